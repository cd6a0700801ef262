from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.laws.law import GuideLaw, quantity


class Spring(GuideLaw):
    """A spring between the mass in a guide and the ground.

    Law
    ---
    Force ``k (u - u0)`` against the + direction.

    Valid range
    -----------
    Any; the spring pulls and pushes.

    Source
    ------
    Hooke's law.
    """

    name: ClassVar[str] = "guide.spring"
    stands_for: ClassVar[tuple[str, ...]] = ("force_offset",)
    spring_stiffness: jax.Array = quantity(
        "N/m", "stiffness of a spring to ground", 500.0, lower=0.0, upper=1e7, symbol="k"
    )
    spring_zero: jax.Array = quantity(
        "m",
        "position at which the spring is at rest; a constant force moves it alike",
        1e-2,
        lower=-100.0,
        upper=100.0,
        symbol="u0",
    )

    def force(self, position: jax.Array, velocity: jax.Array) -> jax.Array:
        """``k (u - u0)``."""
        return self.spring_stiffness * (position - self.spring_zero)
