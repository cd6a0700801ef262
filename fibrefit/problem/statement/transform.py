"""Free coordinates: every bound is kept by a change of variable, all of them in this file.

A solver moves in coordinates without limits. Each is scaled so that a step of one is a large but sensible change.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from fibrefit.core.parameter import Parameter
from fibrefit.problem.statement.arrays import functions_for

NUDGE = 1e-4
"""Least distance from a limit at which a start is put: in units of the scale, or of the logarithm."""


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
        size = abs(parameter.typical)
        return cls(parameter.lower, parameter.upper, size if math.isfinite(size) and size > 0.0 else 1.0, log)

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

    def line(self, value: Any) -> Any:
        """Value on the scale it is moved on: its logarithm, or the value in units of `scale`."""
        return functions_for(value).log(value / self.scale) if self.log else value / self.scale

    def from_line(self, position: Any) -> Any:
        """Inverse of `line`."""
        return functions_for(position).exp(position) * self.scale if self.log else position * self.scale

    def value(self, free: Any) -> Any:
        """Value in SI units of a free coordinate.

        Law
        ---
        No limit: y = x. One: y = low + sqrt(x^2 + 1) - 1, which reaches the limit at x = 0. Two:
        y = low + (high - low) / (1 + exp(-4 x / (high - low))), of slope 1 in the middle.
        """
        low, high = self._limits()
        xp = functions_for(free)
        if all(self.bounded):
            width = high - low
            # The logistic curve in a form that neither overflows nor loses digits at its foot.
            position = low + width * xp.exp(-xp.logaddexp(0.0, -4.0 * free / width))
        elif self.bounded[0]:
            position = low + xp.sqrt(free**2 + 1.0) - 1.0
        elif self.bounded[1]:
            position = high - xp.sqrt(free**2 + 1.0) + 1.0
        else:
            position = free
        return self.from_line(position)

    def free(self, value: Any) -> Any:
        """Free coordinate of a value; one nearer to a limit than `NUDGE` is put that far off, for want of a slope."""
        low, high = self._limits()
        position = self.line(value)
        xp = functions_for(position)
        if all(self.bounded):
            width = high - low
            share = xp.clip((position - low) / width, NUDGE / width, 1.0 - NUDGE / width)
            return 0.25 * width * xp.log(share / (1.0 - share))
        if self.bounded[0]:
            return xp.sqrt((xp.maximum(position - low, NUDGE) + 1.0) ** 2 - 1.0)
        if self.bounded[1]:
            return xp.sqrt((xp.maximum(high - position, NUDGE) + 1.0) ** 2 - 1.0)
        return position

    def at_bound(self, value: float, tolerance: float) -> bool:
        """Whether `value` lies within `tolerance` (SI) of a limit."""
        return bool(value - self.lower < tolerance or self.upper - value < tolerance)

    def _limits(self) -> tuple[float, float]:
        with np.errstate(divide="ignore"):
            line = lambda v: float(np.log(v / self.scale)) if self.log else v / self.scale  # noqa: E731
            return line(self.lower) if self.bounded[0] else -math.inf, line(self.upper) if self.bounded[1] else math.inf
