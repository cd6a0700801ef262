"""Plain and whitened estimates with errors of measured inputs unknown: the same as dense algebra with all kept."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import toeplitz

from fibrefit.problem.estimate.gls import HausmanTest
from fibrefit.problem.inputs.sensitivities import InputSensitivities
from fibrefit.problem.noise.whitening import Whitening
from fibrefit.problem.statement.layout import Layout, Range, Slot
from fibrefit.problem.statement.problem import Linearised
from fibrefit.problem.task import Task
from fibrefit.problem.thresholds import UNLIKELY
from fibrefit.sampling.density.filters import Autoregressive, White

SAMPLES, WAVES = 40, 6
EXACT = 1e-4
"""Relative: reactions to errors of inputs are kept in single precision."""


def whitenings() -> dict[str, Whitening]:
    valid = np.ones((2, 2, SAMPLES), dtype=bool)
    coloured = [np.array([1.0, 0.6, 0.36 * 0.9]), np.array([2.0, 1.0])]
    return {"white": White(jnp.asarray(valid)), "coloured": Autoregressive.of(coloured, valid)}


@pytest.fixture
def made(small: tuple[Task, np.ndarray]) -> SimpleNamespace:
    """Records whose residuals are linear in values and coefficients, with random slopes."""
    random, layout = np.random.default_rng(0), small[0].problem.layout
    rows = random.standard_normal((2, len(layout.local_free), 2 * SAMPLES))
    waves = 2.0 * random.standard_normal((2, WAVES, 2 * SAMPLES))
    offset = 5.0 * random.standard_normal((2, 2 * SAMPLES))
    columns = np.zeros((4 * SAMPLES, layout.size + 2))
    for r in (0, 1):
        columns[r * 2 * SAMPLES : (r + 1) * 2 * SAMPLES, layout.local_columns[r]] = rows[r].T
    slopes = np.moveaxis(rows.reshape(2, -1, 2, SAMPLES), 1, -1)
    linear = Linearised(offset.reshape(2, 2, SAMPLES), slopes)
    return SimpleNamespace(
        layout=layout, linear=linear, waves=waves, offset=offset.ravel(), columns=columns[:, : layout.size]
    )


def seen(waves: np.ndarray) -> InputSensitivities:
    return InputSensitivities.of({"drive": np.zeros((2, WAVES))}, list(waves), np.ones((2, 2, SAMPLES)))


def covariance_of(whitening: Whitening, waves: np.ndarray) -> np.ndarray:
    """Of all residuals: the noise's, and that of the coefficients through what they do."""
    total = np.zeros((4 * SAMPLES, 4 * SAMPLES))
    for place, lags in enumerate(whitening.autocovariance(SAMPLES).reshape(4, -1)):
        here = slice(place * SAMPLES, (place + 1) * SAMPLES)
        total[here, here] = toeplitz(lags)
    for r in (0, 1):
        here = slice(r * 2 * SAMPLES, (r + 1) * 2 * SAMPLES)
        total[here, here] += waves[r].T @ waves[r]
    return total


def nothing_believed(layout: Layout) -> np.ndarray:
    return np.zeros((layout.size + 1,) * 2)


def test_both_estimates_are_those_of_dense_algebra(made: SimpleNamespace) -> None:
    whitening, columns = whitenings()["coloured"], made.columns
    belief = nothing_believed(made.layout)
    belief[0, 0], belief[0, -1] = 30.0, -4.0
    noise = (whitening, np.ones(2))
    found = HausmanTest.with_input_errors(made.layout, made.linear, seen(made.waves), noise, belief)
    true, prior, pull = covariance_of(whitening, made.waves), belief[:-1, :-1], belief[:-1, -1]
    weighed = np.linalg.solve(true, columns)
    whitened = np.linalg.inv(columns.T @ weighed + prior)
    # The plain estimate believes in white noise and is judged by what the noise is.
    believed = np.linalg.solve(covariance_of(whitenings()["white"], made.waves), columns)
    bread = np.linalg.inv(columns.T @ believed + prior)
    plain = bread @ (believed.T @ true @ believed + prior) @ bread
    step = -whitened @ (weighed.T @ made.offset + pull) + bread @ (believed.T @ made.offset + pull)
    expected = HausmanTest.of(step, plain, whitened)
    np.testing.assert_allclose(found.scores, expected.scores, rtol=EXACT, atol=EXACT)
    np.testing.assert_allclose(found.efficiency, expected.efficiency, rtol=EXACT)
    assert found.chance == pytest.approx(expected.chance, rel=1e-2)


def test_under_white_noise_both_are_one(made: SimpleNamespace) -> None:
    noise = (whitenings()["white"], np.ones(2))
    found = HausmanTest.with_input_errors(
        made.layout, made.linear, seen(made.waves), noise, nothing_believed(made.layout)
    )
    np.testing.assert_allclose(found.efficiency, 1.0, rtol=EXACT)
    assert np.isnan(found.scores).all()


def test_what_errors_imitate_sets_off_no_alarm(made: SimpleNamespace) -> None:
    """The negative control: the same taken for exact inputs does."""
    noise, random = (whitenings()["coloured"], np.ones(2)), np.random.default_rng(3)
    imitated = np.einsum("rw,rwn->rn", 10.0 * random.standard_normal((2, WAVES)), made.waves)
    linear = Linearised(imitated.reshape(2, 2, SAMPLES), made.linear.slopes)
    of = [
        HausmanTest.with_input_errors(
            made.layout, linear, seen(size * made.waves), noise, nothing_believed(made.layout)
        )
        for size in (10.0, 1e-6)
    ]
    assert of[0].chance > 0.05
    assert of[1].chance < 1e-6


def test_a_value_at_a_bound_is_held_in_both() -> None:
    """In nearly white noise: what is left there is no sign of a model that lacks something."""
    random, count = np.random.default_rng(2), 400
    valid = np.ones((1, 1, count), dtype=bool)
    whitening = Autoregressive.of([np.array([1.0, 0.2])], valid)
    slots = [Slot(name, "-", Range(0.0, np.inf, 1.0)) for name in ("k", "b")]
    both, alone = Layout(tuple(slots), ("a",)), Layout((slots[0], replace(slots[1], fixed=(0.0,))), ("a",))
    slopes = random.standard_normal((1, 1, count, 2))
    slopes[..., 1] += 0.5 * np.cumsum(random.standard_normal(count)) / 5.0
    noise = np.linalg.cholesky(toeplitz(whitening.autocovariance(count).ravel())) @ random.standard_normal(count)
    # The best value of b lies beyond the bound: there k has no gradient, and b has.
    beyond = noise - 0.2 * slopes[0, 0, :, 1]
    first = slopes[0, 0, :, 0]
    residual = (beyond - first * (first @ beyond) / (first @ first))[None, None]
    stopped = HausmanTest.at(both, Linearised(residual, slopes), whitening, None, None, np.array([True, False]))
    known = HausmanTest.at(alone, Linearised(residual, slopes[..., :1]), whitening, None)
    assert stopped.chance == pytest.approx(known.chance)
    assert stopped.scores[0] == pytest.approx(known.scores[0])
    assert np.isnan(stopped.scores[1])
    assert stopped.chance > UNLIKELY > HausmanTest.at(both, Linearised(residual, slopes), whitening, None).chance
