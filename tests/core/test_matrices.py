"""Matrices whose rows are of any units: a diagonal of ones, and nothing that depends on the units."""

from __future__ import annotations

import numpy as np
import pytest

from fibrefit.core.matrices import correlation_matrix, equilibrated, scale_of

UNITS = np.array([1e-7, 1.0, 2e9])


@pytest.fixture
def normal() -> np.ndarray:
    rows = np.random.default_rng(1).standard_normal((20, 3))
    return rows.T @ rows


def test_units_leave_no_trace_and_diagonals_are_one(normal: np.ndarray) -> None:
    whole = np.stack([normal, normal * np.outer(UNITS, UNITS)])
    same = equilibrated(whole, scale_of(whole))
    np.testing.assert_allclose(same[1], same[0], rtol=1e-14)
    np.testing.assert_allclose(np.diagonal(same, axis1=1, axis2=2), 1.0, rtol=1e-14)
    assert np.linalg.cond(same[1]) < 10.0 < 1e12 < np.linalg.cond(whole[1])


def test_a_row_that_nothing_is_seen_of_stays_nothing(normal: np.ndarray) -> None:
    normal[1], normal[:, 1] = 0.0, 0.0
    assert scale_of(normal)[1] == 1.0
    assert not equilibrated(normal, scale_of(normal))[1].any()


def test_an_inverse_is_scaled_as_its_matrix_is(normal: np.ndarray) -> None:
    scale = scale_of(normal)
    there = equilibrated(np.linalg.inv(equilibrated(normal, scale)), scale)
    np.testing.assert_allclose(there @ normal, np.eye(3), atol=1e-12)


def test_correlations_of_what_is_not_determined_are_missing() -> None:
    found = correlation_matrix(np.array([[4.0, -3.0, 0.0], [-3.0, 9.0, 0.0], [0.0, 0.0, np.inf]]))
    np.testing.assert_allclose(found[:2, :2], [[1.0, -0.5], [-0.5, 1.0]], rtol=1e-14)
    assert np.isnan(found[2]).all()
    assert np.isnan(found[:, 2]).all()
