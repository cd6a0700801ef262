"""R-hat and effective sizes against chains whose worth is known."""

from __future__ import annotations

import numpy as np
import pytest

from fibrefit.sampling.chains import mixing


def chain(correlation: float, seed: int, shape: tuple[int, int, int] = (4, 400, 32)) -> np.ndarray:
    """First-order autoregressions, one a walker."""
    random = np.random.default_rng(seed)
    values = np.empty((shape[0], shape[1], shape[2], 1))
    values[:, 0] = random.standard_normal((shape[0], shape[2], 1))
    for t in range(1, shape[1]):
        fresh = random.standard_normal((shape[0], shape[2], 1))
        values[:, t] = correlation * values[:, t - 1] + np.sqrt(1.0 - correlation**2) * fresh
    return values


@pytest.mark.parametrize("correlation", [0.0, 0.8])
def test_draws_are_worth_what_theory_says(correlation: float) -> None:
    expected = 4 * 400 * 32 * (1.0 - correlation) / (1.0 + correlation)
    found = mixing(chain(correlation, 0))
    # The autocorrelation time itself is known from 1600 means of steps only.
    assert found.ess_bulk[0] == pytest.approx(expected, rel=0.35)
    assert found.r_hat[0] < 1.01
    assert found.r_hat_walkers[0] < 1.1


def test_walkers_that_move_together_are_not_counted_apart() -> None:
    """Every walker the same: the draws are worth one walker's, however many there are."""
    together = np.repeat(chain(0.5, 1, (4, 400, 1)), 32, axis=2)
    assert mixing(together).ess_bulk[0] == pytest.approx(4 * 400 / 3.0, rel=0.35)


def test_an_ensemble_that_sits_elsewhere_is_seen() -> None:
    found = chain(0.5, 2)
    found[3] += 0.5
    assert mixing(found).r_hat[0] > 1.01
    assert mixing(chain(0.5, 2)).r_hat[0] < 1.01


def test_walkers_frozen_in_two_places_are_seen_though_ensembles_agree() -> None:
    found = chain(0.0, 3)
    found[:, :, ::2] += 20.0
    judged = mixing(found)
    assert judged.r_hat[0] < 1.01
    assert judged.r_hat_walkers[0] > 1.3


def test_a_chain_that_never_moves_has_no_worth() -> None:
    still = np.repeat(chain(0.0, 4)[:, :1], 100, axis=1)
    judged = mixing(still)
    assert judged.ess_bulk[0] < 128
    assert judged.r_hat_walkers[0] > 1e3
