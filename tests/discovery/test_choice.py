"""Where a search looks for a frequency, and the weak starts of a descent in the marginal likelihood."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fibrefit.discovery.engine.candidates import FREQUENCIES, MANY, SHAPES, _starts, absent_values
from fibrefit.discovery.engine.marginal import WEAK, weak_starts
from fibrefit.discovery.engine.supermodel import frame_of
from fibrefit.effects.catalogue import CATALOGUE, find_effect
from fibrefit.problem.task import Task


@pytest.mark.parametrize("begin", [_starts, weak_starts])
def test_a_frequency_is_looked_for_near_wherever_it_may_be(task: Task, begin: Any) -> None:
    resonance = find_effect("sensor.gauge_resonance")
    frame = frame_of(task, (resonance,))
    starts = begin(frame, absent_values(frame, 1), (resonance,))
    tried = {float(start[0, frame.names.index("sensor.gauge_resonance.natural_frequency")]) for start in starts}
    assert len(tried) == len(FREQUENCIES)
    assert len(starts) > MANY
    for frequency in np.geomspace(30.0, 1500.0, 40):
        assert min(abs(np.log(frequency / near)) for near in tried) < np.log(1.15)


def test_an_effect_enters_weakly_with_each_sign_and_shape(task: Task) -> None:
    stribeck, delay = CATALOGUE["guide.stribeck_friction"], CATALOGUE["sensor.force_delay"]
    frame = frame_of(task, (stribeck, delay))
    blank = absent_values(frame, 2)
    starts = weak_starts(frame, blank, (stribeck, delay))
    for effect in (stribeck, delay):
        for parameter in effect.parameters:
            column = frame.names.index(f"{effect.name}.{parameter.name}")
            tried = {float(start[0, column]) for start in starts}
            assert all(np.ptp(start[:, column]) == 0.0 for start in starts)
            assert all(parameter.lower <= value <= parameter.upper for value in tried)
            if parameter.name in effect.strength:
                away = {abs(value - parameter.null) / abs(parameter.typical - parameter.null) for value in tried}
                assert max(away) <= max(WEAK, effect.singular) * (1.0 + 1e-9)
                assert min(away) > 0.0
            elif parameter.log:
                assert len(tried) == len(SHAPES)
    added = [frame.names.index(f"{e.name}.{p.name}") for e in (stribeck, delay) for p in e.parameters]
    others = np.setdiff1d(np.arange(len(frame.names)), added)
    assert all(np.array_equal(start[:, others], blank[:, others]) for start in starts)
