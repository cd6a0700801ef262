"""All effects the program knows by name, and the way to one of a user's own."""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import os
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib.metadata import entry_points
from itertools import chain
from pathlib import Path
from typing import Protocol, TypeGuard

from fibrefit.core.declarations import Capability
from fibrefit.core.errors import StudyError, as_one, did_you_mean
from fibrefit.core.paths import read_plain_file
from fibrefit.laws import changes, pushes, study
from fibrefit.laws import functions_of_speed as speed
from fibrefit.laws.contract import KINDS, refusals, unusable, violations
from fibrefit.laws.drive.compliance import Compliance
from fibrefit.laws.drive.play import Play
from fibrefit.laws.families import MARK, called_with_place, family_of
from fibrefit.laws.fibre import relaxation, series
from fibrefit.laws.fibre.free_length_offset import FreeLengthOffset
from fibrefit.laws.fibre.hysteresis import Hysteresis
from fibrefit.laws.fibre.point_masses import PointMasses, point_masses
from fibrefit.laws.fibre.toe_region import ToeRegion
from fibrefit.laws.guide import drag, friction_level
from fibrefit.laws.guide.loose_mass import LooseMass
from fibrefit.laws.guide.presliding import Presliding
from fibrefit.laws.guide.spring import Spring
from fibrefit.laws.law import Effect
from fibrefit.laws.pivot.quadratic_damping import QuadraticDamping
from fibrefit.laws.pulley.capstan_friction import CapstanFriction
from fibrefit.laws.pulley.eccentricity import Eccentricity
from fibrefit.laws.pulley.rim import BearingFriction, PulleyInertia
from fibrefit.laws.sensor import calibration, dynamics
from fibrefit.laws.sensor.dial_gauge_force import DialGaugeForce
from fibrefit.laws.sensor.position_ripple import PositionRipple

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
    CatalogueEntry(drag.ViscousFriction, alternative=_BY_A_FIBRE),
    CatalogueEntry(friction_level.StribeckFriction, alternative=_BY_A_FIBRE),
    CatalogueEntry(friction_level.LoadDependentFriction, alternative=_BY_A_FIBRE),
    CatalogueEntry(drag.QuadraticDrag),
    CatalogueEntry(friction_level.AsymmetricFriction),
    CatalogueEntry(drag.AsymmetricViscousFriction),
    CatalogueEntry(Presliding),
    CatalogueEntry(QuadraticDamping),
    CatalogueEntry(Spring, sought=None),
    CatalogueEntry(friction_level.FrictionOverPosition, sought=frozenset({Capability.PUSH})),
    CatalogueEntry(pushes.PushDelay, alike=("push.force_lag", "push.hold")),
    CatalogueEntry(pushes.PushLag, sought=None),
    CatalogueEntry(pushes.PushHold, sought=None),
    CatalogueEntry(pushes.PushGain, sought=None),
    CatalogueEntry(speed.FrictionSpeedCurve, sought=None),
    CatalogueEntry(speed.FrictionPowerLaw, sought=None),
    CatalogueEntry(speed.FrictionSpeedExponent, sought=None),
    CatalogueEntry(series.Hardening, alternative=_BY_A_FIBRE),
    CatalogueEntry(ToeRegion),
    CatalogueEntry(relaxation.MaxwellBranch, alternative=_BY_A_FIBRE),
    CatalogueEntry(series.RateDependentDamping, alternative=_BY_A_FIBRE),
    CatalogueEntry(series.RateDependentStiffness),
    CatalogueEntry(speed.StiffnessSpeedCurve, sought=None),
    CatalogueEntry(speed.StiffnessPowerLaw, sought=None),
    CatalogueEntry(speed.StiffnessSpeedExponent, sought=None),
    CatalogueEntry(speed.DampingSpeedCurve, sought=None),
    CatalogueEntry(speed.DampingPowerLaw, sought=None),
    CatalogueEntry(speed.DampingSpeedExponent, sought=None),
    CatalogueEntry(Hysteresis, alternative=_BY_A_FIBRE),
    CatalogueEntry(FreeLengthOffset, alike=("study.lift",)),
    CatalogueEntry(relaxation.Creep),
    CatalogueEntry(changes.StiffnessDrift),
    CatalogueEntry(changes.StiffnessTrend),
    CatalogueEntry(changes.StiffnessWear),
    CatalogueEntry(changes.StiffnessChange),
    CatalogueEntry(changes.StiffnessStep, costly=True),
    CatalogueEntry(changes.LengthDrift),
    CatalogueEntry(changes.LengthTrend),
    CatalogueEntry(changes.LengthChange),
    CatalogueEntry(changes.Setting),
    CatalogueEntry(changes.KnotSlip, costly=True),
    CatalogueEntry(changes.FrictionDrift),
    CatalogueEntry(changes.FrictionTrend),
    CatalogueEntry(changes.FrictionWear),
    CatalogueEntry(changes.FrictionChange),
    CatalogueEntry(changes.FrictionStep, costly=True),
    CatalogueEntry(LooseMass, costly=True),
    CatalogueEntry(PointMasses, sought=frozenset({Capability.FALL}), costly=True),
    CatalogueEntry(PulleyInertia, alike=("fibre.mass",)),
    CatalogueEntry(BearingFriction),
    CatalogueEntry(CapstanFriction),
    CatalogueEntry(Eccentricity),
    CatalogueEntry(Compliance),
    CatalogueEntry(Play),
    CatalogueEntry(calibration.ForceGain, alternative=_BY_A_FIBRE),
    CatalogueEntry(calibration.ForceOffset),
    CatalogueEntry(calibration.ForceDrift),
    CatalogueEntry(dynamics.ForceDelay, alternative=_BY_A_FIBRE),
    CatalogueEntry(dynamics.ForceLag),
    CatalogueEntry(dynamics.GaugeResonance),
    CatalogueEntry(calibration.PositionGain, sought=frozenset({Capability.FIBRE}), alternative=_BY_A_FIBRE),
    CatalogueEntry(DialGaugeForce),
    CatalogueEntry(calibration.GaugeNonlinearity),
    CatalogueEntry(calibration.AccelerationCrosstalk),
    CatalogueEntry(PositionRipple, sought=frozenset({Capability.FIBRE}), costly=True),
    CatalogueEntry(study.InclinationError, sought=None),
    CatalogueEntry(study.WeightMass, alternative=_BY_A_FIBRE),
    CatalogueEntry(study.AddedMass),
    CatalogueEntry(study.Inclination, alike=("rig.inclination_error",), alternative=_BY_A_FIBRE),
    CatalogueEntry(study.Lift, sought=None, alternative=_BY_A_FIBRE),
    CatalogueEntry(study.WrapAngle, sought=None),
    CatalogueEntry(study.Gain, sought=None),
    CatalogueEntry(study.ClockError, alternative=_BY_A_FIBRE),
    CatalogueEntry(study.OtherFibre),
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
        if name in CATALOGUE:
            return CATALOGUE[name]
        if ".py:" in name:
            found = _from_file(name, Path(directory))
        elif name not in offered:
            return None
        else:
            try:
                found = offered[name].load()
            except (Exception, SystemExit) as error:
                got = f"{offered[name].value}, which an installed package offers, fails with "
                got += f"{type(error).__name__}: {error}"
                raise StudyError(f'effect "{name}"', got, do="Mend that package, or remove it.") from error
        where = f'effect "{name}"'
        if not _is_effect(found):
            raise StudyError(where, f"{found!r} is no effect", KINDS)
        # The first thing that is wrong: it breaks what is asked of an effect, or cannot be compiled.
        for refusal in chain(refusals(found, where), unusable(found, where)):
            raise refusal
        return _named_anew(found, name)

    if (found := called_with_place(name, called)) is not None:
        return found
    known = [*CATALOGUE, *offered]
    hint = did_you_mean(name, known)
    if not hint and name and (holding := [f'"{one}"' for one in known if name.casefold() in one]):
        first, more = holding[:MOST_SUGGESTED], holding[MOST_SUGGESTED:]
        hint = f"Did you mean {' or '.join(first)}?"
        hint += f" `fibrefit effects` lists {len(more)} more with that word." if more else ""
    raise StudyError(
        f'effect "{name}"', "not in the catalogue", 'a name from it, or "my_effects.py:MyEffect"', hint or LIST_THEM
    )


def _from_file(name: str, directory: Path) -> object:
    """What a user's file holds by the name after the colon, ``"my_effects.py:MyEffect"``; a `StudyError` if nothing."""
    file, _, wanted = name.rpartition(":")
    path = (directory / file).resolve()
    if not os.path.isfile(path):
        raise StudyError(f'effect "{name}"', f"no file {path}", "a Python file beside the study", "Check the path.")
    source = read_plain_file(path, "a Python file", StudyError)
    digest = hashlib.sha256(str(path).encode("utf-8", "surrogateescape") + source).hexdigest()
    title = f"fibrefit_user_{path.stem}_{digest[:12]}"
    # A second class of the same file must be of the same module: JAX tells pytrees apart by their class.
    if title not in sys.modules:
        spec = importlib.util.spec_from_file_location(title, path)
        if spec is None or spec.loader is None:
            raise StudyError(f'effect "{name}"', f"{path.name} is not a Python file", "a file ending in .py")
        sys.modules[title] = importlib.util.module_from_spec(spec)
        try:
            # The very bytes of the digest: byte code kept beside a file is only as old as its clock tells seconds.
            exec(compile(source, str(path), "exec", dont_inherit=True), vars(sys.modules[title]))
        except (Exception, SystemExit) as error:
            del sys.modules[title]
            got = f"{path.name} fails with {type(error).__name__}: {error}"
            raise StudyError(f'effect "{name}"', got, do="Run the file by itself.") from error
    module = sys.modules[title]
    if (found := getattr(module, wanted, None)) is None:
        classes = [n for n, v in vars(module).items() if inspect.isclass(v) and v.__module__ == module.__name__]
        hint = did_you_mean(wanted, classes) or "Check the name after the colon."
        raise StudyError(f'effect "{name}"', f"no {wanted} in {path.name}", ", ".join(classes) or "a class", hint)
    return found


def _is_effect(found: object) -> TypeGuard[type[Effect]]:
    return inspect.isclass(found) and issubclass(found, Effect)


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
    found = _from_file(name, Path()) if ".py:" in name else find_effect(name)
    if not _is_effect(found):
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
    found, refused = [], []
    for name in names:
        try:
            found.append(find_effect(name, directory))
        except StudyError as error:
            refused.append(error)
    if refused:
        raise as_one(refused, "effects")
    effects = tuple(point_masses(points) if points is not None and one is PointMasses else one for one in found)
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


def _named_anew(found: type[Effect], name: str) -> type[Effect]:
    """An effect that is not of the catalogue, if its name is not taken there."""
    if getattr(found, "name", "") in CATALOGUE and CATALOGUE[found.name] is not found:
        taken = f'the name "{found.name}" is taken'
        raise StudyError(f'effect "{name}"', taken, "a name of its own", "Change the attribute `name`.")
    return found
