"""The report fits the terminal, says what matters, and shows only digits that mean something."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fibrefit.fitting.result import Starts
from fibrefit.plots import overview
from fibrefit.problem.estimate.evidence import _level_at, grid_over, usual_axes
from fibrefit.report.any import report_of
from fibrefit.report.checks import MOST_NOTES, failures, notes_on_records, quantity_of
from fibrefit.report.layout import WIDTH, shortened_names
from fibrefit.report.page import Result, page
from fibrefit.report.page.fit import fit_page
from fibrefit.report.pooled import trend_sentences
from fibrefit.report.prediction import prediction_report
from fibrefit.report.sentences.alike import RECORDS_AGREE, between_sentence, taken_alike_sentence
from fibrefit.report.sentences.thresholds import SMALL_DIFFERENCE
from fibrefit.report.sweep import sweep_report
from fibrefit.report.text import (
    fit_report,
    parameter_row,
    prior_sentences,
    quantity_text,
    with_error,
)
from fibrefit.study.summaries import results as s
from fibrefit.study.summaries.check import SIZE, Check
from fibrefit.study.summaries.results import InputErrorSummary, PredictedChannel
from fibrefit.study.summaries.series import TrendSummary
from fibrefit.workflow.fit_files import starts_summary
from tests.study.test_summaries import CONDITIONS, EXAMPLES, FIT, GAP

FAILED = Check(
    name="the gap is noise",
    passed=False,
    quantity="residual size",
    says="Something systematic is left after take-up.",
)


def suspect() -> s.FitSummary:
    long = "guide.asymmetric_viscous_friction.viscous_asymmetry"
    return FIT.model_copy(
        update={
            "study": "a name that goes on " * 10,
            "status": "suspect",
            "parameters": {
                "stiffness": s.ParameterSummary(
                    value=11150.6, std_error=4.2, interval_95=(11142.0, 11159.0), unit="N/m"
                ),
                "damping": s.ParameterSummary(value=9.4, unit="N s/m", std_error=None),
                "friction": s.ParameterSummary(value=2.5, unit="N", free=False),
                long: s.ParameterSummary(value=0.0, std_error=0.2, interval_95=(0.0, 0.4), unit="-", at_bound=True),
            },
            "records": {f"record_{i}_{'x' * 60}.csv": s.RecordSummary(gap=GAP, masked=i) for i in range(20)},
            "checks": (*FIT.checks, FAILED),
            "starts": s.StartsSummary(
                tried=32, agreeing=20, basins=(s.Basin(cost=0.0, starts=20), s.Basin(cost=7.5, starts=12))
            ),
            "error_method": "newey_west",
            "error_inflation": 2.5,
            "findings": ("Only the product of mass and gain is determined. " * 3,),
            "advice": ("Run fibrefit discover on this study: it looks for what the model lacks, and says so.",),
            "effects": ("guide.asymmetric_viscous_friction",),
        }
    )


def test_it_fits_80_columns_of_ascii() -> None:
    for summary in (FIT, suspect()):
        text = fit_report(summary)
        assert max(map(len, text.splitlines())) <= WIDTH
        assert text.isascii()


def test_it_says_what_matters() -> None:
    text = " ".join(fit_report(suspect()).split())
    for part in (
        "SUSPECT",
        "11.1506 0.0042 kN/m",
        "11.1420 to 11.1590",
        "not determined",
        "held",
        "at most 0.40",
        "FAILED residual size: Something systematic",
        "2.5 times as wide",
        "Multistart: 20 of 32 starts reached the best minimum; 1 local minimum: cost x 8.5 (12 starts).",
        "Gap: normalised residual RMS",
        "Terms: fibrefit glossary.",
        "and 8 more",
        "What to do next",
        "Newey-West",
    ):
        assert part in text, part


def test_a_value_at_a_bound_has_the_other_end_of_its_interval() -> None:
    low = s.ParameterSummary(value=0.0, std_error=0.2, interval_95=(0.0, 0.4), unit="N", at_bound=True)
    assert parameter_row("friction", low) == ("friction", "0.00", "0.20", "N", "at most 0.40")
    high = s.ParameterSummary(value=20.0, std_error=0.5, interval_95=(19.0, 20.0), unit="N s/m", at_bound=True)
    assert parameter_row("damping", high)[-1] == "at least 19.00"
    blind = s.ParameterSummary(value=0.0, unit="N", at_bound=True)
    assert parameter_row("friction", blind)[-1] == "at its bound"


def test_values_that_each_record_has_for_itself_stand_in_a_table() -> None:
    own = s.ParameterSummary(value=25.0, std_error=0.4, interval_95=(24.2, 25.8), unit="N s/m", interval_kind="record")
    zero = own.model_copy(update={"unit": "m"})
    records = {
        f"fall_{i}.csv": s.RecordSummary(gap=GAP, parameters={"damping": own, "position_zero": zero}) for i in range(14)
    }
    found = FIT.model_copy(update={"records": records, "own_parameters": ("damping",)})
    lines = [" ".join(line.split()) for line in fit_report(found).splitlines()]
    head = lines.index("damping of value +/- unit 95 % interval")
    assert lines[head + 1] == "fall_0 25.00 0.40 N s/m 24.20 to 25.80"
    assert "and of 2 more, as summary.json lists them." in lines
    assert not any("position_zero" in line for line in lines)
    tables = {getattr(block, "heading", ""): block for block in fit_page(Result("folder", found)).blocks}
    assert len(tables["damping of each record"].rows) == 14  # type: ignore[union-attr]


def test_what_was_taken_to_be_the_same_in_all_records_is_told() -> None:
    free = s.ParameterSummary(value=1.0, std_error=0.1, interval_95=(0.8, 1.2), unit="N")
    held = s.ParameterSummary(value=1.0, unit="N", free=False)
    between = {"stiffness": s.BetweenRecordsSummary(sd=0.0, interval_95=(0.0, 0.001), agree=0.9, rms=0.0)}
    several = {name: s.RecordSummary(gap=GAP) for name in ("a.csv", "b.csv")}
    named = {"stiffness": free, "damping": free, "friction": free, "mass": held}
    found = FIT.model_copy(update={"parameters": named, "records": several, "between_records": between})
    assert taken_alike_sentence(found) == (
        "Taken to be the same in all records: damping and friction. Differences between records in these were not "
        "looked for, and no interval allows for them."
    )
    assert taken_alike_sentence(found) in " ".join(fit_report(found).split())
    plain = found.model_copy(update={"between_records": {}})
    assert taken_alike_sentence(plain).startswith(
        "Taken to be the same in all records: stiffness, damping and friction."
    )
    asked = next(check for check in FIT.checks).model_copy(update={"identifier": RECORDS_AGREE})
    looked_at = taken_alike_sentence(plain.model_copy(update={"checks": (asked,)}))
    assert looked_at.endswith("Whether single records ask for other values was looked at; no interval allows for it.")
    both = dict.fromkeys(("stiffness", "damping", "friction"), between["stiffness"])
    assert taken_alike_sentence(found.model_copy(update={"between_records": both})) == ""
    one = found.model_copy(update={"records": {"a.csv": several["a.csv"]}, "between_records": {}})
    assert taken_alike_sentence(one).startswith("There is one record: values and intervals are those of this record")
    assert taken_alike_sentence(one.model_copy(update={"parameters": {"mass": held}})) == ""


def test_it_says_what_was_taken_off_an_input() -> None:
    errors = {"drive": InputErrorSummary(rms=5.8e-6, noise=1.05e-5, unit="m")}
    said = " ".join(fit_report(FIT.model_copy(update={"expected_gap": 0.946, "input_errors": errors})).split())
    assert "The measured drive was corrected by 5.8 um rms (errors in variables); its noise is 10 um." in said
    assert "the expected gap of a perfect model is 0.95" in said.lower()
    looked_for = {"drive": errors["drive"].model_copy(update={"looked_for": 6e-6})}
    told = " ".join(fit_report(FIT.model_copy(update={"input_errors": looked_for})).split())
    assert "its noise is 10 um, 6 um of it where errors are looked for." in told
    assert "perfect model" not in fit_report(FIT)


@pytest.mark.parametrize("kind", ["population", "normal", "profile likelihood"])
@pytest.mark.parametrize("schema", ["fibrefit/fit/1", "fibrefit/discovery/1", "fibrefit/prediction/1"])
def test_what_is_the_mean_of_a_population_is_marked_in_every_report(schema: str, kind: str) -> None:
    """Beside it stands what all records share."""
    differs = EXAMPLES[schema].parameters["stiffness"].model_copy(update={"interval_kind": kind})  # type: ignore[attr-defined]
    parameters = {"stiffness": differs, "friction": differs.model_copy(update={"interval_kind": "normal"})}
    summary = EXAMPLES[schema].model_copy(update={"parameters": parameters})
    whose = "marked (mean) are those of the mean of the population of records"
    for text in (report_of(summary), page([Result("results/a", summary)], "one")):
        assert ("stiffness (mean)" in text) == (kind == "population")
        assert (whose in " ".join(text.split())) == (kind == "population")
        assert "friction (mean)" not in text
    assert max(map(len, report_of(summary).splitlines())) <= WIDTH


def test_a_clean_result_raises_no_doubt() -> None:
    text = fit_report(FIT)
    assert "OK" in text.splitlines()[0]
    assert "All checks passed: residuals are white." in text
    assert "What to do next" not in text


def test_a_fit_within_its_noise_is_not_said_to_leave_more_than_noise() -> None:
    """A check of the model that failed for another reason than the size of what is left."""
    level = Check(
        name="noise level", passed=False, says="The records hold no rest.", about="model", identifier="noise_level"
    )
    size = level.model_copy(update={"name": "the gap is noise", "identifier": "residual_size"})
    for lacking, says in (((level,), "no larger than the noise"), ((level, size), "more than the noise")):
        text = fit_report(FIT.model_copy(update={"checks": (*FIT.checks, *lacking)}))
        assert f"What is left is {says}" in " ".join(text.split())


def test_error_bars_are_said_to_allow_for_a_gap_only_where_they_do() -> None:
    """Those of the likelihood do not: the report would say in one place that they do, in another that they cannot."""
    lacks = Check(name="x", passed=False, identifier=SIZE, quantity="residual size", about="model")
    for method, said, drawn in (
        ("discrepancy", "error bars allow for it, and the model lacks something.", "The error bars allow for what is"),
        ("whitened", "more than the noise (1.3 times it): the model lacks something.", "What is left is more than"),
    ):
        found = FIT.model_copy(update={"checks": (*FIT.checks, lacks), "error_method": method})
        assert said in " ".join(fit_report(found).split())
        assert overview._verdict(found).startswith(drawn)


def test_records_that_tell_nothing_of_their_differences_are_not_told_to_agree() -> None:
    """What the prior alone leaves is an upper end, and no finding; it is a small one that is."""
    grid, prior = grid_over(usual_axes(1))
    _, _, top = (_level_at(grid[:, 0], np.exp(prior), share) for share in (0.025, 0.5, 0.975))
    assert top == pytest.approx(10.0 * SMALL_DIFFERENCE, rel=0.05)
    nothing = s.BetweenRecordsSummary(sd=0.0, interval_95=(0.0, top), agree=0.51)
    little = s.BetweenRecordsSummary(sd=0.0, interval_95=(0.0, 0.001), agree=0.97)
    apart = s.BetweenRecordsSummary(sd=0.01, interval_95=(0.005, 0.03), agree=0.0)
    said = "Between records: stiffness: no difference found; up to 7.3 % is not excluded."
    assert between_sentence({"stiffness": nothing, "damping": little}) == said
    both = between_sentence({"stiffness": nothing, "friction": apart})
    assert both.startswith(
        f"{said} friction differs by 1 % (95 %: 0.5 to 3 %) from record to record, beyond its error. "
    )
    assert both.endswith("as wide as so few records ask for.")
    assert between_sentence({"damping": little}) == "Between records: no difference beyond the errors."


def test_a_result_that_failed_says_so_first() -> None:
    text = fit_report(FIT.model_copy(update={"status": "failed"}))
    assert text.splitlines()[3].startswith("Do not use these numbers")


@pytest.mark.parametrize(
    ("value", "error", "unit", "expected"),
    [
        (34213.7, 190.0, "N/m", ("34.21", "0.19", "kN/m")),
        (2.685, 0.012, "N", ("2.685", "0.012", "N")),
        (2.685, 123.4, "N", ("3", "123", "N")),
        (0.0, 2e-4, "m", ("0", "200", "um")),
        (1.5, None, "N", ("1.5", "", "N")),
        (1.5, 0.0, "N", ("1.5", "", "N")),
    ],
)
def test_digits(value: float, error: float | None, unit: str, expected: tuple[str, str, str]) -> None:
    assert with_error(value, error, unit) == expected


@given(st.floats(1e-6, 1e9), st.floats(1e-9, 1.0))
def test_rounding_stays_below_the_error_bar(value: float, relative: float) -> None:
    error = value * relative
    shown, shown_error, unit = with_error(value, error, "N")
    worth = {"N": 1.0, "kN": 1e3}[unit]
    # Half a unit in the last of two digits of the error bar, or of the twelve decimals that are shown at most.
    allowed = max(0.051 * error, 1e-12 * worth)
    assert math.isclose(float(shown) * worth, value, abs_tol=allowed, rel_tol=1e-15)
    assert float(shown_error) * worth == pytest.approx(error, rel=0.051, abs=1e-12 * worth)


def test_a_failed_check_is_listed_by_what_was_tested_and_a_passed_one_by_its_name() -> None:
    named = FAILED.model_copy(update={"quantity": "residual RMS"})
    other = FAILED.model_copy(update={"name": "my own check", "quantity": ""})
    assert failures([FAILED, *FIT.checks]) == ["- FAILED residual size: Something systematic is left after take-up."]
    assert [quantity_of(check) for check in (named, other)] == ["residual RMS", "my own check"]
    text = " ".join(fit_report(suspect()).split())
    assert "the gap is noise" not in text
    assert "Passed: residuals are white." in text


def test_each_record_of_a_report_is_told_by_its_name_however_long() -> None:
    """One word of eighty letters: nothing else tells it from its neighbours."""
    names = [f"{'drop_in_the_second_laboratory_' * 2}{n}.csv" for n in range(3)]
    fitted = FIT.model_copy(update={"study": "x" * 100, "records": {n: s.RecordSummary(gap=GAP) for n in names}})
    predicted = EXAMPLES["fibrefit/prediction/1"].model_copy(update={"study": "x" * 100, "records": fitted.records})
    for text in (fit_report(fitted), prediction_report(predicted)):
        assert text.startswith("xxxxxxxxxx")
        assert all(re.search(rf"^drop_in_.*\.\.\..*_{n}\b", text, re.MULTILINE) for n in range(3))
        assert max(map(len, text.splitlines())) <= WIDTH


def records_of_two_files() -> dict[str, s.RecordSummary]:
    """Two records in which the lift and the angle differ; of one the lift is stated, with its error, of one found."""
    steep = s.ConditionSummary(value=0.5 * math.pi, unit="rad")
    stated = s.ConditionSummary(value=0.01, unit="m", std_error=1e-4)
    other = CONDITIONS | {"inclination": steep, "lift": stated, "gain": s.ConditionSummary(value=1.2, unit="-")}
    return {
        "a.csv": s.RecordSummary(files=("a.csv",), conditions=CONDITIONS, gap=GAP),
        "b.csv": s.RecordSummary(files=("../../records/b.csv", "c.csv"), conditions=other, gap=GAP),
    }


def test_what_was_fitted_is_told_with_its_conditions() -> None:
    """What all records have alike stands once; a lift that no study states is told to be found."""
    text = fit_report(FIT.model_copy(update={"records": records_of_two_files()}))
    assert text.partition("Records and their conditions\n")[2].partition("\n\n")[0].splitlines()[1:] == [
        "All records: weight mass 3.096 kg.",
        "- a: inclination 45 deg, lift 5.020 +/- 0.030 mm (found)",
        "- b (../../records/b.csv, c.csv): inclination 90 deg, lift 10.00 +/- 0.10 mm,",
        "  gain 1.2",
    ]
    assert "- a: weight mass 3.096 kg, inclination 45 deg, lift" in fit_report(FIT)


def test_of_many_records_the_first_are_listed_and_the_others_counted() -> None:
    many = {f"record_{i}_{'x' * 60}.csv": s.RecordSummary(conditions=CONDITIONS, gap=GAP) for i in range(20)}
    text = fit_report(FIT.model_copy(update={"records": many}))
    assert "and 8 more, as summary.json lists them." in text
    assert max(map(len, text.splitlines())) <= WIDTH
    bare = FIT.model_copy(update={"records": {name: s.RecordSummary(gap=GAP) for name in many}})
    assert "Records and their conditions" not in fit_report(bare)  # a result of before they were kept


def test_notes_on_files_are_told_once_and_behind_the_records_that_they_are_of() -> None:
    record = next(iter(FIT.records.values()))

    def noted(*notes: tuple[str, ...]) -> s.FitSummary:
        records = {f"drop {i}.csv": record.model_copy(update={"notes": one}) for i, one in enumerate(notes)}
        return FIT.model_copy(update={"records": records})

    alike, own = "Not understood, and taken to change no number.", "force: 3 samples masked (saturated)."
    text = " ".join(fit_report(noted((alike,), (alike, own), (alike,))).split())
    assert f"All 3 records: {alike}" in text
    assert f"drop 1: {own}" in text
    assert fit_page(Result("results/a", noted((alike,), ()))).notes == [f"drop 0: {alike}"]
    many = notes_on_records(noted(*((f"note {i}",) for i in range(20))).records)
    assert len(many) == MOST_NOTES + 1
    assert many[-1] == "And 12 more such notes: records.*.notes of summary.json."
    assert notes_on_records(noted((), ()).records) == []


def test_names_of_records_stay_apart_where_they_are_cut() -> None:
    names = ("trapezoid_60mms_60mm.csv", "trapezoid_450mms_60mm.csv", "trapezoid_200mms_80mm_added.csv")
    assert list(shortened_names(names, 18).values()) == ["trap...60mms_60mm", "trap...450mms_60mm", "trap...80mm_added"]
    assert shortened_names(("drop_5mm.csv", "drop_10mm.csv"), 18) == {
        "drop_5mm.csv": "drop_5mm",
        "drop_10mm.csv": "drop_10mm",
    }
    assert shortened_names(("a.csv", "a.txt"), 18) == {"a.csv": "a.csv", "a.txt": "a.txt"}


@given(st.lists(st.text(min_size=1, max_size=60), min_size=1, unique=True), st.integers(6, 40))
def test_cut_names_keep_to_their_width(names: list[str], width: int) -> None:
    short = shortened_names(names, width)
    assert list(short) == names
    assert all(len(one) <= width for one in short.values())


@pytest.mark.parametrize(
    ("error", "says"),
    [
        (0.049, "mass is held by its prior, 1.900 +/- 0.050 kg: its error is 98 % of the prior's."),
        (0.020, "mass rests also on its prior, 1.900 +/- 0.050 kg: its error is 40 % of the prior's."),
        (0.001, "mass hardly hangs on its prior, 1.900 +/- 0.050 kg: its error is 2 % of the prior's."),
    ],
)
def test_a_prior_is_told_with_what_the_records_leave_of_it(error: float, says: str) -> None:
    known = {"prior_centre": 1.9, "prior_error": 0.05}
    mass = s.ParameterSummary(value=1.91, std_error=error, interval_95=(1.8, 2.0), unit="kg", **known)
    assert prior_sentences({"mass": mass}) == [says]
    told = " ".join(fit_report(FIT.model_copy(update={"parameters": {"mass": mass}})).split())
    assert says in told
    without = mass.model_copy(update={"prior_centre": None, "prior_error": None})
    assert prior_sentences({"mass": without, "held": mass.model_copy(update={"std_error": None})}) == []


@pytest.mark.parametrize(
    ("condition", "unit", "said"),
    [("lift", "m", "N/m per m ("), ("order of the records", "-", "N/m per record ("), ("clamped", "-", "N/m (")],
)
def test_a_trend_says_what_it_is_per(condition: str, unit: str, said: str) -> None:
    trend = TrendSummary(
        parameter="stiffness", condition=condition, slope=-9.5, slope_error=0.1, slope_interval_95=(-9.7, -9.3),
        intercept=2e4, unit="N/m", condition_unit=unit, between_records=0.0, chance=1e-9, chance_corrected=1e-8,
        records=9,
    )  # fmt: skip
    (line,) = trend_sentences([trend])
    assert said in line
    share = trend.model_copy(update={"unit": "-", "condition_unit": "m", "condition": "x"})
    assert "over x: -9.50 +/- 0.10 per m (" in trend_sentences([share])[0]
    many = trend_sentences([trend.model_copy(update={"parameter": f"p{i}"}) for i in range(9)])
    assert many[-1] == "Further trends that are more than chance: 3."


def test_a_pure_number_has_no_unit_and_what_is_known_without_an_interval_is_determined() -> None:
    assert quantity_text(1.52, 0.031, "-") == "1.520 +/- 0.031"
    assert quantity_text(14690.0, None, "N/m").endswith(" kN/m")
    known = s.ParameterSummary(value=34200.0, std_error=300.0, unit="N/m")
    assert parameter_row("stiffness", known)[2:] == ("0.30", "kN/m", "")
    assert parameter_row("stiffness", known.model_copy(update={"std_error": None}))[4] == "not determined"


def test_what_could_not_be_simulated_is_not_known() -> None:
    channel = s.ChannelGap(rms=math.nan, unit="N", noise=0.4, explained=0.5)
    errors = {"drive": InputErrorSummary(rms=math.nan, noise=1e-5, unit="m")}
    gap = s.Gap(force=channel)
    text = fit_report(FIT.model_copy(update={"status": "failed", "gap": gap, "input_errors": errors}))
    said = " ".join(text.split())
    assert "% of the force" not in said
    assert re.search(r"^force +50\.0 % +not known +", text, re.MULTILINE)
    assert "What the measured drive was corrected by is not known; its noise is 10 um." in said
    assert not {"nan", "inf"} & set(said.split())
    predicted = PredictedChannel(rms=math.nan, unit="N")
    update = {"status": "failed", "verdict": "not_trusted", "channels": {"force": predicted}, "gap": gap}
    prediction = EXAMPLES["fibrefit/prediction/1"].model_copy(update=update)
    assert re.search(r"^force +not known$", prediction_report(prediction), re.MULTILINE)
    page_text = page([Result("results/a", prediction)], "one")
    assert "not known" in page_text
    assert "nan" not in re.sub(r"<script.*?</script>", "", page_text, flags=re.DOTALL).split()


@pytest.mark.parametrize(
    ("basins", "says"), [(3, "; 2 local minima: "), (7, "; 6 local minima: "), (12, "; at least 7 local minima: ")]
)
def test_local_minima_are_counted_as_far_as_they_are_kept(basins: int, says: str) -> None:
    shape = (basins, 1)
    starts = Starts(
        ("k",), np.ones(shape), np.ones(shape), np.ones(shape), 1.0 + np.arange(basins), np.zeros(basins, dtype=int),
        np.arange(basins),
    )  # fmt: skip
    text = fit_report(FIT.model_copy(update={"starts": starts_summary(starts)}))
    assert says in " ".join(text.split())


@pytest.mark.parametrize(("number", "more"), [(4, ""), (5, "1 more jump"), (9, "5 more jumps")])
def test_jumps_that_are_not_listed_are_counted(number: int, more: str) -> None:
    swept = EXAMPLES["fibrefit/sweep/1"]
    (curve,) = swept.curves.values()
    branch = curve.branches["rest"]
    jumping = branch.model_copy(update={"jumps": branch.jumps * number})
    changed = curve.model_copy(update={"branches": {"rest": jumping}})
    text = " ".join(sweep_report(swept.model_copy(update={"curves": {"20 mm": changed}})).split())
    assert text.count("jumps between") == 4
    assert (f"from rest: {more}" in text) if more else "more jump" not in text
