"""The cross-check with NUTS: draws of the same law agree as often as is said, and those of another one do not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.report.sentences.posterior import posterior_sentence
from fibrefit.sampling.mode import Approximation
from fibrefit.sampling.nuts import CrossCheck, _compared, cross_check
from fibrefit.study.summaries.check import Check
from fibrefit.workflow.sampling.files import _cross_check

NAMES = ("a", "b", "c")
SIZE = len(NAMES)
ROUNDS, MOST = 100, 5
"""Of a hundred comparisons one differs by chance: five or more in one case of three hundred."""


def compared(random: np.random.Generator, scale: float = 1.0, tails: float = np.inf, divergent: int = 0) -> CrossCheck:
    """Ensembles and chains of independent draws; those of NUTS are so many times as wide."""

    def drawn(*shape: int) -> np.ndarray:
        white = random.standard_normal(shape)
        return white if np.isinf(tails) else white * np.sqrt(tails / random.chisquare(tails, shape))

    kept = drawn(4, 100, 8, SIZE)
    course = SimpleNamespace(kept=kept, mixing=SimpleNamespace(ess_bulk=np.full(SIZE, 3200.0)))
    return _compared(cast(Any, SimpleNamespace(course=course)), scale * drawn(4, 200, SIZE), divergent)


def told(found: CrossCheck) -> tuple[Check, str]:
    check = found.check(NAMES)
    return check, posterior_sentence(check)


@pytest.mark.parametrize("tails", [np.inf, 8.0], ids=["normal", "student"])
def test_the_same_law_is_told_apart_as_rarely_as_is_said(tails: float) -> None:
    random = np.random.default_rng(1)
    found = [compared(random, tails=tails) for _ in range(ROUNDS)]
    assert sum(not one.alike for one in found) < MOST
    assert sum(not one.converged for one in found) == 0
    # Scores are of unit size: ratios of standard deviations count by what is known of both.
    scores = np.array([one.spread_scores for one in found])
    assert np.std(scores) == pytest.approx(1.0, abs=0.15)


def test_another_spread_is_seen_where_means_agree() -> None:
    """A posterior a third wider is another one, though its mean is the same."""
    found = compared(np.random.default_rng(2), scale=4.0 / 3.0)
    assert np.abs(found.scores).max() < 3.0
    np.testing.assert_allclose(found.spread, 0.75, atol=0.06)
    check, says = told(found)
    assert not check.passed
    assert "standard deviations of the ensembles and of NUTS differ: by" in says
    assert "(standard deviation of " in says


def test_chains_that_disagree_among_themselves_confirm_nothing() -> None:
    random = np.random.default_rng(3)
    chains = random.standard_normal((4, 200, SIZE))
    chains[:2, :, 1] -= 0.5
    chains[2:, :, 1] += 0.5
    kept = random.standard_normal((4, 100, 8, SIZE)) * np.array([1.0, np.sqrt(1.25), 1.0])
    course = SimpleNamespace(kept=kept, mixing=SimpleNamespace(ess_bulk=np.full(SIZE, 3200.0)))
    found = _compared(cast(Any, SimpleNamespace(course=course)), chains, 0)
    assert found.alike
    check, says = told(found)
    assert not check.passed
    assert "(b), threshold 1.05: its chains have not converged." in says


@pytest.mark.extra("blackjax")
@pytest.mark.parametrize(("wide", "agrees"), [(1.0, True), (1.5, False)])
def test_chains_of_nuts_are_held_against_the_ensembles(wide: float, agrees: bool) -> None:
    """Of a normal law of known widths; the negative control has ensembles that are wider."""
    size = np.array([2.0, 1e-3, 50.0])
    log_density = lambda x: -0.5 * jnp.sum((x / size) ** 2, axis=-1)  # noqa: E731
    kept = wide * size * np.random.default_rng(5).standard_normal((4, 100, 8, SIZE))
    posterior = SimpleNamespace(
        modes=[SimpleNamespace(approximation=Approximation(np.zeros(SIZE), np.diag(size**2), 0.0))],
        density=log_density,
        target=SimpleNamespace(log_density=lambda points: np.asarray(log_density(points))),
        course=SimpleNamespace(kept=kept, mixing=SimpleNamespace(ess_bulk=np.full(SIZE, 3200.0))),
    )
    found = cross_check(cast(Any, posterior), seed=3)
    assert found.agrees is agrees
    assert found.converged
    assert found.points.shape == (4, 200, SIZE)
    np.testing.assert_allclose(found.spread, wide, rtol=0.2)


def test_chains_that_never_moved_confirm_nothing() -> None:
    kept = np.random.default_rng(3).standard_normal((4, 100, 8, SIZE))
    course = SimpleNamespace(kept=kept, mixing=SimpleNamespace(ess_bulk=np.full(SIZE, 3200.0)))
    found = _compared(cast(Any, SimpleNamespace(course=course)), np.zeros((4, 200, SIZE)), 800)
    check, says = told(found)
    assert not check.passed
    assert "its chains have not converged" in says
    target = SimpleNamespace(names=NAMES)
    told_of = _cross_check(cast(Any, SimpleNamespace(target=target)), found)
    assert told_of.r_hat == told_of.spread_scores == dict.fromkeys(NAMES)


@pytest.mark.parametrize(("divergent", "passes"), [(0, True), (8, True), (9, False)])
def test_more_than_a_few_divergent_transitions_confirm_nothing(divergent: int, passes: bool) -> None:
    check, says = told(compared(np.random.default_rng(4), divergent=divergent))
    assert check.passed is passes
    assert (f"{divergent} of 800 transitions of NUTS were divergent" in says) is (divergent > 0)
    assert ("more than 1 %: it misses a part of the posterior." in says) is not passes
