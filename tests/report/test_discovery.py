"""The report of a discovery: the verdict first, all that a colleague would say, in 80 columns."""

from __future__ import annotations

import pytest

from fibrefit.report.discovery import (
    NOT_IN_THE_GAP,
    discovery_report,
    evidence_text,
    not_in_the_gap,
    others_listed,
    unfinished_parts,
    verdict_line,
)
from fibrefit.report.layout import WIDTH, shortened
from fibrefit.study.summaries import discovery as d
from fibrefit.study.summaries import results as s
from fibrefit.study.summaries.discovery import listed_candidates
from tests.report.test_text import suspect
from tests.study.test_summaries import EXAMPLES, GAP, STIFFNESS

NAMED = EXAMPLES["fibrefit/discovery/1"]
assert isinstance(NAMED, d.DiscoverySummary)
LONG = "guide.asymmetric_viscous_friction"
BEFORE = d.Before(
    status="suspect",
    parameters={"stiffness": STIFFNESS.model_copy(update={"value": 31800.0})},
    gap=GAP.model_copy(update={"total": 3.1}),
    records={"a.csv": GAP},
)


def test_values_of_each_record_and_how_records_differ_are_told_of_a_search_as_of_a_fit() -> None:
    own = {name: one.model_copy(update={"parameters": values("offset")}) for name, one in NAMED.records.items()}
    between = {"stiffness": s.BetweenRecordsSummary(sd=0.01, interval_95=(0.005, 0.02), agree=0.01)}
    told = NAMED.model_copy(update={"records": own, "own_parameters": ("offset",), "between_records": between})
    said = discovery_report(told)
    assert "offset of" in said
    assert "stiffness differs by 1 % (95 %: 0.5 to 2 %) from record to record, beyond its error." in " ".join(
        said.split()
    )


def values(*names: str) -> dict[str, s.ParameterSummary]:
    return {name: s.ParameterSummary(value=1.766, std_error=0.015, unit="N s/m") for name in names}


def full() -> d.DiscoverySummary:
    """Everything long that a report can hold."""
    base = suspect()
    ranking = tuple(
        d.Candidate(
            effect=f"{LONG} + fibre.rate_dependent_stiffness" if i == 2 else LONG,
            gap_after=1.0 + i,
            evidence=15094.0 - 3000.0 * i,
            parameters=values(f"{LONG}.viscous_asymmetry", "guide.viscous_friction.viscous_coefficient"),
        )
        for i in range(9)
    )
    place = d.GapPlace(
        record=f"record_0_{'x' * 60}.csv",
        channel="position",
        from_s=0.31,
        to_s=0.68,
        phase="taut, unloading",
        share=0.38,
    )
    sentence = "38 % of the gap lies in the position while slack. " * 4
    return d.DiscoverySummary(
        **{name: getattr(base, name) for name in s.FitResultSummary.model_fields},
        verdict="named",
        reason="What is left is noise.",
        added=("guide.viscous_friction", LONG),
        rounds=(
            d.Round(
                added="guide.viscous_friction", gap_before=3.1, gap_after=1.4, where=(place,), ranking=ranking,
                sentence=sentence,
            ),
            d.Round(added=LONG, gap_before=1.4, gap_after=1.02, ranking=ranking, sentence="Then the rest."),
        ),
        cannot_tell_apart=((LONG, "guide.load_dependent_friction"),),
        unexplained=d.Unexplained(gap=1.0),
        before=BEFORE.model_copy(update={"records": dict.fromkeys(base.records, GAP)}),
        held_out=tuple(d.HeldOut(record=name, gap_before=13.6, gap_after=1.01) for name in base.records),
    )  # fmt: skip


def with_verdict(verdict: s.Verdict, **changes: object) -> d.DiscoverySummary:
    found = {"added": (), "rounds": (), "cannot_tell_apart": (), "verdict": verdict, "before": BEFORE}
    return NAMED.model_copy(update=found | {"reason": "The reason is this.", **changes})


CURVE = d.FreeCurve(
    variable="position", unit="m", says="a friction that depends on the position of the weight",
    knots=(-0.02, -0.01, 0.0, 0.01), heights=(-1.5, 0.0, 0.0, 2.5), std_errors=(None, 0.2, 0.1, 0.3), gap_after=1.02,
)  # fmt: skip
SENSED = CURVE.model_copy(
    update={"says": "an error of the displacement gauge that depends on the position", "gap_after": 2.5}
)


LAW = d.ProposedLawSummary(
    name="guide.friction_of_position_sine", file="laws/friction_of_position_sine.py",
    effect="laws/friction_of_position_sine.py:FrictionOfPositionSine",
    says="A friction that depends on the position of the weight: it varies as a sine of position.",
    port="guide.friction", variables=("position",), variable_units=("m",), valid_range=(-0.02, 0.01), form="sine",
    expression="a sin(2 pi x / p)",
    parameters={
        "amplitude": d.LawParameter(symbol="a", value=0.7291, std_error=0.0082, unit="N"),
        "period": d.LawParameter(symbol="p", value=4.8521e-3, std_error=None, unit="m"),
    },
    evidence=1210.0, false_alarm=0.0, gap_before=3.43, gap_after=0.994, gap_left_out_before=3.5, gap_left_out=0.999,
    elpd_left_out=2400.0,
)  # fmt: skip


ALL = {
    "law": with_verdict("unexplained", unexplained=d.Unexplained(gap=2.0, curves=(CURVE,)), proposed_law=LAW),
    "named": NAMED.model_copy(update={"before": BEFORE}),
    "full": full(),
    "nothing_missing": with_verdict("nothing_missing"),
    "unexplained": with_verdict(
        "unexplained", unexplained=d.Unexplained(gap=2.0, looks_like="a friction that depends on the position " * 5)
    ),
    "drawn": with_verdict("unexplained", unexplained=d.Unexplained(gap=2.0, curves=(CURVE, SENSED))),
    "not_trusted": with_verdict("not_trusted"),
}


@pytest.mark.parametrize("name", ALL)
def test_it_fits_80_columns_of_ascii(name: str) -> None:
    text = discovery_report(ALL[name])
    assert max(map(len, text.splitlines())) <= WIDTH
    assert text.isascii()


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("named", "NAMED: guide.viscous_friction (or guide.quadratic_drag)"),
        ("full", f"NAMED: guide.viscous_friction and {LONG} (or guide.load_dependent_friction)"),
        ("nothing_missing", "NOTHING MISSING"),
        ("not_trusted", "NOT TRUSTED: The reason is this."),
    ],
)
def test_the_verdict_comes_first(name: str, line: str) -> None:
    assert verdict_line(ALL[name]) == line
    assert discovery_report(ALL[name]).replace("\n", " ").startswith(line)


def test_the_unexplained_says_what_it_looks_like() -> None:
    text = discovery_report(ALL["unexplained"])
    assert text.startswith("UNEXPLAINED: looks like a friction that depends on the position")
    assert discovery_report(with_verdict("unexplained", unexplained=None)).startswith("UNEXPLAINED\n")


def test_a_law_is_what_the_records_ask_for_with_its_numbers_and_their_errors() -> None:
    asked = "the records ask for a friction that depends on the position of the weight: it varies as a sine of position"
    assert verdict_line(ALL["law"]) == f"UNEXPLAINED: {asked}"
    text = " ".join(discovery_report(ALL["law"]).split())
    assert f"No catalogued effect does it; {asked}, a = 0.7291 +/- 0.0082 N, p = 4.8521 mm. With it," in text


def test_what_was_not_tried_is_counted_where_nothing_was() -> None:
    names = tuple(f"guide.law_{n}" for n in range(70))
    nothing = with_verdict("unexplained", untried=names)
    assert unfinished_parts(nothing)[0] == "Not tried: any of the 70 effects that make sense on this rig."
    some = nothing.model_copy(update={"untried": names[:2], "ranking": NAMED.rounds[0].ranking})
    assert unfinished_parts(some)[0] == "Not tried: guide.law_0, guide.law_1."
    many = some.model_copy(update={"untried": (*names[:20], "fibre.creep")})
    said = "Not tried: 21 effects, 20 guide.*, 1 fibre.*; summary.json lists them under untried."
    assert unfinished_parts(many)[0] == said


def test_the_best_curve_is_drawn_and_the_others_are_listed() -> None:
    text = discovery_report(ALL["drawn"])
    assert "What is missing, as a curve\n" in text
    assert "with it, the gap is 1.02. The heights are good to 0.2 N" in " ".join(text.split())
    assert "      2.5 |" in text
    assert "     -1.5 |" in text
    assert "position / mm" in text
    assert "an error of the displacement gauge that depends on the position      2.500" in text
    assert "as a curve" not in discovery_report(ALL["unexplained"])


def test_it_says_what_helped_but_is_not_all() -> None:
    text = discovery_report(with_verdict("unexplained", added=("guide.viscous_friction",)))
    assert "guide.viscous_friction helped, but that is not the whole of it." in " ".join(text.split())


@pytest.mark.parametrize(
    ("before", "says", "explains"),
    [
        (1.5, "(gap) falls from 1.50 to {after}, expected", False),
        (0.5, "(gap) rises from 0.50 to {after}, expected", True),
        (None, "(gap) stays at {after}, expected", True),
    ],
)
def test_a_gap_that_does_not_fall_is_not_said_to(before: float | None, says: str, explains: bool) -> None:
    """Errors of a measured drive take up a faint effect, and residuals are small without it."""
    after = NAMED.gap.total
    assert after is not None
    began = BEFORE.model_copy(update={"gap": GAP.model_copy(update={"total": after if before is None else before})})
    summary = with_verdict("named", added=("guide.viscous_friction",), before=began)
    text = " ".join(discovery_report(summary).split())
    assert says.format(after=f"{after:.2f}") in text
    assert (NOT_IN_THE_GAP in text) is explains
    assert not_in_the_gap(summary) == [NOT_IN_THE_GAP] * explains
    # Where nothing was added nothing is compared.
    assert NOT_IN_THE_GAP not in discovery_report(summary.model_copy(update={"added": ()}))


def test_it_says_what_matters() -> None:
    text = " ".join(discovery_report(full()).split())
    for part in (
        "The normalised residual RMS (gap) falls from 3.10 to 1.30, expected 1.",
        "1. 38 % of the gap lies in the position while slack.",
        "2. Then the rest.",
        "position 0.310 0.680 taut, unloading 38 %",
        "13.60 -> 1.01",
        "and 8 more records with smaller gaps",
        "What was tried in round 2",
        "1.000 15094 1.766 +/- 0.015 N s/m",
        "and 3 more that gain nothing",
        "These records do not tell",
        "31.8000 11.1506 0.0042 kN/m",
        "What to do next",
    ):
        assert part in text, part


def test_candidates_that_gain_nothing_are_counted_unless_none_gains() -> None:
    found = NAMED.rounds[0].ranking[0]
    gains = [
        found.model_copy(update={"effect": f"guide.law_{n}", "evidence": gain})
        for n, gain in enumerate((40.0, 3.0, 0.4, -0.3, -7.0))
    ]
    told = listed_candidates(gains, 6)
    assert [one.effect for one in told.shown] == ["guide.law_0", "guide.law_1"]
    assert others_listed(told) == "and 3 more that gain nothing"
    assert others_listed(listed_candidates(gains, 1)) == "and 4 more with less evidence"
    assert [one.effect for one in listed_candidates(gains, 6, "guide.law_4").shown][-1] == "guide.law_4"
    assert listed_candidates(gains[2:], 2).shown == tuple(gains[2:4])
    assert [evidence_text(one) for one in gains[2:]] == ["0", "0", "-7"]


def test_nothing_stands_before_where_nothing_was_added() -> None:
    text = discovery_report(ALL["nothing_missing"])
    assert "->" not in text
    assert "before" not in text


def test_a_name_is_cut_in_its_middle() -> None:
    assert shortened("drop_10mm_90deg.csv", 34) == "drop_10mm_90deg.csv"
    cut = shortened("record_" + "x" * 60 + "_9.csv", 20)
    assert len(cut) == 20
    assert cut.startswith("record_")
    assert cut.endswith("_9.csv")
