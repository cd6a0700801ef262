"""The weight of a mode: the integral of the posterior density over it, from its own draws."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fibrefit.sampling.approximation import Approximation
from fibrefit.sampling.chains.ensembles import ChainHistory

MOST_DRAWS = 2000


@dataclass(frozen=True)
class Evidence:
    """Logarithm of a marginal likelihood, or of a mode's share of it.

    Parameters
    ----------
    error : float
        Standard error.
    """

    log_value: float
    error: float


def bridge(log_density: Callable[[np.ndarray], np.ndarray], course: ChainHistory, seed: int) -> Evidence | None:
    """Bridge sampling between the draws and a normal distribution fitted to other draws.

    The first half of the steps shapes the normal distribution, the second half is compared with it.

    Parameters
    ----------
    log_density : callable ``(n_point, n) -> (n_point,)``

    Returns
    -------
    Evidence or None
        None where a run that was cut short has too few draws for it.

    Source
    ------
    Meng and Wong, Statistica Sinica 6 (1996); error: Fruehwirth-Schnatter, Econometrics Journal 7 (2004).
    """
    points, densities = course.kept, course.kept_log_density
    half, size = points.shape[1] // 2, points.shape[-1]
    # Half of the draws are worth half of what all are.
    worth = 0.5 * float(np.minimum(course.mixing.ess_bulk, course.mixing.ess_tail).min())
    if not worth > 0.0:
        return None
    shape = points[:, :half].reshape(-1, size)
    normal = Approximation(shape.mean(axis=0), np.cov(shape.T).reshape(size, size), 0.0)
    random = np.random.default_rng(seed)
    drawn, its_density = points[:, half:].reshape(-1, size), densities[:, half:].ravel()
    chosen = random.choice(len(drawn), min(MOST_DRAWS, len(drawn)), replace=False)
    drawn, its_density = drawn[chosen], its_density[chosen]
    proposed = normal.centre + random.standard_normal(drawn.shape) @ normal.root.T
    of_drawn = its_density - _log_normal(normal, drawn)
    of_proposed = log_density(proposed) - _log_normal(normal, proposed)
    # Those that are taken of them are worth no more than their number.
    worth = worth * len(drawn) / (worth + len(drawn))
    return _bridge(of_drawn, of_proposed, worth / len(drawn))


def _log_normal(normal: Approximation, points: np.ndarray) -> np.ndarray:
    return -0.5 * normal.distance(points) ** 2 - normal.log_evidence


def _bridge(of_drawn: np.ndarray, of_proposed: np.ndarray, independent: float) -> Evidence:
    """Optimal bridge between log ratios of density and proposal, at draws of the one and of the other."""
    shift = float(np.median(of_drawn))
    first, second = (np.exp(np.clip(ratio - shift, -600.0, 600.0)) for ratio in (of_drawn, of_proposed))
    share = independent * len(first) / (independent * len(first) + len(second))
    value = 1.0
    for _ in range(1000):
        upper = second / (share * second + (1.0 - share) * value)
        lower = 1.0 / (share * first + (1.0 - share) * value)
        value, before = float(upper.mean() / lower.mean()), value
        if abs(np.log(value / before)) < 1e-10:
            break
    of_second = upper.var() / upper.mean() ** 2 / len(second)
    of_first = lower.var() / lower.mean() ** 2 / (independent * len(first))
    return Evidence(shift + float(np.log(value)), float(np.sqrt(of_first + of_second)))
