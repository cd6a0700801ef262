"""All effects the program knows by name, and the way to one of a user's own."""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import sys
from collections.abc import Iterable
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType

from fibrefit.core.errors import StudyError, did_you_mean
from fibrefit.effects.drive.compliance import Compliance
from fibrefit.effects.fibre.free_length_offset import FreeLengthOffset
from fibrefit.effects.fibre.hardening import Hardening
from fibrefit.effects.fibre.hysteresis import Hysteresis
from fibrefit.effects.fibre.maxwell_branch import MaxwellBranch
from fibrefit.effects.fibre.point_masses import PointMasses, point_masses
from fibrefit.effects.fibre.rate_dependent_damping import RateDependentDamping
from fibrefit.effects.fibre.rate_dependent_stiffness import RateDependentStiffness
from fibrefit.effects.fibre.toe_region import ToeRegion
from fibrefit.effects.functions_of_speed import (
    DampingPowerLaw,
    DampingSpeedCurve,
    FrictionPowerLaw,
    FrictionSpeedCurve,
    StiffnessPowerLaw,
    StiffnessSpeedCurve,
)
from fibrefit.effects.guide.asymmetric_friction import AsymmetricFriction
from fibrefit.effects.guide.asymmetric_viscous_friction import AsymmetricViscousFriction
from fibrefit.effects.guide.load_dependent_friction import LoadDependentFriction
from fibrefit.effects.guide.presliding import Presliding
from fibrefit.effects.guide.quadratic_drag import QuadraticDrag
from fibrefit.effects.guide.stribeck_friction import StribeckFriction
from fibrefit.effects.guide.viscous_friction import ViscousFriction
from fibrefit.effects.law import Effect
from fibrefit.effects.pulley.bearing_friction import BearingFriction
from fibrefit.effects.pulley.capstan_friction import CapstanFriction
from fibrefit.effects.pulley.eccentricity import Eccentricity
from fibrefit.effects.pulley.inertia import PulleyInertia
from fibrefit.effects.rig.inclination_error import InclinationError
from fibrefit.effects.sensor.dial_gauge_force import DialGaugeForce
from fibrefit.effects.sensor.force_delay import ForceDelay
from fibrefit.effects.sensor.force_drift import ForceDrift
from fibrefit.effects.sensor.force_gain import ForceGain
from fibrefit.effects.sensor.force_lag import ForceLag
from fibrefit.effects.sensor.force_offset import ForceOffset
from fibrefit.effects.sensor.gauge_resonance import GaugeResonance
from fibrefit.effects.sensor.position_gain import PositionGain

ENTRY_POINTS = "fibrefit.effects"
"""Group under which an installed package offers effects of its own."""

_CLASSES: tuple[type[Effect], ...] = (
    ViscousFriction,
    StribeckFriction,
    LoadDependentFriction,
    QuadraticDrag,
    AsymmetricFriction,
    AsymmetricViscousFriction,
    Presliding,
    FrictionSpeedCurve,
    FrictionPowerLaw,
    Hardening,
    ToeRegion,
    MaxwellBranch,
    RateDependentDamping,
    RateDependentStiffness,
    StiffnessSpeedCurve,
    StiffnessPowerLaw,
    DampingSpeedCurve,
    DampingPowerLaw,
    Hysteresis,
    FreeLengthOffset,
    PointMasses,
    PulleyInertia,
    BearingFriction,
    CapstanFriction,
    Eccentricity,
    Compliance,
    ForceGain,
    ForceOffset,
    ForceDrift,
    ForceDelay,
    ForceLag,
    GaugeResonance,
    PositionGain,
    DialGaugeForce,
    InclinationError,
)

CATALOGUE: dict[str, type[Effect]] = {effect.name: effect for effect in _CLASSES}


def find_effect(name: str, directory: Path | str = ".") -> type[Effect]:
    """Effect by its name.

    Parameters
    ----------
    name : str
        A name in the catalogue or among installed packages, or ``"my_effects.py:MyEffect"``.
    directory : path
        Where the path of such a file begins: the directory of the study.

    Returns
    -------
    type of Effect

    Raises
    ------
    StudyError
        Where there is no such effect, or what was found is none.
    """
    if ".py:" in name:
        return _from_file(name, Path(directory))
    if name in CATALOGUE:
        return CATALOGUE[name]
    offered = {point.name: point for point in entry_points(group=ENTRY_POINTS)}
    if name in offered:
        return _checked(offered[name].load(), name)
    hint = did_you_mean(name, [*CATALOGUE, *offered])
    raise StudyError(
        f'effect "{name}"', "not in the catalogue", 'a name from it, or "my_effects.py:MyEffect"', hint or LIST_THEM
    )


LIST_THEM = "`fibrefit effects` lists the catalogue."


def select_effects(
    names: Iterable[str], kind: str, directory: Path | str = ".", points: int | None = None
) -> tuple[type[Effect], ...]:
    """Effects of a model, fit for its rig and for each other.

    Parameters
    ----------
    names : iterable of str
        As for `find_effect`.
    kind : str
        Kind of rig.
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
        Where one is not known, makes no sense on this rig, is named twice, or lacks another it builds upon.
    """
    effects = tuple(find_effect(name, directory) for name in names)
    if points is not None:
        effects = tuple(point_masses(points) if effect is PointMasses else effect for effect in effects)
    known = [effect.name for effect in effects]
    for effect in effects:
        where = f'effect "{effect.name}"'
        if kind not in effect.rigs:
            fitting = ", ".join(sorted(effect.rigs))
            raise StudyError(where, f"makes no sense on the rig {kind}", f"one of {fitting}", "Take it off the list.")
        if known.count(effect.name) > 1:
            raise StudyError(where, "named twice", "each effect once", "Take one of the two off the list.")
        for other in effect.excludes:
            if other in known:
                raise StudyError(where, f'stands beside "{other}"', "one of the two", f'Take "{other}" off the list.')
        for other in effect.needs:
            if other not in known:
                raise StudyError(where, f'stands without "{other}"', "both", f'Add "{other}" to the list.')
    return effects


def _from_file(name: str, directory: Path) -> type[Effect]:
    """Effect of a user's own: the class after the colon in the file before it."""
    file, _, wanted = name.rpartition(":")
    path = (directory / file).resolve()
    if not path.is_file():
        raise StudyError(f'effect "{name}"', f"no file {path}", "a Python file beside the study", "Check the path.")
    module = _load(path, name)
    found = getattr(module, wanted, None)
    if found is None:
        classes = [n for n, v in vars(module).items() if inspect.isclass(v) and v.__module__ == module.__name__]
        hint = did_you_mean(wanted, classes) or "Check the name after the colon."
        raise StudyError(f'effect "{name}"', f"no {wanted} in {path.name}", ", ".join(classes) or "a class", hint)
    return _checked(found, name)


def _load(path: Path, name: str) -> ModuleType:
    title = f"fibrefit_user_{path.stem}_{hashlib.sha256(str(path).encode()).hexdigest()[:12]}"
    if title in sys.modules:
        # A second class of the same file must be of the same module: JAX tells pytrees apart by their class.
        return sys.modules[title]
    spec = importlib.util.spec_from_file_location(title, path)
    if spec is None or spec.loader is None:
        raise StudyError(f'effect "{name}"', f"{path.name} is not a Python file", "a file ending in .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[title] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[title]
        raise StudyError(
            f'effect "{name}"', f"{path.name} fails with {type(error).__name__}: {error}", do="Run the file by itself."
        ) from error
    return module


def _checked(found: object, name: str) -> type[Effect]:
    """`found` if it is an effect that a model can hold."""
    where = f'effect "{name}"'
    if not (inspect.isclass(found) and issubclass(found, Effect)):
        raise StudyError(where, f"{found!r} is no effect", "a subclass of FibreLaw, GuideLaw or another port", "")
    title = getattr(found, "name", "")
    if not isinstance(title, str) or title.count(".") != 1:
        raise StudyError(where, f"its name is {title!r}", 'a name = "port.effect"', "Set the class attribute `name`.")
    if not found.parameters:
        raise StudyError(where, "it declares no parameter", "a field made with quantity(...)", "Declare its strength.")
    if title in CATALOGUE and CATALOGUE[title] is not found:
        raise StudyError(where, f'the name "{title}" is taken', "a name of its own", "Change the attribute `name`.")
    return found
