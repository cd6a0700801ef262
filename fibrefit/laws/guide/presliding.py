from __future__ import annotations

import math
from typing import ClassVar

import jax

from fibrefit.core.declarations import inverse_of
from fibrefit.laws.law import GuideLaw, quantity


class Presliding(GuideLaw):
    """Presliding, as of LuGre's bristles: the weight moves a little before it breaks away.

    Law
    ---
    Friction ``σ_0 z + σ_1 z'`` with ``z' = v - σ_0 |v| z/level(v)`` instead of one that is there at once; the level is
    that of all other laws of the guide. Without damping this is Dahl's law.

    Valid range
    -----------
    Moves before break-away, level/σ_0, that the position channel can see: micrometres and more.

    Source
    ------
    Canudas de Wit, Olsson, Åström and Lischinsky, IEEE Trans. Automatic Control 40 (1995) 419-425.
    """

    name: ClassVar[str] = "guide.presliding"
    creeps: ClassVar[bool] = True
    stiff: ClassVar[bool] = True
    singular: ClassVar[float] = 0.1
    # The bristles follow the faster, the faster the weight: from step to step by no more than a factor.
    speeds: ClassVar[tuple[float, ...]] = (5e-4, 2e-3, 8e-3, 32e-3, 128e-3)
    bristle_stiffness: jax.Array = quantity(
        "N/m",
        "stiffness of the guide before it breaks away",
        2e5,
        lower=1e3,
        null=math.inf,
        reciprocal=True,
        symbol="σ_0",
    )
    bristle_damping: jax.Array = quantity("N s/m", "damping of the bristles", 50.0, lower=0.0, upper=1e4, symbol="σ_1")

    def compliance(self) -> jax.Array:
        """1/σ_0."""
        return inverse_of(self.bristle_stiffness)

    def bristle_damping_coefficient(self) -> jax.Array:
        """The damping σ_1."""
        return self.bristle_damping
