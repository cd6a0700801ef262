"""An inverted pendulum held by two driven fibres."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, StrictStr, model_validator

from fibrefit.core.limits import MOST_SWEPT
from fibrefit.study.channels import ChannelEntry
from fibrefit.study.quantity import (
    AngleNoise,
    Distance,
    Duration,
    ForceNoise,
    Frequency,
    Inertia,
    Length,
    LengthNoise,
    Load,
    Mass,
    MassOrNone,
    Points,
    refusal,
)
from fibrefit.study.rigs.common import OF_FIBRE_MASS, OF_POINTS, DriveLimits, RecordTable, optional, required
from fibrefit.study.study import Study
from fibrefit.study.table import StudyTable
from fibrefit.study.thresholds import STEPS_A_PERIOD

MOST = 20_000
"""Frequencies of one sweep."""


class InvertedPendulumConstants(StudyTable):
    """Constants of an inverted pendulum held by two driven fibres."""

    rod_length: Length = required("Length of the pendulum, l.")
    rod_mass: Mass = required("Mass of the pendulum, m.")
    moment_of_inertia: Inertia = required("Moment of inertia about the pivot.")
    attachment_height: Length = required("Distance from the pivot to where the fibres are attached, d.")
    anchor_distance: Length = required("Distance from the pivot to each driven end, a.")
    fibre_mass: MassOrNone | None = optional(OF_FIBRE_MASS.format("one fibre"))
    preload: Load | None = optional("Tension of both fibres at rest; none when absent.")
    amplitude: Distance | None = optional("Amplitude of the driven ends, x0.")
    frequency: Frequency | None = optional("Frequency of the driven ends.")


class InvertedPendulumRecord(InvertedPendulumConstants, RecordTable):
    """One run at a frequency."""


class InvertedPendulumRig(InvertedPendulumConstants):
    """``[rig]`` of an inverted pendulum."""

    kind: Literal["inverted_pendulum"]
    masses_per_fibre: Points | None = optional(OF_POINTS)


class PendulumChannels(StudyTable):
    """Channels of an inverted pendulum."""

    time: ChannelEntry | None = None
    angle: ChannelEntry | None = None
    force_1: ChannelEntry | None = None
    force_2: ChannelEntry | None = None
    drive: ChannelEntry | None = None


class PendulumNoise(StudyTable):
    """Noise of an inverted pendulum."""

    angle: AngleNoise | None = None
    force_1: ForceNoise | None = None
    force_2: ForceNoise | None = None
    drive: LengthNoise | None = None


class SweepCurve(InvertedPendulumConstants):
    """One curve: constants that differ from those under ``[rig]``."""

    name: Annotated[StrictStr, Field(min_length=1)] = Field(description="Name of the curve in results.")


class SweepSettings(StudyTable):
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
        if round((range_ := self.highest - self.lowest) / self.step, 6) < 1.0:  # 0.1 to 0.3 Hz is less than 0.2 Hz
            raise refusal(
                f"step {self.step:g} Hz", f"at most {range_:g} Hz, from lowest to highest", "Take a smaller one."
            )
        if range_ / self.step > MOST:
            raise refusal(f"step {self.step:g} Hz", f"at most {MOST} frequencies", "Take a larger step.")
        if self.sampling_rate < (rate := STEPS_A_PERIOD * self.highest):
            raise refusal(
                f"sampling_rate {self.sampling_rate:g} Hz", f"at least {rate:g} Hz: {STEPS_A_PERIOD} steps a period", ""
            )
        # Many runs are simulated at once, each over as many steps as its longest period has.
        steps = self.sampling_rate / self.lowest * (range_ / self.step + 1.0)
        if steps > MOST_SWEPT:
            got = f"{steps:.3g} steps of a period at {self.lowest:g} Hz, in all runs of a curve together"
            do = "Begin at a larger lowest, or take fewer frequencies or a smaller sampling_rate."
            raise refusal(got, f"at most {MOST_SWEPT / 1e6:g} million", do)
        names = [curve.name for curve in self.curves]
        if len(set(names)) < len(names):
            raise refusal("two curves of one name", "a name of its own for each", "Rename one.")
        return self


class InvertedPendulumStudy(Study):
    """Study of an inverted pendulum; without records it can still be swept."""

    base_parameters: ClassVar[dict[str, str]] = {"stiffness": "N/m", "damping": "N s/m"}
    rig: InvertedPendulumRig
    channels: PendulumChannels = PendulumChannels()
    noise: PendulumNoise = PendulumNoise()
    limits: DriveLimits = DriveLimits()
    sweep: SweepSettings = Field(default=SweepSettings(), description="What `fibrefit sweep` goes through.")
    records: tuple[InvertedPendulumRecord, ...] = ()
