"""All effects the program knows by name, and the way to one of a user's own."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path
from typing import Protocol

from fibrefit.core.declarations import Capability
from fibrefit.core.errors import StudyError, as_one, did_you_mean
from fibrefit.laws.changes.friction_change import FrictionChange
from fibrefit.laws.changes.friction_drift import FrictionDrift
from fibrefit.laws.changes.friction_step import FrictionStep
from fibrefit.laws.changes.friction_trend import FrictionTrend
from fibrefit.laws.changes.friction_wear import FrictionWear
from fibrefit.laws.changes.knot_slip import KnotSlip
from fibrefit.laws.changes.length_change import LengthChange
from fibrefit.laws.changes.length_drift import LengthDrift
from fibrefit.laws.changes.length_trend import LengthTrend
from fibrefit.laws.changes.setting import Setting
from fibrefit.laws.changes.stiffness_change import StiffnessChange
from fibrefit.laws.changes.stiffness_drift import StiffnessDrift
from fibrefit.laws.changes.stiffness_step import StiffnessStep
from fibrefit.laws.changes.stiffness_trend import StiffnessTrend
from fibrefit.laws.changes.stiffness_wear import StiffnessWear
from fibrefit.laws.contract import violations
from fibrefit.laws.declared import KINDS
from fibrefit.laws.drive.compliance import Compliance
from fibrefit.laws.drive.play import Play
from fibrefit.laws.families import MARK, called_with_place, family_of
from fibrefit.laws.fibre.creep import Creep
from fibrefit.laws.fibre.free_length_offset import FreeLengthOffset
from fibrefit.laws.fibre.hardening import Hardening
from fibrefit.laws.fibre.hysteresis import Hysteresis
from fibrefit.laws.fibre.maxwell_branch import MaxwellBranch
from fibrefit.laws.fibre.point_masses import PointMasses, point_masses
from fibrefit.laws.fibre.rate_dependent_damping import RateDependentDamping
from fibrefit.laws.fibre.rate_dependent_stiffness import RateDependentStiffness
from fibrefit.laws.fibre.toe_region import ToeRegion
from fibrefit.laws.functions_of_speed import (
    DampingPowerLaw,
    DampingSpeedCurve,
    DampingSpeedExponent,
    FrictionPowerLaw,
    FrictionSpeedCurve,
    FrictionSpeedExponent,
    StiffnessPowerLaw,
    StiffnessSpeedCurve,
    StiffnessSpeedExponent,
)
from fibrefit.laws.guide.asymmetric_friction import AsymmetricFriction
from fibrefit.laws.guide.asymmetric_viscous_friction import AsymmetricViscousFriction
from fibrefit.laws.guide.friction_over_position import FrictionOverPosition
from fibrefit.laws.guide.load_dependent_friction import LoadDependentFriction
from fibrefit.laws.guide.loose_mass import LooseMass
from fibrefit.laws.guide.presliding import Presliding
from fibrefit.laws.guide.quadratic_drag import QuadraticDrag
from fibrefit.laws.guide.spring import Spring
from fibrefit.laws.guide.stribeck_friction import StribeckFriction
from fibrefit.laws.guide.viscous_friction import ViscousFriction
from fibrefit.laws.law import Effect
from fibrefit.laws.own import checked, from_file, from_package, is_effect
from fibrefit.laws.pivot.quadratic_damping import QuadraticDamping
from fibrefit.laws.pulley.bearing_friction import BearingFriction
from fibrefit.laws.pulley.capstan_friction import CapstanFriction
from fibrefit.laws.pulley.eccentricity import Eccentricity
from fibrefit.laws.pulley.inertia import PulleyInertia
from fibrefit.laws.push.force_delay import PushDelay
from fibrefit.laws.push.force_gain import PushGain
from fibrefit.laws.push.force_lag import PushLag
from fibrefit.laws.push.hold import PushHold
from fibrefit.laws.rig.inclination_error import InclinationError
from fibrefit.laws.sensor.acceleration_crosstalk import AccelerationCrosstalk
from fibrefit.laws.sensor.dial_gauge_force import DialGaugeForce
from fibrefit.laws.sensor.force_delay import ForceDelay
from fibrefit.laws.sensor.force_drift import ForceDrift
from fibrefit.laws.sensor.force_gain import ForceGain
from fibrefit.laws.sensor.force_lag import ForceLag
from fibrefit.laws.sensor.force_offset import ForceOffset
from fibrefit.laws.sensor.gauge_nonlinearity import GaugeNonlinearity
from fibrefit.laws.sensor.gauge_resonance import GaugeResonance
from fibrefit.laws.sensor.position_gain import PositionGain
from fibrefit.laws.sensor.position_ripple import PositionRipple
from fibrefit.laws.study.added_mass import AddedMass
from fibrefit.laws.study.clock import ClockError
from fibrefit.laws.study.gain import Gain
from fibrefit.laws.study.inclination import Inclination
from fibrefit.laws.study.lift import Lift
from fibrefit.laws.study.other_fibre import OtherFibre
from fibrefit.laws.study.weight_mass import WeightMass
from fibrefit.laws.study.wrap_angle import WrapAngle

ENTRY_POINTS = "fibrefit.effects"
"""Group under which an installed package offers effects of its own."""


@dataclass(frozen=True)
class CatalogueEntry:
    """An effect, and what a search for what a model lacks has to know of it.

    Parameters
    ----------
    effect : Effect class
    sought : frozenset of Capability or None
        What a rig must have, besides what the effect acts on, for a search to try it unrequested; None where
        only a person asks for it.
    costly : bool
        Whether it is tried after all others, as it takes longer than all of them: where they leave more than noise, or
        slopes predict of it half of what was found.
    alike : tuple of str
        Effects that records do not tell from it where a search does not try them.
    alternative : frozenset of Capability or None
        What a rig must have besides for a fit that leaves more than noise to be held against the same model with this
        law, which other values are taken for; None where a fit is not.
    """

    effect: type[Effect]
    sought: frozenset[Capability] | None = frozenset()
    costly: bool = False
    alike: tuple[str, ...] = ()
    alternative: frozenset[Capability] | None = None


_BY_A_FIBRE = frozenset({Capability.FIBRE})

_ENTRIES: tuple[CatalogueEntry, ...] = (
    CatalogueEntry(ViscousFriction, alternative=_BY_A_FIBRE),
    CatalogueEntry(StribeckFriction, alternative=_BY_A_FIBRE),
    CatalogueEntry(LoadDependentFriction, alternative=_BY_A_FIBRE),
    CatalogueEntry(QuadraticDrag),
    CatalogueEntry(AsymmetricFriction),
    CatalogueEntry(AsymmetricViscousFriction),
    CatalogueEntry(Presliding),
    CatalogueEntry(QuadraticDamping),
    CatalogueEntry(Spring, sought=None),
    CatalogueEntry(FrictionOverPosition, sought=frozenset({Capability.PUSH})),
    CatalogueEntry(PushDelay, alike=("push.force_lag", "push.hold")),
    CatalogueEntry(PushLag, sought=None),
    CatalogueEntry(PushHold, sought=None),
    CatalogueEntry(PushGain, sought=None),
    CatalogueEntry(FrictionSpeedCurve, sought=None),
    CatalogueEntry(FrictionPowerLaw, sought=None),
    CatalogueEntry(FrictionSpeedExponent, sought=None),
    CatalogueEntry(Hardening, alternative=_BY_A_FIBRE),
    CatalogueEntry(ToeRegion),
    CatalogueEntry(MaxwellBranch, alternative=_BY_A_FIBRE),
    CatalogueEntry(RateDependentDamping, alternative=_BY_A_FIBRE),
    CatalogueEntry(RateDependentStiffness),
    CatalogueEntry(StiffnessSpeedCurve, sought=None),
    CatalogueEntry(StiffnessPowerLaw, sought=None),
    CatalogueEntry(StiffnessSpeedExponent, sought=None),
    CatalogueEntry(DampingSpeedCurve, sought=None),
    CatalogueEntry(DampingPowerLaw, sought=None),
    CatalogueEntry(DampingSpeedExponent, sought=None),
    CatalogueEntry(Hysteresis, alternative=_BY_A_FIBRE),
    CatalogueEntry(FreeLengthOffset, alike=("study.lift",)),
    CatalogueEntry(Creep),
    CatalogueEntry(StiffnessDrift),
    CatalogueEntry(StiffnessTrend),
    CatalogueEntry(StiffnessWear),
    CatalogueEntry(StiffnessChange),
    CatalogueEntry(StiffnessStep, costly=True),
    CatalogueEntry(LengthDrift),
    CatalogueEntry(LengthTrend),
    CatalogueEntry(LengthChange),
    CatalogueEntry(Setting),
    CatalogueEntry(KnotSlip, costly=True),
    CatalogueEntry(FrictionDrift),
    CatalogueEntry(FrictionTrend),
    CatalogueEntry(FrictionWear),
    CatalogueEntry(FrictionChange),
    CatalogueEntry(FrictionStep, costly=True),
    CatalogueEntry(LooseMass, costly=True),
    CatalogueEntry(PointMasses, sought=frozenset({Capability.FALL}), costly=True),
    CatalogueEntry(PulleyInertia, alike=("fibre.mass",)),
    CatalogueEntry(BearingFriction),
    CatalogueEntry(CapstanFriction),
    CatalogueEntry(Eccentricity),
    CatalogueEntry(Compliance),
    CatalogueEntry(Play),
    CatalogueEntry(ForceGain, alternative=_BY_A_FIBRE),
    CatalogueEntry(ForceOffset),
    CatalogueEntry(ForceDrift),
    CatalogueEntry(ForceDelay, alternative=_BY_A_FIBRE),
    CatalogueEntry(ForceLag),
    CatalogueEntry(GaugeResonance),
    CatalogueEntry(PositionGain, sought=frozenset({Capability.FIBRE}), alternative=_BY_A_FIBRE),
    CatalogueEntry(DialGaugeForce),
    CatalogueEntry(GaugeNonlinearity),
    CatalogueEntry(AccelerationCrosstalk),
    CatalogueEntry(PositionRipple, sought=frozenset({Capability.FIBRE}), costly=True),
    CatalogueEntry(InclinationError, sought=None),
    CatalogueEntry(WeightMass, alternative=_BY_A_FIBRE),
    CatalogueEntry(AddedMass),
    CatalogueEntry(Inclination, alike=("rig.inclination_error",), alternative=_BY_A_FIBRE),
    CatalogueEntry(Lift, sought=None, alternative=_BY_A_FIBRE),
    CatalogueEntry(WrapAngle, sought=None),
    CatalogueEntry(Gain, sought=None),
    CatalogueEntry(ClockError, alternative=_BY_A_FIBRE),
    CatalogueEntry(OtherFibre),
)

ENTRIES: dict[str, CatalogueEntry] = {entry.effect.name: entry for entry in _ENTRIES}
CATALOGUE: dict[str, type[Effect]] = {name: entry.effect for name, entry in ENTRIES.items()}


class HasCapabilities(Protocol):
    """A rig, as far as an effect must know it."""

    @property
    def kind(self) -> str:
        """Name in a study."""

    @property
    def capabilities(self) -> frozenset[Capability]:
        """What it has."""


def entry_of(effect: type[Effect]) -> CatalogueEntry:
    """Entry of an effect by its name; one that is not in the catalogue is tried everywhere, like most."""
    return ENTRIES.get(family_of(effect)) or CatalogueEntry(effect)


def suits(effect: type[Effect], rig: HasCapabilities) -> bool:
    """Whether an effect makes sense on a rig."""
    return effect.acts_on <= rig.capabilities


def is_sought(effect: type[Effect], rig: HasCapabilities) -> bool:
    """Whether a search on that rig tries an effect unrequested."""
    sought = entry_of(effect).sought
    return suits(effect, rig) and sought is not None and sought <= rig.capabilities


def is_costly(effect: type[Effect]) -> bool:
    """Whether a search tries an effect after all others, if they leave more than noise or slopes promise much of it."""
    return entry_of(effect).costly


def is_alternative(effect: type[Effect], rig: HasCapabilities) -> bool:
    """Whether a fit on that rig that leaves more than noise is held against the same model with an effect."""
    where = entry_of(effect).alternative
    return suits(effect, rig) and where is not None and where <= rig.capabilities


def look_alikes(effect: type[Effect]) -> tuple[str, ...]:
    """Names of effects that records do not tell from one."""
    return entry_of(effect).alike


def unsuited(effect: type[Effect], rig: HasCapabilities) -> tuple[str, str]:
    """What is wrong with an effect on a rig that it does not suit, and what was expected."""
    lacking = " and ".join(capability.value for capability in Capability if capability in effect.acts_on)
    return f"makes no sense on the rig {rig.kind}", f"a rig with {lacking}"


MOST_SUGGESTED = 3
"""Names with a word in them that are suggested where nothing is called so."""


def find_effect(name: str, directory: Path | str = ".") -> type[Effect]:
    """Effect by its name.

    Parameters
    ----------
    name : str
        A name in the catalogue or among installed packages, or ``"my_effects.py:MyEffect"``; with ``@3`` after it where
        there is one effect for each record, ``@1-5`` where it happens in each of five.
    directory : path
        Where the path of such a file begins: the directory of the study.

    Raises
    ------
    StudyError
        Where there is no such effect, or what was found is none.
    """
    offered = {point.name: point for point in entry_points(group=ENTRY_POINTS)}

    def called(name: str) -> type[Effect] | None:
        if ".py:" in name:
            return _named_anew(checked(from_file(name, Path(directory)), name), name)
        known = CATALOGUE.get(name)
        return known or (_named_anew(checked(from_package(offered[name]), name), name) if name in offered else None)

    if (found := called_with_place(name, called)) is not None:
        return found
    hint = _suggested(name, [*CATALOGUE, *offered])
    raise StudyError(
        f'effect "{name}"', "not in the catalogue", 'a name from it, or "my_effects.py:MyEffect"', hint or LIST_THEM
    )


def _suggested(name: str, known: Sequence[str]) -> str:
    """Sentence that suggests the nearest name, or else those that contain the word; empty where there is none."""
    if near := did_you_mean(name, known):
        return near
    holding = [f'"{one}"' for one in known if name and name.casefold() in one]
    first, more = holding[:MOST_SUGGESTED], holding[MOST_SUGGESTED:]
    also = f" `fibrefit effects` lists {len(more)} more with that word." if more else ""
    return f"Did you mean {' or '.join(first)}?{also}" if first else ""


def all_wrong(name: str, conditions: Mapping[str, float]) -> tuple[StudyError, ...]:
    """All that is wrong with an effect, of the catalogue or a user's own, as errors that are not raised.

    Parameters
    ----------
    name : str
        As for `find_effect`.
    conditions : mapping of str to float, in SI units
        Those of all rigs.

    Raises
    ------
    StudyError
        Where there is no such effect.
    """
    where = f'effect "{name}"'
    found = from_file(name, Path()) if ".py:" in name else find_effect(name)
    if not is_effect(found):
        return (StudyError(where, f"{found!r} is no effect", KINDS),)
    wrong = violations(found, conditions, where)
    try:
        _named_anew(found, name)
    except StudyError as taken:
        return (taken, *wrong)
    return wrong


LIST_THEM = "`fibrefit effects` lists the catalogue."
NAME_IT = "Add the place of the record, from 1."


def select_effects(
    names: Iterable[str], rig: HasCapabilities, directory: Path | str = ".", points: int | None = None
) -> tuple[type[Effect], ...]:
    """Effects of a model, fit for its rig and for each other.

    Parameters
    ----------
    names : iterable of str
        As for `find_effect`.
    rig : Rig
    directory : path
        Directory of the study.
    points : int, optional
        Number of points of a fibre with mass.

    Returns
    -------
    tuple of Effect classes
        In the order of `names`.

    Raises
    ------
    StudyError
        Where one is not known, makes no sense on this rig, names no record where it belongs to some, is named twice, or
        lacks another it builds upon.
    """
    effects = _all_found(names, directory)
    if points is not None:
        effects = tuple(point_masses(points) if effect is PointMasses else effect for effect in effects)
    known = [effect.name for effect in effects]
    for effect in effects:
        where = f'effect "{effect.name}"'
        if not suits(effect, rig):
            raise StudyError(where, *unsuited(effect, rig), "Take it off the list.")
        if effect.family and not (effect.records or effect.recurs):
            raise StudyError(where, "belongs to single records, and names none", f'"{effect.name}{MARK}3"', NAME_IT)
        if known.count(effect.name) > 1:
            raise StudyError(where, "named twice", "each effect once", "Take one of the two off the list.")
        for other in effect.excludes:
            if other in known:
                raise StudyError(where, f'stands beside "{other}"', "one of the two", f'Take "{other}" off the list.')
        for other in effect.needs:
            if other not in known:
                raise StudyError(where, f'stands without "{other}"', "both", f'Add "{other}" to the list.')
    return effects


def _all_found(names: Iterable[str], directory: Path | str) -> tuple[type[Effect], ...]:
    """Effects by their names; refused are all names at once that stand for none."""
    found, refused = [], []
    for name in names:
        try:
            found.append(find_effect(name, directory))
        except StudyError as error:
            refused.append(error)
    if refused:
        raise as_one(refused, "effects")
    return tuple(found)


def _named_anew(found: type[Effect], name: str) -> type[Effect]:
    if getattr(found, "name", "") in CATALOGUE and CATALOGUE[found.name] is not found:
        taken = f'the name "{found.name}" is taken'
        raise StudyError(f'effect "{name}"', taken, "a name of its own", "Change the attribute `name`.")
    return found
