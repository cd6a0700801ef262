"""Records as arrays of one shape: what a compiled program reads; and residuals of readings in coarse steps.

Law
---
A reading ``y`` in steps of ``q`` says that the signal ``x`` and its noise, normal with standard deviation ``s``, lay
within half a step of it: ``P(y | x) = Phi((y + q/2 - x) / s) - Phi((y - q/2 - x) / s)``. Its residual is the signed
root of ``2 (max log P - log P)``, so that the sum of their squares is twice the log likelihood, as it is for fine
readings. Errors of rounding are no noise: where a signal is slow they last for many samples, and depend on where it is.

Source
------
Likelihoods of rounded data: Vardeman and Lee, Technometrics 47 (2005). Deviance residuals: McCullagh and Nelder,
Generalized Linear Models (1989), section 2.4.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import log_ndtr

from fibrefit.core.errors import DataError
from fibrefit.problem.thresholds import FEWEST_READINGS
from fibrefit.rigs.signals.trace import Trace
from fibrefit.simulation.inputs import Signals
from fibrefit.simulation.model import Experiment

NEAR = 1e-3
"""Distance from a reading, in units of the noise before rounding, up to which its residual is taken as straight."""


class Steps(NamedTuple):
    """Readings of one channel in coarse steps, ``(n_record,)`` each, in SI units.

    Parameters
    ----------
    size : of a step
    noise : standard deviation of the noise before rounding
    level : noise by which the channel's samples are weighed, that of rounding in it
    """

    size: Any
    noise: Any
    level: Any


def log_probability(distance: jax.Array, half: jax.Array) -> jax.Array:
    """Logarithm of the probability of readings.

    Parameters
    ----------
    distance : (...)
        Of the signal from the reading, in units of the noise before rounding.
    half : ()
        Of a step, in the same units.
    """
    away = jnp.abs(distance)
    inside, beyond = log_ndtr(half - away), log_ndtr(-half - away)
    return inside + jnp.log1p(-jnp.exp(beyond - inside))


def step_residuals(distance: jax.Array, steps: Steps) -> jax.Array:
    """Deviance residuals of readings in coarse steps, their signs those of the distances.

    Parameters
    ----------
    distance : (n_time,) in SI units
        Simulated less measured.
    steps : Steps
        Of one record.
    """
    half, away = 0.5 * steps.size / steps.noise, distance / steps.noise
    best = log_probability(jnp.zeros(()), half)
    bend = 2.0 * half * jax.scipy.stats.norm.pdf(half) / jnp.exp(best)
    far = jnp.where(jnp.abs(away) > NEAR, away, NEAR)
    residual = jnp.sign(far) * jnp.sqrt(jnp.maximum(2.0 * (best - log_probability(far, half)), 1e-300))
    return jnp.where(jnp.abs(away) > NEAR, residual, away * jnp.sqrt(bend))


def rows_in_steps(rows: jax.Array, weight: jax.Array, steps: Steps) -> jax.Array:
    """Residuals of readings as if they were fine, and their changes, as those of readings in coarse steps.

    Their slope is taken at the residuals: that of a difference would be off by the bend of the likelihood, and always
    to the same side.

    Parameters
    ----------
    rows : (n_record, n_row, n_time) in units of the noise
        Residuals first.
    weight : (n_record, n_time) per SI unit
    """
    distance = jnp.where(weight > 0.0, rows[:, 0] / jnp.where(weight > 0.0, weight, 1.0), 0.0)
    each = jax.vmap(step_residuals)
    residuals, slope = jax.jvp(lambda away: each(away, steps), (distance,), (jnp.ones_like(distance),))
    level = jnp.asarray(steps.level)[:, None]
    return jnp.concatenate([(residuals * weight * level)[:, None], rows[:, 1:] * (slope * level)[:, None]], axis=1)


LENGTH_STEP = 512
"""Lengths are padded to a multiple of this, so that studies of like length share a compiled program."""


class Observations(NamedTuple):
    """Stacked records.

    Parameters
    ----------
    experiment : Experiment
        Leaves ``(n_record, ...)``.
    measured : dict of (n_record, n_time)
        Zero where nothing was measured.
    weight : dict of (n_record, n_time)
        One over the noise (rms, SI) where a sample counts, zero elsewhere.
    steps : dict of Steps
        Of the channels whose residuals are those of readings in coarse steps.
    """

    experiment: Experiment
    measured: dict[str, jax.Array]
    weight: dict[str, jax.Array]
    steps: dict[str, Steps] = {}  # noqa: RUF012


def stack(traces: Sequence[Trace], noise: Mapping[str, Sequence[Any]]) -> Observations:
    """Pad the records to one length and stack them.

    Parameters
    ----------
    noise : mapping of channel to (n_record,) in SI units
        Noise rms of each channel in each record, or of each of its readings, ``(n_time,)``.

    Raises
    ------
    DataError
        If a record has fewer than 16 samples.
    """
    for trace in traces:
        if len(trace.times) < FEWEST_READINGS:
            do = "Check how the file was read."
            raise DataError(trace.name, f"{len(trace.times)} samples", f"at least {FEWEST_READINGS}", do)
    longest = max(len(trace.times) for trace in traces)
    size = -(-longest // LENGTH_STEP) * LENGTH_STEP
    times = [
        np.concatenate([t, t[-1] + np.diff(t).mean() * np.arange(1, size - len(t) + 1)])
        for t in (trace.times for trace in traces)
    ]
    experiment = Experiment(
        times=_stacked(times),
        count=jax.device_put(np.array([len(trace.times) for trace in traces], dtype=np.int32)),
        conditions={name: _stacked([trace.conditions[name] for trace in traces]) for name in traces[0].conditions},
        inputs={
            name: Signals(*(_stacked([_padded(t.inputs[name][:, i], size) for t in traces]) for i in (0, 1)))
            for name in traces[0].inputs
        },
        duration=_stacked([float(trace.times[-1] - trace.times[0]) for trace in traces]),
    )
    channels = traces[0].channels
    measured = {c: _stacked([_padded(np.nan_to_num(t.channels[c]), size) for t in traces]) for c in channels}
    weight = {
        c: _stacked([_padded(np.isfinite(t.channels[c]) / n, size, 0.0) for t, n in zip(traces, noise[c], strict=True)])
        for c in channels
    }
    return Observations(experiment, measured, weight)


def _padded(values: np.ndarray, size: int, fill: float | None = None) -> np.ndarray:
    last = values[-1] if fill is None else fill
    return np.concatenate([values, np.full(size - len(values), last)])


def _stacked(rows: Sequence[np.ndarray] | Sequence[float]) -> jax.Array:
    # As it is: another way of handing it over would be a program for each shape.
    return jax.device_put(np.array(rows, dtype=float))
