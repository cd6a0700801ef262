"""Conditions of records side by side: numbers, words, and when each was taken."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from fibrefit.study import load_study
from fibrefit.study.summaries.results import ParameterSummary
from fibrefit.workflow.fit_files import conditions_of_record
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


STUDY = """schema = "fibrefit/study/1"
name = "drops"
[rig]
kind = "fibre_mass"
weight_mass = "3.1 kg"
inclination = "90 +/- 1 deg"
fibre_length = "599 mm"
[[records]]
file = "a.csv"
weight_mass = "3.2 kg"
added_mass = "100 +/- 2 g"
release = "0.1 s"
[[records]]
file = "b.csv"
lift = "5 mm"
"""


def test_a_record_is_kept_with_what_is_stated_of_it_and_what_was_found_in_its_place(tmp_path: Path) -> None:
    """Constants of the rig among them; neither what is a parameter of all records, nor where something happens."""
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text("t [s],F [N],x [mm]\n")
    (tmp_path / "study.toml").write_text(STUDY)
    study = load_study(tmp_path)
    own = {
        "lift": ParameterSummary(value=0.0102, std_error=1e-4, unit="m"),
        "release": ParameterSummary(value=0.1, unit="s", free=False),
        "position_zero": ParameterSummary(value=1e-3, std_error=1e-5, unit="m"),
    }
    first = conditions_of_record(study, 0, own)
    assert {name: (one.value, one.unit, one.found) for name, one in first.items()} == {
        "weight_mass": (3.2, "kg", False),
        "added_mass": (0.1, "kg", False),
        "fibre_length": (0.599, "m", False),
        "lift": (0.0102, "m", True),
    }
    assert (first["added_mass"].std_error, first["lift"].std_error) == (0.002, 1e-4)
    held = {"lift": ParameterSummary(value=0.005, unit="m", free=False)}
    second = conditions_of_record(study, 1, held)
    assert (second["lift"].value, second["lift"].found, second["weight_mass"].value) == (0.005, False, 3.1)


def test_a_pure_number_is_a_condition_too(tmp_path: Path) -> None:
    rig = '[rig]\nkind = "guided_mass"\ngain = 1.2\nwindow = "0.1 s"\n[[records]]\nfile = "a.csv"\n'
    (tmp_path / "a.csv").write_text("t [s],F [N],x [mm]\n")
    (tmp_path / "study.toml").write_text(f'schema = "fibrefit/study/1"\nname = "axis"\n{rig}')
    found = conditions_of_record(load_study(tmp_path), 0, {})
    assert {name: (one.value, one.unit) for name, one in found.items()} == {"gain": (1.2, "-")}
