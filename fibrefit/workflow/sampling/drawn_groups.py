"""What is drawn of a posterior besides its draws, as groups of ``result.h5``: traces, and densities of priors."""

from __future__ import annotations

import numpy as np

from fibrefit.plots.overlay import POINTS
from fibrefit.plots.traces import SPREAD
from fibrefit.sampling.density.prior import Prior
from fibrefit.sampling.posterior import Posterior
from fibrefit.sampling.thresholds import PRIOR_MATTERS
from fibrefit.study.summaries.part import Variable

MOST_STEPS = 400
"""Steps of which the traces are kept, evenly over the run: more than can be distinguished in a figure."""


def drawn_groups(posterior: Posterior) -> dict[str, dict[str, Variable]]:
    """Groups ``traces`` and ``prior_density``."""
    return {"traces": _traces(posterior), "prior_density": _prior_density(posterior)}


def _traces(posterior: Posterior) -> dict[str, Variable]:
    course, target = posterior.course, posterior.target
    number = course.points.shape[1]
    steps = np.unique(np.linspace(0, number - 1, min(number, MOST_STEPS)).round().astype(int))
    points = course.points[:, steps]
    values = target.values(points.reshape(-1, target.size)).reshape(points.shape)
    low, middle, high = np.moveaxis(np.quantile(values, [SPREAD[0], 0.5, SPREAD[1]], axis=2), -1, 1)
    dims, of_what = ("value", "chain", "step"), "of the walkers of an ensemble, in SI units of the value."
    return {
        "value": Variable(np.array(target.names, dtype=object), ("value",)),
        "step": Variable(steps + 1, ("step",), doc="From 1, warm-up included."),
        "low": Variable(low, dims, doc=f"Quantile {SPREAD[0]:g} {of_what}"),
        "median": Variable(middle, dims, doc=f"Median {of_what}"),
        "high": Variable(high, dims, doc=f"Quantile {SPREAD[1]:g} {of_what}"),
    }


def _prior_density(posterior: Posterior) -> dict[str, Variable]:
    """Densities over what is worth seeing of each value; no numbers where a prior is improper."""
    target, draws = posterior.target, posterior.draws.reshape(-1, posterior.target.size)
    grids, densities = [], []
    for i, (name, prior) in enumerate(zip(target.names, target.priors, strict=True)):
        grid = np.linspace(*_prior_ends(draws[:, i], prior, posterior.marginals[name].prior_share), POINTS + 1)
        grids.append(0.5 * (grid[1:] + grid[:-1]))
        # The slope of the distribution function.
        slope = np.diff(prior.cdf(grid)) / np.diff(grid) if prior.proper else np.full(POINTS, np.nan)
        densities.append(slope)
    dims = ("value", "point")
    return {
        "value": Variable(np.array(target.names, dtype=object), ("value",)),
        "at": Variable(np.array(grids), dims, doc="In SI units of the value."),
        "density": Variable(np.array(densities), dims, doc="Per SI unit of the value."),
    }


WIDER = 3.0
"""Half-width of the axis in half-widths of the posterior: enough to see the prior go on beside it."""


def _prior_ends(values: np.ndarray, prior: Prior, share: float) -> tuple[float, float]:
    """Ends of the axis in SI units: around the posterior, or the whole prior where the data tell little."""
    low, middle, high = np.quantile(values, [0.001, 0.5, 0.999])
    if prior.proper and share >= PRIOR_MATTERS:
        first, last = prior.quantile(np.array([0.005, 0.995]))
        return min(float(first), float(low)), max(float(last), float(high))
    half = max(WIDER * 0.5 * float(high - low), 1e-9 * abs(float(middle)), 1e-300)
    return max(float(middle) - half, prior.lower), min(float(middle) + half, prior.upper)
