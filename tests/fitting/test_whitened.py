"""The last step of a fit: whitened where the noise is known to wander, plain wherever that is in doubt."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from fibrefit.fitting.gls_estimate import SETTLED, cost_with_one_held
from fibrefit.problem.noise.residual_noise import wander_of

from fibrefit.core.check import Check
from fibrefit.effects.guide.viscous_friction import ViscousFriction
from fibrefit.fitting import gls as last_step
from fibrefit.fitting.identify import identify
from fibrefit.fitting.result import Identification
from fibrefit.fitting.search.solve import linearised
from fibrefit.problem.estimate.gls import whitened
from fibrefit.problem.task import Task
from tests.fitting import made

VAGUE = "viscous_coefficient"


def fitted(
    folder: Path, more: str = "", robust: bool = False, profile: bool = False, **made_of: object
) -> Identification:
    options = {"share": 0.5, "seed": 3, **made_of}
    return identify(made.task(folder, made.records(**options), more=more), starts=1, robust=robust, profile=profile)


def test_where_noise_wanders_the_estimate_is_whitened_and_surer(found: Identification) -> None:
    assert found.estimator == "whitened least squares"
    assert found.estimator_says.startswith("Whitened least squares: the noise wanders")
    for name, estimate in found.parameters.items():
        assert estimate.std_error < estimate.plain_error, name
        assert abs(estimate.value - estimate.plain_value) < 3.0 * estimate.plain_error
        assert estimate.std_errors["white"] < estimate.std_error
        assert set(estimate.std_errors) == {"white", "whitened", "spectrum", "newey_west", "block_bootstrap"}
    check = next(check for check in found.checks if check.name == "plain and whitened estimates agree")
    assert check.passed


def test_no_further_whitened_step_is_left(task: Task, found: Identification) -> None:
    here = whitened(
        task.problem.layout, linearised(task.problem, found.values), found.sharp.whitening, found.sharp.level
    )
    errors = np.sqrt(np.diag(here.covariance))
    assert np.max(np.abs(here.step) / errors) < SETTLED
    # The negative control: the plain estimate is not where whitened residuals are smallest.
    plain = whitened(
        task.problem.layout, linearised(task.problem, found.plain.values), found.sharp.whitening, found.sharp.level
    )
    assert np.max(np.abs(plain.step) / errors) > 0.3
    assert here.cost < plain.cost


def test_what_is_white_has_no_memory_left(task: Task, found: Identification) -> None:
    noise = wander_of(task.problem, linearised(task.problem, found.plain.values).residuals)
    assert noise.over_white > 100.0
    assert noise.over_autoregressive > 0.0
    fresh = found.sharp.scores.residuals
    before = found.residuals
    for channel in range(2):
        # 2000 samples: a correlation of two samples scatters by 0.02.
        assert abs(_correlation(fresh[:, channel])) < 0.08
        assert _correlation(before[:, channel]) > 0.1


def _correlation(rows: np.ndarray) -> float:
    """Of means of four samples with the next ones."""
    means = rows[:, : rows.shape[1] // 4 * 4].reshape(len(rows), -1, 4).mean(axis=2)
    return float(np.sum(means[:, 1:] * means[:, :-1]) / np.sum(means**2))


def test_a_profile_of_the_whitened_cost_is_its_normal_interval(task: Task, found: Identification) -> None:
    estimate = found.parameters["damping"]
    index = task.problem.layout.free_names.index("damping")
    cost = cost_with_one_held(task.problem, found.sharp, index)
    for sign in (-1.0, 1.0):
        moved = found.values.copy()
        moved[index] += 2.0 * sign * estimate.std_errors["whitened"]
        # Two standard errors raise a sum of squares by four.
        assert cost(moved) - cost(found.values) == pytest.approx(4.0, rel=0.1)


def test_profiles_are_those_of_the_estimate_reported(tmp_path: Path) -> None:
    profiled = fitted(tmp_path, profile=True)
    assert profiled.sharp is not None
    for estimate in profiled.parameters.values():
        assert estimate.interval_kind == "profile likelihood"
        low, high = estimate.interval_95
        assert low == pytest.approx(estimate.value - 1.96 * estimate.std_error, abs=0.2 * estimate.std_error)
        assert high == pytest.approx(estimate.value + 1.96 * estimate.std_error, abs=0.2 * estimate.std_error)


def test_noise_without_memory_needs_no_whitening(tmp_path: Path) -> None:
    white = fitted(tmp_path, share=0.0)
    assert white.sharp is None
    assert white.estimator_says == "Plain least squares: the noise has no memory that shows."
    np.testing.assert_array_equal(white.values, white.plain.values)
    assert np.isnan(white.parameters["damping"].plain_value)


def test_missing_physics_keeps_the_plain_estimate(tmp_path: Path) -> None:
    missing = {"effects": (ViscousFriction,), f"guide__viscous_friction__{VAGUE}": 2.0}
    found = fitted(tmp_path, **missing)
    assert found.status == "suspect"
    assert found.estimator == "plain least squares"
    assert found.estimator_says.startswith("Plain least squares: whitening is for what is noise alone")
    assert "the gap is noise" in found.estimator_says


def test_a_robust_fit_and_one_that_a_bound_stops_stay_plain(tmp_path: Path) -> None:
    assert "count less, as asked for" in fitted(tmp_path / "robust", robust=True).estimator_says
    stopped = fitted(tmp_path / "bound", '[parameters.damping]\nbounds = ["0 N s/m", "20 N s/m"]')
    assert "no parameter at a bound" in stopped.estimator_says


def test_where_both_estimates_part_the_plain_one_stands(
    task: Task, found: Identification, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same records, and a comparison that finds them apart."""
    parted = Check("plain and whitened estimates agree", False, "They part.", 1e-6, 1e-3)
    monkeypatch.setattr(last_step, "parting_check", lambda names, found: parted)
    again = identify(task, starts=1)
    assert again.estimator_says == (
        "Plain least squares: whitened residuals want other values, so the model lacks something."
    )
    assert again.checks[-1] is parted
    assert again.status == "suspect"
    assert again.sharp is None
    np.testing.assert_allclose(again.values, found.plain.values, rtol=1e-6)


def test_a_bound_that_only_the_whitened_estimate_meets_keeps_the_plain_one(
    task: Task, found: Identification, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(last_step, "estimates", lambda *_: (SimpleNamespace(at_bound=True),))
    kept = identify(task, starts=1)
    assert kept.estimator_says == "Plain least squares: the whitened search ends at a bound."
    np.testing.assert_allclose(kept.values, found.plain.values, rtol=1e-6)


def test_whitening_that_makes_nothing_surer_is_not_reported(task: Task, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(last_step, "size", lambda problem, covariance: 0.0)
    assert identify(task, starts=1).estimator_says == "Plain least squares: whitening makes no error bar smaller."


def test_errors_of_an_input_keep_the_estimate_plain() -> None:
    plain = SimpleNamespace(input_errors={"drive": None}, values=np.zeros(1), linear=SimpleNamespace(residuals=None))
    kept = last_step.reported(plain, None, (), 2000.0)
    assert kept.says == "Plain least squares: errors of the measured drive are fitted beside the parameters."
    assert kept.sharp is None
