"""Coloured noise: white, first-order parts of many corners, and lines, whitened exactly in one pass over a record.

First-order parts with corners spread over the band stand for any spectrum that falls with the frequency, 1/f among
them; with white noise and lines they are the reading of a small linear system driven by white noise, and its
innovations are those of a Kalman filter whose gains do not depend on the data. The gains are computed once; what is
left for each evaluation is one linear recurrence.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.programs import kept_program
from fibrefit.problem.noise.spectrum import Noise

RELAXATIONS = 10
"""First-order parts: corners lie a factor of two to three apart, so any falling spectrum is met within percents."""
PARTS = 4
"""First-order parts are carried in multiples of this."""
LINES = 3
"""Lines a channel may hold."""
HALF_WIDTH_OF_LINE = 0.02
"""Half width of a line in Hz: it keeps its phase for some ten seconds."""
LOWEST = 0.25
"""Lowest corner, in periods a record: what is slower still is an offset of each record."""
HIGHEST = 0.15
"""Highest corner, as a share of the sampling rate."""


class Bank(NamedTuple):
    """What coloured noise is composed of.

    Parameters
    ----------
    corners : (n_relaxation,) in Hz
        Of the first-order parts, the same for all records.
    decay : (n_record, n_relaxation)
        Factor on each of them from one sample to the next.
    pink : (n_record, n_relaxation)
        Their variances for a density of 1/f in unit^2/Hz.
    rate : (n_record,) in Hz
    """

    corners: jax.Array
    decay: jax.Array
    pink: jax.Array
    rate: jax.Array


def bank_of(rates: Sequence[float], duration: float) -> Bank:
    """Bank for records sampled at `rates` [Hz], the longest of which lasts `duration` [s]."""
    return _bank_of(tuple(rates), duration)


# All channels and looks at the same records ask for the same one.
@lru_cache(maxsize=4)
def _bank_of(rates: tuple[float, ...], duration: float) -> Bank:
    corners = np.geomspace(LOWEST / duration, HIGHEST * max(rates), RELAXATIONS)
    decay = np.exp(-2.0 * np.pi * corners / np.asarray(rates)[:, None])
    pink = np.stack([_pink(corners, rate, LOWEST / duration) for rate in rates])
    return Bank(*map(jax.device_put, (corners, decay, pink, np.asarray(rates, dtype=float))))


def bank_for(times: np.ndarray, counts: np.ndarray) -> Bank:
    """Bank for records with instants ``(n_record, n_time)`` in s, of which the first `counts` ``(n_record,)`` count."""
    rates = [float(1.0 / np.diff(t[:n]).mean()) for t, n in zip(times, counts, strict=True)]
    return bank_of(rates, longest(times, counts))


def longest(times: np.ndarray, counts: np.ndarray) -> float:
    """Time the longest record lasts, in s."""
    return float(max(t[n - 1] - t[0] for t, n in zip(times, counts, strict=True)))


def _pink(corners: np.ndarray, rate: float, lowest: float) -> np.ndarray:
    """Variances of first-order parts whose densities add up to 1/f from `lowest` to the band's end."""
    from scipy.optimize import nnls

    frequency = np.geomspace(lowest, 0.5 * rate, 400)
    decay = np.exp(-2.0 * np.pi * corners / rate)
    angle = 2.0 * np.pi * frequency[:, None] / rate
    density = 2.0 / rate * (1.0 - decay**2) / (1.0 - 2.0 * decay * np.cos(angle) + decay**2)
    return nnls(density * frequency[:, None], np.ones(len(frequency)))[0]


class Coloured(eqx.Module):
    """Innovations filter of coloured noise.

    Law
    ---
    z_t = r_t - sum(x_t), x_{t+1} = A (x_t + K_t z_t), e_t = z_t / s_t; A turns the two states of each line by its
    phase, and lets the others decay. At a masked sample K_t = 0.

    Parameters
    ----------
    gain : (n_time, n_record, n_channel, n_state)
        States: first-order parts, the lines, and the lines a quarter period on, which are not read.
    inverse_scale : (n_time, n_record, n_channel)
        One over s_t; zero where a sample is masked.
    along, across : (n_record, n_channel, n_state)
        Factors from one sample to the next of each state on itself and, of a line's, on its other one.
    variance : (n_record, n_channel, n_part + n_line + 1)
        Of first-order parts, lines, and white noise, in units of the residuals.
    """

    gain: jax.Array
    inverse_scale: jax.Array
    along: jax.Array
    across: jax.Array
    variance: jax.Array
    lines: int = eqx.field(static=True)

    @property
    def _read(self) -> slice:
        """States that are read."""
        return slice(self.along.shape[-1] - self.lines)

    @property
    def channels(self) -> int:
        """Number of channels."""
        return self.gain.shape[2]

    @property
    def log_scale(self) -> jax.Array:
        """Sum of the logarithms of the innovations' standard deviations over all valid samples."""
        valid = self.inverse_scale > 0.0
        return -jnp.sum(jnp.where(valid, jnp.log(jnp.where(valid, self.inverse_scale, 1.0)), 0.0))

    @property
    def scales(self) -> jax.Array:
        """Standard deviations ``(n_record, n_channel, n_time)`` of the innovations; zero where a sample is masked."""
        valid = self.inverse_scale > 0.0
        return jnp.moveaxis(jnp.where(valid, 1.0 / jnp.where(valid, self.inverse_scale, 1.0), 0.0), 0, -1)

    def whiten(self, residuals: jax.Array) -> jax.Array:
        """Innovations of unit variance; zero where a sample is masked."""
        return self.whiten_rows(residuals[None])[0]

    def whiten_rows(self, rows: jax.Array) -> jax.Array:
        """Innovations of many residuals at once, ``(n_row, n_record, n_channel, n_time)``."""

        def step(state: jax.Array, here: Any) -> tuple[jax.Array, jax.Array]:
            residual, gain = here
            innovation = residual - jnp.sum(state[..., self._read], axis=-1)
            state = state + gain * innovation[..., None]
            after = self.along * state
            return after + self.across * swapped(state, self.lines) if self.lines else after, innovation

        start = jnp.zeros((len(rows), *self.gain.shape[1:]))
        innovations = jax.lax.scan(step, start, (jnp.moveaxis(rows, -1, 0), self.gain), unroll=4)[1]
        return jnp.moveaxis(innovations * self.inverse_scale[:, None], 0, -1)

    def autocovariance(self, n_lag: int) -> np.ndarray:
        """Sum of that of all parts, ``(n_record, n_channel, n_lag)``."""
        along, across, variance = map(np.asarray, (self.along, self.across, self.variance))
        lags = np.arange(n_lag)
        held, phase = np.hypot(along, across)[..., self._read, None], np.arctan2(across, along)[..., self._read, None]
        turning = held**lags * (np.cos(phase * lags) if self.lines else 1.0)
        return np.sum(variance[..., :-1, None] * turning, axis=-2) + variance[..., -1:] * (lags == 0)


def coloured_of(bank: Bank, noise: Sequence[Noise], unit: np.ndarray, valid: np.ndarray) -> Coloured:
    """The filter for noise of known spectra.

    Parameters
    ----------
    noise : sequence of Noise
        One for each channel, in SI units.
    unit : (n_record, n_channel)
        SI units in one unit of the residuals.
    valid : (n_record, n_channel, n_time) bool
    """
    number = max(len(_lines(of)) for of in noise)
    turn = np.zeros((len(noise), number))
    for channel, of in enumerate(noise):
        lines = [frequency for frequency, _ in _lines(of)]
        turn[channel, : len(lines)] = lines
    variance, size = np.asarray(variances_of(bank, noise, unit)), len(bank.corners)
    # Parts that no channel has take time in every evaluation; their number goes in steps, for the compiler's sake.
    some = np.argsort(-variance[..., :size].max(axis=(0, 1)), kind="stable")
    used = int(np.count_nonzero(variance[..., :size].max(axis=(0, 1))))
    kept = np.sort(some[: min(size, max(-(-used // PARTS) * PARTS, PARTS))])
    variance = np.concatenate([variance[..., kept], variance[..., size : size + number], variance[..., -1:]], axis=-1)
    gain, inverse_scale, along, across = _filtered(
        np.asarray(bank.decay)[:, kept], bank.rate, turn, variance, np.asarray(valid)
    )
    return Coloured(gain, inverse_scale, along, across, jax.device_put(variance), number)


@kept_program
def _filtered(
    decay: jax.Array, rate: jax.Array, lines: jax.Array, variance: jax.Array, valid: jax.Array
) -> tuple[jax.Array, ...]:
    """Gains by a Kalman filter's covariance recursion, inverse scales, and factors of the states."""
    along, across = _turns(decay, rate, lines)
    number = lines.shape[1]
    read = slice(along.shape[-1] - number)
    # Both phases of a line have its variance.
    stationary = jnp.concatenate([variance[..., :-1], variance[..., -1 - number : -1]], axis=-1)
    fresh = stationary * (1.0 - along**2 - across**2)
    eye = jnp.eye(along.shape[-1])

    def turned(covariance: jax.Array) -> jax.Array:
        other = jnp.swapaxes(swapped(jnp.swapaxes(covariance, -1, -2), number), -1, -2)
        return along[..., None] * covariance + across[..., None] * other

    def step(covariance: jax.Array, here: jax.Array) -> Any:
        seen = jnp.sum(covariance[..., read], axis=-1)
        total = jnp.sum(seen[..., read], axis=-1) + variance[..., -1]
        gain = jnp.where(here[..., None], seen / total[..., None], 0.0)
        covariance = covariance - gain[..., :, None] * seen[..., None, :]
        covariance = turned(jnp.swapaxes(turned(covariance), -1, -2)) + fresh[..., None] * eye
        return covariance, (gain, jnp.where(here, 1.0 / jnp.sqrt(total), 0.0))

    first = jnp.broadcast_to(stationary[..., None] * eye, (*stationary.shape, stationary.shape[-1]))
    gain, inverse_scale = jax.lax.scan(step, first, jnp.moveaxis(valid, -1, 0))[1]
    return gain, inverse_scale, along, across


def variances_of(bank: Bank, noise: Sequence[Noise], unit: np.ndarray) -> jax.Array:
    """Variances of all parts in units of the residuals, ``(n_record, n_channel, n_relaxation + n_line + 1)``.

    Parameters as `coloured_of`.
    """
    corners, pink, rate = map(np.asarray, (bank.corners, bank.pink, bank.rate))
    parts = np.zeros((len(rate), len(noise), len(corners) + LINES + 1))
    for channel, of in enumerate(noise):
        parts[:, channel, : len(corners)] = of.pink * pink
        for corner, variance in of.slow:
            parts[:, channel, int(np.argmin(np.abs(np.log(corners / corner))))] += variance
        lines = [variance for _, variance in _lines(of)]
        parts[:, channel, len(corners) : len(corners) + len(lines)] = lines
        parts[:, channel, -1] = of.white * 0.5 * rate
    return jax.device_put(parts / np.asarray(unit)[..., None] ** 2)


def _lines(noise: Noise) -> list[tuple[float, float]]:
    """Lines of a noise, the strongest first."""
    return sorted(noise.all_lines, key=lambda line: -line[1])[:LINES]


def _turns(decay: jax.Array, rate: jax.Array, lines: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Factors ``(n_record, n_channel, n_state)`` of each state on itself and, of a line's, on its other one."""
    pace = 2.0 * jnp.pi / rate[:, None, None]
    held = jnp.exp(-pace * HALF_WIDTH_OF_LINE)
    cosine, sine = held * jnp.cos(pace * lines), held * jnp.sin(pace * lines)
    decay = jnp.broadcast_to(decay[:, None, :], (*cosine.shape[:2], decay.shape[1]))
    along = jnp.concatenate([decay, cosine, cosine], axis=-1)
    return along, jnp.concatenate([jnp.zeros_like(decay), -sine, sine], axis=-1)


def swapped(states: jax.Array, lines: int) -> jax.Array:
    """States with the two of each line exchanged."""
    rest, first, second = jnp.split(states, [states.shape[-1] - 2 * lines, states.shape[-1] - lines], axis=-1)
    return jnp.concatenate([rest, second, first], axis=-1)
