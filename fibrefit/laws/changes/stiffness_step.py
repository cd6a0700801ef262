from __future__ import annotations

from typing import ClassVar, Self

import jax

from fibrefit.laws.law import INSTANTS, FibreLaw, Moment, quantity


class StiffnessStep(FibreLaw):
    """A stiffness that changes at an instant of one record, as when a strand breaks.

    Law
    ---
    Elastic tension ``k e (1 + a)`` from the instant t_s on.

    Parameters
    ----------
    change : () a pure number
        a.
    instant : () a pure number
        t_s over the length of the record.

    Valid range
    -----------
    a > -1.

    Source
    ------
    Daniels, Proc. R. Soc. A 183 (1945): a bundle whose threads break one by one.
    """

    name: ClassVar[str] = "fibre.stiffness_step"
    timed: ClassVar[bool] = True
    sudden: ClassVar[bool] = True
    family: ClassVar[str] = "in"
    change: jax.Array = quantity("-", "relative change of the stiffness", -0.05, lower=-0.95, upper=5.0)
    instant: jax.Array = quantity(
        "-", "share of the record after which it happens", 0.5, lower=0.0, upper=1.0, starts=INSTANTS
    )

    def as_of(self, moment: Moment) -> Self:
        """Nothing before the instant."""
        return self.scaled(moment.past)

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """1 + a."""
        return 1.0 + self.change
