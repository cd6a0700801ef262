"""Predictive performance: leave-one-block-out cross-validation by Pareto-smoothed importance sampling (PSIS-LOO).

Noise is autocorrelated, so a single sample left out would be predicted by its neighbours. What is left out is a block
of time of one record, all channels together.
"""

from __future__ import annotations

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.posterior.log_posterior import LogPosterior
from fibrefit.sampling.deviations import records_at
from fibrefit.sampling.posterior import Posterior
from fibrefit.sampling.thresholds import PARETO_K

LEFT_OUT_SECONDS = 0.05
DRAWS = 1000
NORMAL_MEDIAN = 0.6745
"""Median magnitude of a normal variable over its standard deviation."""


@dataclass(frozen=True)
class CrossValidation:
    """Expected log predictive density of blocks left out.

    Parameters
    ----------
    blocks : (n_block,)
        Expected log density of each block, SI units.
    pareto_k : (n_block,)
        Reliability of each: good below 0.7.
    effective_parameters : float
        p_loo.
    """

    blocks: np.ndarray
    pareto_k: np.ndarray
    effective_parameters: float

    @property
    def total(self) -> float:
        """elpd_loo: sum over all blocks."""
        return float(self.blocks.sum())

    @property
    def error(self) -> float:
        """Standard error of the sum; takes two blocks or more."""
        return float(np.sqrt(len(self.blocks) * self.blocks.var(ddof=1)))

    @property
    def unreliable(self) -> int:
        """Number of blocks with a Pareto k above 0.7, whose figure is unreliable."""
        return int(np.sum(self.pareto_k > PARETO_K))


def cross_validate(posterior: Posterior, seed: int = 0) -> CrossValidation:
    """PSIS-LOO of a posterior over blocks of time.

    Source
    ------
    Vehtari, Gelman and Gabry, Statistics and Computing 27 (2017).
    """
    from arviz_stats.base import array_stats

    points = jnp.asarray(posterior.thinned(DRAWS, seed))
    density = posterior.density
    blocks, n_block = block_index(density)
    each = np.asarray(blockwise(density, points, jnp.asarray(blocks), n_block))
    each = each[:, np.isin(np.arange(n_block - 1), blocks).nonzero()[0]]
    log, k, effective = array_stats.loo(each.T, chain_axis=None, draw_axis=-1)
    return CrossValidation(np.asarray(log), np.asarray(k), float(np.sum(effective)))


def block_index(density: LogPosterior) -> tuple[np.ndarray, int]:
    """Block ``(n_record, n_time)`` each sample belongs to, and the number of blocks; the last takes what is masked."""
    data = density.problem.observations
    times = np.asarray(data.experiment.times)
    valid = np.any([np.asarray(w) > 0.0 for w in data.weight.values()], axis=0)
    number = ((times - times[:, :1]) / LEFT_OUT_SECONDS).astype(int)
    largest = int(number.max()) + 1
    index = number + largest * np.arange(len(times))[:, None]
    return np.where(valid, index, largest * len(times)), largest * len(times) + 1


def usual_log_density(density: LogPosterior, blocks: np.ndarray, n_block: int) -> np.ndarray:
    """Log density ``(n_block,)`` of noise that scatters as neighbouring readings do, SI units: the same for any model.

    A hundred readings to 20 um have a density of exp(1000) in SI units, which no number holds. What a model has beyond
    this is small, and models of the same records differ by as much.

    Parameters
    ----------
    blocks : (n_record, n_time) int array
        Of `block_index`.
    """
    data, found = density.problem.observations, np.zeros(n_block)
    for channel in density.likelihood.channels:
        valid = np.asarray(data.weight[channel]) > 0.0
        # Second differences of noise have six times its variance; of a motion that is sampled well hardly anything.
        bends = np.diff(np.where(valid, data.measured[channel], np.nan), 2, axis=1)
        bends = np.abs(bends[np.isfinite(bends)])
        typical = float(np.median(bends)) / NORMAL_MEDIAN if bends.size else 0.0
        spread = (typical or float(np.sqrt(np.mean(bends**2))) if bends.any() else 1.0) / np.sqrt(6.0)
        found += np.bincount(blocks[valid], minlength=n_block) * -(np.log(spread) + 0.5 * np.log(2.0 * np.pi * np.e))
    return found


def blockwise(density: LogPosterior, points: jax.Array, blocks: jax.Array, n_block: int) -> jax.Array:
    """Log likelihood ``(n_point, n_block)`` of each block; the last is that of masked samples, which is zero.

    Deviations of the records are drawn with the points, as any other of their values.
    """
    local = jnp.asarray(records_at(density, np.asarray(points)))
    return _blockwise(density, local, points, blocks, n_block)


@eqx.filter_jit
def _blockwise(
    density: LogPosterior, local: jax.Array, points: jax.Array, blocks: jax.Array, n_block: int
) -> jax.Array:
    problem, likelihood = density.problem, density.likelihood

    def one(row: tuple[jax.Array, jax.Array]) -> jax.Array:
        own, point = row
        _, noise = density.split(point)
        each = likelihood.pointwise(problem.residuals_at(own), noise)
        valid = jnp.stack([problem.observations.weight[c] for c in likelihood.channels], axis=1) > 0.0
        # A level belongs to the readings of its channel, which a block may hold more or less of; what is left of the
        # constants belongs to all readings in equal parts.
        levels = jnp.log(likelihood.levels(noise))
        rest = likelihood.constant(noise) + jnp.sum(likelihood.counts * levels)
        each = jnp.where(valid, each + rest / jnp.sum(likelihood.counts) - levels[:, None], 0.0)
        return jnp.zeros(n_block).at[blocks].add(each.sum(axis=1))

    return jax.lax.map(one, (local, points))
