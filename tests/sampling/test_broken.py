"""Posteriors of the textbook's broken kinds: each ends with the right warning, none with a confident wrong answer."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.core.errors import StudyError
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.report.posterior import posterior_advice
from fibrefit.report.sentences.posterior import posterior_sentence
from fibrefit.sampling.density.prior import Prior
from fibrefit.sampling.evidence import LOOK_ESS, LOOK_STEPS, distinct, sample_modes
from fibrefit.sampling.mode import Approximation
from fibrefit.sampling.posterior import Marginal, assess, marginals, status
from fibrefit.sampling.sample import ChainStart, PosteriorRequest, sample_posterior
from fibrefit.sampling.settings import Settings
from fibrefit.study.summaries.check import Check
from tests.sampling.drops import TRUTH
from tests.sampling.targets import around, normal, target

WIDE = Prior(False, 0.0, 1e3)
Density = Callable[[np.ndarray], np.ndarray]


def judged(
    density: Density, approximations: list[Approximation], priors: tuple[Prior, ...] = (), **settings: object
) -> tuple[dict[str, Check], dict[str, Marginal], str]:
    """Checks by name, marginals and verdict of a two-dimensional density."""
    chosen = Settings(**{"seed": 0, "max_steps": 300, **settings})
    aim = target(density, 2, priors or (WIDE, WIDE))
    modes = sample_modes(aim, distinct(approximations), chosen)
    found = marginals(aim, modes[0].course, chosen.interval)
    checks = assess(aim, modes, found, approximations[0].centre, chosen)
    # Whoever is warned is told what to do, and a good posterior is not called into question.
    told = posterior_advice(checks, modes[0].course.converged, with_nuts=True)
    assert bool(told) == (status(checks) != "ok"), [posterior_sentence(check) for check in checks if not check.passed]
    return {check.name: check for check in checks}, found, status(checks)


def test_a_good_posterior_passes_all() -> None:
    """The negative control of all the others."""
    density = normal(np.zeros(2), np.eye(2))
    checks, found, verdict = judged(density, [around(density, np.zeros(2), np.eye(2))])
    assert verdict == "ok", [posterior_sentence(c) for c in checks.values() if not c.passed]
    assert found["a"].sd == pytest.approx(1.0, abs=0.1)


TWO = (normal(np.zeros(2), np.eye(2), math.log(0.4)), normal(np.array([12.0, 0.0]), np.eye(2), math.log(0.6)))


def two_modes(x: np.ndarray) -> np.ndarray:
    return np.logaddexp(TWO[0](x), TWO[1](x))


def test_two_known_modes_are_weighed_and_never_averaged() -> None:
    found = [around(two_modes, np.array([c, 0.0]), np.eye(2)) for c in (0.0, 12.0)]
    checks, marginal, verdict = judged(two_modes, found)
    assert verdict == "suspect"
    says = posterior_sentence(checks["there is one mode"])
    assert says.startswith(
        "The posterior is multimodal: weight 0.6 at a = 12 m, b = 0 m; weight 0.4 at a = 0 m, b = 0 m."
    )
    assert "never an average" in says
    assert marginal["a"].mean == pytest.approx(12.0, abs=0.3)


def test_a_cloud_over_two_modes_is_noticed() -> None:
    """Nobody knew of two modes; the walkers began in both and stay where they are."""
    far = lambda x: np.logaddexp(TWO[0](x), normal(np.array([40.0, 0.0]), np.eye(2), math.log(0.6))(x))  # noqa: E731
    wide = Approximation(np.array([20.0, 0.0]), np.diag([900.0, 1.0]), -500.0)
    checks, _, verdict = judged(far, [wide], max_steps=100)
    assert verdict != "ok"
    failed = {name for name, check in checks.items() if not check.passed}
    assert failed & {"the walkers mix", "the ensembles agree"}, failed


def test_a_strong_correlation_is_named() -> None:
    """Only the sum is determined."""
    covariance = np.array([[1.0, -0.99999], [-0.99999, 1.0]])
    density = normal(np.zeros(2), covariance)
    checks, _, verdict = judged(density, [around(density, np.zeros(2), covariance)])
    assert verdict == "suspect"
    correlation = checks["no strong posterior correlation"]
    assert (correlation.identifier, correlation.quantity) == (
        "posterior_correlation",
        "strongest posterior correlation",
    )
    assert posterior_sentence(correlation).startswith("The posterior |correlation| of a and b is 1.0000")
    assert "only a combination of them is determined" in posterior_sentence(correlation)


def test_a_start_far_out_is_found_out() -> None:
    density = normal(np.array([0.0, 60.0]), np.eye(2))
    checks, found, verdict = judged(density, [around(density, np.array([60.0, 0.0]), np.eye(2))], max_steps=1500)
    assert not checks["the posterior lies at the fit"].passed
    assert verdict != "ok"
    # Either it got there or it says that it did not: never a confident wrong answer.
    if checks["the ensembles agree"].passed and checks["the walkers mix"].passed:
        assert found["b"].mean == pytest.approx(60.0, abs=0.5)


def test_a_start_too_far_for_the_budget_is_no_answer() -> None:
    density = normal(np.array([0.0, 60.0]), np.eye(2))
    checks, _, verdict = judged(density, [around(density, np.array([60.0, 0.0]), 0.01 * np.eye(2))], max_steps=12)
    assert verdict == "failed", [posterior_sentence(c) for c in checks.values()]


def test_what_the_data_do_not_see_is_the_prior_and_said_so() -> None:
    prior = Prior(False, 3.0, 2.0)
    density = lambda x: normal(np.zeros(1), np.eye(1))(x[:, :1]) + normal(np.array([3.0]), 4.0 * np.eye(1))(x[:, 1:])  # noqa: E731
    approximation = around(density, np.array([0.0, 3.0]), np.diag([1.0, 4.0]))
    checks, found, verdict = judged(density, [approximation], (WIDE, prior))
    assert verdict == "suspect"
    says = posterior_sentence(checks["every posterior is narrower than its prior"])
    assert says.startswith("Posterior / prior width of b exceeds 0.8 (largest ")
    assert says.endswith("): the data tell nothing of it, and what is reported is the prior.")
    assert found["b"].prior_share > 0.9
    assert found["a"].prior_share < 0.01


def test_a_posterior_that_a_bound_truncates_is_named() -> None:
    positive = Prior(False, 0.0, 50.0, 0.0)
    density = lambda x: np.where(x[:, 0] > 0.0, -x[:, 0] - 0.5 * x[:, 1] ** 2, -np.inf)  # noqa: E731
    checks, _, verdict = judged(density, [Approximation(np.array([1.0, 0.0]), np.eye(2), -1.0)], (positive, WIDE))
    assert verdict == "suspect"
    assert "The posterior of a is truncated by a bound" in posterior_sentence(
        checks["no posterior is truncated by a bound"]
    )


def test_an_improper_prior_is_named_where_the_data_make_up_for_it() -> None:
    density = normal(np.zeros(2), np.eye(2))
    endless = Prior(False, 1.0, math.inf)
    checks, _, verdict = judged(density, [around(density, np.zeros(2), np.eye(2))], (endless, WIDE))
    assert verdict == "suspect"
    assert posterior_sentence(checks["every prior is proper"]).startswith("The prior of a is improper")


FALLING = 150
"""Samples before the first contact: the fibre, and all it is made of, has not been touched yet."""


@pytest.fixture
def falling(small: tuple[Task, np.ndarray]) -> Task:
    """The small task cut short: the fall tells friction, and nothing tells stiffness and damping."""
    task, _ = small
    return replace(task, problem=task.problem.until(jnp.full(2, FALLING)))


@pytest.mark.slow
def test_unseen_parameters_end_as_their_priors(falling: Task) -> None:
    stated = {"stiffness": Prior(True, 2e4, 0.5), "damping": Prior(False, 20.0, 3.0)}
    found = sample_posterior(
        falling, ChainStart(falling.start), PosteriorRequest(noise="coloured", settings=Settings(seed=1)), stated=stated
    )
    contraction = {check.name: check for check in found.checks}["every posterior is narrower than its prior"]
    assert posterior_sentence(contraction).startswith("Posterior / prior width of stiffness, damping exceeds 0.8 ")
    assert "what is reported is the prior" in posterior_sentence(contraction)
    assert found.status != "ok"
    assert found.marginals["damping"].mean == pytest.approx(20.0, abs=0.5)
    assert found.marginals["damping"].sd == pytest.approx(3.0, rel=0.15)
    # The rest is none the worse for it.
    friction = found.marginals["friction"]
    assert friction.prior_share < 0.1
    assert abs(friction.mean - TRUTH["friction"]) < 4.0 * friction.sd


def test_an_unseen_parameter_without_a_proper_prior_has_no_posterior(small: tuple[Task, np.ndarray]) -> None:
    """Nobody measured the position: what its channel would have read at the taut point is anybody's guess."""
    task, values = small
    data = task.problem.observations
    blind = data._replace(weight={**data.weight, "position": jnp.zeros_like(data.weight["position"])})
    problem = Problem(task.problem.model, task.problem.layout, blind)
    stated = {"position_zero": Prior(False, 1.0, math.inf)}
    with pytest.raises(StudyError) as refused:
        sample_posterior(replace(task, problem=problem), ChainStart(values), stated=stated)
    assert str(refused.value) == (
        "prior of position_zero[drop 0]: neither the data nor a prior limit position_zero[drop 0] with "
        "position_zero[drop 1]: the posterior is not a distribution; expected a proper prior, for one of them at "
        'least. Give it one, such as kind = "normal" or "half_normal", or bounds on both sides.'
    )


def test_a_light_looking_mode_that_proves_the_heaviest_is_sampled_in_full() -> None:
    """Laplace's method is told that the second mode is narrower than it is; bridge sampling finds out."""
    first, second = np.zeros(2), np.array([30.0, 0.0])
    both = lambda x: np.logaddexp(  # noqa: E731
        normal(first, np.eye(2), math.log(0.2))(x), normal(second, 9.0 * np.eye(2), math.log(0.8))(x)
    )
    found = [around(both, first, np.eye(2)), around(both, second, 0.5 * np.eye(2))]
    modes = sample_modes(target(both, 2), found, Settings(seed=0, ess=1500.0))
    assert modes[0].approximation.centre[0] == 30.0
    assert modes[0].weight == pytest.approx(0.8, abs=0.03)
    for mode, enough in zip(modes, (1500.0, LOOK_ESS), strict=True):
        assert mode.course is not None
        assert mode.course.converged or mode is modes[1]
        assert mode.course.mixing.ess_bulk.min() > enough
    assert modes[1].course.points.shape[1] <= LOOK_STEPS
