"""Other minima, held against the one that is reported."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fibrefit.fitting import minima
from fibrefit.fitting.identify import How, identify
from fibrefit.fitting.minima import Led, Minima, SecondSolver
from fibrefit.fitting.result import Starts
from fibrefit.study import load_study
from fibrefit.workflow.prepare import task_of
from tests.validation.cases import interval_cases


def starts_of(cost: list[float]) -> Starts:
    """As many minima as starts."""
    of, each = np.array(cost), np.arange(float(len(cost)))[:, None]
    return Starts(("stiffness",), each, each, each, of, np.ones(len(cost), dtype=int), np.arange(len(cost)), len(cost))


def beside(
    monkeypatch: pytest.MonkeyPatch,
    led: dict[float, Led],
    noise: bool = True,
    may_be_noise: bool = True,
    gls: Any = True,
) -> Minima:
    """Minima of one shared value, which tells them apart; the likelihood leads from each to what is stated."""
    monkeypatch.setattr(minima, "_led", lambda gls, values: led[float(values[0])])
    sound = SimpleNamespace(gap=SimpleNamespace(passed=noise), may_be_noise=may_be_noise)
    best: Any = SimpleNamespace(sound=sound, gls=gls or None, input_errors={"drive": 1})
    plain: Any = SimpleNamespace(input_errors={"drive": 1}, values=np.zeros(1), problem=None)
    monkeypatch.setattr(minima, "convergence_unit", lambda problem, bars: 1.0)
    bars: Any = SimpleNamespace(errors={"white": np.ones(1)}, method="white")
    second = SecondSolver(np.array([7.0]), 3.0, -5.0)
    return Minima(None, starts_of([1.0, 1.01, 1.02]), second, plain, bars, best, True)  # type: ignore[arg-type]


SAME, WORSE, AS_GOOD = Led(0.3, 0.1), Led(4.0, 12.0), Led(4.0, 3.0)


@pytest.mark.parametrize(
    ("ends", "passed", "nats"),
    [((SAME, SAME, SAME), True, np.inf), ((SAME, WORSE, SAME), True, 12.0), ((SAME, WORSE, AS_GOOD), False, 3.0)],
)
def test_starts_of_noisy_inputs_agree_where_the_likelihood_leads_from_them(
    ends: tuple[Led, ...], passed: bool, nats: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    led = dict(zip((0.0, 1.0, 2.0), ends, strict=True))
    check = beside(monkeypatch, led).starts_agree()
    assert check.passed is passed
    assert check.facts["nats"] == nats
    # Slow noise is louder than at rest, and has its spectrum; what has neither its size nor its structure is none.
    assert beside(monkeypatch, led, noise=False).starts_agree().passed is passed
    assert not beside(monkeypatch, led, noise=False, may_be_noise=False).starts_agree().passed


def test_without_a_likelihood_the_next_minimum_is_fitted_with_its_inputs(monkeypatch: pytest.MonkeyPatch) -> None:
    fits = {1.0: 40.0, 2.0: 4.0}
    monkeypatch.setattr(minima, "optimum", lambda task, values: SimpleNamespace(values=values + 5.0))
    monkeypatch.setattr(minima, "_objective", lambda end: fits.get(float(end.values[0]) - 5.0, 0.0))
    assert beside(monkeypatch, {}, gls=False).starts_agree().passed
    fits[1.0] = 4.0
    assert not beside(monkeypatch, {}, gls=False).starts_agree().passed


@pytest.mark.parametrize(("end", "passed"), [(SAME, True), (WORSE, True), (AS_GOOD, False)])
def test_what_a_second_solver_found_is_followed_in_the_likelihood(
    end: Led, passed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert beside(monkeypatch, {7.0: end}).second_solver_agrees().passed is passed
    # Without one its end is another minimum, and says so.
    assert not beside(monkeypatch, {}, gls=False).second_solver_agrees().passed


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
