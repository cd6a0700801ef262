from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.law import PulleyLaw, quantity

SLIP_SPEED = 1e-4
"""Speed of slipping at which half of the friction acts, in m/s."""


class CapstanFriction(PulleyLaw):
    """A locked pulley over which the fibre slips.

    Law
    ---
    ``T_2 = T_1 exp(-μ φ σ)``, ``σ = v/(|v| + 10^-4 m/s)``; φ is the wrap angle, v the speed of the weight.

    Valid range
    -----------
    A pulley that does not turn; friction that does not hold at rest.

    Source
    ------
    Euler (1769) and Eytelwein (1808).
    """

    name: ClassVar[str] = "pulley.capstan_friction"
    stiff: ClassVar[bool] = True
    speeds: ClassVar[tuple[float, ...]] = tuple(SLIP_SPEED * ratio for ratio in (0.5, 2.0, 8.0, 32.0, 128.0))
    capstan_coefficient: jax.Array = quantity(
        "-", "friction between fibre and pulley", 0.03, lower=0.0, upper=1.0, symbol="μ"
    )

    def grip(self, wrap_angle: jax.Array, velocity: jax.Array) -> jax.Array:
        """exp(-μ φ σ)."""
        slip = velocity / (jnp.abs(velocity) + SLIP_SPEED)
        return jnp.exp(-self.capstan_coefficient * wrap_angle * slip)
