"""Which estimate is reported where inputs are noisy: of shared values, or of each record by itself; in louder noise."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fibrefit.fitting import checks as judge
from fibrefit.fitting import gls, identify
from fibrefit.fitting.checks import DECIDING
from fibrefit.fitting.evaluated import EvaluatedEstimate, How, SearchEnd
from fibrefit.fitting.identify import _rescued
from fibrefit.fitting.result import Why
from fibrefit.fitting.search.optimum import Ended
from fibrefit.fitting.thresholds import ROUGHLY
from fibrefit.study.summaries.check import SIZE, Check
from tests.fitting.test_checks import gap

GOOD, BAD = (
    judge.check("convergence", judge.converged(0.0, True)),
    judge.check("convergence", judge.converged(1.0, True)),
)


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
    found: Any, in_a_fit: bool, in_a_search: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def asked(task: Any, how: How, **facts: Any) -> bool:
        called: list[bool] = []
        monkeypatch.setattr(identify, "each_by_itself", lambda *of: called.append(True))
        of: Any = SimpleNamespace(**{**vars(found), **facts}, record_gaps={})
        assert _rescued(task, of, how, None, None, lambda: False) is of  # type: ignore[arg-type]
        return bool(called)

    several = task_with(None, "a")
    assert asked(several, How()) is in_a_fit
    assert asked(several, How(rivals=False)) is in_a_search
    # Of one record, of none that share a value, and of exact inputs there is nothing to try.
    for task in (task_with(None, traces=1), task_with("a", "b")):
        assert not asked(task, How())
    assert not asked(several, How(), input_errors={})


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
    monkeypatch.setattr(identify, "each_by_itself", lambda *of: Ended(np.zeros((5, 1)), True, {}))
    alike = SimpleNamespace(**{"why": Why("not_noise"), **vars(alike), "record_gaps": {}})
    for rivals, taken in ((True, in_a_fit), (False, in_a_search)):
        # In a search only what shared values lose is a reason to try.
        lost = SimpleNamespace(**{**vars(alike), "expected_gap": 1.0 if rivals else 0.1})
        of: Any = (task_with(None, "a"), lost, How(rivals=rivals), None, lambda ended: own, lambda: False)
        assert (_rescued(*of) is own) is taken


def likelihood(
    monkeypatch: pytest.MonkeyPatch, ratio: float, inputs: bool = True, differ: bool = False, **outcomes: Check
) -> str:
    """Why what is reported, of a likelihood that leaves records with such a gap."""
    found = {row.identifier: GOOD for row in DECIDING} | outcomes
    passed = {name: (check.model_copy(update={"identifier": name}),) for name, check in found.items()}
    plain: Any = SimpleNamespace(input_errors={"drive": 1} if inputs else {}, expected_gap=1.0)
    starts = SimpleNamespace(cost=np.zeros(1))
    task: Any = SimpleNamespace(problem=SimpleNamespace(soft_beyond=None))
    search: Any = SearchEnd(task, How(), starts, None, plain, None)  # type: ignore[arg-type]
    seen = SimpleNamespace(record_gaps={"a": gap(1.0), "b": gap(ratio)}, gap=gap(ratio))
    gls = SimpleNamespace(records_differ=differ, expected_gap=1.0)
    of_gls: Any = EvaluatedEstimate(
        search, plain, None, None, None, (), None, gls, seen, {}, 0.0, outcomes=passed  # type: ignore[arg-type]
    )  # fmt: skip
    monkeypatch.setattr(identify, "gls_estimate", lambda *of: gls)
    monkeypatch.setattr(identify, "_of_gls", lambda *of: of_gls)
    monkeypatch.setattr(identify, "_of_plain", lambda *of: of_gls)
    monkeypatch.setattr(identify, "_compared", lambda *of: ())
    return identify.reported(search).why.identifier


def test_noise_that_is_louder_than_at_rest_lets_the_likelihood_stand(monkeypatch: pytest.MonkeyPatch) -> None:
    loud, quiet = (judge.check(SIZE, judge.gap_is_noise(gap(ratio))) for ratio in (1.2, 1.0))
    assert likelihood(monkeypatch, 1.2, residual_size=loud) == "louder"
    # Of exact inputs there are no errors that plain least squares would take it for.
    assert likelihood(monkeypatch, 1.2, inputs=False, residual_size=loud) == "not_noise"
    # Records that differ it would take for alike.
    assert likelihood(monkeypatch, 1.2, inputs=False, differ=True, residual_size=loud) == "louder"
    differ = likelihood(monkeypatch, 1.2, inputs=False, differ=True, residual_size=loud, residual_phase=BAD)
    assert differ != "louder"
    # Nor where a record leaves more, where it has the structure of no noise, whatever its size, or without a mode.
    assert likelihood(monkeypatch, 1.3, residual_size=loud) == "not_noise"
    assert likelihood(monkeypatch, 1.2, residual_size=loud, residual_phase=BAD) == "not_noise"
    assert likelihood(monkeypatch, 1.0, residual_size=quiet, residual_phase=BAD) == "not_noise"
    assert likelihood(monkeypatch, 1.2, residual_size=loud, convergence=BAD) == "not_noise"


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
