from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import StudyLaw, quantity


class WeightMass(StudyLaw):
    """A weight whose mass is not what the study says.

    Law
    ---
    ``m (1 + δ)`` instead of m.

    Valid range
    -----------
    A few percent.

    Source
    ------
    Arithmetic.
    """

    name: ClassVar[str] = "study.weight_mass"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.INCLINE})
    condition: ClassVar[str] = "weight_mass"
    error: jax.Array = quantity(
        "-", "relative error of the mass that is stated", 0.02, lower=-0.5, upper=1.0, symbol="δ"
    )

    def correct(self, conditions: dict[str, jax.Array]) -> dict[str, jax.Array]:
        """``m (1 + δ)`` instead of m."""
        return conditions | {"weight_mass": conditions["weight_mass"] * (1.0 + self.error)}
