"""Whether chains have mixed, and how many independent draws they are worth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Mixing:
    """Diagnostics of each coordinate, ``(n,)``.

    Parameters
    ----------
    r_hat : (n,)
        Rank-normalised split R-hat between ensembles.
    r_hat_walkers : (n,)
        The same between all walkers: large where walkers sit in places they do not leave.
    ess_bulk, ess_tail : (n,)
        Effective number of draws for the middle and for the 5 % tails.

    Source
    ------
    Vehtari, Gelman, Simpson, Carpenter and Buerkner, Bayesian Analysis 16 (2021).
    """

    r_hat: np.ndarray
    r_hat_walkers: np.ndarray
    ess_bulk: np.ndarray
    ess_tail: np.ndarray


def mixing(chain: np.ndarray) -> Mixing:
    """Diagnostics of a chain of several ensembles.

    Walkers of one ensemble move with regard to each other, so they are no independent chains. What is independent are
    the ensembles, and how well a mean is known shows in how the ensembles' means move from step to step.

    Parameters
    ----------
    chain : (n_ensemble, n_step, n_walker, n)
    """
    ensembles, steps, walkers, size = chain.shape
    columns = [_ranked(chain[..., i]) for i in range(size)]
    together = np.stack([z.reshape(ensembles, steps * walkers) for z in columns])
    apart = np.stack([np.swapaxes(z, 1, 2).reshape(ensembles * walkers, steps) for z in columns])
    return Mixing(
        r_hat=_r_hat(together),
        r_hat_walkers=_r_hat(apart),
        ess_bulk=np.array([effective_draws(z) for z in columns]),
        ess_tail=np.array([_ess_tail(chain[..., i]) for i in range(size)]),
    )


def _ranked(values: np.ndarray) -> np.ndarray:
    from scipy.special import ndtri
    from scipy.stats import rankdata

    return ndtri((rankdata(values).reshape(values.shape) - 0.375) / (values.size + 0.25))


def _r_hat(columns: np.ndarray) -> np.ndarray:
    """R-hat of columns ``(n, n_chain, n_draw)``; infinite where a chain has not moved at all."""
    from arviz_stats.base import array_stats

    with np.errstate(divide="ignore", invalid="ignore"):
        found = np.array([array_stats.rhat(column, chain_axis=0, draw_axis=1) for column in columns], dtype=float)
    return np.where(np.isfinite(found), found, np.inf)


def effective_draws(values: np.ndarray) -> float:
    """Effective number of draws of `values` ``(n_ensemble, n_step, n_walker)``, from the means of the ensembles."""
    from arviz_stats.base import array_stats

    means = values.mean(axis=2)
    spread = means.var(ddof=1)
    if not spread > 0.0 or means.shape[1] < 4:
        return 0.0
    steps = float(array_stats.ess(means, chain_axis=0, draw_axis=1, method="mean"))
    # The variance of the grand mean is that of one step's mean over the effective number of steps.
    return float(np.nan_to_num(steps * values.var(ddof=1) / spread))


def _ess_tail(values: np.ndarray) -> float:
    return min(effective_draws((values <= np.quantile(values, share)).astype(float)) for share in (0.05, 0.95))
