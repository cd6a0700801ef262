from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import StudyLaw, quantity


class Gain(StudyLaw):
    """A drive whose force on the mass is not what the study says.

    Law
    ---
    ``g (1 + δ)`` instead of g.

    Valid range
    -----------
    Mass, friction and offset take the error up in full unless they are held.

    Source
    ------
    Arithmetic.
    """

    name: ClassVar[str] = "study.gain"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.PUSH})
    condition: ClassVar[str] = "gain"
    error: jax.Array = quantity(
        "-", "relative error of the gain that is stated", 0.02, lower=-0.5, upper=1.0, symbol="δ"
    )

    def correct(self, conditions: dict[str, jax.Array]) -> dict[str, jax.Array]:
        """``g (1 + δ)`` instead of g."""
        return conditions | {"gain": conditions["gain"] * (1.0 + self.error)}
