"""A weight on an incline, pulled by a drive over a pulley."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from fibrefit.study.channels import ChannelEntry
from fibrefit.study.quantity import (
    Angle,
    Distance,
    Length,
    LengthNoise,
    Mass,
    MassOrNone,
    Pause,
    Points,
    Position,
    Speed,
    Turn,
)
from fibrefit.study.rigs.common import (
    OF_FIBRE_MASS,
    OF_POINTS,
    Channels,
    DriveLimits,
    NoiseLevels,
    RecordTable,
    instead,
    optional,
    required,
)
from fibrefit.study.study import Study
from fibrefit.study.table import StudyTable


class PulleyDriveConstants(StudyTable):
    """Constants of a weight on an incline, pulled by a drive over a pulley."""

    weight_mass: Mass = required("Mass of the moving weight.")
    inclination: Angle = required("Angle of the incline to the horizontal.")
    fibre_length: Length | None = optional("Free length of the fibre; kept with the result, not used by the model.")
    fibre_mass: MassOrNone | None = optional(OF_FIBRE_MASS.format("the fibre"))
    pulley_diameter: Length | None = optional("Diameter of the pulley; 80 mm when absent.")
    wrap_angle: Turn | None = optional("Angle over which the fibre lies on the pulley; 150 deg when absent.")
    lateral_offset: Distance | None = optional("Distance of the weight from the plane of the pulley.")
    guide_distance: Length | None = optional("Distance along the guide to the foot of the pulley.")
    added_mass: MassOrNone | None = optional("Mass added to the weight.")


class PulleyDriveRecord(PulleyDriveConstants, RecordTable):
    """One movement of the drive."""

    excitation: Literal["rectangle", "trapezoid", "quasi_sine"] | None = optional("Shape of the drive's movement.")
    amplitude: Length | None = optional("Travel of the drive.")
    rate: Speed | None = optional("Speed of the drive.")
    hold: Pause | None = optional("Time at rest between movements; of a planned record 0.6 s when absent.")
    position_zero: Position | None = instead(
        "Reading of the position where the whole fibre is just taut; found when absent."
    )


class PulleyDriveRig(PulleyDriveConstants):
    """``[rig]`` of a pulley-drive rig."""

    kind: Literal["pulley_drive"]
    masses_per_fibre: Points | None = optional(OF_POINTS)


class DriveChannels(Channels):
    """Channels of a rig with a measured drive."""

    drive: ChannelEntry | None = None


class DriveNoise(NoiseLevels):
    """Noise of a rig with a measured drive."""

    drive: LengthNoise | None = None


class PulleyDriveLimits(DriveLimits):
    """What a rig can do in which a drive pulls a weight over a pulley."""

    inclination: tuple[Angle, Angle] | None = optional("Angle of the incline to the horizontal.")
    added_mass: tuple[MassOrNone, MassOrNone] | None = optional("Mass added to the weight.")


class PulleyDriveStudy(Study):
    """Study of a pulley-drive rig."""

    base_parameters: ClassVar[dict[str, str]] = {"stiffness": "N/m", "damping": "N s/m", "friction": "N"}
    rig: PulleyDriveRig
    channels: DriveChannels = DriveChannels()
    noise: DriveNoise = DriveNoise()
    limits: PulleyDriveLimits = PulleyDriveLimits()
    records: tuple[PulleyDriveRecord, ...] = Field(min_length=1)
