"""What a study says about each kind of rig: its constants, its records, its channels.

Every constant may stand under ``[rig]`` or in a record, and a record overrides the rig. The fields are therefore
optional for the file; `needed` marks those that `load_study` refuses to do without once both places have been read.
"""

from __future__ import annotations

from typing import Any, Literal, Self

from pydantic import Field, StrictStr, model_validator

from fibrefit.study.quantity import (
    Angle,
    AngleNoise,
    Distance,
    Duration,
    ForceNoise,
    Frequency,
    Gain,
    Inertia,
    Instant,
    Length,
    LengthNoise,
    Load,
    Mass,
    MassOrNone,
    Pause,
    Points,
    Position,
    Speed,
    Turn,
    refusal,
)
from fibrefit.study.table import Table


def needed(description: str) -> Any:
    """Field that must stand under ``[rig]`` or in each record."""
    return Field(default=None, description=description, json_schema_extra={"x-needed": True})


def optional(description: str) -> Any:
    """Field that may be absent."""
    return Field(default=None, description=description)


class Record(Table):
    """What all records have in common: a measured file, or the conditions of one that is planned."""

    file: StrictStr | None = optional("Measured data; relative to the study file.")
    name: StrictStr | None = optional("Name in results; the file's name when absent.")
    sampling_rate: Frequency | None = optional("Where the file has no time column, or no file exists yet.")
    duration: Duration | None = optional("Length of a planned record.")

    @property
    def label(self) -> str:
        """Name of the record in results and messages."""
        return self.name or self.file or ""

    @model_validator(mode="after")
    def _measured_or_planned(self) -> Self:
        if self.file is None and None in (self.name, self.sampling_rate, self.duration):
            raise refusal("no file", "a file, or name, sampling_rate and duration of a planned record", "")
        return self


class FibreMass(Table):
    """Constants of a weight on one fibre in an inclined guide."""

    weight_mass: Mass = needed("Mass of the moving weight.")
    inclination: Angle = needed("Angle of the guide to the horizontal; 90 deg is free fall.")
    fibre_length: Length | None = optional("Free length of the fibre.")
    fibre_mass: MassOrNone | None = optional("Mass of the fibre.")
    masses_per_fibre: Points | None = optional("Points of a fibre with a mass of its own; 2 when absent.")


class FibreMassRecord(FibreMass, Record):
    """One drop: the weight is lifted, held, and let go."""

    lift: Distance | None = optional("Height above the point where the fibre is just taut.")
    release: Instant | None = optional("When the weight was let go; found from the data when absent.")
    position_zero: Position | None = optional(
        "Reading of the position where the fibre is just taut; found when absent."
    )


class FibreMassRig(FibreMass):
    """``[rig]`` of a fibre-mass rig."""

    kind: Literal["fibre_mass"]


class PulleyDrive(Table):
    """Constants of a weight on an incline, pulled by a drive over a pulley."""

    weight_mass: Mass = needed("Mass of the moving weight.")
    inclination: Angle = needed("Angle of the incline to the horizontal.")
    fibre_length: Length | None = optional("Free length of the fibre.")
    fibre_mass: MassOrNone | None = optional("Mass of the fibre.")
    masses_per_fibre: Points | None = optional("Points of a fibre with a mass of its own; 2 when absent.")
    pulley_diameter: Length | None = optional("Diameter of the pulley.")
    wrap_angle: Turn | None = optional("Angle over which the fibre lies on the pulley.")
    lateral_offset: Distance | None = optional("Distance of the weight from the plane of the pulley.")
    guide_distance: Length | None = optional("Distance along the guide to the foot of the pulley.")
    added_mass: MassOrNone | None = optional("Mass added to the weight.")


class PulleyDriveRecord(PulleyDrive, Record):
    """One movement of the drive."""

    excitation: Literal["rectangle", "trapezoid", "quasi_sine"] | None = optional("Shape of the drive's movement.")
    amplitude: Length | None = optional("Travel of the drive.")
    rate: Speed | None = optional("Speed of the drive.")
    hold: Pause | None = optional("Time at rest between movements.")


class PulleyDriveRig(PulleyDrive):
    """``[rig]`` of a pulley-drive rig."""

    kind: Literal["pulley_drive"]


class InvertedPendulum(Table):
    """Constants of an inverted pendulum held by two driven fibres."""

    rod_length: Length = needed("Length of the pendulum, l.")
    rod_mass: Mass = needed("Mass of the pendulum, m.")
    moment_of_inertia: Inertia = needed("Moment of inertia about the pivot.")
    attachment_height: Length = needed("Distance from the pivot to where the fibres are attached, d.")
    anchor_distance: Length = needed("Distance from the pivot to each driven end, a.")
    fibre_mass: MassOrNone | None = optional("Mass of one fibre.")
    preload: Load | None = optional("Tension of both fibres at rest; none when absent.")
    amplitude: Distance | None = optional("Amplitude of the driven ends, x0.")
    frequency: Frequency | None = optional("Frequency of the driven ends.")
    masses_per_fibre: Points | None = optional("Points of each fibre with a mass of its own; 2 when absent.")


class InvertedPendulumRecord(InvertedPendulum, Record):
    """One run at a frequency."""


class InvertedPendulumRig(InvertedPendulum):
    """``[rig]`` of an inverted pendulum."""

    kind: Literal["inverted_pendulum"]


class GuidedMass(Table):
    """Constants of a mass in a guide that a measured force drives."""

    window: Duration | None = optional("Length of the stretches that are simulated from states of their own.")
    gain: Gain | None = optional("Force on the mass per measured force; 1 when absent.")


class GuidedMassRecord(GuidedMass, Record):
    """One run under a measured force."""


class GuidedMassRig(GuidedMass):
    """``[rig]`` of a guided mass."""

    kind: Literal["guided_mass"]


class Channels(Table):
    """Column header of each role; found by the headers' own words where absent."""

    time: StrictStr | None = None
    force: StrictStr | None = None
    position: StrictStr | None = None


class DriveChannels(Channels):
    """Channels of a rig with a measured drive."""

    drive: StrictStr | None = None


class PendulumChannels(Table):
    """Channels of an inverted pendulum."""

    time: StrictStr | None = None
    angle: StrictStr | None = None
    force_1: StrictStr | None = None
    force_2: StrictStr | None = None
    drive: StrictStr | None = None


class Noise(Table):
    """Standard deviation of each channel's noise; estimated from the records where absent."""

    force: ForceNoise | None = None
    position: LengthNoise | None = None


class DriveNoise(Noise):
    """Noise of a rig with a measured drive."""

    drive: LengthNoise | None = None


class PendulumNoise(Table):
    """Noise of an inverted pendulum."""

    angle: AngleNoise | None = None
    force_1: ForceNoise | None = None
    force_2: ForceNoise | None = None
    drive: LengthNoise | None = None


#: Parameters of the base model of each rig, with their SI unit.
BASE_PARAMETERS = {
    "fibre_mass": {"stiffness": "N/m", "damping": "N s/m", "friction": "N"},
    "pulley_drive": {"stiffness": "N/m", "damping": "N s/m", "friction": "N"},
    "inverted_pendulum": {"stiffness": "N/m", "damping": "N s/m"},
    "guided_mass": {"mass": "kg", "friction": "N", "force_offset": "N"},
}
