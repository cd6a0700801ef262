"""Stiffness and damping to first order: in the stretch, and in its rate."""

from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.law import FibreLaw, quantity

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
