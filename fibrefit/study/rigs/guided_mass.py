"""A mass in a guide that a measured force drives."""

from __future__ import annotations

from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from fibrefit.study.channels import ChannelEntry
from fibrefit.study.quantity import Duration, Gain, MassOrNone, SpeedNoise, refusal
from fibrefit.study.rigs.common import Channels, NoiseLevels, RecordTable, instead, optional
from fibrefit.study.study import Study
from fibrefit.study.table import StudyTable


class GuidedMassConstants(StudyTable):
    """Constants of a mass in a guide that a measured force drives."""

    window: Duration | None = instead("Length of the stretches that are simulated from states of their own.")
    added_mass: MassOrNone | None = optional(
        "Mass added to the moving one; records that differ in it calibrate the force."
    )
    gain: Gain | None = optional("Force on the mass per measured force; 1 when absent.")


class GuidedMassRecord(GuidedMassConstants, RecordTable):
    """One run under a measured force."""


class GuidedMassRig(GuidedMassConstants):
    """``[rig]`` of a guided mass."""

    kind: Literal["guided_mass"]
    driven_by: Literal["force", "position", "nothing"] = Field(
        default="force",
        description="force: a measured one, the motion is explained; position: the measured motion, the force that it "
        "asks for is explained (inverse dynamics); nothing: let go once, a free decay, of which values per mass are "
        "found: hold the mass.",
    )
    measured: Literal["position", "velocity"] = Field(
        default="position", description="What was measured of the motion; velocity: its column is to be named."
    )

    @model_validator(mode="after")
    def _shows_its_place(self) -> Self:
        if self.measured == "velocity" and self.driven_by == "nothing":
            do = "Integrate the velocity to a position, or measure the force that drives the mass."
            raise refusal("a free decay of which the velocity was measured", "a position, which shows the spring", do)
        return self


class GuidedMassChannels(Channels):
    """Channels of a mass in a guide."""

    velocity: ChannelEntry | None = None


class GuidedMassNoise(NoiseLevels):
    """Noise of a mass in a guide."""

    velocity: SpeedNoise | None = None


class GuidedMassStudy(Study):
    """Study of a guided mass."""

    @property
    def variant(self) -> str:
        """``free`` where nothing drives the mass, ``followed`` where its measured motion does; ``by_velocity``."""
        driven = {"nothing": ["free"], "position": ["followed"]}.get(self.rig.driven_by, [])
        return "_".join(driven + ["by_velocity"] * (self.rig.measured == "velocity"))

    @property
    def driven_by_force(self) -> bool:
        """Unless nothing drives the mass."""
        return bool(self.rig.driven_by != "nothing")

    base_parameters: ClassVar[dict[str, str]] = {"mass": "kg", "friction": "N", "force_offset": "N"}
    rig: GuidedMassRig
    channels: GuidedMassChannels = GuidedMassChannels()
    noise: GuidedMassNoise = GuidedMassNoise()
    records: tuple[GuidedMassRecord, ...] = Field(min_length=1)
