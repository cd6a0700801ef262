from __future__ import annotations

from typing import ClassVar, Self

import jax

from fibrefit.laws.law import FibreLaw, Moment, quantity


class LengthDrift(FibreLaw):
    """A fibre that lengthens steadily while a record lasts.

    Law
    ---
    Stretch ``e - w t`` instead of e, t from the first sample.

    Valid range
    -----------
    Lengthening that does not depend on the load; where it does, see `fibre.creep`.

    Source
    ------
    Kinematics.
    """

    name: ClassVar[str] = "fibre.length_drift"
    timed: ClassVar[bool] = True
    drift: jax.Array = quantity("m/s", "growth of the free length over time", 1e-4, lower=-0.05, upper=0.05, symbol="w")

    def as_of(self, moment: Moment) -> Self:
        """What has come together by then."""
        return self.scaled(moment.time)

    def initial_slack(self) -> jax.Array:
        """The length w t."""
        return self.drift
