"""What a grid of standard deviations between records says of the values that records share, and of their differences.

Few records tell little of how much they differ. The posterior of a shared value is therefore a mixture of normal ones,
a narrow one for each small standard deviation and a wide one for each large one: its tails are as heavy as those of
Student's distribution.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from fibrefit.problem.estimate.evidence import MarginalLikelihood
from fibrefit.problem.estimate.normal_equations import RIGID
from fibrefit.problem.estimate.schur import solved
from fibrefit.study.summaries.summaries import BetweenRecordsSummary

INSIDE_95 = (0.025, 0.975)
HALVINGS = 60
FARTHEST = 12.0
"""Distance in standard deviations at which quantiles are looked for."""
LIGHT = 1e-4
"""Weight on the grid, as a share of the largest, below which a point is left out of covariances."""


def between(evidence: MarginalLikelihood) -> dict[str, BetweenRecordsSummary]:
    """Standard deviations between records of all parameters that may deviate, by name."""
    unknowns, found = evidence.mode.unknowns, {}
    for index, column in enumerate(unknowns.scattering):
        levels, weight = evidence.levels(index)
        low, middle, high = (_level_at(levels, weight, share) for share in (INSIDE_95[0], 0.5, INSIDE_95[1]))
        found[unknowns.names[column]] = BetweenRecordsSummary(
            sd=middle, interval_95=(low, high), agree=evidence.agree(index)
        )
    return found


def _level_at(levels: np.ndarray, weight: np.ndarray, share: float) -> float:
    """Quantile of a standard deviation: zero with the weight of the first level, log-uniform around each other one."""
    logs = np.log(levels[1:])
    middles = 0.5 * (logs[1:] + logs[:-1])
    edges = np.concatenate([[1.5 * logs[0] - 0.5 * logs[1]], middles, [1.5 * logs[-1] - 0.5 * logs[-2]]])
    cumulated = np.cumsum(weight) / weight.sum()
    return 0.0 if share <= cumulated[0] else float(np.exp(np.interp(share, cumulated, edges)))


def quantiles(evidence: MarginalLikelihood, index: int) -> tuple[float, ...]:
    """Ends of the 95 % interval of one shared coordinate over all standard deviations between records."""
    middles, error = evidence.z[:, index], np.sqrt(np.maximum(evidence.covariance[:, index, index], 0.0))
    return tuple(mixture_quantile(evidence.weight, middles, error, share) for share in INSIDE_95)


def mixture_quantile(weight: np.ndarray, middle: np.ndarray, error: np.ndarray, share: float) -> float:
    """Quantile of a mixture of normal distributions, ``(n,)`` each."""
    used = weight > 0.0
    weight, middle, error = weight[used], middle[used], np.maximum(error[used], 1e-300)
    low, high = float((middle - FARTHEST * error).min()), float((middle + FARTHEST * error).max())
    for _ in range(HALVINGS):
        here = 0.5 * (low + high)
        below = weight @ ndtr((here - middle) / error) < share * weight.sum()
        low, high = (here, high) if below else (low, here)
    return 0.5 * (low + high)


def covariance_of_all(evidence: MarginalLikelihood) -> np.ndarray:
    """Covariance of shared coordinates and, record after record, of each one's own, for all standard deviations.

    Returns
    -------
    (n_shared + n_record * n_each,) * 2
        Of coordinates, and of own values in units of their sizes.
    """
    mode = evidence.mode
    unknowns, normal = mode.unknowns, mode.normal
    n, each, records = len(unknowns.shared), len(unknowns.each), len(normal.blocks)
    total = np.zeros((n + records * each,) * 2)
    kept = evidence.weight > LIGHT * evidence.weight.max()
    weight = evidence.weight[kept] / evidence.weight[kept].sum()
    mean = weight @ evidence.z[kept]
    for share, sigma, z, shared in zip(
        weight, evidence.grid[kept], evidence.z[kept], evidence.covariance[kept], strict=True
    ):
        precision = np.concatenate([np.zeros(each), np.maximum(sigma, RIGID) ** -2.0])
        blocks = normal.blocks + np.diag(precision)
        inverse = solved(blocks, np.broadcast_to(np.eye(blocks.shape[-1]), blocks.shape))[:, :each]
        own = inverse[:, :, :each]
        # How a record's best own values move with the shared ones.
        follow = -np.einsum("rij,rkj->rik", inverse, normal.cross).reshape(records * each, n)
        whole = np.concatenate([np.eye(n), follow])
        away = whole @ (z - mean)
        part = whole @ shared @ whole.T + np.outer(away, away)
        for r in range(records):
            here = slice(n + r * each, n + (r + 1) * each)
            part[here, here] += own[r]
        total += share * part
    return total


__all__ = ["INSIDE_95", "between", "covariance_of_all", "mixture_quantile", "quantiles"]
