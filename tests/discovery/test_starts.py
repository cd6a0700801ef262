"""Which effects a search follows."""

from __future__ import annotations

from typing import Any, cast

import pytest

from fibrefit.discovery.engine.screening import PredictedGain
from fibrefit.discovery.engine.thresholds import BEYOND_DOUBT
from fibrefit.discovery.search.starts import (
    EffectStart,
    is_left_to_follow,
    is_worth_following,
    little_is_missing,
    may_do_better,
)
from fibrefit.laws.catalogue import find_effect


@pytest.mark.parametrize(
    ("predicted_gain", "gain", "expected"),
    [(1.0, 0.0, True), (1.0, BEYOND_DOUBT, True), (101.0, 200.0, True), (99.0, 200.0, False), (60.0, 120.1, False)],
)
def test_what_explains_beyond_doubt_leaves_out_what_is_predicted_to_gain_far_less(
    predicted_gain: float, gain: float, expected: bool
) -> None:
    assert may_do_better(predicted_gain, gain) is expected


@pytest.mark.parametrize(
    ("gap", "predicted_gain", "expected"),
    [
        (1.05, 5000.0, True),
        (1.15, BEYOND_DOUBT, True),
        (1.15, BEYOND_DOUBT + 1.0, False),
        (1.5, 0.0, False),
    ],
)
def test_slopes_lead_to_what_is_missing_where_it_is_little(gap: float, predicted_gain: float, expected: bool) -> None:
    """By its size, or, as where noise is louder than at rest, by what slopes predict at the most."""
    assert little_is_missing(gap, predicted_gain) is expected


def test_slopes_at_a_null_where_the_model_changes_its_kind_are_not_asked() -> None:
    play, drag = find_effect("drive.play"), find_effect("guide.quadratic_drag")
    assert is_worth_following(play, -50.0, 0.0)
    assert is_worth_following(play, 30.0, 200.0, 20.0)
    assert not is_worth_following(play, 10.0, 200.0, 20.0)
    assert not is_worth_following(drag, -1.0, -10.0)
    assert not is_worth_following(drag, 3.0, 4.0)
    assert is_worth_following(drag, 5.0, 4.0)


@pytest.mark.parametrize(
    ("effect", "predicted_gain", "gain", "expected"),
    [
        ("guide.quadratic_drag", 0.3, 0.0, True),
        ("guide.quadratic_drag", 0.3, 90.0, False),
        ("guide.quadratic_drag", 5.0, 90.0, True),
        ("guide.quadratic_drag", 5.0, 120.0, False),
        ("drive.play", -3.0, 90.0, True),
        ("drive.play", -3.0, 120.0, False),
    ],
)
def test_what_slopes_predict_next_to_nothing_of_is_not_followed_beside_what_gains_much(
    effect: str, predicted_gain: float, gain: float, expected: bool
) -> None:
    prediction = PredictedGain(predicted_gain, {}, {}, {})
    start = EffectStart(predicted_gain, find_effect(effect), cast(Any, None), prediction, cast(Any, None))
    assert is_left_to_follow(start, gain) is expected


def test_an_effect_is_followed_last_from_where_slopes_were_taken() -> None:
    far, weak, slight = ({"guide.quadratic_drag.drag_coefficient": value} for value in (0.3, 0.2, 0.003))
    assert PredictedGain(50.0, far, weak, slight).starts == [far, weak, slight]
    assert PredictedGain(50.0, weak, weak, slight).starts == [weak, slight]
    assert PredictedGain(50.0, weak, weak, weak).starts == [weak]
