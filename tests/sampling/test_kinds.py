"""What every kind of noise in `KINDS` keeps, and that a kind which nothing names goes the same way."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import toeplitz

from fibrefit.problem.noise.whitening import Whitening
from fibrefit.problem.statement.layout import Layout, Range, Slot
from fibrefit.problem.statement.problem import Linearised
from fibrefit.report.sentences.posterior import likelihood_sentence
from fibrefit.sampling.density.filters import NoiseEvidence
from fibrefit.sampling.density.kinds import KINDS, noise_kind
from fibrefit.sampling.density.likelihood import choose_noise_model
from tests.problem.coefficients import first_order_noise, records

EXACT = 1e-8
"""Two ways to the same quadratic form, of some hundred terms."""
SAME = 0.35
"""Share of the variance by which autocovariances of two estimates may differ: five records of a second tell slow parts
no better."""
SURE = 4.5
"""Standard errors of a correlation by chance: once in a hundred thousand."""
SIZE = 2000
FORCE = 0


class Alternating(NamedTuple):
    """Noise of which each sample is the mean of a fresh one and the last fresh one turned round, times a level."""

    level: jax.Array
    valid: jax.Array

    @property
    def scales(self) -> jax.Array:
        return jnp.where(self.valid, self.level[:, None], 0.0)

    @property
    def log_scale(self) -> jax.Array:
        return jnp.sum(jnp.where(self.valid, jnp.log(self.level)[:, None], 0.0))

    def whiten(self, residuals: jax.Array) -> jax.Array:
        def step(before: jax.Array, here: jax.Array) -> tuple[jax.Array, jax.Array]:
            fresh = here + 0.5 * before
            return fresh, fresh

        rows = jnp.moveaxis(residuals / self.level[:, None], -1, 0)
        return jnp.where(self.valid, jnp.moveaxis(jax.lax.scan(step, jnp.zeros(rows.shape[1:]), rows)[1], 0, -1), 0.0)

    def autocovariance(self, n_lag: int) -> np.ndarray:
        lags = np.zeros((*self.valid.shape[:2], n_lag))
        lags[..., :2] = np.asarray(self.level)[:, None] ** 2 * np.array([1.25, -0.5])
        return lags


class AlternatingNoise:
    def estimate(self, evidence: NoiseEvidence) -> tuple[np.ndarray, int]:
        power = np.mean(np.asarray(evidence.linear.residuals) ** 2, axis=(0, 2)) / 1.25
        return np.sqrt(power), len(power)

    def whiten(self, level: np.ndarray, evidence: NoiseEvidence) -> Alternating:
        return Alternating(jnp.asarray(level), evidence.valid)

    def describe(self, level: np.ndarray, channels: tuple[str, ...]) -> tuple[str, tuple[float, ...]]:
        return "alternating noise" + "".join(f", %.1f in {channel}" for channel in channels), tuple(level)


@pytest.fixture
def made_up(monkeypatch: pytest.MonkeyPatch) -> str:
    """A kind that stands in the table alone."""
    monkeypatch.setitem(KINDS, "alternating", f"{__name__}:AlternatingNoise")
    return "alternating"


def evidence_of(residuals: np.ndarray) -> NoiseEvidence:
    """Of records ``(n_record, n_time)`` of one channel in which a model has nothing to do."""
    valid = np.ones(residuals.shape, dtype=bool)
    problem = records(valid)
    problem.layout = Layout((Slot("idle", "N", Range(0.0, 10.0, 1.0)),), tuple(f"{r}" for r in range(len(valid))))
    linear = Linearised(residuals[:, None], np.zeros((len(valid), 1, residuals.shape[1], 1)))
    return NoiseEvidence(problem, linear, jnp.asarray(valid)[:, None], (False,))


def drawn(whitening: Whitening, random: np.random.Generator, size: int = SIZE) -> np.ndarray:
    """Noise of the covariance that a filter claims, ``(n_record, n_time)``."""
    lags = whitening.autocovariance(size)[:, FORCE]
    return np.stack([np.linalg.cholesky(toeplitz(row)) @ random.standard_normal(size) for row in lags])


@pytest.mark.parametrize("name", [*KINDS, "alternating"])
def test_a_kind_recovers_whitens_and_describes_its_noise(name: str, made_up: str) -> None:
    kind, random = noise_kind(name), np.random.default_rng(11)
    first = evidence_of(
        drawn(Alternating(jnp.ones(1), np.ones((5, 1, SIZE))), random) if name == made_up else first_order_noise(random)
    )
    parameters, numbers = kind.estimate(first)
    truth = kind.whiten(parameters, first)
    assert numbers >= 1

    second = evidence_of(drawn(truth, random))
    found, _ = kind.estimate(second)
    whitening = kind.whiten(found, second)
    known, again = (of.autocovariance(40)[:, FORCE] for of in (truth, whitening))
    np.testing.assert_allclose(again, known, atol=SAME * known[0, 0])

    residuals = np.asarray(second.linear.residuals)
    fresh = np.asarray(truth.whiten(jnp.asarray(residuals)))[:, FORCE]
    for lag in (1, 2, 5, 20, 100):
        assert abs(np.sum(fresh[:, lag:] * fresh[:, :-lag])) < SURE * np.sqrt(fresh[:, lag:].size)
    assert np.mean(fresh**2) == pytest.approx(1.0, abs=SURE * np.sqrt(2.0 / fresh.size))

    words, places = kind.describe(found, ("force",))
    assert name.partition("_")[0] in words % places


@pytest.mark.parametrize("name", KINDS)
def test_the_density_of_innovations_is_that_of_the_covariance(name: str) -> None:
    kind, size = noise_kind(name), 300
    evidence = evidence_of(first_order_noise(np.random.default_rng(12))[:2, :size])
    whitening, residuals = kind.whiten(kind.estimate(evidence)[0], evidence), np.asarray(evidence.linear.residuals)
    matrices = [toeplitz(row) for row in whitening.autocovariance(size)[:, FORCE]]
    square = sum(row @ np.linalg.solve(matrix, row) for row, matrix in zip(residuals[:, FORCE], matrices, strict=True))
    assert float(jnp.sum(whitening.whiten(jnp.asarray(residuals)) ** 2)) == pytest.approx(square, rel=EXACT)
    volume = 0.5 * sum(np.linalg.slogdet(matrix)[1] for matrix in matrices)
    assert float(whitening.log_scale) == pytest.approx(volume, rel=EXACT, abs=EXACT)
    assert np.sum(np.log(np.asarray(whitening.scales))) == pytest.approx(volume, rel=EXACT, abs=EXACT)


def test_a_kind_that_stands_in_the_table_alone_is_chosen_and_named(made_up: str) -> None:
    noise = drawn(Alternating(jnp.array([2.0]), np.ones((5, 1, SIZE))), np.random.default_rng(13))
    evidence = evidence_of(noise)
    found = choose_noise_model(evidence.problem, evidence.linear)
    assert set(found.scores) == set(KINDS)
    assert found.kind == made_up
    assert likelihood_sentence(found).startswith("Likelihood: alternating noise, 2.0 in force; chosen because")
    asked = choose_noise_model(evidence.problem, evidence.linear, made_up)
    assert likelihood_sentence(asked) == "Likelihood: alternating noise, 2.0 in force, as requested."
