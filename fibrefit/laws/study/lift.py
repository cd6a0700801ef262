from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import StudyLaw, quantity


class Lift(StudyLaw):
    """A weight that falls from another height than the study says.

    Law
    ---
    ``h + δ`` instead of h, in all records.

    Valid range
    -----------
    The same error in all records.

    Source
    ------
    Arithmetic.
    """

    name: ClassVar[str] = "study.lift"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FALL})
    condition: ClassVar[str] = "lift"
    error: jax.Array = quantity("m", "error of the height that is stated", 0.0002, lower=-0.05, upper=0.05, symbol="δ")

    def correct(self, conditions: dict[str, jax.Array]) -> dict[str, jax.Array]:
        """``h + δ`` instead of h, in all records."""
        return conditions | {"lift": conditions["lift"] + self.error}
