"""Groups of ``result.h5`` that several kinds of result hold: what was measured, motion, conditions, standard errors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fibrefit.core.declarations import PHASES, STATES, TURNING
from fibrefit.fitting.result import Identification
from fibrefit.problem import Motion, Problem
from fibrefit.study.summaries.part import Variable

BY_SAMPLE = ("record", "sample")
"""Dimensions of what every sample has."""


def names_of_records(problem: Problem) -> dict[str, Variable]:
    """Names of the records, as the coordinates of that dimension."""
    return {"record": Variable(np.array(problem.layout.records, dtype=object), ("record",))}


def sample_times(problem: Problem) -> dict[str, Variable]:
    """Names of the records and times of their samples."""
    times = np.asarray(problem.observations.experiment.times)
    return names_of_records(problem) | {"time": Variable(times, BY_SAMPLE, "s", "Time of each sample.")}


def observed_group(problem: Problem, units: Mapping[str, str]) -> dict[str, Variable]:
    """What was measured in each channel, and when."""
    found, data = sample_times(problem), problem.observations
    for channel in problem.model.rig.channels:
        measured = np.where(np.asarray(data.weight[channel]) > 0.0, np.asarray(data.measured[channel]), np.nan)
        doc = "Measured; NaN where masked or beyond the record."
        found[channel] = Variable(measured, BY_SAMPLE, units[channel], doc)
    return found


def within_records(problem: Problem, readings: Any) -> np.ndarray:
    """Readings with NaN beyond each record: what shorter records are filled up with is no prediction.

    Parameters
    ----------
    readings : (..., n_record, n_time)
    """
    experiment = problem.observations.experiment
    return np.where(np.arange(np.shape(readings)[-1]) < np.asarray(experiment.count)[:, None], readings, np.nan)


def phase_of(moved: Motion) -> Variable:
    """Phase of the motion of each sample."""
    return Variable(moved.phase, BY_SAMPLE, doc=", ".join(f"{i}: {phase}" for i, phase in enumerate(PHASES)))


def motion_group(problem: Problem, moved: Motion) -> dict[str, Variable]:
    """Phase and states of the simulated motion; states by their names with underscores."""
    turns = "angle" in problem.model.rig.channels
    units = {**STATES, **(TURNING if turns else {})}
    states = {
        name.replace(" ", "_"): Variable(values, BY_SAMPLE, units[name], "Simulated.")
        for name, values in moved.states.items()
    }
    return {**names_of_records(problem), "phase": phase_of(moved), **states}


def conditions_group(problem: Problem) -> dict[str, Variable]:
    """Number of samples and conditions of each record."""
    count = np.asarray(problem.observations.experiment.count)
    samples = Variable(count, ("record",), doc="Number of samples, without the padding.")
    return {**names_of_records(problem), "samples": samples, **conditions_by_name(problem)}


def conditions_by_name(problem: Problem) -> dict[str, Variable]:
    """Conditions of each record by name."""
    known = problem.observations.experiment.conditions
    return {
        one.name: Variable(np.asarray(known[one.name]), ("record",), one.unit, one.doc)
        for one in problem.model.rig.conditions
        if one.name in known
    }


def reading_errors(found: Identification) -> dict[str, Variable]:
    """Standard error of each simulated reading by the errors of the values, and noise, which may grow with the load.

    Errors are NaN where a value is not determined, and where nothing was measured: slopes are known in units of a
    reading's noise. The noise is there that of the quietest reading.
    """
    layout = found.problem.layout
    linear, _ = found.problem.evaluate(layout.local(np.asarray(found.values)))
    slopes, columns = np.asarray(linear.slopes), np.asarray(layout.local_columns)
    # A value that is held in a record has a place beyond the last one.
    covariance = np.pad(found.covariance, (0, 1))
    errors = {}
    for i, (channel, gap) in enumerate(found.gap.items()):
        weight = np.asarray(found.problem.observations.weight[channel])
        own = [
            np.sqrt(np.maximum(np.einsum("ti,ij,tj->t", of[i], covariance[np.ix_(at, at)], of[i]), 0.0))
            for of, at in zip(slopes, np.minimum(columns, layout.size), strict=True)
        ]
        values = np.array(own) / np.where(weight > 0.0, weight, np.nan)
        doc = "Standard error of the simulated reading by the errors of the values; NaN where nothing was measured."
        errors[f"{channel}_error"] = Variable(values, BY_SAMPLE, gap.unit, doc)
        noise = 1.0 / np.maximum(np.where(weight > 0.0, weight, weight.max(axis=1, keepdims=True)), 1e-300)
        errors[f"{channel}_noise"] = Variable(noise, BY_SAMPLE, gap.unit, "Noise rms of the reading.")
    return errors
