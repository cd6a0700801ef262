"""The one fit that all contenders are given: the drop series that ships with the project."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fibrefit.core.environment import configure_jax

configure_jax()

from fibrefit.problem.task import Task  # noqa: E402
from fibrefit.study import load_study  # noqa: E402
from fibrefit.workflow.prepare import read_records, task_of  # noqa: E402

STUDY = Path(__file__).resolve().parents[2] / "configs" / "drop_series" / "study.toml"
GRAVITY = 9.81
SHARED = ("stiffness", "damping", "friction")
OWN = ("position_zero", "release")


class Drop(NamedTuple):
    """One record, in SI units, with weights of one over the noise."""

    times: np.ndarray
    force: np.ndarray
    position: np.ndarray
    force_weight: float
    position_weight: float
    mass: float
    pull: float
    lift: float


class Fit(NamedTuple):
    """The problem as any program could be given it.

    Parameters
    ----------
    records : tuple of Drop
    start : (3 + 2 n_record,) in SI units: stiffness, damping, friction, then zero and release of each record
    scale : (3 + 2 n_record,) sizes of the parameters
    """

    records: tuple[Drop, ...]
    start: np.ndarray
    scale: np.ndarray


def drop_task(n_records: int | None = None) -> Task:
    """Our own task, of the first `n_records`; more than there are repeats them.

    Repeated after they are read: a study that lists a file twice is refused.
    """
    study = load_study(STUDY)
    if n_records is None:
        return task_of(study)
    number = len(study.records)
    read = read_records(study)
    rows = tuple(study.records[i % number].model_copy(update={"name": f"record {i}"}) for i in range(n_records))
    records = [dataclasses.replace(read[i % number], name=f"record {i}") for i in range(n_records)]
    return task_of(study.model_copy(update={"records": rows}), records)


def fit_of(task: Task) -> Fit:
    """The same problem without us."""
    records = []
    data = task.problem.observations
    for r, trace in enumerate(task.traces):
        held = {name: float(column[r]) for name, column in data.experiment.conditions.items()}
        mass = held["weight_mass"] + held["added_mass"]
        records.append(
            Drop(
                times=trace.times,
                force=trace.channels["force"],
                position=trace.channels["position"],
                force_weight=float(np.max(data.weight["force"][r])),
                position_weight=float(np.max(data.weight["position"][r])),
                mass=mass,
                pull=mass * GRAVITY * np.sin(held["inclination"]),
                lift=held["lift"],
            )
        )
    start = in_their_order(task, task.start)
    scale = np.array([start[0], 10.0, 1.0] + [1e-3, 1e-2] * len(records))
    return Fit(tuple(records), start, scale)


def in_their_order(task: Task, values: np.ndarray) -> np.ndarray:
    """Free values in the order of `Fit`, from those in the order of our layout."""
    order = [(name, None) for name in SHARED] + [(name, r) for r in range(len(task.traces)) for name in OWN]
    ours = [(slot.name, record) for slot, record in task.problem.layout.entries]
    return np.array([values[ours.index(entry)] for entry in order])


def in_our_order(task: Task, values: np.ndarray) -> np.ndarray:
    """Free values in the order of our layout, from those in the order of `Fit`."""
    order = [(name, None) for name in SHARED] + [(name, r) for r in range(len(task.traces)) for name in OWN]
    return np.array([values[order.index((slot.name, record))] for slot, record in task.problem.layout.entries])
