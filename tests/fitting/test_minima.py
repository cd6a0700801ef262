"""Other minima, held against the one that is reported."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fibrefit.core.limits import check_time, time_limit
from fibrefit.fitting import checks as judge
from fibrefit.fitting.identify import How, identify
from fibrefit.fitting.result import Starts
from fibrefit.fitting.search import rescue as identifying
from fibrefit.fitting.search.rescue import SecondSolver
from fibrefit.fitting.search.solve import Descent
from fibrefit.problem.estimate.gauss_newton import Effort, mode
from fibrefit.study import load_study
from fibrefit.study.summaries.check import Check
from fibrefit.workflow.prepare import task_of
from tests.problem.toys import NAMES, begun, gram_of, unknowns
from tests.validation.cases import interval_cases

TRUTH = np.array([0.3, -0.2, 0.5])


def starts_of(cost: list[float]) -> Starts:
    """As many minima as starts."""
    of, each = np.array(cost), np.arange(float(len(cost)))[:, None]
    return Starts(("stiffness",), each, each, each, of, np.ones(len(cost), dtype=int), np.arange(len(cost)), len(cost))


Led = tuple[float, float]
"""Where the likelihood leads from another minimum: see `likelihood_continued_from`."""


def beside(
    monkeypatch: pytest.MonkeyPatch, led: dict[float, Led], noise: bool = True, gls: bool = True, **facts: Any
) -> Any:
    """An estimate of one shared value, which tells minima apart; the likelihood leads from each to what is stated."""
    monkeypatch.setattr(judge, "likelihood_continued_from", lambda gls, values: led[float(values[0])])
    monkeypatch.setattr(judge, "optimum", lambda task, values: Any)
    plain = SimpleNamespace(
        input_errors={"drive": 1}, values=np.zeros(1), problem=None, local=0.0, coefficients=None,
        differ=facts.get("differ", False),
    )  # fmt: skip
    search = SimpleNamespace(
        task=None,
        how=How(rivals=facts.get("compared", True)),
        starts=facts.get("starts", starts_of([1.0, 1.2, 1.3])),
        second=SecondSolver(np.array([7.0]), 3.0, -5.0),
        plain=plain,
        bars=SimpleNamespace(errors={"white": np.ones(1)}, method="white"),
        unit=1.0,
    )
    like = facts.get("like", noise)
    return SimpleNamespace(search=search, gls=gls or None, may_be_noise=like, passed=lambda identifier: noise)


def starts_check(estimate: Any) -> Check:
    return judge.check("starts", judge.best_minimum(estimate))


def second_check(estimate: Any) -> Check:
    return judge.check("second_solver", judge.second_solver_agrees(estimate))


SAME, WORSE, AS_GOOD, MISSED, LOST = (0.3, 0.1), (4.0, 12.0), (4.0, 3.0), (0.3, -20.0), (np.inf, 0.0)
OUTCOMES = [
    ((SAME, SAME, SAME), True, np.inf),
    ((SAME, WORSE, SAME), True, 12.0),
    ((SAME, WORSE, AS_GOOD), False, 3.0),
    ((SAME, SAME, MISSED), False, -20.0),
    ((SAME, LOST, SAME), False, 0.0),
]


@pytest.mark.parametrize(("ends", "passed", "nats"), OUTCOMES)
def test_starts_of_noisy_inputs_agree_where_the_likelihood_leads_from_them(
    ends: tuple[Led, ...], passed: bool, nats: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    led = dict(zip((0.0, 1.0, 2.0), ends, strict=True))
    check = starts_check(beside(monkeypatch, led))
    assert check.passed is passed
    assert check.facts["nats"] == nats
    # Slow noise is louder than at rest; what has neither the size nor the structure of noise is none.
    assert starts_check(beside(monkeypatch, led, noise=False, like=True)).passed is passed
    assert not starts_check(beside(monkeypatch, led, noise=False)).passed
    unknown = starts_check(beside(monkeypatch, led, noise=False, differ=True))
    assert (unknown.passed, unknown.facts["nats"]) == (False, None)
    # Nor are others followed in a search for effects.
    assert not starts_check(beside(monkeypatch, led, compared=False)).passed


def test_one_start_that_ended_alone_says_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    lonely = starts_of([1.0, np.inf, np.inf])
    lonely = replace(lonely, basin=np.array([0, -1, -1]))
    for gls in (True, False):
        assert not starts_check(beside(monkeypatch, {0.0: SAME}, gls=gls, starts=lonely)).passed


def test_no_start_counts_for_records_that_were_followed_by_themselves(monkeypatch: pytest.MonkeyPatch) -> None:
    all_one = replace(starts_of([1.0, 1.0, 1.0]), basin=np.zeros(3, dtype=int))
    same, worse, as_good = (
        starts_check(beside(monkeypatch, {0.0: led}, starts=all_one, differ=True)) for led in (SAME, WORSE, AS_GOOD)
    )
    assert same.statistic == 0.0
    assert (same.passed, worse.passed) == (True, True)
    assert not starts_check(beside(monkeypatch, {0.0: AS_GOOD}, starts=all_one, differ=True)).passed
    assert starts_check(beside(monkeypatch, {0.0: AS_GOOD}, starts=all_one)).passed
    assert as_good.statistic == 0.0


def test_without_a_likelihood_the_next_minima_are_fitted_with_their_inputs(monkeypatch: pytest.MonkeyPatch) -> None:
    fits = {0.0: 0.0, 1.0: 40.0, 2.0: 4.0}
    of = beside(monkeypatch, {}, gls=False)
    ends = {
        key: SimpleNamespace(values=np.array([5.0 + key]), problem=key, local=0.0, coefficients=None) for key in fits
    }
    monkeypatch.setattr(judge, "optimum", lambda task, values: ends[float(values[0])])
    monkeypatch.setattr(judge, "objective", lambda problem, local, coefficients: fits.get(problem, 0.0))
    # All that differ count, whatever their order as measured.
    assert not starts_check(of).passed
    fits[2.0] = 30.0
    assert starts_check(of).passed
    ends[1.0].values = np.array([0.5])
    assert starts_check(of).facts["nats"] == 15.0


@pytest.mark.parametrize("lost", [False, True])
def test_ends_are_compared_at_the_values_of_each_record(monkeypatch: pytest.MonkeyPatch, lost: bool) -> None:
    """An end whose motion is lost, of which there are no numbers, is no better one."""
    values, left = np.array([[1.0], [2.0]]), np.array([3.0, np.nan if lost else 4.0])

    def linearised(problem: str, at: np.ndarray) -> Any:
        assert problem == "the problem"
        assert at is values
        return SimpleNamespace(residuals=left)

    monkeypatch.setattr(judge, "linearised", linearised)
    waves = {"drive": np.array([[1.0], [1.0]])}
    assert judge.objective("the problem", values, waves) == (np.inf if lost else 27.0)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("end", "passed"), [(SAME, True), (WORSE, True), (AS_GOOD, False), (MISSED, False), (LOST, False)]
)
def test_what_a_second_solver_found_is_followed_in_the_likelihood(
    end: Led, passed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert second_check(beside(monkeypatch, {7.0: end})).passed is passed
    # Without one its end is another minimum, and says so.
    assert not second_check(beside(monkeypatch, {}, gls=False)).passed


class Swing:
    """Four records of a swing, of which a frequency some periods off is a minimum of its own."""

    def __init__(self, sigma: float = 0.0) -> None:
        self.of, samples = unknowns(()), np.arange(400)
        truth = self.of.value(TRUTH)

        def residuals(local: np.ndarray) -> np.ndarray:
            swing = np.sin(0.02 * local[:, :1] * samples) - np.sin(0.02 * truth[0] * samples)
            lost = np.where(local[:, :1] > 3.0 * truth[0], np.nan, 0.0)
            return np.concatenate([30.0 * swing + lost, local[:, 1:] - [*truth[1:], 0.0, 0.0]], axis=1)

        self.gram = gram_of(residuals)
        best = mode(self.of, begun(self.of, TRUTH), self.gram, np.zeros(0))
        entries = [(None, record) for record in (None, None, None, 0, 0)]
        layout = SimpleNamespace(
            local=lambda values: np.repeat(np.asarray(values)[None], 4, axis=0),
            entries=[(SimpleNamespace(name=name), record) for name, (_, record) in zip(NAMES, entries, strict=True)],
            means_of=lambda local: np.r_[local[:, :3].mean(axis=0), local[0, 3:]],
        )
        seen = SimpleNamespace(gram=lambda of: self.gram, problem=SimpleNamespace(layout=layout))
        errors = SimpleNamespace(errors={"whitened": np.full(5, 1e-2)}, method="whitened")
        self.gls: Any = SimpleNamespace(evidence=SimpleNamespace(mode=best), seen=seen, bars=errors)
        self.best = np.concatenate([best.values, np.zeros(2)])

    def led(self, factor: float) -> Led:
        """From a frequency so many times too high."""
        return judge.likelihood_continued_from(self.gls, self.best * np.array([factor, 1.0, 1.0, 1.0, 1.0]))


def test_the_likelihood_is_followed_from_elsewhere_to_its_end() -> None:
    swing = Swing()
    near, far, lost = (swing.led(factor) for factor in (1.003, 1.3, 5.0))
    assert near[0] < 0.1
    assert abs(near[1]) < 0.1
    assert far[0] > 1.0
    assert far[1] > 100.0
    assert lost == (np.inf, 0.0)
    with time_limit(-1.0):

        def ended(*of: Any) -> Any:
            check_time()

        swing.gls.seen.gram = lambda of: ended
        assert swing.led(1.003) == (np.inf, 0.0)


def test_an_end_that_may_still_fall_is_no_less_probable_than_where_the_next_step_leads(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    swing = Swing()
    whole = swing.led(1.003)
    monkeypatch.setattr(judge, "mode", partial(mode, effort=Effort(steps=1)))
    cut = swing.led(1.003)
    assert cut[1] < 0.5
    assert cut[0] > whole[0]


@pytest.mark.slow
def test_records_whose_differences_errors_of_the_drive_would_take_up_are_told_apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Five driven weights 1 % apart under hum: values that all share leave 0.996 of the noise, 4 to 7 errors off.
    case = next(iter(interval_cases("2026-11-27r", "pulley_drive", "hum", 0.01)))
    case = next(c for c in interval_cases("2026-11-27r", "pulley_drive", "hum", 0.01) if c.index == case.index + 2)
    truth = case.write(tmp_path).series.base
    task = task_of(load_study(tmp_path))
    found = identify(task, 8, 0)
    of = {one.name: one.found for one in found.estimates}
    assert found.status == "ok"
    for name in ("stiffness", "damping", "friction"):
        low, high = of[name].interval_95 or (np.nan, np.nan)
        assert low < getattr(truth, name) < high
    # The negative control: as a search for effects begins.
    alike = identify(task, 8, 0, How(rivals=False))
    assert abs(alike.values[1] / truth.damping - 1.0) > 0.005


@pytest.mark.parametrize("better", [2, 9])
def test_what_a_second_solver_gained_is_no_longer_to_be_gained(monkeypatch: pytest.MonkeyPatch, better: int) -> None:
    """The values go where it led, each time, as further starts; the last chance leaves nothing behind."""
    costs = iter([90.0, 80.0, *([70.0] if better > 2 else [80.0])])
    entries = [(SimpleNamespace(name="stiffness"), None)]
    layout = SimpleNamespace(free=lambda values: values, values=lambda free: free, entries=entries)
    problem: Any = SimpleNamespace(layout=layout, n_measured=100)
    task: Any = SimpleNamespace(problem=problem, counts=np.array([[1]]))
    row, none = np.zeros((1, 1)), np.zeros(1, dtype=int)
    starts = Starts(("stiffness",), row, row, row, np.array([100.0]), none, none, 1)
    last = [100.0]

    def second_opinion(*of: Any) -> Any:
        last[0] = next(costs)
        return SimpleNamespace(values=np.zeros(1), cost=last[0])

    def descend(*of: Any) -> Descent:
        return Descent(np.full(1, last[0]), last[0], 1, True)

    monkeypatch.setattr(identifying, "rough_errors", lambda *of: np.ones(1))
    monkeypatch.setattr(identifying, "second_opinion", second_opinion)
    monkeypatch.setattr(identifying, "descend", descend)
    found, second = identifying.with_second_solver(task, lambda: np.ones(1), starts, lambda: False)
    assert second is not None
    assert second.gain == 0.0
    assert found.best == (found.cost.min(), found.cost.min())
    # No start but the last one ended in the best minimum.
    assert (found.agreeing, found.tried) == (1, len(found.cost)) == (1, 3 + (better > 2))
