"""A pulley whose rim moves by itself: its inertia, and a bearing that rubs."""

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


class BearingFriction(PulleyLaw):
    """A pulley whose bearing rubs, and holds it at rest.

    Law
    ---
    ``- F_b Sign(s')`` on the rim, which has the mass that `pulley.inertia` gives it, else 0.05 kg.

    Valid range
    -----------
    The fibre does not slip on the rim.

    Source
    ------
    Coulomb friction, as of the guide.
    """

    name: ClassVar[str] = "pulley.bearing_friction"
    turns: ClassVar[bool] = True
    rubs: ClassVar[bool] = True
    stiff: ClassVar[bool] = True
    # With the least friction comes the whole mass of a rim.
    singular: ClassVar[float] = 1.0
    bearing_friction: jax.Array = quantity(
        "N", "friction of the pulley's bearing at the rim", 1.0, lower=0.0, upper=100.0, symbol="F_b"
    )

    def rubbing(self) -> jax.Array:
        """F_b."""
        return self.bearing_friction
