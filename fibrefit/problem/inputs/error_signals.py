"""The error of a measured input as a sum of cosines, sent through the smoother that the input went through."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.noise.spectrum import MAINS, Noise
from fibrefit.problem.thresholds import LINE_WIDTH
from fibrefit.simulation.inputs import Signals

FASTEST = 100.0
"""Highest frequency in Hz of an error that is looked for, lines apart: beyond it the smoother lets little through. What
of it a stiff fibre turns into force and is not looked for is noise that comes and goes with the tension: with 60 Hz a
play as large as the noise of the drive, which swallows it, was 39 nats more probable than none, with 100 Hz 9 less."""
MOST = 1024
"""Most cosines for a record; a longer one has a lower highest frequency."""
COSINES = 16
"""Cosines whose effects are found in one pass along the motion."""
ALIKE = 1e-11
"""Difference of two weights of the smoother, of the largest one, up to which they are the same but for rounding."""
KINDS = 256
"""Distinct weights are padded to multiples of this, so that records share a compiled program."""


class InputErrors(NamedTuple):
    """What is known of the errors of one input.

    Parameters
    ----------
    numbers : (n_record, n_wave)
        Half periods of each cosine over the record; consecutive ones within each `COSINES`.
    size : (n_record, n_wave)
        Amplitude of each cosine, in SI units, for a coefficient of one.
    duration : (n_record,) in s
    weights : (n_record, n_kind, n_near, 2)
        Of the smoother, those of all instants that have the same ones once.
    kind : (n_record, n_time) int
        Which of them an instant has.
    """

    numbers: Any
    size: Any
    duration: Any
    weights: Any
    kind: Any

    @property
    def rms(self) -> float:
        """Rms in SI units that such errors have beforehand, the mean square over the records."""
        square = np.asarray(self.size) ** 2 * np.where(np.asarray(self.numbers) == 0, 1.0, 0.5)
        return float(np.sqrt(np.mean(np.sum(square, axis=1))))


def smoothed_cosines(times: jax.Array, known: InputErrors, places: jax.Array) -> Signals:
    """Cosines at some places of one `COSINES`, after the smoother, ``(n_place, n_time)``; zero where there is no such.

    A cosine shifted in time is a sum of two that are not: the smoother's weights are multiplied once for all instants.
    Each cosine is the one before it, turned on, as the functions themselves take most of the time.
    """
    there, inside = (places >= 0) & (places < known.size.size), jnp.clip(places, 0, known.size.size - 1)
    size, first = jnp.where(there, known.size[inside], 0.0), jnp.argmax(there)
    numbers = known.numbers[inside[first]] + jnp.arange(len(places)) - first
    near = known.weights.shape[1]
    pace = jnp.pi / known.duration
    shift = (times[1] - times[0]) * (jnp.arange(near) - near // 2) * pace * numbers[:, None]
    even, odd = (jnp.einsum("wi,cik->wkc", wave, known.weights) for wave in (jnp.cos(shift), jnp.sin(shift)))
    angle = pace * (times - times[0])
    turn = jnp.cos(angle), jnp.sin(angle)

    def on(here: tuple[jax.Array, jax.Array], of: tuple) -> tuple[tuple[jax.Array, jax.Array], jax.Array]:
        (cosine, sine), (size, even, odd) = here, of
        after = cosine * turn[0] - sine * turn[1], sine * turn[0] + cosine * turn[1]
        return after, size * (even[:, known.kind] * cosine - odd[:, known.kind] * sine)

    begun = jnp.cos(numbers[0] * angle), jnp.sin(numbers[0] * angle)
    return Signals(*jnp.moveaxis(jax.lax.scan(on, begun, (size, even, odd))[1], 1, 0))


def _smoothed(error: jax.Array, weights: jax.Array) -> jax.Array:
    """Value and slope ``(..., n_time, 2)`` of an error ``(..., n_time)`` after the smoother."""
    n_time, n_near = weights.shape[:2]
    padded = jnp.pad(error, [(0, 0)] * (error.ndim - 1) + [(n_near // 2, n_near // 2)])
    terms = (weights[:, i] * padded[..., i : i + n_time, None] for i in range(n_near))
    return sum(terms, start=jnp.zeros(()))


def taken_off(inputs: Mapping[str, Signals], times: jax.Array, known: Any, coefficients: Any) -> dict[str, Signals]:
    """Inputs of one record without their errors."""
    cleaned = dict(inputs)
    for name in known:
        weights = known[name].weights[known[name].kind]
        smooth = _smoothed(error_signal(times, known[name], coefficients[name]), weights)
        cleaned[name] = Signals(inputs[name].values - smooth[:, 0], inputs[name].slopes - smooth[:, 1])
    return cleaned


def error_signal(times: jax.Array, known: InputErrors, wave: jax.Array) -> jax.Array:
    """Error of an input at each instant, before the smoother, ``(n_time,)``; see `smoothed_cosines`.

    The angle of a cosine is that of the first of its `COSINES` and a few half periods more: by the theorem of addition
    the sum is two products of matrices, and few functions are evaluated.
    """
    angle, first = jnp.pi * (times - times[0]) / known.duration, known.numbers[::COSINES, None]
    further = jnp.arange(COSINES)[:, None] * angle
    parts = (known.size * wave).reshape(-1, COSINES)
    even, odd = parts @ jnp.cos(further), parts @ jnp.sin(further)
    return jnp.sum(jnp.cos(first * angle) * even - jnp.sin(first * angle) * odd, axis=0)


def amplitudes(noise: Noise, duration: float, numbers: np.ndarray) -> np.ndarray:
    """Amplitudes of cosines of so many half periods over a record, ``(n_wave,)``."""
    spacing = 0.5 / duration
    frequency = spacing * numbers
    density = noise.density(np.maximum(frequency, 0.5 * spacing))
    # At which of the mains frequencies an unnamed line lies is not kept: both are allowed it.
    for places, variance in ((MAINS, noise.line), *(((place,), power) for place, power in noise.lines)):
        near = np.min([np.abs(frequency - place) for place in places], axis=0) <= LINE_WIDTH
        density = density + near * variance / max(2.0 * LINE_WIDTH, spacing)
    return np.where(numbers == 0, np.sqrt(0.5), 1.0) * np.sqrt(2.0 * density * spacing)


def wave_numbers(noise: Noise, durations: np.ndarray) -> np.ndarray:
    """Half periods over each record of the cosines its error is made of, ``(n_record, n_wave)``: slow ones, and lines.

    Parameters
    ----------
    noise : Noise
    durations : (n_record,) in s
    """
    number = max(min(int(2.0 * FASTEST * durations.max()), MOST) // COSINES, 1) * COSINES
    runs = [np.tile(np.arange(number), (len(durations), 1))]
    width = -(-int(4.0 * LINE_WIDTH * durations.max()) // COSINES) * COSINES
    for place in (place for place, _ in noise.lines if 2.0 * place * durations.max() > number):
        middle = np.round(2.0 * place * durations).astype(int)
        runs.append(np.maximum(middle - width // 2, number)[:, None] + np.arange(width))
    return np.concatenate(runs, axis=1)


def stacked_weights(weights: Sequence[np.ndarray], size: int) -> tuple[np.ndarray, np.ndarray]:
    """Weights of all records, and which of them each instant has: `InputErrors`.

    Away from the ends and from corners of the motion all instants of an even clock have the same weights.

    Parameters
    ----------
    weights : sequence of (n_time, n_near, 2)
        Of each record.
    size : int
        Instants of the longest, the padding counted; in it all weights are zero.
    """
    widest = max(each.shape[1] for each in weights)
    found = [_distinct(each) for each in weights]
    number = KINDS * (1 + max(len(kinds) for kinds, _ in found) // KINDS)
    stacked = np.zeros((len(weights), number, widest, 2))
    kind = np.zeros((len(weights), size), dtype=np.int32)
    for r, (kinds, places) in enumerate(found):
        edge = (widest - kinds.shape[1]) // 2
        stacked[r, 1 : 1 + len(kinds), edge : edge + kinds.shape[1]] = kinds
        kind[r, : len(places)] = 1 + places
    return stacked, kind


def _distinct(weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows ``(n_kind, ...)`` that differ by more than rounding, and which of them each instant has."""
    flat = weights.reshape(len(weights), -1)
    size = np.abs(weights).max(axis=(0, 1)) * ALIKE
    rounded = np.round(weights / np.where(size > 0.0, size, 1.0)).reshape(flat.shape)
    _, first, places = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
    return weights[first], places.reshape(-1)
