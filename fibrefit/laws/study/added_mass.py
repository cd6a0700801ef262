from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import StudyLaw, quantity


class AddedMass(StudyLaw):
    """A mass added to the weight that is not what the study says.

    Law
    ---
    ``m_a (1 + δ)`` instead of m_a.

    Valid range
    -----------
    Records of which some have a mass added, and some another or none.

    Source
    ------
    Arithmetic.
    """

    name: ClassVar[str] = "study.added_mass"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.INCLINE})
    condition: ClassVar[str] = "added_mass"
    error: jax.Array = quantity(
        "-", "relative error of the added mass that is stated", 0.05, lower=-1.0, upper=2.0, symbol="δ"
    )

    def correct(self, conditions: dict[str, jax.Array]) -> dict[str, jax.Array]:
        """``m_a (1 + δ)`` instead of m_a."""
        return conditions | {"added_mass": conditions["added_mass"] * (1.0 + self.error)}
