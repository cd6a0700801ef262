"""That all that is timed gives the same answers; the timing itself is `make bench`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("numba", reason="the hand-written loop is compiled with numba: install the extra `bench`")

from tests.benchmarks import ours, rivals, simulations
from tests.benchmarks.limit import Drop, simulate, simulate_sensitive
from tests.benchmarks.problem import drop_task, fit_of, in_our_order
from tests.benchmarks.timing import Contender, Stopwatch, spoken

REFERENCE = Path(__file__).resolve().parent.parent / "data" / "reference" / "fibre_mass__base.csv.gz"

# Runge-Kutta steps of half a millisecond, 25 to a contact: measured 2e-6 of the range, and 1e-3 of the slopes.
READINGS, SLOPES = 1e-5, 2e-3
# LSODA at the tolerance the benchmark gives it.
EVENTS = 3e-5


@pytest.fixture(scope="module")
def reference() -> np.ndarray:
    return np.loadtxt(REFERENCE, delimiter=",", skiprows=1)


@pytest.fixture(scope="module")
def limit(reference: np.ndarray) -> tuple:
    """The hand-written loop under the conditions of the reference, whose first sample is one step after the start."""
    n = len(reference) + 1
    run = Drop(2e4, 25.0, 4.0, 3.096, 3.096 * 9.81, 0.012, 0.0)
    readings, slopes = np.empty((2, n)), np.empty((2, n, 5))
    simulate_sensitive(run, 5e-4, *readings, *slopes)
    plain = np.empty((2, n))
    simulate(run, 5e-4, *plain)
    np.testing.assert_allclose(plain, readings, rtol=1e-9, atol=1e-12)
    return readings[:, 1:], slopes[:, 1:]


def test_hand_written_readings(reference: np.ndarray, limit: tuple) -> None:
    for mine, column in zip(limit[0], reference[:, 1:3].T, strict=True):
        assert np.sqrt(np.mean((mine - column) ** 2)) <= READINGS * np.ptp(column)


def test_hand_written_slopes(reference: np.ndarray, limit: tuple) -> None:
    for i, columns in enumerate(((3, 4), (5, 6), (7, 8))):
        for mine, column in zip(limit[1][..., i], reference[:, columns].T, strict=True):
            assert np.sqrt(np.mean((mine - column) ** 2)) <= SLOPES * np.sqrt(np.mean(column**2))


def test_hand_written_slope_of_the_release() -> None:
    run, nudge, n = Drop(2e4, 2.0, 0.2, 3.096, 3.096 * 9.81, 0.012, 0.01), 1e-7, 800
    slopes, later, earlier, readings = np.empty((2, n, 5)), np.empty((2, n)), np.empty((2, n)), np.empty((2, n))
    simulate_sensitive(run, 5e-4, *readings, *slopes)
    simulate(run._replace(release=run.release + nudge), 5e-4, *later)
    simulate(run._replace(release=run.release - nudge), 5e-4, *earlier)
    difference = (later[1] - earlier[1]) / (2.0 * nudge)
    assert np.abs(slopes[1, :, 3] - difference).max() <= 1e-4 * np.abs(difference).max()


@pytest.mark.parametrize("case", sorted(simulations.CASES))
def test_ours_is_the_hand_written_loop(case: str) -> None:
    simulations.check(np.asarray(ours.start(simulations.CASES[case])), n_time=2000)


def test_a_difference_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ours, "GRAVITY", 9.8101)
    with pytest.raises(AssertionError, match="off by"):
        simulations.check(np.asarray(ours.start((2e4, 25.0, 4.0))), n_time=2000)


def test_rivals_simulate_the_same() -> None:
    fit = fit_of(drop_task())
    for r, record in enumerate(fit.records[:2]):
        values = np.concatenate([fit.start[:3], fit.start[3 + 2 * r : 5 + 2 * r]])
        run = Drop(*values[:3], record.mass, record.pull, record.lift, values[4])
        mine = np.empty((2, record.times.size))
        simulate(run, record.times[1], *mine)
        mine[1] += values[3]
        for rival in (rivals.simulate_events, rivals.simulate_smooth):
            for theirs, ours_ in zip(rival(record, values), mine, strict=True):
                assert np.sqrt(np.mean((theirs - ours_) ** 2)) <= EVENTS * np.ptp(ours_)


def test_the_problem_is_handed_over_whole() -> None:
    """Our residuals and those of the problem as a stranger sees it are the same numbers."""
    task = drop_task()
    fit = fit_of(task)
    np.testing.assert_array_equal(in_our_order(task, fit.start), task.start)
    ours_ = np.asarray(task.problem.residuals(task.start))
    theirs = rivals.residuals(fit, fit.start, rivals.simulate_events)
    assert np.sum(theirs**2) == pytest.approx(np.sum(ours_**2), rel=2e-3)


def test_more_records_repeat_the_series() -> None:
    task = drop_task(7)
    assert len(task.traces) == 7
    np.testing.assert_array_equal(task.traces[5].times, task.traces[0].times)


@pytest.mark.parametrize("busy", [False, True])
def test_timing_counts_every_turn(busy: bool) -> None:
    turns = {"a": 0, "b": 0}

    def work(name: str) -> None:
        turns[name] += 1
        sum(range(20_000))

    times = Stopwatch(busy).interleaved({"a": Contender(lambda: work("a"), 5, 2), "b": Contender(lambda: work("b"), 2)})
    assert turns == {"a": 6, "b": 3}
    assert 0.0 < times["a"].best <= times["a"].median
    assert [spoken(t) for t in (2.0, 0.0123, 4.56e-5)] == ["2 s", "12.3 ms", "45.6 µs"]
