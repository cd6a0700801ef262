from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import StudyLaw, quantity


class WrapAngle(StudyLaw):
    """A pulley that the fibre lies on over another angle than the study says.

    Law
    ---
    ``φ (1 + δ)`` instead of φ.

    Valid range
    -----------
    With friction on the pulley; its coefficient takes the error up in full.

    Source
    ------
    Arithmetic.
    """

    name: ClassVar[str] = "study.wrap_angle"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.PULLEY})
    condition: ClassVar[str] = "wrap_angle"
    needs: ClassVar[tuple[str, ...]] = ("pulley.capstan_friction",)
    error: jax.Array = quantity(
        "-", "relative error of the angle that is stated", 0.05, lower=-0.5, upper=1.0, symbol="δ"
    )

    def correct(self, conditions: dict[str, jax.Array]) -> dict[str, jax.Array]:
        """``φ (1 + δ)`` instead of φ."""
        return conditions | {"wrap_angle": conditions["wrap_angle"] * (1.0 + self.error)}
