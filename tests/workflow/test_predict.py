"""Values on records they were not found from: where they hold, where they do not, and where nothing can be said."""

from __future__ import annotations

import shutil
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import h5py
import numpy as np
import pytest

import fibrefit
from fibrefit.cli.main import run
from fibrefit.core.errors import DataError, StudyError, UsageError
from fibrefit.problem.diagnose.newton import ForceBalance
from fibrefit.store import read_result, read_summary, write_summary
from fibrefit.study import Study, load_study
from fibrefit.study.summaries.results import ChannelGap, PredictedChannel, PredictionSummary
from fibrefit.study.summaries.series import BatchSummary
from fibrefit.workflow.fit import Fit
from fibrefit.workflow.outcome.draw import draw_result
from fibrefit.workflow.prediction.files import _says
from fibrefit.workflow.prediction.known import known_from
from fibrefit.workflow.prediction.predict import (
    Prediction,
    _lacking,
    _refuse_other_constants,
    _with_values,
    predict_study,
)
from tests.fitting import made
from tests.workflow import axis

FEW_SAMPLES = 0.02
"""Share by which a count of samples may miss its expectation."""


def series(folder: Path, **options: float) -> Study:
    """Two drops from other lifts than those of the fit."""
    lifts = (7e-3, 1.4e-2)
    study = made.study(folder, lifts)
    made.write(folder, made.records(lifts, seed=9, share=0.5, **options))
    return study


@pytest.fixture(scope="module")
def predicted(fit: Fit, tmp_path_factory: pytest.TempPathFactory) -> Prediction:
    return fit.predict(series(tmp_path_factory.mktemp("new")))


def test_values_hold_for_records_of_the_same_rig(predicted: Prediction) -> None:
    summary = predicted.summary()
    assert (summary.status, summary.verdict) == ("ok", "holds")
    for channel, noise in made.NOISE.items():
        told = summary.channels[channel]
        assert told.rms == pytest.approx(noise, rel=0.1)
        # Two records that agree leave open that a third one differs.
        assert noise < told.expected < 1.25 * noise
        assert 0.95 - FEW_SAMPLES < told.inside < 0.99
        assert told.explained is not None
        assert 0.99 < told.explained < 1.0


def test_zero_and_start_are_found_and_nothing_else(predicted: Prediction, fit: Fit) -> None:
    summary = predicted.summary()
    for record in summary.records.values():
        assert set(record.parameters) == set(made.NUISANCES)
        for name, value in made.NUISANCES.items():
            assert record.parameters[name].value == pytest.approx(value, abs=2e-5)
    assert {name: told.value for name, told in summary.parameters.items()} == {
        name: estimate.value for name, estimate in fit.parameters.items()
    }


def test_values_do_not_hold_for_another_fibre(fit: Fit, tmp_path: Path) -> None:
    summary = fit.predict(series(tmp_path, stiffness=1.03 * made.TRUTH["stiffness"])).summary()
    assert (summary.status, summary.verdict) == ("suspect", "does_not_hold")
    assert {check.identifier for check in summary.checks if not check.passed} == {
        "force_predicted",
        "position_predicted",
    }
    assert "do not hold" in summary.says
    assert any("discover" in advice for advice in summary.advice)
    # A band that takes what is missing for noise would hold it; this one does not.
    assert summary.channels["position"].inside < 0.9


def test_records_of_the_fit_are_no_prediction(saved: Path, study: Study) -> None:
    summary = predict_study(saved, study).summary()
    assert (summary.status, summary.verdict) == ("suspect", "not_trusted")
    assert "served to find the values" in summary.says


def test_records_of_the_fit_are_known_in_every_part_and_when_they_are_gone(
    fit: Fit, folder: Path, tmp_path: Path
) -> None:
    """What counts is what was read, of every file of a record."""
    place = Path(shutil.copytree(folder, tmp_path / "again"))
    again = load_study(place)
    parts = [place / record.file for record in again.records]
    found = fit.predict(again)
    own = [
        record.model_copy(update={"file": f"new_{record.file}", "parts": (record.file,)}) for record in again.records
    ]
    continued = replace(found, study=again.model_copy(update={"records": tuple(own)}))
    for file in parts:
        file.unlink()
    for one in (found, continued):
        assert one.verdict == "not_trusted"
        (check,) = (check for check in one.summary().checks if check.identifier == "new_records")
        assert check.facts["records"] == tuple(record.label for record in one.study.records)


def test_a_force_that_nothing_is_known_of_is_not_said_to_be_as_predicted(predicted: Prediction) -> None:
    """As of a posterior, which does not say what it left of a force that drives the rig."""
    before = {check.identifier: check.statistic for check in predicted.summary().checks}
    pushed = replace(predicted, known=replace(predicted.known, gaps={}), force=ForceBalance(3.0, 0.1, 0.9))
    told = pushed.summary()
    assert {check.identifier: check.statistic for check in told.checks} == before
    assert (told.channels["force"].rms, told.channels["force"].expected) == (3.0, None)


def test_what_a_model_lacked_may_be_missing_in_new_records(predicted: Prediction) -> None:
    """It left 1.5 times the noise of its own records."""
    channels = predicted.summary().channels
    gaps = {name: ChannelGap.against_noise(one, 1.5 * one, channels[name].unit) for name, one in made.NOISE.items()}
    known = replace(predicted.known, gaps=gaps)
    told = replace(predicted, known=known).summary().channels
    for channel, noise in made.NOISE.items():
        assert told[channel].fit_rms == pytest.approx(1.5 * noise)
        assert _lacking(known, channel) == pytest.approx((1.5**2 - 1.0) * noise**2)
    assert _lacking(replace(known, gaps={}), "force") == 0.0


def test_a_value_a_rounding_error_beyond_its_range_is_predicted_with(predicted: Prediction) -> None:
    model = predicted.task.problem.model
    declared = {parameter.name: parameter for parameter in model.parameters}
    friction = predicted.known.parameters["friction"].model_copy(update={"value": -1e-18})
    known = replace(predicted.known, parameters={**predicted.known.parameters, "friction": friction})
    settings = _with_values(predicted.study, known).settings(declared)
    assert settings["friction"].initial == declared["friction"].lower == 0.0


def test_the_band_is_as_wide_as_the_error_bars_ask_for(predicted: Prediction) -> None:
    """Against differences: one value moved by its error bar, zero and release fitted anew."""
    known = predicted.known
    wide = np.zeros_like(known.covariance)
    place = known.names.index("stiffness")
    step = 2e-3 * known.parameters["stiffness"].value
    wide[place, place] = step**2
    told = predict_study(replace(known, covariance=wide), predicted.study)
    moved = dict(known.parameters)
    moved["stiffness"] = moved["stiffness"].model_copy(update={"value": moved["stiffness"].value + step})
    other = predict_study(replace(known, parameters=moved), predicted.study)
    for c, channel in enumerate(("force", "position")):
        difference = other.seen.motion.readings[channel] - told.seen.motion.readings[channel]
        for r in range(2):
            inside = slice(0, made.SAMPLES)
            expected = np.sqrt(np.mean(told.sigma("values")[r, c, inside] ** 2))
            assert np.sqrt(np.mean(difference[r, inside] ** 2)) == pytest.approx(expected, rel=0.1)


def test_files_and_report(predicted: Prediction, tmp_path: Path) -> None:
    out = predicted.save(tmp_path / "out")
    summary = read_summary(out)
    assert isinstance(summary, PredictionSummary)
    assert summary.verdict == "holds"
    groups, attributes = read_result(out / "result.h5")
    assert attributes["schema"] == "fibrefit/prediction/1"
    assert groups["predictions"]["force_sd"].unit == "N"
    for name in ("force", "force_sd", "force_model_sd"):
        values = groups["predictions"][name].values
        assert np.isfinite(values[:, : made.SAMPLES]).all()
        assert np.isnan(values[:, made.SAMPLES :]).all()
    left = groups["observed_data"]["position"].values - groups["predictions"]["position"].values
    table = fibrefit.load_result(out).residuals
    own = table[table["channel"] == "position"]
    noise = np.nanmax(left[np.isfinite(left)] / own["residual"].dropna().to_numpy())
    assert noise > 0.0
    np.testing.assert_allclose(own["residual"].dropna() * noise, left[np.isfinite(left)], rtol=1e-6)
    assert table.groupby("channel", observed=True)["residual"].std().between(0.8, 1.2).all()
    assert len(list((out / "figures").glob("*.png"))) == 2
    assert list(draw_result(out)) == list(predicted.plot()) != []
    assert load_study(out).parameters["stiffness"].initial is not None
    text = predicted.report()
    assert max(map(len, text.splitlines())) <= 80
    for said in ("HOLDS", "explained", "in band", "position zero and", "none of them was fitted here"):
        assert said in text


def test_the_command(saved: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    series(tmp_path / "new")
    words = ("predict", str(saved), str(tmp_path / "new"), "--out", str(tmp_path / "out"))
    assert run(words) == 0
    assert "HOLDS" in capsys.readouterr().out
    assert run(("show", str(tmp_path / "out"))) == 0
    assert "HOLDS" in capsys.readouterr().out
    assert run(("report", str(tmp_path / "out"), "--out", str(tmp_path / "page.html"))) == 0
    assert "The values hold for these records" in (tmp_path / "page.html").read_text(encoding="utf-8")
    assert run(words) == 2
    told = read_summary(tmp_path / "out").provenance.inputs
    for name in ("summary.json", "result.h5", "study.toml"):
        assert told[(saved / name).as_posix()] == sha256((saved / name).read_bytes()).hexdigest()


def test_a_result_that_was_handed_on_is_predicted_from(saved: Path, predicted: Prediction, tmp_path: Path) -> None:
    """Without the records it was found from, which nothing is read from."""
    alone = Path(shutil.copytree(saved, tmp_path / "elsewhere" / "result"))
    with pytest.raises(StudyError, match="no folder for|no file"):
        load_study(alone)
    handed = known_from(alone)
    assert handed.parameters == known_from(saved).parameters
    assert handed.digests == known_from(saved).digests
    assert run(("predict", str(alone), str(predicted.study.source), "--out", str(tmp_path / "out"))) == 0


def test_a_result_that_is_not_there_is_told_with_its_neighbour(
    saved: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Though there is a result in the folder it would lie in."""
    series(tmp_path / "new")
    wrong = saved / "sumary.json"
    assert run(("predict", str(wrong), str(tmp_path / "new"), "--out", str(tmp_path / "out"))) == 3
    assert f'{wrong}: no such file or folder; expected the folder of a result. Did you mean "summary.json"?' in (
        capsys.readouterr().err
    )


def test_a_constant_that_is_stated_otherwise_is_refused(predicted: Prediction) -> None:
    """What was found of one mass is nothing that another record has."""
    unsure = predicted.known.study.model_copy(update={"parameters": {"weight_mass": None}})
    assert unsure.found_constants == {"weight_mass": made.MASS}
    known = replace(predicted.known, study=unsure)
    study = predicted.known.study
    _refuse_other_constants(study, known)
    rig = study.rig.model_copy(update={"weight_mass": 5.0})
    with pytest.raises(StudyError, match="another value than in .*, where it is a parameter of the model") as told:
        _refuse_other_constants(study.model_copy(update={"rig": rig}), known)
    assert told.value.where.endswith("rig.weight_mass")
    _refuse_other_constants(study.model_copy(update={"rig": rig}), predicted.known)  # nothing of it was found


def test_the_result_that_is_predicted_from_is_not_replaced(
    saved: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nor is a posterior that another one is to be compared with, whatever is forced."""
    series(tmp_path / "new")
    before = (saved / "summary.json").read_bytes()
    for words in (("predict", saved, tmp_path / "new"), ("sample", tmp_path / "new", "--compare", saved)):
        assert run([*map(str, words), "--out", str(saved), "--force"]) == 2
        assert f"{saved}: holds {saved}/summary.json, which is read" in capsys.readouterr().err
    assert (saved / "summary.json").read_bytes() == before


def test_a_channel_that_its_mean_predicts_better_has_no_share_explained() -> None:
    channels = {
        "force": PredictedChannel(rms=12.0, unit="N", explained=-3.2),
        "position": PredictedChannel(rms=1e-4, unit="m", explained=0.9),
    }
    assert _says("does_not_hold", channels, ()) == (
        "The values do not hold for these records: they explain less of the force than its mean does, within 12 N rms "
        "and 90.0 % of the position, within 100 um rms."
    )


def test_a_result_without_its_arrays_is_refused(saved: Path, tmp_path: Path, predicted: Prediction) -> None:
    """As of another version, or damaged."""
    shutil.copytree(saved, tmp_path / "result")
    with h5py.File(tmp_path / "result" / "result.h5", "a") as file:
        del file["estimate"]
    with pytest.raises(DataError, match='result.h5: a result.h5 without the group "estimate"; expected one with all'):
        predict_study(tmp_path / "result", predicted.study)


def test_refusals(fit: Fit, predicted: Prediction, saved: Path, tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="a guided_mass; expected a fibre_mass"):
        predict_study(saved, load_study(axis.write(tmp_path, (), seconds=1.0)))
    out = predicted.save(tmp_path / "out")
    with pytest.raises(UsageError, match="a result without values of a model"):
        predict_study(out, predicted.study)
    write_summary(tmp_path, BatchSummary(status="ok", name="many", items={}))
    with pytest.raises(UsageError, match="a result without values of a model"):
        predict_study(tmp_path, predicted.study)
    item = tmp_path / "item"
    item.mkdir()
    (item / "summary.json").write_bytes((saved / "summary.json").read_bytes())
    with pytest.raises(UsageError, match="as batch keeps it; expected one with its result.h5"):
        predict_study(item, predicted.study)
