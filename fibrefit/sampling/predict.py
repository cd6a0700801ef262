"""What a posterior predicts: bands of the records, and blocks of time that are left out (PSIS-LOO).

Noise is autocorrelated, so a single sample left out would be predicted by its neighbours. What is left out is a block
of time of one record, all channels together.
"""

from __future__ import annotations

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem import unit_of
from fibrefit.sampling.density.likelihood import Likelihood
from fibrefit.sampling.density.log_posterior import LogPosterior
from fibrefit.sampling.latent import DrawnInputs, records_at, whitened_residuals
from fibrefit.sampling.posterior import Posterior
from fibrefit.sampling.thresholds import PARETO_K

LEVELS = (0.05, 0.5, 0.95)
LEFT_OUT_SECONDS = 0.05


@dataclass(frozen=True)
class Bands:
    """Quantiles of one channel at `LEVELS`, in SI units.

    Parameters
    ----------
    model : (3, n_record, n_time)
        Of the model's readings: what the parameters leave open.
    measured : (3, n_record, n_time)
        Of new measurements: the noise added.
    replicates : (n_draw, n_record, n_time)
        New measurements, one for each draw.
    covered : float
        Share of the measured samples inside the outer band of `measured`; about 0.9 if all is well.
    """

    model: np.ndarray
    measured: np.ndarray
    replicates: np.ndarray
    covered: float


def predict(posterior: Posterior, count: int = 100, seed: int = 0) -> dict[str, Bands]:
    """Bands of every channel.

    Parameters
    ----------
    count : int
        Number of draws they are made from.
    """
    density, random = posterior.density, np.random.default_rng(seed)
    points = posterior.thinned(count, seed)
    local, problem, inputs = records_at(density, points, seed), density.problem, posterior.inputs
    if inputs is None:
        found = _readings(density, jnp.asarray(local))
    else:
        # Errors of inputs are drawn, too.
        white = whitened_residuals(problem, density.likelihood.whitening, jnp.asarray(local))
        found = inputs.readings(local, inputs.drawn(np.array(white), np.random.default_rng(seed)))
        problem = inputs.problem
    readings = {channel: np.asarray(row) for channel, row in found.items()}
    channels, data = problem.model.rig.channels, problem.observations
    unit = unit_of(data, channels)
    size = density.problem.layout.size
    n_time = readings[channels[0]].shape[-1]
    noise = np.stack([draw_noise(density.likelihood, n_time, point[size:], random) for point in points])
    bands = {}
    for i, channel in enumerate(channels):
        weight = np.asarray(data.weight[channel])
        counted = weight > 0.0
        # Noise may grow with the load: the residuals of each reading are in units of its own.
        own = np.where(counted, 1.0 / np.where(counted, weight, 1.0), unit[:, i, None])
        replicates = readings[channel] + noise[:, :, i] * own
        measured = np.quantile(replicates, LEVELS, axis=0)
        value = np.asarray(data.measured[channel])
        inside = (value >= measured[0]) & (value <= measured[2])
        model = np.quantile(readings[channel], LEVELS, axis=0)
        bands[channel] = Bands(model, measured, replicates, float(np.mean(inside[counted])))
    return bands


def draw_noise(likelihood: Likelihood, n_time: int, noise: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Noise ``(n_record, n_channel, n_time)`` in units of the residuals, of the spectrum a likelihood assumes.

    Parameters
    ----------
    noise : (n_noise,)
        Noise coordinates.
    random : numpy.random.Generator
    """
    lags = likelihood.whitening.autocovariance(n_time)
    # A circle of twice the length, of which one half is used, has the covariance of the line.
    circle = np.concatenate([lags, lags[..., -1:], lags[..., :0:-1]], axis=-1)
    power = np.maximum(np.fft.rfft(circle, axis=-1).real, 0.0)
    shape = (*lags.shape[:2], 2 * n_time)
    white = random.standard_t(float(np.exp(noise[-1])), shape) if likelihood.heavy else random.standard_normal(shape)
    drawn = np.fft.irfft(np.sqrt(power) * np.fft.rfft(white, axis=-1), 2 * n_time, axis=-1)[..., :n_time]
    level = np.asarray(likelihood.levels(jnp.asarray(noise)))[:, None]
    return drawn * level


@eqx.filter_jit
def _readings(density: LogPosterior, local: jax.Array) -> dict[str, jax.Array]:
    problem = density.problem
    return jax.lax.map(lambda own: problem.predict(own, problem.observations.experiment), local)


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

    points = jnp.asarray(posterior.thinned(1000, seed))
    density = posterior.density
    blocks, n_block = block_index(density)
    each = np.asarray(blockwise(density, points, jnp.asarray(blocks), n_block, posterior.inputs))
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
        # Second differences of noise have six times its variance; of a motion that is sampled well hardly anything. The
        # median magnitude of a normal variable is 0.6745 of its standard deviation.
        bends = np.diff(np.where(valid, data.measured[channel], np.nan), 2, axis=1)
        bends = np.abs(bends[np.isfinite(bends)])
        typical = float(np.median(bends)) / 0.6745 if bends.size else 0.0
        spread = (typical or float(np.sqrt(np.mean(bends**2))) if bends.any() else 1.0) / np.sqrt(6.0)
        found += np.bincount(blocks[valid], minlength=n_block) * -(np.log(spread) + 0.5 * np.log(2.0 * np.pi * np.e))
    return found


def blockwise(
    density: LogPosterior, points: jax.Array, blocks: jax.Array, n_block: int, inputs: DrawnInputs | None = None
) -> np.ndarray:
    """Log likelihood ``(n_point, n_block)`` of each block; the last is that of masked samples, which is zero.

    Deviations of the records are drawn with the points, as any other of their values. Errors of inputs are integrated
    out, given the other blocks: there are many of them, and what a block itself tells of them is not to be used.
    """
    local = records_at(density, np.asarray(points))
    left_out = None if inputs is None else inputs.left_out(np.asarray(blocks), n_block)
    parts, size = [], 50
    for first in range(0, len(local), size):
        # Of one size, for the compiler's sake; innovations of fifty draws of five records of three seconds take 25 MB.
        chunk = np.minimum(np.arange(first, first + size), len(local) - 1)
        white, lost = np.array(_innovations(density, jnp.asarray(local[chunk]))), np.zeros(n_block)
        if left_out is not None:
            white, lost = left_out.predicted(white), left_out.log_det
        each = _blockwise(density, jnp.asarray(white), points[chunk], blocks, n_block)
        parts.append(np.asarray(each) - lost)
    return np.concatenate(parts)[: len(local)]


@eqx.filter_jit
def _innovations(density: LogPosterior, local: jax.Array) -> jax.Array:
    return jax.lax.map(density.innovations, local)


@eqx.filter_jit
def _blockwise(
    density: LogPosterior, white: jax.Array, points: jax.Array, blocks: jax.Array, n_block: int
) -> jax.Array:
    problem, likelihood = density.problem, density.likelihood
    valid = jnp.stack([problem.observations.weight[c] for c in likelihood.channels], axis=1) > 0.0
    number = jnp.sum(valid, axis=(0, 2))

    def one(row: tuple[jax.Array, jax.Array]) -> jax.Array:
        own, point = row
        _, noise = density.split(point)
        each = likelihood.of_innovations(own, noise)
        # A level belongs to the readings of its channel, which a block may hold more or less of; what is left of the
        # constants belongs to all readings in equal parts.
        levels = likelihood.counts * jnp.log(likelihood.levels(noise))
        rest = likelihood.constant(noise) + jnp.sum(levels)
        of_levels = (levels / jnp.maximum(number, 1))[:, None]
        each = jnp.where(valid, each + rest / jnp.sum(number) - of_levels, 0.0)
        return jnp.zeros(n_block).at[blocks].add(each.sum(axis=1))

    return jax.lax.map(one, (white, points))
