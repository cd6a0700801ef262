"""Coloured noise: hiss, slow wander and a mains line, whitened exactly in one pass over a record.

Wander with a density of 1/f is a sum of a few relaxations with rates spread over the band; with hiss and a line it is
the reading of a small linear system driven by white noise, and its innovations are those of a Kalman filter whose gains
do not depend on the data. They are computed once; what is left for each evaluation is one linear recurrence.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.noise.spectrum import MAINS, Noise

RELAXATIONS = 6
"""Relaxations that stand for the wander: with six over four decades the density is right within a few per cent."""


LOWEST = 0.25
"""Lowest frequency of the wander, in periods a record: what wanders more slowly still is an offset of each record."""


class Bank(NamedTuple):
    """Relaxations whose sum has a density of 1/f, and the mains line.

    Parameters
    ----------
    decay : (n_record, n_relaxation)
        Factor on each relaxation from one sample to the next.
    variance : (n_record, n_relaxation)
        For a density of 1/f in unit^2/Hz.
    turn : (n_record,) in rad
        Phase of the mains line from one sample to the next.
    band : (n_record,) in Hz
        Half the sampling rate.
    """

    decay: jax.Array
    variance: jax.Array
    turn: jax.Array
    band: jax.Array


def bank_of(rates: Sequence[float], duration: float, mains: float = MAINS[0]) -> Bank:
    """Bank for records sampled at `rates` [Hz], the longest of which lasts `duration` [s]."""
    columns = [_relaxations(rate, LOWEST / duration) for rate in rates]
    decay, variance = (jnp.asarray(np.stack(part)) for part in zip(*columns, strict=True))
    rate = np.asarray(rates)
    return Bank(decay, variance, jnp.asarray(2.0 * np.pi * mains / rate), jnp.asarray(0.5 * rate))


def bank_for(times: np.ndarray, counts: np.ndarray, residuals: np.ndarray) -> Bank:
    """Bank for records whose residuals are known: the stronger mains line is theirs.

    Parameters
    ----------
    times : (n_record, n_time) in s
    counts : (n_record,)
        Samples of each record.
    residuals : (n_record, n_channel, n_time)
    """
    rates = [float(1.0 / np.diff(t[:n]).mean()) for t, n in zip(times, counts, strict=True)]
    duration = longest(times, counts)
    index = np.arange(residuals.shape[-1])

    def power(line: float) -> float:
        wave = np.exp(-2j * np.pi * line / np.array(rates)[:, None] * index)
        return float(np.sum(np.abs(np.einsum("rct,rt->rc", residuals, wave)) ** 2))

    return bank_of(rates, duration, max(MAINS, key=power))


def longest(times: np.ndarray, counts: np.ndarray) -> float:
    """Time the longest record lasts, in s."""
    return float(max(t[n - 1] - t[0] for t, n in zip(times, counts, strict=True)))


def _relaxations(rate: float, lowest: float) -> tuple[np.ndarray, np.ndarray]:
    """Decay factors and variances whose densities add up to 1/f from `lowest` to the band's end."""
    from scipy.optimize import nnls

    frequency = np.geomspace(lowest, 0.5 * rate, 400)
    decay = np.exp(-2.0 * np.pi * np.geomspace(1.2 * lowest, 0.3 * rate, RELAXATIONS) / rate)
    angle = 2.0 * np.pi * frequency[:, None] / rate
    density = 2.0 / rate * (1.0 - decay**2) / (1.0 - 2.0 * decay * np.cos(angle) + decay**2)
    variance, _ = nnls(density * frequency[:, None], np.ones(len(frequency)))
    return decay, variance


class Coloured(eqx.Module):
    """Innovations filter of hiss, wander and line.

    Law
    ---
    z_t = r_t - sum(x_t), x_{t+1} = A (x_t + K_t z_t), e_t = z_t / s_t; A turns the last two states by the phase of the
    line, and lets the others decay. At a masked sample K_t = 0.

    Parameters
    ----------
    gain : (n_time, n_record, n_channel, n_state)
    inverse_scale : (n_time, n_record, n_channel)
        One over s_t; zero where a sample is masked.
    bank : Bank
    variance : (n_record, n_channel, n_relaxation + 2)
        Of the states, the hiss last, in units of the residuals; the line before it.
    """

    gain: jax.Array
    inverse_scale: jax.Array
    bank: Bank
    variance: jax.Array

    @property
    def log_scale(self) -> jax.Array:
        """Sum of the logarithms of the innovations' standard deviations over all valid samples."""
        valid = self.inverse_scale > 0.0
        return -jnp.sum(jnp.where(valid, jnp.log(jnp.where(valid, self.inverse_scale, 1.0)), 0.0))

    def whiten(self, residuals: jax.Array) -> jax.Array:
        """Innovations of unit variance; zero where a sample is masked."""
        along, across = _turns(self.bank)

        def step(state: jax.Array, row: Any) -> tuple[jax.Array, jax.Array]:
            residual, gain = row
            innovation = residual - jnp.sum(state[..., :-1], axis=-1)
            state = state + gain * innovation[..., None]
            return along * state + across * _swapped(state, -1), innovation

        rows = (jnp.moveaxis(residuals, -1, 0), self.gain)
        innovations = jax.lax.scan(step, jnp.zeros(self.gain.shape[1:]), rows)[1]
        return jnp.moveaxis(innovations * self.inverse_scale, 0, -1)

    def autocovariance(self, n_lag: int) -> np.ndarray:
        """Sum of the relaxations', the line's and the hiss's."""
        bank, variance = jax.tree.map(np.asarray, (self.bank, self.variance))
        lags = np.arange(n_lag)
        wander = np.einsum("rcj,rjk->rck", variance[..., :-2], bank.decay[..., None] ** lags)
        line = variance[..., -2, None] * np.cos(bank.turn[:, None, None] * lags)
        return wander + line + variance[..., -1, None] * (lags == 0)


@jax.jit
def coloured_of(bank: Bank, variance: jax.Array, valid: jax.Array) -> Coloured:
    """The filter, its gains computed by a Kalman filter's covariance recursion.

    Parameters
    ----------
    bank : Bank
    variance : (n_record, n_channel, n_relaxation + 2)
        See `Coloured`.
    valid : (n_record, n_channel, n_time) bool
    """
    along, across = _turns(bank)
    # Both phases of the line have its variance.
    stationary = jnp.concatenate([variance[..., :-1], variance[..., -2:-1]], axis=-1)
    fresh = stationary * (1.0 - along**2 - across**2)
    eye = jnp.eye(along.shape[-1])

    def turned(covariance: jax.Array) -> jax.Array:
        return along[..., None] * covariance + across[..., None] * _swapped(covariance, -2)

    def step(covariance: jax.Array, here: jax.Array) -> Any:
        seen = jnp.sum(covariance[..., :-1], axis=-1)
        total = jnp.sum(seen[..., :-1], axis=-1) + variance[..., -1]
        gain = jnp.where(here[..., None], seen / total[..., None], 0.0)
        covariance = covariance - gain[..., :, None] * seen[..., None, :]
        covariance = turned(jnp.swapaxes(turned(covariance), -1, -2)) + fresh[..., None] * eye
        return covariance, (gain, jnp.where(here, 1.0 / jnp.sqrt(total), 0.0))

    first = jnp.broadcast_to(stationary[..., None] * eye, (*stationary.shape, stationary.shape[-1]))
    gain, inverse_scale = jax.lax.scan(step, first, jnp.moveaxis(valid, -1, 0))[1]
    return Coloured(gain, inverse_scale, bank, variance)


def variances_of(bank: Bank, noise: Sequence[Noise], unit: np.ndarray) -> jax.Array:
    """Variances of wander, line and hiss in units of the residuals, ``(n_record, n_channel, n_relaxation + 2)``.

    Parameters
    ----------
    bank : Bank
    noise : sequence of Noise
        One for each channel, in SI units.
    unit : (n_record, n_channel)
        SI units in one unit of the residuals.
    """
    pink, line, white = (jnp.array([getattr(n, name) for n in noise]) for name in ("pink", "line", "white"))
    wander = pink[:, None] * bank.variance[:, None, :]
    shape = wander.shape[:2]
    rest = jnp.stack([jnp.broadcast_to(line, shape), white * bank.band[:, None]], axis=-1)
    return jnp.concatenate([wander, rest], axis=-1) / jnp.asarray(unit)[..., None] ** 2


def _turns(bank: Bank) -> tuple[jax.Array, jax.Array]:
    """Factors ``(n_record, 1, n_state)`` of each state on itself and, of the line's, on one another."""
    cosine, sine = jnp.cos(bank.turn)[:, None], jnp.sin(bank.turn)[:, None]
    along = jnp.concatenate([bank.decay, cosine, cosine], axis=1)
    across = jnp.concatenate([jnp.zeros_like(bank.decay), -sine, sine], axis=1)
    return along[:, None, :], across[:, None, :]


def _swapped(states: jax.Array, axis: int) -> jax.Array:
    """States with the last two exchanged."""
    size = states.shape[axis]
    parts = (
        jax.lax.slice_in_dim(states, *ends, axis=axis)
        for ends in ((0, size - 2), (size - 1, size), (size - 2, size - 1))
    )
    return jnp.concatenate(list(parts), axis=axis)
