"""The arrowhead normal equations about a place, the score test of further directions, and the sandwich variance.

Source
------
Schur complement: Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973). Score test: Rao, Proc. Camb. Phil. Soc. 44 (1948).
Sandwich variance: White, Econometrica 50 (1982).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from fibrefit.problem.linear_model.unknowns import (
    Place,
    Unknowns,
    coordinate_steps,
    held_places,
    local_of,
    own_precision,
    penalty,
    shared_coordinates,
)
from fibrefit.problem.statement.matrices import solved

Gram = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""Products ``(n_record, n_column + 1, n_column + 1)`` of the changes of all residuals, and of the residuals, when the
columns ``(n_column,)`` of local values ``(n_record, n_local)`` go to targets ``(n_record, n_column)``."""


@runtime_checkable
class Corrected(Protocol):
    """A `Gram` whose slopes are not always simulated; `exact` tells whether those of the last products were."""

    exact: bool

    def renew(self) -> None:
        """Have all slopes simulated where products are needed next."""


def eliminated(
    shared: np.ndarray, cross: np.ndarray, blocks: np.ndarray, pull: np.ndarray, pulls: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Normal matrix ``(..., n_shared, n_shared)`` and pull without the records' own unknowns (Schur complement).

    Parameters
    ----------
    shared : (n_shared, n_shared)
    cross : (n_record, n_shared, n_own)
    blocks : (..., n_record, n_own, n_own)
    pull : (n_shared,)
    pulls : (n_record, n_own)
    """
    if not blocks.shape[-1]:
        return np.broadcast_to(shared, (*blocks.shape[:-3], *shared.shape)), np.broadcast_to(
            pull, (*blocks.shape[:-3], *pull.shape)
        )
    right = np.concatenate([np.swapaxes(cross, -1, -2), pulls[..., None]], axis=-1)
    share = solved(blocks, np.broadcast_to(right, (*blocks.shape[:-2], *right.shape[-2:])))
    whole = np.einsum("rij,...rjk->...ik", cross, share)
    return shared - whole[..., :-1], pull - whole[..., -1]


class Arrowhead(NamedTuple):
    """Normal equations about a place, the deviations' prior left out.

    Parameters
    ----------
    shared : (n_shared, n_shared)
    cross : (n_record, n_shared, n_own)
    blocks : (n_record, n_own, n_own)
    pull : (n_shared,)
        Half the gradient of the cost with respect to the shared coordinates.
    pulls : (n_record, n_own)
    cost : float
        Sum of squared residuals.
    costs : (n_record,)
    """

    shared: np.ndarray
    cross: np.ndarray
    blocks: np.ndarray
    pull: np.ndarray
    pulls: np.ndarray
    cost: float
    costs: np.ndarray


@dataclass(frozen=True)
class PosteriorMode:
    """Where Q is smallest.

    Parameters
    ----------
    normal : Arrowhead
        There.
    sigma : (n_scattering,)
    predicted_reduction : float
        Reduction of Q predicted of one more step within reach.
    steps : int
        Evaluations.
    unmet : float
        Reduction of Q that slopes predict of a step as far as they say, and that no step brought. Where Q is kinked,
        the reach shrinks and this stays.
    """

    unknowns: Unknowns
    place: Place
    normal: Arrowhead
    sigma: np.ndarray
    predicted_reduction: float
    steps: int
    unmet: float = 0.0

    @property
    def local(self) -> np.ndarray:
        """Values of each record, ``(n_record, n_local)`` in SI units."""
        return local_of(self.unknowns, self.place)

    @property
    def values(self) -> np.ndarray:
        """Shared values, ``(n_shared,)`` in SI units."""
        return self.unknowns.value(self.place.z)

    @property
    def objective(self) -> float:
        """Q."""
        return self.normal.cost + penalty(self.unknowns, self.place, self.sigma)


def arrowhead(unknowns: Unknowns, place: Place, gram: Gram) -> Arrowhead:
    """Normal equations about a place."""
    return arranged(unknowns, local_grams(unknowns, place, gram))


def begun_at(unknowns: Unknowns, place: Place, gram: Gram, sigma: np.ndarray) -> PosteriorMode:
    """Where a descent begins, or none is made, under standard deviations between records ``(n_scattering,)``."""
    return PosteriorMode(unknowns, place, arrowhead(unknowns, place, gram), sigma, np.inf, 1)


class Differences(NamedTuple):
    """What slopes at a place are differences over; the parameters of a `Gram` first.

    Parameters
    ----------
    local : (n_record, n_local) in SI units
    columns : (n_column,) int
    targets : (n_record, n_column) in SI units
        Where the columns go.
    rate : (n_record, n_column + 1)
        Of changes per unit of the coordinates; one of the residuals, which come last.
    """

    local: np.ndarray
    columns: np.ndarray
    targets: np.ndarray
    rate: np.ndarray

    def per_unit(self, grams: np.ndarray) -> np.ndarray:
        """Products ``(n_record, n_column + 1, n_column + 1)`` of changes, per unit of the coordinates."""
        return grams * self.rate[:, :, None] * self.rate[:, None, :]


def differences(unknowns: Unknowns, place: Place, further: tuple[np.ndarray, np.ndarray] | None = None) -> Differences:
    """What slopes at a place are differences over.

    Parameters
    ----------
    further : ((n_direction,) int, (n_direction,) in SI units), optional
        Columns after those of the unknowns, and where they go: as they are, not per unit of anything.
    """
    local, shared = local_of(unknowns, place), len(unknowns.shared)
    columns, steps = unknowns.columns, coordinate_steps(unknowns, place)
    there = unknowns.value(shared_coordinates(unknowns, place) + steps[:, :shared])
    targets = np.concatenate([there, (place.own + steps[:, shared:]) * unknowns.size], axis=1)
    rate = 1.0 / steps
    if further is not None:
        columns = np.concatenate([columns, further[0]])
        targets = np.concatenate([targets, np.repeat(further[1][None], len(local), axis=0)], axis=1)
    rate = np.concatenate([rate, np.ones((len(local), len(columns) - rate.shape[1] + 1))], axis=1)
    return Differences(local, columns, targets, rate)


def local_grams(
    unknowns: Unknowns, place: Place, gram: Gram, further: tuple[np.ndarray, np.ndarray] | None = None
) -> np.ndarray:
    """Products of slopes and residuals of each record, per unit of its coordinates; residuals come last.

    Parameters
    ----------
    further : ((n_direction,) int, (n_direction,) in SI units), optional
        See `differences`.
    """
    at = differences(unknowns, place, further)
    return at.per_unit(gram(at.local, at.columns, at.targets))


def arranged(unknowns: Unknowns, grams: np.ndarray) -> Arrowhead:
    """Products of slopes ``(n_record, n_column + 1, n_column + 1)`` sorted into shared ones and each record's own."""
    n, mine, held = len(unknowns.shared), unknowns.own, held_places(unknowns)
    pulls = np.where(held, 0.0, grams[:, mine, -1])
    blocks = np.where(held[:, :, None] | held[:, None, :], np.eye(len(mine)), grams[:, mine[:, None], mine])
    cross = np.where(held[:, None, :], 0.0, grams[:, :n][:, :, mine])
    # Where slopes are no numbers a record is lost, as it is where its motion is.
    costs = np.where(np.isfinite(grams).all(axis=(1, 2)), grams[:, -1, -1], np.inf)
    whole = grams[:, :n].sum(axis=0)
    return Arrowhead(whole[:, :n], cross, blocks, whole[:, -1], pulls, float(costs.sum()), costs)


def with_priors(unknowns: Unknowns, place: Place, normal: Arrowhead, sigma: np.ndarray) -> Arrowhead:
    """Normal equations of Q about a place, from those of the residuals; the costs stay those of the residuals.

    Parameters
    ----------
    sigma : (n_scattering,)
    """
    precision = own_precision(unknowns, sigma)
    return normal._replace(
        shared=normal.shared + unknowns.precision,
        blocks=normal.blocks + np.diag(precision),
        pull=normal.pull + unknowns.precision @ (place.z - unknowns.mean),
        pulls=normal.pulls + np.concatenate([np.zeros_like(place.own), place.eta], axis=1) * precision,
    )


class ScoreTest(NamedTuple):
    """What slopes say of some directions.

    Parameters
    ----------
    score, information : (n_direction,)
        Without what the unknowns can imitate.
    covariance : (n_direction, n_direction)
        Of the scores where nothing is missing, noise and scatter drawn; `information` is its diagonal.
    shared : (n_direction, n_shared)
        How the shared unknowns give way to a unit of each direction.
    own : (n_direction, n_record, n_own)
        The same of each record's own, its deviations last.
    """

    score: np.ndarray
    information: np.ndarray
    covariance: np.ndarray
    shared: np.ndarray
    own: np.ndarray

    @property
    def gain(self) -> np.ndarray:
        """What each is predicted to add to the log likelihood by itself; -inf where slopes say nothing of it."""
        seen = np.where(self.information > 0.0, self.information, np.inf)
        gain = 0.5 * self.score**2 / seen
        return np.where((self.information > 0.0) & np.isfinite(gain), gain, -np.inf)


def score_test(unknowns: Unknowns, place: Place, grams: np.ndarray, number: int, sigma: np.ndarray) -> ScoreTest:
    """What slopes say of further directions.

    Parameters
    ----------
    grams : (n_record, n_column + number + 1, n_column + number + 1)
        From `local_grams`, with `number` further directions.
    sigma : (n_scattering,)
    """
    first = len(unknowns.columns)
    extra, last = np.arange(first, first + number), grams.shape[1] - 1
    own = np.r_[np.arange(first), last]
    normal = with_priors(unknowns, place, arranged(unknowns, grams[:, own[:, None], own]), sigma)
    n, mine = len(unknowns.shared), unknowns.own
    right = np.where(held_places(unknowns)[..., None], 0.0, grams[:, mine[:, None], extra])
    # Each record's own unknowns first, then the shared ones.
    share = solved(
        normal.blocks, np.concatenate([np.swapaxes(normal.cross, 1, 2), right, normal.pulls[..., None]], axis=-1)
    )
    to_shared = np.einsum("rij,rjk->ik", normal.cross, share)
    to_extra = np.einsum("rji,rjk->ik", right, share)
    shared = normal.shared - to_shared[:, :n]
    both = grams[:, :n][:, :, extra].sum(axis=0) - to_shared[:, n : n + number]
    pull = normal.pull - to_shared[:, -1]
    inside = solved(shared, np.concatenate([both, pull[:, None]], axis=-1))
    whole = grams[:, extra[:, None], extra].sum(axis=0) - to_extra[:, n : n + number] - both.T @ inside[:, :-1]
    score = grams[:, extra, -1].sum(axis=0) - to_extra[:, -1] - both.T @ inside[:, -1]
    # At a mode nothing pulls at the unknowns but the directions.
    own = share[..., n : n + number] - np.einsum("rij,jk->rik", share[..., :n], inside[:, :-1])
    return ScoreTest(score, np.diag(whole).copy(), whole, -inside[:, :-1].T, -np.moveaxis(own, 2, 0))


def overdispersion_of_scores(
    found: PosteriorMode, products: np.ndarray, grams: np.ndarray, covariance: np.ndarray
) -> np.ndarray:
    """Variance of each shared value by how its scores scatter over the one it is taken to have, ``(n_shared,)``.

    Parameters
    ----------
    found : PosteriorMode
    products : (n_record, n_stretch, n_column + 1, n_column + 1)
        Of changes and residuals within each stretch of a record, the residuals last.
    grams : (n_record, n_column + 1, n_column + 1)
        Their sums, per unit of the coordinates.
    covariance : (n_shared, n_shared)
    """
    unknowns = found.unknowns
    raw = np.sqrt(np.maximum(np.einsum("rsii->ri", products), 1e-300))
    rate = np.sqrt(np.maximum(np.einsum("rii->ri", grams), 0.0)) / raw
    scores = products[..., :-1, -1] * rate[:, None, :-1]
    n, mine = len(unknowns.shared), unknowns.own
    blocks = found.normal.blocks + np.diag(own_precision(unknowns, found.sigma))
    share = solved(blocks, np.swapaxes(found.normal.cross, 1, 2))
    own = np.where(held_places(unknowns)[:, None], 0.0, scores[..., mine])
    moved = (scores[..., :n] - np.einsum("rsj,rji->rsi", own, share)) @ covariance
    return np.asarray(np.sum(moved**2, axis=(0, 1)) / np.maximum(np.diag(covariance), 1e-300))


def overdispersion_of_change(products: np.ndarray) -> float:
    """The same along one finite change of the readings, such as that which an effect makes.

    Where a change bends, as a bounce makes it, slopes at its end say nothing of it: it may lie in a few readings that
    tails of the noise have made loud.

    Parameters
    ----------
    products : (n_record, n_stretch, 2, 2)
        Of the change and of residuals within each stretch of a record, the residuals last.
    """
    size = float(np.sum(products[..., 0, 0]))
    return float(np.sum(products[..., 0, 1] ** 2)) / size if size > 0.0 else 1.0
