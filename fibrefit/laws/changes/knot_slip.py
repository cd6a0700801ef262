from __future__ import annotations

from typing import ClassVar, Self

import jax

from fibrefit.laws.law import INSTANTS, FibreLaw, Moment, quantity


class KnotSlip(FibreLaw):
    """A knot that slips: all at once the fibre is longer.

    Law
    ---
    Stretch ``e - x`` instead of e from the instant t_s on, in one record.

    Valid range
    -----------
    A slip that takes less time than a few samples.

    Source
    ------
    Kinematics.
    """

    name: ClassVar[str] = "fibre.knot_slip"
    timed: ClassVar[bool] = True
    sudden: ClassVar[bool] = True
    family: ClassVar[str] = "in"
    slip: jax.Array = quantity(
        "m", "length the knot gives; negative: it has caught", 3e-4, lower=-0.05, upper=0.05, symbol="x"
    )
    instant: jax.Array = quantity(
        "-", "share of the record after which it happens", 0.5, lower=0.0, upper=1.0, starts=INSTANTS, symbol="t_s"
    )

    def as_of(self, moment: Moment) -> Self:
        """Nothing before the instant."""
        return self.scaled(moment.past)

    def initial_slack(self) -> jax.Array:
        """``x``."""
        return self.slip
