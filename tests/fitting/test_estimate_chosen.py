"""Which estimate is reported where inputs are noisy: of shared values, or of each record by itself; in louder noise."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fibrefit.fitting import checks as judge
from fibrefit.fitting import gls, identify, reported
from fibrefit.fitting.estimates import Why
from fibrefit.fitting.identify import How, _apart, _may_lose_bounces
from fibrefit.fitting.reported import Sound
from fibrefit.fitting.search.optimum import Ended
from fibrefit.fitting.thresholds import ROUGHLY
from fibrefit.study.summaries.check import Check
from tests.fitting.test_checks import gap

GOOD, BAD = judge.converged(0.0, True), judge.converged(1.0, True)


def found_with(ratio: float, why: str = "gls", *failed: str) -> Any:
    """An estimate with that gap, why it is reported, and identifiers of checks that failed."""
    checks = [Check(name=name, passed=False, identifier=name) for name in failed]
    return SimpleNamespace(gap=gap(ratio), expected_gap=1.0, input_errors={"drive": 1}, why=Why(why), checks=checks)


def task_with(*records: str | None, traces: int = 5) -> Any:
    """A task whose free values are shared (None) or of a record."""
    entries = [(None, record) for record in records]
    layout = SimpleNamespace(entries=entries, means_of=lambda local: np.zeros(1))
    return SimpleNamespace(traces=range(traces), problem=SimpleNamespace(layout=layout))


@pytest.mark.parametrize(
    ("found", "in_a_fit", "in_a_search"),
    [
        (found_with(1.0), False, False),
        (found_with(1.0, "not_noise"), True, False),
        (found_with(1.0, "not_converged"), True, False),
        (found_with(1.2, "louder"), True, False),
        (found_with(1.0, "robust"), False, False),
        (found_with(2.5), True, True),
    ],
)
def test_each_record_is_fitted_by_itself_where_shared_values_leave_no_noise(
    found: Any, in_a_fit: bool, in_a_search: bool
) -> None:
    several = task_with(None, "a")
    assert _may_lose_bounces(several, found, How()) is in_a_fit
    assert _may_lose_bounces(several, found, How(rivals=False)) is in_a_search
    # Of one record, of none that share a value, and of exact inputs there is nothing to try.
    for task in (task_with(None, traces=1), task_with("a", "b")):
        assert not _may_lose_bounces(task, found, How())
    exact = SimpleNamespace(**{**vars(found), "input_errors": {}})
    assert not _may_lose_bounces(several, exact, How())  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("own", "alike", "in_a_fit", "in_a_search"),
    [
        (found_with(1.0), found_with(1.1, "not_noise", "phases"), True, False),
        (found_with(1.0, "gls", "gap"), found_with(1.1, "not_noise", "gap", "phases"), True, False),
        # Other doubts are no fewer, and as many doubts say no less.
        (found_with(1.0, "gls", "gap"), found_with(1.1, "not_noise", "phases", "drive"), False, False),
        (found_with(1.0, "gls", "gap"), found_with(1.1, "louder", "gap"), False, False),
        # That error bars are too small says nothing of the values.
        (
            found_with(1.0, "loses_less", "gap", "error_bars"),
            found_with(1.1, "not_noise", "gap", "phases"),
            True,
            False,
        ),
        # What became of the starts is no doubt of either.
        (found_with(1.0, "gls", "starts"), found_with(1.1, "gls", "second_solver"), False, False),
        (found_with(1.0, "gls", "gap"), found_with(2.1), True, True),
    ],
)
def test_records_by_themselves_are_taken_where_less_is_held_against_them(
    own: Any, alike: Any, in_a_fit: bool, in_a_search: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(identify, "_concluded", lambda *of: own)
    ended = Ended(np.zeros((5, 1)), True, {})
    for rivals, taken in ((True, in_a_fit), (False, in_a_search)):
        found = _apart(task_with(None), None, None, alike, How(rivals=rivals), ended)  # type: ignore[arg-type]
        assert (found is own) is taken


def likelihood(sound: Sound, ratio: float, inputs: bool, monkeypatch: pytest.MonkeyPatch, differ: bool = False) -> str:
    """Why what is reported, of a likelihood that leaves records with such a gap."""
    seen = SimpleNamespace(record_gaps={"a": gap(1.0), "b": gap(ratio)}, gap=gap(ratio))
    of_gls: Any = reported.Reported(
        None, None, None, None, SimpleNamespace(records_differ=differ), seen, sound, {}, {}, 1.0  # type: ignore[arg-type]
    )  # fmt: skip
    monkeypatch.setattr(reported, "gls_estimate", lambda *of: SimpleNamespace(records_differ=differ))
    monkeypatch.setattr(reported, "_of_gls", lambda *of: of_gls)
    monkeypatch.setattr(reported, "_of_plain", lambda *of: of_gls)
    monkeypatch.setattr(reported, "_compared", lambda *of: ())
    task: Any = SimpleNamespace(problem=SimpleNamespace(soft_beyond=None))
    plain: Any = SimpleNamespace(input_errors={"drive": 1} if inputs else {})
    return reported.reported(task, plain, None, True).why.identifier  # type: ignore[arg-type]


def test_noise_that_is_louder_than_at_rest_lets_the_likelihood_stand(monkeypatch: pytest.MonkeyPatch) -> None:
    loud, quiet = judge.gap_is_noise(gap(1.2)), judge.gap_is_noise(gap(1.0))
    assert likelihood(Sound(GOOD, GOOD, loud, (GOOD, GOOD)), 1.2, True, monkeypatch) == "louder"
    # Of exact inputs there are no errors that plain least squares would take it for.
    assert likelihood(Sound(GOOD, GOOD, loud, (GOOD, GOOD)), 1.2, False, monkeypatch) == "not_noise"
    # Records that differ it would take for alike.
    assert likelihood(Sound(GOOD, GOOD, loud, (GOOD, GOOD)), 1.2, False, monkeypatch, differ=True) == "louder"
    assert likelihood(Sound(GOOD, GOOD, loud, (GOOD, BAD)), 1.2, False, monkeypatch, differ=True) != "louder"
    # Nor where a record leaves more, where it has the structure of no noise, whatever its size, or without a mode.
    assert likelihood(Sound(GOOD, GOOD, loud, (GOOD, GOOD)), 1.3, True, monkeypatch) == "not_noise"
    assert likelihood(Sound(GOOD, GOOD, loud, (GOOD, BAD)), 1.2, True, monkeypatch) == "not_noise"
    assert likelihood(Sound(GOOD, GOOD, quiet, (GOOD, BAD)), 1.0, True, monkeypatch) == "not_noise"
    assert likelihood(Sound(BAD, GOOD, loud, (GOOD, GOOD)), 1.2, True, monkeypatch) == "not_noise"


@pytest.mark.parametrize(
    ("promised", "rounds", "stands"),
    [
        ([9.0, 0.01], 2, 1),
        ([0.01, 0.01, 0.01], 2, 1),
        ([9.0, 0.2, 0.2, 0.01], 4, 3),
        ([0.2] * 9, gls.MOST_ROUNDS, gls.MOST_ROUNDS - 1),
        # What was reached stands where it cannot be come nearer to, but not before the noise was taken twice.
        ([9.0, 0.2, None], 3, 1),
        ([9.0, None], 2, None),
    ],
)
def test_a_mode_that_is_crept_up_to_gets_further_rounds(
    promised: list[float | None], rounds: int, stands: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[int] = []

    def evidence(*of: Any) -> Any:
        asked.append(len(asked))
        reduction = promised[asked[-1]]
        place = SimpleNamespace(predicted_reduction=reduction, place=None, sigma=None)
        return (
            None if reduction is None else SimpleNamespace(mode=place, number=asked[-1], posterior_roots=lambda: None)
        )

    monkeypatch.setattr(gls, "_laplace_evidence", evidence)
    monkeypatch.setattr(gls, "_estimate", lambda bars, evidence, seen, noise: evidence.number)
    for name in ("noise_of_residuals", "whitening_of"):
        monkeypatch.setattr(gls, name, lambda *of: ())
    seen: Any = SimpleNamespace(raw=1, problem=None, residuals=lambda *of: [None])
    seen.residuals_with_noise_power = lambda *of: None
    seen.through = lambda whitening: seen
    unknowns: Any = SimpleNamespace(local_of=lambda place: None)
    found: Any = gls._at_mode(None, unknowns, None, seen)  # type: ignore[arg-type]
    assert (found, len(asked)) == (stands, rounds)
    assert 0.01 <= ROUGHLY < 0.2
