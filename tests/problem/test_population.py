"""Intervals of a mean of few records: mixtures over how much these differ, against Student's distribution."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm, t

from fibrefit.problem.estimate import evidence as weighing
from fibrefit.problem.estimate.evidence import mixture_quantile
from fibrefit.problem.linear_model.unknowns import Unknowns
from fibrefit.problem.linear_model.view import antithetic_draws

RECORDS = 5
ERROR = 1e-5
"""Error of the logarithm in each record: as good as none beside how they differ."""


def unknowns(records: int = RECORDS) -> Unknowns:
    nothing = np.zeros(0, dtype=int)
    return Unknowns(
        names=("stiffness",),
        shared=np.array([0]),
        each=nothing,
        free=np.zeros((records, 0), dtype=bool),
        scattering=np.array([0]),
        log=np.array([True]),
        reference=np.array([1.0]),
        scale=np.array([1.0]),
        mean=np.zeros(1),
        precision=np.eye(1) * 1e-6,
        lower=np.array([-10.0]),
        upper=np.array([10.0]),
        size=np.zeros(0),
    )


def weighed(logs: np.ndarray) -> weighing.MarginalLikelihood:
    """Of records that each read the logarithm of one value."""

    def gram(local: np.ndarray, columns: np.ndarray, targets: np.ndarray) -> np.ndarray:
        slopes = (np.log(targets) - np.log(local))[:, 0] / ERROR
        rows = np.stack([slopes, (np.log(local[:, 0]) - logs) / ERROR], axis=-1)
        return rows[:, :, None] * rows[:, None, :]

    of = unknowns(len(logs))
    return weighing.laplace_evidence(of, of.place_of(np.ones((len(logs), 1))), gram)


def test_a_mixture_of_one_is_normal_and_of_two_lies_between() -> None:
    one = mixture_quantile(np.ones(1), np.array([1.0]), np.array([2.0]), 0.975)
    assert one == pytest.approx(1.0 + 2.0 * norm.ppf(0.975), abs=1e-6)
    two = mixture_quantile(np.array([0.5, 0.5]), np.zeros(2), np.array([1.0, 3.0]), 0.975)
    assert norm.ppf(0.975) < two < 3.0 * norm.ppf(0.975)
    assert 0.5 * norm.cdf(two) + 0.5 * norm.cdf(two / 3.0) == pytest.approx(0.975, abs=1e-6)


@pytest.mark.parametrize("sd", [0.01, 0.02])
def test_an_interval_of_the_mean_of_five_records_is_that_of_student(sd: float) -> None:
    logs = sd * np.array([-1.2, -0.4, 0.1, 0.3, 1.2])
    found = weighed(logs)
    low, high = found.interval_95(0)
    spread = logs.std(ddof=1) / np.sqrt(RECORDS)
    # Between the prior that leaves all degrees of freedom and that which takes one more.
    narrow, wide = (t.ppf(0.975, freedom) * spread * np.sqrt((RECORDS - 1) / freedom) for freedom in (4, 3))
    assert 0.93 * narrow < 0.5 * (high - low) < 1.07 * wide
    assert 0.5 * (high + low) == pytest.approx(logs.mean(), abs=0.02 * spread)
    assert (
        found.between_records()["stiffness"].interval_95[0] < sd < found.between_records()["stiffness"].interval_95[1]
    )
    assert found.between_records()["stiffness"].agree < 1e-6


def test_records_that_agree_are_said_to() -> None:
    found = weighed(ERROR * np.array([-1.2, -0.4, 0.1, 0.3, 1.2]))
    assert found.between_records()["stiffness"].sd == 0.0
    assert not found.between_records()["stiffness"].found
    low, high = found.interval_95(0)
    assert 0.5 * (high - low) == pytest.approx(norm.ppf(0.975) * ERROR / np.sqrt(RECORDS), rel=0.15)
    np.testing.assert_allclose(found.covariance_of_all(), found.spread, rtol=1e-3)


def test_of_records_that_tell_nothing_the_prior_says_how_much_a_new_one_may_differ() -> None:
    """Half of it lies where they agree, and the median with it."""
    found = weighed(ERROR * np.array([-1.2, -0.4, 0.1, 0.3, 1.2]))
    prior = np.exp(found.prior)
    told = replace(found, weight=prior).between_records()["stiffness"]
    assert told.agree == pytest.approx(0.5)
    assert told.sd == 0.0
    assert told.rms == pytest.approx(np.sqrt(prior @ found.grid[:, 0] ** 2 / prior.sum()))
    assert told.rms == pytest.approx(0.032, abs=0.001)
    known = weighed(0.02 * np.array([-1.2, -0.4, 0.1, 0.3, 1.2])).between_records()["stiffness"]
    assert known.sd < known.rms < known.interval_95[1]


def test_roots_of_the_posterior_are_those_of_its_covariance() -> None:
    """Of the values of each record: what is not known of the mean, and of each record's deviation from it."""
    for logs in (ERROR * np.array([-1.2, -0.4, 0.1, 0.3, 1.2]), 0.01 * np.array([-1.2, -0.4, 0.1, 0.3, 1.2])):
        found = weighed(logs)
        roots, sigma = found.posterior_roots(), found.mode.sigma[0]
        variance = np.einsum("rck,rck->r", roots, roots)
        # Each record is told by its own reading and, as far as records agree, by the others.
        expected = ERROR**2 / RECORDS if sigma == 0.0 else ERROR**2
        np.testing.assert_allclose(variance / found.mode.local[:, 0] ** 2, expected, rtol=0.05)


def test_what_a_fit_takes_of_slow_noise_is_put_back() -> None:
    """The mean power over residuals that are spread is that of the noise; of the residuals alone it is too small."""
    count, number, random = 400, 6, np.random.default_rng(3)
    frequency = np.fft.rfftfreq(count)[1:]
    size = np.concatenate([[0.0], frequency**-0.5])
    waves = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, count), number)[:, 1:]
    # The noise has no mean: what is fitted shall have none either.
    waves -= waves.mean(axis=0)
    low, taken, whole, true = slice(1, 6), 0.0, 0.0, 0.0
    full = np.concatenate([size, size[1:-1][::-1]])
    turn = np.fft.fft(np.eye(count), norm="ortho")
    covariance = (turn.conj().T @ (full[:, None] ** 2 * turn)).real + 1e-9 * np.eye(count)
    weight = np.linalg.inv(covariance)
    posterior = np.linalg.inv(waves.T @ weight @ waves)
    moved = (waves @ np.linalg.cholesky(posterior)).T[:, None, None]
    for _ in range(300):
        wave = random.standard_normal((2, len(size)))
        noise = np.fft.irfft((wave[0] + 1j * wave[1]) * size * np.sqrt(0.5), count, norm="ortho")
        left = noise - waves @ (posterior @ (waves.T @ (weight @ noise)))
        power = [np.abs(np.fft.rfft(x, norm="ortho")[..., low]) ** 2 for x in (noise, left)]
        spread = np.abs(np.fft.rfft(antithetic_draws(left[None, None, None], moved), norm="ortho")[..., low]) ** 2
        true, taken, whole = true + power[0], taken + power[1], whole + spread.mean(axis=0)[0, 0]
    assert np.mean(taken / true) < 0.6
    np.testing.assert_allclose(whole / true, 1.0, rtol=0.15)
