"""Priors: densities against SciPy, limits, words; and that a change of coordinates neither makes nor loses mass."""

from __future__ import annotations

import dataclasses
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from fibrefit.core.declarations import Parameter
from fibrefit.core.errors import StudyError
from fibrefit.problem.statement.layout import Layout, Range, Slot
from fibrefit.report.sentences.posterior import prior_words
from fibrefit.rigs.catalogue import RIGS
from fibrefit.sampling.density.prior import Density, Prior, Priors, default_prior, log_slope
from fibrefit.simulation.model import Model
from fibrefit.study.parameters import PriorSetting

ROUNDING = 1e-10
"""Densities are short formulas in double precision."""
QUADRATURE = 2e-3
"""Trapezoids over some thousand points, and a nudge of 1e-4 that coordinates keep from a limit."""

KINDS = {
    "normal": (PriorSetting("normal", 4.0, 2.0), scipy.stats.norm(4.0, 2.0)),
    "truncated normal": (PriorSetting("normal", 4.0, 2.0, 3.0, 9.0), scipy.stats.truncnorm(-0.5, 2.5, 4.0, 2.0)),
    "half-normal": (PriorSetting("half_normal", 0.0, 3.0, 0.0), scipy.stats.halfnorm(scale=3.0)),
    "log-normal": (PriorSetting("log_normal", 5.0, 0.4, 0.0), scipy.stats.lognorm(0.4, scale=5.0)),
    "uniform": (PriorSetting("uniform", lower=1.0, upper=6.0), scipy.stats.uniform(1.0, 5.0)),
    "log-uniform": (PriorSetting("log_uniform", lower=0.5, upper=50.0), scipy.stats.loguniform(0.5, 50.0)),
}


@pytest.mark.parametrize("kind", KINDS)
def test_density_is_that_of_the_distribution(kind: str) -> None:
    stated, truth = KINDS[kind]
    density = Density.of([Prior.of(stated)])
    values = truth.ppf([0.01, 0.3, 0.5, 0.9, 0.999])
    found = [float(density.log_density(jnp.array([value]))) for value in values]
    np.testing.assert_allclose(found, truth.logpdf(values), rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("kind", KINDS)
def test_cdf_and_quantile_are_those_of_the_distribution(kind: str) -> None:
    stated, truth = KINDS[kind]
    prior, shares = Prior.of(stated), np.array([0.001, 0.2, 0.5, 0.99])
    np.testing.assert_allclose(prior.quantile(shares), truth.ppf(shares), rtol=ROUNDING)
    np.testing.assert_allclose(prior.cdf(truth.ppf(shares)), shares, atol=ROUNDING)


@pytest.mark.parametrize(("kind", "outside"), [("truncated normal", 2.9), ("half-normal", -0.1), ("log-uniform", 60.0)])
def test_density_is_nil_outside_the_support_and_has_a_finite_slope_there(kind: str, outside: float) -> None:
    density = Density.of([Prior.of(KINDS[kind][0])])
    value, slope = jax.value_and_grad(lambda x: density.log_density(x))(jnp.array([outside]))
    assert value == -math.inf
    assert np.isfinite(slope).all()


@given(st.floats(0.001, 0.999), st.sampled_from(sorted(KINDS)), st.floats(0.05, 0.45), st.floats(0.55, 0.95))
def test_truncation_is_conditioning(share: float, kind: str, low: float, high: float) -> None:
    whole = Prior.of(KINDS[kind][0])
    lower, upper = (float(v) for v in whole.quantile(np.array([low, high])))
    cut = whole.within(lower, upper, "here")
    expected = whole.quantile(np.array(low + share * (high - low)))
    assert float(cut.quantile(np.array(share))) == pytest.approx(float(expected), rel=1e-6)


RANGES = {
    "no limit": Range(-math.inf, math.inf, 2.0),
    "from below": Range(1.0, math.inf, 2.0),
    "from above": Range(-math.inf, 7.0, 2.0),
    "both": Range(1.0, 7.0, 2.0),
    "logarithmic": Range(0.0, math.inf, 2.0, True),
    "logarithmic, both": Range(1.0, 9.0, 2.0, True),
}


@pytest.mark.parametrize("limits", RANGES)
@pytest.mark.parametrize("kind", ["normal", "log-normal"])
def test_a_change_of_coordinates_keeps_the_mass(limits: str, kind: str) -> None:
    layout = Layout((Slot("a", "N", RANGES[limits]),), ("r",))
    prior = Prior.of(KINDS[kind][0]).within(RANGES[limits].lower, RANGES[limits].upper, "a")
    density = Density.of([prior])
    free = jnp.linspace(-40.0, 40.0, 160001)[:, None]

    def mass(x: jax.Array) -> jax.Array:
        return jnp.exp(density.log_density(layout.values(x)) + log_slope(layout, x))

    assert float(jnp.trapezoid(jax.vmap(mass)(free), free[:, 0])) == pytest.approx(1.0, abs=QUADRATURE)


def test_without_the_slope_mass_is_lost() -> None:
    """The negative control of the test above."""
    layout = Layout((Slot("a", "N", RANGES["both"]),), ("r",))
    density = Density.of([Prior.of(KINDS["normal"][0]).within(1.0, 7.0, "a")])
    free = jnp.linspace(-40.0, 40.0, 160001)[:, None]
    mass = jnp.trapezoid(jax.vmap(lambda x: jnp.exp(density.log_density(layout.values(x))))(free), free[:, 0])
    assert abs(float(mass) - 1.0) > 10.0 * QUADRATURE


def test_a_prior_beyond_the_limits_is_refused_with_the_remedy() -> None:
    with pytest.raises(StudyError) as refused:
        Prior.of(PriorSetting("uniform", lower=10.0, upper=20.0)).within(0.0, 5.0, "prior of damping")
    assert str(refused.value) == (
        "prior of damping: the prior allows 10 to 20 only; expected some overlap with the parameter's limits 0 to 5. "
        "Widen the prior or the bounds."
    )


@pytest.mark.parametrize(("centre", "left"), [(100.0, False), (-100.0, False), (55.0, True), (-4.0, True)])
def test_a_prior_of_which_limits_leave_nothing_is_refused_on_either_side(centre: float, left: bool) -> None:
    prior = Prior.of(PriorSetting("normal", centre=centre, spread=1.0))
    if left:
        assert np.isfinite(prior.within(1.0, 50.0, "prior of damping").log_mass)
        return
    with pytest.raises(StudyError, match=r"has nothing between 1 and 50; expected limits within eight of its standard"):
        prior.within(1.0, 50.0, "prior of damping")


@pytest.mark.parametrize(
    ("prior", "words"),
    [
        (Prior(False, 4.0, 2.0), "normal, 4 +/- 2 N"),
        (Prior(False, 4.0, 2.0, 0.0), "normal, 4 +/- 2 N, within 0 to inf N"),
        (Prior(False, 0.0, 40.0, 0.0), "half-normal, sd 40 N"),
        (Prior(False, 3.0, 1.0, 3.0), "normal, 3 +/- 1 N, within 3 to inf N"),
        (Prior(False, 0.0, 40.0, 0.0, 9.0), "half-normal, sd 40 N, within 0 to 9 N"),
        (Prior(True, 5.0, math.log(2.0), 5.0), "log-normal, median 5 N, factor 2, within 5 to inf N"),
        (Prior(True, 5.0, math.log(2.0), 0.0), "log-normal, median 5 N, factor 2"),
        (Prior(True, 1.0, math.inf, 10.0, 1e7), "log-uniform, 10 to 1e+07 N"),
        (Prior(False, 1.0, math.inf, 1.0, 2.0), "uniform, 1 to 2 N"),
    ],
)
def test_words(prior: Prior, words: str) -> None:
    assert prior_words(prior, "N") == words


@pytest.mark.parametrize(
    ("prior", "proper"),
    [
        (Prior(False, 1.0, math.inf), False),
        (Prior(False, 1.0, math.inf, 0.0), False),
        (Prior(True, 1.0, math.inf, 0.0, 5.0), False),
        (Prior(True, 1.0, math.inf, 1.0, 5.0), True),
        (Prior(False, 0.0, 1.0), True),
    ],
)
def test_a_density_without_end_is_not_proper(prior: Prior, proper: bool) -> None:
    assert prior.proper == proper
    assert np.isfinite(prior.quantile(np.array([0.3]))).all() == proper


def test_defaults_exclude_nothing_sensible() -> None:
    for rig in RIGS.values():
        for parameter in rig.parameters:
            prior = default_prior(parameter, Range.of(parameter))
            assert prior.proper, parameter.name
            # A third and three times the typical size lie well inside.
            assert np.all(np.abs(prior.cdf(parameter.typical * np.array([1 / 3, 3.0])) - 0.5) < 0.499), parameter.name


def test_default_of_what_vanishes_at_infinity_is_a_distribution() -> None:
    stiff = Parameter("mount", "N/m", "", 1e6, lower=1e3, null=math.inf, reciprocal=True)
    prior = default_prior(stiff, Range(1e3, math.inf, 1e6, True))
    assert prior.proper
    assert prior.log


def test_priors_of_a_problem_name_their_source() -> None:
    rig = RIGS["fibre_mass"]
    slots = [Slot(p.name, p.unit, Range.of(p)) for p in rig.parameters]
    slots += [Slot(p.name, p.unit, Range.of(p), shared=False) for p in rig.nuisances]
    layout = Layout(tuple(slots), ("one",))
    start = layout.pack({"stiffness": 2e4, "damping": 20.0, "friction": 3.0, "position_zero": 1e-4, "release": 0.1})
    priors = Priors.of(layout, Model(rig), start, {"friction": PriorSetting("normal", 3.0, 0.5)})
    said = {n: (prior_words(p, u), p.source) for n, u, p in zip(priors.names, priors.units, priors.each, strict=True)}
    assert said["friction"] == ("normal, 3 +/- 0.5 N, within 0 to 1000 N", "study")
    assert said["damping"] == ("half-normal, sd 200 N s/m, within 0 to 1e+04 N s/m", "default")
    assert said["position_zero[one]"] == ("normal, 0.0001 +/- 0.01 m", "default")


def test_draws_follow_the_priors() -> None:
    rig = RIGS["fibre_mass"]
    layout = Layout(tuple(Slot(p.name, p.unit, Range.of(p)) for p in rig.parameters), ("one",))
    priors = Priors.of(layout, Model(rig), np.array([2e4, 20.0, 3.0]), {})
    draws = priors.draw(np.random.default_rng(0), 20_000)
    for prior, column in zip(priors.each, draws.T, strict=True):
        assert scipy.stats.kstest(prior.cdf(column), "uniform").pvalue > 1e-3
        # The negative control: a prior that is wider by a fifth, or has seven decades in place of six.
        changed = {"upper": 10.0 * prior.upper} if prior.even else {"spread": 1.2 * prior.spread}
        wider = dataclasses.replace(prior, **changed)
        assert scipy.stats.kstest(wider.cdf(column), "uniform").pvalue < 1e-6
