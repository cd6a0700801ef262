"""The whole way from a task to a posterior, on one small series whose truth is known."""

from __future__ import annotations

import sys
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

from fibrefit.core.errors import UsageError
from fibrefit.fitting.identify import identify
from fibrefit.laws.guide.drag import ViscousFriction
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.report.sentences.posterior import likelihood_sentence, posterior_sentence, prior_words
from fibrefit.sampling.density.log_posterior import noise_priors
from fibrefit.sampling.evidence import distinct
from fibrefit.sampling.mode import find_mode
from fibrefit.sampling.posterior import Posterior
from fibrefit.sampling.predict import Bands, cross_validate, draw_noise, predict
from fibrefit.sampling.sample import ChainStart, PosteriorRequest, _gap, coordinates_of, prepare, sample_posterior
from fibrefit.sampling.settings import Settings
from fibrefit.store.hdf5 import read_result, write_result
from fibrefit.study.summaries.results import ChannelGap, Provenance
from fibrefit.workflow.sampling.groups import posterior_groups
from tests.sampling.drops import NOISE, TRUTH, fitted, series, task_of

ORIGIN = Provenance(created="now", versions={}, inputs={}, resolved_study="")
SHORT = Settings(seed=3, max_steps=6)
SURE = 4.0
"""Standard deviations from the truth that one of nine values may be."""


@pytest.fixture(scope="module")
def posterior(small: tuple[Task, np.ndarray]) -> Posterior:
    task, values = small
    return sample_posterior(task, ChainStart(values), PosteriorRequest(settings=Settings(seed=3, ess=100.0)))


@pytest.fixture(scope="module")
def bands(posterior: Posterior) -> dict[str, Bands]:
    return predict(posterior, 60)


def test_it_holds_the_truth(posterior: Posterior, small: tuple[Task, np.ndarray]) -> None:
    for name, value in zip(small[0].problem.layout.free_names, small[0].start, strict=True):
        marginal = posterior.marginals[name]
        assert abs(marginal.mean - value) < SURE * marginal.sd, name
        assert marginal.interval[0] < marginal.median < marginal.interval[1]
    for channel, rms in NOISE.items():
        assert posterior.marginals[f"noise.{channel}"].mean == pytest.approx(rms, rel=0.1)
    assert posterior.marginals["noise.force"].unit == "N"


def test_it_passes_its_checks(posterior: Posterior) -> None:
    assert posterior.status == "ok", [posterior_sentence(check) for check in posterior.checks if not check.passed]
    assert posterior.course.converged
    assert len({check.name for check in posterior.checks}) == len(posterior.checks) == 11


def test_the_noise_is_told(posterior: Posterior) -> None:
    assert posterior.noise_model.kind == "coloured"
    says = likelihood_sentence(posterior.noise_model)
    assert says.startswith("Likelihood: coloured noise")
    assert says.endswith(", as a fit finds it from what the model leaves.")
    prior = posterior.marginals["noise.force"].prior
    assert prior is not None
    assert prior.centre == pytest.approx(NOISE["force"], rel=0.1)
    assert prior_words(prior, "N") == f"log-normal, median {prior.centre:.4g} N, factor 2.718"


@pytest.mark.parametrize("records", [1, 2])
def test_noise_mode_and_evidence_are_those_of_a_fit(small: tuple[Task, np.ndarray], records: int) -> None:
    """Also where no record can differ from another, as there is one."""
    traces = small[0].traces[:records]
    task = task_of(list(traces))
    fit = identify(task, 2, 0)
    assert fit.gls is not None
    ready = prepare(task, ChainStart(fit.plain.values), {}, PosteriorRequest())
    frequency = np.geomspace(3.0, 900.0, 40)
    for mine, its in zip(ready.noise_model.parameters, fit.gls.noise, strict=True):
        np.testing.assert_allclose(mine.density(frequency), its.density(frequency), rtol=0.02)
    found = ready.deviations
    assert found is not None
    assert found.evidence is not None
    assert found.evidence.log == pytest.approx(fit.gls.evidence.log, abs=0.05)
    assert np.all(np.abs(ready.values - fit.gls.values) < 0.1 * fit.gls.bars.errors["whitened"])
    # The negative control: white noise of the same level is another likelihood.
    white = prepare(task, ChainStart(fit.plain.values), {}, PosteriorRequest("white")).deviations
    assert white is not None
    assert white.evidence is not None
    assert abs(white.evidence.log - fit.gls.evidence.log) > 5.0


@pytest.mark.parametrize(("kind", "expected"), [("fit", 1.0), ("white", np.sqrt(0.5 * (0.5**2 + 0.25**2)))])
def test_where_walkers_begin_a_level_is_that_of_the_noise_in_motion(
    small: tuple[Task, np.ndarray], kind: str, expected: float
) -> None:
    """Of records louder than their rests are said to be; white noise knows nothing but its level at rest."""
    task, values = small
    data, louder = task.problem.observations, jnp.array([2.0, 4.0])[:, None]
    quiet = data._replace(weight={channel: louder * weight for channel, weight in data.weight.items()})
    told = replace(task, problem=eqx.tree_at(lambda p: p.observations, task.problem, quiet))
    ready = prepare(told, ChainStart(values), {}, PosteriorRequest(kind))
    levels = ready.target.values(coordinates_of(ready.density, ready.values)[None])[0, -2:]
    np.testing.assert_allclose(levels, expected * np.array([NOISE["force"], NOISE["position"]]), rtol=0.1)


@pytest.mark.parametrize("away", [0.0, 0.05])
def test_a_posterior_is_held_against_what_the_fit_reports(small: tuple[Task, np.ndarray], away: float) -> None:
    task, values = small
    reported = values * np.where(np.arange(len(values)) == 0, 1.0 + away, 1.0)
    found = sample_posterior(task, ChainStart(values, reported=reported), PosteriorRequest(settings=SHORT))
    (check,) = [check for check in found.checks if check.identifier == "distance_from_fit"]
    assert check.passed is (away == 0.0)
    assert "from what the fit reports" in posterior_sentence(check)


def test_a_mode_this_normal_has_the_evidence_laplace_gives(posterior: Posterior) -> None:
    found = posterior.log_evidence
    assert found.error < 0.05
    assert found.log_value == pytest.approx(posterior.modes[0].approximation.log_evidence, abs=0.3)


@pytest.mark.slow
def test_white_intervals_are_too_narrow(posterior: Posterior, small: tuple[Task, np.ndarray]) -> None:
    task, values = small
    white = sample_posterior(task, ChainStart(values), PosteriorRequest(noise="white", settings=Settings(seed=3)))
    assert likelihood_sentence(white.noise_model) == "Likelihood: white noise, as requested."
    zero = "position_zero[drop 0]"
    assert posterior.marginals[zero].sd / white.marginals[zero].sd > 1.3
    # What wander does to a shared value is then taken for a difference between records.
    assert white.between["friction"].found
    assert not posterior.between["friction"].found


def test_bands_hold_the_measurements(bands: dict[str, Bands], small: tuple[Task, np.ndarray]) -> None:
    assert set(bands) == {"force", "position"}
    for channel, band in bands.items():
        # 2000 samples, their noise correlated, from 60 draws.
        assert band.covered == pytest.approx(0.9, abs=0.03)
        spread = band.model[2] - band.model[0]
        assert np.all(spread <= band.measured[2] - band.measured[0] + 1e-12)
        # The motion is known far better than a single sample of it, but where the force jumps.
        assert np.median(spread) < 0.3 * 3.3 * NOISE[channel]


def test_drawn_noise_has_the_colour_of_the_likelihood(posterior: Posterior) -> None:
    likelihood = posterior.density.likelihood
    random, size = np.random.default_rng(0), 512
    drawn = np.stack([draw_noise(likelihood, size, np.zeros(2), random) for _ in range(400)])
    expected = likelihood.whitening.autocovariance(size)
    for lag in (0, 1, 50):
        found = np.mean(drawn[..., : size - lag] * drawn[..., lag:], axis=(0, -1))
        np.testing.assert_allclose(found, expected[..., lag], atol=0.03)


def test_drawn_noise_with_heavy_tails_has_their_law(posterior: Posterior) -> None:
    """Of so few degrees of freedom a normal law of the same variance is far wider where most readings lie."""
    white = posterior.density.likelihood.whitening
    heavy = replace(posterior.density.likelihood, heavy=True, whitening=white)
    random, size, freedom = np.random.default_rng(0), 256, 2.2
    flat = SimpleNamespace(autocovariance=lambda n: np.eye(1, n)[0] + np.zeros((1, 2, n)))
    heavy = replace(heavy, whitening=cast(Any, flat))
    noise = np.array([0.0, 0.0, np.log(freedom)])
    drawn = np.concatenate([draw_noise(heavy, size, noise, random).ravel() for _ in range(40)])
    level = float(np.asarray(heavy.levels(jnp.asarray(noise)))[0])
    low, high = np.quantile(drawn / level, [0.05, 0.95])
    assert (-low + high) / 2.0 == pytest.approx(stats.t(freedom).ppf(0.95), rel=0.06)


@pytest.mark.slow
def test_cross_validation_counts_the_parameters_and_prefers_the_truth(posterior: Posterior) -> None:
    found = cross_validate(posterior)
    assert found.effective_parameters == pytest.approx(posterior.target.size, abs=4.0)
    assert found.unreliable <= 0.1 * len(found.blocks)
    stated = Settings(seed=3, max_steps=60)
    task = task_of(series(np.random.default_rng(1)))
    elsewhere = sample_posterior(
        task, ChainStart(task.start * np.array([1.0, 1.05, *np.ones(5)])), PosteriorRequest(settings=stated)
    )
    # Same data, same model: the same figure within its Monte-Carlo error, wherever the run began.
    assert cross_validate(elsewhere).total == pytest.approx(found.total, abs=3.0)
    wrong = task_of(task.traces, fixed={"damping": 3.0 * TRUTH["damping"]})
    worse = sample_posterior(wrong, ChainStart(fitted(wrong)), PosteriorRequest(settings=stated))
    assert cross_validate(worse).total < found.total - 5.0


def test_groups_go_to_a_file_and_back(posterior: Posterior, bands: dict[str, Bands], tmp_path: object) -> None:
    groups = posterior_groups(posterior, bands, 0)
    assert set(groups) == {
        "posterior",
        "sample_stats",
        "prior",
        "observed_data",
        "posterior_predictive",
        "constant_data",
    }
    file = tmp_path / "result.h5"
    write_result(file, "fibrefit/posterior/1", groups, ORIGIN)
    read, _ = read_result(file)
    draws = read["posterior"]["release"].values
    assert draws.shape[0] == 4
    assert draws.shape[2] == 2
    own = [posterior.target.names.index(f"release[drop {r}]") for r in (0, 1)]
    np.testing.assert_array_equal(draws[:, 0], posterior.draws[:, 0][:, own])
    assert read["posterior"]["stiffness"].unit == "N/m"
    assert read["posterior_predictive"]["force"].dims == ("chain", "draw", "record", "sample")
    samples = posterior.density.problem.observations.experiment.count[0]
    for name in ("force", "force_model", "force_measured"):
        values = read["posterior_predictive"][name].values
        assert values.shape[-1] > samples
        assert np.isfinite(values[..., :samples]).all()
        assert np.isnan(values[..., samples:]).all()


def test_groups_open_as_arviz_expects(posterior: Posterior, bands: dict[str, Bands], tmp_path: object) -> None:
    xarray = pytest.importorskip("xarray")
    groups = posterior_groups(posterior, bands, 0)
    file = tmp_path / "result.h5"
    write_result(file, "fibrefit/posterior/1", groups, ORIGIN)
    with xarray.open_datatree(file, engine="h5netcdf") as tree:
        opened = tree["posterior"]
        assert set(opened["stiffness"].dims) == {"chain", "draw"}
        assert float(opened["stiffness"].mean()) == pytest.approx(TRUTH["stiffness"], rel=0.01)


@pytest.mark.slow
def test_missing_physics_sets_off_the_alarm() -> None:
    """Viscous friction made the data and the model lacks it: whitening would explain it away."""
    viscous = {"guide.viscous_friction.viscous_coefficient": 6.0}
    task = task_of(series(np.random.default_rng(1), viscous, effects=(ViscousFriction,)))
    found = sample_posterior(
        task, ChainStart(fitted(task)), PosteriorRequest(noise="coloured", settings=Settings(seed=0, max_steps=12))
    )
    checks = {check.name: check for check in found.checks}
    assert not checks["the residuals are noise"].passed
    assert "Run discover" in posterior_sentence(checks["the residuals are noise"])
    hausman_test = checks["plain and whitened estimates agree"]
    assert not hausman_test.passed
    assert "noise model is explaining it away: run discover" in posterior_sentence(hausman_test)
    assert found.status != "ok"


@pytest.mark.slow
def test_another_minimum_is_looked_into(posterior: Posterior, small: tuple[Task, np.ndarray]) -> None:
    """A start a little off leads to the same mode and is not counted twice."""
    task, values = small
    beside = values * np.array([1.001, 1.02, 0.98, *np.ones(4)])
    found = sample_posterior(task, ChainStart(values, basins=[beside]), PosteriorRequest(settings=Settings(seed=3)))
    assert len(found.modes) == 1
    np.testing.assert_array_equal(found.points, posterior.points)


def test_a_search_that_is_given_up_is_no_mode(small: tuple[Task, np.ndarray], monkeypatch: pytest.MonkeyPatch) -> None:
    """On the slope of a mode Laplace's method counts the mass of that mode: it was sampled a second time for it."""
    monkeypatch.setattr("fibrefit.sampling.mode.MOST_STEPS", 3)
    task, values = small
    far = values * np.array([1.1, 1.5, 0.7, *np.ones(4)])
    found = sample_posterior(task, ChainStart(values, basins=[far]), PosteriorRequest(settings=SHORT))
    assert len(found.modes) == 1


def test_a_search_from_afar_arrives(small: tuple[Task, np.ndarray]) -> None:
    task, values = small
    far = values * np.array([1.1, 1.5, 0.7, *np.ones(4)])
    ready = prepare(task, ChainStart(values), {}, PosteriorRequest(settings=SHORT))
    priors = ready.priors.each + noise_priors(ready.noise_model.likelihood)
    ends = [find_mode(ready.density, coordinates_of(ready.density, one), priors) for one in (values, far)]
    assert [arrived for _, arrived in ends] == [True, True]
    assert len(distinct([mode for mode, _ in ends])) == 1


@pytest.mark.extra("blackjax")
@pytest.mark.slow
def test_nuts_agrees(posterior: Posterior) -> None:
    from fibrefit.sampling.nuts import cross_check

    other = cross_check(posterior)
    assert other.divergent == 0
    assert other.agrees, other.scores
    # Of 800 draws, correlated.
    np.testing.assert_allclose(other.spread, 1.0, atol=0.2)


@pytest.mark.slow
def test_readings_of_a_draw_are_the_problems_own(posterior: Posterior) -> None:
    problem: Problem = posterior.density.problem
    point = posterior.thinned(1)[0]
    values = posterior.density.values(jnp.asarray(point))[: problem.layout.size]
    one = predict(posterior, 1, 0)["force"].model[1]
    said = problem.predict(problem.layout.local(values), problem.observations.experiment)
    np.testing.assert_allclose(one, said["force"], rtol=1e-9)


def test_nuts_without_its_package_says_what_to_install(posterior: Posterior, monkeypatch: pytest.MonkeyPatch) -> None:
    from fibrefit.sampling.nuts import cross_check

    monkeypatch.setitem(sys.modules, "blackjax", None)
    with pytest.raises(UsageError, match=r"Install it: pip install 'fibrefit\[nuts\]'"):
        cross_check(posterior)


def test_what_is_left_is_told_in_units_of_the_channel() -> None:
    """So many times the noise as residuals are in units of it; a channel that nobody measured tells nothing."""
    weight = {"force": np.array([[2.0, 2.0, 0.0], [1.0, 0.5, 0.5]]), "position": np.full((2, 3), 1e4)}
    rig = SimpleNamespace(channels=tuple(weight))
    problem = SimpleNamespace(observations=SimpleNamespace(weight=weight), model=SimpleNamespace(rig=rig))
    ready = SimpleNamespace(density=SimpleNamespace(problem=problem), ratio=np.array([1.5, 1.0]))
    task = SimpleNamespace(problem=problem, units={"force": "N", "position": "m"})
    found = _gap(cast(Any, task), cast(Any, ready))
    noise = np.sqrt((2 * 0.5**2 + 3 * 1.0**2) / 5)
    assert found["force"] == ChannelGap.against_noise(noise, 1.5 * noise, "N")
    assert (found["position"].rms, found["position"].unit) == (pytest.approx(1e-4), "m")
