"""Values that lie at a bound: whether the records would have them beyond it, or chance brought them there.

A friction that truly is zero is found within a tenth of an error of zero in half of all fits, as no estimate goes
below. What tells such a value from one that a wrong bound stops is how far it would go if there were no bound.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fibrefit.fitting.error_bars import error_bars
from fibrefit.fitting.estimates import GlsEstimate
from fibrefit.fitting.result import Estimate
from fibrefit.fitting.thresholds import CHANCE
from fibrefit.fitting.uncertainty import Scores
from fibrefit.problem.estimate.evidence import MarginalLikelihood
from fibrefit.problem.statement.layout import Layout
from fibrefit.problem.statement.matrices import least_squares
from fibrefit.problem.statement.problem import Problem
from fibrefit.study.summaries.check import Check

BOUNDS = "bounds"
"""Identifier of the check of these."""


class AtBound(NamedTuple):
    """A value at a bound.

    Parameters
    ----------
    name : str
        With its record, as in `Layout.free_names`.
    unit : str
    limit : float
        The bound, in SI units.
    end : float
        The other end of its 95 % interval, in SI units.
    above : bool
        Whether values lie above the bound.
    pull : float
        How far beyond the bound it would lie without it, in the standard errors that it would have there.
    """

    name: str
    unit: str
    limit: float
    end: float
    above: bool
    pull: float


def at_bounds(layout: Layout, found: Sequence[Estimate], pulls: Callable[[], np.ndarray]) -> tuple[AtBound, ...]:
    """The values that lie at a bound, and how far they would go beyond it.

    Parameters
    ----------
    found : sequence of Estimate
        Those of the free values, in the order of the layout; others may follow.
    pulls : callable
        Steps ``(n_free,)`` to where the values would lie without bounds, upwards, in the standard errors they would
        have there; asked only where a value lies at a bound.
    """
    stopped = [i for i in range(layout.size) if found[i].found.at_bound]
    steps = pulls() if stopped else np.zeros(0)
    places = []
    for i in stopped:
        slot, one = layout.entries[i][0], found[i].found
        limits = slot.range
        above = one.value - limits.lower <= limits.upper - one.value
        low, high = one.interval_95 or (limits.lower, limits.upper)
        limit, end = (limits.lower, high) if above else (limits.upper, low)
        pull = float(-steps[i] if above else steps[i])
        if one.std_error:
            # Nothing stops what a record has for itself in a likelihood: it lies as far beyond as it would.
            pull = max(pull, (limit - one.value if above else one.value - limit) / one.std_error)
        end = float(np.clip(end, limits.lower, limits.upper))
        places.append(AtBound(layout.free_names[i], slot.unit, limit, end, above, pull))
    return tuple(places)


def pulls_of_plain(problem: Problem, scores: Scores, rate: float) -> np.ndarray:
    """Steps ``(n_free,)`` to the minimum of plain least squares without bounds, over the standard errors there.

    What a bound keeps from being explained makes errors at the bound larger: they are those of the residuals that
    slopes predict beyond it.

    Parameters
    ----------
    rate : float
        Samples a second, in Hz.
    """
    normal, gradient = scores.normal_matrix(), scores.gradient()
    if not (np.isfinite(normal).all() and np.isfinite(gradient).all()):
        return np.zeros(scores.size)
    step = -least_squares(normal, gradient)
    # What is held in a record has a place beyond all free values.
    local = np.concatenate([step, np.zeros(2)])[scores.columns]
    there = scores.residuals + np.einsum("rcti,ri->rct", scores.slopes, local)
    bars = error_bars(problem, replace(scores, residuals=np.where(scores.residuals != 0.0, there, 0.0)), rate)
    return _over(step, bars.errors[bars.method])


def pulls_of_gls(gls: GlsEstimate) -> np.ndarray:
    """The same of the likelihood; nothing bounds what each record has for itself.

    Records that a bound keeps from their common value seem to differ: how much they do is weighed anew without it.
    """
    found, layout = gls.evidence.mode, gls.seen.problem.layout
    endless = np.full(len(found.unknowns.shared), np.inf)
    unbounded = replace(found, unknowns=replace(found.unknowns, lower=-endless, upper=endless))
    with np.errstate(all="ignore"):
        free = MarginalLikelihood.of(unbounded, gls.evidence.axes)
        shared = _over(free.mean - gls.evidence.mean, np.sqrt(np.diag(free.spread)))
    # Of a strength whose typical value lies below its null the coordinate falls as it rises.
    shared = shared * np.sign(found.unknowns.slope(found.place.z))
    places, pulls = found.unknowns.places_in(layout)[0], np.zeros(layout.size)
    pulls[layout.shared_places] = shared[places[layout.shared_places]]
    return pulls


def _over(step: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """Steps in standard errors; what has no error is not visible, and no record asks for anything."""
    known = np.isfinite(step) & np.isfinite(errors) & (errors > 0.0)
    return np.where(known, step, 0.0) / np.where(known, errors, 1.0)


def inside_bounds(places: Sequence[AtBound]) -> Check:
    """Whether the records ask for no value beyond a bound, chance allowed for."""
    beyond = tuple(one.name for one in places if one.pull > CHANCE)
    return Check(
        name="no parameter is stopped by a bound",
        passed=not beyond,
        statistic=max((one.pull for one in places), default=0.0),
        threshold=CHANCE,
        identifier=BOUNDS,
        quantity="distance of the parameters from their bounds",
        facts={"parameters": beyond, "by_chance": tuple(one for one in places if one.pull <= CHANCE)},
    )


def with_ends(check: Check, layout: Layout, found: Sequence[Estimate]) -> Check:
    """That check with the ends of the intervals that are reported, which are often wider than those it was made of."""
    ends = {name: one.found.interval_95 for name, one in zip(layout.free_names, found, strict=False)}
    told = tuple(
        one if (interval := ends.get(one.name)) is None else one._replace(end=interval[1 if one.above else 0])
        for one in check.facts["by_chance"]
    )
    return check.model_copy(update={"facts": {**check.facts, "by_chance": told}})
