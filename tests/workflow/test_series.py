"""A series asked whether one set of parameters serves all speeds: a law that is there, and none where there is none."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from types import SimpleNamespace

import jsonschema
import numpy as np
import pandas
import pytest
from click.testing import CliRunner

from fibrefit.cli.main import group
from fibrefit.core.errors import StudyError
from fibrefit.core.limits import quiet
from fibrefit.discovery.comparison import Comparison
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.secant import SecantGram
from fibrefit.laws.functions_of_speed import DampingSpeedExponent
from fibrefit.problem.estimate.evidence import MarginalLikelihood
from fibrefit.problem.estimate.gauss_newton import mode
from fibrefit.report.any import report_of
from fibrefit.series import speed_models as models
from fibrefit.series.speed_laws import LAWS
from fibrefit.series.speed_models import SpeedSearch
from fibrefit.store.summary import read_summary
from fibrefit.study import load_study
from fibrefit.study.summaries.part import Z_95
from fibrefit.study.summaries.series import SeriesSummary
from fibrefit.workflow.outcome.stored import load_result
from fibrefit.workflow.together.series import SeriesResult, series_study
from fibrefit.workflow.together.words import _constant
from tests.fitting import made

LIFTS = (5e-3, 1e-2, 1.6e-2, 2e-2)
EXPONENT = -0.31
SCHEMA = Path(__file__).resolve().parents[2] / "data_schemas" / "series.schema.json"


def asked(folder: Path, seed: int, effects: tuple = (), **values: float) -> SeriesResult:
    study = made.study(folder, LIFTS)
    made.write(folder, made.records(LIFTS, seed=seed, effects=effects, **values))
    return series_study(study)


@pytest.fixture(scope="module")
def lawful(tmp_path_factory: pytest.TempPathFactory) -> SeriesResult:
    """A series whose damping falls with a power of speed."""
    name = DampingSpeedExponent.name.replace(".", "__")
    return asked(tmp_path_factory.mktemp("lawful"), 7, (DampingSpeedExponent,), **{f"{name}__exponent": EXPONENT})


@pytest.fixture(scope="module")
def saved(lawful: SeriesResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its result on disk."""
    return lawful.save(tmp_path_factory.mktemp("result") / "out")


def test_the_law_is_found_and_preferred_on_records_left_out(lawful: SeriesResult) -> None:
    assert lawful.answer == "speed_law"
    assert lawful.verdict.models.law.names == (DampingSpeedExponent.name,)
    found, error = (
        getattr(lawful.verdict.best, key)[f"{DampingSpeedExponent.name}.exponent"] for key in ("shared", "errors")
    )
    assert abs(found - EXPONENT) < 4.0 * error
    left = lawful.verdict.left_out
    assert left["speed_law"].elpd.sum() > left["constant"].elpd.sum() + 5.0
    assert left["speed_law"].gap < left["constant"].gap
    assert lawful.verdict.gaps["speed_law"] == pytest.approx(1.0, abs=0.05)


def test_the_sentence_has_the_numbers(lawful: SeriesResult) -> None:
    said = lawful.sentence
    assert said.startswith("One set of parameters does not serve all speeds: damping falls from ")
    for part in ("power law of exponent -0.3", "one model serves all 4 records", "stiffness and friction need no law"):
        assert part in said, part


def test_the_curve_holds_the_truth(lawful: SeriesResult) -> None:
    (curve,) = lawful.verdict.curves
    truth = made.TRUTH["damping"] * (curve.speeds / 0.1) ** EXPONENT
    inside = (curve.low <= truth * 1.02) & (truth * 0.98 <= curve.high)
    assert inside[curve.speeds > 0.02].all()


def test_the_result_is_for_programs_and_for_persons(lawful: SeriesResult, saved: Path) -> None:
    content = json.loads((saved / "summary.json").read_text(encoding="utf-8"))
    jsonschema.validate(content, json.loads(SCHEMA.read_text(encoding="utf-8")))
    assert content["answer"] == "speed_law"
    assert content["models"]["constant"]["log_bayes_factor"] == 0.0
    summary = read_summary(saved)
    assert isinstance(summary, SeriesSummary)
    text = report_of(summary)
    assert text == lawful.report()
    assert max(map(len, text.splitlines())) <= 80
    with (saved / "table.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(LIFTS) * 3
    assert float(rows[0]["lift [m]"]) == LIFTS[0]
    # An interval holds what all records share of the error, too.
    frame = lawful.to_dataframe()
    half, both = 0.5 * (frame["high"] - frame["low"]), np.hypot(frame["std_error"], frame["common_error"])
    np.testing.assert_allclose(half, Z_95 * both)
    pandas.testing.assert_frame_equal(
        pandas.read_parquet(saved / "table.parquet"), pandas.read_csv(saved / "table.csv"), rtol=1e-8, check_dtype=False
    )
    assert {path.stem for path in (saved / "figures").glob("*.png")} == {"answer", "population", "trends"}
    pandas.testing.assert_frame_equal(lawful.to_dataframe(), load_result(saved).to_dataframe())


def test_the_study_of_the_winning_model_begins_at_its_values(lawful: SeriesResult, saved: Path) -> None:
    study = load_study(saved / "study.toml")
    assert study.model.effects == (DampingSpeedExponent.name,)
    initial = study.parameters[f"{DampingSpeedExponent.name}.exponent"].initial
    assert initial == pytest.approx(lawful.verdict.best.shared[f"{DampingSpeedExponent.name}.exponent"])
    with pytest.raises(StudyError, match="a model with a law of speed"):
        series_study(study)


def test_the_command_shows_a_result_again(saved: Path) -> None:
    shown = CliRunner().invoke(group, ["show", str(saved)], standalone_mode=False)
    assert shown.exit_code == 0, shown.output
    assert "One set of parameters does not serve all speeds" in " ".join(shown.output.split())


@pytest.mark.slow
def test_where_there_is_no_law_none_is_preferred(tmp_path: Path) -> None:
    found = asked(tmp_path, 8)
    assert found.answer == "constant"
    assert found.verdict.logs["speed_law"] < 0.0
    assert "serves all 4 records" in found.sentence
    assert np.isfinite(found.verdict.models.law.evidence.spread).all()
    assert max(map(len, found.report().splitlines())) <= 80
    table_agrees(found)


def table_agrees(found: SeriesResult) -> None:
    """The law of the sentence has the same number in the table; a promise is told as one, and has no values."""
    effects = found.verdict.models.law.names
    rows = {law.effect: law for law in found.summary().laws}
    assert len(rows) == len(found.verdict.models.tried)
    (mine,) = (rows[name] for name in effects)
    assert mine.log_bayes_factor == found.verdict.logs["speed_law"]
    assert not mine.linearised
    assert all(row.linearised == (not row.parameters) for row in rows.values())
    assert any(row.linearised for row in rows.values())
    assert "predicted by linearisation" in found.report()


def test_the_table_of_laws_says_what_the_sentence_says(lawful: SeriesResult) -> None:
    table_agrees(lawful)


def test_a_law_that_stood_in_for_another_one_is_left_out_once_that_is_found(
    lawful: SeriesResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Damping with a free curve, then friction with a power: with friction's law the curve says nothing more."""
    found = lawful.verdict.models
    search, base, true = found.search, found.constant, found.law
    later = next(law.effect for law in LAWS if law.parameter == "friction")
    # The true law, found after one of the friction, of which there is none.
    stand_in = search.inference.absent(base, true.supermodel, (later,), 10.0)
    both = search.inference.fitted(
        true.supermodel, (later, *true.effects), true.local, true.evidence.mode.sigma, true.evidence.mode.place.eta
    )
    rounds = iter([(stand_in,), (both,), ()])
    seen = []

    def compared(search: SpeedSearch, parent: LaplaceFit, what: str) -> Comparison:
        seen.append(parent.names)
        return Comparison(search, parent, next(rounds))

    monkeypatch.setattr(models, "comparison_of", compared)
    _, law, rivals = models._grown(search, base, quiet)
    assert seen == [(), (later.name,), true.names]
    assert law.names == true.names
    assert rivals == (both,)


def test_a_law_that_slopes_promise_nothing_of_is_told_at_its_mode(
    lawful: SeriesResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = lawful.verdict.models
    inference, effects = found.search.inference, found.law.effects[:1]
    blank = inference.absent(found.constant, found.law.supermodel, effects, -1.0)
    assert not np.isfinite(blank.evidence.spread).any()
    monkeypatch.setattr(models, "comparison_of", lambda search, parent, what: Comparison(search, parent, (blank,)))
    _, told, _ = models._grown(found.search, found.constant, quiet)
    assert np.isfinite(told.evidence.spread).all()
    assert told.log > found.constant.log


@pytest.mark.parametrize(
    ("more", "match"),
    [
        ("[parameters.damping]\nshared = false", "damping fixed, or not shared"),
        ("[parameters.damping]\nfixed = true\ninitial = '25 N s/m'", "damping fixed, or not shared"),
    ],
)
def test_what_is_not_to_be_asked_is_refused(tmp_path: Path, more: str, match: str) -> None:
    study = made.study(tmp_path, LIFTS, more)
    made.write(tmp_path, made.records(LIFTS, seed=1))
    with pytest.raises(StudyError, match=match):
        series_study(study)


@pytest.mark.parametrize(
    ("log", "says"),
    [
        (2.0, "has a logarithm of the Bayes factor of 2; it would need 5."),
        (12.0, "of 12; but it predicts records left out no better: their log density changes by -1.5."),
    ],
)
def test_the_reason_why_no_law_is_preferred_is_the_one_that_decided(log: float, says: str) -> None:
    rows = np.array([[0.1, 0.2, 0.3]])
    elpd = {"constant": [4.0, 2.0], "speed_law": [3.0, 1.5]}
    found = SimpleNamespace(
        speeds={"damping": rows},
        models=SimpleNamespace(law=SimpleNamespace(effects=(DampingSpeedExponent,))),
        gaps={"constant": 1.0},
        left_out={name: SimpleNamespace(gap=1.0, elpd=np.array(values)) for name, values in elpd.items()},
        logs={"speed_law": log},
        populations={},
    )
    assert says in _constant(found, 5)  # type: ignore[arg-type]


def test_two_records_are_no_series(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="a series of 3 or more"):
        series_study(made.study(tmp_path))


def test_a_rig_of_which_no_law_is_known_is_refused(tmp_path: Path) -> None:
    times = np.arange(0.0, 6.0, 5e-3)
    head = 'schema = "fibrefit/study/1"\nname = "swings"\n[rig]\nkind = "pendulum"\nmoment_of_inertia = "0.2 kg m^2"\n'
    for i in range(3):
        table = np.column_stack([times, 0.2 * np.exp(-0.1 * times) * np.cos(5.7 * times + 0.1 * i)])
        np.savetxt(tmp_path / f"{i}.csv", table, "%.6f", ",", header="time [s],angle [rad]", comments="")
        head += f'[[records]]\nfile = "{i}.csv"\n'
    (tmp_path / "study.toml").write_text(head, encoding="utf-8")
    with pytest.raises(StudyError, match="the rig pendulum; expected one with a fibre or a guide"):
        series_study(load_study(tmp_path / "study.toml"))


def test_what_the_others_say_without_a_record_is_where_they_lead_by_themselves(lawful: SeriesResult) -> None:
    found = lawful.verdict.models
    at, whole = found.law.evidence.mode, found.search.context.whole
    for r in range(len(LIFTS)):
        gram = SecantGram(
            found.search.inference.common_noise.whitened(found.law.supermodel),
            np.where(np.arange(len(LIFTS)) == r, 0, whole),
        )
        alone = MarginalLikelihood.of(mode(at.unknowns, at.place, gram, at.sigma))
        said = found.law.log - lawful.verdict.left_out["speed_law"].elpd[r]
        assert said == pytest.approx(alone.log, abs=0.5)


def test_constant_parameters_beside_a_law_are_no_worse_than_the_law_left_out_at_once(lawful: SeriesResult) -> None:
    found = lawful.verdict.models
    inference, at_once = found.search.inference, found.search.inference.without(found.law, ())
    assert inference.without_by_continuation(found.law, ()).log > at_once.log - 0.5
    assert found.constant.log > at_once.log - 0.5
