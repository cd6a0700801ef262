"""Trials of plans: what is drawn, what is written of a further record, and what the table counts."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("numba", reason="the second simulator is compiled with numba: install the extra `bench`")

from fibrefit.discovery.model.finding import Choice
from fibrefit.study import load_study
from tests.validation.tables import append, read
from tests.validation.validate_plan import (
    ALIKE,
    PAIRS,
    STRENGTH,
    TOLD,
    Bench,
    Outcome,
    Trial,
    _nothing,
    _row,
    table_of,
    trials,
)

TRIAL = Trial("made here", 0, PAIRS[0])


def test_every_pair_has_its_turn_and_another_release_draws_other_trials() -> None:
    first = list(itertools.islice(trials("a"), len(PAIRS)))
    assert {trial.pair for trial in first} == set(PAIRS)
    assert len({trial.seed for trial in (*first, *itertools.islice(trials("b"), len(PAIRS)))}) == 2 * len(PAIRS)


@pytest.mark.parametrize("pair", PAIRS)
def test_what_is_hidden_can_be_found_and_hardly_be_told_from_its_rival(pair: tuple[str, str]) -> None:
    bench = Bench(replace(TRIAL, pair=pair))
    alone, beside = (bench.ideal.noncentrality([bench.truth], known) for known in ((), bench.rivals))
    assert beside < 1.05 * ALIKE
    assert 15.0 < alone < 1.05 * STRENGTH
    assert max(alone / STRENGTH, beside / ALIKE) > 0.95


def test_a_further_record_is_taken_under_the_conditions_of_the_plan(tmp_path: Path) -> None:
    bench = Bench(TRIAL)
    assert bench.hidden in TRIAL.pair
    choice = Choice(0, {"lift": 0.012, "inclination": math.radians(30.0), "added_mass": 3.096})
    record = bench.further(choice)
    study = load_study(bench.write(tmp_path, record))
    said = study.records[-1]
    assert (said.lift, said.weight_mass) == (pytest.approx(0.012), pytest.approx(6.192))
    assert said.inclination == pytest.approx(math.radians(30.0))
    # What it hangs from in the end is both masses, on that slope, up to the friction of the guide.
    load = 2.0 * 3.096 * 9.81 * math.sin(math.radians(30.0))
    assert float(np.mean(record.clean.force[-100:])) == pytest.approx(load, abs=2.0 * bench.base.friction)


def test_the_table_counts_what_is_told_apart(tmp_path: Path) -> None:
    told = _row(TRIAL, _nothing() | {"after": TOLD, "after_random": 0.9 * TOLD, "before": 0.0, "foretold": 0.9}, 9.0)
    failed = _row(replace(TRIAL, index=1), _nothing(), 1.0)
    path = tmp_path / "a.csv"
    for row in (told, failed):
        append(path, row, "case")
    lines = table_of(read(path, Outcome)).lines()
    assert "50.0 % (1 of 2" in lines[-1]
    assert "0.0 % (0 of 2" in lines[-1]
    assert "no case" in lines[-2]
