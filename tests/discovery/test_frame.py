"""Frames of rigs with noisy inputs: what the errors of the inputs are taken to be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fibrefit.discovery.engine.candidates import absent_values, carried
from fibrefit.discovery.engine.supermodel import Frame, frame_of, waves_at
from fibrefit.effects.catalogue import find_effect
from fibrefit.problem.formulate.formulate import formulate
from fibrefit.problem.inputs.errors_in_variables import eliminate, input_errors, no_waves
from fibrefit.problem.inputs.linearity_weights import faded
from fibrefit.problem.inputs.reactions import reactions_of
from fibrefit.problem.task import Task
from fibrefit.rigs.catalogue import RIGS
from fibrefit.simulation.model import Model
from fibrefit.study import load_study
from fibrefit.workflow.prepare import read_records

STUDY = Path(__file__).parents[2] / "configs" / "drive_series" / "study.toml"
#: Reactions are kept in single precision.
SINGLE = 1e-4


@pytest.fixture(scope="module")
def task() -> Task:
    """The first record of the drive series."""
    study = load_study(STUDY)
    study = study.model_copy(update={"records": study.records[:1]})
    return formulate(study, read_records(study), Model(RIGS["pulley_drive"], ()))


def test_best_errors_and_costs_are_those_of_the_elimination(task: Task) -> None:
    known = input_errors(task)
    quiet = no_waves(known)
    reactions = reactions_of(task, task.start, quiet)
    assert reactions is not None
    # A little beside the values the reactions are those of.
    values = task.start * 1.0002
    whole = eliminate(faded(task.problem, reactions.fade), known, values, quiet)
    waves = waves_at(task, values, reactions)
    scale = np.abs(whole.best["drive"]).max()
    np.testing.assert_allclose(waves["drive"], whole.best["drive"], atol=0.02 * scale)
    frame = frame_of(task, (), reactions)
    local = np.asarray(task.problem.layout.local(values))
    cost = frame.costs(local, task.counts[-1]).sum()
    assert cost == pytest.approx(sum(gram[-1, -1] for gram in whole.gram), rel=0.01)


def test_far_from_a_right_model_nothing_counts_once_something_could_not_be_foretold() -> None:
    study = load_study(STUDY)
    study = study.model_copy(update={"records": study.records[-1:]})
    task = formulate(study, read_records(study), Model(RIGS["pulley_drive"], ()))
    quiet = no_waves(input_errors(task))
    near, far = (reactions_of(task, task.start, quiet, far) for far in (False, True))
    assert near is not None
    assert far is not None
    # The last record bounces, and comes to rest again: seen from nearby, what is after counts once more.
    assert np.any(np.diff(near.fade, axis=-1) > 0.1)
    assert np.all(np.diff(far.fade, axis=-1) <= 0.0)
    assert np.all(far.fade <= near.fade)


def test_an_absent_effect_changes_nothing(task: Task) -> None:
    reactions = reactions_of(task, task.start, no_waves(input_errors(task)))
    bare = frame_of(task, (), reactions)
    frame = frame_of(task, (find_effect("guide.viscous_friction"),), reactions)
    local = np.asarray(task.problem.layout.local(task.start))
    wider = carried(frame, absent_values(frame, len(local)), Frame(task), local)
    costs = [bare.costs(local, task.counts[-1]), frame.costs(wider, task.counts[-1])]
    np.testing.assert_allclose(*costs, rtol=SINGLE)
