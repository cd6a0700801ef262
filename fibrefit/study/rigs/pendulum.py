"""A plain pendulum that is let go once."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from fibrefit.study.channels import ChannelEntry
from fibrefit.study.quantity import AngleNoise, Inertia, Length, Mass
from fibrefit.study.rigs.common import RecordTable, optional
from fibrefit.study.study import Study
from fibrefit.study.table import StudyTable


class PendulumConstants(StudyTable):
    """Constants of a plain pendulum; without any of them friction and damping are per unit of its inertia."""

    moment_of_inertia: Inertia | None = optional(
        "Moment of inertia about the pivot; 1 kg m^2 when absent; not used where mass and centre_distance are stated."
    )
    mass: Mass | None = optional(
        "Mass of the pendulum; with centre_distance and the length it gives the moment of inertia, whatever is stated."
    )
    centre_distance: Length | None = optional("Distance of the centre of mass from the pivot.")


class PendulumRecord(PendulumConstants, RecordTable):
    """One swing, from where the pendulum is let go."""


class PendulumRig(PendulumConstants):
    """``[rig]`` of a plain pendulum."""

    kind: Literal["pendulum"]


class AngleChannel(StudyTable):
    """Channels of a plain pendulum."""

    time: ChannelEntry | None = None
    angle: ChannelEntry | None = None


class PlainPendulumNoise(StudyTable):
    """Noise of a plain pendulum."""

    angle: AngleNoise | None = None


class PendulumStudy(Study):
    """Study of a plain pendulum."""

    base_parameters: ClassVar[dict[str, str]] = {"length": "m", "damping": "N m s", "friction": "N m"}
    rig: PendulumRig
    channels: AngleChannel = AngleChannel()
    noise: PlainPendulumNoise = PlainPendulumNoise()
    records: tuple[PendulumRecord, ...] = Field(min_length=1)
