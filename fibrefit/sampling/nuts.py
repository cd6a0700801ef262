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
from fibrefit.core.limits import Progress
from fibrefit.sampling.chains import effective_draws, mixing
from fibrefit.sampling.density.log_posterior import LogPosterior
from fibrefit.sampling.posterior import Posterior
from fibrefit.sampling.thresholds import DIFFERS, NUTS_R_HAT, OVERLOOKED
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
    spread_scores : (n,)
        Its logarithm over the Monte-Carlo standard error of that.
    r_hat : (n,)
        Between the chains of NUTS.
    """

    points: np.ndarray
    divergent: int
    scores: np.ndarray
    spread: np.ndarray
    spread_scores: np.ndarray
    r_hat: np.ndarray

    @property
    def alike(self) -> bool:
        """Whether no mean and no standard deviation differs by more than chance allows for as many as there are."""
        from scipy.stats import norm

        every = np.abs([self.scores, self.spread_scores])
        return bool(np.max(every) < norm.isf(0.5 * DIFFERS / every.size))

    @property
    def converged(self) -> bool:
        """Whether the chains of NUTS agree among themselves, and few of their transitions were divergent."""
        return bool(np.max(self.r_hat) < NUTS_R_HAT) and self.divergent <= OVERLOOKED * self.draws

    @property
    def draws(self) -> int:
        """Of all chains."""
        return int(np.prod(self.points.shape[:2]))

    @property
    def agrees(self) -> bool:
        """Whether NUTS converged, to the posterior of the ensembles."""
        return self.alike and self.converged

    def check(self, names: Sequence[str]) -> Check:
        """Whether both samplers found the same posterior.

        Parameters
        ----------
        names : sequence of str
            Of the coordinates.
        """
        every = np.abs([self.scores, self.spread_scores])
        which, worst = divmod(int(np.argmax(every)), every.shape[1])
        least_mixed = int(np.argmax(self.r_hat))
        return Check(
            name="NUTS finds the same posterior",
            passed=self.agrees,
            statistic=float(every.max()),
            identifier="nuts",
            quantity="agreement with NUTS",
            facts={
                "of": ("mean", "standard deviation")[which],
                "worst": names[worst],
                "alike": self.alike,
                "r_hat": (float(self.r_hat[least_mixed]), names[least_mixed], NUTS_R_HAT),
                "divergent": (self.divergent, self.draws, OVERLOOKED),
            },
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
    # As the ensembles do, chains begin wider than the posterior, so that agreement has to be earned.
    begun, _ = approximation.cloud(posterior.target.log_density, CHAINS, np.random.default_rng(seed))
    starts = np.linalg.solve(approximation.root, (begun - approximation.centre).T).T
    found = []
    for chain in range(CHAINS):
        if progress:
            progress("cross-check with NUTS", chain / CHAINS)
        key = jax.random.fold_in(jax.random.key(seed), chain)
        found.append(jax.tree.map(np.asarray, _chain(posterior.density, frame, jnp.asarray(starts[chain]), key)))
    points = np.stack([points for points, _ in found])
    return _compared(posterior, points, sum(int(bad) for _, bad in found))


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
def _chain(density: LogPosterior, frame: Any, start: jax.Array, key: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Draws ``(n_draw, n)`` of one chain and its divergences, in a frame in which the mode is a unit ball."""
    blackjax, draws = require_nuts(), CHAIN_DRAWS
    centre, root, level = frame

    def log_density(position: jax.Array) -> jax.Array:
        value = density(centre + root @ position) - level
        # Beyond a limit there is no slope to follow; a finite wall ends the move.
        return jnp.where(jnp.isfinite(value), value, -1e10)

    warm_key, run_key = jax.random.split(key)
    (state, tuned), _ = blackjax.window_adaptation(blackjax.nuts, log_density).run(warm_key, start, num_steps=draws)
    step = blackjax.nuts(log_density, **tuned).step

    def advance(state: Any, key: jax.Array) -> tuple[Any, tuple[jax.Array, jax.Array]]:
        state, info = step(key, state)
        return state, (state.position, info.is_divergent)

    _, (positions, divergent) = jax.lax.scan(advance, state, jax.random.split(run_key, draws))
    return centre + positions @ root.T, jnp.sum(divergent)


@np.errstate(divide="ignore", invalid="ignore")  # of chains that have not moved
def _compared(posterior: Posterior, points: np.ndarray, divergent: int) -> CrossCheck:
    """Both samples, by the same estimates of how well their means and standard deviations are known."""
    mixed, found = mixing(points[:, :, None]), []
    own = posterior.course.kept, posterior.course.mixing.ess_bulk
    for sample, ess in (own, (points[:, :, None], mixed.ess_bulk)):
        mean, spread = sample.mean(axis=(0, 1, 2)), sample.std(axis=(0, 1, 2))
        # The error of the variance is that of the mean of these squares: it knows of heavy tails.
        squares = ((sample - mean) / spread) ** 2
        size = np.array([effective_draws(squares[..., i]) for i in range(points.shape[-1])])
        found.append((mean, np.log(spread), spread / np.sqrt(ess), 0.5 * squares.std(axis=(0, 1, 2)) / np.sqrt(size)))
    means, logs, errors, log_errors = zip(*found, strict=True)
    ratio, scores = logs[0] - logs[1], (means[0] - means[1]) / np.hypot(*errors)
    return CrossCheck(points, divergent, scores, np.exp(ratio), ratio / np.hypot(*log_errors), mixed.r_hat)
