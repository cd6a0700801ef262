"""A fit that is stopped concludes with what there is."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.core.limits import check_time, cuts_noted, time_limit
from fibrefit.fitting import gls
from fibrefit.fitting.identify import How, identify
from fibrefit.fitting.result import Identification
from fibrefit.fitting.search.starts import STARTS_AT_ONCE, Searched, latin_hypercube_starts, search
from fibrefit.problem.task import Task
from fibrefit.report.sentences.fit import estimator_sentence, fit_sentence

STARTS = 4 * STARTS_AT_ONCE


def after(times: int) -> Callable[[], bool]:
    """Answers no so many times, and then yes for ever."""
    asked = 0

    def stop() -> bool:
        nonlocal asked
        asked += 1
        return asked > times

    return stop


def searched(
    task: Task, stop: Callable[[], bool], lost: tuple[int, ...] = (), horizons: np.ndarray | None = None
) -> Searched:
    layout = task.problem.layout
    frees = layout.free(latin_hypercube_starts(layout, task.start, task.spread, STARTS, 0))
    frees[list(lost)] = np.nan
    return search(task.problem, frees, task.horizons if horizons is None else horizons, lambda _: None, stop)


def test_the_best_start_is_followed_to_its_end(task: Task, found: Identification) -> None:
    assert task.horizons.shape[1] > 1
    stopped = searched(task, after(0))
    assert stopped.ended.sum() == 1
    assert np.flatnonzero(stopped.ended)[0] < STARTS_AT_ONCE
    assert stopped.descent.cost[stopped.ended][0] == pytest.approx(found.starts.cost.min(), rel=1e-6)


def test_starts_that_came_to_an_end_are_kept(task: Task) -> None:
    at_once = task.horizons[:, -1:]
    whole, stopped = (searched(task, stop, horizons=at_once) for stop in (lambda: False, after(1)))
    assert whole.ended.all()
    np.testing.assert_array_equal(stopped.ended, np.arange(STARTS) < 2 * STARTS_AT_ONCE)
    np.testing.assert_array_equal(stopped.descent.cost[stopped.ended], whole.descent.cost[stopped.ended])
    assert not np.isfinite(stopped.descent.cost[~stopped.ended]).any()


def test_where_no_start_can_be_followed_nothing_is_known(task: Task) -> None:
    with np.errstate(invalid="ignore"), pytest.raises(KeyboardInterrupt) as stopped:
        searched(task, after(0), lost=tuple(range(STARTS)))
    assert stopped.value.__notes__ == ["No start of the search had come anywhere yet; nothing was written."]


def test_the_result_says_that_it_is_not_whole(task: Task, found: Identification) -> None:
    cut = identify(task, starts=STARTS, stop=after(0))
    check = cut.checks[0]
    assert (check.name, check.passed) == ("the fit ran to its end", False)
    assert fit_sentence(check) == f"Interrupted: 1 of {STARTS} starts came to an end; the best of them is kept."
    assert "A second solver was not run." in [
        fit_sentence(check) for check in cut.checks if check.identifier == "second_solver"
    ]
    assert cut.status != "ok"
    errors = np.sqrt(np.diag(found.covariance))
    assert np.abs((cut.values - found.values) / errors).max() < 0.05


def test_profiles_that_were_found_are_kept(task: Task) -> None:
    asked = []

    def stop() -> bool:
        # Asked before other minima, before the second solver, and before each profile.
        asked.append(True)
        return len(asked) > 3

    cut = identify(task, 1, how=How(profile=True), stop=stop)
    kinds = [one.interval_kind for one in cut.parameters.values()]
    assert kinds == ["profile likelihood", "normal", "normal"]
    assert (
        fit_sentence(cut.checks[0])
        == "Interrupted: 1 of 1 starts came to an end; what should follow them was cut short."
    )


def test_a_fit_that_is_let_to_its_end_says_nothing_of_it(found: Identification) -> None:
    assert "the fit ran to its end" not in [check.name for check in found.checks]


def test_where_the_time_is_over_the_plain_estimate_is_told_and_why(task: Task, found: Identification) -> None:
    with time_limit(0.0):
        plain = identify(task, starts=1)
    assert (plain.gls, plain.why.identifier, plain.cut_short) == (None, "no_time", True)
    assert found.gls is not None
    assert not found.cut_short
    np.testing.assert_allclose(plain.values, found.plain.values, rtol=1e-5)
    assert estimator_sentence(plain.why).endswith("the time given ended before it was done.")


def test_a_look_at_errors_of_inputs_that_came_in_time_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    names, now = iter("bcd"), [0.0]

    def estimate(name: str) -> Any:
        return SimpleNamespace(name=name, seen=SimpleNamespace(raw=True), evidence=SimpleNamespace(mode=mode))

    def at_mode(*of: Any) -> Any:
        now[0] += 0.2
        return estimate(next(names))

    mode = SimpleNamespace(unknowns=None, place=None, sigma=None)
    lefts = {"a": 9.0, "b": 4.0, "c": 2.0, "d": 1.5}
    clock = SimpleNamespace(monotonic=lambda: now[0])
    monkeypatch.setattr(gls, "time", clock)
    monkeypatch.setattr("fibrefit.core.limits.time", clock)
    monkeypatch.setattr(gls, "_linearised_again", at_mode)
    monkeypatch.setattr(gls, "_linearisation", lambda _, found: gls._Linearisation(found, True, 0.5, lefts[found.name]))

    def kept(seconds: float) -> tuple[str, bool]:
        with time_limit(seconds), cuts_noted() as cuts:
            found = gls._relinearised(cast(Any, None), cast(Any, None), estimate("a"), True)
        return cast(Any, found).name, bool(cuts)

    # Two more are made, as there is no time for a third one.
    assert kept(0.5) == ("c", True)
    # A first one is tried in any case, unless there is no time at all.
    assert kept(0.0) == ("a", True)

    def late(*of: Any) -> Any:
        now[0] += 2.0
        check_time()

    names = iter("b")
    monkeypatch.setattr(gls, "_linearised_again", lambda _, bars, found: late() if found.name == "b" else at_mode())
    assert kept(1.0) == ("b", True)
    # Where nothing more is to be gained it is not the time that ends it.
    monkeypatch.setattr(gls, "_tells_more", lambda *of: False)
    assert kept(0.5) == ("a", False)


@pytest.mark.parametrize("coarse", [True, False])
def test_what_a_look_leaves_is_told_in_units_of_what_noise_leaves(
    monkeypatch: pytest.MonkeyPatch, coarse: bool
) -> None:
    # Within a bounce half a record counts, and noise leaves a twentieth of its variance where readings are coarse;
    # beyond, a lost bounce leaves as much as noise does where they are fine.
    noise = 0.05 if coarse else 1.0
    left = np.sqrt(np.where(np.arange(100) < 50, noise, 1.0 if coarse else 20.0))[None, None]
    downweight = np.where(np.arange(100) < 50, 1.0, 0.0)[None, None]
    problem = SimpleNamespace(linearised_at=lambda local: SimpleNamespace(residuals=left))
    monkeypatch.setattr(gls, "problem_at", lambda task, found: problem)
    monkeypatch.setattr(
        gls, "instant_weights", lambda _, downweight=1.0: np.broadcast_to(np.square(downweight), (1, 1, 100))
    )
    seen = SimpleNamespace(raw=SimpleNamespace(downweight=downweight))
    found: Any = SimpleNamespace(seen=seen, local=None, residuals=left * downweight)
    task: Any = SimpleNamespace(problem=problem, steps={"force": 1.0} if coarse else {})
    look = gls._linearisation(task, found)
    assert look.left == pytest.approx(0.5 * (1.0 + 20.0))
    assert (look.share, look.bends) == (0.5, False)
    assert gls._tells_more([look], True)
