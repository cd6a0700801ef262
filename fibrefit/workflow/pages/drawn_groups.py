"""What is drawn of a fit, as groups of ``result.h5``: motion, conditions, standard errors of the readings."""

from __future__ import annotations

import numpy as np

from fibrefit.core.roles import PHASES, STATES, TURNING
from fibrefit.fitting.result import Identification
from fibrefit.problem.diagnose.phases import Motion
from fibrefit.problem.statement.observations import BY_SAMPLE
from fibrefit.problem.statement.problem import Problem
from fibrefit.store.hdf5 import Variable


def motion_group(problem: Problem, moved: Motion) -> dict[str, Variable]:
    """Phase and states of the simulated motion; states by their names with underscores."""
    turns = "angle" in problem.model.rig.channels
    units = {**STATES, **(TURNING if turns else {})}
    said = ", ".join(f"{i}: {phase}" for i, phase in enumerate(PHASES))
    states = {
        name.replace(" ", "_"): Variable(values, BY_SAMPLE, units[name], "Simulated.")
        for name, values in moved.states.items()
    }
    return {"record": _records(problem), "phase": Variable(moved.phase, BY_SAMPLE, doc=said), **states}


def conditions_group(problem: Problem) -> dict[str, Variable]:
    """Number of samples and conditions of each record."""
    experiment = problem.observations.experiment
    found = {
        "samples": Variable(np.asarray(experiment.count), ("record",), doc="Number of samples, without the padding.")
    }
    for condition in problem.model.rig.conditions:
        if condition.name in experiment.conditions:
            values = np.asarray(experiment.conditions[condition.name])
            found[condition.name] = Variable(values, ("record",), condition.unit, condition.doc)
    return {"record": _records(problem), **found}


def reading_errors(found: Identification) -> dict[str, Variable]:
    """Standard error of each simulated reading by the errors of the values; NaN where a value is not determined."""
    layout = found.problem.layout
    linear, _ = found.problem.followed(layout.local(np.asarray(found.values)))
    slopes, columns = np.asarray(linear.slopes), np.asarray(layout.local_columns)
    # A value that is held in a record has a place beyond the last one.
    covariance = np.pad(found.covariance, (0, 1))
    errors = {}
    for i, (channel, gap) in enumerate(found.gap.items()):
        weight = np.asarray(found.problem.observations.weight[channel]).max(axis=1)
        own = [
            np.sqrt(np.maximum(np.einsum("ti,ij,tj->t", of[i], covariance[np.ix_(at, at)], of[i]), 0.0))
            for of, at in zip(slopes, np.minimum(columns, layout.size), strict=True)
        ]
        values = np.array(own) / np.where(weight > 0.0, weight, np.nan)[:, None]
        doc = "Standard error of the simulated reading by the errors of the values."
        errors[f"{channel}_error"] = Variable(values, BY_SAMPLE, gap.unit, doc)
    return errors


def _records(problem: Problem) -> Variable:
    return Variable(np.array(problem.layout.records, dtype=object), ("record",))
