"""Coloured noise: white, first-order parts of many corners, and lines, whitened exactly in one pass over a record.

First-order parts with corners spread over the band stand for any spectrum that falls with the frequency, 1/f among
them; with white noise and lines they are the reading of a small linear system driven by white noise, and its
innovations are those of a Kalman filter whose gains do not depend on the data. The gains are computed once; what is
left for each evaluation is one linear recurrence.

A filter that goes from sample to sample takes as long for one row of residuals as for ten, since each of its steps is
short. Within a block of samples innovations are a triangular matrix times the residuals, and what came before enters by
the state at its beginning alone; only that is carried on from block to block.

Law
---
``z_t = r_t - sum(x_t)``, ``x_{t+1} = A (x_t + K_t z_t)``, ``e_t = z_t / s_t``; A turns the two states of each line by
its phase, and lets the others decay. At a masked sample ``K_t = 0``. With the covariance P of the states the gain is
``K = P h / s^2`` and ``s^2 = h' P h + v``, h being one for each state that is read and v the white variance; P becomes
``A (P - K h' P) A' + Q``, Q what keeps the variance of each part.

Source
------
Block recursive filters: Burrus, IEEE Trans. Audio Electroacoust. 20 (1972).
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
from fibrefit.core.threads import for_each
from fibrefit.problem.noise.spectrum import Noise

LINES = 3
"""Lines a channel may hold."""
HALF_WIDTH_OF_LINE = 0.02
"""Half width of a line in Hz: it keeps its phase for some ten seconds."""
BLOCK = 32
"""Samples of a block: fewer make more blocks, more make larger matrices."""


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


# All channels and looks at the same records ask for the same one.
@lru_cache(maxsize=4)
def bank_of(rates: tuple[float, ...], duration: float) -> Bank:
    """Bank for records sampled at `rates` [Hz], the longest of which lasts `duration` [s]."""
    from scipy.optimize import nnls

    # What is slower than a quarter of a period of a record is an offset of it. Ten corners lie a factor of two to three
    # apart, so any falling spectrum is met within percents.
    lowest = 0.25 / duration
    corners = np.geomspace(lowest, 0.15 * max(rates), 10)
    decay = np.exp(-2.0 * np.pi * corners / np.asarray(rates)[:, None])
    pink = []
    for rate, own in zip(rates, decay, strict=True):
        # Variances of parts whose densities add up to 1/f from the lowest corner to the band's end.
        frequency = np.geomspace(lowest, 0.5 * rate, 400)
        angle = 2.0 * np.pi * frequency[:, None] / rate
        density = 2.0 / rate * (1.0 - own**2) / (1.0 - 2.0 * own * np.cos(angle) + own**2)
        pink.append(nnls(density * frequency[:, None], np.ones(len(frequency)))[0])
    return Bank(*map(jax.device_put, (corners, decay, np.stack(pink), np.asarray(rates, dtype=float))))


def bank_for(times: np.ndarray, counts: np.ndarray) -> Bank:
    """Bank for records with instants ``(n_record, n_time)`` in s, of which the first `counts` ``(n_record,)`` count."""
    rates = tuple(float(1.0 / np.diff(t[:n]).mean()) for t, n in zip(times, counts, strict=True))
    return bank_of(rates, float(max(t[n - 1] - t[0] for t, n in zip(times, counts, strict=True))))


class Coloured(eqx.Module):
    """Innovations filter of coloured noise.

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
            return after + self.across * _swapped(state, self.lines) if self.lines else after, innovation

        start = jnp.zeros((len(rows), *self.gain.shape[1:]))
        innovations = jax.lax.scan(step, start, (jnp.moveaxis(rows, -1, 0), self.gain), unroll=4)[1]
        return jnp.moveaxis(innovations * self.inverse_scale[:, None], 0, -1)

    def whiten_many(self, records: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Those of so many residuals of each record that products of matrices pay, see `BlockFilter`."""
        return in_blocks(self).whiten_many(records)

    def autocovariance(self, n_lag: int) -> np.ndarray:
        """Sum of that of all parts, ``(n_record, n_channel, n_lag)``."""
        along, across, variance = map(np.asarray, (self.along, self.across, self.variance))
        lags = np.arange(n_lag)
        decay, phase = np.hypot(along, across)[..., self._read, None], np.arctan2(across, along)[..., self._read, None]
        turning = decay**lags * (np.cos(phase * lags) if self.lines else 1.0)
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
    corners, pink, rate = map(np.asarray, (bank.corners, bank.pink, bank.rate))
    lines = [sorted(of.all_lines, key=lambda line: -line[1])[:LINES] for of in noise]
    number, size = max(map(len, lines)), len(corners)
    turn, variance = np.zeros((len(noise), number)), np.zeros((len(rate), len(noise), size + number + 1))
    for channel, (of, own) in enumerate(zip(noise, lines, strict=True)):
        turn[channel, : len(own)] = [frequency for frequency, _ in own]
        variance[:, channel, :size] = of.pink * pink
        for corner, part in of.slow:
            variance[:, channel, int(np.argmin(np.abs(np.log(corners / corner))))] += part
        variance[:, channel, size : size + len(own)] = [part for _, part in own]
        variance[:, channel, -1] = of.white * 0.5 * rate
    variance = variance / np.asarray(unit)[..., None] ** 2

    # Parts that no channel has take time in every evaluation; their number goes in fours, for the compiler's sake.
    largest = variance[..., :size].max(axis=(0, 1))
    used = min(size, max(-(-int(np.count_nonzero(largest)) // 4) * 4, 4))
    kept = np.sort(np.argsort(-largest, kind="stable")[:used])
    variance = np.concatenate([variance[..., kept], variance[..., size:]], axis=-1)
    decay = np.asarray(bank.decay)[:, kept]
    gain, inverse_scale, along, across = _filtered(decay, bank.rate, turn, variance, np.asarray(valid))
    return Coloured(gain, inverse_scale, along, across, jax.device_put(variance), number)


@kept_program
def _filtered(
    decay: jax.Array, rate: jax.Array, lines: jax.Array, variance: jax.Array, valid: jax.Array
) -> tuple[jax.Array, ...]:
    """Gains by a Kalman filter's covariance recursion, inverse scales, and factors of the states."""
    number, pace = lines.shape[1], 2.0 * jnp.pi / rate[:, None, None]
    damping = jnp.exp(-pace * HALF_WIDTH_OF_LINE)
    cosine, sine = damping * jnp.cos(pace * lines), damping * jnp.sin(pace * lines)
    decay = jnp.broadcast_to(decay[:, None, :], (*cosine.shape[:2], decay.shape[1]))
    # Factors ``(n_record, n_channel, n_state)`` of each state on itself and, of a line's, on its other one.
    along = jnp.concatenate([decay, cosine, cosine], axis=-1)
    across = jnp.concatenate([jnp.zeros_like(decay), -sine, sine], axis=-1)
    read = slice(along.shape[-1] - number)
    # Both phases of a line have its variance.
    stationary = jnp.concatenate([variance[..., :-1], variance[..., -1 - number : -1]], axis=-1)
    fresh = stationary * (1.0 - along**2 - across**2)
    eye = jnp.eye(along.shape[-1])

    def turned(covariance: jax.Array) -> jax.Array:
        other = jnp.swapaxes(_swapped(jnp.swapaxes(covariance, -1, -2), number), -1, -2)
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


def _swapped(states: jax.Array, lines: int) -> jax.Array:
    """States with the two of each line exchanged."""
    rest, first, second = jnp.split(states, [states.shape[-1] - 2 * lines, states.shape[-1] - lines], axis=-1)
    return jnp.concatenate([rest, second, first], axis=-1)


class BlockFilter(eqx.Module):
    """The filter of a `Coloured`.

    Parameters
    ----------
    taps : (n_block, n_record, n_channel, BLOCK, BLOCK)
        Innovations from the residuals of the block.
    onto : (n_block, n_record, n_channel, BLOCK, n_state)
        Innovations from the states before it.
    drive : (n_block, n_record, n_channel, n_state, BLOCK)
        States after it from its residuals.
    carry : (n_block, n_record, n_channel, n_state, n_state)
        States after it from those before.
    """

    taps: jax.Array
    onto: jax.Array
    drive: jax.Array
    carry: jax.Array

    def of_records(self, records: Sequence[int]) -> BlockFilter:
        """The filter of other records, each like one of these, whose places are given."""
        places = np.asarray(records)
        return BlockFilter(*(part[:, places] for part in (self.taps, self.onto, self.drive, self.carry)))

    def whiten(self, residuals: jax.Array) -> jax.Array:
        """Innovations of unit variance ``(n_record, n_channel, n_time)``; zero where a sample is masked."""
        return self.whiten_rows(residuals[None])[0]

    def whiten_rows(self, rows: jax.Array) -> jax.Array:
        """Innovations of many residuals at once, ``(n_row, n_record, n_channel, n_time)``."""
        number, time = len(self.taps), rows.shape[-1]
        padded = jnp.pad(rows, [(0, 0)] * 3 + [(0, number * BLOCK - time)])
        blocks = jnp.transpose(padded.reshape(*rows.shape[:3], number, BLOCK), (3, 1, 2, 4, 0))

        def on(state: jax.Array, block: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
            carry, driven = block
            return carry @ state + driven, state

        nothing = jnp.zeros((*self.carry.shape[1:4], len(rows)))
        _, before = jax.lax.scan(on, nothing, (self.carry, self.drive @ blocks))
        innovations = self.taps @ blocks + self.onto @ before
        return jnp.transpose(innovations, (4, 1, 2, 0, 3)).reshape(*rows.shape[:3], number * BLOCK)[..., :time]

    def whiten_many(self, records: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Innovations of so many residuals of each record ``(n_row, n_channel, n_seen)`` that products of matrices pay.

        NumPy's are several times as fast as those of a compiled program, in the precision of the rows. What is not seen
        of the end of a record is not needed.
        """

        def one(r: int, rows: np.ndarray) -> np.ndarray:
            time = rows.shape[-1]
            number = -(-time // BLOCK)
            parts = self.taps, self.onto, self.drive, self.carry
            taps, onto, drive, carry = (np.asarray(part[:number], dtype=rows.dtype) for part in parts)
            padded = np.pad(rows, [(0, 0)] * 2 + [(0, number * BLOCK - time)])
            blocks = np.ascontiguousarray(padded.reshape(*rows.shape[:2], number, BLOCK).transpose(2, 1, 3, 0))
            before = drive[:, r] @ blocks
            state = np.zeros_like(before[0])
            for block, after in zip(carry[:, r], before, strict=True):
                driven = after.copy()
                after[:] = state
                state = block @ state + driven
            innovations = taps[:, r] @ blocks
            innovations += onto[:, r] @ before
            return np.ascontiguousarray(innovations.transpose(3, 1, 0, 2).reshape(padded.shape)[..., :time])

        return for_each(one, range(len(records)), records)


@kept_program
def in_blocks(filtered: Coloured) -> BlockFilter:
    """A filter in blocks: what it makes of each sample of a block, and of each state before it."""
    lines, size = filtered.lines, filtered.along.shape[-1]
    read = slice(size - lines)
    number = -(-len(filtered.gain) // BLOCK)
    spare = number * BLOCK - len(filtered.gain)
    # What belongs to each sample of a block, ``(BLOCK, n_block, ...)``; padded with nothing.
    gain, scale = (
        jnp.swapaxes(
            jnp.pad(part, [(0, spare), *[(0, 0)] * (part.ndim - 1)]).reshape(number, BLOCK, *part.shape[1:]), 0, 1
        )
        for part in (filtered.gain, filtered.inverse_scale)
    )
    along, across = filtered.along[..., None, :], filtered.across[..., None, :]
    state = jnp.zeros((*gain.shape[1:4], BLOCK + size, size)).at[..., BLOCK:, :].set(jnp.eye(size))

    def step(state: jax.Array, here: tuple[jax.Array, jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        impulse, gain, scale = here
        innovation = impulse - jnp.sum(state[..., read], axis=-1)
        state = state + gain[..., None, :] * innovation[..., None]
        after = along * state
        return after + across * _swapped(state, lines) if lines else after, innovation * scale[..., None]

    end, made = jax.lax.scan(step, state, (jnp.eye(BLOCK, BLOCK + size), gain, scale))
    made, end = jnp.moveaxis(made, 0, -2), jnp.swapaxes(end, -1, -2)
    return BlockFilter(made[..., :BLOCK], made[..., BLOCK:], end[..., :BLOCK], end[..., BLOCK:])
