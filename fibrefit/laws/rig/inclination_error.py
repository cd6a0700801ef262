from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import RigLaw, quantity


class InclinationError(RigLaw):
    """A guide whose slope is not quite what was noted.

    Law
    ---
    ``α + δ`` instead of α.

    Valid range
    -----------
    A few degrees. Records do not tell it from `study.inclination`, which a search tries; this one is tried where it is
    named.

    Source
    ------
    Kinematics.
    """

    name: ClassVar[str] = "rig.inclination_error"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.INCLINE})
    angle: jax.Array = quantity("rad", "error of the noted inclination", 0.01, lower=-0.1, upper=0.1, symbol="δ")

    def correct(self, conditions: dict[str, jax.Array]) -> dict[str, jax.Array]:
        """α + δ."""
        return conditions | {"inclination": conditions["inclination"] + self.angle}
