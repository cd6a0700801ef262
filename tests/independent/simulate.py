"""One record of a rig with any of the effects in it, clean of noise."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from tests.independent.chain import run_chain
from tests.independent.excitation import Excitation, fine_motion
from tests.independent.kernel import power_of_speed, run_direct, run_rim
from tests.independent.laws import CHAIN, DRIVE, GRAVITY, Laws
from tests.independent.sensors import sense

Effects = Mapping[str, Mapping[str, float]]
OF_READINGS = {
    "sensor.force_gain",
    "sensor.force_offset",
    "sensor.force_drift",
    "sensor.force_delay",
    "sensor.force_lag",
    "sensor.gauge_resonance",
    "sensor.position_gain",
    "open.curved_gauge",
}
"""Effects that change readings only, not the motion."""

RIM_MASS_WITH_BEARING_FRICTION = 0.05
FINE_STEP = 5e-6
LEAST_CHAIN_STEP = 2.5e-7


class Base(NamedTuple):
    """Parameters of the base model."""

    stiffness: float = 2e4
    damping: float = 25.0
    friction: float = 4.0


@dataclass(frozen=True)
class Conditions:
    """How one record is taken.

    Parameters
    ----------
    kind : "fibre_mass" or "pulley_drive"
    inclination : rad
    lift, release : m and s, for fibre_mass
    excitation : for pulley_drive
    start_excess : N by which the fibre carries more than the weight before the drive starts, for pulley_drive
    slip_instant : s at which a slipping knot slips
    lateral_offset, guide_distance : m, for the asymmetric pulley_drive
    zeroed : whether the position reads zero at the start (pulley_drive); else where the fibre is just taut
    relaxed : whether a relaxing branch has come to rest before the start
    point_masses : of a fibre with mass
    tension_law : "clamped" or "heaviside"
    """

    kind: str = "fibre_mass"
    weight_mass: float = 3.096
    added_mass: float = 0.0
    inclination: float = math.pi / 2
    lift: float = 0.01
    release: float = 0.0
    excitation: Excitation = field(default_factory=Excitation)
    start_excess: float = 0.0
    slip_instant: float = 1e9
    lateral_offset: float = 0.0
    guide_distance: float = 1.0
    pulley_diameter: float = 0.08
    wrap_angle: float = math.radians(150.0)
    zeroed: bool = True
    relaxed: bool = True
    point_masses: int = 5
    tension_law: str = "clamped"


class Channels(NamedTuple):
    """Readings of one record, SI; `drive` is None where there is none."""

    times: np.ndarray
    force: np.ndarray
    position: np.ndarray
    drive: np.ndarray | None


def laws_for(conditions: Conditions, base: Base, effects: Effects) -> Laws:
    """All constants of a record."""
    mass = conditions.weight_mass + conditions.added_mass
    tilt = effects.get("study.inclination", {}).get("error", 0.0)
    side = 1.0 if conditions.kind == DRIVE else -1.0
    laws = Laws(
        *map(float, base),
        mass=mass,
        pull=-side * mass * GRAVITY * math.sin(conditions.inclination + tilt),
        side=side,
        heaviside=float(conditions.tension_law == "heaviside"),
        pulley_radius=0.5 * conditions.pulley_diameter,
        lateral_offset=conditions.lateral_offset,
        guide_distance=conditions.guide_distance,
        slip_instant=conditions.slip_instant,
    )
    for name, values in effects.items():
        if name in OF_READINGS or name == CHAIN:
            continue
        changes = {key: float(value) for key, value in values.items()}
        if name == "study.inclination":
            continue
        if name == "pulley.capstan_friction":
            changes = {"capstan": changes["capstan_coefficient"] * conditions.wrap_angle}
        elif name == "drive.compliance":
            changes = {"mount_compliance": 1.0 / changes["mount_stiffness"]}
        elif name == "pulley.bearing_friction":
            changes.setdefault("rim_mass", laws.rim_mass or RIM_MASS_WITH_BEARING_FRICTION)
        laws = laws._replace(**changes)
    return laws


def simulate(
    conditions: Conditions, base: Base, effects: Effects, times: np.ndarray, step: float = FINE_STEP
) -> Channels:
    """Readings at `times` (from 0) without noise.

    Raises
    ------
    ValueError
        For combinations that the kernels do not cover.
    """
    laws = laws_for(conditions, base, effects)
    _refuse_uncovered(effects, laws)
    driven = conditions.kind == DRIVE
    if CHAIN in effects:
        step = min(step, chain_step(base, float(effects[CHAIN]["fibre_mass"]), conditions.point_masses))
    begin = 0.0 if driven else conditions.release
    n = max(math.ceil((times[-1] - begin) / step) + 1, 2)
    forces, positions, rest = (driven_steps if driven else _dropped)(conditions, laws, effects, n, step)
    middles = begin + (np.arange(n) + 0.5) * step
    force = sense(effects, forces, middles, times, step, rest[0])
    position = np.interp(times, middles, positions, left=rest[1])
    position = effects.get("sensor.position_gain", {}).get("gain", 1.0) * (
        position - (rest[1] if driven and conditions.zeroed else 0.0)
    )
    return Channels(times, force, position, conditions.excitation.motion(times)[0] if driven else None)


def chain_step(base: Base, fibre_mass: float, count: int) -> float:
    """Step in s that follows how damping brings points of a fibre to one speed.

    The midpoint rule does not let what is faster than its step die out, and segments that ring go slack and taut. With
    steps of 1e-5 s a fibre of 0.5 g had a noncentrality of 163 in noise that is quiet at high frequencies, where it has
    1.1.
    """
    return max(0.5 * (fibre_mass / count) / ((count + 1) * base.damping), LEAST_CHAIN_STEP)


def _refuse_uncovered(effects: Effects, laws: Laws) -> None:
    fibre = [name for name in effects if name.startswith(("fibre.", "pulley.", "drive."))]
    alone = {CHAIN, "drive.compliance"} & set(effects)
    if alone and set(fibre) - {"fibre.free_length_offset"} != alone:
        raise ValueError(f"{', '.join(sorted(alone))} stands alone among fibre, pulley and drive: got {fibre}")
    if laws.rim_mass > 0.0 and laws.capstan != 0.0:
        raise ValueError("capstan friction means a locked pulley: no rim mass beside it")
    if CHAIN in effects and (laws.bristle_stiffness or laws.lateral_offset or laws.heaviside or laws.slip_length):
        raise ValueError("a fibre of point masses is simulated with the clamped law on a symmetric rig only")


def _dropped(conditions: Conditions, laws: Laws, effects: Effects, n: int, step: float) -> tuple:
    nothing = np.zeros(n)
    start = (-conditions.lift, 0.0, 0.0)
    if CHAIN in effects:
        count, fibre_mass = conditions.point_masses, float(effects[CHAIN]["fibre_mass"])
        weight = fibre_mass * GRAVITY * math.sin(conditions.inclination)
        places = hung(laws, count, weight, -conditions.lift)
        forces, positions = run_chain(places, count, nothing, nothing, 0.0, step, laws, fibre_mass, weight)
        return forces, positions, (weight, -conditions.lift)
    forces, positions = run_direct(*start, nothing, nothing, conditions.release, step, laws)
    return forces, positions, (0.0, -conditions.lift)


def hung(laws: Laws, count: int, weight: float, end: float) -> np.ndarray:
    """Places of the points of a slack fibre that hangs at rest from the gauge, and of its lower end held at `end`."""
    below = weight * np.arange(count, 0, -1) / count
    stretches = below / ((count + 1) * laws.stiffness) + laws.length_offset / (count + 1)
    return np.append(np.cumsum(stretches), end)


def driven_steps(conditions: Conditions, laws: Laws, effects: Effects, n: int, step: float) -> tuple:
    """Force and position at the middle of each of `n` steps, and both at rest before the drive moves."""
    drive, rate = fine_motion(conditions.excitation, step, n)
    mass = conditions.weight_mass + conditions.added_mass
    load = mass * GRAVITY * math.sin(conditions.inclination) + conditions.start_excess
    stretch = static_stretch(laws, load)
    mount = load * laws.mount_compliance
    position = -(stretch + mount)
    dashpot = stretch - laws.length_offset if conditions.relaxed else 0.0
    if CHAIN in effects:
        count, fibre_mass = conditions.point_masses, float(effects[CHAIN]["fibre_mass"])
        places = stretch * np.arange(1, count + 2) / (count + 1)
        forces, positions = run_chain(places, count, drive, rate, 0.0, step, laws, fibre_mass, 0.0)
    elif laws.rim_mass > 0.0:
        forces, positions = run_rim(position, 0.5 * position, dashpot, drive, rate, 0.0, step, laws)
    else:
        forces, positions = run_direct(position, dashpot, mount, drive, rate, 0.0, step, laws)
    return forces, positions, (load, position)


def static_stretch(laws: Laws, load: float) -> float:
    """Lengthening between the fibre's ends, free length offset included, at which its own spring carries `load`."""

    def excess(stretch: float) -> float:
        elastic = laws.stiffness * stretch * (1.0 + laws.hardening * stretch)
        elastic *= 1.0 - laws.toe_depth * math.exp(-stretch / laws.toe_length)
        elastic *= power_of_speed(0.0, laws.stiffness_exponent)
        elastic += laws.kink * max(0.0, stretch - laws.kink_stretch)
        return elastic - load

    high = load / laws.stiffness
    while excess(high) < 0.0:
        high *= 1.5
    return brentq(excess, 0.0, high, xtol=1e-16) + laws.length_offset
