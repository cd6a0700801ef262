"""Errors of measured inputs, integrated out with deviations between records: the same as dense algebra."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, NamedTuple, cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.stats import multivariate_normal

from fibrefit.problem.inputs.sensitivities import InputSensitivities
from fibrefit.problem.linear_model.view import View
from fibrefit.problem.noise.whitening import Levelled
from fibrefit.problem.statement.problem import Linearised
from fibrefit.sampling.density.filters import White
from fibrefit.sampling.density.likelihood import Likelihood
from fibrefit.sampling.density.log_posterior import InputEffects, Mixture, RandomEffects
from fibrefit.sampling.latent import DrawnInputs, input_effects_of

RECORDS, SAMPLES, VALUES, WAVES = 2, 20, 3, 6
SIZE = 2 * SAMPLES
LEVEL = np.array([1.3, 0.8])
SIGMA = np.array([[0.0, 0.0], [0.01, 0.0], [0.02, 0.05]])
THERE = np.array([[1.0, 2.0, 0.5], [1.1, 1.5, 0.4]])
EXACT = 1e-5
"""Relative: reactions to errors of inputs are kept in single precision."""


class Records(NamedTuple):
    """Linear records: slopes, what errors of inputs do, readings at nothing, coefficients where it is linearised."""

    slopes: np.ndarray
    waves: np.ndarray
    rest: np.ndarray
    about: np.ndarray

    def residuals(self, local: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
        """``(n_record, 2, n_time)``."""
        found = self.rest + np.einsum("ri,rin->rn", local, self.slopes)
        return (found + np.einsum("rw,rwn->rn", coefficients, self.waves)).reshape(RECORDS, 2, SAMPLES)


@pytest.fixture
def records() -> Records:
    """Readings at `THERE` are those of noise and of errors of inputs of their size."""
    random = np.random.default_rng(4)
    draw = random.standard_normal
    slopes, waves = 30.0 * draw((RECORDS, VALUES, SIZE)), 2.0 * draw((RECORDS, WAVES, SIZE))
    rest = draw((RECORDS, SIZE)) - np.einsum("rw,rwn->rn", draw((RECORDS, WAVES)), waves)
    return Records(slopes, waves, rest - np.einsum("ri,rin->rn", THERE, slopes), draw((RECORDS, WAVES)))


def sensitivities_of(records: Records) -> InputSensitivities:
    return InputSensitivities.of({"drive": records.about}, list(records.waves), np.ones((RECORDS, 2, SAMPLES)))


def seen_of(records: Records) -> View:
    """Through the noise at which the records are linearised, the inputs as corrected there."""
    raw, valid = sensitivities_of(records), np.ones((RECORDS, 2, SAMPLES), dtype=bool)
    whitening = Levelled(White(jnp.asarray(valid)), jnp.asarray(LEVEL))
    slopes = np.moveaxis(records.slopes.reshape(RECORDS, VALUES, 2, SAMPLES), 1, -1)

    def followed(local: np.ndarray) -> tuple[Linearised, None]:
        return Linearised(records.residuals(local, records.about), slopes), None

    problem = SimpleNamespace(evaluate=followed, layout=SimpleNamespace(local_free=(0, 1, 2)))
    return View(cast(Any, problem), whitening, raw.through(whitening), raw)


def likelihood() -> Likelihood:
    valid = jnp.ones((RECORDS, 2, SAMPLES), dtype=bool)
    counts = jnp.full(2, float(RECORDS * SAMPLES))
    return Likelihood(White(valid), counts, jnp.zeros(()), ("force", "position"), (False, False))


def random_effects_of(records: Records, inputs: InputEffects, eta: np.ndarray) -> RandomEffects:
    """The first and the last value may deviate."""
    slopes = np.moveaxis(records.slopes.reshape(RECORDS, VALUES, 2, SAMPLES), 1, -1) + np.asarray(inputs.slopes)
    slopes = (slopes * np.asarray(inputs.local)[:, None, None])[..., [0, 2]]
    return RandomEffects(
        slopes=jnp.asarray(slopes),
        products=jnp.einsum("rcti,rctj->rcij", slopes, slopes),
        middle=jnp.zeros(2),
        eta=jnp.asarray(eta),
        follow=jnp.zeros((3, RECORDS, 2, 2)),
        where=Mixture(jnp.zeros(3), jnp.zeros((3, 2)), jnp.zeros((3, 2, 2))),
        sigma=jnp.asarray(SIGMA),
        log_prior=jnp.log(jnp.array([0.5, 0.3, 0.2])),
        places=(0, 2),
        columns=(0, 2),
        bend=inputs.bend((0, 2)),
    )


def found(records: Records, inputs: InputEffects, local: np.ndarray, level: np.ndarray = LEVEL) -> np.ndarray:
    """Log density under each standard deviation, as `LogPosterior` puts it together."""
    of, noise = likelihood(), jnp.log(jnp.asarray(level))
    white = inputs.at_best(jnp.asarray(records.residuals(local, records.about)), jnp.asarray(local))
    total = jnp.sum(of.of_innovations(white, noise)) + of.constant(noise)
    total += inputs.log_density(of, noise, jnp.asarray(local))
    effects = random_effects_of(records, inputs, np.zeros((RECORDS, 2)))
    beside = inputs.pull(jnp.asarray(local), (0, 2))
    return np.asarray(total + effects.conditional(of, white, noise, jnp.zeros((RECORDS, 2)), beside).logs)


def dense(records: Records, local: np.ndarray, there: np.ndarray, level: np.ndarray = LEVEL) -> np.ndarray:
    """The same by the covariance of all readings; deviations are relative to the values at the mode."""
    rest = records.residuals(local, np.zeros((RECORDS, WAVES))).reshape(RECORDS, SIZE)
    totals = np.log([0.5, 0.3, 0.2])
    for g, sigma in enumerate(SIGMA):
        for r in range(RECORDS):
            moved = (sigma * there[r, [0, 2]])[:, None] * records.slopes[r, [0, 2]]
            covariance = np.diag(np.repeat(level**2, SAMPLES)) + moved.T @ moved
            covariance += records.waves[r].T @ records.waves[r]
            totals[g] += multivariate_normal.logpdf(rest[r], cov=covariance)
    return totals


@pytest.mark.parametrize("away", [0.0, 0.03])
def test_the_density_is_that_of_readings_whose_covariance_holds_errors_and_deviations(
    records: Records, away: float
) -> None:
    inputs = input_effects_of(seen_of(records), THERE, LEVEL)
    assert inputs is not None
    local = THERE + away * np.random.default_rng(5).standard_normal(THERE.shape)
    np.testing.assert_allclose(found(records, inputs, local), dense(records, local, THERE), rtol=EXACT, atol=1e-2)


def test_errors_that_stay_where_they_were_best_are_another_density(records: Records) -> None:
    """The negative control: what the walkers did before, with the inputs as corrected at the mode."""
    inputs = input_effects_of(seen_of(records), THERE, LEVEL)
    assert inputs is not None
    held = eqx.tree_at(lambda one: one.slopes, inputs, jnp.zeros_like(inputs.slopes))
    local = THERE + 0.03
    assert np.abs(found(records, held, local) - dense(records, local, THERE)).min() > 1.0


def test_the_level_of_the_noise_has_the_slope_of_the_exact_density(records: Records) -> None:
    """To the first order, as far as a level is open; the control counts no coefficients that the readings tell."""
    inputs = input_effects_of(seen_of(records), THERE, LEVEL)
    assert inputs is not None
    free = eqx.tree_at(lambda one: one.told, inputs, jnp.zeros(2))
    for channel in (0, 1):
        low, high = (LEVEL * np.exp(step * (np.arange(2) == channel)) for step in (-0.01, 0.01))
        exact = dense(records, THERE, THERE, high)[0] - dense(records, THERE, THERE, low)[0]
        slope, without = (
            found(records, one, THERE, high)[0] - found(records, one, THERE, low)[0] for one in (inputs, free)
        )
        assert slope == pytest.approx(exact, abs=0.01)
        assert abs(without - exact) > 0.05


def drawn_of(records: Records) -> DrawnInputs:
    known = {"drive": SimpleNamespace(size=np.ones((RECORDS, WAVES)))}
    return DrawnInputs(cast(Any, None), cast(Any, known), seen_of(records), LEVEL)


def test_errors_are_drawn_from_their_normal_law(records: Records) -> None:
    white = np.repeat(records.residuals(THERE, records.about)[None], 4000, axis=0)
    drawn = drawn_of(records).drawn(white, np.random.default_rng(6))["drive"] + records.about
    rest = records.residuals(THERE, np.zeros((RECORDS, WAVES))).reshape(RECORDS, SIZE)
    for r in range(RECORDS):
        weighed = records.waves[r] / np.repeat(LEVEL**2, SAMPLES)
        covariance = np.linalg.inv(np.eye(WAVES) + weighed @ records.waves[r].T)
        spread = np.sqrt(np.diag(covariance))
        # Four standard errors of a mean of 4000 draws.
        off = np.abs(drawn[:, r].mean(axis=0) + covariance @ weighed @ rest[r])
        assert np.all(off < 4.0 * spread / np.sqrt(4000))
        np.testing.assert_allclose(drawn[:, r].std(axis=0), spread, rtol=0.05)


def test_a_block_is_predicted_from_all_others(records: Records) -> None:
    inputs = input_effects_of(seen_of(records), THERE, LEVEL)
    assert inputs is not None
    blocks = np.where(np.arange(SAMPLES) < 12, 0, 1) + 2 * np.arange(RECORDS)[:, None]
    left_out = drawn_of(records).left_out(blocks, 5)
    white = inputs.at_best(jnp.asarray(records.residuals(THERE, records.about)), jnp.asarray(THERE))
    of, noise = likelihood(), jnp.log(jnp.asarray(LEVEL))
    each = np.asarray(of.of_innovations(jnp.asarray(left_out.predicted(np.asarray(white)[None])[0]), noise))
    rest = records.residuals(THERE, np.zeros((RECORDS, WAVES))).reshape(RECORDS, SIZE)
    for r in range(RECORDS):
        covariance = np.diag(np.repeat(LEVEL**2, SAMPLES)) + records.waves[r].T @ records.waves[r]
        whole = multivariate_normal.logpdf(rest[r], cov=covariance)
        for block in (0, 1):
            inside = np.tile(blocks[r] == 2 * r + block, 2)
            others = multivariate_normal.logpdf(rest[r][~inside], cov=covariance[np.ix_(~inside, ~inside)])
            constant = np.sum(np.log(np.repeat(LEVEL, SAMPLES)[inside])) + 0.5 * inside.sum() * np.log(2.0 * np.pi)
            here = each[r].reshape(-1)[inside].sum() - constant - left_out.log_det[2 * r + block]
            assert here == pytest.approx(whole - others, rel=1e-4, abs=1e-3)


def test_inputs_without_errors_change_nothing(records: Records) -> None:
    """The negative control: what no reading shows is neither taken off nor counted."""
    still = replace_waves(records, 1e-9)
    inputs = input_effects_of(seen_of(still), THERE, LEVEL)
    assert inputs is not None
    np.testing.assert_allclose(inputs.slopes, 0.0, atol=1e-6)
    assert float(inputs.log_det) == pytest.approx(0.0, abs=1e-6)
    assert input_effects_of(replace(seen_of(records), sensitivities=None), THERE, LEVEL) is None


def replace_waves(records: Records, factor: float) -> Records:
    return records._replace(waves=factor * records.waves)


def test_its_gradient_is_that_of_the_values(records: Records) -> None:
    inputs = input_effects_of(seen_of(records), THERE, LEVEL)
    assert inputs is not None
    of, noise = likelihood(), jnp.log(jnp.asarray(LEVEL))
    gradient = jax.grad(lambda local: inputs.log_density(of, noise, local))(jnp.asarray(THERE + 0.02))
    expected = -np.asarray(inputs.pull(jnp.asarray(THERE + 0.02), (0, 1, 2))) / THERE
    np.testing.assert_allclose(gradient, expected, rtol=1e-9)
