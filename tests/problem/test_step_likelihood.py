"""Readings in coarse steps beside errors of inputs, held against a search over these errors themselves."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import minimize

from fibrefit.problem.inputs.sensitivities import (
    InputSensitivities,
    StepLikelihood,
    step_likelihood,
)
from fibrefit.problem.statement.observations import Steps, step_residuals

STEP, NOISE = 0.5, 0.1
LEVEL = float(np.hypot(STEP / np.sqrt(12.0), NOISE))
CHANNELS = ("force", "position")
TIMES = np.arange(600) * 1e-3


def _steps(noise: float = NOISE) -> Steps:
    return Steps(*(np.array([size]) for size in (STEP, noise, LEVEL)))


def _waves(number: int = 6, size: float = 0.4) -> np.ndarray:
    """What errors of a drive do to a force in newtons and, a fifth of it, to a position, ``(n_wave, 2 * n_time)``."""
    waves = np.array([np.cos(2.0 * np.pi * (1 + 3 * k) * TIMES) * size / (1 + 0.3 * k) for k in range(number)])
    return np.concatenate([waves, 0.2 * waves], axis=1)


def _seen(signal: np.ndarray, errors: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Residuals ``(2 * n_time,)`` in units of the noise of a force that is read in steps, and of a fine position."""
    there = signal + errors @ _waves()
    read = there + NOISE * random.standard_normal(len(there))
    read[: len(TIMES)] = STEP * np.round(read[: len(TIMES)] / STEP)
    return (signal - read) / LEVEL


def _fine() -> InputSensitivities:
    rows = _waves() / LEVEL
    return InputSensitivities.of({"drive": np.zeros((1, len(rows)))}, [rows], np.ones((1, 2, len(TIMES))))


def _likelihood(residuals: np.ndarray, fine: InputSensitivities | None) -> StepLikelihood:
    weights = {channel: np.full((1, len(TIMES)), 1.0 / LEVEL) for channel in CHANNELS}
    return step_likelihood(CHANNELS, {"force": _steps()}, residuals[None], weights, fine)


def _cost(likelihood: StepLikelihood, residuals: np.ndarray) -> float:
    """The least that errors of inputs leave, by algebra."""
    weights = {channel: np.full((1, len(TIMES)), 1.0 / LEVEL) for channel in CHANNELS}
    rows = np.asarray(likelihood.rows(jnp.asarray(residuals)[None, None], weights))
    sensitivities = likelihood.sensitivities
    assert sensitivities is not None
    return float(sensitivities.eliminated(rows @ np.swapaxes(rows, 1, 2), sensitivities.products(rows))[0, 0, 0])


def _at(errors: np.ndarray, residuals: np.ndarray, steps: Steps) -> float:
    """What given errors leave, and their own prior."""
    size, known = len(TIMES), Steps(*(jnp.asarray(of[0]) for of in steps))
    there = residuals + errors @ _waves() / LEVEL
    force = np.asarray(step_residuals(jnp.asarray(there[:size] * LEVEL), known))
    return float(np.sum(force**2) + np.sum(there[size:] ** 2) + np.sum(errors**2))


def _least(residuals: np.ndarray, steps: Steps) -> float:
    """What the best errors leave, by a search over them."""
    return float(minimize(_at, np.zeros(6), args=(residuals, steps), method="BFGS", options={"gtol": 1e-2}).fun)


@pytest.mark.parametrize("seed", range(3))
def test_what_errors_of_inputs_leave_is_what_a_search_over_them_leaves(seed: int) -> None:
    random = np.random.default_rng(seed)
    signal = np.concatenate([3.0 * np.sin(9.0 * TIMES), np.zeros(len(TIMES))])
    residuals = _seen(signal, random.standard_normal(6), random)
    likelihood = _likelihood(residuals, _fine())
    found, true = _cost(likelihood, residuals), _least(residuals, likelihood.steps["force"])
    # Where errors are at first, what is gained from there is what their best ones gain, or a half more: deviance
    # residuals have up to a third less curvature than the likelihood.
    errors = -_fine().named([record.best(residuals[None])[0] for record in _fine().records])["drive"][0]
    first = _at(errors, residuals, likelihood.steps["force"])
    assert true - 0.1 < first
    assert 0.9 * (first - true) < first - found < 1.6 * (first - true) + 0.1


@pytest.mark.slow
def test_what_a_model_is_worth_beside_another_is_what_a_search_says() -> None:
    random = np.random.default_rng(7)
    signal = np.concatenate([3.0 * np.sin(9.0 * TIMES), np.zeros(len(TIMES))])
    residuals = _seen(signal, random.standard_normal(6), random)
    likelihood = _likelihood(residuals, _fine())
    # A force that is too large by a tenth of a step in its peaks, and a gain of the position that is off.
    for change in (np.concatenate([0.05 * np.sin(9.0 * TIMES) ** 3, np.zeros(len(TIMES))]), 0.02 * signal[::-1]):
        other = residuals + change / LEVEL
        found = _cost(likelihood, other) - _cost(likelihood, residuals)
        true = _least(other, likelihood.steps["force"]) - _least(residuals, likelihood.steps["force"])
        assert found == pytest.approx(true, abs=0.5 + 0.1 * abs(true))


def test_a_rest_within_a_step_is_not_taken_for_what_its_readings_are() -> None:
    """Most readings are those of the step below; taken for fine ones they speak against the truth by many nats."""
    off = np.concatenate([np.full(len(TIMES), 0.3 * STEP), np.zeros(len(TIMES))])
    true = _seen(off, np.zeros(6), np.random.default_rng(1))
    wrong, likelihood = true - off / LEVEL, _likelihood(true, _fine())
    left = [_fine().without_errors(one[None, None])[0, 0] for one in (true, wrong)]
    assert np.sum(left[0] ** 2) > np.sum(left[1] ** 2) + 40.0
    assert _cost(likelihood, true) < _cost(likelihood, wrong) - 40.0


def test_noise_before_rounding_is_found_though_errors_of_inputs_are_larger() -> None:
    random = np.random.default_rng(3)
    signal = np.concatenate([3.0 * np.sin(9.0 * TIMES), np.zeros(len(TIMES))])
    residuals = _seen(signal, 2.0 * random.standard_normal(6), random)
    beside, alone = _likelihood(residuals, _fine()), _likelihood(residuals, None)
    assert beside.steps["force"].noise[0] == pytest.approx(NOISE, rel=0.25)
    assert alone.steps["force"].noise[0] > 3.0 * NOISE
    assert alone.sensitivities is None


def test_fine_readings_stay_what_they_are() -> None:
    random = np.random.default_rng(4)
    residuals = random.standard_normal(2 * len(TIMES))
    likelihood = _likelihood(residuals, _fine())
    weights = {channel: np.full((1, len(TIMES)), 1.0 / LEVEL) for channel in CHANNELS}
    rows = np.stack([residuals, np.ones_like(residuals)])[None]
    seen = np.asarray(likelihood.rows(jnp.asarray(rows), weights))
    np.testing.assert_allclose(seen[:, :, len(TIMES) :], rows[:, :, len(TIMES) :], rtol=1e-6, atol=1e-6)
