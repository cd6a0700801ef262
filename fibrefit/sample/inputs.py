"""What the noise of a measured input does to the estimates: another draw of it would have led to other values.

A likelihood takes the inputs for exact. Where a drive's position is measured and multiplied by a stiff fibre it is not,
and the posterior would be too narrow by an order of magnitude. Each draw of input noise moves the estimate by a step
that is linear in it; the posterior is widened by the covariance of these steps.
"""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.drive import smoothed
from fibrefit.problem.layout import Layout
from fibrefit.problem.noise import Noise
from fibrefit.problem.problem import Linearised, Problem
from fibrefit.problem.task import Task
from fibrefit.problem.whitening import Whitening, innovations

DRAWS = 40
SMALL = 0.1
"""Share of the noise that is simulated, so that the steps are linear in it."""


class Steps(NamedTuple):
    """Steps of the estimates, ``(n_draw, n_free)`` in SI units, for draws of the noise of all inputs.

    Parameters
    ----------
    plain, whitened : (n_draw, n_free)
    """

    plain: np.ndarray
    whitened: np.ndarray


def input_steps(
    task: Task, values: np.ndarray, linear: Linearised, whitening: Whitening, level: np.ndarray, seed: int
) -> Steps | None:
    """Steps of the plain and of the whitened estimate; None for a rig without measured inputs.

    Parameters
    ----------
    task : Task
    values : (n_free,) in SI units
    linear : Linearised
        At these values.
    whitening : Whitening
    level : (n_channel,)
        Noise over what the whitening assumes.
    seed : int
    """
    if not task.problem.model.rig.inputs:
        return None
    random = np.random.default_rng(seed)
    layout, level, slopes = task.problem.layout, level[:, None, None], np.asarray(linear.slopes)
    sharp = np.asarray(innovations(whitening, jnp.asarray(slopes))) / level
    plain, whitened = [], []
    for _ in range(DRAWS):
        moved = np.asarray(_residuals(disturbed(task, random), jnp.asarray(values))) - linear.residuals
        moved = moved / SMALL
        fresh = np.asarray(innovations(whitening, jnp.asarray(moved)))
        plain.append(_step(layout, slopes, moved))
        whitened.append(_step(layout, sharp, fresh / level[..., 0]))
    return Steps(np.array(plain), np.array(whitened))


def covariance_of(steps: Steps | None, problem: Problem, values: np.ndarray) -> np.ndarray:
    """Covariance ``(n_free, n_free)`` of the whitened estimate, in free coordinates, due to the inputs' noise."""
    layout = problem.layout
    if steps is None:
        return np.zeros((layout.size, layout.size))
    free = layout.free(jnp.asarray(values))
    slope = np.asarray(jax.jvp(layout.values, (free,), (jnp.ones_like(free),))[1])
    return np.atleast_2d(np.cov((steps.whitened / slope).T))


def disturbed(task: Task, random: np.random.Generator) -> Problem:
    """The problem with a small share of another draw of noise on its inputs."""
    experiment = task.problem.observations.experiment
    inputs = dict(experiment.inputs)
    for name in task.problem.model.rig.inputs:
        signal = inputs[name]
        values, slopes = np.array(signal.values), np.array(signal.slopes)
        for r, trace in enumerate(task.traces):
            noise = smoothed(_drawn(task.input_noise[name], trace.times, random), trace.times, trace.name)
            values[r, : len(noise)] += SMALL * noise[:, 0]
            slopes[r, : len(noise)] += SMALL * noise[:, 1]
        inputs[name] = type(signal)(jnp.asarray(values), jnp.asarray(slopes))
    return eqx.tree_at(lambda p: p.observations.experiment.inputs, task.problem, inputs)


def _drawn(noise: Noise, times: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """A draw of noise ``(n_time,)`` with a given spectrum, cut from twice the length: its ends are no circle."""
    count, step = 2 * len(times), float(np.diff(times).mean())
    frequency = np.fft.rfftfreq(count, step)
    density = np.zeros(len(frequency))
    density[1:] = noise.density(frequency[1:])
    wave = random.standard_normal(len(frequency)) + 1j * random.standard_normal(len(frequency))
    return np.fft.irfft(wave * np.sqrt(0.25 * density * count / step), count)[: len(times)]


def _step(layout: Layout, slopes: np.ndarray, residuals: np.ndarray) -> np.ndarray:
    """Least-squares step ``(n_free,)`` for a change of the residuals."""
    size = layout.size
    normal, pull = np.zeros((size + 2, size + 2)), np.zeros(size + 2)
    for record, place in enumerate(layout.local_columns):
        rows = slopes[record].reshape(-1, len(place))
        np.add.at(normal, (place[:, None], place[None, :]), rows.T @ rows)
        np.add.at(pull, place, rows.T @ residuals[record].ravel())
    normal, pull = normal[:size, :size], pull[:size]
    scale = np.sqrt(np.where(np.diag(normal) > 0.0, np.diag(normal), 1.0))
    inverse = np.linalg.pinv(normal / np.outer(scale, scale), rcond=1e-10, hermitian=True)
    return -(inverse @ (pull / scale)) / scale


@eqx.filter_jit
def _residuals(problem: Problem, values: jax.Array) -> jax.Array:
    return problem.residuals(values)
