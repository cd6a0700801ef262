"""``[sweep]`` of an inverted pendulum: over which frequencies of the drive, and for which curves."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, StrictStr, model_validator

from fibrefit.study.quantity import Duration, Frequency, refusal
from fibrefit.study.rigs import InvertedPendulum
from fibrefit.study.table import Table

MOST = 20_000
"""Frequencies of one sweep."""


class SweepCurve(InvertedPendulum):
    """One curve: constants that differ from those under ``[rig]``."""

    name: Annotated[StrictStr, Field(min_length=1)] = Field(description="Name of the curve in results.")


class SweepSettings(Table):
    """Frequencies of the drive, how each run is made, and the curves."""

    lowest: Frequency = Field(default=0.5, description="First frequency.")
    highest: Frequency = Field(default=12.0, description="Last frequency.")
    step: Frequency = Field(default=0.05, description="Distance of two frequencies; at most 0.1 Hz near a jump.")
    settle: Duration = Field(default=60.0, description="Longest time a motion is given to settle.")
    sampling_rate: Frequency = Field(default=1000.0, description="Steps of the simulation a second.")
    curves: tuple[SweepCurve, ...] = Field(default=(), description="One curve of the rig's constants when absent.")

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.highest <= self.lowest:
            raise refusal(f"highest {self.highest:g} Hz", f"a value above lowest, {self.lowest:g} Hz", "Swap them.")
        if (self.highest - self.lowest) / self.step > MOST:
            raise refusal(f"step {self.step:g} Hz", f"at most {MOST} frequencies", "Take a larger step.")
        if self.sampling_rate < 20.0 * self.highest:
            rate = 20.0 * self.highest
            raise refusal(f"sampling_rate {self.sampling_rate:g} Hz", f"at least {rate:g} Hz: 20 steps a period", "")
        names = [curve.name for curve in self.curves]
        if len(set(names)) < len(names):
            raise refusal("two curves of one name", "a name of its own for each", "Rename one.")
        return self
