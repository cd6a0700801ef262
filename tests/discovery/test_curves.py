"""Free curves, and what is told from their shape; noise told from motion."""

from __future__ import annotations

import numpy as np
import pytest

from fibrefit.discovery.curves.free_form import Reading, described
from fibrefit.discovery.curves.probes import FINE_KNOTS, KNOTS, PROBES, FrictionOfPosition, TensionOfRate
from fibrefit.discovery.engine.thresholds import outdone
from fibrefit.discovery.search.search import moving
from fibrefit.problem.statement.observations import Trace
from fibrefit.problem.task import Task

PLACES = np.linspace(-0.02, 0.01, FINE_KNOTS)


def reading(heights: np.ndarray) -> Reading:
    return Reading(FrictionOfPosition, PLACES, heights, None)  # type: ignore[arg-type]


@pytest.mark.parametrize("probe", PROBES)
def test_a_curve_passes_through_its_heights_and_is_level_beyond(probe: type) -> None:
    heights = np.random.default_rng(1).normal(size=probe.knots)
    curve = probe(0.0, 2.0, *heights)
    knots = np.linspace(0.0, 2.0, probe.knots)
    middles = 0.5 * (knots[1:] + knots[:-1])
    np.testing.assert_allclose([curve.at(x) for x in knots], heights, atol=1e-12)
    np.testing.assert_allclose([curve.at(x) for x in middles], 0.5 * (heights[1:] + heights[:-1]), atol=1e-12)
    assert (curve.at(-1.0), curve.at(3.0)) == (heights[0], heights[-1])


def test_knots_over_the_position_are_finer() -> None:
    assert FrictionOfPosition.knots == FINE_KNOTS > TensionOfRate.knots == KNOTS
    assert FrictionOfPosition.strength == ("low",)
    assert len(FrictionOfPosition.parameters) == 2 + FINE_KNOTS


@pytest.mark.parametrize("periods", [2.0, 4.0])
def test_a_wave_is_counted_by_its_turns_whatever_its_level(periods: float) -> None:
    wave = np.sin(2.0 * np.pi * periods * np.linspace(0.0, 1.0, FINE_KNOTS))
    ripple = 0.05 * (-1.0) ** np.arange(FINE_KNOTS)
    assert f"rising and falling {round(2 * periods)} times over 30 mm" in described(reading(7.0 + wave + ripple))


def test_a_stop_is_told_by_where_it_begins() -> None:
    stop = np.maximum(PLACES - 0.005, 0.0) * 1e3
    says = described(reading(stop))
    assert "beyond a position of 5" in says
    assert "rising and falling" not in says


@pytest.mark.parametrize(("curve", "is_outdone"), [(900.0, True), (990.0, False), (1010.0, False)])
def test_a_curve_outdoes_names_only_beyond_what_its_knots_reach_by_chance(curve: float, is_outdone: bool) -> None:
    assert outdone(1000.0, 3, curve, 10, 1.0) == is_outdone
    assert not outdone(1000.0, 3, curve, 10, 10.0)


def test_motion_lies_between_the_rests(task: Task) -> None:
    for trace in task.traces:
        first, last = moving(trace)
        position = trace.channels["position"]
        assert 0 < first < last <= len(position)
        noise = np.std(position[:first])
        assert np.ptp(position[:first]) < 10.0 * noise < np.ptp(position[first:last])


def test_all_is_motion_where_no_rest_is_seen() -> None:
    times = np.arange(0.0, 1.0, 5e-4)
    wave = np.sin(20.0 * times) + 1e-3 * np.random.default_rng(2).normal(size=len(times))
    assert moving(Trace("wave", times, {"position": wave}, {}, {})) == (0, len(times))
