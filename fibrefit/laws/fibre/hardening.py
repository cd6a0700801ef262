from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.laws.law import FibreLaw, quantity


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
