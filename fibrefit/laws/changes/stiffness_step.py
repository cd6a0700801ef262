from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.laws.forms_of_change import ChangeAtInstant, OfStiffness
from fibrefit.laws.law import quantity


class StiffnessStep(ChangeAtInstant, OfStiffness):
    """A stiffness that changes at an instant of one record, as when a strand breaks.

    Law
    ---
    Elastic tension ``k e (1 + a)`` from the instant t_s on.

    Source
    ------
    Daniels, Proc. R. Soc. A 183 (1945): a bundle whose threads break one by one.
    """

    name: ClassVar[str] = "fibre.stiffness_step"
    change: jax.Array = quantity("-", "relative change of the stiffness", -0.05, lower=-0.95, upper=5.0, symbol="a")
