from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.laws.forms_of_change import OfFriction, SettlingChange
from fibrefit.laws.law import quantity


class FrictionDrift(SettlingChange, OfFriction):
    """Friction that grows or falls while a record lasts, as in a guide that warms up.

    Law
    ---
    Level ``F_c (1 + a (1 - exp(-t/τ)))``, t from the first sample.

    Source
    ------
    Approach to a new state; warming lubricants: Bittencourt and Gunnarsson, J. Dyn. Syst. Meas. Control 134
    (2012) 051013.
    """

    name: ClassVar[str] = "guide.friction_drift"
    drift: jax.Array = quantity(
        "-", "relative change of Coulomb friction in the end", -0.3, lower=-0.98, upper=20.0, symbol="a"
    )
