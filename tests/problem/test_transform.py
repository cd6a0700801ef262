"""Free coordinates: there and back, inside the limits, monotone, alike in NumPy and JAX."""

from __future__ import annotations

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fibrefit.core.declarations import Parameter
from fibrefit.problem.statement.layout import NUDGE, Range

ROUND_TRIP = 1e-9
"""A logarithm or a root there, an exponential or a square back: digits are lost at the foot of a map."""

sizes = st.floats(1e-3, 1e6)
places = st.floats(0.02, 0.98)


@st.composite
def ranges(draw: st.DrawFn) -> Range:
    """Every kind of range, of any size."""
    scale, log = draw(sizes), draw(st.booleans())
    lower, upper = draw(st.booleans()), draw(st.booleans())
    if log:
        low = scale * draw(st.floats(1e-3, 0.5)) if lower else 0.0
        return Range(low, scale * draw(st.floats(2.0, 1e3)) if upper else math.inf, scale, True)
    low = scale * draw(st.floats(-50.0, 0.5)) if lower else -math.inf
    return Range(low, scale * draw(st.floats(1.0, 500.0)) if upper else math.inf, scale)


def inside(limits: Range, place: float) -> float:
    """A value that lies well inside."""
    low = limits.lower if math.isfinite(limits.lower) else -10.0 * limits.scale
    high = limits.upper if math.isfinite(limits.upper) else 10.0 * limits.scale
    if limits.log:
        low = max(low, 1e-2 * limits.scale)
        return low * (high / low) ** place
    return low + place * (high - low)


@given(ranges(), places)
def test_there_and_back(limits: Range, place: float) -> None:
    value = inside(limits, place)
    back = float(limits.value(limits.free(np.float64(value))))
    assert back == pytest.approx(value, rel=ROUND_TRIP, abs=ROUND_TRIP * limits.scale)


@given(ranges(), st.floats(-1e3, 1e3))
def test_no_coordinate_leaves_the_range(limits: Range, free: float) -> None:
    with np.errstate(over="ignore"):
        value = float(limits.value(np.float64(free)))
    slack = 1e-12 * max(limits.scale, abs(value) if math.isfinite(value) else 0.0)
    assert limits.lower - slack <= value <= limits.upper + slack


@given(ranges(), st.lists(st.floats(0.0, 40.0), min_size=2, max_size=8))
def test_one_way_only(limits: Range, frees: list[float]) -> None:
    """Up, or down from an upper limit alone; a map with one limit folds at zero and is used on one side."""
    values = np.diff(limits.value(np.sort(np.array(frees))))
    sign = -1.0 if limits.bounded == (False, True) else 1.0
    assert np.all(sign * values >= -1e-12 * limits.scale)


@settings(deadline=None, max_examples=50)  # JAX compiles where it has not met a shape
@given(ranges(), st.floats(-30.0, 30.0))
def test_numpy_and_jax_agree(limits: Range, free: float) -> None:
    here, there = limits.value(np.float64(free)), limits.value(jnp.asarray(free))
    assert isinstance(there, jax.Array)
    assert not isinstance(here, jax.Array)
    assert float(there) == pytest.approx(float(here), rel=1e-12, abs=1e-12 * limits.scale)


@settings(deadline=None, max_examples=50)  # JAX compiles where it has not met a shape
@given(ranges(), st.floats(-1e3, 1e3))
def test_the_slope_is_finite_everywhere(limits: Range, free: float) -> None:
    free = float(np.clip(free, -600.0, 600.0)) if limits.log else free
    assert math.isfinite(float(jax.grad(limits.value)(free)))


@pytest.mark.parametrize("log", [False, True])
def test_a_start_at_a_limit_is_put_beside_it_where_the_map_has_a_slope(log: bool) -> None:
    limits = Range(2.0, 50.0, 4.0, log)
    for limit in (2.0, 50.0):
        free = limits.free(np.float64(limit))
        assert float(jax.grad(limits.value)(float(free))) > 0.0
        moved = float(limits.line(limits.value(free)) - limits.line(np.float64(limit)))
        assert abs(moved) == pytest.approx(NUDGE, rel=1e-6)


def test_a_small_value_in_a_wide_range_is_itself() -> None:
    damping = Range(0.0, 1e4, 20.0)
    assert float(damping.value(damping.free(np.float64(0.5)))) == pytest.approx(0.5, rel=ROUND_TRIP)


def test_limits_of_a_person_narrow_those_of_the_parameter_and_never_widen_them() -> None:
    declared = Range.of(Parameter("x", "N", "", 3.0, lower=0.0, upper=10.0))
    assert declared.within(-5.0, 4.0) == Range(0.0, 4.0, 3.0)
    assert declared.within(None, 40.0) == Range(0.0, 10.0, 3.0)


def test_a_value_is_at_a_bound_only_within_the_tolerance() -> None:
    limits = Range(0.0, 10.0, 1.0)
    assert limits.at_bound(0.01, 0.02)
    assert limits.at_bound(9.99, 0.02)
    assert not limits.at_bound(0.03, 0.02)


def test_a_parameter_that_vanishes_at_infinity_spans_decades() -> None:
    assert Range.of(Parameter("x", "Hz", "", 300.0, lower=1.0, null=math.inf, reciprocal=True)).log
