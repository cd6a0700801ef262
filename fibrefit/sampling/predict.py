"""Posterior predictive bands of the records: of the model, and of new measurements."""

from __future__ import annotations

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.noise.likelihood import Likelihood, unit_of
from fibrefit.problem.posterior.log_posterior import LogPosterior
from fibrefit.sampling.deviations import records_at
from fibrefit.sampling.mode.inputs import whitened_residuals
from fibrefit.sampling.posterior import Posterior

LEVELS = (0.05, 0.5, 0.95)


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
    problem = density.problem if posterior.inputs is None else posterior.inputs.problem
    readings = {
        c: np.asarray(r) for c, r in _drawn_readings(posterior, records_at(density, points, seed), seed).items()
    }
    channels, data = problem.model.rig.channels, problem.observations
    unit = unit_of(data, channels)
    size = density.problem.layout.size
    n_time = readings[channels[0]].shape[-1]
    noise = np.stack([draw_noise(density.likelihood, n_time, point[size:], random) for point in points])
    found = {}
    for i, channel in enumerate(channels):
        weight = np.asarray(data.weight[channel])
        counted = weight > 0.0
        # Noise may grow with the load: the residuals of each reading are in units of its own.
        own = np.where(counted, 1.0 / np.where(counted, weight, 1.0), unit[:, i, None])
        replicates = readings[channel] + noise[:, :, i] * own
        bands = np.quantile(replicates, LEVELS, axis=0)
        value = np.asarray(data.measured[channel])
        inside = (value >= bands[0]) & (value <= bands[2])
        model = np.quantile(readings[channel], LEVELS, axis=0)
        found[channel] = Bands(model, bands, replicates, float(np.mean(inside[counted])))
    return found


def _drawn_readings(posterior: Posterior, local: np.ndarray, seed: int) -> dict[str, jax.Array]:
    """Readings of the model ``(n_draw, n_record, n_time)`` by channel, errors of its inputs drawn where they have some.

    Parameters
    ----------
    local : (n_draw, n_record, n_local) in SI units
    """
    density, inputs = posterior.density, posterior.inputs
    if inputs is None:
        return _readings(density, jnp.asarray(local))
    white = whitened_residuals(density.problem, density.likelihood.whitening, local)
    return inputs.readings(local, inputs.drawn(white, np.random.default_rng(seed)))


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
