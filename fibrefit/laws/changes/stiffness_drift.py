from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.laws.forms_of_change import OfStiffness, SettlingChange
from fibrefit.laws.law import quantity


class StiffnessDrift(SettlingChange, OfStiffness):
    """A stiffness that grows or fades while a record lasts.

    Law
    ---
    Elastic tension ``k e (1 + a (1 - exp(-t/τ)))``, t from the first sample.

    Source
    ------
    Approach to a new state; e.g. heating of polymer fibres under cyclic load.
    """

    name: ClassVar[str] = "fibre.stiffness_drift"
    drift: jax.Array = quantity(
        "-", "relative change of the stiffness in the end", -0.05, lower=-0.98, upper=20.0, symbol="a"
    )
