"""Conditions that further records could be measured under: what was measured, wider, or what the rig is said to do."""

from __future__ import annotations

import numpy as np
import pytest

from fibrefit.rigs.catalogue import RIGS, rig_of
from fibrefit.rigs.rig import Rig

DROPS = {
    "weight_mass": [2.0, 2.0, 2.0],
    "added_mass": [0.0, 0.0, 0.0],
    "inclination": [np.pi / 2] * 3,
    "lift": [0.005, 0.01, 0.02],
}


def test_drops_vary_about_what_the_records_state() -> None:
    menu = RIGS["fibre_mass"].menu(DROPS)
    values = {name: sorted({conditions[name] for conditions in menu}) for name in menu[0]}
    assert values["lift"] == pytest.approx([0.005 / 1.5, 0.02, 0.03])
    assert values["inclination"] == pytest.approx([np.pi / 3, np.pi / 2]), "no guide hangs over"
    assert values["added_mass"] == pytest.approx([0.0, 1.0]), "none, or what makes half as much again"
    assert len(menu) == 3 * 2 * 2
    # 90 deg in radians may be rounded beyond pi/2, and is no slope of its own.
    rounded = DROPS | {"inclination": [np.nextafter(np.pi / 2, 2.0)] * 3}
    assert len(RIGS["fibre_mass"].menu(rounded)) == len(menu)
    # The peak force of a drop grows with the root of height times mass: none is more than half as hard again.
    hardest = max(one["lift"] * (2.0 + one["added_mass"]) for one in menu)
    assert np.sqrt(hardest / (0.02 * 2.0)) == pytest.approx(1.5)


def test_another_laboratory_is_offered_its_own_sizes() -> None:
    light = RIGS["fibre_mass"].menu(DROPS | {"weight_mass": [0.1] * 3, "lift": [0.001] * 3})
    assert sorted({conditions["added_mass"] for conditions in light}) == pytest.approx([0.0, 0.05])
    assert max(conditions["lift"] for conditions in light) == 0.0015


def test_a_mass_that_was_added_is_widened_with_the_weight_it_is_added_to() -> None:
    loaded = RIGS["pulley_drive"].reach(
        {"weight_mass": [3.0, 3.0], "added_mass": [0.0, 5.0], "inclination": [0.5, 0.5], "lift": [0.0, 0.0]}
    )
    assert loaded["added_mass"] == pytest.approx((0.0, 1.5 * 8.0 - 3.0))
    assert loaded["inclination"] == pytest.approx((0.5 / 1.5, 0.75))


def test_what_a_rig_is_said_to_do_takes_the_place_of_what_was_measured() -> None:
    rig = rig_of("fibre_mass", possible=(("lift", (0.004, 0.05)), ("inclination", (np.pi / 2, np.pi / 2))))
    assert rig.reach(DROPS)["lift"] == (0.004, 0.05)
    menu = rig.menu(DROPS)
    assert sorted({one["lift"] for one in menu}) == [0.004, 0.02, 0.05]
    assert {one["inclination"] for one in menu} == {np.pi / 2}
    assert RIGS["fibre_mass"].possible == {}


@pytest.mark.parametrize("rig", RIGS.values(), ids=list(RIGS))
def test_what_varies_is_a_condition_of_the_rig(rig: Rig) -> None:
    known = {condition.name for condition in rig.conditions}
    assert all({v.condition, v.onto or v.condition} <= known for v in rig.further)


def test_a_rig_without_a_choice_has_no_menu() -> None:
    assert RIGS["guided_mass"].menu({"gain": [1.0]}) == ()
