"""What a study says of each kind of rig: constants, records, channels, noise, limits and base parameters.

One mechanism makes the models of a study from `RigKeys`: those of the table here, which say more than a rig declares
and are read without JAX, or those that follow from its declaration.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, StrictStr, create_model, model_validator

from fibrefit.core.declarations import ROLES, declaration_of
from fibrefit.core.limits import MOST_SWEPT
from fibrefit.study import quantity as q
from fibrefit.study.reading import ChannelEntry
from fibrefit.study.records import DriveLimits, RecordTable, RigLimits, no_condition, optional, required
from fibrefit.study.study import Study
from fibrefit.study.table import StudyTable
from fibrefit.study.thresholds import STEPS_A_PERIOD

MOST = 20_000
"""Frequencies of one sweep."""
OF_FIBRE = "Free length of the fibre; kept with the result, not used by the model."
OF_FIBRE_MASS = (
    "Mass of {}; kept with the result, not used by the model: the effect fibre.mass takes its value from "
    '[parameters."fibre.mass.fibre_mass"].'
)
OF_POINTS = (
    "Points of a fibre with a mass of its own, alike in all records; 2 when absent, and 5 where discover, distinguish "
    "or plan look for that mass."
)


class FibreMassConstants(StudyTable):
    """Constants of a weight on one fibre in an inclined guide."""

    weight_mass: q.Mass = required("Mass of the moving weight.")
    added_mass: q.MassOrNone | None = optional("Mass added to the weight.")
    inclination: q.Slope = required("Angle of the guide to the horizontal; 90 deg is free fall.")
    fibre_length: q.Length | None = optional(OF_FIBRE)
    fibre_mass: q.MassOrNone | None = optional(OF_FIBRE_MASS.format("the fibre"))


class FibreMassRecord(FibreMassConstants, RecordTable):
    """One drop: the weight is lifted, held, and let go."""

    lift: q.Distance | None = None
    """Height above the point where the fibre is just taut; found from the data when absent."""
    release: q.Instant | None = no_condition("When the weight was let go; found from the data when absent.")
    position_zero: q.Position | None = no_condition()
    """Reading of the position where the fibre is just taut; found when absent."""


class FibreMassRig(FibreMassConstants):
    """``[rig]`` of a fibre-mass rig."""

    kind: Literal["fibre_mass"]
    masses_per_fibre: q.Points | None = optional(OF_POINTS)
    measured: Literal["force and position", "force"] = "force and position"
    """force: no position was recorded; the lift is found then."""


class FibreMassLimits(RigLimits):
    """What a rig can do in which a weight falls into a fibre."""

    lift: tuple[q.Distance, q.Distance] | None = optional("Height above the point where the fibre is just taut.")
    inclination: tuple[q.Slope, q.Slope] | None = optional("Angle of the guide to the horizontal.")
    added_mass: tuple[q.MassOrNone, q.MassOrNone] | None = optional("Mass added to the weight.")


class DropStudy(Study):
    """Study of a weight that falls into its fibre."""

    @property
    def variant(self) -> str:
        """``force_only`` where no position was measured."""
        return "force_only" if self.rig.measured == "force" else ""


class PulleyDriveConstants(StudyTable):
    """Constants of a weight on an incline, pulled by a drive over a pulley."""

    weight_mass: q.Mass = required("Mass of the moving weight.")
    inclination: q.Angle = required("Angle of the incline to the horizontal.")
    fibre_length: q.Length | None = optional(OF_FIBRE)
    fibre_mass: q.MassOrNone | None = optional(OF_FIBRE_MASS.format("the fibre"))
    pulley_diameter: q.Length | None = optional("Diameter of the pulley; 80 mm when absent.")
    wrap_angle: q.Turn | None = optional("Angle over which the fibre lies on the pulley; 150 deg when absent.")
    lateral_offset: q.Distance | None = optional("Distance of the weight from the plane of the pulley.")
    guide_distance: q.Length | None = optional("Distance along the guide to the foot of the pulley.")
    added_mass: q.MassOrNone | None = optional("Mass added to the weight.")


class PulleyDriveRecord(PulleyDriveConstants, RecordTable):
    """One movement of the drive."""

    excitation: Literal["rectangle", "trapezoid", "quasi_sine"] | None = optional("Shape of the drive's movement.")
    amplitude: q.Length | None = optional("Travel of the drive.")
    rate: q.Speed | None = optional("Speed of the drive.")
    hold: q.Pause | None = optional("Time at rest between movements; of a planned record 0.6 s when absent.")
    position_zero: q.Position | None = no_condition()
    """Reading of the position where the whole fibre is just taut; found when absent."""


class PulleyDriveRig(PulleyDriveConstants):
    """``[rig]`` of a pulley-drive rig."""

    kind: Literal["pulley_drive"]
    masses_per_fibre: q.Points | None = optional(OF_POINTS)


class PulleyDriveLimits(DriveLimits):
    """What a rig can do in which a drive pulls a weight over a pulley."""

    inclination: tuple[q.Angle, q.Angle] | None = optional("Angle of the incline to the horizontal.")
    added_mass: tuple[q.MassOrNone, q.MassOrNone] | None = optional("Mass added to the weight.")


class InvertedPendulumConstants(StudyTable):
    """Constants of an inverted pendulum held by two driven fibres."""

    rod_length: q.Length = required("Length of the pendulum, l.")
    rod_mass: q.Mass = required("Mass of the pendulum, m.")
    moment_of_inertia: q.Inertia = required("Moment of inertia about the pivot.")
    attachment_height: q.Length = required("Distance from the pivot to where the fibres are attached, d.")
    anchor_distance: q.Length = required("Distance from the pivot to each driven end, a.")
    fibre_mass: q.MassOrNone | None = optional(OF_FIBRE_MASS.format("one fibre"))
    preload: q.Load | None = optional("Tension of both fibres at rest; none when absent.")
    amplitude: q.Distance | None = optional("Amplitude of the driven ends, x0.")
    frequency: q.Frequency | None = optional("Frequency of the driven ends.")


class InvertedPendulumRecord(InvertedPendulumConstants, RecordTable):
    """One run at a frequency."""


class InvertedPendulumRig(InvertedPendulumConstants):
    """``[rig]`` of an inverted pendulum."""

    kind: Literal["inverted_pendulum"]
    masses_per_fibre: q.Points | None = optional(OF_POINTS)


class SweepCurve(InvertedPendulumConstants):
    """One curve: constants that differ from those under ``[rig]``."""

    name: Annotated[StrictStr, Field(min_length=1)]
    """Name of the curve in results."""


class SweepSettings(StudyTable):
    """Frequencies of the drive, how each run is made, and the curves."""

    lowest: q.Frequency = 0.5
    """First frequency."""
    highest: q.Frequency = 12.0
    """Last frequency."""
    step: q.Frequency = 0.05
    """Distance of two frequencies; at most 0.1 Hz near a jump."""
    settle: q.Duration = 60.0
    """Longest time a motion is given to settle."""
    sampling_rate: q.Frequency = 1000.0
    """Steps of the simulation a second."""
    curves: tuple[SweepCurve, ...] = ()
    """One curve of the rig's constants when absent."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.highest <= self.lowest:
            raise q.refusal(f"highest {self.highest:g} Hz", f"a value above lowest, {self.lowest:g} Hz", "Swap them.")
        step = f"step {self.step:g} Hz"
        if round((range_ := self.highest - self.lowest) / self.step, 6) < 1.0:  # 0.1 to 0.3 Hz is less than 0.2 Hz
            raise q.refusal(step, f"at most {range_:g} Hz, from lowest to highest", "Take a smaller one.")
        if range_ / self.step > MOST:
            raise q.refusal(step, f"at most {MOST} frequencies", "Take a larger step.")
        if self.sampling_rate < (rate := STEPS_A_PERIOD * self.highest):
            expected = f"at least {rate:g} Hz: {STEPS_A_PERIOD} steps a period"
            raise q.refusal(f"sampling_rate {self.sampling_rate:g} Hz", expected, "")
        # Many runs are simulated at once, each over as many steps as its longest period has.
        steps = self.sampling_rate / self.lowest * (range_ / self.step + 1.0)
        if steps > MOST_SWEPT:
            got = f"{steps:.3g} steps of a period at {self.lowest:g} Hz, in all runs of a curve together"
            do = "Begin at a larger lowest, or take fewer frequencies or a smaller sampling_rate."
            raise q.refusal(got, f"at most {MOST_SWEPT / 1e6:g} million", do)
        names = [curve.name for curve in self.curves]
        if len(set(names)) < len(names):
            raise q.refusal("two curves of one name", "a name of its own for each", "Rename one.")
        return self


class SweptStudy(Study):
    """Study of an inverted pendulum; without records it can still be swept."""

    sweep: SweepSettings = SweepSettings()
    """What `fibrefit sweep` goes through."""


class GuidedMassConstants(StudyTable):
    """Constants of a mass in a guide that a measured force drives."""

    window: q.Duration | None = no_condition("Length of the stretches that are simulated from states of their own.")
    added_mass: q.MassOrNone | None = None
    """Mass added to the moving one; records that differ in it calibrate the force."""
    gain: q.Gain | None = optional("Force on the mass per measured force; 1 when absent.")


class GuidedMassRecord(GuidedMassConstants, RecordTable):
    """One run under a measured force."""


class GuidedMassRig(GuidedMassConstants):
    """``[rig]`` of a guided mass."""

    kind: Literal["guided_mass"]
    driven_by: Literal["force", "position", "nothing"] = "force"
    """force: a measured one, the motion is explained; position: the measured motion, the force that it asks for is
    explained (inverse dynamics); nothing: let go once, a free decay, of which values per mass are found: hold the
    mass."""
    measured: Literal["position", "velocity"] = "position"
    """What was measured of the motion; velocity: its column is to be named."""

    @model_validator(mode="after")
    def _shows_its_place(self) -> Self:
        if self.measured == "velocity" and self.driven_by == "nothing":
            do = "Integrate the velocity to a position, or measure the force that drives the mass."
            raise q.refusal("a free decay of which the velocity was measured", "a position, which shows the spring", do)
        return self


class DrivenMassStudy(Study):
    """Study of a mass that a measured force drives, its measured motion, or nothing."""

    @property
    def variant(self) -> str:
        """``free`` where nothing drives the mass, ``followed`` where its measured motion does; ``by_velocity``."""
        driven = {"nothing": ["free"], "position": ["followed"]}.get(self.rig.driven_by, [])
        return "_".join(driven + ["by_velocity"] * (self.rig.measured == "velocity"))

    @property
    def driven_by_force(self) -> bool:
        """Unless nothing drives the mass."""
        return bool(self.rig.driven_by != "nothing")


class PendulumConstants(StudyTable):
    """Constants of a plain pendulum; without any of them friction and damping are per unit of its inertia."""

    moment_of_inertia: q.Inertia | None = None
    """Moment of inertia about the pivot; 1 kg m^2 when absent; not used where mass and centre_distance are stated."""
    mass: q.Mass | None = None
    """Mass of the pendulum; with centre_distance and the length it gives the moment of inertia, whatever is stated."""
    centre_distance: q.Length | None = optional("Distance of the centre of mass from the pivot.")


class PendulumRecord(PendulumConstants, RecordTable):
    """One swing, from where the pendulum is let go."""


class PendulumRig(PendulumConstants):
    """``[rig]`` of a plain pendulum."""

    kind: Literal["pendulum"]


@dataclass(frozen=True)
class RigKeys:
    """What a study may say of a kind of rig.

    Parameters
    ----------
    study : str
        A sentence on its studies.
    record, rig : type
        Keys of a record, and those under ``[rig]``.
    parameters : mapping of str to str
        SI unit of each parameter of the base model.
    noise : mapping of str to type
        Channels, and the type of the noise of each.
    channel_tables : tuple of str
        Name of the model of channels, and a sentence on it; the same of that of noise.
    limits, base : type
        What further records may be, and a study with what this one says besides.
    may_lack_records : bool
        Whether its study makes sense without any.
    """

    study: str
    record: type[RecordTable]
    rig: type[StudyTable]
    parameters: Mapping[str, str]
    noise: Mapping[str, Any]
    channel_tables: tuple[str, str, str, str]
    limits: type[StudyTable] = StudyTable
    base: type[Study] = Study
    may_lack_records: bool = False


RIG_KEYS: dict[str, RigKeys] = {
    "fibre_mass": RigKeys(
        "Study of a fibre-mass rig.",
        FibreMassRecord,
        FibreMassRig,
        {"stiffness": "N/m", "damping": "N s/m", "friction": "N"},
        {"force": q.ForceNoise, "position": q.LengthNoise},
        (
            "Channels",
            "Column header of each role; found by the headers' own words where absent.",
            "NoiseLevels",
            "Standard deviation of each channel's noise.\n\nWhere absent it is estimated from the records; of planned "
            "ones 0.4 N and 0.02 mm are assumed.",
        ),
        FibreMassLimits,
        DropStudy,
    ),
    "pulley_drive": RigKeys(
        "Study of a pulley-drive rig.",
        PulleyDriveRecord,
        PulleyDriveRig,
        {"stiffness": "N/m", "damping": "N s/m", "friction": "N"},
        {"force": q.ForceNoise, "position": q.LengthNoise, "drive": q.LengthNoise},
        (
            "DriveChannels",
            "Channels of a rig with a measured drive.",
            "DriveNoise",
            "Noise of a rig with a measured drive.",
        ),
        PulleyDriveLimits,
    ),
    "inverted_pendulum": RigKeys(
        "Study of an inverted pendulum; without records it can still be swept.",
        InvertedPendulumRecord,
        InvertedPendulumRig,
        {"stiffness": "N/m", "damping": "N s/m"},
        {"angle": q.AngleNoise, "force_1": q.ForceNoise, "force_2": q.ForceNoise, "drive": q.LengthNoise},
        ("PendulumChannels", "Channels of an inverted pendulum.", "PendulumNoise", "Noise of an inverted pendulum."),
        DriveLimits,
        SweptStudy,
        may_lack_records=True,
    ),
    "guided_mass": RigKeys(
        "Study of a guided mass.",
        GuidedMassRecord,
        GuidedMassRig,
        {"mass": "kg", "friction": "N", "force_offset": "N"},
        {"force": q.ForceNoise, "position": q.LengthNoise, "velocity": q.SpeedNoise},
        ("GuidedMassChannels", "Channels of a mass in a guide.", "GuidedMassNoise", "Noise of a mass in a guide."),
        base=DrivenMassStudy,
    ),
    "pendulum": RigKeys(
        "Study of a plain pendulum.",
        PendulumRecord,
        PendulumRig,
        {"length": "m", "damping": "N m s", "friction": "N m"},
        {"angle": q.AngleNoise},
        ("AngleChannel", "Channels of a plain pendulum.", "PlainPendulumNoise", "Noise of a plain pendulum."),
    ),
}
"""Kinds whose study says more than their rig declares, such as what was not measured, or must be read without JAX."""


@cache
def study_type(kind: str) -> type[Study]:
    """What a study of a kind of rig may say.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    """
    if kind in RIG_KEYS:
        return study_of(kind, RIG_KEYS[kind])
    return study_of(kind, declared_keys(declaration_of(kind)))


def study_of(kind: str, keys: RigKeys) -> type[Study]:
    """Model of the studies of a kind of rig, from what they may say.

    Returns
    -------
    type of Study
        With a key for each constant, under ``[rig]`` or in a record, and one for each channel and its noise.
    """
    channels, of_channels, noise, of_noise = keys.channel_tables
    entries: dict[str, Any] = dict.fromkeys(("time", *keys.noise), (ChannelEntry | None, None))
    levels: dict[str, Any] = {role: (number | None, None) for role, number in keys.noise.items()}
    columns = create_model(channels, __base__=StudyTable, __doc__=of_channels, **entries)
    deviations = create_model(noise, __base__=StudyTable, __doc__=of_noise, **levels)
    tables: dict[str, Any] = {
        "base_parameters": (ClassVar[dict[str, str]], dict(keys.parameters)),
        "rig": (keys.rig, ...),
        "channels": (columns, columns()),
        "noise": (deviations, deviations()),
        "limits": (keys.limits, keys.limits()),
        "records": (tuple[keys.record, ...], () if keys.may_lack_records else Field(min_length=1)),  # type: ignore[name-defined]
    }
    return create_model(f"{_title(kind)}Study", __base__=keys.base, __doc__=keys.study, **tables)


def declared_keys(rig: Any) -> RigKeys:
    """What a study may say of a rig whose declaration says it all: a key for each condition and channel.

    A condition that is typically NaN has to be stated.
    """

    def quantity(unit: str, lower: float = 0.0, upper: float = math.inf, *, above: bool = True) -> Any:
        """Type of a number that is written with its unit, or plainly where it has none."""
        if unit == "-":
            return Annotated[float, Field(gt=lower, le=upper) if above else Field(ge=lower, le=upper)]
        return Annotated[float, q.Unit(unit, f"1 {unit}", lower, upper, lower_allowed=not above)]

    constants: dict[str, Any] = {}
    for condition in rig.conditions:
        unit, doc, value = condition.unit, condition.doc[:1].upper() + condition.doc[1:], condition.typical
        number = quantity(unit, condition.lower, condition.upper, above=condition.lower == 0.0 and value != 0.0)
        absent = f"{doc}; {value:g}{'' if unit == '-' else f' {unit}'} when absent."
        may_be_absent = number | None, optional(absent)
        constants[condition.name] = (number, required(f"{doc}.")) if math.isnan(value) else may_be_absent
    title, said = _title(rig.kind), f"a {rig.kind.replace('_', ' ')}"
    record = create_model(f"{title}Record", __base__=RecordTable, __doc__=f"One record of {said}.", **constants)
    kind: dict[str, Any] = {"kind": (Literal[rig.kind], ...)}
    table = create_model(f"{title}Rig", __base__=StudyTable, __doc__=f"``[rig]`` of {said}.", **kind, **constants)
    return RigKeys(
        f"Study of {said}.",
        record,
        table,
        {parameter.name: parameter.unit for parameter in rig.parameters},
        {role: quantity(ROLES[role]) for role in rig.measured},
        (f"{title}Channels", f"Channels of {said}.", f"{title}Noise", f"Noise of {said}."),
    )


def _title(kind: str) -> str:
    return "".join(word.capitalize() for word in kind.split("_"))
