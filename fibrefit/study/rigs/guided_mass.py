"""A mass in a guide that a measured force drives."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from fibrefit.study.quantity import Duration, Gain
from fibrefit.study.rigs.common import Channels, NoiseLevels, RecordTable, optional
from fibrefit.study.study import Study
from fibrefit.study.table import Table


class GuidedMassConstants(Table):
    """Constants of a mass in a guide that a measured force drives."""

    window: Duration | None = optional("Length of the stretches that are simulated from states of their own.")
    gain: Gain | None = optional("Force on the mass per measured force; 1 when absent.")


class GuidedMassRecord(GuidedMassConstants, RecordTable):
    """One run under a measured force."""


class GuidedMassRig(GuidedMassConstants):
    """``[rig]`` of a guided mass."""

    kind: Literal["guided_mass"]


class GuidedMassStudy(Study):
    """Study of a guided mass."""

    base_parameters: ClassVar[dict[str, str]] = {"mass": "kg", "friction": "N", "force_offset": "N"}
    rig: GuidedMassRig
    channels: Channels = Channels()
    noise: NoiseLevels = NoiseLevels()
    records: tuple[GuidedMassRecord, ...] = Field(min_length=1)
