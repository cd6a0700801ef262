"""Which of the explanations a search goes on with, and where it looks for a frequency."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.discovery.engine.candidates import FREQUENCIES, MANY, Hypothesis, _starts, absent_values
from fibrefit.discovery.engine.supermodel import frame_of
from fibrefit.discovery.search.search import Search
from fibrefit.effects.catalogue import find_effect
from fibrefit.problem.task import Task


def explanation(cost: float, size: int) -> Hypothesis:
    """Something with so many parameters that leaves this sum of squares."""
    return cast(Hypothesis, SimpleNamespace(fit=SimpleNamespace(cost=cost), size=size))


@pytest.fixture
def search(task: Task) -> Search:
    """One over so many samples that sums of squares within 500 are alike."""
    nothing = cast(Any, None)
    return Search(task, (), nothing, nothing, kappa=1.0, slowest=1.0, samples=50_000.0, tell=lambda what, share: None)


def test_of_explanations_alike_the_simplest_is_taken(search: Search) -> None:
    over, best, plain = explanation(60_000.0, 0), explanation(50_000.0, 2), explanation(50_300.0, 1)
    assert search.simplest([best, plain, explanation(51_000.0, 1)], over) is plain


def test_a_simple_one_that_explains_little_is_not_like_the_best(search: Search) -> None:
    # The best gains 200: within 500 of it are all that gain nothing.
    over, best, idle = explanation(50_200.0, 0), explanation(50_000.0, 2), explanation(50_170.0, 1)
    assert search.simplest([best, idle], over) is best
    assert search.alike(best, [best, idle], over) == [best]


def test_a_frequency_is_looked_for_near_wherever_it_may_be(task: Task) -> None:
    resonance = find_effect("sensor.gauge_resonance")
    frame = frame_of(task, (resonance,))
    starts = _starts(frame, absent_values(frame, 1), (resonance,))
    tried = {float(start[0, frame.names.index("sensor.gauge_resonance.natural_frequency")]) for start in starts}
    assert len(tried) == len(FREQUENCIES)
    assert len(starts) > MANY
    for frequency in np.geomspace(30.0, 1500.0, 40):
        assert min(abs(np.log(frequency / near)) for near in tried) < np.log(1.15)
