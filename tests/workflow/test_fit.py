"""From a study to a fit and its files."""

from __future__ import annotations

import contextvars
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import jsonschema
import numpy as np
import pytest

import fibrefit
import fibrefit.plots.save
from fibrefit.core.errors import DataError, StudyError, UsageError
from fibrefit.core.paths import FIGURES
from fibrefit.fitting.result import total
from fibrefit.store import read_result, read_summary
from fibrefit.study import Study, load_study
from fibrefit.workflow.fit import Fit, fit_study
from fibrefit.workflow.prepare import task_of
from tests.fitting import made
from tests.reliability.studies import copied

SCHEMA = Path(__file__).resolve().parents[2] / "data_schemas" / "fit.schema.json"
NAMES = [f"drop_{1e3 * lift:g}mm.csv" for lift in made.LIFTS]


def test_the_fit_finds_what_the_files_were_made_with(fit: Fit) -> None:
    assert fit.status == "ok"
    for name, estimate in fit.parameters.items():
        assert estimate.value == pytest.approx(made.TRUTH[name], rel=0.01)
    assert fit.values.shape == (fit.identification.problem.layout.size,)


def test_all_files_are_there_and_nothing_else(saved: Path) -> None:
    assert {path.name for path in saved.iterdir()} == {
        "summary.json",
        "result.h5",
        "study.toml",
        "figures",
        ".fibrefit",
    }
    assert not saved.with_name("out.partial").exists()
    assert [path.name for path in (saved / "figures").iterdir()] == ["overview.png"]


def test_all_figures_are_drawn_where_they_are_asked_for(fit: Fit, tmp_path: Path) -> None:
    """In a context of its own: what was asked for holds for all that is written in it."""
    context = contextvars.copy_context()
    context.run(FIGURES.set, ("png",))
    out = context.run(fit.save, tmp_path / "out")
    assert {path.name for path in (out / "figures").iterdir()} == {
        "overview.png",
        "record_drop_5mm.png",
        "record_drop_10mm.png",
        "snaps.png",
        "starts.png",
        "correlation.png",
        "errors.png",
        "each.png",
    }


def test_the_summary_keeps_to_its_schema_and_to_the_contract(saved: Path, fit: Fit) -> None:
    content = json.loads((saved / "summary.json").read_text(encoding="utf-8"))
    jsonschema.validate(content, json.loads(SCHEMA.read_text(encoding="utf-8")))
    assert content["schema"] == "fibrefit/fit/1"
    assert content["status"] == "ok"
    assert set(content["parameters"]) == {"stiffness", "damping", "friction"}
    stiffness = content["parameters"]["stiffness"]
    assert stiffness["unit"] == "N/m"
    assert stiffness["free"] and not stiffness["at_bound"]  # noqa: PT018
    assert stiffness["interval_95"][0] < stiffness["value"] < stiffness["interval_95"][1]
    assert content["gap"]["total"] == pytest.approx(total(fit.identification.gap))
    assert content["gap"]["force"]["ratio"] == pytest.approx(
        content["gap"]["force"]["rms"] / content["gap"]["force"]["noise"]
    )
    assert set(content["records"]) == set(NAMES)
    first = content["records"][NAMES[0]]
    assert set(first["parameters"]) == {"position_zero", "release"}
    assert (first["files"], first["conditions"]["weight_mass"]["unit"]) == ([NAMES[0]], "kg")
    assert {"weight_mass", "inclination", "lift"} <= set(first["conditions"])
    assert not any(one["found"] for one in first["conditions"].values())
    assert content["starts"] | {"tried": made.STARTS, "agreeing": made.STARTS} == content["starts"]
    assert {"name", "passed", "says"} <= set(content["checks"][0])
    assert len(content["provenance"]["inputs"]) == 3


def test_the_summary_reads_back(saved: Path, fit: Fit) -> None:
    assert read_summary(saved).parameters == fit.summary().parameters  # type: ignore[union-attr]


def test_the_result_opens_with_h5py_and_holds_what_was_found(saved: Path, fit: Fit) -> None:
    found = fit.identification
    with h5py.File(saved / "result.h5") as file:
        assert {"estimate", "observed_data", "predictions", "residuals", "starts"} <= set(file)
        np.testing.assert_array_equal(file["estimate/value"], found.values)
        np.testing.assert_array_equal(file["estimate/covariance"], found.covariance)
        assert file["observed_data/force"].attrs["units"] == "N"
        assert file["predictions/position"].shape == (2, 1024)
    groups, attributes = read_result(saved / "result.h5")
    assert attributes["schema"] == "fibrefit/fit/1"
    assert list(groups["estimate"]["parameter"].values) == list(found.problem.layout.free_names)


def test_the_result_opens_with_xarray(saved: Path, fit: Fit) -> None:
    xarray = pytest.importorskip("xarray")
    with xarray.open_dataset(saved / "result.h5", group="predictions", engine="h5netcdf") as data:
        assert dict(data.sizes) == {"record": 2, "sample": 1024}
        assert list(data["record"].values) == NAMES
        simulated = data["force"].values
        np.testing.assert_array_equal(
            simulated[:, : made.SAMPLES], fit.identification.readings["force"][:, : made.SAMPLES]
        )
        assert np.isnan(simulated[:, made.SAMPLES :]).all()
    with xarray.open_dataset(saved / "result.h5", group="observed_data", engine="h5netcdf") as data:
        measured = data["force"].values[:, : made.SAMPLES]
        assert np.isfinite(measured).all()
        assert np.isnan(data["force"].values[:, made.SAMPLES :]).all()


def test_the_study_beside_the_result_is_the_same_study(saved: Path, study: Study) -> None:
    again = load_study(saved / "study.toml")
    assert again.resolved_toml() != ""
    for old, new in zip(study.records, again.records, strict=True):
        assert again.path_of(new.file).resolve() == study.path_of(old.file).resolve()
        assert new.lift == old.lift
    assert again.input_files()[1].exists()


def test_a_result_is_not_replaced_unless_asked(saved: Path, fit: Fit) -> None:
    with pytest.raises(UsageError, match="exists already"):
        fit.save(saved)
    assert fit.save(saved, force=True) == saved


def test_a_failure_while_writing_leaves_nothing(fit: Fit, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise OSError("the disk is full")

    monkeypatch.setattr(fibrefit.plots.save, "save_figures", fail)
    with pytest.raises(OSError, match="full"):
        fit.save(tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_a_failure_leaves_the_earlier_result_alone(fit: Fit, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fit.save(tmp_path / "out")
    before = (tmp_path / "out" / "summary.json").read_bytes()
    monkeypatch.setattr(fibrefit.plots.save, "save_figures", lambda *_: (_ for _ in ()).throw(OSError("full")))
    with pytest.raises(OSError, match="full"):
        fit.save(tmp_path / "out", force=True)
    assert (tmp_path / "out" / "summary.json").read_bytes() == before


def test_the_report_fits_a_terminal_and_says_the_verdict(fit: Fit) -> None:
    lines = fit.report().splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[0].endswith("OK")
    assert any("stiffness" in line and "kN/m" in line for line in lines)


def test_masked_samples_are_counted_by_record(tmp_path: Path) -> None:
    made.study(tmp_path)
    first, second = made.records(share=0.5, seed=3)
    force = first.channels["force"].copy()
    force[600:640] = np.nan
    made.write(tmp_path, [made.replace(first, force=force), second])
    hurt = fit_study(load_study(tmp_path), starts=made.STARTS)
    records = hurt.summary().records
    assert (records[NAMES[0]].masked, records[NAMES[1]].masked) == (40, 0)
    assert hurt.status == "ok"


MIXED = """
[parameters.damping]
shared = false
prior = "25 +/- 5 N s/m"
[parameters.friction]
initial = "4 N"
fixed = true
"""


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Fit:
    """A damping for each record, friction held, one lift not told, one zero and one release held."""
    folder = tmp_path_factory.mktemp("mixed")
    own = ['release = "123.4 ms"', 'position_zero = "0.13 mm"']
    made.study(folder, lifts=(None, 1e-2), more=MIXED, own=own)
    damped = (20.0, 30.0)
    records = [made.records(share=0.5, seed=3, damping=damping)[i] for i, damping in enumerate(damped)]
    made.write(folder, records)
    return fit_study(load_study(folder), starts=made.STARTS)


def test_a_parameter_of_each_record_is_found_for_each(mixed: Fit) -> None:
    assert "damping" not in mixed.parameters
    found = {e.record: e.found for e in mixed.identification.estimates if e.name == "damping"}
    for name, true in zip(NAMES, (20.0, 30.0), strict=True):
        assert abs(found[name].value - true) < 4.0 * found[name].std_error
        assert found[name].value == pytest.approx(true, rel=0.03)


def test_what_is_held_is_reported_as_held(mixed: Fit) -> None:
    friction = mixed.parameters["friction"]
    assert (friction.value, friction.free, friction.interval_95) == (4.0, False, (4.0, 4.0))
    held = {(e.name, e.record): e.found.value for e in mixed.identification.estimates if not e.found.free}
    assert held == {
        ("friction", None): 4.0,
        ("release", NAMES[0]): pytest.approx(0.1234),
        ("position_zero", NAMES[1]): pytest.approx(1.3e-4),
        ("lift", NAMES[1]): pytest.approx(1e-2),
    }


def test_a_lift_that_is_not_told_is_found_with_its_error(mixed: Fit) -> None:
    (of,) = (e for e in mixed.identification.estimates if e.name == "lift" and e.found.free)
    assert of.record == NAMES[0]
    lift = of.found
    assert abs(lift.value - 5e-3) < 4.0 * lift.std_error
    assert lift.std_error < 1e-4


def test_the_files_of_such_a_fit_are_sound_too(mixed: Fit, tmp_path: Path) -> None:
    content = json.loads((mixed.save(tmp_path / "out") / "summary.json").read_text(encoding="utf-8"))
    jsonschema.validate(content, json.loads(SCHEMA.read_text(encoding="utf-8")))
    assert content["parameters"]["friction"]["std_error"] is None
    assert content["records"][NAMES[0]]["parameters"]["release"]["free"] is False
    assert content["own_parameters"] == ["damping"]
    assert any(line.startswith("damping of") for line in mixed.report().splitlines())
    assert any("This fit does not weigh the prior of damping" in said for said in content["advice"])
    assert max(map(len, mixed.report().splitlines())) <= 80
    # Each record's own values in the resolved study would be no use to the next run.
    assert load_study(tmp_path / "out" / "study.toml").parameters["damping"].shared is False


HELD = "".join(
    f'[parameters.{name}]\ninitial = "{value}"\nfixed = true\n'
    for name, value in (("stiffness", "20 kN/m"), ("damping", "25 N s/m"), ("friction", "4 N"))
)
REFUSED = [
    (
        HELD,
        ['release = "123.4 ms"\nposition_zero = "0.13 mm"'] * 2,
        StudyError,
        "every parameter is held; expected at least one that is free",
    ),
    ('[model]\neffects = ["guide.stribek_friction"]', [], StudyError, 'Did you mean "guide.stribeck_friction"'),
    ('[parameters."guide.stribeck_friction.breakaway_excess"]\ninitial = "2 N"', [], StudyError, "unknown parameter"),
    ('[units]\nforce = "kx"', [], StudyError, "kx"),
    ('[parameters.stiffness]\nbounds = ["50 kN/m", "60 kN/m"]\ninitial = "20 kN/m"', [], StudyError, "bounds"),
]


@pytest.mark.parametrize(("more", "own", "error", "says"), REFUSED)
def test_a_study_that_cannot_be_fitted_is_refused(
    tmp_path: Path, more: str, own: list[str], error: type[Exception], says: str
) -> None:
    made.write(tmp_path, made.records())
    with pytest.raises(error) as refused:
        fit_study(made.study(tmp_path, more=more, own=own), starts=1)
    assert says in str(refused.value)


@pytest.mark.parametrize("asked", [fibrefit.discover, fibrefit.distinguish, fibrefit.plan])
def test_nothing_is_asked_of_a_study_in_which_all_is_held(tmp_path: Path, asked: Callable[..., Any]) -> None:
    made.write(tmp_path, made.records())
    with pytest.raises(StudyError, match="every parameter is held; expected at least one that is free"):
        asked(made.study(tmp_path, more=HELD, own=['release = "123.4 ms"\nposition_zero = "0.13 mm"'] * 2))


def test_a_record_that_is_not_a_record_is_refused_by_name(tmp_path: Path) -> None:
    study = made.study(tmp_path)
    (tmp_path / NAMES[0]).write_text("this is not a measurement\n", encoding="utf-8")
    with pytest.raises(DataError, match=r"drop_5mm\.csv"):
        task_of(study)


def test_a_profile_of_a_measured_drive_is_refused_before_the_work(tmp_path: Path) -> None:
    study = copied("drive_series", tmp_path, records=1)
    with pytest.raises(UsageError, match=r"--profile: the \w+ that leads .*Leave it out: intervals of the fit"):
        fit_study(study, profile=True)
