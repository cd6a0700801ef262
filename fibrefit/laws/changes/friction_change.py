from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.laws.forms_of_change import ChangeSince, OfFriction
from fibrefit.laws.law import quantity


class FrictionChange(ChangeSince, OfFriction):
    """Friction that is another one from one record on.

    Law
    ---
    Level ``F_c (1 + a)`` in that record and all that follow in the study.

    Source
    ------
    Coulomb friction, with two levels.
    """

    name: ClassVar[str] = "guide.friction_change"
    change: jax.Array = quantity("-", "relative change of Coulomb friction", 0.5, lower=-0.95, upper=20.0, symbol="a")
