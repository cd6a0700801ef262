"""The files of a discovery: they follow their schemas, and the study of the final model is a study like any other."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from fibrefit.core.errors import UsageError
from fibrefit.laws.catalogue import CATALOGUE, is_sought, suits
from fibrefit.laws.families import MARK, members
from fibrefit.problem.task import Task
from fibrefit.rigs.catalogue import RIGS
from fibrefit.store import read_result, read_summary
from fibrefit.study import load_study
from fibrefit.study.schemas import schemas
from fibrefit.study.summaries.discovery import DiscoverySummary
from fibrefit.workflow.discovery import discover as workflow
from fibrefit.workflow.discovery.candidates import candidates_of
from fibrefit.workflow.discovery.discover import Discovery, SearchOptions, finished
from fibrefit.workflow.prepare import model_of
from tests.discovery.conftest import DATA
from tests.discovery.made import CURVES, FINDINGS, VISCOUS, identified, named
from tests.discovery.test_candidates import OWN

Make = Callable[..., Discovery]


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the figures, which take most of the time."""
    monkeypatch.setattr(Discovery, "plot", lambda self: {})


@pytest.mark.parametrize("verdict", sorted(FINDINGS))
def test_every_verdict_is_written_and_read(
    discovery: Make, elsewhere: Path, verdict: str, request: pytest.FixtureRequest
) -> None:
    if verdict != "named":
        request.getfixturevalue("undrawn")  # every verdict is drawn in test_figures
    made = discovery(verdict)
    out = made.save(elsewhere / "out")
    content = json.loads((out / "summary.json").read_text())
    jsonschema.validate(content, schemas()["discovery.schema.json"])
    summary = read_summary(out)
    assert summary == made.summary().model_copy(update={"provenance": summary.provenance})  # type: ignore[attr-defined]
    groups, attributes = read_result(out / "result.h5")
    assert attributes["schema"] == "fibrefit/discovery/1"
    assert set(groups["predictions_before"]) >= {"force", "position"}
    assert load_study(out / "study.toml").model.effects == made.added
    assert verdict != "named" or (out / "figures" / "gap.png").stat().st_size > 10_000


def test_the_contract_of_the_summary(discovery: Make) -> None:
    content = json.loads(discovery().summary().model_dump_json(by_alias=True))
    assert content["verdict"] == "named"
    assert content["added"] == content["effects"] == [VISCOUS.name]
    (found,) = content["rounds"]
    assert (found["added"], found["gap_before"], found["gap_after"]) == (VISCOUS.name, 3.6, 1.0)
    assert set(found["where"][0]) == {"record", "channel", "from_s", "to_s", "phase", "share"}
    best = found["ranking"][0]
    assert best["effect"] == VISCOUS.name
    assert set(best["parameters"]["guide.viscous_friction.viscous_coefficient"]) >= {"value", "std_error", "unit"}
    assert content["cannot_tell_apart"] == [[VISCOUS.name, "guide.quadratic_drag"]]
    assert content["unexplained"] == {"gap": 1.0, "where": [], "looks_like": None, "curves": []}
    assert content["before"]["gap"]["total"] > 3.0 > content["gap"]["total"]
    assert [held["gap_after"] for held in content["held_out"]] == [1.02, 1.31]


@pytest.mark.usefixtures("undrawn")
def test_the_candidates_in_the_file_of_arrays(discovery: Make, elsewhere: Path) -> None:
    groups, _ = read_result(discovery().save(elsewhere / "out") / "result.h5")
    trials = groups["discovery"]
    assert list(trials["effect"].values[:2]) == [VISCOUS.name, "guide.quadratic_drag"]
    assert trials["round"].values.tolist() == [1] * 7
    owner = trials["value_of"].values[list(trials["parameter"].values).index("fibre.hysteresis.beta")]
    assert trials["effect"].values[owner] == "fibre.hysteresis"
    assert np.isinf(trials["std_error"].values).sum() > 0
    assert groups["held_out"]["gap_before"].values.tolist() == [6.8, 7.0]


def test_the_curves_in_the_summary(discovery: Make) -> None:
    content = json.loads(discovery("unexplained").summary().model_dump_json(by_alias=True))
    curves = content["unexplained"]["curves"]
    assert [curve["gap_after"] for curve in curves] == [1.01, 1.31, 2.2, 3.2]
    best = curves[0]
    assert (best["variable"], best["unit"], best["height_unit"]) == ("position", "m", "N")
    assert best["heights"] == list(CURVES[0].heights)
    assert best["knots"][0] == -0.02
    # What the records do not see has no error that could be written down.
    assert (best["std_errors"][0], best["std_errors"][-1]) == (None, 0.1)
    assert best["acts"] == list(CURVES[0].acts or ())


@pytest.mark.usefixtures("undrawn")
def test_the_curves_in_the_file_of_arrays(discovery: Make, elsewhere: Path) -> None:
    groups, _ = read_result(discovery("unexplained").save(elsewhere / "out") / "result.h5")
    curves = groups["curves"]
    assert list(curves["variable"].values) == ["position"] * 4
    assert curves["gap_after"].values.tolist() == [1.01, 1.31, 2.2, 3.2]
    second = curves["curve_of"].values == 1
    np.testing.assert_array_equal(curves["knot"].values[second], CURVES[1].knots)
    np.testing.assert_array_equal(curves["height"].values[second], CURVES[1].heights)
    np.testing.assert_array_equal(
        curves["std_error"].values[second], [error or np.inf for error in CURVES[1].std_errors]
    )
    assert read_result(discovery().save(elsewhere / "named") / "result.h5")[0]["curves"]["knot"].values.size == 0


@pytest.mark.usefixtures("undrawn")
def test_the_final_study_starts_where_the_search_ended(discovery: Make, elsewhere: Path) -> None:
    made = discovery()
    again = load_study(made.save(elsewhere / "deep" / "out") / "study.toml")
    assert again.model.effects == (VISCOUS.name,)
    declared = {p.name: p for p in model_of(again).parameters}
    settings = again.settings(declared)
    for name, estimate in made.parameters.items():
        assert settings[name].initial == estimate.value, name
    assert [again.path_of(record.file).resolve() for record in again.records] == [
        made.study.path_of(record.file).resolve() for record in made.study.records
    ]
    assert again.records[0].release is None  # what each record has for itself stays to be found


def member(name: str) -> str:
    """An effect, or that of a family which belongs to the second record."""
    return members(CATALOGUE[name], 2)[-1].name


@pytest.mark.parametrize("name", [member(name) for name in sorted(CATALOGUE)])
def test_values_of_every_effect_survive_the_round_trip(task: Task, discovery: Make, elsewhere: Path, name: str) -> None:
    effect = CATALOGUE[name.partition(MARK)[0]]
    made = discovery()
    if not suits(effect, RIGS[made.study.kind]):
        pytest.skip("for another rig")
    made = discovery(options=SearchOptions(also=() if is_sought(effect, RIGS[made.study.kind]) else (name,)))
    effect = made.candidates[name]
    added = (*(CATALOGUE[other] for other in effect.needs), effect)
    finding = replace(named(task), added=added, after=identified(task, added))
    made = replace(made, finding=finding)
    path = elsewhere / "study.toml"
    path.write_text(made.final.resolved_toml(relative_to=elsewhere))
    again = load_study(path)
    settings = again.settings({p.name: p for p in model_of(again).parameters})
    assert {key: setting.initial for key, setting in settings.items()} == {
        key: estimate.value for key, estimate in made.parameters.items()
    }


@pytest.mark.usefixtures("undrawn")
def test_an_effect_of_ones_own_is_named_by_its_file(task: Task, discovery: Make, elsewhere: Path) -> None:
    folder = elsewhere / "study"
    folder.mkdir()
    (folder / "mine.py").write_text(OWN)
    for path in (DATA / "viscous").iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    study = load_study(folder)
    options = SearchOptions(also=("mine.py:Rub",))
    tried = candidates_of(study, also=options.also)
    own = tried["mine.py:Rub"]
    finding = replace(named(task), added=(own,), after=identified(task, (own,)))
    made = replace(discovery(), study=study, finding=finding, candidates=tried, options=options)
    assert made.added == ("mine.py:Rub",)
    out = made.save(elsewhere / "results" / "out")
    again = load_study(out / "study.toml")
    assert again.model.effects == ("../../study/mine.py:Rub",)
    assert [effect.name for effect in model_of(again).effects] == ["guide.rub"]
    summary = read_summary(out)
    assert isinstance(summary, DiscoverySummary)
    assert summary.added == ("guide.rub",)
    assert summary.provenance is not None
    assert any(path.endswith("mine.py") for path in summary.provenance.inputs)
    assert finished(out, study, options) is not None
    (folder / "mine.py").write_text(OWN + "# another law\n")
    assert finished(out, study, options) is None


def test_a_value_a_rounding_error_beyond_its_bound_is_put_back(task: Task, discovery: Make) -> None:
    study = load_study(DATA / "viscous", ['parameters.stiffness.bounds=["1 kN/m", "22 kN/m"]'])
    finding = named(task)
    beyond = {"value": 22000.000000001}
    estimates = tuple(
        e._replace(found=e.found.model_copy(update=beyond)) if e.name == "stiffness" else e
        for e in finding.after.estimates
    )
    made = replace(
        discovery(), study=study, finding=replace(finding, after=replace(finding.after, estimates=estimates))
    )
    assert made.final.settings({p.name: p for p in model_of(made.final).parameters})["stiffness"].initial == 22000.0


def test_what_the_study_holds_stays_held(task: Task, discovery: Make) -> None:
    study = load_study(DATA / "viscous", ['parameters.damping.fixed="19 N s/m"'])
    finding = named(task)
    estimates = tuple(
        e._replace(found=e.found.model_copy(update={"free": e.name != "damping"})) for e in finding.after.estimates
    )
    made = replace(
        discovery(), study=study, finding=replace(finding, after=replace(finding.after, estimates=estimates))
    )
    assert made.final.parameters["damping"] == study.parameters["damping"]


def test_a_fit_that_failed_is_no_place_to_start_from(discovery: Make) -> None:
    made = discovery("not_trusted")
    assert made.final == made.study


@pytest.mark.usefixtures("undrawn")
def test_the_same_search_is_known_again(discovery: Make, elsewhere: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    options = SearchOptions(max_effects=2, only=("guide.*",), seed=3)
    made = discovery("named", options)
    out = made.save(elsewhere / "out")
    assert isinstance(finished(out, made.study, options), DiscoverySummary)
    assert finished(out, made.study, replace(options, only=("guide.*",), exclude=("guide.quadratic_drag",))) is None
    assert finished(out, made.study, replace(options, seed=4)) is None
    assert finished(out, made.study, replace(options, max_effects=3)) is None
    assert finished(out, load_study(DATA / "viscous", ["rig.weight_mass=3 kg"]), options) is None
    assert finished(out, load_study(DATA / "plain"), options) is None
    assert finished(elsewhere / "nowhere", made.study, options) is None
    monkeypatch.setattr(workflow, "versions", lambda: {"fibrefit": "another"})
    assert finished(out, made.study, options) is None


@pytest.mark.usefixtures("undrawn")
def test_what_a_person_chose_is_not_what_a_search_finds(discovery: Make, elsewhere: Path) -> None:
    made = replace(discovery(), chosen=True)
    assert finished(made.save(elsewhere / "out"), made.study, made.options) is None


@pytest.mark.usefixtures("undrawn")
def test_damaged_results_are_not_taken_for_finished(discovery: Make, elsewhere: Path) -> None:
    made = discovery()
    out = made.save(elsewhere / "out")
    (out / "summary.json").write_text("{")
    assert finished(out, made.study, made.options) is None


def test_the_folder_of_a_journal_is_made_or_refused_before_the_search(
    elsewhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A journal that cannot be written does not end a search: nobody would learn that it keeps nothing."""
    kept: list[Path | None] = []
    for name in ("read_records", "task_of", "task_to_fit"):
        monkeypatch.setattr(workflow, name, lambda *given: None)
    monkeypatch.setattr(workflow, "discover", lambda task, effects, limits, progress: kept.append(limits.folder))
    study = load_study(DATA / "rough")
    workflow.discover_study(study, folder="deep/journal")
    assert kept == [Path("deep/journal")]
    assert (elsewhere / "deep" / "journal").is_dir()
    Path("file").touch()
    with pytest.raises(UsageError, match="file: cannot be made: .*; expected a folder to write to"):
        workflow.discover_study(study, folder="file")
    assert len(kept) == 1
