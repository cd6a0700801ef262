"""The variance of a change by how its scores scatter, beside what they tell of it."""

from __future__ import annotations

import numpy as np

from fibrefit.discovery.engine.laplace_inference import overdispersion_of_change


def products(change: np.ndarray, residuals: np.ndarray) -> np.ndarray:
    """Products of a change and residuals ``(n_stretch, n)`` within each stretch of one record."""
    rows = np.stack([change, residuals], axis=1)
    return (rows @ np.swapaxes(rows, 1, 2))[None]


def test_scores_of_noise_scatter_as_their_information_says() -> None:
    random = np.random.default_rng(0)
    change = np.sin(np.linspace(0.0, 40.0, 64 * 50)).reshape(64, 50)
    found = [overdispersion_of_change(products(change, random.standard_normal((64, 50)))) for _ in range(400)]
    assert abs(np.mean(found) - 1.0) < 0.05
    # A ratio of some sixty stretches is known to a fifth.
    assert 0.1 < np.std(found) < 0.3


def test_a_change_that_lies_in_one_loud_reading_tells_little() -> None:
    random = np.random.default_rng(1)
    residuals = random.standard_normal((64, 50))
    change = 0.05 * np.sin(np.linspace(0.0, 40.0, 64 * 50)).reshape(64, 50)
    before = overdispersion_of_change(products(change, residuals))
    change[20, 7], residuals[20, 7] = 2.0, -4.0
    assert overdispersion_of_change(products(change, residuals)) > 4.0 > 2.0 > before


def test_what_changes_nothing_scatters_no_more() -> None:
    assert overdispersion_of_change(products(np.zeros((64, 50)), np.ones((64, 50)))) == 1.0
