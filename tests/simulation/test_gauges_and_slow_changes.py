"""Gauges that err and fibres that change slowly, against what their law says of a motion that is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fibrefit.laws.catalogue import CATALOGUE
from tests.simulation.drops import CONDITIONS, STEP, VALUES, drop, respond

GRAVITY = 9.81
EXACT = 1e-10
"""Of the range: readings are those of the same motion."""
MASS, STIFFNESS = CONDITIONS["weight_mass"], VALUES["stiffness"]
STRETCH = MASS * GRAVITY / STIFFNESS
"""Of the fibre by the weight at rest, in m."""
RECORD = drop(801)
LONG = drop(6001, lift=0.002)
"""By its end the weight hangs still."""


def of(name: str, **values: float) -> tuple[tuple, dict[str, float]]:
    return (CATALOGUE[name],), {f"{name}.{key}": value for key, value in values.items()}


def same(found: np.ndarray, expected: np.ndarray) -> None:
    np.testing.assert_allclose(found, expected, atol=EXACT * np.ptp(expected))


def test_a_gauge_that_is_not_linear_reads_a_parabola_of_the_force() -> None:
    effects, values = of("sensor.gauge_nonlinearity", nonlinearity=1e-3)
    found, true = respond(RECORD, effects, **values), respond(RECORD)
    same(found["force"], true["force"] * (1.0 + 1e-3 * true["force"]))
    same(found["position"], true["position"])


def test_a_position_with_a_periodic_error_repeats_it_over_its_scale() -> None:
    effects, values = of("sensor.position_ripple", sine=3e-5, cosine=-2e-5, period=4e-3)
    found, true = respond(RECORD, effects, **values), respond(RECORD)
    phase = 2.0 * math.pi * true["position"] / 4e-3
    same(found["position"], true["position"] + 3e-5 * np.sin(phase) - 2e-5 * np.cos(phase))
    same(found["force"], true["force"])


def test_crosstalk_reads_what_newton_says_the_weight_is_accelerated_by() -> None:
    """Hanging free of friction: gravity and the tension, which the gauge reads, are all that act on the weight."""
    effects, values = of("sensor.acceleration_crosstalk", seismic_mass=0.2)
    found, true = (respond(RECORD, e, friction=0.0, **v) for e, v in ((effects, values), ((), {})))
    same(found["force"], true["force"] + 0.2 * (GRAVITY - true["force"] / MASS))


@pytest.mark.parametrize("rate", [0.02, 0.5])
def test_under_a_hanging_weight_a_fibre_creeps_as_a_dashpot_in_series_does(rate: float) -> None:
    """Of k/r, with the damper of the fibre beside both."""
    effects, values = of("fibre.creep", creep_rate=rate)
    found = respond(LONG, effects, friction=0.0, damping=(damping := 100.0), **values)["position"]
    late = np.arange(4001, 6001)
    speed = np.polyfit(STEP * late, found[late], 1)[0]
    assert speed == pytest.approx(MASS * GRAVITY / (STIFFNESS / rate + damping), rel=1e-4)


def test_a_fibre_that_lengthens_lets_the_weight_hang_lower_by_all_that_has_come_together() -> None:
    effects, values = of("fibre.length_drift", drift=1e-4)
    found, without = (respond(LONG, e, friction=0.0, **v)["position"] for e, v in ((effects, values), ((), {})))
    assert found[-1] - without[-1] == pytest.approx(1e-4 * STEP * 6000, rel=1e-3)


def test_a_stiffness_that_wears_carries_the_weight_with_what_all_stretching_has_left_of_it() -> None:
    effects, values = of("fibre.stiffness_wear", wear=-5.0)
    # Let go where the fibre is just taut, the weight never comes back to where it would be slack.
    found = respond(drop(6001, lift=1e-6), effects, friction=0.0, **values)["position"]
    stretched = np.abs(np.diff(found)).sum()
    assert stretched > 0.01
    assert found[-1] == pytest.approx(STRETCH / (1.0 - 5.0 * stretched), rel=1e-3)
