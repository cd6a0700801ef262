"""What a missing effect looks like when it has no name: fitting the probes and reading their curves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from fibrefit.discover.candidates import Ground, Hypothesis, absent_values, carried, fit_all, retimed
from fibrefit.discover.evidence import KNOT
from fibrefit.discover.frame import Frame, frame_of
from fibrefit.discover.probes import PROBES, Curve
from fibrefit.discover.refit import Subset, refit
from fibrefit.effects.law import Effect
from fibrefit.fit.result import Identification
from fibrefit.problem.phases import HELD

UNITS = {
    "position": ("mm", 1e3),
    "speed": ("m/s", 1.0),
    "tension": ("N", 1.0),
    "stretch": ("mm", 1e3),
    "stretch rate": ("m/s", 1.0),
}
"""Unit a person reads a variable in, and its factor from SI."""
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
    parent: Hypothesis, found: Identification, ground: Ground, kappa: float, tell: Callable[[float], None]
) -> list[Reading]:
    """Fit each probe on top of a hypothesis, best first.

    Parameters
    ----------
    parent : Hypothesis
    found : Identification
        Of the model before the search: its motion tells the range of each variable.
    ground : Ground
    kappa : float
        Colour of the noise.
    tell : callable
        Told the share that is done.
    """
    ranges = _ranges(found)
    probes = [probe for probe in PROBES if probe.variable in ranges]
    frame = parent.frame
    if not frame.holds(probes):
        frame = frame_of(frame.task, probes, frame.reactions)
    start = _prepared(frame, parent, probes, ranges)
    jobs = [partial(_fit, frame, ground, parent, probe, start) for probe in probes]
    ends = fit_all(jobs, lambda done: tell(done / len(jobs)))
    readings = [_read(probe, end, ranges) for probe, end in zip(probes, ends, strict=True)]
    return sorted(readings, key=lambda reading: reading.hypothesis.fit.cost + KNOT * kappa * len(reading.heights))


def described(reading: Reading) -> str:
    """The curve in words."""
    unit, factor = UNITS[reading.probe.variable]
    knots = reading.knots * factor
    # What is the same everywhere, the model can do without the curve.
    heights = reading.heights - np.median(reading.heights)
    lowest, highest = float(heights.min()), float(heights.max())
    says = f"{reading.probe.says}, between {lowest:.2g} and {highest:.2g} N"
    acting = np.flatnonzero(np.abs(heights) > ACTS * np.abs(heights).max())
    if len(acting) and acting[0] >= len(knots) // 2:
        says += f", beyond a {reading.probe.variable} of {knots[acting[0] - 1]:.3g} {unit}"
    elif len(acting) and acting[-1] < len(knots) // 2:
        says += f", below a {reading.probe.variable} of {knots[acting[-1] + 1]:.3g} {unit}"
    turns = _turns(heights)
    if turns >= 2:
        says += f", rising and falling {turns} times over {knots[-1] - knots[0]:.3g} {unit}"
    return says


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
    heights = tuple(f"{probe.name}.{height}" for height in probe.heights)
    subset = ground.subset(parent.effects)
    active = Subset(subset.shared + heights, subset.each, curve=heights)
    end = retimed(frame, active, refit(frame, active, start, ground.whole, 40), ground)
    return Hypothesis((*parent.effects, probe), end, frame)


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


def _ranges(found: Identification) -> dict[str, tuple[float, float]]:
    """Range of each variable the rig has in the simulated motion, in SI units."""
    times = np.asarray(found.problem.observations.experiment.times)
    counts = np.asarray(found.problem.observations.experiment.count)
    moving = (found.motion.phase != HELD) & (np.arange(times.shape[1]) < counts[:, None])
    states = found.motion.states
    position, speed = (states[name][moving] for name in ("position", "speed"))
    ranges = {
        "position": (float(position.min()), float(position.max())),
        "speed": (0.0, float(np.abs(speed).max())),
    }
    if "tension" not in states:
        return ranges
    stretch = states["tension"] / found.parameters["stiffness"].value
    rate = np.gradient(stretch, axis=1) / np.gradient(times, axis=1)
    fast = float(np.quantile(np.abs(rate[moving]), 0.995))
    return ranges | {
        "tension": (0.0, float(states["tension"][moving].max())),
        "stretch": (0.0, float(stretch[moving].max())),
        "stretch rate": (-fast, fast),
    }


def is_probe(effect: type[Effect]) -> bool:
    """Whether an effect is a probe, which has no name to offer."""
    return issubclass(effect, Curve)
