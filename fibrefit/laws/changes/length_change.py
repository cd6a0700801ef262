from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import FibreLaw, quantity


class LengthChange(FibreLaw):
    """A fibre that is longer or shorter from one record on.

    Law
    ---
    Stretch ``e - x`` instead of e in that record and all that follow in the study.

    Valid range
    -----------
    The height of fall is measured from the same mark in all records.

    Source
    ------
    Kinematics.
    """

    name: ClassVar[str] = "fibre.length_change"
    # On the drive rig each record has a zero of its own: nothing would change.
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE, Capability.TAUT_POINT})
    family: ClassVar[str] = "since"
    change: jax.Array = quantity("m", "growth of the free length", 2e-4, lower=-0.02, upper=0.02, symbol="x")

    def initial_slack(self) -> jax.Array:
        """``x``."""
        return self.change
