"""Loggers with coarse steps: which they are, and the noise before rounding, from what a model leaves.

A rest says little of that noise: where the signal lies in the middle of a step, all readings are equal.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import comb
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from scipy.optimize import minimize_scalar

from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.statement.observations import Steps, log_probability
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.thresholds import COARSE_STEPS, CROSSED
from fibrefit.rigs.signals.rest import fast_part, resolution
from fibrefit.rigs.signals.trace import Trace

ROUNDED = 12.0**-0.5
"""Noise of rounding over a step."""
FIRST = 0.25
"""Noise before rounding, as a share of a step, that is taken before anything is known of it."""
LEAST, MOST = 0.05, 3.0
"""The same, between which it is looked for."""
ORDER, WINDOW = 3, 32
"""Of the differences that show the noise in motion, and samples of a window in which readings have to cross steps."""
CHANGED = 0.02
"""Relative change of it that is not followed any more."""


def coarse_step(traces: Sequence[Trace], channel: str) -> float | None:
    """Step of a channel whose noise does not reach across it; None where it is fine, in SI units."""
    signals = [trace.channels[channel] for trace in traces]
    size = min(resolution(signal) for signal in signals)
    fast = float(np.sqrt(np.mean([fast_part(signal) ** 2 for signal in signals])))
    return size if size > 0.0 and fast < COARSE_STEPS * size else None


def noise_in_motion(traces: Sequence[Trace], channel: str, size: float) -> float:
    """Noise of readings in coarse steps, that of rounding in it, where they cross steps; zero where they never do.

    At rest rounding shows as an offset, and hardly as noise.

    Parameters
    ----------
    size : float
        Of a step, in SI units.
    """
    found = []
    for trace in traces:
        values = trace.channels[channel]
        number = (len(values) - ORDER) // WINDOW
        windows = values[: number * WINDOW].reshape(number, WINDOW)
        differences = np.diff(values, ORDER)[: number * WINDOW].reshape(number, WINDOW)
        # Steps that are missing make a window unfit: a comparison with what is no number fails.
        crossing = np.ptp(windows, axis=1) > CROSSED * size
        found.append(np.mean(differences[crossing] ** 2, axis=1) / comb(2 * ORDER, ORDER))
    power = np.concatenate(found)
    power = power[np.isfinite(power)]
    return float(np.sqrt(np.median(power))) if power.size else 0.0


def steps_of(traces: Sequence[Trace], channel: str, level: Sequence[float]) -> Steps | None:
    """Steps of a channel, before anything is known of the noise before rounding; None where it is fine.

    Parameters
    ----------
    level : (n_record,) in SI units
        Noise of each record.
    """
    size = coarse_step(traces, channel)
    # Noise behind a filter may hardly change from one sample to the next, and reach across many steps all the same.
    if size is None or float(np.mean(level)) > np.hypot(COARSE_STEPS, ROUNDED) * size:
        return None
    return Steps(
        *(np.array(row, dtype=float) for row in (np.full(len(level), size), [FIRST * size] * len(level), level))
    )


def with_noise_before_rounding(problem: Problem, local: np.ndarray) -> Problem:
    """The problem with the noise before rounding that is most probable at given values.

    Parameters
    ----------
    local : (n_record, n_local) in SI units
    """
    coarse = problem.observations.steps
    if not coarse:
        return problem
    readings, data = _predicted(problem, local), problem.observations
    away = {channel: np.asarray(readings[channel]) - np.asarray(data.measured[channel]) for channel in coarse}
    counted = {channel: np.asarray(data.weight[channel]) > 0.0 for channel in coarse}
    return with_steps(problem, {c: before_rounding(coarse[c], away[c][counted[c]]) for c in coarse})


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


def noise_of_steps(steps: Steps, rate: float, samples: int) -> Noise:
    """Noise of a channel in coarse steps: its residuals are those of a likelihood, white and of variance one.

    Parameters
    ----------
    rate : float, in Hz
    samples : int
        That tell of it.
    """
    return Noise(float(np.mean(np.asarray(steps.level) ** 2)) / (0.5 * rate), 0.0, 0.0, samples)


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
    far = jnp.asarray(np.abs(distance) / size)
    if not bool(jnp.isfinite(far).all()):
        return known

    def cost(log: float) -> float:
        return -float((share * log_probability(far / np.exp(log), jnp.asarray(0.5 / np.exp(log)))).sum())

    best = minimize_scalar(cost, bounds=(np.log(LEAST), np.log(MOST)), method="bounded", options={"xatol": 1e-3})
    found, before = size * float(np.exp(best.x)), float(np.asarray(known.noise)[0])
    return known if abs(found / before - 1.0) < CHANGED else known._replace(noise=np.full_like(known.noise, found))
