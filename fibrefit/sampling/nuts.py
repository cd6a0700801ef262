"""Cross-check with the No-U-Turn sampler (NUTS), which needs the gradient and nothing of the ensembles."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.errors import UsageError
from fibrefit.core.progress import Progress
from fibrefit.problem.posterior.log_posterior import LogPosterior
from fibrefit.sampling.posterior import Posterior
from fibrefit.sampling.thresholds import DIFFERS
from fibrefit.study.summaries.check import Check

CHAINS, CHAIN_DRAWS = 4, 200
"""Chains, and draws of each after as many for adaptation."""


@dataclass(frozen=True)
class CrossCheck:
    """Draws of NUTS, compared with those of the ensembles.

    Parameters
    ----------
    points : (n_chain, n_draw, n)
    divergent : int
        Number of divergent transitions.
    scores : (n,)
        Difference of the means of both samplers over its Monte-Carlo standard error.
    spread : (n,)
        Ratio of the standard deviations.
    """

    points: np.ndarray
    divergent: int
    scores: np.ndarray
    spread: np.ndarray

    @property
    def agrees(self) -> bool:
        """Whether no mean differs by more than chance allows, for as many coordinates as there are."""
        from scipy.stats import norm

        return bool(np.max(np.abs(self.scores)) < norm.isf(0.5 * DIFFERS / len(self.scores)))

    def check(self, names: Sequence[str]) -> Check:
        """Whether both samplers found the same posterior.

        Parameters
        ----------
        names : sequence of str
            Of the coordinates.
        """
        worst = int(np.argmax(np.abs(self.scores)))
        most = float(np.abs(self.scores[worst]))
        return Check(
            name="NUTS finds the same posterior",
            passed=self.agrees,
            statistic=most,
            identifier="nuts",
            quantity="agreement with NUTS",
            facts={"worst": names[worst], "divergent": self.divergent},
        )


def cross_check(posterior: Posterior, seed: int = 0, progress: Progress | None = None) -> CrossCheck:
    """Sample the heaviest mode again with NUTS and compare.

    Parameters
    ----------
    progress : callable, optional
        Called with what is being done and the share that is finished.

    Raises
    ------
    UsageError
        If the optional package it needs is missing.
    """
    require_nuts()
    approximation = posterior.modes[0].approximation
    frame = (jnp.asarray(approximation.centre), jnp.asarray(approximation.root), approximation.log_density)
    found = []
    for chain in range(CHAINS):
        if progress:
            progress("cross-check with NUTS", chain / CHAINS)
        key = jax.random.fold_in(jax.random.key(seed), chain)
        found.append(jax.tree.map(np.asarray, _chain(posterior.density, frame, CHAIN_DRAWS, key)))
    points = np.stack([points for points, _ in found])
    return CrossCheck(points, sum(int(bad) for _, bad in found), *_compared(posterior, points))


def require_nuts() -> Any:
    """The optional package.

    Raises
    ------
    UsageError
        If it is not installed.
    """
    try:
        return importlib.import_module("blackjax")
    except ImportError:
        raise UsageError(
            "NUTS",
            "the package blackjax is not installed",
            "the extra nuts",
            "Install it: pip install 'fibrefit[nuts]'.",
        ) from None


@eqx.filter_jit
def _chain(density: LogPosterior, frame: Any, draws: int, key: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Draws ``(n_draw, n)`` of one chain and its divergences, in a frame in which the mode is a unit ball."""
    blackjax = require_nuts()
    centre, root, level = frame

    def log_density(position: jax.Array) -> jax.Array:
        value = density(centre + root @ position) - level
        # Beyond a limit there is no slope to follow; a finite wall ends the move.
        return jnp.where(jnp.isfinite(value), value, -1e10)

    start_key, warm_key, run_key = jax.random.split(key, 3)
    start = jax.random.normal(start_key, centre.shape)
    (state, tuned), _ = blackjax.window_adaptation(blackjax.nuts, log_density).run(warm_key, start, num_steps=draws)
    step = blackjax.nuts(log_density, **tuned).step

    def advance(state: Any, key: jax.Array) -> tuple[Any, tuple[jax.Array, jax.Array]]:
        state, info = step(key, state)
        return state, (state.position, info.is_divergent)

    _, (positions, divergent) = jax.lax.scan(advance, state, jax.random.split(run_key, draws))
    return centre + positions @ root.T, jnp.sum(divergent)


def _compared(posterior: Posterior, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    from arviz_stats.base import array_stats

    own = posterior.course.kept.reshape(-1, points.shape[-1])
    other = points.reshape(-1, points.shape[-1])
    ess = np.array([float(array_stats.ess(points[..., i], chain_axis=0, draw_axis=1)) for i in range(points.shape[-1])])
    error = np.sqrt(own.var(axis=0) / posterior.course.mixing.ess_bulk + other.var(axis=0) / ess)
    return (own.mean(axis=0) - other.mean(axis=0)) / error, own.std(axis=0) / other.std(axis=0)
