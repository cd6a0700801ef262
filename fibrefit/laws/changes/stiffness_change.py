from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.laws.forms_of_change import ChangeSince, OfStiffness
from fibrefit.laws.law import quantity


class StiffnessChange(ChangeSince, OfStiffness):
    """A stiffness that is another one from one record on.

    Law
    ---
    Elastic tension ``k e (1 + a)`` in that record and all that follow in the study.

    Source
    ------
    Linear elasticity, with two constants.
    """

    name: ClassVar[str] = "fibre.stiffness_change"
    change: jax.Array = quantity("-", "relative change of the stiffness", -0.05, lower=-0.95, upper=5.0, symbol="a")
