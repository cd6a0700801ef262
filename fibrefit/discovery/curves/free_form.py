"""What a missing effect looks like when it has no name: fitting the probes and reading their curves."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from fibrefit.core.declarations import SI
from fibrefit.core.limits import check_time, in_time, time_left
from fibrefit.core.programs import longest_compilation
from fibrefit.discovery.curves.predicted import Looks, PromisedCurve, look_at
from fibrefit.discovery.curves.probes import COURSES, PROBES, Curve
from fibrefit.discovery.engine.candidates import JOBS_AT_ONCE, Hypothesis, fit_all, transferred, with_values
from fibrefit.discovery.engine.effort import PROMISING, course_time, may_be_worth
from fibrefit.discovery.engine.journal import digest
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.priors import Heights
from fibrefit.discovery.engine.supermodel import Supermodel, supermodel_of
from fibrefit.discovery.engine.thresholds import ACTS, NAMED
from fibrefit.discovery.search.inputs import linearised_about, overdispersion_corrected, overdispersion_of
from fibrefit.discovery.search.search import Search
from fibrefit.discovery.search.starts import may_do_better
from fibrefit.fitting.result import Identification
from fibrefit.laws.ports import PORTS


@dataclass(frozen=True)
class FittedCurve:
    """A fitted probe.

    Parameters
    ----------
    probe : Curve class
    knots, heights, errors : (n_knot,) in SI units
        Errors are those of the shape, see `shape_errors`.
    hypothesis : Hypothesis
    gain, predicted : float
        Logarithm of the Bayes factor over the model without the curve, and what slopes predicted of it.
    fitted : LaplaceFit
        The model with it.
    walk : Heights
        What is believed of its heights beforehand.
    """

    probe: type[Curve]
    knots: np.ndarray
    heights: np.ndarray
    errors: np.ndarray
    hypothesis: Hypothesis
    gain: float
    predicted: float
    fitted: LaplaceFit
    walk: Heights

    @property
    def predicted_well(self) -> bool:
        """Whether slopes predicted what it gains, as far as they have to for others to be left: they lead there."""
        return PROMISING * self.predicted <= self.gain and PROMISING * self.gain <= self.predicted


def probe_all(
    search: Search, parent: LaplaceFit, found: Identification, worth: float, least: float | None = None
) -> list[FittedCurve]:
    """Probes that explain more than a hypothesis does, best first.

    Where one over a state does, those over the course of a record are looked at, too, see `_with_course`.

    Parameters
    ----------
    search : Search
    parent : LaplaceFit
    found : Identification
        Of the model before the search: its motion tells the range of each variable.
    worth : float
        Logarithm of the Bayes factor that a probe has to gain.
    least : float, optional
        What its slopes have to predict for it to be fitted in full; as much unless said. Far from a good fit they
        predict less than there is.
    """
    looks = look_at(search, parent, found, tuple(PORTS))
    worthy = _worthy(search, parent, looks, worth, worth if least is None else least)
    held = _held(worthy, worth + looks.price, partial(_gain_about_itself, search, parent, looks.probes))
    curves = [_read(search, end, parent.log, looks) for end in held]
    return _with_course(search, parent, found, curves) if curves else []


def proposing(
    search: Search, parent: LaplaceFit, found: Identification, ports: Collection[str],
    probes: Sequence[type[Curve]] | None = None,
) -> list[FittedCurve]:  # fmt: skip
    """Probes that explain more than a hypothesis does where readings are linearised about that, best first.

    They propose laws, which are compared themselves: to linearise readings about a curve takes as long as all curves.

    Parameters
    ----------
    search : Search
    parent : LaplaceFit
    found : Identification
        Of the model before the search.
    ports : collection of str
    probes : sequence of Curve class, optional
        Nothing but these. Without, those over a state, and those over the course of a record that may explain more.

    Raises
    ------
    OutOfTimeError
        If not all could be drawn.
    """
    sets = (PROBES, COURSES) if probes is None else (probes,)
    return proposed_by(search, parent, look_at(search, parent, found, ports, *sets))


def proposed_by(search: Search, parent: LaplaceFit, looks: Looks) -> list[FittedCurve]:
    """Curves that slopes promise and that explain more than their parent, best first, see `proposing`.

    Raises
    ------
    OutOfTimeError
        If one could not be drawn that may do better than the best that was.
    """
    worthy = _worthy(search, parent, looks, NAMED, NAMED)
    if not worthy and len(looks.predicted) < len(looks.probes):
        check_time()  # Of curves that were not looked at nothing is known.
    drawn, most = {end.probe for end in worthy}, max((end.fitted.log - parent.log for end in worthy), default=0.0)
    if any(may_do_better(one.gain, most) for one in looks.predicted if one.probe not in drawn):
        check_time()
    return [_read(search, end, parent.log, looks) for end in worthy]


def _with_course(
    search: Search, parent: LaplaceFit, found: Identification, curves: Sequence[FittedCurve]
) -> list[FittedCurve]:
    """Curves over a state and those over the course of a record of which slopes predict more, the best first.

    A rig with the latter takes longer to simulate, so that most are not followed. Where none is, a stiffness that
    grows with the speed of the drive is told as a bump of the position: where the drive goes to and fro one goes with
    the other, and no test objects to what that leaves. They are told and propose laws; that something is missing was
    said before, by a curve over a state.
    """
    best = curves[0].gain

    def over_course() -> list[FittedCurve]:
        looks = look_at(search, parent, found, tuple(PORTS), COURSES)
        worthy = _worthy(search, parent, looks, best, best)
        check_time()
        return [_read(search, end, parent.log, looks) for end in worthy]

    share = course_time(time_left())
    if share < longest_compilation():
        return list(curves)
    # What the time does not suffice for takes nothing from what was drawn.
    further, _ = in_time(over_course, list[FittedCurve](), share)
    return sorted((*further, *curves), key=lambda one: -one.gain)


def _worthy(search: Search, parent: LaplaceFit, looks: Looks, worth: float, least: float) -> list[_End]:
    """Free curves that gain so many nats, their number paid for, of those that are predicted `least`, best first."""
    promising = [one for one in looks.predicted if may_be_worth(one.gain, least)]
    ends = [_corrected(search, parent, end) for end in _followed(search, parent, promising)]
    ends.sort(key=lambda end: -end.fitted.log)
    return [end for end in ends if end.fitted.log - parent.log - looks.price > worth]


def _corrected(search: Search, parent: LaplaceFit, end: _End) -> _End:
    """A curve with its gain divided by the overdispersion of the scores, as that of an effect is.

    What depends on where the signal lies looks like a law of it: errors of coarse readings, taken for noise, made a
    friction over the position of a driven rig gain 17 nats where there was none, with an overdispersion of 4.
    """
    heights = [f"{end.probe.name}.{height}" for height in end.probe.heights]
    overdispersion = overdispersion_of(search.inference, parent, end.fitted, heights)
    return end._replace(fitted=overdispersion_corrected(parent, end.fitted, overdispersion))


def _held(ends: Sequence[_End], worth: float, gain: Callable[[_End], float]) -> Sequence[_End]:
    """Curves from the first on that is worth as much about itself: one that holds says that something is missing."""
    return next((ends[i:] for i, end in enumerate(ends) if gain(end) > worth), ())


class _End(NamedTuple):
    """Where a probe led, what was taken of its heights beforehand, and what slopes predicted that it gains, in nats."""

    probe: type[Curve]
    fitted: LaplaceFit
    curve: Heights
    predicted: float = np.nan


def _gain_over_led(search: Search, parent: LaplaceFit, end: _End) -> float:
    """What a curve gains over its parent from where the curve led: a minimum that held that is no gap."""
    supermodel, found = end.fitted.supermodel, end.fitted.evidence.mode
    flat = _flattened(supermodel, end, end.fitted.local)
    led = search.inference.fitted(supermodel, parent.effects, flat, found.sigma, found.place.eta)
    return end.fitted.log - max(parent.log, led.log) - _relief(parent, end.fitted)


def _relief(parent: LaplaceFit, bent: LaplaceFit) -> float:
    """Nats by which values of a parent are nearer to what was expected of them once a curve is there.

    The mean height of a curve is all but free, a strength is not: of a gauge that is 7 N off, where half a newton is
    usual, a curve over the force takes the whole offset, and is 107 nats more probable for nothing that is missing.
    """
    before, after = (_surprise(one) for one in (parent, bent))
    return max(sum(cost - after[name] for name, cost in before.items()), 0.0)


def _surprise(one: LaplaceFit) -> dict[str, float]:
    """What the priors of shared values take off, in nats, by name."""
    unknowns, z = one.evidence.mode.unknowns, one.evidence.mode.place.z
    costs = 0.5 * np.diag(unknowns.precision) * (z - unknowns.mean) ** 2
    return dict(zip(unknowns.names[: len(z)], costs.tolist(), strict=True))


def _flattened(supermodel: Supermodel, end: _End, local: np.ndarray) -> np.ndarray:
    """Values with a curve of no height. The ranges of the variables stay: a curve without any is no curve."""
    return with_values(supermodel, local, {f"{end.probe.name}.{height}": 0.0 for height in end.probe.heights})


def _gain_about_itself(search: Search, parent: LaplaceFit, probes: Sequence[type[Curve]], end: _End) -> float:
    """What a curve gains where readings are linearised about it, see `confirmed`, or its parent is led by it."""
    # Heights that no walk holds, and a range that is free, lead nowhere.
    if (about := linearised_about(search, end.fitted, lead=False)) is None:
        return _gain_over_led(search, parent, end)
    supermodel = supermodel_of(search.task, (*parent.effects, *probes), about.supermodel.sensitivities)
    inference, old = about.search.inference, parent.evidence.mode
    with_it = transferred(supermodel, end.fitted.supermodel, end.fitted.local)
    local = transferred(supermodel, parent.supermodel, parent.local, _flattened(supermodel, end, with_it))
    lesser = inference.fitted(supermodel, parent.effects, local, old.sigma, old.place.eta)
    bend = partial(
        inference.with_curve, lesser, supermodel, with_it, end.probe, end.curve, inference.secant(supermodel)
    )
    key = "curve about itself", lesser, (end.probe.name, end.curve, with_it)
    bent: LaplaceFit = about.search.recalled(*key, bend, supermodel)()
    return bent.log - lesser.log - _relief(lesser, bent)


def curve_facts(curve: FittedCurve) -> dict[str, Any]:
    """What a sentence says of the curve: its range, where it acts and how often it turns."""
    probe, shape, knots = curve.probe, shape_of(curve), curve.knots
    acts = acting(shape)
    beyond = acts is not None and acts[1] == len(knots) - 1
    return {
        "curve": probe.says,
        "variable": probe.variable,
        "unit": SI[probe.variable],
        "height_unit": probe.unit,
        "heights": (float(shape.min()), float(shape.max())),
        "range": (float(knots[0]), float(knots[-1])),
        "beyond": float(knots[acts[0]]) if acts and beyond else None,
        "below": float(knots[acts[1]]) if acts and not beyond else None,
        "turns": _turns(shape),
    }


def shape_of(curve: FittedCurve) -> np.ndarray:
    """Heights without their median: what is the same everywhere, the model can do without the curve."""
    return curve.heights - np.median(curve.heights)


def acting(shape: np.ndarray) -> tuple[int, int] | None:
    """First and last knot between which a curve acts, where that is one end of its range."""
    half, there = len(shape) // 2, np.flatnonzero(np.abs(shape) > ACTS * np.abs(shape).max())
    if len(there) and there[0] >= half:
        return int(there[0]) - 1, len(shape) - 1
    if len(there) and there[-1] < half:
        return 0, int(there[-1]) + 1
    return None


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


def _followed(search: Search, parent: LaplaceFit, predicted: Sequence[PromisedCurve]) -> list[_End]:
    """Where probes lead, those that slopes predict most of first; none that are predicted far less than one gains."""
    found, left = list[_End](), sorted(predicted, key=lambda one: -one.gain)
    while left:
        # As many as run side by side; the next ones only if they may still do better.
        now, left = left[:JOBS_AT_ONCE], left[JOBS_AT_ONCE:]
        jobs = [
            search.recalled(
                "curve", parent, (one.probe.name, one.curve, digest(one.start)),
                partial(_bent, search, parent, one),
                one.supermodel,
            )
            for one in now
        ]  # fmt: skip
        ends = fit_all(jobs, lambda done: None)
        found += [
            _End(one.probe, end, one.curve, one.gain) for one, end in zip(now, ends, strict=True) if end is not None
        ]
        search.tell("probing for what has no name", 1.0 - len(left) / len(predicted))
        gain = max((end.fitted.log - parent.log for end in found), default=0.0)
        left = [one for one in left if may_do_better(one.gain, gain)]
    return found


def _bent(search: Search, parent: LaplaceFit, one: PromisedCurve) -> LaplaceFit:
    """A parent with a curve, from where slopes predict it."""
    return search.inference.with_curve(parent, one.supermodel, one.start, one.probe, one.curve, one.products())


def _read(search: Search, end: _End, before: float, looks: Looks) -> FittedCurve:
    probe, fitted, walk, predicted = end
    shared, n = fitted.shared, len(probe.heights)
    heights = np.array([shared[f"{probe.name}.{height}"] for height in probe.heights])
    errors = shape_errors(probe.size**2 * fitted.evidence.spread[-n:, -n:])
    knots = np.linspace(*looks.ranges[probe.variable], n)
    gain, predicted = fitted.log - before - looks.price, predicted - looks.price
    return FittedCurve(probe, knots, heights, errors, search.plain(fitted), gain, predicted, fitted, walk)


def shape_errors(spread: np.ndarray) -> np.ndarray:
    """Standard errors ``(n_knot,)`` of heights but for their level, which base parameters may take up as well.

    They are of the differences from the mean height, each counted by what the records see of it.

    Parameters
    ----------
    spread : (n_knot, n_knot)
        Covariance of the heights.
    """
    seen = 1.0 / np.maximum(np.diag(spread), 1e-300)
    without_level = np.eye(len(seen)) - seen / seen.sum()
    return np.sqrt(np.abs(np.diag(without_level @ spread @ without_level.T)))
