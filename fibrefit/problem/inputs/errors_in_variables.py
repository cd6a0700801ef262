"""Errors of measured inputs as unknowns of the problem, with a prior from their spectrum.

A drive is measured with noise, and a stiff fibre turns that noise into force. Taken for exact, such an input leaves a
gap no model can close, and biases what is identified. Here its error is one more unknown of each record: a sum of
cosines over the record with independent coefficients of variance one, each as large as the input's noise is at its
frequency, sent through the smoother that the input went through. Linearised, these coefficients are eliminated exactly.

Law
---
Residuals ``r(θ, w) ≈ r + J δθ + A δw`` with prior ``w ~ N(0, I)``. For given θ the best ``w`` leaves
``|r|² + |w|² = m' P m`` with ``m = r - A w`` and ``P = (I + A A')⁻¹ = I - A (I + A'A)⁻¹ A'``.

An error of one-sided density S over a record of T is a sum of cosines of k half periods, ``k / 2T`` Hz apart, with
amplitudes ``sqrt(2 S / 2T)`` for coefficients of variance one; a line spreads its variance evenly over its width. A
cosine shifted in time is a sum of two that are not: the smoother's weights are multiplied once for all instants.

Where the linearised problem predicts little, samples count less: by ``1 / sqrt(1 + (miss / 0.5)^4)`` of their weight
for what it misses of errors that are drawn, and by as much for what errors do to them, over 5 times their noise.

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
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.ndimage import maximum_filter1d

from fibrefit.core.limits import check_time
from fibrefit.core.programs import kept_program
from fibrefit.core.spectra import MAINS
from fibrefit.core.threads import for_each
from fibrefit.problem.inputs.smoothing import smoother
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.problem.thresholds import LINE_WIDTH
from fibrefit.rigs.signals.trace import Trace
from fibrefit.simulation.inputs import Signals

COSINES = 16
"""Cosines whose effects are found in one pass along the motion."""

InputCoefficients = Mapping[str, Any]
_MADE: deque[tuple[list[np.ndarray], int, tuple[np.ndarray, np.ndarray]]] = deque(maxlen=2)
_LOCK = Lock()


class InputErrors(NamedTuple):
    """What is known of the errors of one input.

    Parameters
    ----------
    numbers : (n_record, n_coef)
        Half periods of each cosine over the record; consecutive ones within each `COSINES`.
    size : (n_record, n_coef)
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


def input_errors(task: Task) -> dict[str, InputErrors]:
    """What is known of each noisy input of a task; empty where there is none."""
    size = task.problem.observations.experiment.times.shape[1]
    known = {}
    for name in task.noisy_inputs:
        noise = task.input_noise[name]
        durations = np.array([float(trace.times[-1] - trace.times[0]) for trace in task.traces])
        numbers = half_periods(noise, durations)
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
    weights = [
        smoother(values[:, 2], trace.times, f'{trace.name}, channel "{name}"')
        for values, trace in zip(measured, traces, strict=True)
    ]
    found = stacked_weights(weights, size)
    with _LOCK:
        _MADE.append((measured, size, found))
    return found


def no_errors(known: Mapping[str, InputErrors]) -> dict[str, np.ndarray]:
    """Coefficients of inputs taken as measured, ``(n_record, n_coef)`` each."""
    return {name: np.zeros(of.size.shape) for name, of in known.items()}


def corrected(problem: Problem, known: Mapping[str, InputErrors], coefficients: InputCoefficients) -> Problem:
    """The problem with the errors taken off its inputs."""
    experiment = problem.observations.experiment
    inputs = _corrected(*_arrays(experiment.inputs, experiment.times, dict(known), dict(coefficients)))
    return eqx.tree_at(lambda p: p.observations.experiment.inputs, problem, inputs)


@kept_program
def _corrected(inputs: Any, times: jax.Array, known: Any, coefficients: Any) -> dict[str, Signals]:
    return jax.vmap(cleaned_inputs)(inputs, times, known, coefficients)


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
        record ``(n_record, n_local)``, which may differ; coefficients are a mapping of input to ``(n_record, n_coef)``.
    records : iterable of int, optional
        The only ones that are asked for.

    Returns
    -------
    list of (residuals, slopes, sensitivities)
        ``(n_channel, n_time)``, ``(n_local_free, n_channel * n_time)`` and ``(n_coef, n_channel * n_time)``,
        the coefficients of all inputs one after the other.

    Raises
    ------
    OutOfTimeError
        If the time is over before a record is begun: each takes a second, of a model that is stiff ten.
    """
    local, parts = values_by_record(problem, values), (problem.observations, dict(known), dict(coefficients))
    asked = range(len(problem.layout.records)) if records is None else records

    def of_record(r: int) -> tuple:
        check_time()
        data, *rows = jax.tree.map(lambda rows: rows[r], parts)
        record = Problem(problem.model, problem.layout, data, problem.soft_beyond)
        return tuple(np.asarray(part) for part in _linearised(record, local[r], *_arrays(*rows)))

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


@kept_program
def _linearised(problem: Problem, local: Any, known: Any, coefficients: Any) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Residuals, slopes and sensitivities of a problem that holds the rows of one record, see `expanded`."""
    data = problem.observations
    columns, times = jnp.array(problem.layout.local_free), data.experiment.times
    inputs = cleaned_inputs(data.experiment.inputs, times, known, coefficients)

    def residuals(part: jax.Array, inputs: Any) -> jax.Array:
        there = data._replace(experiment=data.experiment._replace(inputs=inputs))
        return problem.record_residuals(local.at[columns].set(part), there)

    def along(tangent: tuple[jax.Array, Any]) -> jax.Array:
        return jax.jvp(residuals, (local[columns], inputs), tangent)[1].ravel()

    # Tangents of the free values, then of the inputs for each cosine, ``(n_chunk, COSINES, ...)``.
    behind = first = COSINES * (-(-columns.size // COSINES))
    numbers = jnp.arange(first + sum(of.size.size for of in known.values())).reshape(-1, COSINES)
    parts, moved = jnp.where(numbers[..., None] == jnp.arange(columns.size), 1.0, 0.0), {}
    for name, signal in inputs.items():
        if name in known:
            cosines = jax.lax.map(partial(smoothed_cosines, times, known[name]), numbers - first)
            moved[name] = jax.tree.map(jnp.negative, cosines)
            first += known[name].size.size
        else:
            moved[name] = jax.tree.map(lambda row: jnp.zeros((*numbers.shape, row.size)), signal)
    rows = jax.lax.map(jax.vmap(along), (parts, moved))
    rows = rows.reshape(-1, rows.shape[-1])
    return residuals(local[columns], inputs), rows[: columns.size], rows[behind:]


def smoothed_cosines(times: jax.Array, known: InputErrors, places: jax.Array) -> Signals:
    """Cosines at some places of one `COSINES`, after the smoother, ``(n_place, n_time)``; zero where there is no such.

    Each cosine is the one before it, turned on, as the functions themselves take most of the time.
    """
    there, inside = (places >= 0) & (places < known.size.size), jnp.clip(places, 0, known.size.size - 1)
    size, first = jnp.where(there, known.size[inside], 0.0), jnp.argmax(there)
    numbers = known.numbers[inside[first]] + jnp.arange(len(places)) - first
    near = known.weights.shape[1]
    pace = jnp.pi / known.duration
    shift = (times[1] - times[0]) * (jnp.arange(near) - near // 2) * pace * numbers[:, None]
    even, odd = (jnp.einsum("wi,cik->wkc", parts, known.weights) for parts in (jnp.cos(shift), jnp.sin(shift)))
    angle = pace * (times - times[0])
    turn = jnp.cos(angle), jnp.sin(angle)

    def on(here: tuple[jax.Array, jax.Array], of: tuple) -> tuple[tuple[jax.Array, jax.Array], jax.Array]:
        (cosine, sine), (size, even, odd) = here, of
        after = cosine * turn[0] - sine * turn[1], sine * turn[0] + cosine * turn[1]
        return after, size * (even[:, known.kind] * cosine - odd[:, known.kind] * sine)

    begun = jnp.cos(numbers[0] * angle), jnp.sin(numbers[0] * angle)
    return Signals(*jnp.moveaxis(jax.lax.scan(on, begun, (size, even, odd))[1], 1, 0))


def cleaned_inputs(
    inputs: Mapping[str, Signals], times: jax.Array, known: Any, coefficients: Any
) -> dict[str, Signals]:
    """Inputs of one record without their errors."""
    cleaned = dict(inputs)
    for name in known:
        weights = known[name].weights[known[name].kind]
        error, reach = error_signal(times, known[name], coefficients[name]), weights.shape[1] // 2
        padded = jnp.pad(error, (reach, reach))
        terms = (weights[:, i] * padded[i : i + len(weights), None] for i in range(weights.shape[1]))
        smooth = sum(terms, start=jnp.zeros(()))
        cleaned[name] = Signals(inputs[name].values - smooth[:, 0], inputs[name].slopes - smooth[:, 1])
    return cleaned


def error_signal(times: jax.Array, known: InputErrors, coefficients: jax.Array) -> jax.Array:
    """Error of an input at each instant, before the smoother, ``(n_time,)``; see `smoothed_cosines`.

    The angle of a cosine is that of the first of its `COSINES` and a few half periods more: by the theorem of addition
    the sum is two products of matrices, and few functions are evaluated.
    """
    angle, first = jnp.pi * (times - times[0]) / known.duration, known.numbers[::COSINES, None]
    further = jnp.arange(COSINES)[:, None] * angle
    parts = (known.size * coefficients).reshape(-1, COSINES)
    even, odd = parts @ jnp.cos(further), parts @ jnp.sin(further)
    return jnp.sum(jnp.cos(first * angle) * even - jnp.sin(first * angle) * odd, axis=0)


def amplitudes(noise: Noise, duration: float, numbers: np.ndarray) -> np.ndarray:
    """Amplitudes of cosines of so many half periods over a record, ``(n_coef,)``."""
    spacing = 0.5 / duration
    frequency = spacing * numbers
    density = noise.density(np.maximum(frequency, 0.5 * spacing))
    # At which of the mains frequencies an unnamed line lies is not kept: both are allowed it.
    for places, variance in ((MAINS, noise.line), *(((place,), power) for place, power in noise.lines)):
        near = np.min([np.abs(frequency - place) for place in places], axis=0) <= LINE_WIDTH
        density = density + near * variance / max(2.0 * LINE_WIDTH, spacing)
    return np.where(numbers == 0, np.sqrt(0.5), 1.0) * np.sqrt(2.0 * density * spacing)


def half_periods(noise: Noise, durations: np.ndarray) -> np.ndarray:
    """Half periods over each record of the cosines that make its error, ``(n_record, n_coef)``.

    Slow ones, and those about lines.

    Parameters
    ----------
    noise : Noise
    durations : (n_record,) in s
    """
    # Up to 100 Hz: beyond it the smoother lets little through. What of it a stiff fibre turns into force and is not
    # looked for is noise that comes and goes with the tension: with 60 Hz a play as large as the noise of the drive,
    # which swallows it, was 39 nats more probable than none, with 100 Hz 9 less. A record that is long for 1024 cosines
    # has a lower highest frequency.
    number = max(min(int(200.0 * durations.max()), 1024) // COSINES, 1) * COSINES
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
    widest, found = max(each.shape[1] for each in weights), []
    for each in weights:
        # Weights that differ by less than 1e-11 of the largest one are the same but for rounding.
        least = np.abs(each).max(axis=(0, 1)) * 1e-11
        rounded = np.round(each / np.where(least > 0.0, least, 1.0)).reshape(len(each), -1)
        _, first, places = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
        found.append((each[first], places.reshape(-1)))
    # In multiples of 256, so that records share a compiled program.
    number = 256 * (1 + max(len(kinds) for kinds, _ in found) // 256)
    stacked = np.zeros((len(weights), number, widest, 2))
    kind = np.zeros((len(weights), size), dtype=np.int32)
    for r, (kinds, places) in enumerate(found):
        edge = (widest - kinds.shape[1]) // 2
        stacked[r, 1 : 1 + len(kinds), edge : edge + kinds.shape[1]] = kinds
        kind[r, : len(places)] = 1 + places
    return stacked, kind


def downweights(
    problem: Problem,
    known: Mapping[str, InputErrors],
    values: np.ndarray,
    coefficients: InputCoefficients,
    sensitivities: Sequence[np.ndarray],
    roots: Sequence[np.ndarray] | None = None,
) -> np.ndarray:
    """Factor ``(n_record, n_channel, n_time)`` on the weights of samples of which the linearised problem tells little.

    A motion that bounces may depend on the errors of the inputs so strongly, or bend so soon, that such samples say
    nothing of the model and only bar the way of a search. The first is seen from the sensitivities. For the second,
    errors are drawn, and what the model makes of them is compared with what the linearised one predicts.

    Parameters
    ----------
    problem, known, values, coefficients
        As in `expanded`.
    sensitivities : sequence of (n_coef, n_channel * n_time), one for each record
        As `expanded` finds them.
    roots : sequence of (n_coef, n_coef), one for each record, optional
        Of the covariance of what is not known of the coefficients; what is known of them beforehand by default.
    """
    # A search keeps to what is known beforehand: with weights that take in what was learnt more samples count from one
    # linearisation to the next, and none is the last.
    random, missed = np.random.default_rng(0), np.zeros(1)
    here, ends = residuals(problem, known, values, coefficients), np.cumsum([w.shape[1] for w in coefficients.values()])
    # The largest miss of four draws counts.
    for _ in range(4):
        flat = random.standard_normal((len(here), ends[-1]))
        if roots is not None:
            flat = np.stack([root @ row for root, row in zip(roots, flat, strict=True)])
        drawn = dict(zip(coefficients, np.split(flat, ends[:-1], axis=1), strict=True))
        there = residuals(problem, known, values, {name: row + drawn[name] for name, row in coefficients.items()})
        predicted = np.stack(for_each(np.matmul, flat, sensitivities))
        missed = np.maximum(missed, np.abs(there - here - predicted.reshape(here.shape)))
    missed = np.where(np.isfinite(missed), missed, np.inf)
    # A miss counts 5 ms about it: other values of a model move it.
    # Flights behind an amplified bounce fall out whole: unknowns of their own for their few shapes found no more.
    about = samples_about(problem, 0.005)
    missed = np.stack([maximum_filter1d(one, size, axis=-1) for one, size in zip(missed, about, strict=True)])

    def strength(rows: np.ndarray, root: np.ndarray | None) -> np.ndarray:
        # What errors do to each sample, in single precision, as the size alone is needed.
        reached = rows if root is None else root.T.astype(np.float32) @ rows.astype(np.float32)
        return np.asarray(np.linalg.norm(reached, axis=0))

    strengths = for_each(strength, sensitivities, [None] * len(here) if roots is None else roots)
    # In units of a sample's noise: half of it missed, or five times it done by errors, halves the variance it keeps.
    missed_much, strong = (missed / 0.5) ** 4, (np.stack(strengths).reshape(here.shape) / 5.0) ** 4
    return 1.0 / np.sqrt((1.0 + missed_much) * (1.0 + strong))


def downweighted(problem: Problem, downweight: np.ndarray) -> Problem:
    """The problem with factors ``(n_record, n_channel, n_time)`` on the weights of its samples."""
    weights = problem.observations.weight
    weaker = {channel: weights[channel] * downweight[:, c] for c, channel in enumerate(problem.model.rig.channels)}
    return eqx.tree_at(lambda p: p.observations.weight, problem, weaker)


def instant_weights(problem: Problem, downweight: np.ndarray | float = 1.0) -> np.ndarray:
    """How much each instant of a record counts, ``(n_record, n_time)``: by the channels read then, and `downweight`."""
    weights = problem.observations.weight
    seen = np.stack([np.asarray(weights[channel]) > 0.0 for channel in problem.model.rig.channels], axis=1)
    return np.sum(seen * np.square(downweight), axis=1)


def samples_about(problem: Problem, reach: float) -> list[int]:
    """Samples of each record within a `reach` [s] of one of them, it among them."""
    experiment = problem.observations.experiment
    counts = np.asarray(experiment.count)
    steps = [np.median(np.diff(times[:n])) for times, n in zip(np.asarray(experiment.times), counts, strict=True)]
    return [1 + 2 * round(reach / float(step)) for step in steps]
