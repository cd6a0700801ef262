"""Noise of a force that grows with the load: found where it is there, and only there."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fibrefit.problem.noise.readings import growth_and_error, growth_with_load, largest_load, louder_under_load
from fibrefit.problem.thresholds import GROWS
from tests.independent.sensors import Noise, logged

RATE = 2000.0
TIMES = np.arange(4000) / RATE
LOAD = 250.0 * np.where(TIMES > 0.3, 1.0 + np.cos(2.0 * np.pi * 11.0 * TIMES) * np.exp(-TIMES), 0.0)
"""An oscillation after a rest, which slack would not change much."""


def records(growth: float, seed: int, number: int = 5, **more: Any) -> list[Any]:
    """Force records of a logger."""
    random = np.random.default_rng(seed)
    noise = Noise(**{"rms": {"force": 0.4}, "pink": 0.5, "hum": {"force": 0.06}, "resolution": {"force": 0.02}} | more)
    noise = Noise(**{**noise.__dict__, "growth": growth})
    forces = [logged("force", LOAD, TIMES, noise, random, LOAD) for _ in range(number)]
    return [SimpleNamespace(channels={"force": force}) for force in forces]


@pytest.mark.parametrize("growth", [0.7, 1.5])
def test_growth_is_found_within_its_error(growth: float) -> None:
    away = []
    for seed in range(12):
        found, error = growth_and_error(records(growth, seed), "force")
        assert found > GROWS * error
        away.append((found - growth) / error)
    assert abs(np.mean(away)) < 3.0 / np.sqrt(12.0) + 0.3
    assert 0.4 < np.std(away) < 1.6


@pytest.mark.parametrize("more", [{}, {"freedom": 4.0}, {"slow": 0.7}, {"band": 200.0}, {"hum": {"force": 0.6}}])
def test_noise_that_does_not_grow_is_not_said_to(more: dict[str, Any]) -> None:
    assert all(growth_with_load(records(0.0, seed, **more), "force") == 0.0 for seed in range(20))


def test_the_ringing_of_a_gauge_is_no_noise() -> None:
    ringing = 50.0 * np.sin(2.0 * np.pi * 150.0 * TIMES) * LOAD / LOAD.max()
    traces = records(0.0, 1)
    traces = [SimpleNamespace(channels={"force": trace.channels["force"] + ringing}) for trace in traces]
    assert growth_with_load(traces, "force") == 0.0
    third = [np.abs(np.diff(trace.channels["force"], 3)) / np.sqrt(20.0) for trace in traces]
    still, loud = (np.median([row[part].mean() for row in third]) for part in (slice(0, 500), slice(700, 1500)))
    assert loud > 1.2 * still


def test_coarse_readings_tell_nothing() -> None:
    assert growth_and_error(records(1.0, 2, resolution={"force": 5.0}), "force") == (0.0, np.inf)


def test_holes_and_short_records_do_not_stop_it() -> None:
    traces = records(1.5, 3)
    traces[0].channels["force"][1000:1200] = np.nan
    assert growth_with_load(traces, "force") == pytest.approx(1.5, abs=0.6)
    few = [SimpleNamespace(channels={"force": np.full(20, np.nan)})]
    assert growth_and_error(few, "force") == (0.0, np.inf)


def test_readings_are_weighed_by_their_load() -> None:
    traces = records(1.0, 4)
    louder = louder_under_load(traces[0], "force", 1.0, largest_load(traces, "force"))
    assert louder[:500].max() < 1.05
    assert louder.max() == pytest.approx(2.0, abs=0.02)
