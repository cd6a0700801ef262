from __future__ import annotations

from typing import ClassVar, Self

import jax
import jax.numpy as jnp

from fibrefit.laws.law import FibreLaw, Moment, quantity


class StiffnessDrift(FibreLaw):
    """A stiffness that grows or fades while a record lasts.

    Law
    ---
    Elastic tension ``k e (1 + a (1 - exp(-t/τ)))``, t from the first sample.

    Parameters
    ----------
    drift : () a pure number
        a, what it comes to.
    settling_time : () in s
        τ; long against the record, the change is a steady one.

    Valid range
    -----------
    τ from some samples on; of a much longer one, only a/τ is known.

    Source
    ------
    Approach to a new state; e.g. heating of polymer fibres under cyclic load.
    """

    name: ClassVar[str] = "fibre.stiffness_drift"
    timed: ClassVar[bool] = True
    drift: jax.Array = quantity("-", "relative change of the stiffness in the end", -0.05, lower=-0.98, upper=20.0)
    settling_time: jax.Array = quantity("s", "time in which it settles", 1.0, lower=0.01, upper=100.0, log=True)

    def as_of(self, moment: Moment) -> Self:
        """What has come together by then."""
        return self.scaled(-jnp.expm1(-moment.time / self.settling_time))

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """1 + a (1 - exp(-t/τ))."""
        return 1.0 + self.drift
