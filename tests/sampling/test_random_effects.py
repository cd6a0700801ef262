"""Deviations between records, integrated out: the same as dense algebra with all of them kept."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.stats import multivariate_normal

from fibrefit.problem.estimate.evidence import grid_over, usual_axes
from fibrefit.sampling.density.filters import White
from fibrefit.sampling.density.likelihood import Likelihood
from fibrefit.sampling.density.log_posterior import Mixture, RandomEffects

RECORDS, SAMPLES, NUMBER = 3, 12, 2
EXACT = 1e-9


def linear(eta: np.ndarray, random: np.random.Generator) -> tuple[RandomEffects, np.ndarray, np.ndarray]:
    """A scatter of linear records, its slopes, and residuals without deviations."""
    slopes = 30.0 * random.standard_normal((RECORDS, 1, SAMPLES, NUMBER))
    grid, log_prior = grid_over(usual_axes(NUMBER))
    random_effects = RandomEffects(
        slopes=jnp.asarray(slopes),
        products=jnp.einsum("rcti,rctj->rcij", slopes, slopes),
        middle=jnp.zeros(NUMBER),
        eta=jnp.asarray(eta),
        follow=jnp.zeros((len(grid), RECORDS, NUMBER, NUMBER)),
        where=Mixture(jnp.zeros(len(grid)), jnp.zeros((len(grid), NUMBER)), jnp.zeros((len(grid), NUMBER, NUMBER))),
        sigma=jnp.asarray(grid),
        log_prior=jnp.asarray(log_prior),
        places=(0, 1),
        columns=(0, 1),
    )
    return random_effects, slopes[:, 0], random.standard_normal((RECORDS, SAMPLES))


def white() -> Likelihood:
    valid = jnp.ones((RECORDS, 1, SAMPLES), dtype=bool)
    counts = jnp.array([float(RECORDS * SAMPLES)])
    return Likelihood(White(valid), counts, jnp.zeros(()), ("force",), (False,))


@pytest.mark.parametrize("away", [0.0, 0.02])
def test_what_is_integrated_is_dense_algebra_wherever_it_is_linearised(away: float) -> None:
    random = np.random.default_rng(1)
    eta = away * random.standard_normal((RECORDS, NUMBER))
    random_effects, slopes, residuals = linear(eta, random)
    there, noise = residuals + np.einsum("rti,ri->rt", slopes, eta), jnp.log(jnp.array([1.3]))
    likelihood = white()
    known = random_effects.conditional(likelihood, jnp.asarray(there[:, None]), noise, jnp.asarray(eta))
    found = np.asarray(known.logs) + float(jnp.sum(likelihood.of_innovations(jnp.asarray(there[:, None]), noise)))
    found += float(likelihood.constant(noise))
    for g in (0, 5, 40, 80):
        exact = float(random_effects.log_prior[g])
        for r in range(RECORDS):
            covariance = 1.69 * np.eye(SAMPLES) + slopes[r] * np.asarray(random_effects.sigma[g]) ** 2 @ slopes[r].T
            exact += multivariate_normal.logpdf(residuals[r], cov=covariance)
        assert found[g] == pytest.approx(exact, rel=EXACT, abs=1e-6)


def test_deviations_are_drawn_from_their_normal_law() -> None:
    random = np.random.default_rng(2)
    random_effects, slopes, residuals = linear(np.zeros((RECORDS, NUMBER)), random)
    one = dataclasses.replace(
        random_effects, sigma=random_effects.sigma[80:81], log_prior=random_effects.log_prior[80:81]
    )
    none = jnp.zeros((RECORDS, NUMBER))
    known = one.conditional(white(), jnp.asarray(residuals[:, None]), jnp.zeros(1), none)
    drawn = np.stack([one.drawn(known, random) for _ in range(4000)])
    for r in range(RECORDS):
        precision = slopes[r].T @ slopes[r] + np.diag(np.asarray(one.sigma[0]) ** -2.0)
        middle = -np.linalg.solve(precision, slopes[r].T @ residuals[r])
        spread = np.sqrt(np.diag(np.linalg.inv(precision)))
        # Four standard errors of a mean of 4000 draws.
        np.testing.assert_allclose(drawn[:, r].mean(axis=0), middle, atol=4.0 * spread.max() / np.sqrt(4000))
        np.testing.assert_allclose(drawn[:, r].std(axis=0), spread, rtol=0.05)


def test_records_that_agree_leave_the_density_as_it_was() -> None:
    """The negative control: with no standard deviation but zero nothing is added."""
    random_effects, _, residuals = linear(np.zeros((RECORDS, NUMBER)), np.random.default_rng(3))
    still = dataclasses.replace(random_effects, sigma=jnp.zeros((1, NUMBER)), log_prior=jnp.zeros(1))
    none = jnp.zeros((RECORDS, NUMBER))
    known = still.conditional(white(), jnp.asarray(residuals[:, None]), jnp.zeros(1), none)
    assert float(known.logs[0]) == pytest.approx(0.0, abs=1e-12)
