"""Likelihoods against dense linear algebra and SciPy, under masks; their gradient; the choice among them."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.stats
from scipy.linalg import toeplitz

from fibrefit.core.spectra import MAINS
from fibrefit.problem.noise.coloured import BLOCK, HALF_WIDTH_OF_LINE, LINES, Coloured, bank_of, coloured_of, in_blocks
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.noise.whitening import Whitening
from fibrefit.problem.statement.observations import Steps, Trace, stack, step_residuals
from fibrefit.problem.statement.problem import Linearised
from fibrefit.problem.task import Task
from fibrefit.report.sentences.posterior import likelihood_sentence
from fibrefit.sampling.density.filters import Autoregressive, White, order_and_covariance
from fibrefit.sampling.density.likelihood import (
    Likelihood,
    NoiseModel,
    choose_noise_model,
    downweighted_likelihood,
    likelihood_of,
)
from fibrefit.sampling.density.log_posterior import LogPosterior, noise_priors
from fibrefit.sampling.density.prior import Density, Priors
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


UNITS = np.array([[0.4, 2e-5], [0.5, 2e-5]])
NOISES = (
    Noise(1.2e-4, 6e-3, 2e-3, 0, lines=((150.3, 4e-3),)),
    Noise(3e-13, 0.0, 0.0, 0, slow=((8.0, 3e-10), (40.0, 5e-11)), lines=((50.1, 2e-10), (83.7, 1e-10))),
)
"""1/f with a line at a mains frequency and another line; and first-order parts with two lines of any frequency."""


def coloured(valid: np.ndarray) -> Coloured:
    return coloured_of(bank_of((2000.0, 1000.0), 0.15), NOISES, UNITS, valid)


def test_coloured_innovations_have_the_density_of_the_residuals(valid: np.ndarray) -> None:
    residuals = np.where(valid, np.random.default_rng(0).standard_normal(valid.shape), 0.0)
    whitening = coloured(valid)
    square, volume = dense(whitening, valid, residuals)
    assert float(jnp.sum(whitening.whiten(jnp.asarray(residuals)) ** 2)) == pytest.approx(square, rel=EXACT)
    assert float(whitening.log_scale) == pytest.approx(volume, rel=EXACT)


def test_many_rows_are_whitened_as_each_alone(valid: np.ndarray) -> None:
    rows, whitening = jnp.asarray(np.random.default_rng(9).standard_normal((5, *valid.shape))), coloured(valid)
    each = np.stack([np.asarray(whitening.whiten(row)) for row in rows])
    np.testing.assert_allclose(np.asarray(whitening.whiten_rows(rows)), each, rtol=EXACT, atol=EXACT)


@pytest.mark.parametrize("longer", [0, 5, BLOCK - 1])
def test_blocks_whiten_as_the_filter_does(valid: np.ndarray, longer: int) -> None:
    valid = np.concatenate([valid, valid[..., :longer]], axis=-1)
    whitening = coloured(valid)
    rows = jnp.asarray(np.where(valid, np.random.default_rng(4).standard_normal((3, *valid.shape)), 0.0))
    expected, found = np.asarray(whitening.whiten_rows(rows)), np.asarray(in_blocks(whitening).whiten_rows(rows))
    np.testing.assert_allclose(found, expected, rtol=EXACT, atol=EXACT)
    np.testing.assert_array_equal(found[:, ~valid], 0.0)
    np.testing.assert_allclose(np.asarray(in_blocks(whitening).whiten(rows[0])), expected[0], rtol=EXACT, atol=EXACT)


@pytest.mark.parametrize(("kind", "exact"), [(float, EXACT), (np.float32, 1e-5)])
def test_many_rows_are_whitened_in_blocks_by_products_of_matrices(valid: np.ndarray, kind: type, exact: float) -> None:
    whitening = coloured(valid)
    rows = np.where(valid, np.random.default_rng(5).standard_normal((3, *valid.shape)), 0.0)
    expected = np.moveaxis(np.asarray(whitening.whiten_rows(jnp.asarray(rows))), 0, 1)
    filtered = in_blocks(whitening)
    found = np.array(filtered.whiten_many(np.moveaxis(rows, 0, 1).astype(kind)))
    assert found.dtype == kind
    # The end of a record is not needed for what is before it.
    begun = filtered.whiten_many([of[..., : 70 + r] for r, of in enumerate(np.moveaxis(rows, 0, 1).astype(kind))])
    for r, of in enumerate(begun):
        np.testing.assert_allclose(of, found[r, ..., : 70 + r], rtol=0.0, atol=exact * np.abs(expected).max())
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=exact * np.abs(expected).max())
    np.testing.assert_array_equal(np.moveaxis(found, 1, 0)[:, ~valid], 0.0)


def test_the_covariance_is_that_of_the_parts(valid: np.ndarray) -> None:
    bank, lags = bank_of((2000.0, 1000.0), 0.15), np.arange(40)
    found = coloured(valid).autocovariance(40) * UNITS[:, :, None] ** 2
    for r, rate in enumerate((2000.0, 1000.0)):
        held = np.exp(-2.0 * np.pi * HALF_WIDTH_OF_LINE / rate * lags)
        mains, other = (held * np.cos(2.0 * np.pi * line * lags / rate) for line in (MAINS[0], 150.3))
        pink = np.asarray(bank.pink)[r] @ np.asarray(bank.decay)[r][:, None] ** lags
        expected = 1.2e-4 * 0.5 * rate * (lags == 0) + 6e-3 * pink + 2e-3 * mains + 4e-3 * other
        np.testing.assert_allclose(found[r, 0], expected, rtol=EXACT)
        # A corner that is none of the bank's is taken by the nearest one.
        corners = np.asarray(bank.corners)
        near = [corners[np.argmin(np.abs(np.log(corners / corner)))] for corner in (8.0, 40.0)]
        parts = [v * np.exp(-2.0 * np.pi * c / rate * lags) for c, v in zip(near, (3e-10, 5e-11), strict=True)]
        coefficients = [v * held * np.cos(2.0 * np.pi * f * lags / rate) for f, v in ((50.1, 2e-10), (83.7, 1e-10))]
        expected = 3e-13 * 0.5 * rate * (lags == 0) + sum(parts) + sum(coefficients)
        np.testing.assert_allclose(found[r, 1], expected, rtol=EXACT)


def test_of_more_lines_than_there_is_room_for_the_strongest_stay(valid: np.ndarray) -> None:
    lines = tuple((20.0 * (i + 1), 1e-3 * (i + 1)) for i in range(LINES + 1))
    many, few = (Noise(1e-4, 0.0, 0.0, 0, lines=some) for some in (lines, lines[1:]))
    bank, ones = bank_of((2000.0, 1000.0), 0.15), np.ones((2, 1))
    both = [coloured_of(bank, [noise], ones, valid[:, :1]).autocovariance(20) for noise in (many, few)]
    np.testing.assert_array_equal(*both)


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


def test_pink_noise_has_a_density_of_one_over_f() -> None:
    bank = bank_of((2000.0,), 2.0)
    lags = np.asarray(bank.pink)[0] @ np.asarray(bank.decay)[0][:, None] ** np.arange(200000)
    frequency = np.array([1.0, 5.0, 20.0, 80.0, 300.0])
    steps = np.arange(1, len(lags))
    coefficients = np.cos(np.pi * frequency[:, None] / 1000.0 * steps)
    density = 2.0 / 2000.0 * (lags[0] + 2.0 * coefficients @ lags[1:])
    # First-order parts a factor of three apart ripple; white noise hides the upper end.
    np.testing.assert_allclose(density * frequency, 1.0, rtol=0.1)


def likelihood(whitening: Whitening, valid: np.ndarray, known: tuple[bool, bool], heavy: bool) -> Likelihood:
    counts = jnp.asarray(valid.sum(axis=(0, 2)), dtype=float)
    return Likelihood(whitening, counts, jnp.zeros(()), CHANNELS, known, heavy)


def test_white_density_is_that_of_scipy(valid: np.ndarray) -> None:
    residuals = np.random.default_rng(3).standard_normal(valid.shape)
    levels = np.array([1.3, 0.8])
    normal = likelihood(White(jnp.asarray(valid)), valid, (False, False), False)
    expected = sum(scipy.stats.norm(0.0, levels[c]).logpdf(residuals[:, c][valid[:, c]]).sum() for c in range(2))
    assert float(log_density(normal, jnp.asarray(residuals), jnp.log(levels))) == pytest.approx(expected, rel=EXACT)
    heavy = likelihood(White(jnp.asarray(valid)), valid, (True, False), True)
    expected = scipy.stats.t(5.0).logpdf(residuals[:, 0][valid[:, 0]]).sum()
    expected += scipy.stats.t(5.0, scale=0.8).logpdf(residuals[:, 1][valid[:, 1]]).sum()
    noise = jnp.log(jnp.array([0.8, 5.0]))
    assert float(log_density(heavy, jnp.asarray(residuals), noise)) == pytest.approx(expected, rel=EXACT)
    assert heavy.names == ("noise.position", "noise.degrees_of_freedom")


@pytest.fixture(scope="module")
def residual_noise(small: tuple[Task, np.ndarray]) -> Linearised:
    task, values = small
    return jax.tree.map(np.asarray, task.problem.linearised(jnp.asarray(values)))


@pytest.mark.parametrize("freedom", [3.0, 15.0])
def test_the_information_of_tails_is_what_their_curvature_is_on_average(freedom: float) -> None:
    valid = np.ones((1, 2, 100_000), dtype=bool)
    one = likelihood(White(jnp.asarray(valid)), valid, (False, False), True)
    noise = jnp.log(jnp.array([1.3, 0.7, freedom]))
    draws = np.random.default_rng(5).standard_t(freedom, valid.shape) * np.exp(noise[:2])[:, None]
    expected = -jax.hessian(lambda x: log_density(one, jnp.asarray(draws), x))(noise)
    found = one.information(jnp.asarray(draws), noise)
    unit = np.sqrt(np.diag(found))
    np.testing.assert_allclose(found / np.outer(unit, unit), expected / np.outer(unit, unit), atol=0.06)


def test_samples_that_count_in_part_neither_gain_nor_lose_by_it() -> None:
    """What noise is worth on the average does not depend on the factors; the control takes them for larger noise."""
    valid, random = np.ones((1, 2, 2048), dtype=bool), np.random.default_rng(6)
    trace = Trace("one", np.arange(2048) / 2000.0, dict.fromkeys(CHANNELS, np.zeros(2048)), {}, {})
    data = stack([trace], {"force": [0.4], "position": [2e-5]})
    one = likelihood_of(White(jnp.asarray(valid)), data, CHANNELS, (True, True))
    draws, downweight = random.standard_normal((200, *valid.shape)), random.uniform(0.05, 1.0, valid.shape)
    part = downweighted_likelihood(one, data, downweight)

    def mean(of: Likelihood) -> float:
        return float(np.mean([log_density(of, jnp.asarray(downweight * draw), jnp.zeros(0)) for draw in draws]))

    whole = float(np.mean([log_density(one, jnp.asarray(draw), jnp.zeros(0)) for draw in draws]))
    # Of 200 draws of 4096 samples, each with a standard deviation of one over the root of two; and of both means.
    assert mean(part) == pytest.approx(whole, abs=4.0 * np.sqrt(2.0 * 0.5 * 4096.0 / 200.0))
    assert abs(mean(one) - whole) > 200.0
    np.testing.assert_allclose(part.counts, np.sum(downweight**2, axis=(0, 2)), rtol=1e-12)


def log_density(of: Likelihood, residuals: jax.Array, noise: jax.Array) -> jax.Array:
    """Logarithm of the density of the measured values, in SI units."""
    return jnp.sum(of.of_innovations(of.whitening.whiten(residuals), noise)) + of.constant(noise)


def mean_log_density(of: Likelihood, draws: list[np.ndarray]) -> float:
    """Over draws of the noise, at the noise that is stated."""
    density = jax.jit(lambda draw: log_density(of, draw, jnp.zeros(0)))
    return float(np.mean([density(jnp.asarray(draw)) for draw in draws]))


DRAWS = 100


def test_samples_that_a_whitening_does_not_see_neither_gain_nor_lose_by_it() -> None:
    """A quarter of one channel hardly counts, of noise with a memory; the control forgets what that is worth."""
    size, random = 2048, np.random.default_rng(6)
    noise, unit = [Noise(8e-5, 8e-2, 0.0, 0), Noise(4e-13, 2e-12, 0.0, 0)], np.array([[0.4, 2e-5]])
    trace = Trace("one", np.arange(size) / 2000.0, dict.fromkeys(CHANNELS, np.zeros(size)), {}, {})
    data, bank = stack([trace], {"force": [0.4], "position": [2e-5]}), bank_of((2000.0,), size / 2000.0)
    downweight = np.where((np.arange(size) < 0.75 * size) | (np.arange(2)[:, None] > 0), 1.0, 0.1)[None]
    every, seen = np.ones((1, 2, size), dtype=bool), downweight > 0.3
    whole, masked = (
        likelihood_of(coloured_of(bank, noise, unit, valid), data, CHANNELS, (True, True)) for valid in (every, seen)
    )
    draws = [
        np.stack([of.draw(size, 2000.0, random) / rms for of, rms in zip(noise, unit[0], strict=True)])[None]
        for _ in range(DRAWS)
    ]
    full = mean_log_density(whole, draws)
    dimmed = [downweight * draw for draw in draws]
    part, control = (mean_log_density(of, dimmed) for of in (downweighted_likelihood(masked, data, downweight), masked))
    assert part == pytest.approx(full, abs=4.0 * np.sqrt(2.0 * 0.5 * 4096.0 / DRAWS))
    assert abs(control - full) > 100.0


def test_it_is_a_curvature_of_a_maximum_where_the_one_at_hand_is_none() -> None:
    """Noise without tails, and a level that is assumed too small: a search has to find its way from there."""
    valid = np.ones((1, 2, 4000), dtype=bool)
    one = likelihood(White(jnp.asarray(valid)), valid, (False, False), True)
    residuals = jnp.asarray(np.random.default_rng(5).standard_normal(valid.shape))
    noise = jnp.log(jnp.array([0.7, 0.7, 15.0]))
    at_hand = -jax.hessian(lambda x: log_density(one, residuals, x))(noise)
    assert np.linalg.eigvalsh(at_hand).min() < 0.0
    assert np.linalg.eigvalsh(one.information(residuals, noise)).min() > 0.0


@pytest.mark.parametrize(("kind", "heavy"), [("coloured", True)])
def test_gradient_is_that_of_differences(
    small: tuple[Task, np.ndarray], residual_noise: Linearised, kind: str, heavy: bool
) -> None:
    task, values = small
    model = choose_noise_model(task.problem, residual_noise, kind, heavy=heavy)
    priors = Priors.of(task.problem.layout, task.problem.model, values, {})
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
    assert likelihood_sentence(found).startswith(
        "Likelihood: white noise; chosen because it explains the residuals best:"
    )


def sampled_density(noise: Noise, frequency: np.ndarray, rate: float = 2000.0) -> np.ndarray:
    """Of samples: what lies beyond half the rate is folded back."""
    density = noise.white + noise.pink / frequency
    for corner, variance in noise.slow:
        decay = np.exp(-2.0 * np.pi * corner / rate)
        turn = np.abs(1.0 - decay * np.exp(2j * np.pi * frequency / rate)) ** 2
        density += 2.0 / rate * variance * (1.0 - decay**2) / turn
    return density


def test_the_data_choose_coloured_where_it_is_pink() -> None:
    found = chosen(0.5, 5)
    assert found.kind == "coloured"
    # The spectrum that was put in: white noise within some per cent, pink noise within what two short records tell.
    frequency = np.array([4.0, 10.0, 30.0, 700.0, 900.0])
    truth = 0.75 * 0.4**2 / 1000.0 + (0.5 * 0.4) ** 2 / np.log(500.0) / frequency
    density = sampled_density(found.parameters[0], frequency)
    np.testing.assert_allclose(density[:3], truth[:3], rtol=0.6)
    np.testing.assert_allclose(density[3:], truth[3:], rtol=0.1)
    assert found.parameters[0].lines == ()


def test_a_line_is_found_on_the_way_and_a_stated_spectrum_is_taken_as_it_is() -> None:
    task = task_of(series(np.random.default_rng(4), share=0.0), 0.0)
    linear = jax.tree.map(np.asarray, task.problem.linearised(jnp.asarray(fitted(task))))
    mains = 0.6 * np.sin(2.0 * np.pi * 50.1 * np.arange(linear.residuals.shape[-1]) / 2000.0)
    with_line = linear.residuals.copy()
    with_line[:, 0] += mains
    found = choose_noise_model(task.problem, linear._replace(residuals=with_line))
    assert found.kind == "coloured"
    ((frequency, variance),) = found.parameters[0].lines
    # Two records of half a second: lines two hertz apart are told apart, and its phase in so few is no average.
    assert abs(frequency - 50.1) < 1.0
    assert variance == pytest.approx(0.5 * (0.6 * 0.4) ** 2, rel=0.3)
    # The negative control: in the other channel there is none.
    assert found.parameters[1].lines == ()
    stated = {"force": Noise(2e-4, 0.0, 0.0, 0), "position": Noise(3e-13, 0.0, 0.0, 0)}
    taken = choose_noise_model(task.problem, linear, "coloured", spectrum=stated)
    assert taken.parameters == tuple(stated.values())
    assert likelihood_sentence(taken) == "Likelihood: noise of a spectrum without slow parts, as requested."


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
    # What was stated is the rms over a record; slower pink noise is part of the zero.
    np.testing.assert_allclose(covariance[:, 0], 1.0, atol=0.15)


def test_samples_that_stray_are_named() -> None:
    task = task_of(series(np.random.default_rng(8), share=0.0), 0.0)
    linear = jax.tree.map(np.asarray, task.problem.linearised(jnp.asarray(fitted(task))))
    assert "heavier tails" not in likelihood_sentence(choose_noise_model(task.problem, linear, "white"))
    struck = linear.residuals.copy()
    struck[0, 0, 100:1000:90] += 12.0
    says = likelihood_sentence(choose_noise_model(task.problem, linear._replace(residuals=struck), "white"))
    assert "Residuals have heavier tails than normal noise" in says


def test_readings_in_coarse_steps_have_the_probability_of_their_steps() -> None:
    """Against the normal law's integral over each step, by SciPy; densities differ from that by the step."""
    random, size, noise = np.random.default_rng(2), 0.5, 0.15
    times = np.arange(80) / 1000.0
    signal = 4.0 * np.sin(60.0 * times)
    read = size * np.round((signal + noise * random.standard_normal(len(times))) / size)
    data = stack([Trace("made", times, {"force": read}, {}, {})], {"force": [0.2]})
    steps = Steps(*(np.array([number]) for number in (size, noise, 0.2)))
    likelihood = likelihood_of(
        White(jnp.asarray(data.weight["force"])[:, None] > 0.0),
        data._replace(steps={"force": steps}),
        ("force",),
        (True,),
    )
    residuals = np.zeros((1, 1, data.experiment.times.shape[1]))
    residuals[0, 0, : len(times)] = step_residuals(jnp.asarray(signal - read), Steps(*(float(s[0]) for s in steps)))
    ends = (read[:, None] + size * np.array([-0.5, 0.5]) - signal[:, None]) / noise
    expected = np.log(np.diff(scipy.stats.norm.cdf(ends), axis=1) / size).sum()
    assert float(log_density(likelihood, jnp.asarray(residuals), jnp.zeros(0))) == pytest.approx(expected, rel=1e-6)
