"""Limits of time: the nearest one holds, in threads too, and what comes too late is told."""

from __future__ import annotations

import time

import pytest

from fibrefit.core.limits import (
    Budget,
    OutOfTimeError,
    beyond_limits,
    check_time,
    cuts_noted,
    in_time,
    note_cut,
    time_for,
    time_left,
    time_limit,
)
from fibrefit.core.threads import for_each
from fibrefit.discovery.engine.candidates import fit_all


def test_without_a_limit_there_is_always_time() -> None:
    check_time()
    assert time_left() == float("inf")


def test_the_nearest_limit_holds_and_ends_with_its_block() -> None:
    with time_limit(100.0):
        with time_limit(0.0), pytest.raises(OutOfTimeError):
            check_time()
        check_time()
        with time_limit(1000.0):
            assert time_left() <= 100.0


def test_what_comes_too_late_is_told() -> None:
    assert in_time(lambda: 3, 0) == (3, True)
    assert in_time(lambda: check_time() or 3, 0, seconds=0.0) == (0, False)


def test_work_that_ends_for_lack_of_time_is_noted() -> None:
    with cuts_noted() as cuts:
        assert time_for(1e9)
        with time_limit(10.0):
            assert time_for(1.0)
            assert not cuts
            assert not time_for(100.0)
        with cuts_noted() as inside:
            for_each(lambda _: note_cut(), range(3))
    assert (len(cuts), len(inside)) == (1, 3)
    assert 0.0 < cuts[0] <= 10.0
    note_cut()  # Where nobody asks it is nothing.


def test_an_error_is_no_lack_of_time() -> None:
    with pytest.raises(ZeroDivisionError):
        in_time(lambda: 1 / 0, 0)


def test_a_limit_holds_in_the_threads_of_a_search() -> None:
    with time_limit(0.0):
        assert fit_all([lambda: 1, lambda: 2], lambda done: None) == [None, None]
    assert fit_all([lambda: 1, lambda: 2], lambda done: None) == [1, 2]


def test_a_limit_holds_in_the_threads_that_share_out_records() -> None:
    def asks(record: int) -> int:
        check_time()
        return record

    with time_limit(0.0), pytest.raises(OutOfTimeError):
        for_each(asks, range(8))
    assert for_each(asks, range(8)) == list(range(8))


def test_jobs_that_began_in_time_and_ask_are_ended() -> None:
    def long() -> str:
        for _ in range(3000):
            check_time()
            time.sleep(0.01)
        return "not ended"

    # The short one comes first: it is done long before the time is over, however busy the machine is.
    with time_limit(2.0):
        assert fit_all([lambda: 1, long, long], lambda done: None) == [1, None, None]


def test_a_budget_counts_from_its_beginning() -> None:
    budget = Budget(10.0)
    assert 9.0 < budget.left <= 10.0
    assert budget.used + budget.left == pytest.approx(10.0, abs=0.1)


def test_a_few_last_steps_go_on_beyond_a_limit_and_it_holds_again_after_them() -> None:
    with time_limit(0.0):
        with beyond_limits():
            check_time()
            assert time_left() == float("inf")
        with pytest.raises(OutOfTimeError):
            check_time()
