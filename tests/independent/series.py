"""A series of records with a truth that is known: the usual lifts or excitations, a hidden effect, a logger's noise."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tests.independent.excitation import Excitation
from tests.independent.laws import DRIVE, DROP, EFFECTS
from tests.independent.sensors import USUAL, Noise, logged
from tests.independent.simulate import FINE_STEP, Base, Channels, Conditions, Effects, simulate

RATE = 2000.0
ADDED_MASS = 5.035
DROPS = ((5, 90), (10, 90), (20, 90), (10, 45), (20, 45))
HELD_OUT_DROP = (14, 60)
DRIVES = (
    ("trapezoid", 60, 60, False),
    ("trapezoid", 200, 80, True),
    ("trapezoid", 450, 60, False),
    ("quasi_sine", 250, 50, True),
    ("rectangle", 800, 20, True),
)
HELD_OUT_DRIVE = ("trapezoid", 300, 70, True)
ACCELERATION = {"trapezoid": 8.0, "quasi_sine": 8.0, "rectangle": 40.0}
DRIVE_SECONDS = 3.2


@dataclass(frozen=True)
class Recording:
    """One record: how it was taken, what was true and what the logger wrote.

    Parameters
    ----------
    name : of the file
    conditions : as taken
    base : base parameters that held on that day
    zero : reading of the position where it ought to read zero, m
    clean, logged : readings without and with the logger's imperfections
    """

    name: str
    conditions: Conditions
    base: Base
    zero: float
    clean: Channels
    logged: Channels


@dataclass(frozen=True)
class Series:
    """Records of one fibre, one of them held out."""

    rig: str
    base: Base
    effects: dict[str, dict[str, float]]
    records: tuple[Recording, ...]
    held_out: Recording
    base_gap: float | None
    seed: int


class Plan(NamedTuple):
    """A record before it is taken."""

    name: str
    conditions: Conditions
    times: np.ndarray


def draw_base(rng: np.random.Generator) -> Base:
    """A plausible fibre and guide."""
    stiffness = math.exp(rng.uniform(math.log(8e3), math.log(4e4)))
    return Base(stiffness, rng.uniform(8.0, 50.0), rng.uniform(1.5, 6.0))


def draw_shape(name: str, rng: np.random.Generator) -> dict[str, float]:
    """Shape parameters of an effect."""
    ranges = EFFECTS[name].fixed
    return {key: math.exp(rng.uniform(math.log(low), math.log(high))) for key, (low, high) in ranges.items()}


def plan_series(rig: str, rng: np.random.Generator) -> list[Plan]:
    """The usual records of a rig and, last, the one held out."""
    if rig == DROP:
        return [drop_plan(lift, degrees, rng) for lift, degrees in (*DROPS, HELD_OUT_DROP)]
    return [drive_plan(*row, rng) for row in (*DRIVES, HELD_OUT_DRIVE)]


def drop_plan(lift: int, degrees: int, rng: np.random.Generator, after: float = 1.6) -> Plan:
    """A drop from `lift` mm on a slope of `degrees`, logged for `after` s from the release on."""
    release = rng.uniform(0.1, 0.3)
    conditions = Conditions(
        DROP,
        inclination=math.radians(degrees),
        lift=1e-3 * lift,
        release=release,
        slip_instant=release + rng.uniform(0.3, 1.2),
    )
    n = round((release + after) * RATE)
    return Plan(f"drop_{lift}mm_{degrees}deg.csv", conditions, np.arange(n) / RATE)


def drive_plan(
    shape: str, rate: int, amplitude: int, added: bool, rng: np.random.Generator, seconds: float = DRIVE_SECONDS
) -> Plan:
    """A motion of the drive at `rate` mm/s over `amplitude` mm, with or without the added mass."""
    excitation = Excitation(shape, 1e-3 * amplitude, 1e-3 * rate, acceleration=ACCELERATION[shape])
    conditions = Conditions(
        DRIVE,
        added_mass=ADDED_MASS if added else 0.0,
        inclination=math.radians(30.0),
        excitation=excitation,
        slip_instant=rng.uniform(0.5, 2.5),
    )
    name = f"{shape}_{rate}mms_{amplitude}mm{'_added' if added else ''}.csv"
    return Plan(name, conditions, np.arange(round(seconds * RATE)) / RATE)


def take(
    plan: Plan, base: Base, effects: Effects, zero: float, noise: Noise, rng: np.random.Generator, step: float
) -> Recording:
    """Simulate a record and log it."""
    clean = simulate(plan.conditions, base, effects, plan.times, step)
    clean = clean._replace(position=clean.position + zero)
    written = {
        channel: logged(channel, values, plan.times, noise, rng, clean.force)
        for channel, values in clean._asdict().items()
        if channel in noise.rms and values is not None
    }
    return Recording(plan.name, plan.conditions, base, zero, clean, clean._replace(**written))


def make_series(
    rig: str,
    effects: Effects | None = None,
    *,
    seed: int,
    base: Base | None = None,
    scatter: float = 0.0,
    noise: Noise = USUAL,
    step: float = FINE_STEP,
    base_gap: float | None = None,
) -> Series:
    """A series as the practice of this field takes it.

    Parameters
    ----------
    rig : "fibre_mass" or "pulley_drive"
    effects : hidden ones with their parameters
    seed : of all that is drawn
    base : drawn if None
    scatter : relative standard deviation of the base parameters from record to record
    noise : of the logger
    step : of the simulator, s
    base_gap : what is known of the gap a base model leaves; only carried along

    Returns
    -------
    Series
    """
    rng = np.random.default_rng(seed)
    base = draw_base(rng) if base is None else base
    zero = rng.uniform(-3e-4, 3e-4) if rig == DROP else 0.0
    effects = {name: dict(values) for name, values in (effects or {}).items()}
    takes = [
        take(plan, scattered(base, rng, scatter), effects, zero, noise, rng, step) for plan in plan_series(rig, rng)
    ]
    return Series(rig, base, effects, tuple(takes[:-1]), takes[-1], base_gap, seed)


def scattered(base: Base, rng: np.random.Generator, share: float) -> Base:
    """Base parameters of one record: each off by its own share, normal, of relative standard deviation `share`."""
    deviates = rng.standard_normal(len(base))
    return Base(*(value * math.exp(share * deviate) for value, deviate in zip(base, deviates, strict=True)))
