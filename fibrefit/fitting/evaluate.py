"""The simulated motion at an estimate, and how far it is from what was measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from fibrefit.fitting.result import ChannelGap, Gap
from fibrefit.fitting.structure import Residuals
from fibrefit.problem.diagnose.phases import Motion, motion
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task


@dataclass(frozen=True)
class Look:
    """A simulation beside its records.

    Parameters
    ----------
    motion : Motion
    gap : Gap
    record_gaps : mapping of record to Gap
    """

    motion: Motion
    gap: Gap
    record_gaps: Mapping[str, Gap]


def look(task: Task, problem: Problem, values: np.ndarray) -> Look:
    """Simulate and compare.

    Parameters
    ----------
    task : Task
    problem : Problem
        Of the task, errors of its inputs taken off.
    values : (n_free,) in SI units
    """
    moved = motion(problem, jnp.asarray(values))
    return Look(moved, *_gaps(task, moved.readings))


def _gaps(task: Task, readings: Mapping[str, np.ndarray]) -> tuple[Gap, Mapping[str, Gap]]:
    data, names = task.problem.observations, task.problem.layout.records
    gaps: dict[str, dict[str, ChannelGap]] = {name: {} for name in names}
    whole: dict[str, ChannelGap] = {}
    for channel, reading in readings.items():
        weight = np.asarray(data.weight[channel])
        counted = weight > 0.0
        error = np.where(counted, np.asarray(data.measured[channel]) - reading, 0.0)
        sigma = 1.0 / weight.max(axis=1)
        for r, name in enumerate(names):
            rms = float(np.sqrt(np.sum(error[r] ** 2) / max(counted[r].sum(), 1)))
            gaps[name][channel] = ChannelGap(rms, float(sigma[r]), task.units[channel])
        number = counted.sum(axis=1)
        rms, noise = (float(np.sqrt(np.sum(part) / number.sum())) for part in (error**2, sigma**2 * number))
        whole[channel] = ChannelGap(rms, noise, task.units[channel])
    return whole, gaps


def residuals_of(task: Task, scaled: np.ndarray, moved: Motion) -> Residuals:
    """Residuals ``(n_record, n_channel, n_time)`` in units of the noise, with what is needed to judge them."""
    data, channels = task.problem.observations, task.problem.model.rig.channels
    weight = np.stack([np.asarray(data.weight[c]) for c in channels], axis=1)
    times = np.asarray(data.experiment.times)
    return Residuals(
        scaled=scaled,
        counted=weight > 0.0,
        counts=np.asarray(data.experiment.count),
        rate=float(1.0 / np.diff(times[0]).mean()),
        channels=channels,
        sigma=1.0 / weight.max(axis=2),
        noise=task.noise,
        motion=moved,
    )
