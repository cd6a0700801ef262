"""The noise of a fit's residuals, at a glance: hiss, slow wander and hum, and whether they are all of its memory."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from fibrefit.problem.noise.autoregressive import innovation_variances, order_and_covariance
from fibrefit.problem.noise.coloured import Coloured, bank_for, coloured_of, variances_of
from fibrefit.problem.noise.likelihood import unit_of
from fibrefit.problem.noise.spectrum import Noise, noise_of
from fibrefit.problem.noise.whitening import innovations
from fibrefit.problem.statement.problem import Problem


@dataclass(frozen=True)
class Wander:
    """Noise of residuals as hiss, wander and hum.

    Parameters
    ----------
    whitening : Coloured
    noise : tuple of Noise
        Of each channel, in SI units.
    over_white, over_autoregressive : float
        How much more likely it makes the residuals than noise without memory, and than the best autoregression:
        differences of log likelihoods, corrected for the numbers each contains.
    """

    whitening: Coloured
    noise: tuple[Noise, ...]
    over_white: float
    over_autoregressive: float


def wander_of(problem: Problem, residuals: np.ndarray) -> Wander:
    """Spectrum of residuals, the filter that whitens them, and what else they might be.

    Parameters
    ----------
    problem : Problem
    residuals : (n_record, n_channel, n_time) in units of the noise
    """
    data, channels = problem.observations, problem.model.rig.channels
    times, counts = map(np.asarray, data.experiment[:2])
    valid = np.stack([np.asarray(data.weight[channel]) > 0.0 for channel in channels], axis=1)
    unit, bank = unit_of(data, channels), bank_for(times, counts, residuals)
    noise = tuple(
        _noise(residuals[:, c] * unit[:, c, None], valid[:, c], counts, 2.0 * np.asarray(bank.band))
        for c in range(len(channels))
    )
    whitening = coloured_of(bank, variances_of(bank, noise, unit), valid)
    white, autoregressive = _rivals(residuals, valid)
    fresh = np.asarray(innovations(whitening, jnp.asarray(residuals)))
    own = _score(np.sum(fresh**2, axis=(0, 2)), valid, 3 * len(channels)) - float(whitening.log_scale)
    return Wander(whitening, noise, own - white, own - autoregressive)


def _noise(residuals: np.ndarray, valid: np.ndarray, counts: np.ndarray, rates: np.ndarray) -> Noise:
    """Spectrum of one channel ``(n_record, n_time)``; masked samples are nil, and the rest stands for them."""
    pieces = []
    for row, seen, count, rate in zip(residuals, valid, counts, rates, strict=True):
        if seen.any():
            pieces.append((row[:count] * np.sqrt(count / seen.sum()), float(rate)))
    return noise_of(pieces) if pieces else Noise(1.0, 0.0, 0.0, 0)


def _rivals(residuals: np.ndarray, valid: np.ndarray) -> tuple[float, float]:
    """Scores of noise without memory and of an autoregression of the best order."""
    white, foretold, numbers = np.sum(residuals**2, axis=(0, 2)), [], 0
    for c in range(valid.shape[1]):
        order, covariance = order_and_covariance(residuals[:, c], valid[:, c])
        foretold.append(innovation_variances(covariance)[-1] * valid[:, c].sum())
        numbers += order + 1
    return _score(white, valid, valid.shape[1]), _score(np.array(foretold), valid, numbers)


def _score(squares: np.ndarray, valid: np.ndarray, numbers: int) -> float:
    """Log likelihood at the best level of each channel, less Schwarz's penalty; constants left out."""
    counts = valid.sum(axis=(0, 2))
    seen = counts > 0
    likelihood = -0.5 * float(np.sum(counts[seen] * np.log(np.maximum(squares[seen] / counts[seen], 1e-300))))
    return likelihood - 0.5 * numbers * float(np.log(counts.sum()))
