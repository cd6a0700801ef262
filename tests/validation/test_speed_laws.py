"""Series of an independent simulator with and without a law of speed: how often it is found, how often made up.

A long study: ``pytest -m slow -s tests/validation/test_speed_laws.py``, or in pieces that are kept
``python -m tests.validation.validate_speed_laws``.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import pytest

from tests.independent.laws import DRIVE, DROP
from tests.validation.speed_laws import STRENGTHS, Asked, SpeedCase, ask, speed_cases
from tests.validation.tables import Share
from tests.validation.validate_speed_laws import tables

LAWFUL, LAWLESS = 15, 30
FOUND, MADE_UP = 0.9, 0.05
ROW = Asked(
    "a/fibre_mass/damping/0", DROP, "damping", 0.3, "speed_law", "fibre.damping_speed_curve", *[1.0] * 7, "", ""
)


@pytest.mark.slow
@pytest.mark.parametrize("rig", [DROP, DRIVE])
def test_a_law_is_found(rig: str) -> None:
    rows = [ask(case) for case in itertools.islice(speed_cases("suite", rig, lawful=True), LAWFUL)]
    print("\n".join(tables(rows)))
    assert sum(row.found for row in rows) >= FOUND * len(rows)


@pytest.mark.slow
@pytest.mark.parametrize("rig", [DROP, DRIVE])
def test_none_is_made_up_of_scatter(rig: str) -> None:
    rows = [ask(case) for case in itertools.islice(speed_cases("suite", rig, lawful=False), LAWLESS)]
    print("\n".join(tables(rows)))
    assert sum(row.made_up for row in rows) <= MADE_UP * len(rows)


def test_series_with_a_law_take_the_parameters_in_turn_and_no_seed_comes_twice() -> None:
    with_law = list(itertools.islice(speed_cases("a", DRIVE, lawful=True), 6))
    assert [case.parameter for case in with_law] == [*STRENGTHS, *STRENGTHS]
    without = list(itertools.islice(speed_cases("a", DRIVE, lawful=False), 6))
    others = list(itertools.islice(speed_cases("b", DRIVE, lawful=False), 6))
    assert len({case.seed for case in (*with_law, *without, *others)}) == 18


def test_what_is_hidden_is_as_strong_as_it_is_said_to_be() -> None:
    series, exponent = SpeedCase("a", DROP, "damping", 0).make()
    assert series.effects == {"fibre.damping_speed_exponent": {"damping_exponent": exponent}}
    assert 0.1 <= abs(exponent) <= 0.5
    assert len({record.base for record in series.records}) == 1
    blank, none = SpeedCase("a", DROP, "", 0).make()
    assert not blank.effects
    assert none == 0.0
    assert len({record.base for record in blank.records}) == len(blank.records)


def test_another_parameter_is_not_the_one_that_depends_on_speed() -> None:
    assert ROW.found
    assert ROW.among
    assert not replace(ROW, answer="constant", laws="").found
    both = replace(ROW, laws="fibre.damping_speed_exponent + guide.friction_power_law")
    assert both.among
    assert not both.found
    assert not replace(ROW, laws="guide.friction_speed_exponent").among


def test_what_ends_in_an_error_is_neither_found_nor_good() -> None:
    wrong = replace(ROW, answer="error", laws="", log_law=math.nan)
    assert wrong.made_up
    assert not wrong.found
    text = "\n".join(tables([ROW, wrong]))
    assert str(Share(1, 2)) in text
