"""Thresholds of what a study may ask for decide: with twice or half of one something else would be refused or told."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from fibrefit.study import rigs, thresholds
from fibrefit.study.summaries import discovery
from fibrefit.study.summaries.discovery import Candidate
from tests.brackets import Bracket
from tests.brackets import thresholds as names_in


def gains(nats: float) -> bool:
    """Whether a candidate that gains so much is told beside one that gains more."""
    found = [
        Candidate(effect=name, gap_after=1.0, evidence=size, parameters={}) for name, size in (("a", 9.0), ("b", nats))
    ]
    return len(discovery.listed_candidates(found, 5).shown) == 2


def stepped(steps: float) -> bool:
    """Whether a drive may be simulated with so many steps in its shortest period."""
    try:
        rigs.SweepSettings(sampling_rate=f"{12.0 * steps} Hz", highest="12 Hz")
    except ValidationError:
        return False
    return True


CASES = (
    Bracket("LEAST_LISTED", discovery, gains, 0.6, 0.4),
    Bracket("STEPS_A_PERIOD", rigs, stepped, 25.0, 15.0),
)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_what_is_asked_for_or_told_turns_at_the_threshold(case: Bracket, monkeypatch: pytest.MonkeyPatch) -> None:
    case.test(monkeypatch)


def test_no_threshold_is_without_a_case() -> None:
    assert names_in(thresholds) == {case.name for case in CASES}
