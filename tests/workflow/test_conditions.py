"""Conditions of records side by side: numbers, words, and when each was taken."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from fibrefit.workflow.together.conditions import SINCE, since_the_first, stated_conditions


@dataclass
class Row:
    """Of a study: what it says of one record."""

    lift: float = 0.01
    excitation: str | None = None
    taken: datetime | None = None

    def __iter__(self):
        return iter(self.__dict__.items())

    def uncertainty(self, condition: str) -> float:
        """All is known exactly."""
        return 0.0


def at(hour: int) -> datetime:
    return datetime(2026, 3, 14, hour)


def test_times_count_from_the_first_wherever_it_stands() -> None:
    rows = [Row(taken=at(11)), Row(taken=at(9)), Row()]
    found = {one.name: one for one in stated_conditions({"lift": "m"}, rows)}
    np.testing.assert_equal(found[SINCE].values, [2.0 / 24.0, 0.0, np.nan])
    assert found[SINCE].unit == "d"


def test_nothing_is_said_of_what_no_record_states() -> None:
    assert [one.name for one in stated_conditions({"lift": "m", "rate": "m/s"}, [Row(), Row()])] == ["lift"]


def test_a_word_is_one_for_each_value_but_the_first_and_unknown_where_it_is_not_said() -> None:
    rows = [Row(excitation="trapezoid"), Row(excitation="rectangle"), Row()]
    found = {one.name: one.values for one in stated_conditions({}, rows)}
    assert list(found) == ["excitation trapezoid"]
    np.testing.assert_equal(found["excitation trapezoid"], [1.0, 0.0, np.nan])


def test_times_that_do_not_compare_are_not_compared() -> None:
    local, zoned = at(9), at(8).replace(tzinfo=UTC)
    np.testing.assert_equal(since_the_first([local, zoned, at(9).replace(tzinfo=UTC)]), [np.nan, 0.0, 1.0 / 24.0])
