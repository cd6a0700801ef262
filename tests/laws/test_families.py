"""Effects of which there is one for each record of a series."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.core.errors import StudyError
from fibrefit.laws.catalogue import CATALOGUE, entry_of, find_effect, select_effects
from fibrefit.laws.families import family_of, members, of_record
from fibrefit.laws.law import extends
from fibrefit.rigs.catalogue import RIGS
from tests.simulation.drops import drop, respond

SLIP, CHANGE, OTHER = (CATALOGUE[n] for n in ("fibre.knot_slip", "fibre.stiffness_change", "study.other_fibre"))


def test_a_member_is_found_by_its_name_and_knows_its_record() -> None:
    third = find_effect("fibre.knot_slip@3")
    assert third is of_record(SLIP, 3)
    assert (third.name, third.record, family_of(third)) == ("fibre.knot_slip@3", 3, "fibre.knot_slip")
    assert entry_of(third) is entry_of(SLIP)
    assert select_effects(["fibre.knot_slip@3", "fibre.knot_slip@1"], RIGS["fibre_mass"])[0] is third


@pytest.mark.parametrize("name", ["fibre.knot_slip@0", "fibre.knot_slip@x", "fibre.hardening@2", "fibre.slip@2"])
def test_what_is_no_member_is_refused(name: str) -> None:
    with pytest.raises(StudyError, match="not in the catalogue"):
        find_effect(name)


def test_there_is_a_member_for_each_record_that_could_be_told() -> None:
    assert [one.record for one in members(SLIP, 3)] == [1, 2, 3]
    # From the first record on is what the base model says, and the only record has no other to differ from.
    assert [one.record for one in members(CHANGE, 3)] == [2, 3]
    assert members(CHANGE, 1) == members(OTHER, 1) == ()
    assert members(CATALOGUE["fibre.hardening"], 3) == (CATALOGUE["fibre.hardening"],)


def test_all_that_changes_with_time_says_so() -> None:
    assert extends(SLIP)
    assert extends(CATALOGUE["study.clock"])
    assert extends(CATALOGUE["guide.loose_mass"])
    assert not extends(CHANGE)
    assert not any(effect.sudden and not effect.timed for effect in CATALOGUE.values())


@pytest.mark.parametrize(
    ("name", "records"), [("study.other_fibre@2", (2,)), ("fibre.stiffness_change@2", (2, 3))], ids=["in", "since"]
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
    law = of_record(SLIP, 2)(jnp.asarray(1e-3), jnp.asarray(0.25))
    there, elsewhere = (law.in_record(jnp.asarray(n), jnp.asarray(4.0)) for n in (2.0, 1.0))
    assert float(there.instant) == 1.0
    assert float(there.slip) == 1e-3
    assert bool(elsewhere.absent())
