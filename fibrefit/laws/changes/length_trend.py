from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.core.declarations import Capability
from fibrefit.laws.forms_of_change import ByRecord
from fibrefit.laws.law import FibreLaw, quantity


class LengthTrend(ByRecord, FibreLaw):
    """A fibre that lengthens from record to record.

    Law
    ---
    Stretch ``e - x (n - 1)`` instead of e in the n-th record of the study.

    Valid range
    -----------
    Records in the order in which they were taken; the height of fall measured from the same mark in all.

    Source
    ------
    Kinematics.
    """

    name: ClassVar[str] = "fibre.length_trend"
    # On the drive rig each record has a zero of its own: nothing would change.
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE, Capability.TAUT_POINT})
    trend: jax.Array = quantity("m", "growth of the free length a record", 1e-4, lower=-0.01, upper=0.01, symbol="x")

    def initial_slack(self) -> jax.Array:
        """The length x (n - 1)."""
        return self.trend
