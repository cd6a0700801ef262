"""Likelihoods against dense linear algebra and SciPy, under masks; their gradient; the choice among them."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.stats
from scipy.linalg import toeplitz

from fibrefit.problem.noise.autoregressive import order_and_covariance
from fibrefit.problem.noise.choose import NoiseModel, choose_noise_model
from fibrefit.problem.noise.coloured import bank_of, coloured_of, variances_of
from fibrefit.problem.noise.likelihood import Likelihood
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.noise.whitening import Autoregressive, White, Whitening
from fibrefit.problem.posterior.log_posterior import LogPosterior, noise_priors
from fibrefit.problem.posterior.prior import Density, priors_of
from fibrefit.problem.statement.problem import Linearised
from fibrefit.problem.task import Task
from tests.sampling.drops import fitted, series, task_of

EXACT = 1e-9
"""Two ways to the same quadratic form, of some hundred terms."""
GAPS = 2e-3
"""After a gap an autoregression is predicted from what is left of its own order, which is nearly the best."""
DIFFERENCES = 1e-5
"""Central differences of a log density of 1e4, with steps that leave five digits."""

SIZE = 300
CHANNELS = ("force", "position")


@pytest.fixture(scope="module")
def valid() -> np.ndarray:
    """Two records, two channels: a gap, single samples lost, and an early end."""
    found = np.ones((2, 2, SIZE), dtype=bool)
    found[0, 0, 100:103] = False
    found[0, 1, [40, 42, 43]] = False
    found[1, :, 250:] = False
    return found


def dense(whitening: Whitening, valid: np.ndarray, residuals: np.ndarray) -> tuple[float, float]:
    """Quadratic form and half the log determinant from the covariance matrix itself."""
    lags = whitening.autocovariance(SIZE)
    square = volume = 0.0
    for r, c in np.ndindex(valid.shape[:2]):
        kept = valid[r, c]
        matrix = toeplitz(lags[r, c])[np.ix_(kept, kept)]
        square += float(residuals[r, c, kept] @ np.linalg.solve(matrix, residuals[r, c, kept]))
        volume += 0.5 * float(np.linalg.slogdet(matrix)[1])
    return square, volume


def coloured(valid: np.ndarray) -> Whitening:
    bank = bank_of([2000.0, 1000.0], 0.15)
    noise = [Noise(1.2e-4, 6e-3, 2e-3, 0), Noise(3e-13, 1.4e-11, 0.0, 0)]
    return coloured_of(bank, variances_of(bank, noise, np.array([[0.4, 2e-5], [0.5, 2e-5]])), jnp.asarray(valid))


def test_coloured_innovations_have_the_density_of_the_residuals(valid: np.ndarray) -> None:
    residuals = np.where(valid, np.random.default_rng(0).standard_normal(valid.shape), 0.0)
    whitening = coloured(valid)
    square, volume = dense(whitening, valid, residuals)
    assert float(jnp.sum(whitening.whiten(jnp.asarray(residuals)) ** 2)) == pytest.approx(square, rel=EXACT)
    assert float(whitening.log_scale) == pytest.approx(volume, rel=EXACT)


def test_masked_samples_do_not_matter(valid: np.ndarray) -> None:
    random = np.random.default_rng(1)
    residuals = random.standard_normal(valid.shape)
    other = np.where(valid, residuals, 1e3 * random.standard_normal(valid.shape))
    for whitening in (coloured(valid), Autoregressive.of([np.array([1.0, 0.6, 0.5])] * 2, valid), White(valid)):
        one, two = (np.asarray(whitening.whiten(jnp.asarray(x))) for x in (residuals, other))
        np.testing.assert_array_equal(one, two)
        assert np.all(one[~valid] == 0.0)


@pytest.mark.parametrize("gaps", [False, True])
def test_autoregressive_innovations_have_the_density_of_the_residuals(valid: np.ndarray, gaps: bool) -> None:
    kept = valid if gaps else np.ones_like(valid)
    lags = coloured(valid).autocovariance(8)[0]
    whitening = Autoregressive.of([lags[0], lags[1, :4]], kept)
    residuals = np.random.default_rng(2).standard_normal(valid.shape)
    square, volume = dense(whitening, kept, residuals)
    tolerance = GAPS if gaps else EXACT
    assert float(jnp.sum(whitening.whiten(jnp.asarray(residuals)) ** 2)) == pytest.approx(square, rel=tolerance)
    assert float(whitening.log_scale) == pytest.approx(volume, rel=tolerance)


def test_wander_has_a_density_of_one_over_f() -> None:
    bank = bank_of([2000.0], 2.0)
    lags = np.asarray(bank.variance)[0] @ np.asarray(bank.decay)[0][:, None] ** np.arange(200000)
    frequency = np.array([1.0, 5.0, 20.0, 80.0, 300.0])
    steps = np.arange(1, len(lags))
    waves = np.cos(np.pi * frequency[:, None] / 1000.0 * steps)
    density = 2.0 / 2000.0 * (lags[0] + 2.0 * waves @ lags[1:])
    # Six relaxations over four decades ripple; hiss hides the upper end.
    np.testing.assert_allclose(density * frequency, 1.0, rtol=0.1)


def likelihood(whitening: Whitening, valid: np.ndarray, known: tuple[bool, bool], heavy: bool) -> Likelihood:
    counts = jnp.asarray(valid.sum(axis=(0, 2)), dtype=float)
    return Likelihood(whitening, counts, jnp.zeros(()), CHANNELS, known, heavy)


def test_white_density_is_that_of_scipy(valid: np.ndarray) -> None:
    residuals = np.random.default_rng(3).standard_normal(valid.shape)
    levels = np.array([1.3, 0.8])
    normal = likelihood(White(jnp.asarray(valid)), valid, (False, False), False)
    expected = sum(scipy.stats.norm(0.0, levels[c]).logpdf(residuals[:, c][valid[:, c]]).sum() for c in range(2))
    assert float(normal.log_density(jnp.asarray(residuals), jnp.log(levels))) == pytest.approx(expected, rel=EXACT)
    heavy = likelihood(White(jnp.asarray(valid)), valid, (True, False), True)
    expected = scipy.stats.t(5.0).logpdf(residuals[:, 0][valid[:, 0]]).sum()
    expected += scipy.stats.t(5.0, scale=0.8).logpdf(residuals[:, 1][valid[:, 1]]).sum()
    noise = jnp.log(jnp.array([0.8, 5.0]))
    assert float(heavy.log_density(jnp.asarray(residuals), noise)) == pytest.approx(expected, rel=EXACT)
    assert heavy.names == ("noise.position", "noise.degrees_of_freedom")


@pytest.fixture(scope="module")
def residual_noise(small: tuple[Task, np.ndarray]) -> Linearised:
    task, values = small
    return jax.tree.map(np.asarray, task.problem.linearised(jnp.asarray(values)))


@pytest.mark.parametrize(("kind", "heavy"), [("coloured", True)])
def test_gradient_is_that_of_differences(
    small: tuple[Task, np.ndarray], residual_noise: Linearised, kind: str, heavy: bool
) -> None:
    task, values = small
    model = choose_noise_model(task.problem, residual_noise, kind, heavy=heavy)
    priors = priors_of(task.problem.layout, task.problem.model, values, {})
    density = LogPosterior(task.problem, priors.density, Density.of(noise_priors(model.likelihood)), model.likelihood)
    noise = np.full(model.likelihood.size, 0.05)
    noise[2:] = np.log(8.0)
    point = jnp.concatenate([task.problem.layout.free(jnp.asarray(values)) + 2e-5, noise])
    evaluate = jax.jit(lambda x: density(x))
    gradient = np.asarray(jax.jit(jax.grad(lambda x: density(x)))(point))
    curvature = np.abs(gradient).max()
    for i in range(len(point)):
        step = jnp.zeros(len(point)).at[i].set(1e-6)
        slope = float(evaluate(point + step) - evaluate(point - step)) / 2e-6
        assert gradient[i] == pytest.approx(slope, abs=DIFFERENCES * curvature + 2e-4 * abs(slope) + 0.02)


def chosen(share: float, seed: int, **settings: object) -> NoiseModel:
    task = task_of(series(np.random.default_rng(seed), share=share), share)
    linear = task.problem.linearised(jnp.asarray(fitted(task)))
    return choose_noise_model(task.problem, jax.tree.map(np.asarray, linear), **settings)


def test_the_data_choose_white_where_it_is_white() -> None:
    found = chosen(0.0, 4)
    assert found.kind == "white"
    assert found.says.startswith("Likelihood: white noise; chosen because it explains the residuals best:")


def test_the_data_choose_coloured_where_it_wanders() -> None:
    found = chosen(0.5, 5)
    assert found.kind == "coloured"
    # The spectrum that was put in: hiss within some per cent, wander within what two short records tell.
    assert found.noise[0].white == pytest.approx(0.75 * 0.4**2 / 1000.0, rel=0.1)
    assert found.noise[0].pink == pytest.approx((0.5 * 0.4) ** 2 / np.log(500.0), rel=0.6)


def test_the_order_of_an_autoregression_is_found() -> None:
    random = np.random.default_rng(6)
    values = np.zeros((4, 3000))
    for t in range(2, 3000):
        values[:, t] = 0.5 * values[:, t - 1] + 0.3 * values[:, t - 2] + random.standard_normal(4)
    order, covariance = order_and_covariance(values, np.ones(values.shape, dtype=bool))
    assert order == 2
    assert covariance[0] == pytest.approx(1.0 / (1.0 - 0.3**2 - 0.5**2 * (1.3 / 0.7)), rel=0.1)
    assert order_and_covariance(random.standard_normal((4, 3000)), np.ones((4, 3000), dtype=bool))[0] == 0


def test_a_level_the_study_states_is_not_learnt() -> None:
    found = chosen(0.5, 7, known=(True, False))
    assert found.likelihood.names == ("noise.position",)
    covariance = found.likelihood.whitening.autocovariance(1)[:, :, 0]
    # What was stated is the rms over a record; slower wander is part of the zero.
    np.testing.assert_allclose(covariance[:, 0], 1.0, atol=0.15)


def test_samples_that_stray_are_named() -> None:
    task = task_of(series(np.random.default_rng(8), share=0.0), 0.0)
    linear = jax.tree.map(np.asarray, task.problem.linearised(jnp.asarray(fitted(task))))
    assert "stray further" not in choose_noise_model(task.problem, linear, "white").says
    struck = linear.residuals.copy()
    struck[0, 0, 100:1000:90] += 12.0
    says = choose_noise_model(task.problem, linear._replace(residuals=struck), "white").says
    assert "Single samples stray further than normal noise does" in says
