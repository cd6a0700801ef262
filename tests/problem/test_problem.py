"""The problem's linear algebra: products, compression, horizons, masks and the soft loss, against plain arithmetic."""

from __future__ import annotations

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.core.arrays import gram_root
from fibrefit.fitting.search.solve import compressed_residuals, gram_at, linearised
from fibrefit.laws.catalogue import find_effect
from fibrefit.problem.statement.problem import Problem, nearest_side
from fibrefit.problem.task import Task
from tests.fitting import made

EXACT = 1e-9
"""Sums of thousands of products, scaled by many orders of magnitude."""
AS_DIFFERENCES = 2e-4
"""Central differences across located switches."""


@pytest.fixture(scope="module")
def task(tmp_path_factory: pytest.TempPathFactory) -> Task:
    return made.task(tmp_path_factory.mktemp("problem"))


@pytest.fixture(scope="module")
def jacobian(task: Task) -> tuple[np.ndarray, np.ndarray]:
    """Residuals ``(n,)`` and whole Jacobian ``(n, n_free)`` by the plain way."""
    residuals = lambda values: task.problem.residuals(values).ravel()  # noqa: E731
    values = jnp.asarray(task.start)
    return np.asarray(residuals(values)), np.asarray(jax.jacfwd(residuals)(values))


def test_gram_is_that_of_the_whole_jacobian(task: Task, jacobian: tuple) -> None:
    columns = np.column_stack([jacobian[1], jacobian[0]])
    columns /= (scale := np.linalg.norm(columns, axis=0))
    for gram in (gram_at(task.problem, task.start), np.asarray(task.problem.gram(jnp.asarray(task.start)))):
        np.testing.assert_allclose(gram / np.outer(scale, scale), columns.T @ columns, atol=EXACT)


def test_what_was_said_of_a_place_is_said_of_no_other_place_and_no_other_problem(task: Task) -> None:
    problem, local = task.problem, np.asarray(task.problem.layout.local(task.start))
    there = problem.evaluate(local)
    assert problem.evaluate(local.copy()) is there
    moved = problem.evaluate(1.01 * local)
    assert not np.array_equal(moved[0].residuals, there[0].residuals)
    short = problem.until(np.asarray(problem.observations.experiment.count) // 2)
    problem.evaluate(local)
    cut, whole = short.evaluate(local)[0].residuals, problem.evaluate_at(local)[0].residuals
    assert np.count_nonzero(cut) < np.count_nonzero(whole)
    np.testing.assert_array_equal(problem.evaluate(local)[0].residuals, whole)


def test_slopes_are_differences(task: Task, jacobian: tuple) -> None:
    problem = task.problem
    for place, size in enumerate(np.maximum(1e-6 * np.abs(task.start), 1e-9)):
        step = size * (np.arange(len(task.start)) == place)
        up, down = (np.asarray(problem.residuals(jnp.asarray(task.start + s))).ravel() for s in (step, -step))
        error = (up - down) / (2.0 * size) - jacobian[1][:, place]
        assert np.linalg.norm(error) < AS_DIFFERENCES * np.linalg.norm(jacobian[1][:, place])


def test_compressed_residuals_keep_cost_gradient_and_normal_matrix(task: Task, jacobian: tuple) -> None:
    problem, residuals = task.problem, jacobian[0]
    free = jnp.asarray(problem.layout.free(task.start))
    slope = jax.jvp(problem.layout.values, (free,), (jnp.ones_like(free),))[1]
    whole = jacobian[1] * np.asarray(slope)
    short, short_slopes = compressed_residuals(free, problem), jax.jacfwd(compressed_residuals)(free, problem)
    assert short.shape == (problem.layout.size + 1,)
    assert float(short @ short) == pytest.approx(residuals @ residuals, rel=EXACT)
    scale = np.linalg.norm(whole, axis=0)
    np.testing.assert_allclose(short_slopes.T @ short / scale, whole.T @ residuals / scale, atol=1e-7)
    np.testing.assert_allclose(
        short_slopes.T @ short_slopes / np.outer(scale, scale), whole.T @ whole / np.outer(scale, scale), atol=EXACT
    )


def test_a_root_of_a_singular_matrix_is_one_too() -> None:
    columns = np.random.default_rng(0).normal(size=(50, 3)) * [1.0, 1e6, 1e-6]
    gram = (lambda a: a.T @ a)(np.column_stack([columns, columns[:, 0], np.zeros(50)]))
    for root in (gram_root(gram), np.asarray(gram_root(jnp.asarray(gram)))):
        scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
        np.testing.assert_allclose(root.T @ root / np.outer(scale, scale), gram / np.outer(scale, scale), atol=1e-12)


def test_a_horizon_is_a_shorter_record(task: Task) -> None:
    problem, values = task.problem, jnp.asarray(task.start)
    counts = jnp.array([300, 500], dtype=jnp.int32)
    short, whole = np.asarray(problem.until(counts).residuals(values)), np.asarray(problem.residuals(values))
    for r, count in enumerate(counts):
        np.testing.assert_array_equal(short[r, :, :count], whole[r, :, :count])
        assert not short[r, :, count:].any()


def test_samples_that_are_not_valid_do_not_count(tmp_path: Path) -> None:
    records = made.records()
    broken = records[0].channels["force"].copy()
    broken[400:450] = np.nan
    hurt = made.replace(records[0], force=broken)
    task = made.task(tmp_path, [hurt, records[1]])
    residuals = np.asarray(task.problem.residuals(jnp.asarray(task.start)))
    assert np.isfinite(residuals).all()
    assert not residuals[0, 0, 400:450].any()
    assert residuals[0, 1, 400:450].all()
    assert task.problem.n_measured == 4 * made.SAMPLES - 50


def test_padding_counts_for_nothing(task: Task) -> None:
    linear = linearised(task.problem, task.problem.layout.local(task.start))
    assert linear.residuals.shape[-1] > made.SAMPLES
    assert not linear.residuals[..., made.SAMPLES :].any()
    assert not linear.slopes[..., made.SAMPLES :, :].any()


def test_an_instant_is_a_share_of_the_whole_record_however_far_that_is_followed(tmp_path: Path) -> None:
    slip = find_effect("fibre.knot_slip@1")
    task = made.task(tmp_path, effects=(slip,))
    problem, names = task.problem, list(task.problem.layout.names)
    local = np.array(problem.layout.local(task.start))
    local[:, [names.index(f"{slip.name}.{name}") for name in ("slip", "instant")]] = 3e-4, 0.6
    of = lambda one: np.asarray(one.predict(jnp.asarray(local), one.observations.experiment)["position"])  # noqa: E731
    whole, short = of(problem), made.SAMPLES // 2
    early = problem.until(np.full(len(task.traces), short))
    for followed in (early, problem.shortened(short)):
        assert np.abs(of(followed)[:, :short] - whole[:, :short]).max() < 1e-6 * np.ptp(whole)


def test_the_soft_loss_is_soft_l1(task: Task) -> None:
    limit, problem = 3.0, task.problem
    soft = Problem(problem.model, problem.layout, problem.observations, limit)
    values = jnp.asarray(task.start * np.where(np.arange(len(task.start)) == 0, 1.2, 1.0))
    plain, softened = np.asarray(problem.residuals(values)), np.asarray(soft.residuals(values))
    assert np.abs(plain).max() > 10.0 * limit
    loss = 2.0 * limit**2 * (np.sqrt(1.0 + (plain / limit) ** 2) - 1.0)
    np.testing.assert_allclose(softened**2, loss, rtol=1e-9, atol=1e-12)


def test_a_sample_beside_a_jump_is_held_against_the_nearer_side_of_it() -> None:
    """The signal jumps from 0 to 100; each reading is of one side or the other, with an error of 1 or of 300."""
    times = jnp.arange(6) * 0.5
    for instant, share in ((1.0, 1.0), (1.25, 0.5)):
        signal = jnp.where(times > instant, 100.0, 0.0)
        for reading, nearer in ((0.0, 0.0), (100.0, 0.0), (60.0, 0.0), (101.0, -1.0), (-1.0, 1.0), (400.0, -300.0)):
            measured = signal.at[2].set(reading)
            found = nearest_side(times, (signal - measured)[None], jnp.array([instant, 9.7]), jnp.array([[100.0, 0.0]]))
            plain = float(signal[2]) - reading
            np.testing.assert_allclose(found[0, 2], plain + share * (nearer - plain))
            np.testing.assert_allclose(np.delete(found[0], 2), 0.0)


def test_a_sample_is_as_far_off_before_a_jump_passes_it_as_after() -> None:
    times, jump = jnp.arange(6) * 0.5, jnp.array([[100.0]])
    for reading in (-300.0, -1.0, 0.5, 50.0, 101.0, 400.0):
        ends = []
        for instant in (1.5 - 1e-9, 1.5 + 1e-9):
            signal = jnp.where(times > instant, 100.0, 0.0)
            ends.append(nearest_side(times, signal[None] - reading, jnp.array([instant]), jump)[0, 3])
        np.testing.assert_allclose(*ends, atol=1e-6)


@pytest.mark.parametrize("steps", [(3, 3), (3, 4), (3, 5), (0, 0, 1, 1, 2), (4, 5, 5, 6)])
def test_jumps_beside_each_other_are_passed_one_after_the_other(steps: tuple[int, ...]) -> None:
    """What one leaves is what the next one finds, as if each were passed by itself."""
    random = np.random.default_rng(len(steps))
    times, distances = jnp.arange(8) * 0.5, jnp.asarray(random.normal(0.0, 50.0, (2, 8)))
    instants = 0.5 * np.sort(np.array(steps) + random.random(len(steps)))
    heights = random.normal(0.0, 100.0, (2, len(steps)))
    found, one_by_one = nearest_side(times, distances, jnp.asarray(instants), jnp.asarray(heights)), distances
    for instant, height in zip(instants, heights.T, strict=True):
        one_by_one = nearest_side(times, one_by_one, jnp.array([instant]), jnp.asarray(height[:, None]))
    np.testing.assert_allclose(found, one_by_one, rtol=1e-14)
    assert np.any(found != distances)


def test_the_cost_is_smooth_where_a_snap_passes_a_sample(task: Task) -> None:
    """The force jumps by some tens of noise rms; the cost would by its square."""
    problem = task.problem
    place = task.problem.layout.free_names.index("release[drop_10mm.csv]")
    cost = jax.jit(lambda values: jnp.sum(problem.residuals(values) ** 2))
    shifts = np.linspace(-6e-4, 6e-4, 241)
    costs = np.array([cost(jnp.asarray(task.start + s * (np.arange(len(task.start)) == place))) for s in shifts])
    jumps = np.abs(np.diff(costs, 3))
    assert jumps.max() < 1e-3 * np.ptp(costs)
