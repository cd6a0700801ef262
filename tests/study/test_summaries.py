"""Summary files hold what is promised to programs, and nothing that is not a number."""

from __future__ import annotations

import json
import math

import pytest
from pydantic import ValidationError

from fibrefit.study.summaries import discovery as d
from fibrefit.study.summaries import results as s
from fibrefit.study.summaries import series
from fibrefit.study.summaries.check import Check
from fibrefit.study.summaries.files import SUMMARIES

GAP = s.Gap.model_validate(
    {
        "force": {"rms": 0.62, "unit": "N", "noise": 0.41, "ratio": 1.51, "explained": None},
        "position": {"rms": 2.1e-5, "unit": "m", "noise": 2e-5, "ratio": 1.05},
        "total": 1.3,
    }
)
STIFFNESS = s.ParameterSummary(value=34210.0, std_error=190.0, interval_95=(33840.0, 34580.0), unit="N/m")
WEIGHT, LEVEL = s.ConditionSummary(value=3.096, unit="kg"), s.ConditionSummary(value=0.25 * math.pi, unit="rad")
CONDITIONS = {
    "weight_mass": WEIGHT,
    "inclination": LEVEL,
    "lift": s.ConditionSummary(value=5.02e-3, unit="m", std_error=3e-5, found=True),
}
CHECK = Check(name="residuals are white", passed=True, says="Nothing is left.", statistic=0.4, threshold=1.0)
PROVENANCE = s.Provenance(
    created="2026-11-20T12:00:00+00:00", versions={"numpy": "2"}, inputs={"a.csv": "0" * 64}, resolved_study="", seed=1
)
FIT = s.FitSummary(
    status="ok",
    study="drops",
    rig="fibre_mass",
    parameters={"stiffness": STIFFNESS},
    gap=GAP,
    records={"a.csv": s.RecordSummary(files=("a.csv",), conditions=CONDITIONS, gap=GAP)},
    checks=(CHECK,),
    starts=s.StartsSummary(tried=32, agreeing=30),
    provenance=PROVENANCE,
)
PLACE = d.GapPlace(record="a.csv", channel="force", from_s=0.41, to_s=0.47, phase="taut, loading", share=0.31)
CANDIDATE = d.Candidate(effect="guide.viscous_friction", gap_after=1.02, evidence=812.0, parameters={})
EXAMPLES: dict[str, s.Part] = {
    "fibrefit/fit/1": FIT,
    "fibrefit/discovery/1": d.DiscoverySummary(
        **{name: getattr(FIT, name) for name in s.FitResultSummary.model_fields},
        verdict="named",
        added=("guide.viscous_friction",),
        rounds=(
            d.Round(
                added="guide.viscous_friction",
                gap_before=3.1,
                gap_after=1.02,
                where=(PLACE,),
                ranking=(CANDIDATE,),
                sentence="It grows with speed.",
            ),
        ),
        cannot_tell_apart=(("guide.viscous_friction", "guide.quadratic_drag"),),
        unexplained=d.Unexplained(gap=1.0),
    ),
    "fibrefit/prediction/1": s.PredictionSummary(
        status="ok",
        verdict="holds",
        says="The values hold.",
        study="drops",
        result="results/drops",
        parameters={"stiffness": STIFFNESS},
        channels={"force": s.PredictedChannel(rms=0.42, unit="N", explained=0.99)},
        gap=GAP,
        records={"a.csv": s.RecordSummary(gap=GAP)},
        checks=(CHECK,),
        provenance=PROVENANCE,
    ),
    "fibrefit/posterior/1": s.PosteriorSummary(
        status="ok",
        study="drops",
        parameters={
            "stiffness": s.PosteriorParameter(mean=1.0, sd=0.1, median=1.0, interval=(0.8, 1.2), unit="N/m", r_hat=1.0)
        },
        interval_kind="equal_tailed",
        interval_probability=0.95,
        likelihood="white",
        ensembles=4,
        walkers=32,
        draws=1000,
        checks=(CHECK,),
    ),
    "fibrefit/batch/1": series.BatchSummary(
        status="suspect",
        name="drops",
        items={
            "a": series.BatchItem(status="ok", parameters={"stiffness": STIFFNESS}, gap=1.0, result="a"),
            "b": series.BatchItem(error="b.csv: no such file."),
        },
    ),
    "fibrefit/sweep/1": s.SweepSummary(
        status="ok",
        study="pendulum",
        rig="inverted_pendulum",
        parameters={"stiffness": 8264.0, "damping": 4.13},
        lowest_hz=4.0,
        highest_hz=5.0,
        frequencies=11,
        runs=33,
        curves={
            "20 mm": s.CurveSummary(
                amplitude_m=0.02,
                preload_n=0.0,
                natural_frequency_hz=5.04,
                branches={
                    "rest": s.BranchSummary(
                        peak=s.PeakSummary(frequency_hz=4.3, angle_rad=0.51),
                        jumps=(
                            s.JumpSummary(
                                from_hz=4.2,
                                to_hz=4.3,
                                from_rad=0.11,
                                to_rad=0.51,
                                farthest_from_rad=0.21,
                                farthest_to_rad=0.76,
                            ),
                        ),
                        overturned_hz=((4.5, 4.6),),
                    )
                },
            )
        },
        checks=(CHECK,),
    ),
    "fibrefit/distinguish/1": d.DistinguishSummary(
        study="drops",
        rig="fibre_mass",
        records=("a.csv",),
        planned=False,
        effects=(
            d.Detectable(
                effect="guide.viscous_friction",
                parameter="viscous_coefficient",
                unit="N s/m",
                smallest_detectable=0.02,
                unique=0.4,
            ),
            d.Detectable(
                effect="fibre.mass", parameter="mass", unit="kg", smallest_detectable=float("inf"), unique=0.0
            ),
        ),
        cosine=((1.0, 0.3), (0.3, 1.0)),
        cannot_see=("fibre.mass",),
    ),
    "fibrefit/plan/1": d.PlanSummary(
        study="drops",
        rig="fibre_mass",
        records=("a.csv",),
        purpose="errors",
        further=(
            d.FurtherRecord(
                like="a.csv",
                conditions={"lift": 0.02},
                pace=1.0,
                size=1.0,
                minutes=3.0,
                errors={"stiffness": 0.7},
                limits={"guide.viscous_friction": 0.8},
                says="A record like a.csv with lift 20 mm (3 min): the standard error of stiffness falls by 30 %.",
            ),
        ),
    ),
    "fibrefit/series/1": series.SeriesSummary(
        status="ok",
        study="drops",
        rig="fibre_mass",
        answer="constant",
        sentence="One set of parameters serves all speeds.",
        models={"constant": series.RivalSummary(log_bayes_factor=0.0, gap=1.0, gap_left_out=1.0, elpd=0.0)},
        laws=(),
        records={
            "a.csv": series.SeriesRecord(
                speeds={"damping": (0.1, 0.6)},
                conditions={"lift": 0.005},
                parameters={"stiffness": series.OwnSummary(value=11150.0, std_error=4.0, unit="N/m")},
                gap_left_out={"constant": 1.0},
            )
        },
        checks=(CHECK,),
    ),
}


def test_there_is_an_example_of_every_kind() -> None:
    assert set(EXAMPLES) == set(SUMMARIES)


@pytest.mark.parametrize("schema", EXAMPLES)
def test_they_read_back(schema: str) -> None:
    text = EXAMPLES[schema].model_dump_json(by_alias=True)
    assert json.loads(text)["schema"] == schema
    assert SUMMARIES[schema].model_validate_json(text, strict=True) == EXAMPLES[schema]


def test_the_promised_names_of_a_fit() -> None:
    content = json.loads(FIT.model_dump_json(by_alias=True))
    promised = {"schema", "status", "study", "parameters", "gap", "records", "checks", "starts"}
    assert promised <= content.keys()
    assert {"value", "std_error", "interval_95", "unit", "free", "at_bound"} <= content["parameters"][
        "stiffness"
    ].keys()
    assert content["gap"]["force"] == {"rms": 0.62, "unit": "N", "noise": 0.41, "ratio": 1.51, "explained": None}
    assert content["gap"]["total"] == 1.3
    assert content["records"]["a.csv"]["gap"]["force"]["rms"] == 0.62
    assert {"name", "passed", "says"} <= content["checks"][0].keys()
    assert {"tried", "agreeing"} <= content["starts"].keys()


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_not_written(value: float) -> None:
    with pytest.raises(ValidationError, match="finite"):
        s.ParameterSummary(value=value, unit="N")


@pytest.mark.parametrize(
    "part",
    [
        s.ChannelGap(rms=math.nan, unit="N"),
        s.InputErrorSummary(rms=math.inf, noise=1e-5, unit="m"),
        s.PredictedChannel(rms=math.inf, unit="N", expected=math.nan),
    ],
)
def test_a_residual_that_is_not_known_is_null_in_the_file(part: s.Part) -> None:
    """As of a model whose motion could not be simulated: the file is written all the same, and can be read."""
    assert part.model_dump(mode="json")["rms"] is None
    text = part.model_dump_json()
    assert json.loads(text)["rms"] is None
    assert math.isnan(type(part).model_validate_json(text).rms)


def test_unknown_names_are_refused() -> None:
    with pytest.raises(ValidationError, match="colour"):
        s.ParameterSummary.model_validate({"value": 1.0, "unit": "N", "colour": "red"})
    with pytest.raises(ValidationError, match="force"):
        s.Gap.model_validate({"force": 3, "total": 1.4})


def test_an_item_of_a_batch_has_a_result_or_an_error() -> None:
    with pytest.raises(ValidationError, match="either a status or an error"):
        series.BatchItem()
