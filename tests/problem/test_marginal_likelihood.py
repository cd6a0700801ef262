"""Evidence of linear models, where it is known exactly, of one-sided priors, and what is said of spreads."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import logsumexp
from scipy.stats import norm

from fibrefit.problem.estimate import evidence as weighing
from fibrefit.problem.estimate.evidence import (
    AGREE,
    ALONE,
    FEW_SIGMA_LEVELS,
    MANY,
    SIGMA_LEVELS,
    UNIFORM_TO,
    MarginalLikelihood,
    _inside_bounds,
    conditioned_on_bounds,
    laplace_evidence,
)
from fibrefit.problem.estimate.gauss_newton import Effort, mode
from fibrefit.problem.linear_model.normal_equations import Arrowhead, PosteriorMode
from fibrefit.problem.linear_model.unknowns import RIGID, Unknowns
from tests.problem.toys import SIZE, Linear, begun, bounded, unknowns

TRUTH = np.array([0.3, -0.2, 0.5])
EXACT = 1e-4
"""Nats: differences are good to six digits of a sum of squares of a few hundred."""
FLAT = 1e3
"""Standard deviation of a nuisance that stands for an infinite one: the records know it to some tenths."""
DRAWS = 300
USUAL = 4.0
"""Standard errors of a mean over the draws: once in sixteen thousand."""


def covariance_of(linear: Linear, of: Unknowns, sigma: np.ndarray, each: float = FLAT) -> np.ndarray:
    """Of all readings, when every unknown is drawn from its prior."""
    design, records, own = linear.design(of), len(linear.slopes), 2 + len(of.scattering)
    prior = np.zeros((design.shape[1],) * 2)
    prior[:3, :3] = np.linalg.inv(of.precision)
    for r in range(records):
        index = 3 + r * own + np.arange(own)
        prior[index, index] = np.concatenate([np.full(2, each**2), np.maximum(sigma, RIGID) ** 2])
    return design @ prior @ design.T + np.eye(len(design))


def exact(linear: Linear, of: Unknowns, sigma: np.ndarray) -> float:
    """Logarithm of the density of the readings, on the scale of `MarginalLikelihood.log`."""
    centre = linear.design(of)[:, :3] @ of.mean
    factor = np.linalg.cholesky(covariance_of(linear, of, sigma))
    left = np.linalg.solve(factor, linear.measured.ravel() - centre)
    # A flat prior has density one in units of the nuisance, and the powers of two pi are left out.
    return float(-0.5 * left @ left - np.log(np.diag(factor)).sum() + of.free.sum() * np.log(FLAT))


def weighed(linear: Linear, of: Unknowns, **start: np.ndarray) -> MarginalLikelihood:
    return laplace_evidence(of, begun(of, records=len(linear.slopes)), linear.gram, tolerance=1e-9, **start)


def agreeing(found: MarginalLikelihood) -> float:
    """Logarithm of the evidence where no parameter deviates at all."""
    return found.log + float(np.log(found.weight[0] / (AGREE if found.grid.shape[1] else 1.0)))


def test_a_model_without_parameters_that_deviate_has_an_evidence() -> None:
    linear = Linear.drawn(1, TRUTH)
    assert weighed(linear, unknowns(())).log == pytest.approx(exact(linear, unknowns(()), np.zeros(0)), abs=EXACT)


def prior(sigma: np.ndarray) -> float:
    """Probability beforehand of a point of the grid."""
    some = np.array(SIGMA_LEVELS[1:])
    each = np.gradient(np.log(some)) * np.minimum(some / UNIFORM_TO, 1.0)
    each = dict(zip(SIGMA_LEVELS, [ALONE, *((1.0 - ALONE) * each / each.sum())], strict=True))
    apart = np.prod([each[float(level)] for level in sigma]) / (1.0 - ALONE ** len(sigma))
    return float((1.0 - AGREE) * apart) if sigma.any() else AGREE


@pytest.mark.parametrize("scattering", [(0,), (0, 1)])
def test_evidence_of_a_linear_model_is_exact_for_each_scatter_and_for_all(scattering: tuple[int, ...]) -> None:
    # Two records where many covariances are taken apart.
    records = 4 // len(scattering)
    of = unknowns(scattering, records)
    linear = Linear.drawn(1, TRUTH, scatter=0.05, records=records, loud=10.0)
    found = weighed(linear, of)
    grid, n = found.grid, len(scattering)
    assert grid.shape == (len(SIGMA_LEVELS) ** n, n)
    priors = np.log([prior(sigma) for sigma in grid])
    assert logsumexp(priors) == pytest.approx(0.0, abs=1e-12)
    logs = np.array([exact(linear, of, sigma) for sigma in grid]) + priors
    assert found.log == pytest.approx(float(logsumexp(logs)), abs=EXACT)
    np.testing.assert_allclose(found.weight, np.exp(logs - logsumexp(logs)), atol=EXACT)


def test_where_it_was_linearised_does_not_matter_to_a_linear_model() -> None:
    """The negative control is a place at which nothing is at rest: a curved model would not agree."""
    of, linear = unknowns(), Linear.drawn(2, TRUTH, scatter=0.02, loud=10.0)
    place = begun(of)._replace(eta=np.full((4, 1), 0.03))
    away = MarginalLikelihood.of(
        PosteriorMode(of, place, Arrowhead.at(of, place, linear.gram), np.array([0.004]), np.inf, 1)
    )
    found = weighed(linear, of)
    assert away.log == pytest.approx(found.log, abs=0.01)
    np.testing.assert_allclose(away.mean, found.mean, atol=1e-4)
    np.testing.assert_allclose(away.spread, found.spread, rtol=1e-3)


def test_what_slopes_predict_and_no_step_brings_is_no_evidence() -> None:
    """Q with a kink: slopes say that it falls, and it rises wherever one goes."""
    of, linear = unknowns(()), Linear.drawn(2, TRUTH, loud=10.0)
    start = begun(of)
    here = PosteriorMode(of, start, Arrowhead.at(of, start, linear.gram), np.zeros(0), np.inf, 1)

    def kinked(local: np.ndarray, columns: np.ndarray, targets: np.ndarray) -> np.ndarray:
        grams = linear.gram(local, columns, targets).copy()
        grams[:, -1, -1] += 1e6 * float(np.abs(local - here.local).max() > 0.0)
        return grams

    best, stuck = weighed(linear, of), laplace_evidence(of, start, kinked, tolerance=1e-9)
    fall = here.objective - best.mode.objective
    assert fall > 10.0
    assert stuck.mode.unmet == pytest.approx(fall, rel=1e-4)
    assert stuck.log == pytest.approx(best.log - 0.5 * fall, abs=0.01)
    assert best.mode.unmet < 1e-6


def test_a_nuisance_that_is_held_is_not_integrated() -> None:
    of, linear = unknowns(), Linear.drawn(3, TRUTH)
    free = of.free.copy()
    free[2, 1] = False
    held = replace(of, free=free)
    assert agreeing(weighed(linear, held)) == pytest.approx(exact(linear, held, np.zeros(1)), abs=EXACT)


def test_an_effect_that_does_nothing_costs_its_occam_factor_and_one_that_acts_gains() -> None:
    """ln BF of a coordinate against its absence, from two exact evidences, over series."""
    gains: dict[float, list[float]] = {0.0: [], 0.5: []}
    of = replace(unknowns(), mean=np.array([0.1, 0.0, 0.0]))
    absent = replace(of, precision=of.precision + np.diag([0.0, 0.0, 1e12]))
    for strength, found in gains.items():
        for seed in range(40):
            linear = Linear.drawn(seed, np.array([0.1, 0.0, strength]))
            found.append(weighed(linear, of).log - weighed(linear, absent).log)
    assert np.median(gains[0.0]) < -1.0
    # Chance reaches a Bayes factor of exp(3) once in twenty times at the most: seven of forty once in two thousand.
    assert np.sum(np.array(gains[0.0]) > 3.0) <= 7
    assert np.min(gains[0.5]) > 5.0


def test_a_one_sided_prior_is_that_of_quadrature() -> None:
    """Twice the normal prior above zero, whether the records pull the strength up, down, or far down."""
    for strength in (0.3, 0.0, -0.1, -0.6):
        of = replace(unknowns(), mean=np.zeros(3))
        of = bounded(replace(of, precision=np.diag([1.0, 2.0, 4.0])), lower=(2, 0.0))
        linear = Linear.drawn(5, np.array([0.3, -0.2, strength]))
        found = weighed(linear, of)
        assert found.mode.place.z[2] >= 0.0
        assert agreeing(found) == pytest.approx(_by_quadrature(linear, of, 0.0, np.inf) + np.log(2.0), abs=1e-3), (
            strength
        )


def test_a_bound_away_from_the_priors_mean_cuts_the_evidence() -> None:
    """Where a strength would like to be at three and may be one at most, the model is no better than that."""
    of = replace(unknowns(), mean=np.zeros(3))
    of = bounded(replace(of, precision=np.diag([1.0, 2.0, 1.0])), lower=(2, 0.0), upper=(2, 1.0))
    linear = Linear.drawn(6, np.array([0.3, -0.2, 3.0]))
    found = weighed(linear, of)
    assert found.mode.place.z[2] == 1.0
    share = norm.cdf(1.0) - norm.cdf(0.0)
    assert agreeing(found) == pytest.approx(_by_quadrature(linear, of, 0.0, 1.0) - np.log(share), abs=1.0)


@pytest.mark.parametrize("away", [-1e200, 1e200])
def test_where_bounds_leave_nothing_a_model_is_impossible(away: float) -> None:
    of = bounded(replace(unknowns(), mean=np.zeros(3)), lower=(2, 0.0), upper=(2, 1.0))
    places = np.array([[0.0, 0.0, away], [0.0, 0.0, 0.5]])
    shares = _inside_bounds(of, places, np.broadcast_to(np.eye(3), (2, 3, 3)))
    assert np.isneginf(shares[0])
    assert np.isfinite(shares[1])
    found = MarginalLikelihood._over_grid(cast(Any, None), np.zeros((2, 1)), shares, places, np.zeros((2, 3, 3)))
    assert found.log == shares[1]
    assert found.weight.tolist() == [0.0, 1.0]
    nowhere = MarginalLikelihood._over_grid(
        cast(Any, None), np.zeros((1, 1)), shares[:1], places[:1], np.zeros((1, 3, 3))
    )
    assert np.isneginf(nowhere.log)


@pytest.mark.parametrize("lost", [np.nan, np.inf])
def test_where_a_motion_is_lost_there_is_no_evidence(lost: float) -> None:
    logs, places = np.array([np.nan, -3.0]), np.zeros((2, 3))
    found = MarginalLikelihood._over_grid(cast(Any, None), np.zeros((2, 1)), logs, places, np.zeros((2, 3, 3)))
    assert found.log == -3.0
    assert found.weight.tolist() == [0.0, 1.0]
    of, linear = unknowns(), Linear.drawn(2, TRUTH)
    place = begun(of)
    normal = Arrowhead.at(of, place, linear.gram)
    normal = normal._replace(blocks=np.full_like(normal.blocks, lost), cost=np.inf)
    assert np.isneginf(MarginalLikelihood.of(PosteriorMode(of, place, normal, np.zeros(1), np.inf, 1)).log)


def _by_quadrature(linear: Linear, of: Unknowns, low: float, high: float) -> float:
    """Logarithm of the evidence with the third coordinate's prior cut to an interval and not renormalised."""
    without = replace(of, precision=of.precision + np.diag([0.0, 0.0, 1e14]))
    covariance = covariance_of(linear, without, np.zeros(1))
    factor = np.linalg.cholesky(covariance)
    left = np.linalg.solve(factor, linear.measured.ravel())
    column = np.linalg.solve(factor, linear.design(of)[:, 2])
    error = 1.0 / np.sqrt(column @ column)
    sd = of.precision[2, 2] ** -0.5
    best = np.clip(column @ left * error**2 / (1.0 + error**2 / sd**2), low, high)

    def log_density(strength: float) -> float:
        away = left - column * strength
        return float(-0.5 * away @ away + norm(0.0, sd).logpdf(strength))

    peak, ends = log_density(best), (max(low, best - 12.0 * error), min(high, best + 12.0 * error))
    whole = quad(lambda s: np.exp(log_density(s) - peak), *ends, epsabs=0.0, epsrel=1e-9)[0]
    nuisances = int(of.free.sum())
    log = peak + np.log(whole) - np.log(np.diag(factor)).sum()
    return float(log + nuisances * np.log(FLAT))


def prior_draw(random: np.random.Generator, of: Unknowns, loud: float = 20.0) -> tuple[Linear, np.ndarray, float]:
    """Records of a truth and a scatter drawn from what is believed beforehand."""
    z = of.mean + np.linalg.cholesky(np.linalg.inv(of.precision)) @ random.standard_normal(3)
    sigma = 0.0 if random.random() < AGREE else float(random.choice(SIGMA_LEVELS[1:]))
    return Linear.drawn(int(random.integers(1 << 30)), z, sigma, loud=loud), z, sigma


@pytest.fixture(scope="module")
def drawn() -> list[tuple[MarginalLikelihood, np.ndarray, float]]:
    """Evidence, the true coordinates and the true scatter."""
    random, found = np.random.default_rng(7), []
    for _ in range(DRAWS):
        linear, z, sigma = prior_draw(random, unknowns())
        found.append((weighed(linear, unknowns()), z, sigma))
    return found


def test_the_spread_is_as_large_as_errors_are(drawn: list) -> None:
    squares = np.array([(z - found.mean) ** 2 / np.diag(found.spread) for found, z, _ in drawn])
    error = squares.std(axis=0) / np.sqrt(DRAWS)
    assert np.all(np.abs(squares.mean(axis=0) - 1.0) < USUAL * error)
    assert np.all(error < 0.2)
    # The negative control: who takes records for alike is far too sure of the value that scatters.
    alike = [(z - found.z[0]) ** 2 / np.diag(found.covariance[0]) for found, z, _ in drawn]
    assert np.mean(alike, axis=0)[0] > 3.0


def test_the_probability_that_records_agree_is_one(drawn: list) -> None:
    said = np.array([found.agree(0) for found, _, _ in drawn])
    true = np.array([sigma == 0.0 for _, _, sigma in drawn])
    assert abs(np.mean(said - true)) < USUAL * np.std(said - true) / np.sqrt(DRAWS)
    # Scatter that is smaller than the records' own errors cannot be seen: the difference is not larger.
    assert said[true].mean() > said[~true].mean() + 0.15


def test_levels_and_their_probabilities(drawn: list) -> None:
    for found, _, _ in drawn[:20]:
        levels, probability = found.levels(0)
        np.testing.assert_array_equal(levels, SIGMA_LEVELS)
        assert probability.sum() == pytest.approx(1.0)
        assert found.agree(0) == probability[0]
    # Scatter of eight percent is told from none, where each record knows its value to a percent.
    widest = [found.levels(0) for found, _, sigma in drawn if sigma == SIGMA_LEVELS[-1]]
    assert np.mean([probability[levels >= 0.03].sum() for levels, probability in widest]) > 0.8


def test_the_mixture_is_that_of_draws_from_it() -> None:
    found = weighed(Linear.drawn(8, TRUTH, scatter=0.02, loud=10.0), unknowns())
    random, count = np.random.default_rng(0), 20_000
    which = random.choice(len(found.grid), count, p=found.weight)
    roots = np.linalg.cholesky(found.covariance)
    z = found.z[which] + np.einsum("nij,nj->ni", roots[which], random.standard_normal((count, 3)))
    np.testing.assert_allclose(z.mean(axis=0), found.mean, atol=USUAL * np.sqrt(np.diag(found.spread).max() / count))
    # A variance of so many draws is known to a hundredth, of a mixture with wide tails to a few.
    np.testing.assert_allclose(np.var(z, axis=0), np.diag(found.spread), rtol=0.06)


def test_many_deviating_parameters_have_a_coarser_grid() -> None:
    of = replace(unknowns(()), log=np.ones(3, dtype=bool), reference=np.ones(3), scale=np.ones(3))
    many = replace(of, scattering=np.array([0, 1, 2, 0])[: MANY + 1])
    place = begun(many)
    normal = Arrowhead.at(many, place, lambda local, columns, targets: np.einsum("rij->rij", _grams(len(columns))))
    found = MarginalLikelihood.of(PosteriorMode(many, place, normal, np.full(4, 0.004), np.inf, 1))
    assert set(np.unique(found.grid)) == set(FEW_SIGMA_LEVELS)
    assert len(found.grid) == len(FEW_SIGMA_LEVELS) ** 4


def _grams(columns: int) -> np.ndarray:
    rows = np.random.default_rng(0).standard_normal((4, columns + 1, SIZE))
    return 1e-12 * np.einsum("rit,rjt->rij", rows, rows)


def test_the_scatter_is_found_on_the_way_wherever_it_begins() -> None:
    of, linear = unknowns(), Linear.drawn(9, TRUTH, scatter=0.03, loud=20.0)
    ends = [weighed(linear, of, sigma=np.array([level])) for level in (0.0, 0.001, 0.08)]
    assert len({round(end.log, 3) for end in ends}) == 1
    assert 0.008 <= ends[0].mode.sigma[0] <= 0.08
    # The mode belongs to that scatter.
    same = mode(of, ends[0].mode.place, linear.gram, ends[0].mode.sigma, 1e-9)
    assert ends[0].mode.objective == pytest.approx(same.objective, abs=EXACT)


def test_a_place_that_is_worth_nothing_has_no_evidence_but_its_own() -> None:
    """Records that differ, taken for alike: from there other scatters look far better, and nobody has been there."""
    of, linear = unknowns(), Linear.drawn(9, TRUTH, scatter=0.03, loud=20.0)
    alike = np.array([0.0])
    stays = mode(of, begun(of), linear.gram, alike, 1e-9)
    given_up = Effort(worthless=stays.objective - 1.0)
    found = laplace_evidence(of, begun(of), linear.gram, alike, 1e-9, given_up)
    assert found.log <= found.log_if(alike) + np.log(len(found.grid))
    # The negative control: what is followed finds them.
    assert weighed(linear, of, sigma=alike).log > found.log + 15.0


def test_what_was_found_is_not_lost_where_other_scatters_lead_to_what_is_worth_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    of, linear = unknowns(), Linear.drawn(9, TRUTH, scatter=0.03, loud=20.0)
    begun_at, rounds = np.array([0.001]), list[PosteriorMode]()
    enough = mode(of, begun(of), linear.gram, begun_at, 1e-9).objective + 1.0

    def astray(of: Unknowns, start: Any, gram: Any, sigma: Any, *how: Any) -> PosteriorMode:
        rounds.append(mode(of, begun(of), gram, sigma, effort=Effort(steps=1 if rounds else 40)))
        return rounds[-1]

    monkeypatch.setattr(weighing, "mode", astray)
    found = laplace_evidence(of, begun(of), linear.gram, begun_at, 1e-9, Effort(worthless=enough))
    assert len(rounds) == 2
    assert found.mode is rounds[0]
    assert found.log <= found.log_if(begun_at) + np.log(len(found.grid))


def test_where_a_prediction_has_failed_others_like_it_do_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    """From a small scatter a larger one looks far better; there the descent ends in another, dearer minimum.

    What the first place predicts of the scatters beside that one, where nobody has been, is of the same kind.
    """
    of, linear = unknowns(), Linear.drawn(9, TRUTH, scatter=0.03, loud=20.0)
    begun_at, rounds = np.array([0.004]), list[PosteriorMode]()

    def elsewhere(of: Unknowns, start: Any, gram: Any, sigma: Any, *how: Any) -> PosteriorMode:
        found = mode(of, start, gram, sigma, *how)
        dearer = replace(found, normal=found.normal._replace(cost=found.normal.cost + (1e3 if rounds else 0.0)))
        rounds.append(dearer)
        return dearer

    monkeypatch.setattr(weighing, "mode", elsewhere)
    found = laplace_evidence(of, begun(of), linear.gram, begun_at, 1e-9)
    assert len(rounds) == 2
    assert found.mode is rounds[0]
    assert found.log_if(begun_at) <= found.log <= found.log_if(begun_at) + np.log(len(found.grid))
    np.testing.assert_array_equal(found.grid[np.argmax(found.weight)], begun_at)


def test_what_lies_beyond_a_bound_takes_the_others_along() -> None:
    """Held at the bound, the others are where a normal law is highest there; what is inside stays to the last bit."""
    random = np.random.default_rng(5)
    root = random.standard_normal((3, 3)) + np.diag([3.0, 1.0, 0.1])
    precision = root @ root.T
    bounds: Any = SimpleNamespace(lower=np.array([-np.inf, 0.0, -np.inf]), upper=np.array([np.inf, np.inf, 9.0]))
    z = np.array([[1.0, -2.0, 3.0], [1.0, 2.0, 3.0]])
    found = conditioned_on_bounds(bounds, z, np.repeat(np.linalg.inv(precision)[None], 2, axis=0))
    others = np.array([0, 2])
    # The highest place with the second at zero, from the normal equations of the others alone.
    pull = precision[np.ix_(others, [1])][:, 0] * 2.0
    held = z[0, others] - np.linalg.solve(precision[np.ix_(others, others)], pull)
    assert found[0] == pytest.approx([held[0], 0.0, held[1]])
    assert np.all(found[1] == z[1])
