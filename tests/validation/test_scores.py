"""The runners of the validation: scores on outcomes made by hand, files that keep first outcomes, time limits."""

from __future__ import annotations

import argparse
import math
import subprocess
import time
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("numba", reason="the second simulator is compiled with numba: install the extra `bench`")

from fibrefit.laws.catalogue import find_effect
from tests.independent.laws import ACTS_BY, KNOWN_AS, OUTSIDE
from tests.independent.simulate import Base
from tests.validation import validate_discover, validate_intervals
from tests.validation.cases import KINDS, cases, interval_cases
from tests.validation.scores import Outcome, by_hidden, by_noise, by_strength, goals, ideal, misses, tables, times
from tests.validation.tables import Share, Table, append, printed, read
from tests.validation.validate_discover import carry_out, chosen, ended, told
from tests.validation.validate_intervals import Fitted, coverage, rows_of
from tests.validation.workers import carried_out

GOOD = Outcome(
    case="a", release="r", kind="faint", rig="fibre_mass", index=0, seed=1, noise="pink", scatter=0.0, strength=60.0,
    hidden="sensor.force_delay", noncentralities="60.1", verdict="named", added="sensor.force_delay", alike="",
    best="sensor.force_delay", evidence=20.0, evidence_of_truth=20.0, gap_before=1.01, gap_after=1.0, status="ok",
    seconds=60.0, processor_seconds=20.0, making_seconds=0.3, revision="abc", says="", memory=0.5,
    gap_left_out=1.02, gap_of_truth=1.0,
)  # fmt: skip
LAG = replace(GOOD, case="b", added="sensor.force_lag")
WRONG = replace(GOOD, case="c", added="guide.viscous_friction")
ALIKE = replace(WRONG, case="d", alike="fibre.mass + fibre.hardening | sensor.force_delay + guide.viscous_friction")
MORE = replace(GOOD, case="e", added="sensor.force_delay + fibre.hardening")
PAIR = replace(GOOD, case="f", kind="pair", hidden="fibre.hardening + sensor.force_delay", added="fibre.hardening")
NULL = replace(GOOD, case="g", kind="null", hidden="", verdict="nothing_missing", added="")
ALARM = replace(NULL, case="h", verdict="named", added="guide.viscous_friction")
STRANGER = replace(GOOD, case="i", kind="outside", hidden="open.detent", verdict="unexplained", added="")
FAILED = replace(GOOD, case="j", verdict="error", added="", seconds=math.nan, says="ValueError: no")
KNOWN = replace(STRANGER, case="k", hidden="open.curved_gauge", verdict="named", added="sensor.gauge_nonlinearity")
ALL = [GOOD, LAG, WRONG, ALIKE, MORE, PAIR, NULL, ALARM, STRANGER, FAILED]


def test_by_class_exactly_and_falsely() -> None:
    said = {o.case: (o.by_class, o.exact, o.falsely) for o in ALL}
    assert said == {
        "a": (True, True, False),
        "b": (True, False, False),
        "c": (False, False, True),
        "d": (True, False, False),
        "e": (True, False, True),
        "f": (False, False, False),
        "g": (False, False, False),
        "h": (False, False, True),
        "i": (False, False, False),
        "j": (False, False, False),
    }


def test_a_cause_the_catalogue_has_a_law_for_is_held_to_that() -> None:
    misled = replace(KNOWN, case="l", added="sensor.force_drift")
    silent = replace(KNOWN, case="m", verdict="unexplained", added="")
    assert [(o.good, o.by_law, o.falsely) for o in (KNOWN, misled, silent)] == [
        (True, True, False), (False, False, True), (False, False, False),
    ]  # fmt: skip
    assert "| outside the catalogue: called unexplained | >= 90 % | 100.0 % (1 of 1;" in "".join(
        goals([STRANGER, KNOWN]).lines()
    )
    assert set(KNOWN_AS) <= set(OUTSIDE)
    assert all(find_effect(name).name == name for name in KNOWN_AS.values())


def test_shares_have_their_interval() -> None:
    assert str(Share(0, 300)) == "0.0 % (0 of 300; 0.0 to 1.2 %)"
    assert str(Share(95, 100)) == "95.0 % (95 of 100; 88.7 to 98.4 %)"
    assert str(Share(0, 0)) == "no case"


def test_the_ideal_finds_what_is_far_from_nothing() -> None:
    assert ideal(0.0) == pytest.approx(0.01 / 20)
    assert [ideal(strength) for strength in (30, 60, 120)] == pytest.approx([0.978, 1.0, 1.0], abs=2e-3)


def test_tables() -> None:
    told = goals(ALL).lines()
    assert "| nothing hidden: an effect named | <= 1 % | 50.0 % (1 of 2;" in told[2]
    assert "| noncentrality 60: named by class | >= 50 % | 66.7 % (4 of 6;" in told[4]
    assert by_strength(ALL).lines()[2].startswith("| fibre_mass | 60 | 100.0 % | 66.7 % (4 of 6")
    assert by_noise(ALL, "null").lines()[2].startswith("| fibre_mass | pink |  | ")
    assert by_hidden(ALL).rows[0][:8] == ("sensor.force_delay", "fibre_mass", "6", "4", "1", "2", "0", "")
    assert by_hidden([KNOWN]).rows == (("open.curved_gauge", "fibre_mass", "1", "0", "0", "0", "0", "1", ""),)
    slow = replace(GOOD, case="o", seconds=46.0)
    twice = [slow, replace(GOOD, seconds=45.0)]
    assert any("within 45 s, driven 120 s | all | 50.0 % (1 of 2;" in line for line in goals(twice).lines())
    assert any("within twice that | nothing compiled | 100.0 % (1 of 1;" in line for line in goals([slow]).lines())
    assert len(misses(ALL).rows) == 7
    assert times(ALL).rows[0] == ("fibre_mass", "null", "2", "60", "20", "60", "0.5")
    assert times([replace(GOOD, memory=math.nan)]).rows[0][-2:] == ("60", "not recorded")


def test_tables_of_a_release_and_of_all_revisions() -> None:
    assert tables([]) == {}
    alone = tables(ALL)
    assert alone["releases"].rows == (("latest", "r", "1", "10"),)
    assert "goals_together" not in alone
    both = tables(ALL, [replace(ALARM, case="n", release="q", revision="older")])
    assert both["goals"] == alone["goals"]
    assert both["goals_together"].rows[0][2].startswith("66.7 % (2 of 3;")
    assert both["releases"].rows[1] == ("earlier", "q", "1", "1")
    assert len(both["misses"].rows) == 8
    days = [replace(GOOD, case=label, release=label) for label in ("2026-11-25aa", "2026-11-25i", "2026-11-26a")]
    assert tables(ALL, days)["releases"].rows[1][1] == "2026-11-25i to 2026-11-26a"


def test_a_table_is_kept_as_it_is_printed(tmp_path: Path) -> None:
    made = goals(ALL)
    made.keep(tmp_path / "some" / "goals.csv")
    assert Table.kept(tmp_path / "some" / "goals.csv") == made
    assert printed({"goals": made}).splitlines()[:3] == ["### goals", "", made.lines()[0]]


def test_a_file_keeps_first_outcomes(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    append(path, GOOD, "case")
    append(path, NULL, "case")
    assert read(path, Outcome) == [GOOD, NULL]
    with pytest.raises(ValueError, match="another release"):
        append(path, replace(GOOD, verdict="unexplained"), "case")
    assert read(path, Outcome) == [GOOD, NULL]


@pytest.mark.parametrize(
    ("hidden", "verdict", "port", "variable", "right"),
    [
        ("open.detent", "unexplained", "guide", "position", True),
        ("open.detent", "unexplained", "guide", "speed", False),
        ("open.detent", "unexplained", "", "", False),
        ("open.kinked_stiffness", "named", "fibre", "stretch", False),
        ("open.kinked_stiffness", "unexplained", "fibre", "tension", True),
    ],
)
def test_a_law_is_right_at_its_port_and_of_its_variable(
    hidden: str, verdict: str, port: str, variable: str, right: bool
) -> None:
    found = replace(GOOD, kind="outside", hidden=hidden, verdict=verdict, law_port=port, law_variable=variable)
    assert found.law_right is right


@pytest.mark.parametrize(
    ("gap", "truth", "as_well"), [(1.04, 1.0, True), (1.3, 1.25, True), (1.3, 1.0, False), (math.nan, math.nan, False)]
)
def test_a_law_predicts_as_well_as_the_true_one_within_a_tenth(gap: float, truth: float, as_well: bool) -> None:
    assert replace(STRANGER, gap_left_out=gap, gap_of_truth=truth).law_predicts is as_well


def test_a_search_over_its_time_is_counted() -> None:
    late = [replace(GOOD, case=str(seconds), seconds=seconds) for seconds in (60.0, 299.9, 300.4, 404.0)]
    assert any(line.startswith("| over 5 minutes | none | 50.0 % (2 of 4;") for line in goals(late).lines())


def test_every_cause_that_is_outside_has_a_law_or_a_name() -> None:
    assert set(OUTSIDE) == set(ACTS_BY) | set(KNOWN_AS)
    assert not set(ACTS_BY) & set(KNOWN_AS)


def test_a_run_goes_on_where_another_ended_with_all_kinds_in_turn() -> None:
    given = argparse.Namespace(
        release="r", kind=None, rig=None, noise=None, strength=None, tuning=False, cases=12
    )  # fmt: skip
    first = chosen(given, [])
    assert len(first) == 12
    assert {case.kind for case in first} == set(KINDS)
    done = [replace(GOOD, case=case.name) for case in first]
    assert not {case.name for case in chosen(given, done)} & {case.name for case in first}
    given.kind, given.strength = ["faint"], 120.0
    assert {case.strength for case in chosen(given, [])} == {120.0}


def test_a_fault_is_an_outcome(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(folder: Path) -> dict[str, object]:
        raise ValueError("no")

    monkeypatch.setattr(validate_discover, "_searched", broken)
    case = next(cases("r", "null", "fibre_mass"))
    outcome = carry_out(case)
    assert (outcome.verdict, outcome.says) == ("error", "ValueError: no")
    assert outcome.seconds < 1.0
    late = ended(case, 5.0)
    assert (late.verdict, late.seconds) == ("too long", 5.0)


def test_a_summary_is_read_by_the_contract() -> None:
    def row(effect: str, evidence: float) -> dict[str, object]:
        return {"effect": effect, "evidence": evidence}

    summary = {
        "verdict": "named",
        "added": ["fibre.mass"],
        "cannot_tell_apart": [["fibre.mass", "sensor.force_lag"]],
        "rounds": [{"ranking": [row("fibre.mass", 30.0), row("sensor.force_lag", 31.0)]}, {"ranking": []}],
        "gap": {"total": 1.0},
        "before": {"gap": {"total": 1.2}},
        "status": "ok",
        "reason": "so",
        "proposed_law": {"port": "guide.friction", "variables": ["position"], "gap_left_out": 1.07},
    }
    found = told(summary, ["fibre.mass"])
    assert (found["best"], found["evidence"], found["evidence_of_truth"]) == ("sensor.force_lag", 31.0, 30.0)
    assert (found["added"], found["alike"]) == ("fibre.mass", "fibre.mass + sensor.force_lag")
    assert (found["gap_before"], found["gap_after"], found["says"]) == (1.2, 1.0, "so")
    assert (found["law_port"], found["law_variable"], found["gap_left_out"]) == ("guide", "position", 1.07)
    bare = told({"verdict": "not_trusted", "added": []}, [])
    assert bare["best"] == ""
    assert math.isnan(bare["evidence"])
    assert math.isnan(bare["gap_left_out"])


def test_work_is_ended_after_its_time_and_the_rest_goes_on() -> None:
    # A number is no command: the process dies of it.
    jobs = ["sleep 100", "echo a", 5, "echo b"]
    began = time.perf_counter()
    done = {one.job: one.result for one in carried_out(subprocess.getstatusoutput, jobs, 2, 5.0)}
    assert done == {"sleep 100": None, "echo a": (0, "a"), 5: None, "echo b": (0, "b")}
    assert time.perf_counter() - began < 100.0


def test_intervals() -> None:
    case = next(interval_cases("r", "fibre_mass", "slow", 0.02))
    found = {
        "value": 1.0e4,
        "std_error": 10.0,
        "interval_95": [9.98e3, 1.002e4],
        "unit": "N/m",
        "std_errors": {"white": 2.0},
    }
    facts = {"status": "ok", "failed": "", "seconds": 3.0, "processor_seconds": 2.0, "says": ""}
    rows = rows_of(case, Base(1.0015e4, 20.0, 3.0), {"stiffness": found}, facts)
    stiffness, damping, _ = rows
    assert (stiffness.holds, stiffness.white_holds, stiffness.score) == (True, False, -1.5)
    assert (damping.holds, damping.white_holds) == (False, False)
    assert "| fibre_mass | slow | 2 % | 100.0 % (1 of 1;" in coverage(rows).lines()[2]
    with pytest.raises(ValueError, match="expected N/m, got kN/m"):
        rows_of(case, Base(), {"stiffness": {**found, "unit": "kN/m"}}, facts)


def test_intervals_are_kept_by_series_and_parameter(tmp_path: Path) -> None:
    case = next(interval_cases("r", "fibre_mass", "slow", 0.02))
    facts = {"status": "error", "failed": "", "seconds": 3.0, "processor_seconds": 2.0, "says": ""}
    rows = rows_of(case, Base(), {}, facts)
    for row in rows:
        append(tmp_path / "r.csv", row, "key")
    assert [row.key for row in read(tmp_path / "r.csv", Fitted)] == [row.key for row in rows]
    given = argparse.Namespace(
        release="r", rig=["fibre_mass"], noise=["slow"], scatter=[0.02], tuning=False, series=1
    )  # fmt: skip
    assert validate_intervals.chosen(case.release, given, rows)[0].index == case.index + 1
