from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.laws.law import FibreLaw, quantity


class OtherFibre(FibreLaw):
    """A record that was taken with another fibre than the others.

    Law
    ---
    Elastic tension ``k e (1 + a)`` and viscous tension ``b e' (1 + c)`` in that record.

    Valid range
    -----------
    a, c > -1.

    Source
    ------
    Two fibres, two pairs of constants.
    """

    name: ClassVar[str] = "study.other_fibre"
    family: ClassVar[str] = "in"
    strength: ClassVar[tuple[str, ...]] = ("stiffness_change", "damping_change")
    stiffness_change: jax.Array = quantity(
        "-", "relative change of the stiffness", 0.2, lower=-0.95, upper=20.0, relative=True, symbol="a"
    )
    damping_change: jax.Array = quantity(
        "-", "relative change of the damping", 0.2, lower=-0.95, upper=20.0, relative=True, symbol="c"
    )

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """1 + a."""
        return 1.0 + self.stiffness_change

    def damping_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """1 + c."""
        return 1.0 + self.damping_change
