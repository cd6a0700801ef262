"""Measured inputs between the points of the grid."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax


class Signals(NamedTuple):
    """A measured input as a cubic between the points of the grid.

    Parameters
    ----------
    values : (n_time,) in SI units of the input
    slopes : (n_time,) its rate, per second
    """

    values: jax.Array
    slopes: jax.Array


class Course(NamedTuple):
    """The same, ready to be evaluated: coefficients of 1, t, t^2, t^3 in each step, t [s] from its start.

    Parameters
    ----------
    constant, linear, square, cube : (n_time - 1,)
    """

    constant: jax.Array
    linear: jax.Array
    square: jax.Array
    cube: jax.Array


def courses(inputs: dict[str, Signals], times: jax.Array) -> dict[str, Course]:
    """Cubics of all inputs over the steps between `times` [s]."""
    length = times[1:] - times[:-1]

    def course(signal: Signals) -> Course:
        rise = (signal.values[1:] - signal.values[:-1]) / length
        m0, m1 = signal.slopes[:-1], signal.slopes[1:]
        return Course(signal.values[:-1], m0, (3.0 * rise - 2.0 * m0 - m1) / length, (m0 + m1 - 2.0 * rise) / length**2)

    return {name: course(signal) for name, signal in inputs.items()}


def row(array: jax.Array, index: jax.Array) -> jax.Array:
    """Element of an array, with no thought of negative indices."""
    return jax.lax.dynamic_index_in_dim(array, index, keepdims=False, allow_negative_indices=False)


def inputs_at(inputs: dict[str, Course], times: jax.Array, step: jax.Array, time: jax.Array) -> dict[str, Any]:
    """Value and rate of each input at `time` [s], which lies in step `step` of the grid.

    Returns
    -------
    dict of tuple
        ``(value, rate)`` of each input.
    """
    if not inputs:
        return {}
    t = time - row(times, step)

    def at(course: Course) -> tuple[jax.Array, jax.Array]:
        a, b, c, d = (row(terms, step) for terms in course)
        return a + t * (b + t * (c + t * d)), b + t * (2.0 * c + t * (3.0 * d))

    return {name: at(course) for name, course in inputs.items()}
