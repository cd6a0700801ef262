from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.laws.law import quantity
from fibrefit.laws.pushes import PushLaw, ahead_of, between_samples


class PushDelay(PushLaw):
    """A force that acts later than it is recorded.

    Law
    ---
    ``F(t - δ)`` pushes.

    Valid range
    -----------
    Shorter than the record; beyond its ends the force is taken as constant.

    Source
    ------
    Controllers that log what they ask for, and loggers whose channels are read in turn.
    """

    name: ClassVar[str] = "push.force_delay"
    delay: jax.Array = quantity(
        "s",
        "time by which the force acts late; negative where it is recorded late",
        1e-3,
        lower=-0.2,
        upper=0.2,
        symbol="δ",
    )

    def applied(self, force: jax.Array, rates: jax.Array, times: jax.Array) -> tuple[jax.Array, jax.Array]:
        """F(t - δ)."""
        return between_samples(force, rates, times, times - self.delay)

    def commanded(self, force: jax.Array, times: jax.Array) -> jax.Array:
        """The force on the mass a delay later."""
        return ahead_of(force, times, self.delay)
