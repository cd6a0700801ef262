"""Laws of the fibre: its tension over stretch, rate and time, its free length, its own mass."""

from __future__ import annotations

import functools
from typing import Any, ClassVar

import jax
import jax.numpy as jnp

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import FibreLaw, Memory, quantity

REFERENCE_RATE = 0.1
"""v_ref, in m/s."""


class Hardening(FibreLaw):
    """Stiffness that grows with stretch.

    Law
    ---
    Elastic tension ``k e (1 + η e)``.

    Valid range
    -----------
    |η e| well below 1: the first term of a series in the stretch.

    Source
    ------
    Series expansion of a nonlinear elastic law, e.g. Ogden, Non-Linear Elastic Deformations (1984).
    """

    name: ClassVar[str] = "fibre.hardening"
    hardening: jax.Array = quantity(
        "1/m",
        "relative growth of stiffness per stretch; negative: the fibre softens",
        50.0,
        lower=-150.0,
        upper=2e3,
        symbol="η",
    )

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """1 + η e."""
        return 1.0 + self.hardening * stretch


class RateDependentStiffness(FibreLaw):
    """Stiffness that depends on the rate of stretch.

    Law
    ---
    Elastic tension ``k e (1 + γ |ė|/v_ref)``, ``v_ref`` = 0.1 m/s.

    Valid range
    -----------
    1 + γ |ė|/v_ref positive at the rates that occur.

    Source
    ------
    Series expansion about zero rate; polymers and coated fibres stiffen with strain rate.
    """

    name: ClassVar[str] = "fibre.rate_dependent_stiffness"
    stiffness_rate_factor: jax.Array = quantity(
        "-", "relative change of stiffness at 0.1 m/s of stretching", 0.03, lower=-0.1, upper=2.0, symbol="γ"
    )

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """1 + γ |ė|/v_ref."""
        return 1.0 + self.stiffness_rate_factor * jnp.abs(rate) / REFERENCE_RATE


class RateDependentDamping(FibreLaw):
    """Damping that depends on the rate of stretch.

    Law
    ---
    Viscous tension ``b ė max(0.05, 1 + β |ė|/v_ref)``, ``v_ref`` = 0.1 m/s.

    Valid range
    -----------
    The floor of 5 % keeps a fibre whose damping falls with speed from feeding energy in.

    Source
    ------
    Series expansion of a nonlinear dashpot about zero rate.
    """

    name: ClassVar[str] = "fibre.rate_dependent_damping"
    damping_rate_factor: jax.Array = quantity(
        "-", "relative change of damping at 0.1 m/s of stretching", 0.5, lower=-1.0, upper=20.0, symbol="β"
    )

    def damping_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """max(0.05, 1 + β |ė|/v_ref)."""
        return jnp.maximum(0.05, 1.0 + self.damping_rate_factor * jnp.abs(rate) / REFERENCE_RATE)


class ToeRegion(FibreLaw):
    """A fibre that is soft until its strands have straightened.

    Law
    ---
    Elastic tension ``k e (1 - ϑ exp(-e/λ))``.

    Valid range
    -----------
    0 ≤ ϑ < 1; λ below the largest stretch, else it is hardening.

    Source
    ------
    The toe of ropes and tendons, e.g. Fung, Biomechanics (1993), ch. 7.
    """

    name: ClassVar[str] = "fibre.toe_region"
    toe_depth: jax.Array = quantity(
        "-", "share of stiffness missing at small stretch", 0.4, lower=0.0, upper=0.98, symbol="ϑ"
    )
    toe_length: jax.Array = quantity(
        "m", "stretch over which it recovers", 5e-4, lower=2e-5, upper=2e-2, log=True, symbol="λ"
    )

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """1 - ϑ exp(-e/λ); a slack fibre, whose stretch is negative, has no say."""
        return 1.0 - self.toe_depth * jnp.exp(-jnp.maximum(stretch, 0.0) / self.toe_length)


class Hysteresis(FibreLaw):
    """Rate-independent hysteresis of strands that rub on each other.

    Law
    ---
    ``+ k_h z``, ``z' = ė - β |ė| z - γ ė |z|``; z = 0 while slack.

    Valid range
    -----------
    |γ| ≤ β, else a loop may release energy.

    Source
    ------
    Bouc (1967) and Wen, J. Eng. Mech. Div. 102 (1976) 249-263.
    """

    name: ClassVar[str] = "fibre.hysteresis"
    memory: ClassVar[tuple[str, ...]] = ("hysteretic_stretch",)
    forgets: ClassVar[bool] = True
    hysteretic_stiffness: jax.Array = quantity(
        "N/m", "stiffness of the rubbing part", 3e3, lower=0.0, upper=1e6, symbol="k_h"
    )
    beta: jax.Array = quantity("1/m", "loop shape: dissipation", 600.0, lower=5.0, upper=3e3, log=True, symbol="β")
    gamma: jax.Array = quantity(
        "1/m", "loop shape: difference of loading and unloading", 300.0, lower=-2e3, upper=2e3, symbol="γ"
    )

    def tension(self, stiffness: jax.Array, stretch: jax.Array, rate: jax.Array, memory: Memory) -> jax.Array:
        """k_h z."""
        return self.hysteretic_stiffness * memory[0]

    def memory_rate(self, stretch: jax.Array, rate: jax.Array, memory: Memory, slack: jax.Array) -> Memory:
        """Rate of z."""
        (z,) = memory
        change = rate - self.beta * jnp.abs(rate) * z - self.gamma * rate * jnp.abs(z)
        return (jnp.where(slack, 0.0, change),)

    def when_slack(self, memory: Memory) -> Memory:
        """A slack fibre has forgotten."""
        return (jnp.zeros_like(memory[0]),)


class Creep(FibreLaw):
    """A fibre that creeps: under load it lengthens, and stays so.

    Law
    ---
    ``- k r z``, ``z' = max(e - r z, 0)``: the whole fibre in series with a dashpot k/r.

    Valid range
    -----------
    Creep within one record; what came before it is part of the free length.

    Source
    ------
    The Maxwell body, e.g. Flügge, Viscoelasticity (1975), ch. 1.
    """

    name: ClassVar[str] = "fibre.creep"
    memory: ClassVar[tuple[str, ...]] = ("stretch_over_time",)
    creep_rate: jax.Array = quantity(
        "1/s", "rate of creep over the elastic stretch", 0.05, lower=0.0, upper=50.0, symbol="r"
    )

    def tension(self, stiffness: jax.Array, stretch: jax.Array, rate: jax.Array, memory: Memory) -> jax.Array:
        """- k r z."""
        return -stiffness * self.creep_rate * memory[0]

    def memory_rate(self, stretch: jax.Array, rate: jax.Array, memory: Memory, slack: jax.Array) -> Memory:
        """Rate of z."""
        return (jnp.maximum(stretch - self.creep_rate * memory[0], 0.0),)


class MaxwellBranch(FibreLaw):
    """Maxwell element parallel to the fibre (standard linear solid): tension that relaxes.

    Law
    ---
    ``+ k_1 (e - q)``, ``q' = (e - q)/τ``; while slack ``q' = -q/τ``.

    Valid range
    -----------
    τ from the sampling interval to the length of a record; a shorter one is damping, a longer one stiffness.

    Source
    ------
    The standard linear solid, e.g. Flügge, Viscoelasticity (1975), ch. 1.
    """

    name: ClassVar[str] = "fibre.maxwell_branch"
    memory: ClassVar[tuple[str, ...]] = ("dashpot_stretch",)
    branch_stiffness: jax.Array = quantity(
        "N/m", "stiffness of the relaxing branch", 3e3, lower=0.0, upper=1e6, symbol="k_1"
    )
    relaxation_time: jax.Array = quantity(
        "s", "time in which it relaxes", 0.02, lower=5e-4, upper=10.0, log=True, symbol="τ"
    )

    def tension(self, stiffness: jax.Array, stretch: jax.Array, rate: jax.Array, memory: Memory) -> jax.Array:
        """k_1 (e - q)."""
        return self.branch_stiffness * (stretch - memory[0])

    def memory_at_rest(self, stretch: jax.Array) -> Memory:
        """Relaxed: q = e."""
        return (jnp.maximum(stretch, 0.0),)

    def memory_rate(self, stretch: jax.Array, rate: jax.Array, memory: Memory, slack: jax.Array) -> Memory:
        """Creep of the dashpot."""
        return ((jnp.maximum(stretch, 0.0) - memory[0]) / self.relaxation_time,)


class FreeLengthOffset(FibreLaw):
    """A fibre that is longer or shorter than its nominal length.

    Law
    ---
    Stretch ``e - e_0`` instead of e.

    Valid range
    -----------
    Any; small against the length of the fibre.

    Source
    ------
    Kinematics.
    """

    name: ClassVar[str] = "fibre.free_length_offset"
    # On the drive rig the tension at the start is known, and the zero of position is not: nothing would change.
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE, Capability.TAUT_POINT})
    length_offset: jax.Array = quantity(
        "m",
        "excess of the free length over the nominal one; negative: a preload",
        2e-4,
        lower=-0.02,
        upper=0.02,
        symbol="e_0",
    )

    def initial_slack(self) -> jax.Array:
        """e_0."""
        return self.length_offset


class PointMasses(FibreLaw):
    """The fibre's own mass, as points between springs.

    Law
    ---
    n points of mass ``m_f/n`` between n + 1 equal segments of the fibre, each of which obeys the law of the whole at
    n + 1 times its own stretch, and pulls only. Without damping the lowest frequency is about ``sqrt(k/m_f)/2``.

    Valid range
    -----------
    Any number of points: what is too fast for the sampling dies out. Motion across the fibre is left out. Weigh the
    fibre and hold its mass: what a record tells of it is over within a sampling interval.

    Source
    ------
    Lumped elastic rod; the point-mass fibres of Polach and Václavík (docs/rigs.md).
    """

    name: ClassVar[str] = "fibre.mass"
    excludes: ClassVar[tuple[str, ...]] = ("pulley.inertia", "pulley.bearing_friction", "drive.compliance")
    stiff: ClassVar[bool] = True
    singular: ClassVar[float] = 0.1
    points: ClassVar[int] = 2
    """Number of points, n."""
    fibre_mass: jax.Array = quantity("kg", "mass of the fibre", 5e-3, lower=0.0, upper=10.0, symbol="m_f")


@functools.cache
def point_masses(number: int) -> type[PointMasses]:
    """The same effect with another number of points.

    Parameters
    ----------
    number : int
        At least 1.
    """

    class Points(PointMasses):
        __doc__ = PointMasses.__doc__
        points: ClassVar[int] = number
        _made_of: ClassVar[tuple[Any, ...]] = (PointMasses, number)

    return Points
