"""The error of a measured input as a sum of cosines, sent through the smoother that the input went through."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.noise.spectrum import MAINS, Noise
from fibrefit.simulation.inputs import Signals

LINE_WIDTH = 1.0
"""Half width in Hz of the band in which the line of the mains may lie."""


class InputErrors(NamedTuple):
    """What is known of the errors of one input.

    Parameters
    ----------
    size : (n_record, n_wave)
        Amplitude of each cosine, in SI units, for a coefficient of one.
    duration : (n_record,) in s
    weights : (n_record, n_time, n_near, 2)
        Of the smoother.
    """

    size: Any
    duration: Any
    weights: Any


def smoothed_cosines(times: jax.Array, known: InputErrors, numbers: jax.Array) -> Signals:
    """Cosines with consecutive numbers, after the smoother, ``(n_number, n_time)``; nil where there is no such.

    A cosine shifted in time is a sum of two that are not: the smoother's weights are multiplied once for all instants.
    Each cosine is the one before it, turned on, as the functions themselves take most of the time.
    """
    there = (numbers >= 0) & (numbers < known.size.size)
    size = jnp.where(there, known.size[jnp.clip(numbers, 0, known.size.size - 1)], 0.0)
    near = known.weights.shape[1]
    pace = jnp.pi / known.duration
    shift = (times[1] - times[0]) * (jnp.arange(near) - near // 2) * pace * numbers[:, None]
    even, odd = (jnp.einsum("wi,tik->wkt", wave, known.weights) for wave in (jnp.cos(shift), jnp.sin(shift)))
    angle = pace * (times - times[0])
    turn = jnp.cos(angle), jnp.sin(angle)

    def on(here: tuple[jax.Array, jax.Array], of: tuple) -> tuple[tuple[jax.Array, jax.Array], jax.Array]:
        (cosine, sine), (size, even, odd) = here, of
        after = cosine * turn[0] - sine * turn[1], sine * turn[0] + cosine * turn[1]
        return after, size * (even * cosine - odd * sine)

    first = jnp.cos(numbers[0] * angle), jnp.sin(numbers[0] * angle)
    return Signals(*jnp.moveaxis(jax.lax.scan(on, first, (size, even, odd))[1], 1, 0))


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
        smooth = _smoothed(error_signal(times, known[name], coefficients[name]), known[name].weights)
        cleaned[name] = Signals(inputs[name].values - smooth[:, 0], inputs[name].slopes - smooth[:, 1])
    return cleaned


def error_signal(times: jax.Array, known: InputErrors, wave: jax.Array) -> jax.Array:
    """Error of an input at each instant, before the smoother, ``(n_time,)``."""
    angle = jnp.pi * jnp.arange(known.size.size)[:, None] * (times - times[0]) / known.duration
    return (known.size * wave) @ jnp.cos(angle)


def amplitudes(noise: Noise, duration: float, number: int) -> np.ndarray:
    """Amplitudes of cosines of 0, 1, 2 ... half periods over a record."""
    spacing = 0.5 / duration
    frequency = spacing * np.arange(number)
    density = noise.density(np.maximum(frequency, 0.5 * spacing))
    # At which of the mains frequencies the line lies is not kept: both are allowed it.
    near = np.min([np.abs(frequency - mains) for mains in MAINS], axis=0) <= LINE_WIDTH
    density = density + near * noise.line / max(2.0 * LINE_WIDTH, spacing)
    sizes = np.sqrt(2.0 * density * spacing)
    sizes[0] /= np.sqrt(2.0)
    return sizes


def stacked_weights(weights: list[np.ndarray], size: int) -> np.ndarray:
    """Weights of all records, ``(n_record, size, n_near, 2)``, padded with nothing."""
    widest = max(each.shape[1] for each in weights)
    stacked = np.zeros((len(weights), size, widest, 2))
    for place, each in zip(stacked, weights, strict=True):
        edge = (widest - each.shape[1]) // 2
        place[: len(each), edge : edge + each.shape[1]] = each
    return stacked
