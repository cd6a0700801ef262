"""A stiffness that grows or fades while a record lasts."""

from __future__ import annotations

from typing import ClassVar, Self

import jax
import jax.numpy as jnp

from fibrefit.effects.law import LEAST, FibreLaw, Moment, quantity


class StiffnessDrift(FibreLaw):
    """A stiffness that grows or fades while a record lasts.

    Law
    ---
    Elastic tension ``k e max(0.02, 1 + a t)``, t from the first sample.

    Parameters
    ----------
    drift : () in 1/s
        a.

    Valid range
    -----------
    Records short against the time in which it would come to rest.

    Source
    ------
    First term of a series in time; e.g. heating of polymer fibres under cyclic load.
    """

    name: ClassVar[str] = "fibre.stiffness_drift"
    timed: ClassVar[bool] = True
    drift: jax.Array = quantity("1/s", "relative growth of the stiffness over time", -0.03, lower=-2.0, upper=5.0)

    def as_of(self, moment: Moment) -> Self:
        """What has come together by then."""
        return self.scaled(moment.time)

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """max(0.02, 1 + a t)."""
        return jnp.maximum(LEAST, 1.0 + self.drift)
