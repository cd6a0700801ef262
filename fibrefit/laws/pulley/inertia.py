from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.laws.law import PulleyLaw, quantity


class PulleyInertia(PulleyLaw):
    """Inertia of the pulley, which has to be set in motion.

    Law
    ---
    ``(J/R^2) s'' = T_1 - T_2``; the rim travels s, and the fibre on either side of it stretches by itself.

    Valid range
    -----------
    The fibre does not slip on the rim. A light rim is fast, and followed all the same. The fibre's own mass changes the
    records of a drive almost as a rim of as much mass does (cosine 0.99 of what either changes beyond the base model).

    Source
    ------
    Euler's law of angular momentum.
    """

    name: ClassVar[str] = "pulley.inertia"
    turns: ClassVar[bool] = True
    stiff: ClassVar[bool] = True
    singular: ClassVar[float] = 0.1
    rim_mass: jax.Array = quantity(
        "kg", "inertia of the pulley, as a mass at its rim", 0.05, lower=0.0, upper=5.0, symbol="J/R^2"
    )

    def inertia(self) -> jax.Array:
        """The mass at the rim."""
        return self.rim_mass
