"""The line of progress: what it says, and that its share never runs ahead of the time."""

from __future__ import annotations

import math

import pytest

from fibrefit.sampling.chains import SamplerProgress
from fibrefit.sampling.settings import Settings
from fibrefit.workflow.sampling.progress import followed, line_of, share_of, spoken


def test_before_the_first_look_it_says_what_is_known() -> None:
    early = SamplerProgress(12, 4000, 3.0, math.nan, 0.4444)
    assert line_of(early, Settings()) == "step 12, accepted 44 %"
    assert share_of(early, Settings()) is None


def test_it_tells_time_left_acceptance_and_agreement_with_their_goals() -> None:
    later = SamplerProgress(75, 4000, 30.0, 200.0, 0.45, 1.0234, 311.4)
    assert line_of(later, Settings()) == ("step 75, 3 min left, accepted 45 %, R-hat 1.023, ESS 311/400")
    assert share_of(later, Settings()) == pytest.approx(30.0 / 230.0)


def test_a_budget_in_seconds_bounds_what_is_left() -> None:
    later = SamplerProgress(75, 4000, 30.0, 200.0, 0.45, 1.02, 311.0)
    assert share_of(later, Settings(max_seconds=40.0)) == pytest.approx(0.75)
    assert share_of(later, Settings(max_seconds=20.0)) == 1.0


def test_listeners_are_told_both() -> None:
    said: list[tuple[str, float | None]] = []
    followed(lambda *words: said.append(words), Settings())(SamplerProgress(1, 10, 1.0, 1.0, 0.5, 1.1, 10.0))
    assert said[0][0].startswith("step 1")
    assert said[0][1] == 0.5


@pytest.mark.parametrize(
    ("seconds", "says"), [(0.4, "0 s"), (89.0, "89 s"), (150.0, "2 min"), (5399.0, "90 min"), (7200.0, "2.0 h")]
)
def test_times_are_spoken(seconds: float, says: str) -> None:
    assert spoken(seconds) == says
