"""What the noise of a measured input does to the readings of a perfect model: a gap that no effect explains."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.drive import smoothed
from fibrefit.problem.noise import Noise
from fibrefit.problem.problem import Problem
from fibrefit.problem.task import Task

DRAWS = 3
SMOOTH = 0.995
"""Share of the samples that lie on no jump."""
SMALL = 0.1
"""Share of the noise that is simulated, and scaled up after: what the fit then takes up is linear in it."""


def propagated(task: Task, values: np.ndarray, slopes: np.ndarray, seed: int = 0) -> np.ndarray:
    """Draws of the residuals that input noise alone would leave after a fit.

    Parameters
    ----------
    task : Task
    values : (n_free,) in SI units
    slopes : (n_record, n_channel, n_time, n_local_free)
        Of the residuals at these values: what they can imitate is not left.
    seed : int

    Returns
    -------
    (n_draw, n_record, n_channel, n_time) in units of the channels' noise
        No draws for a rig without measured inputs.
    """
    problem = task.problem
    data = problem.observations
    shape = (len(problem.layout.records), len(problem.model.rig.channels), data.experiment.times.shape[1])
    if not problem.model.rig.inputs:
        return np.zeros((0, *shape))
    random = np.random.default_rng(seed)
    here = np.asarray(_residuals(problem, jnp.asarray(values)))
    draws = [np.asarray(_residuals(_disturbed(task, random), jnp.asarray(values))) - here for _ in range(DRAWS)]
    return np.stack([_left(draw / SMALL, slopes) for draw in draws])


def expected_gap(task: Task, values: np.ndarray) -> float:
    """Gap a perfect model leaves where inputs are taken as they were measured.

    Parameters
    ----------
    task : Task
    values : (n_free,) in SI units
    """
    problem = task.problem
    draws = propagated(task, values, np.asarray(problem.linearised(jnp.asarray(values)).slopes))
    weights = problem.observations.weight
    counted = np.stack([np.asarray(weights[channel]) > 0.0 for channel in problem.model.rig.channels], axis=1)
    return float(np.sqrt(1.0 + np.mean(draws[:, counted] ** 2))) if len(draws) else 1.0


def _left(draw: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """A draw without what each record's values can imitate."""
    left = np.empty_like(draw)
    for r, rows in enumerate(draw):
        columns = slopes[r].reshape(-1, slopes.shape[-1])
        size = np.linalg.norm(columns, axis=0)
        columns = columns[:, size > 0.0] / size[size > 0.0]
        share = np.linalg.lstsq(columns.T @ columns, columns.T @ rows.ravel(), rcond=1e-10)[0]
        rest = rows - (columns @ share).reshape(rows.shape)
        # A sample on the other side of a jump in the force changes by the whole jump, however small the noise.
        limit = np.quantile(np.abs(rest), SMOOTH, axis=1, keepdims=True)
        left[r] = np.clip(rest, -limit, limit)
    return left


@eqx.filter_jit
def _residuals(problem: Problem, values: jax.Array) -> jax.Array:
    return problem.residuals(values)


def _disturbed(task: Task, random: np.random.Generator) -> Problem:
    """The problem with another draw of noise on its inputs."""
    experiment = task.problem.observations.experiment
    inputs = dict(experiment.inputs)
    for name in task.problem.model.rig.inputs:
        signal = inputs[name]
        values, slopes = np.array(signal.values), np.array(signal.slopes)
        for r, trace in enumerate(task.traces):
            noise = SMALL * smoothed(_drawn(task.input_noise[name], trace.times, random), trace.times, trace.name)
            values[r, : len(noise)] += noise[:, 0]
            slopes[r, : len(noise)] += noise[:, 1]
        inputs[name] = type(signal)(jnp.asarray(values), jnp.asarray(slopes))
    return eqx.tree_at(lambda p: p.observations.experiment.inputs, task.problem, inputs)


def _drawn(noise: Noise, times: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """A draw of noise with the spectrum found, ``(n_time,)``."""
    count, step = len(times), float(np.diff(times).mean())
    frequency = np.fft.rfftfreq(count, step)
    density = np.zeros(len(frequency))
    density[1:] = noise.density(frequency[1:])
    wave = random.normal(size=len(frequency)) + 1j * random.normal(size=len(frequency))
    return np.fft.irfft(wave * np.sqrt(0.25 * density * count / step), count)
