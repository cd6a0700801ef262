"""A posterior of a rig whose drive was measured: errors of the drive and differences between records integrated out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.fitting.identify import identify
from fibrefit.fitting.result import Identification
from fibrefit.problem.noise.whitening import innovations
from fibrefit.problem.task import Task
from fibrefit.sampling.density.log_posterior import LogPosterior, noise_priors
from fibrefit.sampling.latent import between_of, records_at, whitened_residuals
from fibrefit.sampling.mode import Approximation, find_mode
from fibrefit.sampling.posterior import Posterior, PosteriorSetup
from fibrefit.sampling.predict import cross_validate, predict
from fibrefit.sampling.sample import (
    ChainStart,
    PosteriorRequest,
    coordinates_of,
    prepare,
    sample_posterior,
)
from fibrefit.sampling.settings import Settings
from fibrefit.study import load_study
from fibrefit.workflow.prepare import task_of, task_to_fit
from tests.independent.laws import DRIVE
from tests.independent.make import write_study
from tests.independent.sensors import USUAL
from tests.independent.series import Series, drive_plan, scattered, take
from tests.independent.simulate import FINE_STEP, Base

TRUTH = Base(14722.0, 32.89, 5.591)
SHARED = ("stiffness", "damping", "friction")
SURE = 4.0
"""Standard deviations that a value may be off by."""
NEAR = 0.5
"""The same between two ways to one value; the fit's is the mean over the grid, the walkers begin at the mode."""
WIDTH = 0.2
"""Relative difference of two widths, one of which is that of some hundred draws."""
LAPLACE = 0.3
"""Nats that Laplace's method may be off by with two records: how much they differ is open by a factor of ten."""
SETTINGS = Settings(seed=1, max_steps=800)


class Driven(NamedTuple):
    """Two records of a drive, their fit, and what a posterior knows before its first draw."""

    task: Task
    fit: Identification
    begin: ChainStart
    ready: PosteriorSetup


def driven(folder: Path, scatter: float) -> Driven:
    random = np.random.default_rng(5)
    plans = [
        drive_plan("trapezoid", 200, 80, False, random, 1.2),
        drive_plan("quasi_sine", 250, 50, True, random, 1.2),
    ]
    bases = [scattered(TRUTH, random, scatter) for _ in plans]
    rows = zip(plans, bases, strict=True)
    records = tuple(take(plan, base, {}, 0.0, USUAL, random, FINE_STEP) for plan, base in rows)
    write_study(Series(DRIVE, TRUTH, {}, records, records[0], None, 5), folder)
    study = load_study(folder, ['rig.weight_mass="3.1 +/- 0.05 kg"'])
    task = task_to_fit(study, task_of(study))
    fit = identify(task, 2, 0)
    begin = ChainStart(fit.plain.values, fit.coefficients)
    return Driven(task, fit, begin, prepare(task, begin, {}, PosteriorRequest(settings=SETTINGS)))


def mode_of(ready: PosteriorSetup, density: LogPosterior | None = None) -> Approximation:
    density = density or ready.density
    priors = ready.priors.each + noise_priors(ready.noise_model.likelihood)
    return find_mode(density, coordinates_of(density, ready.values), priors)[0]


def spread(found: Approximation, ready: PosteriorSetup) -> np.ndarray:
    """Standard deviations ``(n,)`` of the values at a mode, in SI units."""
    error = np.sqrt(np.diag(found.covariance))
    low, high = (ready.target.values((found.centre + side * error)[None])[0] for side in (-1.0, 1.0))
    return 0.5 * np.abs(high - low)


@pytest.fixture(scope="module")
def alike(tmp_path_factory: pytest.TempPathFactory) -> Driven:
    return driven(tmp_path_factory.mktemp("alike"), 0.0)


@pytest.fixture(scope="module")
def apart(tmp_path_factory: pytest.TempPathFactory) -> Driven:
    return driven(tmp_path_factory.mktemp("apart"), 0.01)


@pytest.fixture(scope="module")
def posterior(apart: Driven) -> Posterior:
    return sample_posterior(apart.task, apart.begin, PosteriorRequest(settings=SETTINGS))


@pytest.mark.slow
def test_records_that_are_alike_have_the_intervals_of_their_fit(alike: Driven) -> None:
    """No differences are told, and what was put in is found again."""
    fit, ready = alike.fit, alike.ready
    assert ready.deviations is not None
    assert ready.deviations.evidence is not None
    assert not ready.deviations.found
    assert min(one.agree for one in ready.deviations.evidence.between_records().values()) > 0.9
    # What little weight large differences have is in the tails of two records, which widen a normal approximation.
    found = mode_of(ready, replace(ready.density, random_effects=None))
    middle, error = ready.target.values(found.centre[None])[0], spread(found, ready)
    errors = np.sqrt(np.diag(fit.covariance))
    for i, name in enumerate(ready.density.problem.layout.free_names):
        assert abs(middle[i] - fit.values[i]) < NEAR * errors[i], name
        assert error[i] == pytest.approx(errors[i], rel=WIDTH), name
    for name in SHARED:
        i = ready.target.names.index(name)
        assert abs(middle[i] - getattr(TRUTH, name)) < SURE * error[i], name


@pytest.mark.slow
def test_errors_of_the_drive_widen_what_they_imitate(alike: Driven) -> None:
    """The negative control holds the drive as it is corrected: a tension at the start is three times too sure then."""
    ready = alike.ready
    same = replace(ready.density, random_effects=None)
    held = replace(same, inputs=None)
    index = next(i for i, name in enumerate(ready.target.names) if name.startswith("start_tension"))
    ratio = spread(mode_of(ready, same), ready)[index] / spread(mode_of(ready, held), ready)[index]
    assert ratio > 2.0


@pytest.mark.slow
def test_its_gradient_is_that_of_differences(apart: Driven) -> None:
    """NUTS follows it."""
    density, mode = apart.ready.density, mode_of(apart.ready)
    error = np.sqrt(np.diag(mode.covariance))
    point = mode.centre + 0.5 * error
    gradient = np.asarray(jax.jit(jax.grad(density))(jnp.asarray(point))) * error
    high, low = (apart.ready.target.log_density(point + side * 1e-3 * np.diag(error)) for side in (1.0, -1.0))
    np.testing.assert_allclose(gradient, (high - low) / 2e-3, rtol=1e-2, atol=1e-2)


@pytest.mark.slow
def test_records_that_differ_widen_what_they_share(apart: Driven) -> None:
    ready = apart.ready
    assert ready.deviations is not None
    assert ready.deviations.found
    same = replace(ready.density, random_effects=None)
    index = ready.target.names.index("stiffness")
    assert spread(mode_of(ready), ready)[index] > 3.0 * spread(mode_of(ready, same), ready)[index]


@pytest.mark.slow
def test_intervals_of_records_that_differ_are_those_of_a_fit(apart: Driven, posterior: Posterior) -> None:
    deviations = apart.ready.deviations
    assert deviations is not None
    assert deviations.found
    evidence = deviations.evidence
    assert evidence is not None
    weight = posterior.marginals["weight_mass"]
    assert abs(weight.mean - 3.096) < SURE * weight.sd
    for index, name in enumerate(SHARED):
        low, high = np.exp(evidence.interval_95(index)) * evidence.mode.unknowns.reference[index]
        found = posterior.marginals[name]
        assert found.interval[1] - found.interval[0] == pytest.approx(high - low, rel=2.0 * WIDTH), name
        assert abs(found.median - 0.5 * (low + high)) < WIDTH * (high - low), name
        assert found.interval[0] < getattr(TRUTH, name) < found.interval[1], name
        assert posterior.between[name].sd == pytest.approx(apart.fit.between[name].sd, rel=0.3), name


@pytest.mark.slow
def test_the_bridge_finds_the_evidence_of_laplace(posterior: Posterior) -> None:
    mode = posterior.modes[0]
    assert mode.evidence.error < 0.05
    assert abs(mode.evidence.log_value - mode.approximation.log_evidence) < SURE * mode.evidence.error + LAPLACE


@pytest.mark.slow
def test_what_bends_in_the_readings_costs_the_density_little(posterior: Posterior) -> None:
    """Errors follow the values along a line; at draws the best ones leave hardly less."""
    lost = bent(posterior, posterior.thinned(50))
    assert np.all(lost > -0.01)
    assert np.quantile(lost, 0.9) < 0.2
    # The negative control: errors that stay where they were best at the mode.
    inputs = posterior.density.inputs
    assert inputs is not None
    squares = jnp.zeros_like(inputs.squares).at[:, -1, -1].set(inputs.squares[:, -1, -1])
    held = replace(inputs, slopes=jnp.zeros_like(inputs.slopes), squares=squares)
    still = replace(posterior, density=replace(posterior.density, inputs=held))
    assert np.median(bent(still, posterior.thinned(50))) > 1.0


def bent(posterior: Posterior, points: np.ndarray) -> np.ndarray:
    """By how many nats the log density ``(n_point,)`` would be higher at the best errors of the inputs."""
    density, inputs, drawn = posterior.density, posterior.density.inputs, posterior.inputs
    assert inputs is not None
    assert drawn is not None
    assert drawn.seen.sensitivities is not None
    assert drawn.seen.raw is not None
    likelihood, local = density.likelihood, records_at(density, points)
    noise = jnp.log(jnp.asarray(drawn.spread))
    offset = np.asarray(drawn.seen.raw.offset).reshape(drawn.seen.raw.downweight.shape)
    zero = (
        np.array(whitened_residuals(density.problem, likelihood.whitening, jnp.asarray(local))) / drawn.spread[:, None]
    )
    zero += np.asarray(innovations(drawn.seen.whitening, offset))
    lost = []
    for rows, own in zip(zero, local, strict=True):
        left = np.asarray(density.innovations(jnp.asarray(own))) / drawn.spread[:, None]
        prior = -2.0 * float(inputs.log_density(likelihood, noise, jnp.asarray(own))) - float(inputs.log_det)
        flat = rows.reshape(len(rows), 1, -1)
        best = sum(
            float(np.sum(row**2)) - float(product @ record.inverse @ product)
            for record, row in zip(drawn.seen.sensitivities.records, flat, strict=True)
            for product in record.products(row)
        )
        lost.append(0.5 * (float(np.sum(left**2)) + prior - best))
    return np.array(lost)


@pytest.mark.slow
def test_records_are_covered_and_blocks_predicted(posterior: Posterior) -> None:
    for bands in predict(posterior).values():
        assert bands.covered == pytest.approx(0.9, abs=0.04)
    found = cross_validate(posterior)
    assert found.unreliable <= 0.1 * len(found.blocks)
    assert found.effective_parameters < 40.0


@pytest.mark.slow
def test_how_much_records_differ_is_told_of_the_draws(apart: Driven, posterior: Posterior) -> None:
    deviations = apart.ready.deviations
    assert deviations is not None
    told = between_of(posterior.density, deviations, posterior.thinned(100))
    assert set(told) == set(SHARED)
    assert any(one.found for one in told.values())


@pytest.mark.extra("blackjax")
@pytest.mark.slow
def test_nuts_finds_the_same_posterior(posterior: Posterior) -> None:
    from fibrefit.sampling.nuts import cross_check

    other = cross_check(posterior)
    assert other.agrees, other.scores
