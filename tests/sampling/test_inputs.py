"""Errors of measured inputs, eliminated: the same as dense algebra with all of them kept."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import toeplitz

from fibrefit.problem.noise.whitening import Autoregressive, White, Whitening
from fibrefit.problem.statement.belief import Belief
from fibrefit.problem.statement.layout import Layout
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.sampling.mode import inputs

SAMPLES, WAVES = 40, 6
EXACT = 1e-5
"""Relative: reactions to errors of inputs are kept in single precision."""


def whitenings() -> dict[str, Whitening]:
    valid = np.ones((2, 2, SAMPLES), dtype=bool)
    coloured = [np.array([1.0, 0.6, 0.36 * 0.9]), np.array([2.0, 1.0])]
    return {"white": White(jnp.asarray(valid)), "coloured": Autoregressive.of(coloured, valid)}


class Linear:
    """Records whose residuals are linear in values and coefficients, with random slopes."""

    def __init__(self, task: Task, seed: int = 0) -> None:
        random = np.random.default_rng(seed)
        self.layout = task.problem.layout
        self.local = len(self.layout.local_free)
        self.slopes = random.standard_normal((2, self.local, 2 * SAMPLES))
        self.sensitivities = 2.0 * random.standard_normal((2, WAVES, 2 * SAMPLES))
        self.offset = 5.0 * random.standard_normal((2, 2 * SAMPLES))

    def expanded(self, problem: object, known: object, values: np.ndarray, coefficients: dict) -> list:
        own = np.concatenate([values, [0.0, 0.0]])[self.layout.local_columns]
        rows = []
        for r in (0, 1):
            residuals = self.offset[r] + own[r] @ self.slopes[r] + coefficients["drive"][r] @ self.sensitivities[r]
            rows.append((residuals.reshape(2, SAMPLES), self.slopes[r], self.sensitivities[r]))
        return rows

    def columns(self) -> np.ndarray:
        """Slopes of all samples ``(n, n_free)``."""
        total = np.zeros((4 * SAMPLES, self.layout.size + 2))
        for r in (0, 1):
            rows = slice(r * 2 * SAMPLES, (r + 1) * 2 * SAMPLES)
            total[rows, self.layout.local_columns[r]] = self.slopes[r].T
        return total[:, : self.layout.size]


@pytest.fixture
def linear(small: tuple[Task, np.ndarray], monkeypatch: pytest.MonkeyPatch) -> Linear:
    model = Linear(small[0])
    monkeypatch.setattr(inputs, "expanded", model.expanded)
    return model


KNOWN = {"drive": SimpleNamespace(size=np.ones((2, WAVES)))}


def dense_noise(whitening: Whitening, linear: Linear, with_waves: bool) -> np.ndarray:
    """Covariance of all residuals: the noise's, and that of the coefficients through their sensitivities."""
    total = np.zeros((4 * SAMPLES, 4 * SAMPLES))
    for place, lags in enumerate(whitening.autocovariance(SAMPLES).reshape(4, -1)):
        here = slice(place * SAMPLES, (place + 1) * SAMPLES)
        total[here, here] = toeplitz(lags)
    for r in (0, 1):
        here = slice(r * 2 * SAMPLES, (r + 1) * 2 * SAMPLES)
        total[here, here] += with_waves * linear.sensitivities[r].T @ linear.sensitivities[r]
    return total


@pytest.mark.parametrize("kind", ["white", "coloured"])
def test_elimination_is_dense_algebra(linear: Linear, small: tuple[Task, np.ndarray], kind: str) -> None:
    whitening, values = whitenings()[kind], np.zeros(linear.layout.size)
    coefficients = {"drive": np.random.default_rng(1).standard_normal((2, WAVES))}
    at = inputs._evaluate(small[0].problem, KNOWN, values, coefficients, whitening, np.ones(2))
    columns, offset = linear.columns(), linear.offset.ravel()
    sigma = dense_noise(whitening, linear, with_waves=True)
    weighed = np.linalg.solve(sigma, columns)
    covariance = np.linalg.inv(columns.T @ weighed)
    np.testing.assert_allclose(at.covariance, covariance, rtol=EXACT, atol=EXACT * covariance.max())
    step = -covariance @ weighed.T @ offset
    np.testing.assert_allclose(at.step, step, rtol=EXACT, atol=EXACT * np.abs(step).max())
    alone = np.linalg.inv(columns.T @ np.linalg.solve(dense_noise(whitening, linear, with_waves=False), columns))
    np.testing.assert_allclose(at.of_corrected, alone, rtol=EXACT, atol=EXACT * alone.max())
    # The plain estimate believes in white noise and is judged by what the noise is.
    believed = np.linalg.solve(dense_noise(whitenings()["white"], linear, with_waves=True), columns)
    bread = np.linalg.inv(columns.T @ believed)
    plain = bread @ believed.T @ sigma @ believed @ bread
    np.testing.assert_allclose(at.of_plain, plain, rtol=EXACT, atol=EXACT * plain.max())


def test_a_stated_prior_is_one_more_residual(linear: Linear, small: tuple[Task, np.ndarray]) -> None:
    problem, layout, whitening = small[0].problem, linear.layout, whitenings()["coloured"]
    belief, values = Belief(0.7, 0.02), np.zeros(layout.size)
    slots = (replace(layout.slots[0], belief=belief), *layout.slots[1:])
    stated = Problem(problem.model, Layout(slots, layout.records), problem.observations)
    zero = {"drive": np.zeros((2, WAVES))}
    at = inputs._evaluate(stated, KNOWN, values, zero, whitening, np.ones(2))
    columns, first = linear.columns(), np.eye(layout.size)[0]
    weighed = np.linalg.solve(dense_noise(whitening, linear, with_waves=True), columns)
    covariance = np.linalg.inv(columns.T @ weighed + np.outer(first, first) / belief.spread**2)
    np.testing.assert_allclose(at.covariance, covariance, rtol=EXACT, atol=EXACT * covariance.max())
    step = -covariance @ (weighed.T @ linear.offset.ravel() - first * belief.centre / belief.spread**2)
    np.testing.assert_allclose(at.step, step, rtol=EXACT, atol=EXACT * np.abs(step).max())
    assert (
        at.covariance[0, 0]
        < 0.9 * inputs._evaluate(problem, KNOWN, values, zero, whitening, np.ones(2)).covariance[0, 0]
    )


@pytest.mark.parametrize("kind", ["white", "coloured"])
def test_best_waves_make_the_sum_of_squares_least(linear: Linear, small: tuple[Task, np.ndarray], kind: str) -> None:
    whitening, values = whitenings()[kind], np.zeros(linear.layout.size)
    at = inputs._evaluate(small[0].problem, KNOWN, values, {"drive": np.zeros((2, WAVES))}, whitening, np.ones(2))
    noise = dense_noise(whitening, linear, with_waves=False)

    def cost(step: np.ndarray, coefficients: np.ndarray) -> float:
        residuals = linear.expanded(None, None, step, {"drive": coefficients})
        flat = np.concatenate([part[0].ravel() for part in residuals])
        return float(flat @ np.linalg.solve(noise, flat) + np.sum(coefficients**2))

    least, random = cost(at.step, at.best["drive"]), np.random.default_rng(2)
    for _ in range(20):
        moved = 1e-3 * random.standard_normal(len(values)), 1e-3 * random.standard_normal((2, WAVES))
        assert cost(at.step + moved[0], at.best["drive"] + moved[1]) > least


def test_waves_known_to_be_nil_change_nothing(linear: Linear, small: tuple[Task, np.ndarray]) -> None:
    """The negative control: inputs without errors widen nothing."""
    linear.sensitivities[:] = 0.0
    values, coefficients = np.zeros(linear.layout.size), {"drive": np.zeros((2, WAVES))}
    at = inputs._evaluate(small[0].problem, KNOWN, values, coefficients, whitenings()["coloured"], np.ones(2))
    np.testing.assert_allclose(at.covariance, at.of_corrected, rtol=EXACT)
    np.testing.assert_array_equal(at.best["drive"], 0.0)


def test_errors_widen_and_never_narrow(linear: Linear, small: tuple[Task, np.ndarray]) -> None:
    values, coefficients = np.zeros(linear.layout.size), {"drive": np.zeros((2, WAVES))}
    at = inputs._evaluate(small[0].problem, KNOWN, values, coefficients, whitenings()["coloured"], np.ones(2))
    assert np.linalg.eigvalsh(at.covariance - at.of_corrected).min() > -EXACT * at.covariance.max()
    assert np.diag(at.covariance - at.of_corrected).max() > 0.01 * np.diag(at.of_corrected).max()


def test_errors_that_suit_the_values_are_where_a_search_begins(
    linear: Linear, small: tuple[Task, np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    """From their best nothing is left to do: one look is enough."""
    task, values = small
    looks = []
    look = inputs.expanded
    monkeypatch.setattr(inputs, "expanded", lambda *a: looks.append(1) or look(*a))
    monkeypatch.setattr(inputs, "corrected", lambda problem, known, coefficients: problem)
    _, best = inputs.inputs_corrected(task, KNOWN, values)
    first = len(looks)
    _, again = inputs.inputs_corrected(task, KNOWN, values, best)
    assert len(looks) - first == 1 < first
    for name, rows in best.items():
        np.testing.assert_allclose(again[name], rows, atol=0.05)
