from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.laws.forms_of_change import ChangeAtInstant, OfFriction
from fibrefit.laws.law import quantity


class FrictionStep(ChangeAtInstant, OfFriction):
    """Friction that changes at an instant of one record, as when dirt gets into the guide.

    Law
    ---
    Level ``F_c (1 + a)`` from the instant t_s on.

    Source
    ------
    Armstrong-Hélouvry, Dupont and Canudas de Wit, Automatica 30 (1994) 1083-1138, on friction that does not repeat.
    """

    name: ClassVar[str] = "guide.friction_step"
    change: jax.Array = quantity("-", "relative change of Coulomb friction", 0.5, lower=-0.95, upper=20.0, symbol="a")
