"""Laws that change: at an instant, from one record on, with time, with use, or from record to record.

A law is of one form, which says when its change comes, and of one thing that is changed by it.
"""

from __future__ import annotations

from typing import Any, ClassVar, Self

import jax
import jax.numpy as jnp

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import ALWAYS_LEFT, INSTANTS, Effect, FibreLaw, GuideLaw, Memory, Moment, quantity


class Change(Effect):
    """A change of something, which a law names and limits."""

    def amount(self) -> jax.Array:
        """How much it comes to: of friction and stiffness over what they are without the law, of a length in m."""
        strength: jax.Array = getattr(self, self.strength[0])
        return strength


class AtInstant(Effect):
    """At an instant of one record."""

    timed: ClassVar[bool] = True
    sudden: ClassVar[bool] = True
    family: ClassVar[str] = "in"

    def as_of(self, moment: Moment) -> Self:
        """Nothing before the instant."""
        return self.scaled(moment.past)


class WhileItLasts(Effect):
    """While a record lasts, to what it settles at."""

    timed: ClassVar[bool] = True
    drift: jax.Array = quantity("-", "relative change in the end", 0.5, symbol="a")
    settling_time: jax.Array = quantity(
        "s", "time in which it settles", 1.0, lower=0.01, upper=100.0, log=True, symbol="τ"
    )

    def as_of(self, moment: Moment) -> Self:
        """What has come together by then."""
        return self.scaled(-jnp.expm1(-moment.time / self.settling_time))


class ByRecord(Effect):
    """Evenly from record to record."""

    def in_record(self, number: jax.Array, duration: jax.Array) -> Self:
        """What has come together by then; the first record is as the base model says."""
        return self.scaled(number - 1.0)


class ByStretching(FibreLaw):
    """With the path of stretching to and fro within a record."""

    memory: ClassVar[tuple[str, ...]] = ("stretching",)

    def memory_rate(self, stretch: jax.Array, rate: jax.Array, memory: Memory, slack: jax.Array) -> Memory:
        """|e'| while the fibre carries."""
        return (jnp.where(slack, 0.0, jnp.abs(rate)),)


class OfFriction(Change, GuideLaw):
    """Change of the level of Coulomb friction."""

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """The relative change times F_c."""
        return self.amount() * coulomb


class OfStiffness(Change, FibreLaw):
    """Change of the stiffness."""

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """One and the relative change."""
        return 1.0 + self.amount()


class OfLength(Change, FibreLaw):
    """Change of the free length."""

    def initial_slack(self) -> jax.Array:
        """By how much the fibre is longer."""
        return self.amount()


def _instant() -> Any:
    """The parameter by which a sudden law tells when it happens."""
    says = "share of the record after which it happens"
    return quantity("-", says, 0.5, lower=0.0, upper=1.0, starts=INSTANTS, symbol="t_s")


class FrictionChange(OfFriction):
    """Friction that is another one from one record on.

    Law
    ---
    Level ``F_c (1 + a)`` in that record and all that follow in the study.

    Valid range
    -----------
    a > -1.

    Source
    ------
    Coulomb friction, with two levels.
    """

    name: ClassVar[str] = "guide.friction_change"
    family: ClassVar[str] = "since"
    change: jax.Array = quantity("-", "relative change of Coulomb friction", 0.5, lower=-0.95, upper=20.0, symbol="a")


class FrictionStep(AtInstant, OfFriction):
    """Friction that changes at an instant of one record, as when dirt gets into the guide.

    Law
    ---
    Level ``F_c (1 + a)`` from the instant t_s on.

    Valid range
    -----------
    a > -1.

    Source
    ------
    Armstrong-Hélouvry, Dupont and Canudas de Wit, Automatica 30 (1994) 1083-1138, on friction that does not repeat.
    """

    name: ClassVar[str] = "guide.friction_step"
    change: jax.Array = quantity("-", "relative change of Coulomb friction", 0.5, lower=-0.95, upper=20.0, symbol="a")
    instant: jax.Array = _instant()


class FrictionDrift(WhileItLasts, OfFriction):
    """Friction that grows or falls while a record lasts, as in a guide that warms up.

    Law
    ---
    Level ``F_c (1 + a (1 - exp(-t/τ)))``, t from the first sample.

    Valid range
    -----------
    τ from some samples on; of a much longer one, only a/τ is known.

    Source
    ------
    Approach to a new state; warming lubricants: Bittencourt and Gunnarsson, J. Dyn. Syst. Meas. Control 134
    (2012) 051013.
    """

    name: ClassVar[str] = "guide.friction_drift"
    drift: jax.Array = quantity(
        "-", "relative change of Coulomb friction in the end", -0.3, lower=-0.98, upper=20.0, symbol="a"
    )


class FrictionTrend(ByRecord, OfFriction):
    """Friction that grows or falls from record to record, as in a guide that is run in.

    Law
    ---
    Level ``F_c max(0.02, 1 + a (n - 1))`` in the n-th record of the study.

    Valid range
    -----------
    Records that stand in the study in the order in which they were taken.

    Source
    ------
    First term of a series in the number of the test; running-in: Blau, Wear 155 (1992) 29-43.
    """

    name: ClassVar[str] = "guide.friction_trend"
    trend: jax.Array = quantity(
        "-", "relative growth of Coulomb friction a record", 0.1, lower=-0.3, upper=5.0, symbol="a"
    )

    def amount(self) -> jax.Array:
        """max(0.02, 1 + a (n - 1)) - 1."""
        return jnp.maximum(ALWAYS_LEFT - 1.0, self.trend)


class FrictionWear(OfFriction):
    """Friction that grows or falls with the path travelled, as surfaces run in or wear.

    Law
    ---
    Level ``F_c (1 + a (1 - exp(-s/σ)))``, s the path of the weight to and fro within the record.

    Valid range
    -----------
    σ from some millimetres on; of a much longer one, only a/σ is known.

    Source
    ------
    Wear over sliding distance: Archard, J. Appl. Phys. 24 (1953) 981-988.
    """

    name: ClassVar[str] = "guide.friction_wear"
    # A path is counted from where a record begins; in windows that begin anew there is none.
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.GUIDE, Capability.FIBRE})
    timed: ClassVar[bool] = True
    history: ClassVar[tuple[str, ...]] = ("path",)
    wear: jax.Array = quantity(
        "-", "relative change of Coulomb friction in the end", 0.3, lower=-0.98, upper=20.0, symbol="a"
    )
    path: jax.Array = quantity("m", "path on which it settles", 0.1, lower=2e-3, upper=100.0, log=True, symbol="σ")

    def as_of(self, moment: Moment) -> Self:
        """What has come together by then."""
        return self.scaled(-jnp.expm1(-moment.path / self.path))


class StiffnessChange(OfStiffness):
    """A stiffness that is another one from one record on.

    Law
    ---
    Elastic tension ``k e (1 + a)`` in that record and all that follow in the study.

    Valid range
    -----------
    a > -1.

    Source
    ------
    Linear elasticity, with two constants.
    """

    name: ClassVar[str] = "fibre.stiffness_change"
    family: ClassVar[str] = "since"
    change: jax.Array = quantity("-", "relative change of the stiffness", -0.05, lower=-0.95, upper=5.0, symbol="a")


class StiffnessStep(AtInstant, OfStiffness):
    """A stiffness that changes at an instant of one record, as when a strand breaks.

    Law
    ---
    Elastic tension ``k e (1 + a)`` from the instant t_s on.

    Valid range
    -----------
    a > -1.

    Source
    ------
    Daniels, Proc. R. Soc. A 183 (1945): a bundle whose threads break one by one.
    """

    name: ClassVar[str] = "fibre.stiffness_step"
    change: jax.Array = quantity("-", "relative change of the stiffness", -0.05, lower=-0.95, upper=5.0, symbol="a")
    instant: jax.Array = _instant()


class StiffnessDrift(WhileItLasts, OfStiffness):
    """A stiffness that grows or fades while a record lasts.

    Law
    ---
    Elastic tension ``k e (1 + a (1 - exp(-t/τ)))``, t from the first sample.

    Valid range
    -----------
    τ from some samples on; of a much longer one, only a/τ is known.

    Source
    ------
    Approach to a new state; e.g. heating of polymer fibres under cyclic load.
    """

    name: ClassVar[str] = "fibre.stiffness_drift"
    drift: jax.Array = quantity(
        "-", "relative change of the stiffness in the end", -0.05, lower=-0.98, upper=20.0, symbol="a"
    )


class StiffnessTrend(ByRecord, FibreLaw):
    """A stiffness that grows or fades from record to record.

    Law
    ---
    Elastic tension ``k e max(0.02, 1 + a (n - 1))`` in the n-th record of the study.

    Valid range
    -----------
    Records that stand in the study in the order in which they were taken.

    Source
    ------
    First term of a series in the number of the test.
    """

    name: ClassVar[str] = "fibre.stiffness_trend"
    trend: jax.Array = quantity(
        "-", "relative growth of the stiffness a record", -0.01, lower=-0.3, upper=1.0, symbol="a"
    )

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """max(0.02, 1 + a (n - 1))."""
        return jnp.maximum(ALWAYS_LEFT, 1.0 + self.trend)


class StiffnessWear(ByStretching):
    """A stiffness that grows or fades with use, load cycle by load cycle.

    Law
    ---
    ``+ k e a s``, s the path of stretching to and fro within the record: ``s' = |e'|``
    while it carries; a cycle of amplitude A adds 4 A.

    Valid range
    -----------
    |a s| well below 1.

    Source
    ------
    Damage that adds up over cycles: Miner, J. Appl. Mech. 12 (1945) A159-A164.
    """

    name: ClassVar[str] = "fibre.stiffness_wear"
    wear: jax.Array = quantity(
        "1/m", "relative growth of the stiffness over the path of stretching", -0.5, lower=-5.0, upper=50.0, symbol="a"
    )

    def tension(self, stiffness: jax.Array, stretch: jax.Array, rate: jax.Array, memory: Memory) -> jax.Array:
        """Elastic tension times a s."""
        return stiffness * stretch * self.wear * memory[0]


class LengthChange(OfLength):
    """A fibre that is longer or shorter from one record on.

    Law
    ---
    Stretch ``e - x`` instead of e in that record and all that follow in the study.

    Valid range
    -----------
    The height of fall is measured from the same mark in all records.

    Source
    ------
    Kinematics.
    """

    name: ClassVar[str] = "fibre.length_change"
    # On the drive rig each record has a zero of its own: nothing would change.
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE, Capability.TAUT_POINT})
    family: ClassVar[str] = "since"
    change: jax.Array = quantity("m", "growth of the free length", 2e-4, lower=-0.02, upper=0.02, symbol="x")


class KnotSlip(AtInstant, OfLength):
    """A knot that slips: all at once the fibre is longer.

    Law
    ---
    Stretch ``e - x`` instead of e from the instant t_s on, in one record.

    Valid range
    -----------
    A slip that takes less time than a few samples.

    Source
    ------
    Kinematics.
    """

    name: ClassVar[str] = "fibre.knot_slip"
    slip: jax.Array = quantity(
        "m", "length the knot gives; negative: it has caught", 3e-4, lower=-0.05, upper=0.05, symbol="x"
    )
    instant: jax.Array = _instant()


class LengthDrift(OfLength):
    """A fibre that lengthens steadily while a record lasts.

    Law
    ---
    Stretch ``e - w t`` instead of e, t from the first sample.

    Valid range
    -----------
    Lengthening that does not depend on the load; where it does, see `fibre.creep`.

    Source
    ------
    Kinematics.
    """

    name: ClassVar[str] = "fibre.length_drift"
    timed: ClassVar[bool] = True
    drift: jax.Array = quantity("m/s", "growth of the free length over time", 1e-4, lower=-0.05, upper=0.05, symbol="w")

    def as_of(self, moment: Moment) -> Self:
        """What has come together by then."""
        return self.scaled(moment.time)


class LengthTrend(ByRecord, OfLength):
    """A fibre that lengthens from record to record.

    Law
    ---
    Stretch ``e - x (n - 1)`` instead of e in the n-th record of the study.

    Valid range
    -----------
    Records in the order in which they were taken; the height of fall measured from the same mark in all.

    Source
    ------
    Kinematics.
    """

    name: ClassVar[str] = "fibre.length_trend"
    # On the drive rig each record has a zero of its own: nothing would change.
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE, Capability.TAUT_POINT})
    trend: jax.Array = quantity("m", "growth of the free length a record", 1e-4, lower=-0.01, upper=0.01, symbol="x")


class Setting(ByStretching):
    """A fibre that sets: its free length grows with use, load cycle by load cycle.

    Law
    ---
    ``- k x s``, s the path of stretching to and fro within the record: ``s' = |e'|`` while it carries.

    Valid range
    -----------
    Small against the stretch.

    Source
    ------
    Bedding in of ropes, e.g. Feyrer, Wire Ropes (2015), ch. 2.
    """

    name: ClassVar[str] = "fibre.setting"
    setting: jax.Array = quantity(
        "-", "growth of the free length over the path of stretching", 2e-3, lower=0.0, upper=0.5, symbol="x"
    )

    def tension(self, stiffness: jax.Array, stretch: jax.Array, rate: jax.Array, memory: Memory) -> jax.Array:
        """- k x s."""
        return -stiffness * self.setting * memory[0]
