"""What a result hands over: tables of pandas, a tree of xarray, two lines, and the same again from disk."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import fibrefit
from fibrefit.core.errors import DataError, UsageError
from fibrefit.store.csv_text import csv_text
from fibrefit.study import Study
from fibrefit.study.summaries.part import Variable
from fibrefit.workflow.fit import Fit
from fibrefit.workflow.outcome.stored import StoredInspection, StoredResult
from tests.study.test_summaries import EXAMPLES

COLUMNS = ["name", "record", "value", "std_error", "low", "high", "unit"]


@pytest.fixture(scope="module")
def again(saved: Path) -> StoredResult:
    found = fibrefit.load_result(saved)
    assert isinstance(found, StoredResult)
    return found


def test_every_value_is_a_row_of_the_table(fit: Fit) -> None:
    frame = fit.to_dataframe()
    assert list(frame.columns) == COLUMNS
    shared = frame[frame["record"].isna()].set_index("name")
    stiffness = fit.parameters["stiffness"]
    assert shared.loc["stiffness", "value"] == stiffness.value
    assert shared.loc["stiffness", "std_error"] == stiffness.std_error
    assert tuple(shared.loc["stiffness", ["low", "high"]]) == stiffness.interval_95
    assert shared.loc["stiffness", "unit"] == "N/m"
    own = frame[frame["record"].notna()]
    assert set(own["name"]) == {"position_zero", "release"}
    assert set(own["record"]) == {record.name for record in fit.records}


def test_what_was_saved_says_the_same(fit: Fit, again: StoredResult) -> None:
    pd.testing.assert_frame_equal(fit.to_dataframe(), again.to_dataframe())
    pd.testing.assert_frame_equal(fit.covariance, again.covariance)
    pd.testing.assert_frame_equal(fit.residuals, again.residuals)
    assert again.report() == fit.report()
    assert (again.kind, again.status) == ("fit", fit.status)
    assert again.parameters["damping"].value == fit.parameters["damping"].value
    assert again.study.name == fit.study.name
    assert list(again.figures) == ["overview"]
    assert {"overview", "snaps", "starts"} <= set(again.plot())


def test_pictures_are_found_as_whatever_files_they_were_asked_for(saved: Path, tmp_path: Path) -> None:
    shutil.copytree(saved, tmp_path / "again")
    drawn = tmp_path / "again" / "figures"
    shutil.rmtree(drawn)
    drawn.mkdir()
    for name in ("overview.svg", "starts.pdf", "starts.svg", "starts.png", "snaps.svg", "snaps.pdf"):
        (drawn / name).touch()
    found = fibrefit.load_result(tmp_path / "again").figures
    assert [path.name for path in found.values()] == ["overview.svg", "snaps.pdf", "starts.png"]


def test_covariance_is_that_of_the_error_bars(fit: Fit) -> None:
    covariance, correlation = fit.covariance, fit.correlation
    assert list(covariance.index) == list(fit.identification.problem.layout.free_names)
    assert np.sqrt(covariance.loc["damping", "damping"]) == pytest.approx(fit.parameters["damping"].std_error)
    np.testing.assert_allclose(np.diag(correlation), 1.0)
    assert correlation.abs().to_numpy().max() <= 1.0 + 1e-12


@pytest.mark.slow
def test_what_was_loaded_draws_and_predicts_as_what_was_found(fit: Fit, again: StoredResult) -> None:
    assert set(again.plot()) == set(fit.plot())
    holdout = fibrefit.example("drop_series") / "holdout"
    assert fibrefit.predict(again, holdout).verdict == fit.predict(holdout).verdict
    assert fibrefit.predict(fit, holdout).report() == fit.predict(holdout).report()
    with pytest.raises(UsageError, match="Study; expected a fit, a discovery"):
        fibrefit.predict(fibrefit.load_study(holdout), holdout)  # type: ignore[arg-type]


def test_what_was_loaded_offers_what_was_found(
    again: StoredResult, saved: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[object, object]] = []
    monkeypatch.setattr("fibrefit.workflow.prediction.predict.predict_study", lambda *of: asked.append(of))
    again.predict("new records")
    assert asked == [(again, "new records")]
    searched = EXAMPLES["fibrefit/discovery/1"]
    (tmp_path / "summary.json").write_text(searched.model_dump_json(by_alias=True), encoding="utf-8")
    found = fibrefit.load_result(tmp_path)
    assert isinstance(found, StoredResult)
    assert (found.verdict, found.added) == (searched.verdict, searched.added)  # type: ignore[attr-defined]
    for name in ("verdict", "added"):
        with pytest.raises(UsageError, match=f"{name} of a result: none in one of kind fit; expected tho?"):
            getattr(again, name)


def test_residuals_are_measured_minus_simulated_sample_by_sample(fit: Fit) -> None:
    frame = fit.residuals
    assert list(frame.columns) == ["record", "channel", "time", "phase", "measured", "simulated", "residual"]
    assert frame.attrs["units"] == {"force": "N", "position": "m"}
    assert len(frame) == sum(2 * len(record.time) for record in fit.records)
    force = frame[frame["channel"] == "force"]
    left = (force["measured"] - force["simulated"]) / fit.identification.gap["force"].noise
    # Samples beside a jump count less.
    assert np.median(np.abs(left - force["residual"])) < 1e-6
    assert {"held", "slack", "taut, loading"} <= set(frame["phase"])
    assert np.sqrt((frame["residual"] ** 2).mean()) == pytest.approx(1.0, abs=0.1)


def test_a_masked_sample_has_no_measurement(fit: Fit) -> None:
    groups = {name: dict(group) for name, group in fit.groups().items()}
    force = groups["observed_data"]["force"]
    holed = force.values.copy()
    holed[0, 7] = np.nan
    groups["observed_data"]["force"] = type(force)(holed, force.dims, force.unit, force.doc)
    from fibrefit.tables.frames import residual_frame

    row = residual_frame(groups, {}).query("channel == 'force'").iloc[7]
    assert np.isnan(row["measured"])
    assert np.isnan(row["residual"])
    assert np.isfinite(row["simulated"])


def test_the_arrays_are_a_tree_of_xarray(fit: Fit) -> None:
    tree = fit.to_datatree()
    assert {"estimate", "observed_data", "predictions", "residuals"} <= set(tree.children)
    assert tree["observed_data"]["force"].attrs["units"] == "N"
    assert tree["observed_data"]["force"].dims == ("record", "sample")
    assert tree.attrs["schema"] == "fibrefit/fit/1"


def test_a_value_of_a_record_in_a_folder_is_a_variable_of_the_tree() -> None:
    """As of a posterior in which one record states its release, and the other does not."""
    from fibrefit.tables.trees import tree_of

    names = ("release[data/a.csv]", "release[data_a.csv]", "stiffness")
    group = {name: Variable(np.full((2, 3), float(i)), ("chain", "draw"), "m") for i, name in enumerate(names)}
    tree = tree_of({"posterior": group}, {})
    found = {str(name): float(values[0, 0]) for name, values in tree["posterior"].data_vars.items()}
    assert found == {"release[data_a.csv]_": 0.0, "release[data_a.csv]": 1.0, "stiffness": 2.0}


def test_without_xarray_it_is_said_what_to_install(fit: Fit, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "fibrefit.tables.trees", raising=False)
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(UsageError, match=r"fibrefit\[arviz\]"):
        fit.to_datatree()


def test_two_lines_and_a_small_table(fit: Fit, again: StoredResult, study: Study) -> None:
    for one in (fit, again, study, study.records[0], fit.records[0]):
        assert len(repr(one).splitlines()) == 2
        assert max(map(len, repr(one).splitlines())) < 200
        assert one._repr_html_().startswith("<div><strong>")
    assert "lift 10 mm" in repr(study.records[1])
    assert repr(fit) == repr(again)
    assert f'Fit of "{study.name}": {fit.status}, gap ' in repr(fit)
    assert "<td>stiffness</td>" in fit._repr_html_()


def test_names_are_escaped_in_a_notebook(study: Study) -> None:
    odd = study.model_copy(update={"name": "<b>"})
    assert "<b>" not in odd._repr_html_()
    assert "&lt;b&gt;" in odd._repr_html_()


@pytest.mark.slow
def test_a_path_does_where_a_study_does(folder: Path, study: Study) -> None:
    by_path, by_study = fibrefit.simulate(folder), fibrefit.simulate(study)
    np.testing.assert_array_equal(by_path.readings["force"], by_study.readings["force"])


def test_inspections_are_read_again(folder: Path, tmp_path: Path) -> None:
    seen = fibrefit.inspect(folder)
    assert seen.to_dataframe()["si"].tolist() == ["N", "m"] * len(seen.seen)
    assert not seen.refusals
    seen.save(tmp_path / "seen")
    inspected = fibrefit.load_result(tmp_path / "seen")
    assert isinstance(inspected, StoredInspection)
    pd.testing.assert_frame_equal(inspected.to_dataframe(), seen.to_dataframe(), check_dtype=False)
    assert inspected.report() == seen.report()
    assert inspected.document() == json.loads(seen.content())
    assert len(repr(inspected).splitlines()) == len(repr(seen).splitlines()) == 2


def test_a_file_that_is_not_understood_is_told_and_not_raised(tmp_path: Path) -> None:
    (tmp_path / "odd.csv").write_text("no numbers at all\n", encoding="utf-8")
    seen = fibrefit.inspect(tmp_path / "odd.csv")
    assert [one.verdict for one in seen.seen] == ["not understood"]
    assert len(seen.refusals) == 1


def test_a_batch_is_a_table(folder: Path, tmp_path: Path) -> None:
    found = fibrefit.batch(folder, tmp_path / "each", starts=2, processes=1)
    assert found.folder == tmp_path / "each"
    table = fibrefit.read_batch(found.folder)
    assert list(table.index) == list(found.items)
    assert table["stiffness [N/m]"].notna().all()
    again = fibrefit.load_result(found.folder)
    assert isinstance(again, StoredResult)
    frame = again.to_dataframe()
    assert set(frame["record"]) == set(found.items)
    pd.testing.assert_frame_equal(frame, found.to_dataframe())
    with pytest.raises(UsageError, match="take to_dataframe|Take to_dataframe"):
        found.to_datatree()
    with pytest.raises(UsageError, match="none in one of kind batch"):
        found.residuals  # noqa: B018


@pytest.mark.parametrize("schema", sorted(EXAMPLES))
def test_every_kind_is_loaded_shown_and_told_again(schema: str, tmp_path: Path) -> None:
    (tmp_path / "summary.json").write_text(EXAMPLES[schema].model_dump_json(by_alias=True), encoding="utf-8")
    found = fibrefit.load_result(tmp_path)
    assert isinstance(found, StoredResult)
    assert found.kind == schema.split("/")[1]
    title, line = repr(found).splitlines()
    assert title.endswith(found.status) or f"{found.status}," in title
    assert line.strip() not in ("", "no parameters")
    assert found._repr_html_().startswith("<div><strong>")
    assert found.report().strip()
    assert len(found.to_dataframe()) > 0


@pytest.mark.slow
def test_effects_and_further_records_are_tables(folder: Path, tmp_path: Path) -> None:
    from fibrefit.workflow.design.plan import Aim

    told = fibrefit.distinguish(folder, only=["guide.viscous_friction", "fibre.hardening"])
    assert told.to_dataframe()["effect"].tolist() == [one.effect for one in told.confusion.directions]
    planned = fibrefit.plan(folder, Aim(only=("guide.viscous_friction",)))
    assert len(planned.to_dataframe()) == len(planned.further)
    assert {"like", "minutes", "error of stiffness"} <= set(planned.to_dataframe())
    for one in (told, planned):
        again = fibrefit.load_result(one.save(tmp_path / type(one).__name__))
        assert isinstance(again, StoredResult)
        assert repr(again) == repr(one)
        assert len(repr(one).splitlines()) == 2
        pd.testing.assert_frame_equal(again.to_dataframe(), one.to_dataframe())
        assert set(again.plot()) == set(one.plot())
        with pytest.raises(
            UsageError,
            match="predictions of a result: none in one of kind .*; expected those of fit, discover, predict",
        ):
            one.residuals  # noqa: B018


def test_what_is_no_result_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no result"):
        fibrefit.load_result(tmp_path)
    with pytest.raises(DataError, match="results.csv"):
        fibrefit.read_batch(tmp_path)
    for odd in ("x" * 300, "a\0b"):
        with pytest.raises(DataError, match="no result"):
            fibrefit.load_result(tmp_path / odd)
        with pytest.raises(DataError, match="results.csv"):
            fibrefit.read_batch(tmp_path / odd)


def test_items_of_a_batch_keep_their_names(tmp_path: Path) -> None:
    """Those that look like numbers or like what is true, and those of which a spreadsheet would make a formula."""
    names = ["001", "1", "01", "true", "nan", "=sum(A1)", "-drop", "'quoted", "drop, 5 mm"]
    table = csv_text([["item", "gap"], *([name, "1.5"] for name in names)])
    (tmp_path / "results.csv").write_text(table, encoding="utf-8")
    found = fibrefit.read_batch(tmp_path)
    assert list(found.index) == names
    assert found["gap"].tolist() == [1.5] * len(names)


@pytest.mark.parametrize(
    "content", [b"name,gap\na,1\n", b"item,gap\n\xff\xfe,1\n", b"", b'item,gap\n"a,1\n', b"item,gap\na,1\n,2\n"]
)
def test_what_is_no_table_of_a_batch_is_refused(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "results.csv").write_bytes(content)
    with pytest.raises(DataError, match=r"results.csv: no table of a batch: .*; expected what fibrefit has written"):
        fibrefit.read_batch(tmp_path)


def test_examples_come_by_name() -> None:
    assert {"drop_series", "second_fibre", "pendulum"} <= set(fibrefit.examples())
    assert fibrefit.load_study(fibrefit.example("drop_series")).kind == "fibre_mass"
    with pytest.raises(UsageError, match='Did you mean "drop_series"'):
        fibrefit.example("drop_serie")


def test_the_catalogue_is_data() -> None:
    found = fibrefit.effects()
    viscous = found["guide.viscous_friction"]
    assert viscous["parameters"][0]["unit"] == "N s/m"
    assert viscous["source"]
    json.dumps(found)


def test_the_text_of_a_fit_tells_what_was_counted(fit: Fit) -> None:
    counts = fit.summary().statistics
    assert counts is not None
    assert counts.samples == fit.identification.problem.n_measured
    assert counts.free_values == len(fit.values)
    assert counts.chi_square / counts.samples == pytest.approx(1.0, abs=0.1)
    assert counts.bic == pytest.approx(counts.chi_square + counts.free_values * np.log(counts.samples))
    assert f"{counts.free_values} free values: chi-square" in " ".join(fit.report().split())


def test_strong_correlations_are_told_and_weak_ones_not(fit: Fit) -> None:
    told = {pair.pair: pair.correlation for pair in fit.summary().correlations}
    shared, matrix = list(fit.parameters), fit.correlation
    for i, a in enumerate(shared):
        for b in shared[i + 1 :]:
            strong = abs(matrix.loc[a, b]) > 0.7
            assert ((a, b) in told) == strong
            assert not strong or told[a, b] == pytest.approx(matrix.loc[a, b])


def test_values_of_a_series_have_the_columns_of_any_values_and_its_conditions(tmp_path: Path) -> None:
    (tmp_path / "summary.json").write_text(EXAMPLES["fibrefit/series/1"].model_dump_json(by_alias=True))
    from_summary = fibrefit.load_result(tmp_path).to_dataframe()
    assert list(from_summary.columns)[: len(COLUMNS)] == COLUMNS
    tidy = {"record": ["a"], "parameter": ["damping"], "value": [10.0], "std_error": [1.0], "unit": ["N s/m"]}
    pd.DataFrame(tidy | {"lift [m]": [0.01]}).to_parquet(tmp_path / "table.parquet")
    told = fibrefit.load_result(tmp_path).to_dataframe()
    assert list(told.columns) == [*COLUMNS, "lift [m]"]
    assert told.loc[0, ["low", "high"]].tolist() == pytest.approx([8.04, 11.96], abs=1e-3)
    pd.DataFrame(tidy | {"std_error": [0.6], "common_error": [0.8]}).to_parquet(tmp_path / "table.parquet")
    told = fibrefit.load_result(tmp_path).to_dataframe()
    assert told.loc[0, ["low", "high"]].tolist() == pytest.approx([8.04, 11.96], abs=1e-3)
