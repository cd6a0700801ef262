"""Readings in coarse steps: the noise before rounding, from what a model leaves, and what rounding does to an input.

A rest says little of that noise: where the signal lies in the middle of a step, all readings are equal. It is the one
that makes the readings most probable, see `statement.steps`. Errors of an input that is read in coarse steps stand
still where it does, and no reading shows them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.optimize import minimize_scalar

from fibrefit.problem.noise.readings import coarse_step, noise_in_motion
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.noise.whittle import noise_of_signals
from fibrefit.problem.statement.observations import Steps, log_probability
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.thresholds import COARSE_STEPS
from fibrefit.rigs.signals.trace import Trace

CHANGED = 0.02
"""Relative change of the noise before rounding that is not followed any more."""


def steps_of(traces: Sequence[Trace], channel: str, level: Sequence[float]) -> Steps | None:
    """Steps of a channel, before anything is known of the noise before rounding; None where it is fine.

    Parameters
    ----------
    level : (n_record,) in SI units
        Noise of each record.
    """
    size, number = coarse_step(traces, channel), len(level)
    # Noise behind a filter may hardly change from one sample to the next, and reach across many steps all the same; in
    # the level is that of rounding, a step over the root of twelve.
    if size is None or float(np.mean(level)) > np.hypot(COARSE_STEPS, 12.0**-0.5) * size:
        return None
    # Before anything is known of the noise before rounding it is taken for a quarter of a step.
    return Steps(np.full(number, size, dtype=float), np.full(number, 0.25 * size), np.array(level, dtype=float))


def with_noise_before_rounding(problem: Problem, local: np.ndarray) -> Problem:
    """The problem with the noise before rounding that is most probable at given values.

    Parameters
    ----------
    local : (n_record, n_local) in SI units
    """
    coarse = problem.observations.steps
    if not coarse:
        return problem
    # At the values at hand: taken once, from readings counted as fine, it is a seventh too large, and an effect seems
    # to be there.
    readings, data, found = _predicted(problem, local), problem.observations, {}
    for channel, steps in coarse.items():
        distance = np.asarray(readings[channel]) - np.asarray(data.measured[channel])
        found[channel] = before_rounding(steps, distance[np.asarray(data.weight[channel]) > 0.0])
    return with_steps(problem, found)


def with_steps(problem: Problem, steps: dict[str, Steps]) -> Problem:
    """The problem with what is known of the steps of its channels."""
    if not steps and not problem.observations.steps:
        return problem
    return Problem(problem.model, problem.layout, problem.observations._replace(steps=steps), problem.soft_beyond)


def same_noise(one: Mapping[str, Steps], other: Mapping[str, Steps]) -> bool:
    """Whether the noise before rounding is the same, as far as it is followed."""
    return one.keys() == other.keys() and all(
        np.allclose(one[channel].noise, other[channel].noise, rtol=CHANGED, atol=0.0) for channel in one
    )


@eqx.filter_jit
def _predicted(problem: Problem, local: Any) -> dict[str, Any]:
    return problem.predict(local, problem.observations.experiment)


def before_rounding(known: Steps, distance: np.ndarray, share: np.ndarray | float = 1.0) -> Steps:
    """Steps with the noise before rounding that makes readings most probable; as they are if that is about the same.

    Parameters
    ----------
    distance : (n,) in SI units
        Of the model's signal from the readings that count, of all records: they have one logger, and a few may be off.
    share : (n,)
        By which the logarithm of the probability of each counts.
    """
    size = float(np.asarray(known.size)[0])
    away = jnp.asarray(np.abs(distance) / size)
    if not bool(jnp.isfinite(away).all()):
        return known

    def cost(log: float) -> float:
        return -float((share * log_probability(away / np.exp(log), jnp.asarray(0.5 / np.exp(log)))).sum())

    # Below a twentieth of a step no reading tells it, beyond three steps readings are as good as fine.
    bounds = np.log(0.05), np.log(3.0)
    best = minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": 1e-3})
    found, before = size * float(np.exp(best.x)), float(np.asarray(known.noise)[0])
    return known if abs(found / before - 1.0) < CHANGED else known._replace(noise=np.full_like(known.noise, found))


def noise_of_rounding(traces: Sequence[Trace], channel: str, size: float) -> Noise:
    """Spectrum of what rounding does: courses as smooth as these, each elsewhere between two steps, are rounded.

    They are rounded with the noise that readings show where they cross steps, which carries some of them to the next
    step: a course that rests between two is known the better for it.

    Parameters
    ----------
    size : float
        Of a step, in SI units.
    """
    # At eight places between two steps: rounding repeats itself with each step.
    offsets = (np.arange(8)[:, None] + 0.5) / 8
    counts = np.array([len(trace.times) for trace in traces])
    times, errors = np.zeros((len(traces), counts.max())), np.zeros((len(offsets), len(traces), counts.max()))
    floor, level = size**2 / 12.0, noise_in_motion(traces, channel, size) ** 2
    before, rng = np.sqrt(max(level - floor, 0.0)) / size, np.random.default_rng(0)
    for r, (trace, count) in enumerate(zip(traces, counts, strict=True)):
        seen = np.isfinite(trace.channels[channel])
        course = np.interp(trace.times, trace.times[seen], trace.channels[channel][seen]) / size
        # Means over 50 ms carry no steps any more, and follow what a drive does.
        course = uniform_filter1d(course, max(round(0.05 * trace.rate), 1), mode="nearest") + offsets
        times[r, :count] = trace.times
        errors[:, r, :count] = size * (np.round(course + before * rng.standard_normal(course.shape)) - course)
    found = noise_of_signals(errors, times, counts)
    white = max(floor, level) / (0.5 * traces[0].rate)
    return replace(found, white=max(found.white, white), samples=0, floor=floor / (0.5 * traces[0].rate))
