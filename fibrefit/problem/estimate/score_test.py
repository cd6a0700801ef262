"""Rao's score test: what slopes at a mode predict of further directions, before anything is fitted.

Source
------
Rao, Proc. Camb. Phil. Soc. 44 (1948).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fibrefit.problem.estimate.normal_equations import Place, Unknowns, arranged, held_places, with_priors
from fibrefit.problem.estimate.schur import solved


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
