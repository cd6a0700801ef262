"""Conditions that further records could be measured under: multiples of what the records at hand state."""

from __future__ import annotations

import numpy as np
import pytest

from fibrefit.rigs.catalogue import RIGS
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
    assert values["lift"] == pytest.approx([0.0025, 0.02, 0.04])
    assert values["inclination"] == pytest.approx([np.pi / 4, np.pi / 2]), "no guide hangs over"
    assert values["added_mass"] == pytest.approx([0.0, 2.0]), "none, or as much again"
    assert len(menu) == 3 * 2 * 2


def test_another_laboratory_is_offered_its_own_sizes() -> None:
    light = RIGS["fibre_mass"].menu(DROPS | {"weight_mass": [0.1] * 3, "lift": [0.001] * 3})
    assert {conditions["added_mass"] for conditions in light} == {0.0, 0.1}
    assert max(conditions["lift"] for conditions in light) == 0.002


@pytest.mark.parametrize("rig", RIGS.values(), ids=list(RIGS))
def test_what_varies_is_a_condition_of_the_rig(rig: Rig) -> None:
    known = {condition.name for condition in rig.conditions}
    assert all({v.condition, v.of or v.condition} <= known for v in rig.further)


def test_a_rig_without_a_choice_has_no_menu() -> None:
    assert RIGS["guided_mass"].menu({"gain": [1.0]}) == ()
