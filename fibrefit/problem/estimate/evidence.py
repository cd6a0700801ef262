"""How probable the records are under a model: Laplace's approximation, summed over how much records may differ.

Law
---
At the mode, ``ln Z(sigma) = -Q / 2 - ln det H / 2 + ln det P / 2`` with H the matrix of second derivatives and P that
of the priors, and Q what was found there, not what slopes predict beyond; ``Z`` is the mean of that over a grid of the
standard deviations between records. With probability one half records agree in all parameters. What makes them differ
in one hardly leaves the others alone: each standard deviation is else zero with a probability of one in ten, or
anything up to eight percent (six where many parameters may differ), uniform to one percent and log-uniform beyond: a
prior that is log-uniform throughout lets few records that happen to agree say that all would. All points of the grid
share the slopes found at the mode: that is algebra on small matrices.

Source
------
Tierney and Kadane, J. Am. Stat. Assoc. 81 (1986); Gelman, Bayesian Anal. 1 (2006) on priors of such deviations.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from fibrefit.problem.estimate.gauss_newton import EVERYTHING, MODE_TOLERANCE, Effort, mode
from fibrefit.problem.estimate.gram import Gram
from fibrefit.problem.estimate.normal_equations import RIGID, Place, PosteriorMode, Unknowns, own_precision
from fibrefit.problem.estimate.schur import eliminated, inverses, log_determinant, solved
from fibrefit.problem.statement.arrays import RAN_AWAY
from fibrefit.problem.thresholds import END_TOLD

LEVELS = (0.0, 0.0003, 0.001, 0.002, 0.004, 0.008, 0.016, 0.03, 0.08)
"""Standard deviations between records, as shares of a parameter."""
FEW_LEVELS = (0.0, 0.001, 0.004, 0.016, 0.06)
"""The same where many parameters deviate."""
FURTHER = (0.2, 0.5)
"""Levels beyond the last one, of parameters that the records of a fit make differ by that: see `end_told`."""
MANY = 3
AGREE = 0.5
"""Probability, before the records speak, that they agree in all parameters."""
ALONE = 0.1
"""Probability that they agree in one where they do not in all."""
USUAL = 0.01
"""Standard deviation up to which any is as probable as another."""
FIRST_SIGMA = 0.004
"""Standard deviation a search begins with."""
ROUNDS = 4


@dataclass(frozen=True)
class MarginalLikelihood:
    """Marginal likelihood of a model, and what the records say of their differences.

    Parameters
    ----------
    mode : PosteriorMode
        At the most probable standard deviations.
    log : float
        Logarithm of the marginal likelihood, up to what all models of the same records share.
    grid : (n_grid, n_scattering)
        Standard deviations.
    logs : (n_grid,)
        Logarithm of the marginal likelihood of each.
    weight : (n_grid,)
        Their probabilities.
    z : (n_grid, n_shared)
        Best shared coordinates of each.
    covariance : (n_grid, n_shared, n_shared)
    """

    mode: PosteriorMode
    log: float
    grid: np.ndarray
    logs: np.ndarray
    weight: np.ndarray
    z: np.ndarray
    covariance: np.ndarray

    @property
    def mean(self) -> np.ndarray:
        """Shared coordinates ``(n_shared,)``, the mean over all standard deviations."""
        return self.weight @ self.z

    @property
    def spread(self) -> np.ndarray:
        """Covariance ``(n_shared,) * 2`` of shared coordinates, what is not known of standard deviations included."""
        away = self.z - self.mean
        return np.einsum("g,gij->ij", self.weight, self.covariance) + np.einsum("g,gi,gj->ij", self.weight, away, away)

    def log_if(self, sigma: np.ndarray) -> float:
        """Logarithm of the marginal likelihood at a point ``(n_scattering,)`` of the grid, its prior included."""
        return float(self.logs[np.all(self.grid == sigma, axis=1)][0])

    def agree(self, index: int) -> float:
        """Probability that the records agree in a parameter that may deviate."""
        return float(self.weight[self.grid[:, index] == 0.0].sum())

    def levels(self, index: int) -> tuple[np.ndarray, np.ndarray]:
        """Standard deviations ``(n_level,)`` of one parameter between records, and their probabilities."""
        levels = np.unique(self.grid[:, index])
        return levels, np.array([self.weight[self.grid[:, index] == level].sum() for level in levels])


def laplace_evidence(
    unknowns: Unknowns,
    start: Place | PosteriorMode,
    gram: Gram,
    sigma: np.ndarray | None = None,
    tolerance: float = MODE_TOLERANCE,
    effort: Effort = EVERYTHING,
) -> MarginalLikelihood:
    """Mode and evidence, the standard deviations between records found on the way.

    Parameters
    ----------
    start : Place or PosteriorMode
        With its normal equations, where they are known.
    sigma : (n_scattering,), optional
        Standard deviations to begin with.
    tolerance, effort
        Of `mode`.
    """
    sigma = np.full(len(unknowns.scattering), FIRST_SIGMA) if sigma is None else sigma
    at = start
    seen: dict[int, MarginalLikelihood] = {}
    for _ in range(ROUNDS):
        found = mode(unknowns, at, gram, sigma, tolerance, effort)
        evidence = laplace(found)
        here = np.flatnonzero(np.all(evidence.grid == sigma, axis=1)).tolist()
        if found.objective > effort.worthless and seen:
            break  # other standard deviations led away from what was found
        if found.objective > effort.worthless:
            # Nothing is looked for from here: what it predicts of other standard deviations is no find, and far from a
            # minimum it may be anything.
            return _as_seen(evidence, {}, max((float(evidence.logs[i]) for i in here), default=np.inf))
        seen |= dict.fromkeys(here, evidence)
        evidence = _as_seen(evidence, seen)
        best = int(np.argmax(evidence.weight))
        if best in seen:
            return _as_seen(seen[best], seen)
        # Standard deviations are priors: what the records say of a place stays what it was.
        at, sigma = found, evidence.grid[best]
    best = max(seen, key=lambda i: float(seen[i].logs[i]))
    return _as_seen(seen[best], seen, float(seen[best].logs[best]))


def _as_seen(
    evidence: MarginalLikelihood, seen: Mapping[int, MarginalLikelihood], most: float = np.inf
) -> MarginalLikelihood:
    """Evidence in which what was found at standard deviations stands in place of what others predict of them.

    Parameters
    ----------
    seen : mapping of int to MarginalLikelihood
        By place in the grid.
    most : float
        A prediction of more than that does not count: the best that was found, where predictions failed time and again.
    """
    logs = np.where(evidence.logs > most, -np.inf, evidence.logs)
    z, covariance = evidence.z.copy(), evidence.covariance.copy()
    for i, there in seen.items():
        logs[i], z[i], covariance[i] = there.logs[i], there.z[i], there.covariance[i]
    return _over_grid(evidence.mode, evidence.grid, logs, z, covariance)


def most_probable_sigma(found: PosteriorMode) -> np.ndarray:
    """Standard deviations between records ``(n_scattering,)`` that slopes at a place say are most probable."""
    evidence = laplace(found)
    return np.asarray(evidence.grid[int(np.argmax(evidence.weight))])


@RAN_AWAY
def laplace(found: PosteriorMode, further: Collection[int] = ()) -> MarginalLikelihood:
    """MarginalLikelihood from the matrices at a mode; none where a motion is lost, of which there are no numbers.

    Parameters
    ----------
    further : collection of int
        Of `grid_of`.
    """
    unknowns, place, normal = found.unknowns, found.place, found.normal
    grid, prior = grid_of(len(unknowns.scattering), further)
    n = len(unknowns.each)
    # Deviations are counted from zero, so that none of them is large beside a small standard deviation.
    eta = np.concatenate([np.zeros((len(place.eta), n)), place.eta], axis=1)
    pulls = normal.pulls - np.einsum("rij,rj->ri", normal.blocks, eta)
    pull = normal.pull - np.einsum("rij,rj->i", normal.cross, eta)
    cost = normal.cost - 2.0 * np.sum(normal.pulls * eta) + np.einsum("ri,rij,rj->", eta, normal.blocks, eta)
    shared, away = normal.shared + unknowns.precision, place.z - unknowns.mean
    pull, cost = pull + unknowns.precision @ away, cost + float(away @ unknowns.precision @ away)
    precision = own_precision(unknowns, grid)
    blocks = normal.blocks + (precision[:, :, None] * np.eye(precision.shape[1]))[:, None]
    schur, right = eliminated(shared, normal.cross, blocks, pull, pulls)
    inverse = inverses(schur)
    dz = -np.einsum("gij,gj->gi", inverse, right)
    lowest = (
        cost
        + np.einsum("gi,gi->g", right, dz)
        - np.einsum("ri,gri->g", pulls, solved(blocks, np.broadcast_to(pulls, blocks.shape[:-1])[..., None])[..., 0])
    )
    log = -0.5 * (lowest + found.unmet) - 0.5 * (log_determinant(schur) + log_determinant(blocks).sum(axis=-1))
    log = log - len(place.eta) * np.sum(np.log(np.maximum(grid, RIGID)), axis=-1)
    inside = kept_inside(unknowns, place.z + dz, inverse)
    log = log + 0.5 * float(log_determinant(unknowns.precision)) + _inside_bounds(unknowns, place.z + dz, inverse)
    return _over_grid(found, grid, log + prior, inside, inverse)


def _over_grid(
    found: PosteriorMode, grid: np.ndarray, logs: np.ndarray, z: np.ndarray, covariance: np.ndarray
) -> MarginalLikelihood:
    logs = np.where(np.isnan(logs), -np.inf, logs)
    peak = logs.max()
    if np.isneginf(peak):
        return MarginalLikelihood(found, peak, grid, logs, np.full(len(grid), 1.0 / len(grid)), z, covariance)
    weight = np.exp(logs - peak)
    whole = float(peak + np.log(weight.sum()))
    return MarginalLikelihood(found, whole, grid, logs, weight / weight.sum(), z, covariance)


def kept_inside(unknowns: Unknowns, z: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Shared coordinates with those beyond their bounds at these, and the others most probable given that.

    Those that did not follow would be far from anything the records say, along a direction of which they say little: of
    a stiffness with a knee of its own at the end of the range, the stiffness at rest.

    Parameters
    ----------
    z : (n_grid, n_shared)
        Where the posterior would be highest without bounds.
    covariance : (n_grid, n_shared, n_shared)

    Source
    ------
    Conditional of a normal law: Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), A.2.
    """
    inside, beyond = np.clip(z, unknowns.lower, unknowns.upper), (z < unknowns.lower) | (z > unknowns.upper)
    for i in np.flatnonzero(beyond.any(axis=1) & np.isfinite(z).all(axis=1)):
        out = beyond[i]
        back = np.linalg.lstsq(covariance[i][np.ix_(out, out)], (inside[i] - z[i])[out], rcond=None)[0]
        moved = z[i] + covariance[i][:, out] @ back
        inside[i] = np.clip(np.where(out, inside[i], moved), unknowns.lower, unknowns.upper)
    return inside


def _inside_bounds(unknowns: Unknowns, z: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Logarithm of the share of the posterior that bounds leave, over the share they leave of the prior.

    Parameters
    ----------
    z : (n_grid, n_shared)
        Where the posterior would be highest without bounds.
    covariance : (n_grid, n_shared, n_shared)
    """
    total, prior = np.zeros(len(z)), np.sqrt(np.diag(inverses(unknowns.precision)))
    for j in np.flatnonzero(np.isfinite(unknowns.lower) | np.isfinite(unknowns.upper)):
        error = np.sqrt(np.maximum(covariance[:, j, j], 1e-300))
        ends = unknowns.lower[j], unknowns.upper[j]
        total += _log_share(*((end - z[:, j]) / error for end in ends))
        total -= _log_share(*((end - unknowns.mean[j]) / prior[j] for end in ends))
    return total


def _log_share(below: np.ndarray, above: np.ndarray) -> np.ndarray:
    """Logarithm of the probability of a standard normal value between limits."""
    from scipy.special import log_ndtr

    # Of the two tails the probability between is the difference of those on the side where both are small.
    low, high = np.where(below > 0.0, -above, below), np.where(below > 0.0, -below, above)
    whole, cut = log_ndtr(high), log_ndtr(low)
    # So far outside that a logarithm overflows, bounds leave nothing.
    beyond = np.minimum(np.where(np.isneginf(whole), -np.inf, cut) - np.where(np.isneginf(whole), 0.0, whole), -1e-300)
    return np.asarray(whole + np.log(-np.expm1(beyond)))


def grid_of(number: int, further: Collection[int] = ()) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations ``(n_grid, number)`` and the logarithms of their probabilities beforehand.

    Parameters
    ----------
    further : collection of int
        Parameters, of `number`, whose standard deviations go on to those of `FURTHER`.
    """
    usual = LEVELS if number <= MANY else FEW_LEVELS
    each = [(*usual, *FURTHER) if i in further else usual for i in range(number)]
    points = list(product(*each))
    grid = np.array(points, dtype=float).reshape(len(points), number)
    if not number:
        return grid, np.zeros(1)
    shares = [_of_levels(levels)[np.searchsorted(levels, column)] for levels, column in zip(each, grid.T, strict=True)]
    alike = np.all(grid == 0.0, axis=1)
    share = np.prod(shares, axis=0)
    return grid, np.log(np.where(alike, AGREE, (1.0 - AGREE) * share / (1.0 - ALONE**number)))


def _of_levels(levels: tuple[float, ...]) -> np.ndarray:
    """Probabilities ``(n_level,)`` of standard deviations of one parameter, where records do not agree in all."""
    some = np.array(levels[1:])
    size = np.gradient(np.log(some)) * np.minimum(some / USUAL, 1.0)
    return np.concatenate([[ALONE], (1.0 - ALONE) * size / size.sum()])


def further_in(grid: np.ndarray) -> list[int]:
    """Parameters whose standard deviations in a grid ``(n_grid, number)`` go on to those of `FURTHER`."""
    return np.flatnonzero(grid.max(axis=0, initial=0.0) >= FURTHER[-1]).tolist()


def prior_of_grid(grid: np.ndarray) -> np.ndarray:
    """Logarithms of the probabilities beforehand, ``(n_grid,)``, of a grid of standard deviations ``(n_grid, number)``.

    Of `grid_of`, however far its parameters go.
    """
    return grid_of(grid.shape[1], further_in(grid))[1]


def end_told(evidence: MarginalLikelihood) -> np.ndarray:
    """How many times as probable as beforehand records make the last level of each parameter, ``(n_scattering,)``.

    Where they say nothing that is one, however much the prior leaves there.
    """
    grid = evidence.grid
    prior, last = np.exp(prior_of_grid(grid)), grid == grid.max(axis=0)
    return np.asarray(evidence.weight @ last / (prior @ last))


def beyond_levels(evidence: MarginalLikelihood) -> list[int]:
    """Parameters, of those that may deviate, in which records may well differ by more than the grid goes to."""
    return np.flatnonzero(end_told(evidence) > END_TOLD).tolist()


def as_far_as_told(evidence: MarginalLikelihood) -> MarginalLikelihood:
    """The evidence at the same mode over a grid that goes on where records may well differ by more than it goes to.

    As it is where they do not. Its logarithm stays that over the grid that all models have alike.
    """
    further = beyond_levels(evidence)
    wide = replace(laplace(evidence.mode, further), log=evidence.log) if further else evidence
    return wide if np.isfinite(wide.spread).all() else evidence
