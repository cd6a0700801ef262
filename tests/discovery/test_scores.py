"""The scores of the validation, on outcomes made by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("numba", reason="the second simulator is compiled with numba: install the extra `bench`")

from tests.validation import validate_discover
from tests.validation.discover_cases import KINDS, all_cases
from tests.validation.discover_scores import Outcome, by_effect, confusions, misses, rates, times
from tests.validation.validate_discover import carry_out, document, done_before, run

GOOD = Outcome(
    case="a", kind="single", rig="fibre_mass", hidden="sensor.force_delay", base_gap=1.5, pink=0.0, scatter=0.0,
    verdict="named", added="sensor.force_delay", alike="", gap_before=2.0, gap_after=1.0, held_out=1.0, seconds=60.0,
    says="", processor_seconds=20.0, expected_gap=1.0,
)  # fmt: skip
LAG = replace(GOOD, case="b", added="sensor.force_lag")
WRONG = replace(GOOD, case="c", added="guide.viscous_friction")
ALIKE = replace(WRONG, case="d", alike="sensor.force_delay + guide.viscous_friction")
PAIR = replace(GOOD, case="e", kind="pair", hidden="fibre.hardening + sensor.force_delay", added="fibre.hardening")
NULL = replace(GOOD, case="f", kind="null", hidden="", base_gap=0.0, verdict="nothing_missing", added="")
ALARM = replace(NULL, case="g", verdict="named", added="guide.viscous_friction")
STRANGER = replace(GOOD, case="h", kind="outside", hidden="open.detent", verdict="unexplained", added="")
FAILED = replace(GOOD, case="i", verdict="error", added="", seconds=math.nan, says="ValueError: no")
ALL = [GOOD, LAG, WRONG, ALIKE, PAIR, NULL, ALARM, STRANGER, FAILED]


def test_a_member_of_the_class_is_right_but_not_exact() -> None:
    assert (GOOD.first_is_right, GOOD.exact) == (True, True)
    assert (LAG.first_is_right, LAG.exact) == (True, False)
    assert (WRONG.first_is_right, WRONG.exact) == (False, False)
    assert (ALIKE.first_is_right, ALIKE.exact) == (True, False)
    assert (PAIR.first_is_right, PAIR.exact) == (True, False)
    assert not FAILED.first_is_right


def test_rates() -> None:
    counted = {rate.what: (rate.hits, rate.cases) for rate in rates(ALL)}
    assert counted == {
        "one effect: right class first": (3, 5),
        "one effect: exactly its name": (1, 5),
        "nothing hidden: an effect named": (1, 2),
        "nothing hidden: called unexplained": (0, 2),
        "two effects: both named": (0, 1),
        "two effects: one of them first": (1, 1),
        "outside the catalogue: called unexplained": (1, 1),
        "not trusted, or failed": (1, 9),
    }


def test_rates_by_rig() -> None:
    found = rates([GOOD, WRONG, replace(GOOD, rig="pulley_drive")])[0]
    assert found.by_rig == ((1, 2), (1, 1))
    assert str(found).startswith("| one effect: right class first | 67 % (2 of 3) |")
    assert "| 1 of 2 | 1 of 1 |" in str(found)


def test_effects_too_weak_or_too_strong_are_not_counted() -> None:
    assert rates([replace(GOOD, base_gap=0.3), replace(GOOD, base_gap=5.0)])[0].cases == 0


def test_the_gap_closed_is_that_beyond_noise() -> None:
    assert GOOD.closed == replace(GOOD, expected_gap=math.nan).closed == 1.0
    assert replace(GOOD, gap_after=math.sqrt(2.5)).closed == pytest.approx(0.5)
    assert replace(GOOD, gap_after=0.9, expected_gap=0.9).closed == pytest.approx(1.0)
    assert math.isnan(replace(GOOD, rig="pulley_drive", expected_gap=math.nan).closed)


def test_tables() -> None:
    assert "| sensor.force_delay | fibre_mass | 5 | 3 | 1 | 100 % |" in by_effect(ALL)[-1]
    said = confusions(ALL)
    assert "- sensor.force_delay taken for guide.viscous_friction: 2" in said
    assert "- nothing taken for guide.viscous_friction: 1" in said
    assert times(ALL).startswith("A search took 60 s (median)")
    assert "20 s (median) and at most 20 s in nine cases of ten of processor time" in times(ALL)
    assert "processor" not in times([replace(GOOD, processor_seconds=math.nan)])
    assert times([FAILED]) == "No search has ended yet."
    assert "9 of 300 cases" in document(ALL, 300)


def test_every_miss_is_listed_with_what_there_was_to_find() -> None:
    assert misses([GOOD, NULL, STRANGER]) == []
    assert misses(ALL)[2:5] == [
        "| sensor.force_delay | fibre_mass | 1.50 | 2.00 | 1.00 | sensor.force_lag |  |",
        "| sensor.force_delay | fibre_mass | 1.50 | 2.00 | 1.00 | guide.viscous_friction |  |",
        "| sensor.force_delay | fibre_mass | 1.50 | 2.00 | 1.00 | guide.viscous_friction | sensor.force_delay, "
        "guide.viscous_friction |",
    ]


def test_cases_are_told_apart_and_every_beginning_is_mixed() -> None:
    cases = all_cases()
    assert len({case.name for case in cases}) == len(cases)
    assert sum(case.kind == "null" for case in cases) >= 100
    assert sum(case.kind == "single" for case in cases) >= 120
    assert {case.kind for case in cases[:12]} == set(KINDS)
    assert all_cases() == cases


def test_a_run_goes_on_where_another_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Here:
        """Carries out in this process what is handed to it."""

        def __init__(self, *args: object, **options: object) -> None: ...

        def __enter__(self) -> Here:
            return self

        def __exit__(self, *args: object) -> None: ...

        def submit(self, function: object, case: object) -> object:
            from concurrent.futures import Future

            future: Future[Outcome] = Future()
            future.set_result(replace(GOOD, case=case.name))  # type: ignore[attr-defined]
            return future

    monkeypatch.setattr(validate_discover, "ProcessPoolExecutor", Here)
    table = tmp_path / "cases.csv"
    run(all_cases()[:2], table, 1)
    run(all_cases()[2:3], table, 1)
    assert {outcome.case for outcome in done_before(table)} == {case.name for case in all_cases()[:3]}
    assert replace(done_before(table)[0], case="a") == GOOD


def test_a_table_of_fewer_columns_is_read_and_gets_the_others(tmp_path: Path) -> None:
    table = tmp_path / "cases.csv"
    run([], table, 1)
    header = table.read_text().strip()
    rows = [f"{GOOD.case},single,fibre_mass,sensor.force_delay,1.5,0.0,0.0,named,sensor.force_delay,,2.0,1.0,1.0,60.0,"]
    table.write_text("\n".join([header.removesuffix(",processor_seconds,expected_gap"), *rows]) + "\n")
    run([], table, 1)
    assert table.read_text().startswith(header)
    (outcome,) = done_before(table)
    assert math.isnan(outcome.processor_seconds)
    assert math.isnan(outcome.expected_gap)
    assert replace(outcome, processor_seconds=20.0, expected_gap=1.0) == GOOD


def test_a_fault_is_an_outcome(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(case: object) -> dict[str, object]:
        raise ValueError("no")

    monkeypatch.setattr(validate_discover, "_searched", broken)
    outcome = carry_out(all_cases()[0])
    assert (outcome.verdict, outcome.says) == ("error", "ValueError: no")
