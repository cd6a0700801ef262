"""Values and input errors found together."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import equinox as eqx
import numpy as np
import pytest

from fibrefit.core.limits import quiet
from fibrefit.fitting.checks import converged
from fibrefit.fitting.identify import _search, identify
from fibrefit.fitting.search import optimum as module
from fibrefit.fitting.search.optimum import (
    ROUGHLY,
    linearised_in_errors,
    noise_left,
    optimum,
    reacts_alike,
    still_gains,
    with_input_errors,
)
from fibrefit.fitting.search.starts import HorizonSchedule
from fibrefit.problem.formulation import formulate
from fibrefit.problem.inputs.errors_in_variables import error_rms, expanded, input_errors, no_errors
from fibrefit.problem.inputs.sensitivities import InputSensitivities
from fibrefit.rigs.catalogue import RIGS
from fibrefit.simulation.model import Model
from fibrefit.study import load_study
from fibrefit.workflow.prepare import read_records
from tests.validation.cases import Case

STUDY = Path(__file__).parents[2] / "configs" / "drive_series" / "study.toml"
TRUTH = {"stiffness": 14693.386, "damping": 26.943, "friction": 3.951}


def test_a_descent_ends_where_it_is_judged_to_have_arrived() -> None:
    assert converged(ROUGHLY, True, rough=True).passed
    assert not converged(1.01 * ROUGHLY, True, rough=True).passed
    assert not converged(ROUGHLY, True).passed


@pytest.mark.parametrize("followed", [True, False])
def test_where_errors_of_inputs_lead_nowhere_the_values_stay_and_nothing_has_converged(
    monkeypatch: pytest.MonkeyPatch, followed: bool
) -> None:
    look = SimpleNamespace(is_followed=followed, variance=1.0, left=np.zeros(1), coefficients={"drive": "found"})
    look.end, look.view = SimpleNamespace(place="end", predicted_reduction=0.01), "about it"
    view = SimpleNamespace(beforehand=None)
    for name, what in {
        "no_errors": {"drive": "none"},
        "_reactions": [None],
        "_values": "values",
        "_seen_with": view,
        "replace": view,
        "_descended": None,
        "_linearisation_at": look,
        "_tells_more": False,
        "corrected": "corrected",
    }.items():
        monkeypatch.setattr(module, name, lambda *of, what=what, **more: what)
    monkeypatch.setattr(module.Unknowns, "of_fit", lambda *of: SimpleNamespace(place_of=lambda local: None))
    layout = SimpleNamespace(size=1, local=lambda values: np.zeros((1, 1)), records=("drive.csv",))
    task: Any = SimpleNamespace(problem=SimpleNamespace(layout=layout))
    found = with_input_errors(task, {}, np.array([3.0]))
    if followed:
        assert (found.values, found.coefficients, found.predicted_reduction) == ("values", look.coefficients, 0.01)
    else:
        assert (found.problem, found.coefficients, found.predicted_reduction) == (task.problem, {"drive": "none"}, None)
        np.testing.assert_array_equal(found.values, [3.0])


@pytest.mark.slow
def test_a_measured_drive_with_noise_leaves_neither_bias_nor_gap() -> None:
    study = load_study(STUDY)
    study = study.model_copy(update={"records": (study.records[0], study.records[3])})
    task = formulate(study, read_records(study), Model(RIGS["pulley_drive"], ()))
    layout, known = task.problem.layout, input_errors(task)
    start = task.start.copy()
    start[: len(TRUTH)] = [1.002 * TRUTH[slot.name] for slot, _ in layout.entries[: len(TRUTH)]]
    found = with_input_errors(task, known, start)
    samples = task.problem.n_measured
    local = np.asarray(layout.local(found.values))
    gap = np.sqrt(np.sum(np.asarray(found.problem.linearised_at(local).residuals) ** 2) / samples)
    expected = np.sqrt(np.mean(noise_left(task, found) ** 2))
    assert gap == pytest.approx(expected, rel=0.03)
    assert expected < 1.0
    for (slot, _), value in zip(layout.entries, found.values[: len(TRUTH)], strict=False):
        assert value == pytest.approx(TRUTH[slot.name], rel=0.01)
    assert 0.2 < error_rms(task.problem, known, found.coefficients)["drive"] / 1.05e-5 < 1.15
    # As it was measured, the drive leaves more.
    plain = np.asarray(task.problem.residuals(found.values))
    assert np.sqrt(np.sum(plain**2) / samples) > 1.03 * gap


@pytest.mark.slow
def test_what_is_learnt_of_the_errors_lets_more_samples_count() -> None:
    study = load_study(STUDY)
    study = study.model_copy(update={"records": (study.records[-1],)})
    task = formulate(study, read_records(study), Model(RIGS["pulley_drive"], ()))
    known, start = input_errors(task), task.start.copy()
    start[: len(TRUTH)] = [TRUTH[slot.name] for slot, _ in task.problem.layout.entries[: len(TRUTH)]]
    first = linearised_in_errors(task.problem, known, start, no_errors(known)).raw
    found = with_input_errors(task, known, start)
    assert first is not None
    # Its weight bounces: at first, parts of the motion are beyond what a linear step predicts.
    assert np.mean(first.downweight < 0.5) > 0.02
    assert np.mean(found.sensitivities.downweight < 0.5) < 0.5 * np.mean(first.downweight < 0.5)


@pytest.mark.slow
def test_readings_linearised_by_somebody_else_are_not_linearised_again(monkeypatch: pytest.MonkeyPatch) -> None:
    study = load_study(STUDY)
    study = study.model_copy(update={"records": (study.records[0],)})
    task = formulate(study, read_records(study), Model(RIGS["pulley_drive"], ()))
    known, start = input_errors(task), task.start.copy()
    start[: len(TRUTH)] = [TRUTH[slot.name] for slot, _ in task.problem.layout.entries[: len(TRUTH)]]
    looks: list[int] = []
    own = module._seen_with

    def counted(*args: Any) -> Any:
        looks[-1] += 1
        return own(*args)

    first = linearised_in_errors(task.problem, known, start, no_errors(known)).raw
    monkeypatch.setattr(module, "_seen_with", counted)
    ends = []
    for near in (None, first):
        looks.append(0)
        ends.append(with_input_errors(task, known, start, no_errors(known), near))
    assert looks[1] == looks[0] - 1
    # What errors do is then found anew where the other takes it over: of these values, a fraction of a standard error.
    np.testing.assert_allclose(ends[1].values, ends[0].values, rtol=5e-3)
    assert (ends[1].view.beforehand or ends[1].view).raw is first


@pytest.mark.slow
def test_records_in_a_wrong_bounce_are_followed_bounce_by_bounce(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Case("2026-11-25z", "null", "pulley_drive", 1, "slow", 0.0).write(tmp_path)
    study = load_study(tmp_path)
    task = formulate(study, read_records(study), Model(RIGS["pulley_drive"], ()))
    found = _search(task, 8, 0, quiet, lambda: False, HorizonSchedule.of(task))
    # Where plain squares end: the drive's noise has moved bounces.
    values, counts = found.values[int(np.argmin(found.cost))], task.problem.n_measured

    def gap() -> float:
        end = optimum(task, values)
        left = np.asarray(end.problem.linearised_at(end.local).residuals)
        return float(np.sqrt(np.sum(left**2) / counts))

    assert gap() < 1.03
    # The negative control: followed to the end or not at all.
    monkeypatch.setattr("fibrefit.fitting.search.optimum.SHORTENED", 0)
    assert gap() > 1.3


@pytest.mark.slow
def test_readings_up_to_an_instant_tell_what_they_would_tell_without_the_others() -> None:
    study = load_study(STUDY)
    study = study.model_copy(update={"records": (study.records[0],)})
    task = formulate(study, read_records(study), Model(RIGS["pulley_drive"], ()))
    known = input_errors(task)
    waves = {name: np.full_like(of, 0.1) for name, of in no_errors(known).items()}
    rows = [rows for _, _, rows in expanded(task.problem, known, task.start, waves)]
    shape = (1, len(task.problem.model.rig.channels), rows[0].shape[1] // len(task.problem.model.rig.channels))
    weight = np.random.default_rng(1).uniform(0.5, 1.0, shape)
    count = shape[-1] // 3
    shorter = InputSensitivities.of(waves, rows, weight).until([count])
    wanted = InputSensitivities.of(waves, rows, np.where(np.arange(shape[-1]) < count, weight, 0.0))
    np.testing.assert_array_equal(shorter.downweight, wanted.downweight)
    np.testing.assert_allclose(shorter.offset, wanted.offset, rtol=1e-9, atol=1e-9)
    seen = np.where(np.arange(shape[-1]) < count, np.random.default_rng(2).standard_normal((1, 3, *shape[1:])), 0.0)
    flat = seen.reshape(1, 3, -1)
    np.testing.assert_allclose(shorter.without_errors(flat), wanted.without_errors(flat), atol=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(("left", "looks"), [(np.inf, 2), (1e-3, 1)])
def test_a_look_that_the_time_does_not_suffice_for_is_not_begun(
    monkeypatch: pytest.MonkeyPatch, left: float, looks: int
) -> None:
    study = load_study(STUDY)
    study = study.model_copy(update={"records": (study.records[-1],)})
    task = formulate(study, read_records(study), Model(RIGS["pulley_drive"], ()))
    known, start = input_errors(task), task.start.copy()
    start[: len(TRUTH)] = [TRUTH[slot.name] for slot, _ in task.problem.layout.entries[: len(TRUTH)]]
    own, begun = module._seen_with, list[int]()

    def counted(*args: Any) -> Any:
        begun.append(1)
        return own(*args)

    monkeypatch.setattr(module, "_seen_with", counted)
    monkeypatch.setattr("fibrefit.core.limits.time_left", lambda: left)
    with_input_errors(task, known, start)
    assert (len(begun) >= looks) if looks > 1 else (len(begun) == 1)


@pytest.mark.slow
def test_error_bars_do_not_rest_on_what_was_predicted_only_once_the_errors_were_learnt() -> None:
    study = load_study(STUDY)
    bars = []
    for record in (study.records[-1], study.records[0]):
        own = study.model_copy(update={"records": (record,)})
        task = formulate(own, read_records(own), Model(RIGS["pulley_drive"], ()))
        found = identify(replace(task, start=task.start, horizons=task.horizons[:1, -1:]), 1, 0)
        assert found.gls is not None
        evidence = found.gls.evidence
        place = evidence.mode.unknowns.names.index("damping")
        of_mode = float(np.sqrt(evidence.spread[place, place]))
        bars.append(found.parameters["damping"].std_error / found.parameters["damping"].value / of_mode)
    # The weight of the first bounces; that of the second hardly moves by itself.
    assert bars[0] > 1.2
    assert bars[0] > bars[1] > 0.95


@pytest.mark.slow
def test_a_model_that_lacks_much_is_left_with_its_inputs_as_they_were_measured() -> None:
    study = load_study(STUDY)
    study = study.model_copy(update={"records": (study.records[0],)})
    task = formulate(study, read_records(study), Model(RIGS["pulley_drive"], ()))
    start = task.start.copy()
    start[: len(TRUTH)] = [TRUTH[slot.name] for slot, _ in task.problem.layout.entries[: len(TRUTH)]]
    measured = task.problem.observations.measured
    louder = {**measured, "force": 1.3 * measured["force"]}
    lacking = replace(task, problem=eqx.tree_at(lambda p: p.observations.measured, task.problem, louder))
    found = with_input_errors(lacking, input_errors(lacking), start)
    assert not np.any(found.coefficients["drive"])
    assert found.predicted_reduction == 0.0


@pytest.mark.slow
def test_errors_that_explain_nothing_are_no_place_to_begin() -> None:
    study = load_study(STUDY)
    study = study.model_copy(update={"records": (study.records[0],)})
    task = formulate(study, read_records(study), Model(RIGS["pulley_drive"], ()))
    known, start = input_errors(task), task.start.copy()
    start[: len(TRUTH)] = [TRUTH[slot.name] for slot, _ in task.problem.layout.entries[: len(TRUTH)]]
    random = np.random.default_rng(0)
    wrong = {name: 100.0 * random.standard_normal(wave.shape) for name, wave in no_errors(known).items()}
    found, plain = with_input_errors(task, known, start, wrong), with_input_errors(task, known, start)
    assert np.any(plain.coefficients["drive"])
    np.testing.assert_array_equal(found.coefficients["drive"], plain.coefficients["drive"])
    np.testing.assert_array_equal(found.values, plain.values)


@pytest.mark.parametrize(
    ("lefts", "bends", "more"),
    [
        ([4.0, 2.0], True, True),
        ([4.0, 2.0], False, True),
        ([4.0, 4.0], False, False),
        ([4.0, 4.0], True, False),
        ([4.0, 2.0, 4.0], True, True),
        ([4.0, 2.0, 4.0], False, False),
        ([4.0, 2.0, 4.0, 2.0], True, False),
        ([40.0, 20.0, 20.0, 10.0], True, True),
    ],
    ids=str,
)
def test_places_that_lead_to_each_other_are_not_looked_at_for_ever(lefts: list[float], bends: bool, more: bool) -> None:
    assert still_gains([0.9] * len(lefts), lefts, bends) == more
    # So it is of any record, and of what comes to count.
    assert still_gains([np.array([0.9, 0.9])] * len(lefts), [np.array([left, 1.0]) for left in lefts], bends) == more
    assert still_gains([0.5] * (len(lefts) - 1) + [0.9], lefts, bends)


def test_a_record_reacts_alike_by_itself() -> None:
    linearised = np.ones((2, 1, 4))
    linearised[:, :, -1] = 0.0
    left = linearised.copy()
    # What does not count says nothing of it.
    left[0, 0] += [0.01, 0.0, 0.0, 9.0]
    left[1, 0] += [0.5, 0.0, 0.0, 0.0]
    assert reacts_alike(left, linearised).tolist() == [True, False]
    assert reacts_alike(left, linearised, variance=100.0).tolist() == [True, True]
