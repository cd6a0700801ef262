from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import StudyLaw, quantity


class Inclination(StudyLaw):
    """A guide whose slope is not what the study says.

    Law
    ---
    ``α + δ`` instead of α.

    Valid range
    -----------
    A few degrees; straight down it shows in its square only.

    Source
    ------
    Arithmetic.
    """

    name: ClassVar[str] = "study.inclination"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.INCLINE})
    condition: ClassVar[str] = "inclination"
    error: jax.Array = quantity("rad", "error of the slope that is stated", 0.01, lower=-0.2, upper=0.2, symbol="δ")

    def correct(self, conditions: dict[str, jax.Array]) -> dict[str, jax.Array]:
        """``α + δ`` instead of α."""
        return conditions | {"inclination": conditions["inclination"] + self.error}
