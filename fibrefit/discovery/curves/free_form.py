"""What a missing effect looks like when it has no name: fitting the probes and reading their curves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from fibrefit.core.roles import ROLES, STATES
from fibrefit.discovery.curves.probes import PROBES, Curve
from fibrefit.discovery.engine.candidates import Ground, Hypothesis, absent_values, carried, fit_all, retimed
from fibrefit.discovery.engine.refit import Subset, refit
from fibrefit.discovery.engine.supermodel import Frame, frame_of
from fibrefit.discovery.engine.thresholds import KNOT
from fibrefit.effects.catalogue import suits
from fibrefit.effects.law import Effect
from fibrefit.fitting.result import Identification
from fibrefit.problem.diagnose.phases import HELD
from fibrefit.problem.task import Task

SI = ROLES | STATES
"""SI unit of each variable."""
READ_IN = {"m": ("mm", 1e3)}
"""Unit a person reads an SI unit in, and its factor, where it is another."""
FROM_ZERO = ("speed", "tension", "stretch")
"""Variables whose range begins at zero."""
ACTS = 0.2
"""Share of its largest height from which a curve is said to act."""


@dataclass(frozen=True)
class Reading:
    """A fitted probe.

    Parameters
    ----------
    probe : Curve class
    knots, heights : (n_knot,) in SI units
    hypothesis : Hypothesis
    """

    probe: type[Curve]
    knots: np.ndarray
    heights: np.ndarray
    hypothesis: Hypothesis


def probe_all(
    task: Task,
    parent: Hypothesis,
    found: Identification,
    ground: Ground,
    kappa: float,
    tell: Callable[[float], None],
) -> list[Reading]:
    """Fit each probe on top of a hypothesis, best first.

    Parameters
    ----------
    task : Task
        Of the model the search began with, its inputs as they were measured.
    parent : Hypothesis
    found : Identification
        Of the model before the search: its motion tells the range of each variable.
    ground : Ground
    kappa : float
        Colour of the noise.
    tell : callable
        Told the share that is done.
    """
    ranges = {variable: _range(variable, values) for variable, (values, _) in in_motion(found).items()}
    rig = found.problem.model.rig
    probes = [probe for probe in PROBES if probe.variable in ranges and suits(probe, rig)]
    frame = parent.frame
    if not frame.holds(probes):
        frame = frame_of(task, (*parent.effects, *probes), frame.reactions)
    start = _prepared(frame, parent, probes, ranges)
    jobs = [partial(_fit, frame, ground, parent, probe, start) for probe in probes]
    ends = fit_all(jobs, lambda done: tell(done / len(jobs)))
    readings = [_read(probe, end, ranges) for probe, end in zip(probes, ends, strict=True)]
    return sorted(readings, key=lambda reading: price(reading, kappa))


def price(reading: Reading, kappa: float) -> float:
    """Cost of a fitted probe, and what chance gives to so many knots, for noise of a colour."""
    return reading.hypothesis.fit.cost + KNOT * kappa * len(reading.heights)


def described(reading: Reading) -> str:
    """The curve in words."""
    probe, shape = reading.probe, shape_of(reading)
    unit, factor = _read_in(SI[probe.variable])
    knots = reading.knots * factor
    height_unit, height_factor = _read_in(probe.unit)
    heights = shape * height_factor
    says = f"{probe.says}, between {heights.min():.2g} and {heights.max():.2g} {height_unit}"
    if acts := acting(heights):
        beyond = acts[1] == len(knots) - 1
        place = knots[acts[0] if beyond else acts[1]]
        says += f", {'beyond' if beyond else 'below'} a {probe.variable} of {place:.3g} {unit}"
    turns = _turns(heights)
    if turns >= 2:
        says += f", rising and falling {turns} times over {knots[-1] - knots[0]:.3g} {unit}"
    return says


def shape_of(reading: Reading) -> np.ndarray:
    """Heights without their median: what is the same everywhere, the model can do without the curve."""
    return reading.heights - np.median(reading.heights)


def acting(shape: np.ndarray) -> tuple[int, int] | None:
    """First and last knot between which a curve acts, where that is one end of its range."""
    half, there = len(shape) // 2, np.flatnonzero(np.abs(shape) > ACTS * np.abs(shape).max())
    if len(there) and there[0] >= half:
        return int(there[0]) - 1, len(shape) - 1
    if len(there) and there[-1] < half:
        return 0, int(there[-1]) + 1
    return None


def _read_in(si: str) -> tuple[str, float]:
    return READ_IN.get(si, (si, 1.0))


def _turns(heights: np.ndarray) -> int:
    """How often a curve turns by more than `ACTS` of its whole height."""
    least, turns, rising = ACTS * float(np.ptp(heights)), 0, None
    low = high = heights[0]
    for height in heights:
        low, high = min(low, height), max(high, height)
        if rising is not False and high - height > least:
            turns, rising, low = turns + (rising is True), False, height
        elif rising is not True and height - low > least:
            turns, rising, high = turns + (rising is False), True, height
    return turns


def _fit(frame: Frame, ground: Ground, parent: Hypothesis, probe: type[Curve], start: np.ndarray) -> Hypothesis:
    active = with_curve(ground, parent.effects, probe)
    end = retimed(frame, active, refit(frame, active, start, ground.whole, 40), ground)
    return Hypothesis((*parent.effects, probe), end, frame)


def with_curve(ground: Ground, effects: Sequence[type[Effect]], probe: type[Curve]) -> Subset:
    """Active values when a probe is fitted on top of effects; its heights are the last of the shared ones."""
    heights = tuple(f"{probe.name}.{height}" for height in probe.heights)
    subset = ground.subset(effects)
    return Subset(subset.shared + heights, subset.each, curve=heights)


def _prepared(
    frame: Frame, parent: Hypothesis, probes: Sequence[type[Curve]], ranges: dict[str, tuple[float, float]]
) -> np.ndarray:
    blank = absent_values(frame, len(parent.fit.local))
    values = carried(frame, blank, parent.frame, parent.fit.local)
    for probe in probes:
        for name, limit in zip(("low", "high"), ranges[probe.variable], strict=True):
            values[:, frame.names.index(f"{probe.name}.{name}")] = limit
    return values


def _read(probe: type[Curve], end: Hypothesis, ranges: dict[str, tuple[float, float]]) -> Reading:
    heights = np.array([end.fit.shared[f"{probe.name}.{height}"] for height in probe.heights])
    return Reading(probe, np.linspace(*ranges[probe.variable], len(heights)), heights, end)


def in_motion(found: Identification) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Every variable the rig has while it moves in the simulated motion, in SI units, and the time it stays there in s.

    Parameters
    ----------
    found : Identification

    Returns
    -------
    dict of str to ((n_sample,), (n_sample,))
    """
    times = np.asarray(found.problem.observations.experiment.times)
    counts = np.asarray(found.problem.observations.experiment.count)
    moving = (found.motion.phase != HELD) & (np.arange(times.shape[1]) < counts[:, None])
    steps = np.diff(times, append=times[:, -1:])[moving]
    states = found.motion.states
    known = {"position": states["position"], "speed": np.abs(states["speed"])}
    if "tension" in states:
        stretch = states["tension"] / found.parameters["stiffness"].value
        rate = np.gradient(stretch, axis=1) / np.gradient(times, axis=1)
        known |= {"tension": states["tension"], "stretch": stretch, "stretch rate": rate}
    there = {variable: (values[moving], steps) for variable, values in known.items()}
    forces = [values[moving] for channel, values in found.readings.items() if channel.startswith("force")]
    if forces:
        there["force"] = np.concatenate(forces), np.tile(steps, len(forces))
    return there


def _range(variable: str, values: np.ndarray) -> tuple[float, float]:
    """Range of a variable, in SI units."""
    if variable == "stretch rate":
        fast = float(np.quantile(np.abs(values), 0.995))
        return -fast, fast
    return 0.0 if variable in FROM_ZERO else float(values.min()), float(values.max())


def is_probe(effect: type[Effect]) -> bool:
    """Whether an effect is a probe, which has no name to offer."""
    return issubclass(effect, Curve)
