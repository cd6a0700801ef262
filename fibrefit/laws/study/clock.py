from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import StudyLaw, quantity


class ClockError(StudyLaw):
    """A logger whose clock, or sampling rate, is not what the study or the file says.

    Law
    ---
    ``t (1 + δ)`` instead of t: with δ > 0 a record lasts longer than it says.

    Valid range
    -----------
    Constant over all records.

    Source
    ------
    Arithmetic.
    """

    name: ClassVar[str] = "study.clock"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE})
    retimes: ClassVar[bool] = True
    error: jax.Array = quantity(
        "-", "relative error of the times that are stated", 0.01, lower=-0.5, upper=1.0, symbol="δ"
    )

    def pace(self) -> jax.Array:
        """1 + δ."""
        return 1.0 + self.error
