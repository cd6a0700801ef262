"""Errors of measured inputs as unknowns of the problem, held by what is known of their spectrum.

A drive is measured with noise, and a stiff fibre turns that noise into force. Taken for exact, such an input leaves a
gap no model can close, and biases what is identified. Here its error is one more unknown of each record: a sum of
cosines over the record with independent coefficients of variance one, each as large as the input's noise is at its
frequency, sent through the smoother that the input went through. Linearised, these coefficients are eliminated exactly.

Law
---
Residuals ``r(θ, w) ≈ r + J δθ + A δw`` with prior ``w ~ N(0, I)``. For given θ the best ``w`` leaves
``|r|² + |w|² = m' P m`` with ``m = r - A w`` and ``P = (I + A A')⁻¹ = I - A (I + A'A)⁻¹ A'``.

Source
------
Errors in variables: Fuller, Measurement Error Models (1987); elimination of linear unknowns: Golub and Pereyra, SIAM J.
Numer. Anal. 10 (1973).
"""

from __future__ import annotations

import operator
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from threading import Lock
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.limits import check_time
from fibrefit.core.programs import kept_program
from fibrefit.core.threads import for_each
from fibrefit.problem.inputs.error_signals import (
    COSINES,
    InputErrors,
    amplitudes,
    error_signal,
    smoothed_cosines,
    stacked_weights,
    taken_off,
    wave_numbers,
)
from fibrefit.problem.inputs.smoothing import smoother
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.rigs.signals.trace import Trace
from fibrefit.simulation.inputs import Signals

InputCoefficients = Mapping[str, Any]
_MADE: deque[tuple[list[np.ndarray], int, tuple[np.ndarray, np.ndarray]]] = deque(maxlen=2)
_LOCK = Lock()


def input_errors(task: Task) -> dict[str, InputErrors]:
    """What is known of each noisy input of a task; empty where there is none."""
    size = task.problem.observations.experiment.times.shape[1]
    known = {}
    for name in task.noisy_inputs:
        noise = task.input_noise[name]
        durations = np.array([float(trace.times[-1] - trace.times[0]) for trace in task.traces])
        numbers = wave_numbers(noise, durations)
        sizes = np.array([amplitudes(noise, *of) for of in zip(durations, numbers, strict=True)])
        known[name] = InputErrors(numbers, sizes, durations, *_smoothers(task.traces, name, size))
    return known


def _smoothers(traces: Sequence[Trace], name: str, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Weights of the smoother of each trace and which of them each instant has: made once for the readings at hand."""
    measured = [trace.inputs[name] for trace in traces]
    with _LOCK:
        for of, length, found in _MADE:
            if length == size and len(of) == len(measured) and all(map(operator.is_, of, measured)):
                return found
    found = stacked_weights([_smoother(trace, name) for trace in traces], size)
    with _LOCK:
        _MADE.append((measured, size, found))
    return found


def no_errors(known: Mapping[str, InputErrors]) -> dict[str, np.ndarray]:
    """Waves of inputs taken as measured, ``(n_record, n_wave)`` each."""
    return {name: np.zeros(of.size.shape) for name, of in known.items()}


def corrected(problem: Problem, known: Mapping[str, InputErrors], coefficients: InputCoefficients) -> Problem:
    """The problem with the errors taken off its inputs."""
    experiment = problem.observations.experiment
    inputs = _cleaned(*_arrays(experiment.inputs, experiment.times, dict(known), dict(coefficients)))
    return eqx.tree_at(lambda p: p.observations.experiment.inputs, problem, inputs)


@kept_program
def _cleaned(inputs: Any, times: jax.Array, known: Any, coefficients: Any) -> dict[str, Signals]:
    return jax.vmap(taken_off)(inputs, times, known, coefficients)


def _arrays(*of: Any) -> tuple[Any, ...]:
    """Pytrees with all numbers as arrays of JAX: a program is compiled for their shapes, whatever they are."""
    return tuple(jax.tree.map(jnp.asarray, part) for part in of)


def error_rms(problem: Problem, known: Mapping[str, InputErrors], coefficients: InputCoefficients) -> dict[str, float]:
    """Size of the errors, in SI units of each input."""
    experiment, found = problem.observations.experiment, {}
    inside = np.arange(experiment.times.shape[1]) < np.asarray(experiment.count)[:, None]
    for name, of in known.items():
        error = np.asarray(jax.vmap(error_signal)(experiment.times, of, coefficients[name]))
        found[name] = float(np.sqrt(np.mean(error[inside] ** 2)))
    return found


def expanded(
    problem: Problem,
    known: Mapping[str, InputErrors],
    values: np.ndarray,
    coefficients: InputCoefficients,
    records: Iterable[int] | None = None,
) -> list[tuple]:
    """Residuals of each record and how they move with its values and with the coefficients of its inputs.

    Parameters
    ----------
    problem, known, values, coefficients
        The problem has its inputs as measured; values are in SI units, the free ones ``(n_free,)`` or those of each
        record ``(n_record, n_local)``, which may differ; coefficients are a mapping of input to ``(n_record, n_wave)``.
    records : iterable of int, optional
        The only ones that are asked for.

    Returns
    -------
    list of (residuals, slopes, sensitivities)
        ``(n_channel, n_time)``, ``(n_local_free, n_channel * n_time)`` and ``(n_wave, n_channel * n_time)``,
        the coefficients of all inputs one after the other.

    Raises
    ------
    OutOfTimeError
        If the time is over before a record is begun: each takes a second, of a model that is stiff ten.
    """
    local = values_by_record(problem, values)
    asked = range(len(problem.layout.records)) if records is None else records

    def of_record(r: int) -> tuple:
        check_time()
        return _linear(problem, known, local[r], coefficients, r)

    return for_each(of_record, asked)


def residuals(
    problem: Problem, known: Mapping[str, InputErrors], values: np.ndarray, coefficients: InputCoefficients
) -> np.ndarray:
    """Residuals ``(n_record, n_channel, n_time)`` with the errors taken off the inputs; parameters as `expanded`."""
    return np.asarray(_residuals(corrected(problem, known, coefficients), values_by_record(problem, values)))


@kept_program
def _residuals(problem: Problem, local: Any) -> jax.Array:
    return problem.residuals_at(local)


def values_by_record(problem: Problem, values: np.ndarray) -> jax.Array:
    """Values of each record ``(n_record, n_local)``, from these or from the free ones ``(n_free,)``."""
    return jnp.asarray(values if np.ndim(values) == 2 else problem.layout.local(values))


def _linear(
    problem: Problem, known: Mapping[str, InputErrors], local: jax.Array, coefficients: InputCoefficients, r: int
) -> tuple:
    """Residuals ``(n_channel, n_time)``, slopes ``(n_local_free, n)`` and sensitivities ``(n_wave, n)`` of a record."""
    data, *rows = jax.tree.map(lambda rows: rows[r], (problem.observations, dict(known), dict(coefficients)))
    record = Problem(problem.model, problem.layout, data, problem.soft_beyond)
    return tuple(np.asarray(part) for part in _linearised(record, local, *_arrays(*rows)))


@kept_program
def _linearised(problem: Problem, local: Any, known: Any, coefficients: Any) -> tuple[jax.Array, jax.Array, jax.Array]:
    """The same of a problem that holds the rows of one record."""
    data = problem.observations
    columns, times = jnp.array(problem.layout.local_free), data.experiment.times
    inputs = taken_off(data.experiment.inputs, times, known, coefficients)

    def residuals(part: jax.Array, inputs: Any) -> jax.Array:
        there = data._replace(experiment=data.experiment._replace(inputs=inputs))
        return problem.record_residuals(local.at[columns].set(part), there)

    def along(tangent: tuple[jax.Array, Any]) -> jax.Array:
        return jax.jvp(residuals, (local[columns], inputs), tangent)[1].ravel()

    rows = jax.lax.map(jax.vmap(along), _tangents(columns.size, inputs, times, known))
    rows = rows.reshape(-1, rows.shape[-1])
    return (
        residuals(local[columns], inputs),
        rows[: columns.size],
        rows[COSINES * (-(-columns.size // COSINES)) :],
    )


def _tangents(free: int, inputs: Any, times: jax.Array, known: Any) -> tuple[jax.Array, Any]:
    """Tangents of the free values, then of the inputs for each wave, ``(n_chunk, COSINES, ...)``."""
    first = COSINES * (-(-free // COSINES))
    numbers = jnp.arange(first + sum(of.size.size for of in known.values())).reshape(-1, COSINES)
    parts = jnp.where(numbers[..., None] == jnp.arange(free), 1.0, 0.0)
    moved = {}
    for name, signal in inputs.items():
        if name in known:
            cosines = jax.lax.map(partial(smoothed_cosines, times, known[name]), numbers - first)
            moved[name] = jax.tree.map(jnp.negative, cosines)
            first += known[name].size.size
        else:
            moved[name] = jax.tree.map(lambda row: jnp.zeros((*numbers.shape, row.size)), signal)
    return parts, moved


def _smoother(trace: Trace, name: str) -> np.ndarray:
    return smoother(trace.inputs[name][:, 2], trace.times, f'{trace.name}, channel "{name}"')
