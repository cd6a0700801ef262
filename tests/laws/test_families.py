"""Effects of which there is one for each record of a series."""

from __future__ import annotations

import itertools
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.core.errors import StudyError
from fibrefit.laws.catalogue import CATALOGUE, entry_of, find_effect, select_effects
from fibrefit.laws.families import (
    family_of,
    goes_by_place,
    members,
    number_of_sets,
    of_each,
    of_records,
    shared_by,
)
from fibrefit.laws.law import extends
from fibrefit.rigs.catalogue import RIGS
from tests.simulation.drops import drop, respond

SLIP, CHANGE, OTHER = (CATALOGUE[n] for n in ("fibre.knot_slip", "fibre.stiffness_change", "study.other_fibre"))


def test_a_member_is_found_by_its_name_and_knows_its_record() -> None:
    third = find_effect("fibre.knot_slip@3")
    assert third is of_records(SLIP, 3)
    assert (third.name, third.records, family_of(third)) == ("fibre.knot_slip@3", (3,), "fibre.knot_slip")
    assert entry_of(third) is entry_of(SLIP)
    assert select_effects(["fibre.knot_slip@3", "fibre.knot_slip@1"], RIGS["fibre_mass"])[0] is third


@pytest.mark.parametrize(
    "name",
    [
        "fibre.knot_slip@0", "fibre.knot_slip@x", "fibre.hardening@2", "fibre.slip@2",
        "fibre.knot_slip@2-5", "fibre.knot_slip@1-1", "fibre.knot_slip@1-", "fibre.knot_slip@1-x",
        "fibre.knot_slip@12345678901", "fibre.knot_slip@1-100000000", "fibre.stiffness_change@1-5",
        "fibre.hardening@1-5",
        "study.other_fibre@4+2", "study.other_fibre@2+2", "study.other_fibre@2+", "study.other_fibre@0+2",
        "study.other_fibre@2+x", "study.other_fibre@1-3+5", "fibre.stiffness_change@2+4", "fibre.knot_slip@2+4",
    ],
)  # fmt: skip
def test_what_is_no_member_is_refused(name: str) -> None:
    with pytest.raises(StudyError, match="not in the catalogue"):
        find_effect(name)


def test_what_several_records_share_is_found_by_its_name() -> None:
    both = find_effect("study.other_fibre@2+4")
    assert both is of_records(OTHER, 2, 4) is shared_by(of_records(OTHER, 1), (2, 4))
    assert (both.name, both.records, family_of(both)) == ("study.other_fibre@2+4", (2, 4), "study.other_fibre")
    assert entry_of(both) is entry_of(OTHER)
    assert goes_by_place(both)


def test_sets_of_records_are_counted_once_with_the_rest() -> None:
    for records in range(4, 9):
        parts = {
            frozenset({frozenset(some), frozenset(range(records)) - set(some)})
            for size in range(2, records - 1)
            for some in itertools.combinations(range(records), size)
        }
        assert number_of_sets(records) == len(parts)
    assert number_of_sets(2) == number_of_sets(3) == 1.0


def test_what_happens_in_each_record_is_found_by_its_name() -> None:
    thrice = find_effect("fibre.knot_slip@1-3")
    assert thrice is of_each(SLIP, 3)
    assert (thrice.records, thrice.recurs, family_of(thrice)) == ((), 3, "fibre.knot_slip")
    assert [parameter.name for parameter in thrice.parameters] == ["slip", "instant", "instant_2", "instant_3"]
    assert entry_of(thrice) is entry_of(SLIP)
    # It is what single slips are, and not beside one of them.
    assert set(thrice.excludes) >= {one.name for one in members(SLIP, 3)[:3]}


def test_what_happens_in_each_record_does_so_at_the_instant_of_each() -> None:
    twice, values = of_each(SLIP, 2), {"slip": 1e-4, "instant": 0.5, "instant_2": 0.75}
    for order, at in ((1, 0.5), (2, 0.75), (3, None)):
        record = drop(801, order=order)
        found = respond(record, (twice,), **{f"{twice.name}.{name}": value for name, value in values.items()})
        one = find_effect(f"fibre.knot_slip@{order}")
        alone = {f"{one.name}.slip": 0.0 if at is None else 1e-4, f"{one.name}.instant": at or 0.5}
        # In a further record, of which no instant is known, nothing happens.
        for role, reading in respond(record, (one,), **alone).items():
            np.testing.assert_allclose(found[role], reading, rtol=0.0, atol=1e-9)


def test_there_is_a_member_for_each_record_that_could_be_told() -> None:
    assert [one.records for one in members(SLIP, 3)] == [(1,), (2,), (3,), ()]
    assert [one.records for one in members(SLIP, 1)] == [(1,)]
    # From the first record on is what the base model says, and the only record has no other to differ from.
    assert [one.records for one in members(CHANGE, 3)] == [(2,), (3,)]
    assert members(CHANGE, 1) == members(OTHER, 1) == ()
    assert members(CATALOGUE["fibre.hardening"], 3) == (CATALOGUE["fibre.hardening"],)


def test_all_that_changes_with_time_says_so() -> None:
    assert extends(SLIP)
    assert extends(CATALOGUE["study.clock"])
    assert extends(CATALOGUE["guide.loose_mass"])
    assert not extends(CHANGE)
    assert not any(effect.sudden and not effect.timed for effect in CATALOGUE.values())


@pytest.mark.parametrize(
    ("name", "records"),
    [("study.other_fibre@2", (2,)), ("fibre.stiffness_change@2", (2, 3)), ("study.other_fibre@1+3", (1, 3))],
    ids=["in", "since", "in both"],
)
def test_a_member_acts_in_its_records_and_in_no_other(name: str, records: tuple[int, ...]) -> None:
    effect = find_effect(name)
    values = {f"{name}.{p.name}": 0.1 for p in effect.parameters}
    stiffer = {"stiffness": 22e3} | ({"damping": 27.5} if name.startswith("study") else {})
    for order in (1, 2, 3):
        record = drop(401, order=order)
        found = respond(record, (effect,), **values)
        expected = respond(record, **(stiffer if order in records else {}))
        for role, reading in expected.items():
            np.testing.assert_allclose(found[role], reading, rtol=0.0, atol=1e-9)


def test_a_trend_counts_from_the_first_record() -> None:
    effect = CATALOGUE["fibre.stiffness_trend"]
    values = {"fibre.stiffness_trend.trend": 0.05}
    for order, stiffness in ((1, 20e3), (3, 22e3)):
        found = respond(drop(401, order=order), (effect,), **values)
        np.testing.assert_allclose(found["force"], respond(drop(401), stiffness=stiffness)["force"], atol=1e-8)


def test_the_instant_of_a_sudden_law_is_a_share_of_the_record() -> None:
    law = of_records(SLIP, 2)(jnp.asarray(1e-3), jnp.asarray(0.25))
    there, elsewhere = (law.in_record(jnp.asarray(n), jnp.asarray(4.0)) for n in (2.0, 1.0))
    assert float(there.instant) == 1.0
    assert float(there.slip) == 1e-3
    assert bool(elsewhere.absent())


OWN = """
from typing import ClassVar
import jax
import jax.numpy as jnp
from fibrefit.laws.law import GuideLaw, quantity


class Mine(GuideLaw):
    name: ClassVar[str] = "guide.mine"
    c: jax.Array = quantity("N s/m", "a coefficient", 1.0, lower=0.0)

    def force(self, position, velocity):
        return self.c * velocity

    def in_record(self, number, duration):
        return self.scaled({factor})
"""


@pytest.mark.parametrize(
    ("factor", "expected"),
    [("1.0 / duration", False), ("1.0 + number", True), ("jnp.where(number == 7.0, 2.0, duration)", True)],
)
def test_a_law_of_ones_own_goes_by_the_place_where_it_differs_there(
    tmp_path: Path, factor: str, expected: bool
) -> None:
    (tmp_path / "laws.py").write_text(OWN.replace("{factor}", factor), encoding="utf-8")
    assert goes_by_place(find_effect("laws.py:Mine", tmp_path)) is expected


def test_laws_of_the_catalogue_go_by_the_place_where_they_say_so() -> None:
    found = {name for name, effect in CATALOGUE.items() if not effect.family and goes_by_place(effect)}
    assert found == {"guide.friction_trend", "fibre.stiffness_trend", "fibre.length_trend"}
