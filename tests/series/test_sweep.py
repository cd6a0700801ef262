"""A pendulum over frequencies: what is known of its jumps, its stability, and what stands out in a curve."""

from __future__ import annotations

import functools
import math

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.rigs.catalogue import RIGS
from fibrefit.series import sweep as sweeping
from fibrefit.series.jumps import jumps, ranges
from fibrefit.series.sweep import Branch, Conditions, Plan, SweptCurve, sweep
from fibrefit.simulation.model import Model
from tests.simulation.drops import PENDULUM_CONDITIONS, pendulum, respond

VALUES = {"stiffness": 8264.0, "damping": 4.13}
#: Angles known to two digits.
TWO_DIGITS = 0.01
#: Steps of 1 ms against those of 0.5 ms, and extremes at samples only.
SAMPLED = 2e-3
#: A multiplier from the derivative of the motion against that of a linear oscillator, whose fibres are never slack.
LINEAR = 2e-3


@functools.cache
def swept(frequencies: tuple[float, ...], curves: tuple[tuple[float, float], ...]) -> tuple[SweptCurve, ...]:
    """Curves by amplitude [m] and preload [N]."""
    conditions = [Conditions(f"{x} {n}", x, PENDULUM_CONDITIONS | {"preload": n}) for x, n in curves]
    return sweep(Model(RIGS["inverted_pendulum"]), VALUES, conditions, Plan(np.array(frequencies), 60.0, 1000.0))


def near_the_jump() -> tuple[Branch, Branch, Branch]:
    (curve,) = swept((4.1, 4.2, 4.3, 4.4), ((0.02, 0.0),))
    return tuple(curve.branches[name] for name in ("rest", "up", "down"))


@pytest.mark.slow
def test_from_rest_it_jumps_between_4_2_and_4_3_hz() -> None:
    rest = near_the_jump()[0]
    np.testing.assert_allclose(rest.max_angle[1:3], [0.21, 0.76], atol=TWO_DIGITS)
    assert rest.amplitude[2] > 4.0 * rest.amplitude[1]


@pytest.mark.slow
def test_what_comes_before_decides_where_two_motions_are_stable() -> None:
    rest, up, down = near_the_jump()
    # At 4.3 Hz: large from rest and coming down, small coming up; at 4.2 Hz the other way round.
    assert rest.amplitude[2] == pytest.approx(down.amplitude[2], rel=SAMPLED)
    assert up.amplitude[2] < 0.5 * down.amplitude[2]
    assert rest.amplitude[1] == pytest.approx(up.amplitude[1], rel=SAMPLED)
    assert down.amplitude[1] > 4.0 * rest.amplitude[1]
    for branch in (rest, up, down):
        assert (branch.periods == 1).all()
        assert (branch.multiplier < 1.0).all()


@pytest.mark.slow
def test_sixty_millimetres_overturn_near_3_75_hz() -> None:
    (curve,) = swept((3.4, 3.75, 4.2, 4.4), ((0.06, 0.0),))
    rest = curve.branches["rest"]
    assert rest.overturned.tolist() == [False, True, False, False]
    assert np.isnan(rest.amplitude[1])
    assert rest.periods[1] == 0
    # After that the branches go on from the upright position.
    assert not curve.branches["up"].overturned[2]


@pytest.mark.slow
def test_preload_moves_the_peak() -> None:
    (curve,) = swept((5.7, 5.9, 6.0, 6.2), ((0.02, 585.0),))
    rest = curve.branches["rest"]
    peak = np.argmax(rest.max_angle)
    assert curve.frequencies[peak] in (5.9, 6.0)
    assert rest.max_angle[2] == pytest.approx(0.44, abs=TWO_DIGITS)


def test_the_settled_motion_is_that_of_a_plain_simulation() -> None:
    rest = near_the_jump()[0]
    long = respond(pendulum(80_001, 4.2), damping=4.13)
    last = slice(-2000, None)
    for column, role in enumerate(("angle", "force_1", "force_2")):
        assert rest.highest[1, column] == pytest.approx(long[role][last].max(), rel=SAMPLED)
        assert rest.first_highest[1, column] == pytest.approx(long[role].max(), rel=SAMPLED)


def test_multipliers_of_small_oscillations_are_those_of_a_linear_oscillator() -> None:
    """Both fibres taut: m'' + 2 δ ω m' + ω² m, whose states shrink by exp(-δ ω T) in a period."""
    (curve,) = swept((2.0, 2.5, 3.0, 3.5), ((1e-4, 400.0),))
    lever = 1.2 * 0.75 / math.hypot(1.2, 0.75)
    decay = 2.0 * VALUES["damping"] * lever**2 / (2.0 * 3.288)
    expected = np.exp(-decay / curve.frequencies)
    np.testing.assert_allclose(curve.branches["rest"].multiplier, expected, rtol=LINEAR)


@pytest.mark.slow
def test_a_sweep_of_a_heaviside_fibre_and_of_one_with_memory() -> None:
    model = Model(RIGS["inverted_pendulum"], (CATALOGUE["fibre.maxwell_branch"],), "heaviside")
    values = VALUES | {"fibre.maxwell_branch.branch_stiffness": 800.0, "fibre.maxwell_branch.relaxation_time": 0.02}
    conditions = [Conditions("", 0.02, PENDULUM_CONDITIONS)]
    (curve,) = sweep(model, values, conditions, Plan(np.array([3.0]), 60.0, 1000.0))
    rest = curve.branches["rest"]
    assert rest.periods[0] == 1
    assert 0.0 < rest.multiplier[0] < 1.0


def test_jumps_are_told_from_flanks() -> None:
    frequencies = np.arange(1.0, 3.0, 0.1)
    flank = 1.0 / (1.0 + np.exp(-8.0 * (frequencies - 2.0)))
    assert not jumps(frequencies, flank)
    cliff = np.where(frequencies < 2.05, 0.1, 0.9)
    (jump,) = jumps(frequencies, cliff)
    assert (jump.lower, jump.upper) == (pytest.approx(2.0), pytest.approx(2.1))
    assert (jump.before, jump.after) == (0.1, 0.9)
    assert not jumps(frequencies, np.full_like(frequencies, 0.3))
    assert not jumps(frequencies, np.where(frequencies < 2.05, 0.1, np.nan))


def test_ranges_of_flags() -> None:
    frequencies = np.arange(6.0)
    flags = np.array([True, True, False, False, True, False])
    assert ranges(frequencies, flags) == ((0.0, 1.0), (4.0, 4.0))
    assert ranges(frequencies, ~flags) == ((2.0, 3.0), (5.0, 5.0))
    assert ranges(frequencies, np.zeros(6, dtype=bool)) == ()


def test_a_curve_says_its_natural_frequency() -> None:
    (curve,) = swept((4.1, 4.2, 4.3, 4.4), ((0.02, 0.0),))
    assert curve.natural_frequency == pytest.approx(5.04, abs=0.005)
    assert jnp.isfinite(curve.natural_frequency)


@pytest.mark.parametrize(("cores", "frequencies", "sizes"), [(2, 9, [2] * 5), (2, 8, [1] * 8), (1, 3, [1] * 3)])
def test_no_more_runs_are_simulated_than_fill_the_last_part(
    cores: int, frequencies: int, sizes: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sweeping, "THREADS", cores)
    up = jnp.arange(1.0, frequencies + 1.0)
    parts = sweeping._parts({"height": jnp.ones(1)}, jnp.ones(1), up)
    assert [len(part[2]) for part in parts] == sizes
    run = np.concatenate([part[2] for part in parts])
    np.testing.assert_array_equal(run[:frequencies], up)
    assert (run[frequencies:] == up[-1]).all()
