"""The simulated motion at an estimate, and how far it is from what was measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fibrefit.fitting.result import Gap
from fibrefit.problem.diagnose.motion import Motion
from fibrefit.problem.noise.readings import unbroken
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.rigs.signals.rest import rests
from fibrefit.study.summaries.results import ChannelGap


@dataclass(frozen=True)
class Evaluation:
    """A simulation beside its records.

    Parameters
    ----------
    record_gaps : mapping of record to Gap
    """

    motion: Motion
    gap: Gap
    record_gaps: Mapping[str, Gap]


def evaluate(task: Task, problem: Problem, local: np.ndarray) -> Evaluation:
    """Simulate and compare.

    Parameters
    ----------
    problem : Problem
        Of the task, errors of its inputs taken off.
    local : (n_record, n_local) in SI units
        Values of each record.
    """
    moved = Motion.of_fit(problem, local)
    return Evaluation(moved, *_gaps(task, moved.readings))


def _gaps(task: Task, readings: Mapping[str, np.ndarray]) -> tuple[Gap, Mapping[str, Gap]]:
    data, names = task.problem.observations, task.problem.layout.records
    gaps: dict[str, dict[str, ChannelGap]] = {name: {} for name in names}
    whole: dict[str, ChannelGap] = {}
    for channel, reading in readings.items():
        weight = np.asarray(data.weight[channel])
        counted = weight > 0.0
        measured = np.asarray(data.measured[channel])
        error = np.where(counted, measured - reading, 0.0)
        pieces = task.problem.model.pieces
        squares = np.array([_squares(row, seen, pieces) for row, seen in zip(measured, counted, strict=True)])
        # Where noise grows with the load each reading has its own: a perfect model is off by their mean square.
        noises = np.divide(1.0, weight, out=np.zeros_like(weight), where=counted)
        number = counted.sum(axis=1)
        for r, name in enumerate(names):
            rms, noise = (float(np.sqrt(np.sum(part[r] ** 2) / max(number[r], 1))) for part in (error, noises))
            share = _explained(float(np.sum(error[r] ** 2)), float(squares[r]))
            gaps[name][channel] = ChannelGap.against_noise(noise, rms, task.units[channel], share)
        rms, noise = (float(np.sqrt(np.sum(part**2) / number.sum())) for part in (error, noises))
        share = _explained(float(np.sum(error**2)), float(squares.sum()))
        whole[channel] = ChannelGap.against_noise(noise, rms, task.units[channel], share)
    return whole, gaps


def _squares(values: np.ndarray, counted: np.ndarray, pieces: int | None) -> float:
    """Sum of squared distances from the mean; in pieces, whose start is their own, from the best line of each."""
    if pieces is None:
        return float(np.sum((values[counted] - values[counted].mean()) ** 2)) if counted.any() else 0.0
    total, ahead = 0.0, np.arange(pieces) - 0.5 * (pieces - 1)
    for start in range(0, len(values), pieces):
        seen = counted[start : start + pieces]
        line = np.column_stack([np.ones(seen.sum()), ahead[: len(seen)][seen]])
        part = values[start : start + pieces][seen]
        if len(part):
            total += float(np.sum((part - line @ np.linalg.lstsq(line, part, rcond=None)[0]) ** 2))
    return total


def _explained(left: float, whole: float) -> float:
    return 1.0 - left / whole if whole > 0.0 else float("nan")


def readings_at_rest(task: Task) -> dict[str, list[tuple[np.ndarray, float]]]:
    """Readings at rest of each channel whose noise was taken from there, and their rates in Hz.

    Where the study states the noise, they are as much larger as it is: rests tell its colour, and the study its size.
    Where noise grows with the load they are taken back to the quietest reading of their record, as residuals are.
    """
    found: dict[str, list[tuple[np.ndarray, float]]] = {channel: [] for channel in task.problem.model.rig.channels}
    weights = {channel: np.asarray(task.problem.observations.weight[channel]) for channel in found}
    for r, trace in enumerate(task.traces):
        rate = trace.rate
        for rest in rests(trace):
            for channel in found:
                own = weights[channel][r, : len(trace.times)][rest]
                quieter = np.where(own > 0.0, own / weights[channel][r].max(), 1.0)
                values = trace.channels[channel][rest]
                # The load itself is no noise: a factor that follows its readings would take slow noise off with it.
                values = (values - values[np.isfinite(values)].sum() / max(np.isfinite(values).sum(), 1)) * quieter
                if task.noise[channel].samples and len(values := unbroken(values)):
                    found[channel].append((values * task.stated_over_rest.get(channel, 1.0), rate))
    return found
