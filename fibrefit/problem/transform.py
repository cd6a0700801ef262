"""Free coordinates: every bound is kept by a change of variable, all of them in this file.

A solver moves in coordinates without limits. Each is scaled so that a step of one is a large but sensible change.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.parameter import Parameter


@dataclass(frozen=True)
class Range:
    """Where a free parameter may lie, in SI units, and how it is scaled.

    Parameters
    ----------
    lower, upper : float
        Infinite where there is no limit.
    scale : float
        Typical size.
    log : bool
        Whether it is moved on a logarithmic scale; `lower` must then not be negative.
    """

    lower: float
    upper: float
    scale: float
    log: bool = False

    @classmethod
    def of(cls, parameter: Parameter) -> Range:
        """Range a parameter declares for itself."""
        # One that vanishes at infinity spans decades too.
        log = parameter.log or parameter.reciprocal
        return cls(parameter.lower, parameter.upper, abs(parameter.typical) or 1.0, log)

    def within(self, lower: float | None, upper: float | None) -> Range:
        """The part of the range between limits a person has set."""
        low = self.lower if lower is None else max(self.lower, lower)
        high = self.upper if upper is None else min(self.upper, upper)
        return Range(low, high, self.scale, self.log)

    @property
    def bounded(self) -> tuple[bool, bool]:
        """Whether there is a limit below and above, on the scale it is moved on."""
        low = self.lower > 0.0 if self.log else math.isfinite(self.lower)
        return low, math.isfinite(self.upper)

    def line(self, value: jax.Array) -> jax.Array:
        """Value on the scale it is moved on: its logarithm, or the value in units of `scale`."""
        return jnp.log(value / self.scale) if self.log else value / self.scale

    def from_line(self, position: jax.Array) -> jax.Array:
        """Inverse of `line`."""
        return jnp.exp(position) * self.scale if self.log else position * self.scale

    def value(self, free: jax.Array) -> jax.Array:
        """Value in SI units of a free coordinate.

        Law
        ---
        No limit: y = x. One: y = low + sqrt(x^2 + 1) - 1, which reaches the limit at x = 0. Two:
        y = low + (high - low) / (1 + exp(-4 x / (high - low))), of slope 1 in the middle.
        """
        low, high = self._limits()
        if all(self.bounded):
            width = high - low
            position = low + width * jax.nn.sigmoid(4.0 * free / width)
        elif self.bounded[0]:
            position = low + jnp.sqrt(free**2 + 1.0) - 1.0
        elif self.bounded[1]:
            position = high - jnp.sqrt(free**2 + 1.0) + 1.0
        else:
            position = free
        return self.from_line(position)

    def free(self, value: jax.Array) -> jax.Array:
        """Free coordinate of a value; one at a limit is nudged off it, where the map has no slope."""
        low, high = self._limits()
        position = self.line(value)
        nudge = 1e-4
        if all(self.bounded):
            width = high - low
            share = jnp.clip((position - low) / width, nudge, 1.0 - nudge)
            return 0.25 * width * jnp.log(share / (1.0 - share))
        if self.bounded[0]:
            return jnp.sqrt((jnp.maximum(position - low, nudge) + 1.0) ** 2 - 1.0)
        if self.bounded[1]:
            return jnp.sqrt((jnp.maximum(high - position, nudge) + 1.0) ** 2 - 1.0)
        return position

    def at_bound(self, value: float, tolerance: float) -> bool:
        """Whether `value` lies within `tolerance` (SI) of a limit."""
        return bool(value - self.lower < tolerance or self.upper - value < tolerance)

    def _limits(self) -> tuple[float, float]:
        with np.errstate(divide="ignore"):
            line = lambda v: float(np.log(v / self.scale)) if self.log else v / self.scale  # noqa: E731
            return line(self.lower) if self.bounded[0] else -math.inf, line(self.upper) if self.bounded[1] else math.inf
