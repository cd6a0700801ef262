"""Asking which candidate is added: by number, by name, through a pipe, and when nobody answers."""

from __future__ import annotations

import io

import pytest

from fibrefit.cli.discover import ask_candidate, distinct_names, listed_steps
from fibrefit.cli.terminal import Terminal
from fibrefit.study.summaries.discovery import Candidate
from fibrefit.study.summaries.results import ParameterSummary

VISCOUS, DRAG, DELAY = "guide.viscous_friction", "guide.quadratic_drag", "sensor.force_delay"
VALUES = {
    name: ParameterSummary(value=value, std_error=error, unit=unit)
    for name, value, error, unit in (
        ("fibre.hardening.hardening", 20.0, 0.1, "1/m"),
        (f"{VISCOUS}.viscous_coefficient", 1.7651, 0.014, "N s/m"),
        (f"{VISCOUS}.shape", 0.5, float("inf"), "-"),
    )
}
FIRST = [
    Candidate(effect=name, gap_after=1.0 + i, evidence=1000.0 - i, parameters=VALUES if name == VISCOUS else {})
    for i, name in enumerate((VISCOUS, DRAG, DELAY))
]
PAIRS = [
    Candidate(effect=" + ".join(names), gap_after=1.0 + i, evidence=900.0 - i, parameters={})
    for i, names in enumerate(((VISCOUS, DELAY), (DRAG, DELAY), (VISCOUS, DRAG), (DRAG, "fibre.hardening")))
]


def answered(monkeypatch: pytest.MonkeyPatch, *lines: str) -> str | None:
    monkeypatch.setattr("sys.stdin", io.StringIO("".join(f"{line}\n" for line in lines)))
    return ask_candidate(FIRST)


@pytest.mark.parametrize(
    ("line", "chosen"), [("", VISCOUS), ("2", DRAG), (DELAY, DELAY), (" 3 ", DELAY), ("s", None), ("Stop", None)]
)
def test_an_answer(monkeypatch: pytest.MonkeyPatch, line: str, chosen: str | None) -> None:
    assert answered(monkeypatch, line) == chosen


def test_a_wrong_answer_is_asked_again(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert answered(monkeypatch, "0", "4", "guide.quadratic_drug", "2") == DRAG
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("is none of them") == 3
    assert f'"guide.quadratic_drug" is none of them. Did you mean "{DRAG}"?' in said.err


def test_the_end_of_the_input_stops(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert answered(monkeypatch) is None
    assert "no answer: stopped" in capsys.readouterr().err


def test_the_candidates_are_listed_beside_the_answer(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    answered(monkeypatch, "1")
    lines = capsys.readouterr().err.splitlines()
    assert lines[1].split() == ["effect", "gap", "after", "evidence", "its", "values"]
    assert lines[2].endswith("1.000      1000  1.765 +/- 0.014 N s/m, 0.5")
    assert lines[3].split() == ["2", DRAG, "2.000", "999"]


def test_a_pair_is_told_by_the_effect_no_earlier_one_holds() -> None:
    """The search takes the first candidate that holds the name it is given."""
    offered = distinct_names(PAIRS)
    for chosen, name in offered.items():
        first = next(candidate for candidate in PAIRS if name in candidate.effect.split(" + "))
        assert first.effect == chosen
    assert list(offered) == [PAIRS[0].effect, PAIRS[1].effect, PAIRS[3].effect]


def test_each_step_is_said_once(capsys: pytest.CaptureFixture[str]) -> None:
    with listed_steps(Terminal()) as tell:
        tell("trying", 0.1)
        tell("trying", 0.5)
        tell("fitting", None)
    assert capsys.readouterr().err == "... trying\n... fitting\n"


def test_quiet_steps(capsys: pytest.CaptureFixture[str]) -> None:
    with listed_steps(Terminal(quiet=True)) as tell:
        tell("trying", 0.1)
    assert capsys.readouterr().err == ""
