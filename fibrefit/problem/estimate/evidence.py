"""How probable the records are under a model: Laplace's approximation, summed over how much records may differ.

The sum tells of the values that records share, and of their differences, as well. Few records tell little of how much
they differ. The posterior of a shared value is therefore a mixture of normal ones, a narrow one for each small standard
deviation and a wide one for each large one: its tails are as heavy as those of Student's distribution.

Law
---
At the mode, ``ln Z(sigma) = -Q / 2 - ln det H / 2 + ln det P / 2`` with H the matrix of second derivatives and P that
of the priors, and Q what was found there, not what slopes predict beyond; ``Z`` is the mean of that over a grid of the
standard deviations between records. All points of the grid share the slopes found at the mode: that is algebra on small
matrices.

Prior of the grid: with probability one half records agree in all parameters. What makes them differ in one hardly
leaves the others alone: each standard deviation is else zero with a probability of one in ten, or anything up to eight
percent (six where many parameters may differ), uniform to one percent and log-uniform beyond: a prior that is
log-uniform throughout lets few records that happen to agree say that all would.

R records tell the logarithm of a standard deviation to ``1 / sqrt(2 (R - 1))`` at best. Models are compared on one
grid, whose levels mostly lie a factor of two apart; what a fit reports is summed over one that is halved, where the
weight is, until its steps are fit for that.

Source
------
Tierney and Kadane, J. Am. Stat. Assoc. 81 (1986) on the approximation; Gelman, Bayesian Anal. 1 (2006) on priors of
such deviations; Trefethen and Weideman, SIAM Rev. 56 (2014) on the trapezoidal rule, of which a normal law with steps
of two standard deviations leaves an error of 1.4 percent.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
from scipy.special import log_ndtr, ndtr, ndtri

from fibrefit.core.arrays import RAN_AWAY
from fibrefit.core.matrices import equilibrated, inverses, log_determinant, scale_of, solved
from fibrefit.problem.estimate.gauss_newton import EVERYTHING, FIRST_SIGMA, MODE_TOLERANCE, Effort, mode
from fibrefit.problem.linear_model.normal_equations import PosteriorMode, eliminated
from fibrefit.problem.linear_model.unknowns import RIGID, Gram, Place, Unknowns
from fibrefit.problem.thresholds import LAST_LEVEL_RATIO
from fibrefit.study.summaries.check import Check
from fibrefit.study.summaries.results import BetweenRecordsSummary

SIGMA_LEVELS = (0.0, 0.0003, 0.001, 0.002, 0.004, 0.008, 0.016, 0.03, 0.08)
"""Standard deviations between records, as shares of a parameter."""
FEW_SIGMA_LEVELS = (0.0, 0.001, 0.004, 0.016, 0.06)
"""The same where many parameters deviate."""
EXTENSION = (0.2, 0.5)
"""Levels beyond the last one, of parameters that the records of a fit make differ by that: see `last_level_ratios`."""
MANY = 3
"""Parameters that may deviate at the most for the finer of these levels."""
AGREE = 0.5
"""Probability, before the records speak, that they agree in all parameters."""
ALONE = 0.1
"""Probability that they agree in one where they do not in all."""
UNIFORM_TO = 0.01
"""Standard deviation up to which any is as probable as another."""
WIDEST_STEP = 2.0
"""Step of the logarithm, over how well that can be known, above which a cell of weight is halved."""
WEIGHS, WEIGHTLESS = 1e-4, 1e-7
"""Weight of a level or point as a share of the largest: that which cells are halved for and that counts in covariances,
and that below which a level goes."""
MOST_POINTS = 40_000
"""Points of a grid that is halved no further."""
ROUNDS = 4
INSIDE_95 = (0.025, 0.975)


@dataclass(frozen=True)
class SigmaAxis:
    """Levels of the standard deviation of one parameter.

    Parameters
    ----------
    levels : (n_level,)
        The first is zero.
    widths : (n_level - 1,)
        Of the cells of the others, in the logarithm.
    whole : float
        What the density beforehand adds up to over the cells of the grid this began as.
    """

    levels: np.ndarray
    widths: np.ndarray
    whole: float

    @classmethod
    def of(cls, levels: Sequence[float]) -> SigmaAxis:
        """Cells that end in the middle between levels, those at the ends as far beyond them."""
        some = np.array(levels[1:])
        widths = np.gradient(np.log(some))
        return cls(np.array(levels), widths, float(_density(some, widths).sum()))

    @property
    def shares(self) -> np.ndarray:
        """Probabilities ``(n_level,)`` of standard deviations, where records do not agree in all."""
        return np.concatenate([[ALONE], (1.0 - ALONE) * _density(self.levels[1:], self.widths) / self.whole])

    def halved(self, weight: np.ndarray, step: float) -> SigmaAxis:
        """Levels in the middle of cells that are wider than a step and have weight; without those that have none.

        Parameters
        ----------
        weight : (n_level,)
            Of each level, that of a model included.
        step : float
            Of the logarithm.

        Returns
        -------
        SigmaAxis
            Itself, where nothing is too wide.
        """
        logs, heavy = np.log(self.levels[1:]), weight[1:] > WEIGHS * weight.max()
        gap = np.diff(logs)
        split = np.flatnonzero((gap > step) & (heavy[1:] | heavy[:-1]))
        if not split.size:
            return self
        widths = self.widths.copy()
        np.subtract.at(widths, np.concatenate([split, split + 1]), np.tile(0.25 * gap[split], 2))
        # Levels that weigh anything, or lie beside one that does; zero and the last one, which are asked about, stay.
        some = weight > WEIGHTLESS * weight.max()
        kept = some.copy()
        kept[1:] |= some[:-1]
        kept[:-1] |= some[1:]
        kept[[0, -1]] = True
        kept = kept[1:]
        middle = np.exp(0.5 * (logs[split] + logs[split + 1]))
        levels = np.concatenate([self.levels[1:][kept], middle])
        order = np.argsort(levels)
        found = np.concatenate([widths[kept], 0.5 * gap[split]])[order]
        return SigmaAxis(np.concatenate([[0.0], levels[order]]), found, self.whole)


def _density(sigma: np.ndarray, widths: np.ndarray) -> np.ndarray:
    return np.asarray(widths * np.minimum(sigma / UNIFORM_TO, 1.0))


def usual_axes(number: int, further: Collection[int] = ()) -> tuple[SigmaAxis, ...]:
    """Levels on which models are compared.

    Parameters
    ----------
    number : int
        Of parameters that may deviate.
    further : collection of int
        Those whose standard deviations go on to those of `EXTENSION`.
    """
    usual = SIGMA_LEVELS if number <= MANY else FEW_SIGMA_LEVELS
    return tuple(SigmaAxis.of((*usual, *EXTENSION) if i in further else usual) for i in range(number))


def grid_over(axes: Sequence[SigmaAxis]) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations ``(n_grid, n_axis)`` and the logarithms of their probabilities beforehand, ``(n_grid,)``."""
    if not axes:
        return np.zeros((1, 0)), np.zeros(1)
    grid = np.stack([column.ravel() for column in np.meshgrid(*(axis.levels for axis in axes), indexing="ij")], axis=1)
    share = reduce(np.multiply.outer, [axis.shares for axis in axes]).ravel()
    alike = np.all(grid == 0.0, axis=1)
    return grid, np.log(np.where(alike, AGREE, (1.0 - AGREE) * share / (1.0 - ALONE ** len(axes))))


def finest_step(records: int) -> float:
    """Step of the logarithm that a grid needs at the most, of so many records."""
    return WIDEST_STEP / float(np.sqrt(2.0 * max(records - 1, 1)))


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
    axes : tuple of SigmaAxis
        Of the grid, one for each parameter that may deviate.
    """

    mode: PosteriorMode
    log: float
    grid: np.ndarray
    logs: np.ndarray
    weight: np.ndarray
    z: np.ndarray
    covariance: np.ndarray
    axes: tuple[SigmaAxis, ...] = ()

    @classmethod
    @RAN_AWAY
    def of(cls, found: PosteriorMode, axes: Sequence[SigmaAxis] | None = None) -> MarginalLikelihood:
        """From the matrices at a mode; none where a motion is lost, of which there are no numbers.

        Parameters
        ----------
        axes : sequence of SigmaAxis, optional
            Of the grid; that on which models are compared, if not given.
        """
        unknowns, place, normal = found.unknowns, found.place, found.normal
        axes = usual_axes(len(unknowns.scattering)) if axes is None else tuple(axes)
        grid, prior = grid_over(axes)
        n = len(unknowns.each)
        # Deviations are counted from zero, so that none of them is large beside a small standard deviation.
        eta = np.concatenate([np.zeros((len(place.eta), n)), place.eta], axis=1)
        pulls = normal.pulls - np.einsum("rij,rj->ri", normal.blocks, eta)
        pull = normal.pull - np.einsum("rij,rj->i", normal.cross, eta)
        cost = normal.cost - 2.0 * np.sum(normal.pulls * eta) + np.einsum("ri,rij,rj->", eta, normal.blocks, eta)
        shared, away = normal.shared + unknowns.precision, place.z - unknowns.mean
        pull, cost = pull + unknowns.precision @ away, cost + float(away @ unknowns.precision @ away)
        precision = unknowns.own_precision(grid)
        blocks = normal.blocks + (precision[:, :, None] * np.eye(precision.shape[1]))[:, None]
        schur, right = eliminated(shared, normal.cross, blocks, pull, pulls)
        inverse = inverses(schur)
        dz = -np.einsum("gij,gj->gi", inverse, right)
        own = solved(blocks, np.broadcast_to(pulls, blocks.shape[:-1])[..., None])[..., 0]
        lowest = cost + np.einsum("gi,gi->g", right, dz) - np.einsum("ri,gri->g", pulls, own)
        # What slopes predict beyond the mode and no step brings is no evidence: `unmet` takes it off.
        log = -0.5 * (lowest + found.unmet) - 0.5 * (log_determinant(schur) + log_determinant(blocks).sum(axis=-1))
        log = log - len(place.eta) * np.sum(np.log(np.maximum(grid, RIGID)), axis=-1)
        inside = conditioned_on_bounds(unknowns, place.z + dz, inverse)
        log = log + 0.5 * float(log_determinant(unknowns.precision)) + _inside_bounds(unknowns, place.z + dz, inverse)
        return cls._over_grid(found, grid, log + prior, inside, inverse, axes)

    @classmethod
    def _over_grid(
        cls, found: PosteriorMode, grid: np.ndarray, logs: np.ndarray, z: np.ndarray, covariance: np.ndarray,
        axes: tuple[SigmaAxis, ...] = (),
    ) -> MarginalLikelihood:  # fmt: skip
        logs = np.where(np.isnan(logs), -np.inf, logs)
        peak = logs.max()
        if np.isneginf(peak):
            return cls(found, peak, grid, logs, np.full(len(grid), 1.0 / len(grid)), z, covariance, axes)
        weight = np.exp(logs - peak)
        whole = float(peak + np.log(weight.sum()))
        return cls(found, whole, grid, logs, weight / weight.sum(), z, covariance, axes)

    @property
    def prior(self) -> np.ndarray:
        """Logarithms of the probabilities beforehand of the points of the grid, ``(n_grid,)``."""
        return grid_over(self.axes)[1]

    @property
    def most_probable_sigma(self) -> np.ndarray:
        """Standard deviations between records ``(n_scattering,)`` that are most probable."""
        return np.asarray(self.grid[int(np.argmax(self.weight))])

    @property
    def mean(self) -> np.ndarray:
        """Shared coordinates ``(n_shared,)``, the mean over all standard deviations."""
        return self.weight @ self.z

    @property
    def spread(self) -> np.ndarray:
        """Covariance ``(n_shared,) * 2`` of shared coordinates, what is not known of standard deviations included."""
        away = self.z - self.mean
        return np.einsum("g,gij->ij", self.weight, self.covariance) + np.einsum("g,gi,gj->ij", self.weight, away, away)

    def agree(self, index: int) -> float:
        """Probability that the records agree in a parameter that may deviate."""
        return float(self.weight[self.grid[:, index] == 0.0].sum())

    def log_if(self, sigma: np.ndarray) -> float:
        """Logarithm of the marginal likelihood at a point ``(n_scattering,)`` of the grid, its prior included."""
        return float(self.logs[np.all(self.grid == sigma, axis=1)][0])

    def levels(self, index: int) -> tuple[np.ndarray, np.ndarray]:
        """Standard deviations ``(n_level,)`` of one parameter between records, and their probabilities."""
        levels = np.unique(self.grid[:, index])
        return levels, np.array([self.weight[self.grid[:, index] == level].sum() for level in levels])

    def _as_seen(self, seen: Mapping[int, MarginalLikelihood], most: float = np.inf) -> MarginalLikelihood:
        """Evidence in which what was found at standard deviations stands in place of what others predict of them.

        Parameters
        ----------
        seen : mapping of int to MarginalLikelihood
            By place in the grid.
        most : float
            A prediction of more than that does not count: the best found, where predictions failed time and again.
        """
        logs = np.where(self.logs > most, -np.inf, self.logs)
        z, covariance = self.z.copy(), self.covariance.copy()
        for i, there in seen.items():
            logs[i], z[i], covariance[i] = there.logs[i], there.z[i], there.covariance[i]
        return self._over_grid(self.mode, self.grid, logs, z, covariance, self.axes)

    @property
    def last_level_ratios(self) -> np.ndarray:
        """How many times as probable as beforehand records make the last level of each parameter, ``(n_scattering,)``.

        Where they say nothing that is one, however much the prior leaves there.
        """
        grid = self.grid
        prior, last = np.exp(self.prior), grid == grid.max(axis=0)
        return np.asarray(self.weight @ last / (prior @ last))

    @property
    def beyond_levels(self) -> list[int]:
        """Parameters, of those that may deviate, in which records may well differ by more than the grid goes to."""
        return np.flatnonzero(self.last_level_ratios > LAST_LEVEL_RATIO).tolist()

    def extended(self) -> MarginalLikelihood:
        """The evidence at the same mode over a grid that goes on where records may well differ by more than it goes to.

        As it is where they do not. Its logarithm stays that over the grid that all models have alike.
        """
        further = self.beyond_levels
        axes = usual_axes(len(self.axes), further)
        return self._weighed_over(axes, self._unforeseen(), self) if further else self

    def refined(self) -> MarginalLikelihood:
        """The evidence at the same mode over a grid as fine as so many records tell how much they differ.

        As far as `extended` goes. Its logarithm stays that over the grid that all models have alike. Where slopes at
        the mode promised more than was found, what they promise between the points of the grid is not asked.
        """
        found, step, unforeseen = self.extended(), finest_step(len(self.mode.place.eta)), self._unforeseen()
        while not np.isneginf(self.logs).any():
            axes = tuple(axis.halved(found.levels(i)[1], step) for i, axis in enumerate(found.axes))
            same = all(one is other for one, other in zip(axes, found.axes, strict=True))
            if same or np.prod([len(axis.levels) for axis in axes]) > MOST_POINTS:
                return found
            finer = self._weighed_over(axes, unforeseen, found)
            if finer is found:
                return found
            found = finer
        return found

    def _weighed_over(
        self, axes: Sequence[SigmaAxis], unforeseen: np.ndarray, otherwise: MarginalLikelihood
    ) -> MarginalLikelihood:
        """Evidence over another grid, what was found at points of its own carried on; `otherwise` if none."""
        from scipy.interpolate import RegularGridInterpolator

        wide = MarginalLikelihood.of(self.mode, axes)
        logs = wide.logs
        if unforeseen.any():
            # Linear in the logarithm of each standard deviation.
            places = [np.arange(len(axis.levels), dtype=float) for axis in self.axes]
            there = [
                np.append(0.0, np.interp(np.log(axis.levels[1:]), np.log(own.levels[1:]), place[1:]))
                for axis, own, place in zip(axes, self.axes, places, strict=True)
            ]
            between = RegularGridInterpolator(places, unforeseen.reshape([len(place) for place in places]))
            logs = logs + between(np.stack([at.ravel() for at in np.meshgrid(*there, indexing="ij")], axis=1))
        found = replace(self._over_grid(wide.mode, wide.grid, logs, wide.z, wide.covariance, wide.axes), log=self.log)
        return found if np.isfinite(found.spread).all() else otherwise

    def _unforeseen(self) -> np.ndarray:
        """What was found at points of the grid over what slopes at the mode predict, in nats, ``(n_grid,)``."""
        with np.errstate(invalid="ignore"):
            beyond = self.logs - MarginalLikelihood.of(self.mode, self.axes).logs
        # A point that is left out of a grid is so many nats down where that goes on to another: it weighs nothing.
        return np.maximum(np.nan_to_num(beyond, nan=0.0, neginf=-100.0), -100.0)

    def between_records(self) -> dict[str, BetweenRecordsSummary]:
        """Standard deviations between records of all parameters that may deviate, by name."""
        unknowns, found = self.mode.unknowns, {}
        for index, column in enumerate(unknowns.scattering):
            levels, weight = self.levels(index)
            low, middle, high = (_level_at(levels, weight, share) for share in (INSIDE_95[0], 0.5, INSIDE_95[1]))
            found[unknowns.names[column]] = BetweenRecordsSummary(
                sd=middle,
                interval_95=(low, high),
                agree=self.agree(index),
                rms=float(np.sqrt(weight @ levels**2 / weight.sum())),
            )
        return found

    def between_records_checks(self) -> list[Check]:
        """Whether the records differ by no more than is looked for at the most; nothing where nobody has to ask."""
        further = [i for i, axis in enumerate(self.axes) if axis.levels[-1] >= EXTENSION[-1]]
        if not further:
            return []
        told, unknowns = self.last_level_ratios, self.mode.unknowns
        worst = max(further, key=lambda index: float(told[index]))
        name = unknowns.names[unknowns.scattering[worst]]
        return [
            Check(
                name="records differ by no more than is looked for",
                passed=bool(told[worst] <= LAST_LEVEL_RATIO),
                statistic=float(told[worst]),
                threshold=LAST_LEVEL_RATIO,
                identifier="between_records",
                quantity="difference between records",
                facts={"parameter": name, "between": self.between_records()[name], "most": EXTENSION[-1]},
            )
        ]

    def interval_95(self, index: int) -> tuple[float, ...]:
        """Ends of the 95 % interval of one shared coordinate over all standard deviations between records."""
        middles, error = self.z[:, index], np.sqrt(np.maximum(self.covariance[:, index, index], 0.0))
        return tuple(mixture_quantile(self.weight, middles, error, share) for share in INSIDE_95)

    def covariance_of_all(self) -> np.ndarray:
        """Covariance of shared coordinates and, record after record, of each one's own, for all standard deviations.

        Returns
        -------
        (n_shared + n_record * n_each,) * 2
            Of coordinates, and of own values in units of their sizes.
        """
        mode = self.mode
        unknowns, normal = mode.unknowns, mode.normal
        n, each, records = len(unknowns.shared), len(unknowns.each), len(normal.blocks)
        total = np.zeros((n + records * each,) * 2)
        kept = self.weight > WEIGHS * self.weight.max()
        weight = self.weight[kept] / self.weight[kept].sum()
        mean = weight @ self.z[kept]
        for share, sigma, z, shared in zip(weight, self.grid[kept], self.z[kept], self.covariance[kept], strict=True):
            blocks = normal.blocks + np.diag(unknowns.own_precision(sigma))
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

    def posterior_roots(self) -> np.ndarray:
        """Independent directions in which the values of each record may be off, a standard deviation each.

        At the most probable standard deviations between records.

        Returns
        -------
        (n_record, n_column, n_root)
            Of the values in `Unknowns.columns`, in SI units; their outer products add up to the covariance.
        """
        mode, best = self.mode, int(np.argmax(self.weight))
        unknowns, normal, place = mode.unknowns, mode.normal, mode.place
        n, each, deviating = len(unknowns.shared), len(unknowns.each), len(unknowns.scattering)
        blocks = normal.blocks + np.diag(unknowns.own_precision(self.grid[best]))
        inverse = inverses(blocks)
        inverse[unknowns.fixed_own] = 0.0
        onto = np.zeros((n + each, each + deviating))
        onto[unknowns.own, np.arange(each + deviating)] = 1.0
        # A record's own values follow the shared ones, and are off by themselves.
        follow = np.eye(n + each, n) - onto @ inverse @ np.swapaxes(normal.cross, 1, 2)
        roots = np.concatenate([follow @ _root_of(self.covariance[best]), onto @ _root_of(inverse)], axis=-1)
        z = unknowns.shared_coordinates(place)
        unit = np.concatenate([unknowns.slope(z), np.broadcast_to(unknowns.size, (len(blocks), each))], axis=1)
        return roots * unit[:, :, None]


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
        evidence = MarginalLikelihood.of(found)
        here = np.flatnonzero(np.all(evidence.grid == sigma, axis=1)).tolist()
        if found.objective > effort.worthless and seen:
            break  # other standard deviations led away from what was found
        if found.objective > effort.worthless:
            # Nothing is looked for from here: what it predicts of other standard deviations is no find, and far from a
            # minimum it may be anything.
            return evidence._as_seen({}, max((float(evidence.logs[i]) for i in here), default=np.inf))
        seen |= dict.fromkeys(here, evidence)
        evidence = evidence._as_seen(seen)
        best = int(np.argmax(evidence.weight))
        if best in seen:
            return seen[best]._as_seen(seen, float(seen[best].logs[best]))
        # Standard deviations are priors: what the records say of a place stays what it was.
        at, sigma = found, evidence.grid[best]
    best = max(seen, key=lambda i: float(seen[i].logs[i]))
    return seen[best]._as_seen(seen, float(seen[best].logs[best]))


def conditioned_on_bounds(unknowns: Unknowns, z: np.ndarray, covariance: np.ndarray) -> np.ndarray:
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
    # Of the two tails the probability between is the difference of those on the side where both are small.
    low, high = np.where(below > 0.0, -above, below), np.where(below > 0.0, -below, above)
    whole, cut = log_ndtr(high), log_ndtr(low)
    # So far outside that a logarithm overflows, bounds leave nothing.
    beyond = np.minimum(np.where(np.isneginf(whole), -np.inf, cut) - np.where(np.isneginf(whole), 0.0, whole), -1e-300)
    return np.asarray(whole + np.log(-np.expm1(beyond)))


def _level_at(levels: np.ndarray, weight: np.ndarray, share: float) -> float:
    """Quantile of a standard deviation: zero with the weight of the first level, log-uniform around each other one.

    None is larger than the last level, where the prior ends.
    """
    logs = np.log(levels[1:])
    middles = 0.5 * (logs[1:] + logs[:-1])
    edges = np.concatenate([[1.5 * logs[0] - 0.5 * logs[1]], middles, logs[-1:]])
    cumulated = np.cumsum(weight) / weight.sum()
    return 0.0 if share <= cumulated[0] else float(np.exp(np.interp(share, cumulated, edges)))


def mixture_quantile(weight: np.ndarray, middle: np.ndarray, error: np.ndarray, share: float) -> float:
    """Quantile of a mixture of normal distributions, ``(n,)`` each."""
    used = weight > 0.0
    weight, middle, error = weight[used], middle[used], np.maximum(error[used], 1e-300)
    if len(weight) == 1:
        return float(middle[0] + error[0] * ndtri(share))
    # Twelve standard deviations hold all but 1e-32 of a normal law; sixty halvings of that end in the last digit.
    low, high = float((middle - 12.0 * error).min()), float((middle + 12.0 * error).max())
    for _ in range(60):
        here = 0.5 * (low + high)
        below = weight @ ndtr((here - middle) / error) < share * weight.sum()
        low, high = (here, high) if below else (low, here)
    return 0.5 * (low + high)


def _root_of(covariance: np.ndarray) -> np.ndarray:
    """Square roots of covariance matrices ``(..., n, n)``; of one that is none, as where a motion is lost, nothing."""
    covariance = np.where(np.isfinite(covariance).all(axis=(-2, -1), keepdims=True), covariance, 0.0)
    unit = scale_of(covariance)
    value, vector = np.linalg.eigh(equilibrated(covariance, unit))
    return unit[..., None] * vector * np.sqrt(np.maximum(value, 0.0))[..., None, :]
