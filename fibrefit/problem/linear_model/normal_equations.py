"""The arrowhead normal equations about a place, the score test of further directions, and the sandwich variance.

Derived in `fibrefit.problem.linear_model`.

Source
------
Schur complement: Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973). Score test: Rao, Proc. Camb. Phil. Soc. 44 (1948).
Sandwich variance: White, Econometrica 50 (1982).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fibrefit.core.matrices import solved
from fibrefit.problem.linear_model.unknowns import RIGID, Gram, Place, Unknowns


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

    @classmethod
    def of(cls, unknowns: Unknowns, grams: np.ndarray) -> Arrowhead:
        """From products ``(n_record, n_column + 1, n_column + 1)``, sorted into shared ones and each record's own."""
        n, mine, fixed = len(unknowns.shared), unknowns.own, unknowns.fixed_own
        pulls = np.where(fixed, 0.0, grams[:, mine, -1])
        blocks = np.where(fixed[:, :, None] | fixed[:, None, :], np.eye(len(mine)), grams[:, mine[:, None], mine])
        cross = np.where(fixed[:, None, :], 0.0, grams[:, :n][:, :, mine])
        # Where slopes are no numbers a record is lost, as it is where its motion is.
        costs = np.where(np.isfinite(grams).all(axis=(1, 2)), grams[:, -1, -1], np.inf)
        whole = grams[:, :n].sum(axis=0)
        return cls(whole[:, :n], cross, blocks, whole[:, -1], pulls, float(costs.sum()), costs)

    @classmethod
    def at(cls, unknowns: Unknowns, place: Place, gram: Gram) -> Arrowhead:
        """About a place."""
        return cls.of(unknowns, unknowns.local_grams(place, gram))

    def with_priors(self, unknowns: Unknowns, place: Place, sigma: np.ndarray) -> Arrowhead:
        """Normal equations of Q about a place, from those of the residuals; the costs stay those of the residuals.

        Parameters
        ----------
        sigma : (n_scattering,)
        """
        precision = unknowns.own_precision(sigma)
        return self._replace(
            shared=self.shared + unknowns.precision,
            blocks=self.blocks + np.diag(precision),
            pull=self.pull + unknowns.precision @ (place.z - unknowns.mean),
            pulls=self.pulls + np.concatenate([np.zeros_like(place.own), place.eta], axis=1) * precision,
        )


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

    @classmethod
    def at(cls, unknowns: Unknowns, place: Place, gram: Gram, sigma: np.ndarray) -> PosteriorMode:
        """Where a descent begins, or none is made, under standard deviations between records ``(n_scattering,)``."""
        return cls(unknowns, place, Arrowhead.at(unknowns, place, gram), sigma, np.inf, 1)

    @property
    def local(self) -> np.ndarray:
        """Values of each record, ``(n_record, n_local)`` in SI units."""
        return self.unknowns.local_of(self.place)

    @property
    def values(self) -> np.ndarray:
        """Shared values, ``(n_shared,)`` in SI units."""
        return self.unknowns.value(self.place.z)

    @property
    def objective(self) -> float:
        """Q."""
        return self.normal.cost + self.unknowns.penalty(self.place, self.sigma)

    def record_costs(self, sigma: np.ndarray | None = None) -> np.ndarray:
        """Share of Q of each record, ``(n_record,)``, beside what is believed of what they share.

        Parameters
        ----------
        sigma : (n_scattering,), optional
            Standard deviations by which deviations count; those of the mode by default.
        """
        deviations = self.place.eta / np.maximum(self.sigma if sigma is None else sigma, RIGID)
        return np.asarray(self.normal.costs + np.sum(deviations**2, axis=1))

    def overdispersion(self, products: np.ndarray, grams: np.ndarray, covariance: np.ndarray) -> np.ndarray:
        """Sandwich variance of each shared value over the one it is taken to have, ``(n_shared,)``.

        The sandwich variance is that by how scores of parts of the records scatter. It exceeds the other where
        innovations are not what they are taken for: heavy tails, slopes that predict little, a wrong spectrum.

        Parameters
        ----------
        products : (n_record, n_stretch, n_column + 1, n_column + 1)
            Of changes and residuals within each stretch of a record, the residuals last.
        grams : (n_record, n_column + 1, n_column + 1)
            Their sums, per unit of the coordinates.
        covariance : (n_shared, n_shared)
        """
        unknowns = self.unknowns
        raw = np.sqrt(np.maximum(np.einsum("rsii->ri", products), 1e-300))
        rate = np.sqrt(np.maximum(np.einsum("rii->ri", grams), 0.0)) / raw
        scores = products[..., :-1, -1] * rate[:, None, :-1]
        n, mine = len(unknowns.shared), unknowns.own
        blocks = self.normal.blocks + np.diag(unknowns.own_precision(self.sigma))
        share = solved(blocks, np.swapaxes(self.normal.cross, 1, 2))
        own = np.where(unknowns.fixed_own[:, None], 0.0, scores[..., mine])
        moved = (scores[..., :n] - np.einsum("rsj,rji->rsi", own, share)) @ covariance
        return np.asarray(np.sum(moved**2, axis=(0, 1)) / np.maximum(np.diag(covariance), 1e-300))


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

    @classmethod
    def of(cls, unknowns: Unknowns, place: Place, grams: np.ndarray, number: int, sigma: np.ndarray) -> ScoreTest:
        """What slopes say of further directions.

        Parameters
        ----------
        grams : (n_record, n_column + number + 1, n_column + number + 1)
            From `Unknowns.local_grams`, with `number` further directions.
        sigma : (n_scattering,)
        """
        first = len(unknowns.columns)
        extra, last = np.arange(first, first + number), grams.shape[1] - 1
        own = np.r_[np.arange(first), last]
        normal = Arrowhead.of(unknowns, grams[:, own[:, None], own]).with_priors(unknowns, place, sigma)
        n, mine = len(unknowns.shared), unknowns.own
        right = np.where(unknowns.fixed_own[..., None], 0.0, grams[:, mine[:, None], extra])
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
        return cls(score, np.diag(whole).copy(), whole, -inside[:, :-1].T, -np.moveaxis(own, 2, 0))

    @property
    def gain(self) -> np.ndarray:
        """What each is predicted to add to the log likelihood by itself; -inf where slopes say nothing of it."""
        seen = np.where(self.information > 0.0, self.information, np.inf)
        gain = 0.5 * self.score**2 / seen
        return np.where((self.information > 0.0) & np.isfinite(gain), gain, -np.inf)


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
