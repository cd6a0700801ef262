"""Descents, starts and basins, the second solver, profiles."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import jax.numpy as jnp
import lineax as lx
import numpy as np
import optimistix as optx
import pytest

from fibrefit.fitting import error_bars
from fibrefit.fitting.error_bars import plain_cost, profile_interval
from fibrefit.fitting.result import Identification
from fibrefit.fitting.search.rescue import second_opinion
from fibrefit.fitting.search.solve import TO_THE_END, Descent, Stopping, descend_all, gram_at, widths
from fibrefit.fitting.search.starts import (
    FAR_ABOVE,
    HorizonSchedule,
    Searched,
    _far_above_best,
    _leaders,
    as_long_as_needed,
    as_probable,
    collected,
    latin_hypercube_starts,
    search,
)
from fibrefit.fitting.search.trust_region import TrustRegion
from fibrefit.fitting.thresholds import SAME_BASIN
from fibrefit.fitting.uncertainty import Scores, sandwich, white
from fibrefit.problem.statement.layout import Belief, Layout, Range, Slot
from fibrefit.problem.statement.observations import Observations
from fibrefit.problem.statement.problem import Linearised, Problem
from fibrefit.problem.task import Task
from fibrefit.study.summaries.part import Z_95
from tests.fitting import made

MOST_FROM_NEARBY = 12
LONG = 3000


def test_a_start_that_cannot_be_simulated_is_lost_and_takes_no_other_with_it(task: Task, found: Identification) -> None:
    layout = task.problem.layout
    began = latin_hypercube_starts(layout, task.start, task.spread, made.STARTS, 0)
    frees = layout.free(began)
    frees[3] = np.nan
    told: list[float] = []
    starts = collected(layout, began, search(task.problem, frees, task.horizons, told.append))
    assert told == sorted(told)
    assert told[-1] == 1.0
    assert starts.basin[3] == -1
    assert not np.isfinite(starts.cost[3])
    assert starts.agreeing == made.STARTS - 1
    assert starts.cost.min() == pytest.approx(found.starts.cost.min(), rel=1e-9)


def test_a_start_far_from_what_another_explains_is_given_up() -> None:
    np.testing.assert_array_equal(
        _far_above_best(np.array([1.0, 0.9 * FAR_ABOVE, 1.1 * FAR_ABOVE, np.inf])), [False, False, True, True]
    )
    assert not _far_above_best(np.full(3, np.inf)).any()


def test_what_is_given_up_takes_no_further_step(task: Task) -> None:
    layout = task.problem.layout
    began = latin_hypercube_starts(layout, task.start, task.spread, made.STARTS, 0)
    began[2, layout.free_names.index("friction")] = 100.0
    found = search(task.problem, layout.free(began), task.horizons, lambda _: None)
    assert found.ended.all()
    assert not np.isfinite(found.descent.cost[2])
    assert found.descent.steps[2] < np.delete(found.descent.steps, 2).min()


@pytest.fixture(scope="module")
def long_task(tmp_path_factory: pytest.TempPathFactory) -> Task:
    """Two drops that are recorded for long after their first contacts."""
    return made.task(tmp_path_factory.mktemp("long"), made.records(samples=LONG))


def length_of(problem: Problem) -> int:
    return int(problem.observations.experiment.times.shape[1])


@pytest.mark.slow
def test_a_horizon_in_arrays_of_its_own_length_leads_to_the_same_place(long_task: Task) -> None:
    problem, near = long_task.problem, long_task.horizons[:, 0]
    began = problem.layout.free(latin_hypercube_starts(problem.layout, long_task.start, long_task.spread, 2, 0))
    plain = search(problem, began, long_task.horizons, lambda _: None).descent
    short = as_long_as_needed(problem, near, 0)
    assert near.max() <= length_of(short) <= LONG // 2
    same = gram_at(problem.until(near[0]), long_task.start)
    np.testing.assert_allclose(gram_at(short.until(near[0]), long_task.start), same, rtol=1e-9)
    schedule = HorizonSchedule.of(long_task, often=True)
    cut = search(problem, began, long_task.horizons, lambda _: None, schedule=schedule).descent
    # Arrays of another length are summed in another order: that they were used shows in last digits.
    assert not np.array_equal(cut.free, plain.free)
    width = widths(problem, plain.free[0])
    np.testing.assert_allclose(cut.free / width, plain.free / width, atol=1e-2)


def test_a_horizon_has_arrays_of_its_own_where_that_spares_more_than_compiling_takes(long_task: Task) -> None:
    problem, near = long_task.problem, long_task.horizons[:1, 0]
    worth = HorizonSchedule.of(long_task).spared
    spared = length_of(problem) - length_of(as_long_as_needed(problem, near, 0))
    for samples, cut in ((5e5, False), (2e6, True)):
        starts = np.repeat(near, round(samples / spared), axis=0)
        assert (as_long_as_needed(problem, starts, worth) is not problem) is cut
    # The last horizon is the whole of each record.
    assert as_long_as_needed(problem, np.repeat(long_task.counts[-1:], 10**6, axis=0), worth) is problem


def with_data(problem: Problem, data: Observations) -> Problem:
    return Problem(problem.model, problem.layout, data)


def test_starts_take_no_more_steps_than_they_are_given(task: Task, found: Identification) -> None:
    began = task.problem.layout.free(found.starts.values[:1] * 1.3)
    few = search(task.problem, began, task.horizons, lambda _: None, schedule=HorizonSchedule(steps=2)).descent
    enough = search(task.problem, began, task.horizons, lambda _: None).descent
    assert few.steps[0] <= 2 * task.horizons.shape[1] < enough.steps[0]


def test_the_cost_of_a_descent_is_that_of_its_end(task: Task, found: Identification) -> None:
    for values, cost in zip(found.starts.values, found.starts.cost, strict=True):
        assert cost == pytest.approx(gram_at(task.problem, values)[-1, -1], rel=1e-6)


def test_rounding_of_the_cost_holds_no_descent_up(task: Task, found: Identification) -> None:
    layout = task.problem.layout
    free = layout.free(found.plain.values)
    width = widths(task.problem, free)
    away = free + 3.0 * width * np.random.default_rng(0).choice([-1.0, 1.0], (8, layout.size))
    starts, counts = np.resize(away, (8, layout.size)), np.tile(task.counts[-1], (8, 1))
    ended = descend_all(task.problem, starts, width, counts, np.ones(8, dtype=bool), Stopping(np.asarray(TO_THE_END)))
    # Quadratic convergence from three errors away: what more there is would be steps that rounding refuses.
    assert np.max(np.asarray(ended.steps)) <= MOST_FROM_NEARBY
    np.testing.assert_allclose(np.asarray(ended.free), np.tile(free, (8, 1)), atol=1e-2 * width.min())


def test_a_step_predicted_to_gain_less_than_rounding_is_taken_and_the_next_is_shorter() -> None:
    flat = optx.FunctionInfo.ResidualJac(jnp.array([1e2]), lx.MatrixLinearOperator(jnp.array([[1e-12]])))
    higher = optx.FunctionInfo.Eval(flat.as_min() * (1.0 + 1e-14))
    for rounding, taken in ((0.0, False), (1e-12, True)):
        region = TrustRegion(rounding=rounding)
        state = region.init(jnp.zeros(1), flat)
        size, accept, *_ = region.step(jnp.asarray(False), jnp.zeros(1), jnp.ones(1), flat, higher, state)
        assert bool(accept) is taken
        assert size == region.low_constant * state.step_size
    # A rise beyond rounding is refused all the same.
    rise = optx.FunctionInfo.Eval(flat.as_min() * (1.0 + 1e-9))
    assert not region.step(jnp.asarray(False), jnp.zeros(1), jnp.ones(1), flat, rise, state)[1]


def test_widths_change_the_cost_by_about_one(task: Task, found: Identification) -> None:
    layout = task.problem.layout
    free = layout.free(found.plain.values)
    width = widths(task.problem, free)
    best = gram_at(task.problem, found.plain.values)[-1, -1]
    for i in range(layout.size):
        moved = layout.values(free + width * (np.arange(layout.size) == i))
        assert gram_at(task.problem, moved)[-1, -1] - best == pytest.approx(1.0, rel=0.2)


def test_starts_are_the_guess_and_a_cloud_within_the_spread_and_the_bounds() -> None:
    shared = Slot("k", "N/m", Range(5.0, 12.0, 1.0))
    layout = Layout((shared, Slot("b", "-", Range(0.0, 1e9, 1.0)), Slot("zero", "m", shared.range, False)), ("a", "b"))
    centre = np.array([10.0, 2.0, 6.0, 7.0])
    began = latin_hypercube_starts(layout, centre, {"k": 4.0, "b": 3.0, "zero": 9.0}, 33, seed=1)
    np.testing.assert_array_equal(began[0], centre)
    assert began[:, 0].min() >= 5.0
    assert began[:, 0].max() <= 12.0
    np.testing.assert_array_less(2.0 / 3.0 - 1e-12, began[:, 1])
    np.testing.assert_array_less(began[:, 1], 6.0 + 1e-12)
    # What each record has for itself stays as the data tell it.
    np.testing.assert_array_equal(began[:, 2:], np.tile(centre[2:], (33, 1)))
    assert len(np.unique(began[1:, 1])) == 32
    np.testing.assert_array_equal(began, latin_hypercube_starts(layout, centre, {"k": 4.0, "b": 3.0}, 33, seed=1))
    assert not np.array_equal(began, latin_hypercube_starts(layout, centre, {"k": 4.0, "b": 3.0}, 33, seed=2))
    assert len(latin_hypercube_starts(layout, centre, {"k": 4.0}, 1, seed=0)) == 1


def test_starts_that_met_go_on_as_one_unless_they_took_different_ways() -> None:
    free = np.array([[0.0, 0.0], [0.3, -0.4], [0.0, 0.1], [5.0, 0.0], [0.1, 0.0], [np.nan, 0.0]])
    cost = np.array([10.0, 10.001, 10.0, 10.0, 12.0, np.inf])
    ended = Descent(free, cost, np.arange(6), np.ones(6, dtype=bool))
    leader = _leaders(ended, np.array([1.0, 1.0]), np.array([0, 0, 1, 0, 0, 0]))
    # The second met the first. The others: another way, too far, another cost, lost.
    np.testing.assert_array_equal(leader, [0, 0, 2, 3, 4, 5])


def test_ends_are_sorted_into_basins_by_their_cost() -> None:
    layout = Layout((Slot("k", "N/m", Range(-np.inf, np.inf, 1.0)),), ("a",))
    cost = np.array([5.0, 1.0, np.inf, 1.0 + 0.5 * SAME_BASIN, 5.0 * (1.0 + 0.5 * SAME_BASIN), 80.0])
    ended = Descent(np.arange(6.0)[:, None], cost, np.arange(6), np.ones(6, dtype=bool))
    starts = collected(layout, np.zeros((6, 1)), Searched(ended, np.ones(6, dtype=bool)))
    np.testing.assert_array_equal(starts.basin, [1, 0, -1, 0, 1, 2])
    assert starts.agreeing == 2
    assert starts.names == ("k",)


@pytest.mark.parametrize(("readings", "apart"), [(1000, 1e-3), (20_000, 1e-3), (400_000, 5e-5)])
def test_ends_of_many_readings_are_apart_where_one_is_less_probable(readings: int, apart: float) -> None:
    """Of n readings of noise of variance one a cost of n that is 20 higher is ten nats less probable."""
    layout = Layout((Slot("k", "N/m", Range(-np.inf, np.inf, 1.0)),), ("a",))
    cost = readings * np.array([1.0, 1.0 + 0.9 * apart, 1.0 + 1.1 * apart])
    ended = Descent(np.arange(3.0)[:, None], cost, np.arange(3), np.ones(3, dtype=bool))
    starts = collected(layout, np.zeros((3, 1)), Searched(ended, np.ones(3, dtype=bool)))
    np.testing.assert_array_equal(as_probable(starts, readings).basin, [0, 0, 1])


def test_the_second_solver_ends_at_the_same_place_from_elsewhere(task: Task, found: Identification) -> None:
    errors = found.plain.errors
    other = second_opinion(task.problem, found.plain.values + 20.0 * errors, errors)
    assert np.abs((other.values - found.plain.values) / errors).max() < 0.05
    assert other.cost == pytest.approx(found.starts.cost.min(), rel=1e-7)


def test_the_second_solver_keeps_the_bounds(task: Task, found: Identification) -> None:
    errors = found.plain.errors
    least = found.plain.values[2] - 20.0 * errors[2]
    slots = tuple(
        replace(slot, range=Range(least, np.inf, 1.0)) if slot.name == "friction" else slot
        for slot in task.problem.layout.slots
    )
    bounded = Problem(task.problem.model, replace(task.problem.layout, slots=slots), task.problem.observations)
    start = np.where(np.arange(len(errors)) == 2, least - 1.0, found.plain.values)  # friction below its bound
    other = second_opinion(bounded, start, errors)
    assert other.values[2] >= least
    assert np.abs((other.values - found.plain.values) / errors).max() < 0.05
    # From no friction at all it may end elsewhere, but no bound is passed.
    assert second_opinion(task.problem, np.where(start == start[2], -1.0, start), errors).values[2] >= 0.0


def plain_profile(task: Task, found: Identification, index: int, own: float, honest: float) -> tuple[float, float]:
    width = widths(task.problem, task.problem.layout.free(found.plain.values))
    cost = plain_cost(task.problem, found.plain.values, index, width, task.horizons[0, -1:])[0]
    return profile_interval(task.problem, found.plain.values, index, cost, own, honest)


def test_a_profile_is_the_normal_interval_where_the_cost_is_a_parabola(task: Task, found: Identification) -> None:
    value, error = found.plain.values[0], found.plain.errors[0]
    low, high = plain_profile(task, found, 0, found.parameters["stiffness"].std_errors["white"], error)
    assert low == pytest.approx(value - Z_95 * error, abs=0.1 * error)
    assert high == pytest.approx(value + Z_95 * error, abs=0.1 * error)


@pytest.mark.parametrize("loud", [3.0, 0.5])
def test_a_profile_beside_a_prior_is_the_interval_that_is_reported(
    loud: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a line with a prior as wide as what residuals say of it, which are not as large as the noise that is taken."""
    t, belief = np.linspace(0.0, 1.0, 500), Belief(2.07, 0.05)
    columns = np.stack([np.ones(500), np.sin(9.0 * t)], axis=-1)
    measured = columns @ [2.0, 1.0] + loud * np.random.default_rng(0).standard_normal(500)
    limits = Range(-np.inf, np.inf, 1.0)
    layout = Layout((Slot("gain", "-", limits, belief=belief), Slot("zero", "-", limits)), ("a.csv",))
    prior = np.diag([belief.spread**-2.0, 0.0])
    inverse = np.linalg.inv(columns.T @ columns + prior)
    best = inverse @ (columns.T @ measured + prior @ [belief.centre, 0.0])

    def squares(at: np.ndarray) -> float:
        return float(np.sum((columns @ at - measured) ** 2) + belief.residual(at[0]) ** 2)

    def held(problem: Any, free: np.ndarray, width: np.ndarray, whole: np.ndarray) -> Any:
        at = layout.values(free)
        beside = columns[:, 1] @ (measured - at[0] * columns[:, 0]) / (columns[:, 1] @ columns[:, 1])
        return SimpleNamespace(cost=squares(np.array([at[0], beside])))

    monkeypatch.setattr(error_bars, "descend", held)
    linear = Linearised((columns @ best - measured)[None, None], columns[None, None])
    problem: Any = SimpleNamespace(
        layout=layout,
        n_measured=500,
        evaluate=lambda local: (linear, None),
        observations=SimpleNamespace(experiment=SimpleNamespace(count=np.array([500]))),
    )
    cost, own = plain_cost(problem, best, 0, np.ones(2), np.array([[500]]))
    assert own == pytest.approx(np.sqrt(squares(best) / 500.0 * inverse[0, 0]))
    reported = 0.04
    low, high = profile_interval(problem, best, 0, cost, own, reported)
    assert (low, high) == pytest.approx((best[0] - Z_95 * reported, best[0] + Z_95 * reported), abs=1e-3 * reported)
    # The error bar of white noise is not that of this cost: with it the interval would be another.
    scores = Scores.of(problem, linear, best)
    of_noise = np.sqrt(sandwich(scores.normal_matrix(), white(scores))[0, 0])
    assert abs(of_noise / own - 1.0) > 0.1


@pytest.mark.parametrize("lowest", [1.0, 3.0e4])
def test_how_much_the_best_fit_leaves_makes_no_interval_of_a_likelihood_narrower(
    task: Task, found: Identification, lowest: float
) -> None:
    """Of coarse readings a likelihood leaves far less than one a reading; that rise is what it is all the same."""
    values, own, reported = found.plain.values, 20.0, 30.0

    def deviance(at: np.ndarray) -> float:
        return lowest + float((at[0] - values[0]) / own) ** 2

    low, high = profile_interval(task.problem, values, 0, deviance, own, reported)
    assert (low, high) == pytest.approx((values[0] - Z_95 * reported, values[0] + Z_95 * reported), abs=1e-3 * reported)


def test_a_profile_that_never_rises_ends_at_the_limits(task: Task, found: Identification) -> None:
    """With errors said to be a millionth of what they are, every end lies beyond the reach of the search."""
    small = 1e-6 * found.plain.errors[2]
    limits = task.problem.layout.entries[2][0].range
    assert plain_profile(task, found, 2, small / 50.0, small) == (limits.lower, limits.upper)
