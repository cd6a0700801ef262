"""What a grid of standard deviations between records says of the values that records share, and of their differences.

Few records tell little of how much they differ. The posterior of a shared value is therefore a mixture of normal ones,
a narrow one for each small standard deviation and a wide one for each large one: its tails are as heavy as those of
Student's distribution.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr, ndtri

from fibrefit.problem.estimate.evidence import FURTHER, MarginalLikelihood, end_told, further_in
from fibrefit.problem.linear_model.unknowns import held_places, own_precision, shared_coordinates
from fibrefit.problem.statement.matrices import equilibrated, inverses, scale_of
from fibrefit.problem.thresholds import END_TOLD
from fibrefit.study.summaries.check import Check
from fibrefit.study.summaries.results import BetweenRecordsSummary

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
            sd=middle,
            interval_95=(low, high),
            agree=evidence.agree(index),
            rms=float(np.sqrt(weight @ levels**2 / weight.sum())),
        )
    return found


def differ_within(evidence: MarginalLikelihood) -> list[Check]:
    """Whether the records differ by no more than is looked for at the most; nothing where nobody has to ask."""
    further = further_in(evidence.axes)
    if not further:
        return []
    told, unknowns = end_told(evidence), evidence.mode.unknowns
    worst = max(further, key=lambda index: float(told[index]))
    name = unknowns.names[unknowns.scattering[worst]]
    return [
        Check(
            name="records differ by no more than is looked for",
            passed=bool(told[worst] <= END_TOLD),
            statistic=float(told[worst]),
            threshold=END_TOLD,
            identifier="between_records",
            quantity="difference between records",
            facts={"parameter": name, "between": between(evidence)[name], "most": FURTHER[-1]},
        )
    ]


def _level_at(levels: np.ndarray, weight: np.ndarray, share: float) -> float:
    """Quantile of a standard deviation: zero with the weight of the first level, log-uniform around each other one.

    None is larger than the last level, where the prior ends.
    """
    logs = np.log(levels[1:])
    middles = 0.5 * (logs[1:] + logs[:-1])
    edges = np.concatenate([[1.5 * logs[0] - 0.5 * logs[1]], middles, logs[-1:]])
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
    if len(weight) == 1:
        return float(middle[0] + error[0] * ndtri(share))
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
        blocks = normal.blocks + np.diag(own_precision(unknowns, sigma))
        inverse = inverses(blocks)[:, :each]
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


def roots_of_posterior(evidence: MarginalLikelihood) -> np.ndarray:
    """Directions in which the values of each record may be off, a standard deviation each, independent of each other.

    At the most probable standard deviations between records.

    Returns
    -------
    (n_record, n_column, n_root)
        Of the values in `Unknowns.columns`, in SI units; their outer products add up to the covariance.
    """
    mode, best = evidence.mode, int(np.argmax(evidence.weight))
    unknowns, normal, place = mode.unknowns, mode.normal, mode.place
    n, each, deviating = len(unknowns.shared), len(unknowns.each), len(unknowns.scattering)
    blocks = normal.blocks + np.diag(own_precision(unknowns, evidence.grid[best]))
    inverse = inverses(blocks)
    inverse[held_places(unknowns)] = 0.0
    onto = np.zeros((n + each, each + deviating))
    onto[unknowns.own, np.arange(each + deviating)] = 1.0
    # A record's own values follow the shared ones, and are off by themselves.
    follow = np.eye(n + each, n) - onto @ inverse @ np.swapaxes(normal.cross, 1, 2)
    roots = np.concatenate([follow @ _root_of(evidence.covariance[best]), onto @ _root_of(inverse)], axis=-1)
    z = shared_coordinates(unknowns, place)
    unit = np.concatenate([unknowns.slope(z), np.broadcast_to(unknowns.size, (len(blocks), each))], axis=1)
    return roots * unit[:, :, None]


def _root_of(covariance: np.ndarray) -> np.ndarray:
    """Square roots of covariance matrices ``(..., n, n)``; of one that is none, as where a motion is lost, nothing."""
    covariance = np.where(np.isfinite(covariance).all(axis=(-2, -1), keepdims=True), covariance, 0.0)
    unit = scale_of(covariance)
    value, vector = np.linalg.eigh(equilibrated(covariance, unit))
    return unit[..., None] * vector * np.sqrt(np.maximum(value, 0.0))[..., None, :]
