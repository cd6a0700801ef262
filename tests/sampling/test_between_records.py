"""A posterior of records that differ: the same as the fit's own marginal likelihood, and wide enough."""

from __future__ import annotations

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.laws.guide.drag import QuadraticDrag, ViscousFriction
from fibrefit.problem.estimate.evidence import EXTENSION, SIGMA_LEVELS
from fibrefit.problem.linear_model.unknowns import FLAT
from fibrefit.problem.noise.rounding import steps_of
from fibrefit.problem.task import Task
from fibrefit.report.sentences.posterior import remark
from fibrefit.sampling import latent
from fibrefit.sampling import mode as searches
from fibrefit.sampling.density.log_posterior import noise_priors
from fibrefit.sampling.latent import records_at
from fibrefit.sampling.mode import Approximation, find_mode
from fibrefit.sampling.posterior import Posterior, PosteriorSetup
from fibrefit.sampling.sample import (
    ChainStart,
    PosteriorRequest,
    coordinates_of,
    prepare,
    sample_posterior,
)
from fibrefit.sampling.settings import AS_A_FIT, Settings
from tests.sampling.drops import NOISE, TRUTH, fitted, series, task_of

AWAY = 0.01 * np.array([-1.2, 0.3, 1.1, -0.5, 0.6])
FAR = 17.0
"""Times as far: a standard deviation of a sixth."""
LIFTS = (5e-3, 7e-3, 8e-3, 1e-2, 1.2e-2)
WIDTH = 0.2
"""Relative difference of two widths, one of which is that of a few hundred draws."""
SURE = 4.0
"""Monte-Carlo errors that an evidence may be off by."""
LAPLACE = 0.2
"""Nats that Laplace's method may be off by where it is open how much records differ: its terms are not normal."""
SERIES, HELD, MISSED = 20, 16, 10
"""Of twenty intervals of 95 % fewer than 16 hold in one case of 400; those of a density without deviations hold in no
more than half the cases."""
SETTINGS = Settings(seed=1, max_steps=150)


def differing_series(
    away: np.ndarray,
    samples: int = 400,
    seed: int = 7,
    share: float = 0.5,
    truth: dict[str, float] | None = None,
    effects: tuple = (),
) -> Task:
    """Drops whose fibres differ in stiffness; the task knows nothing of the effects."""
    random, traces = np.random.default_rng(seed), []
    for number, (lift, one) in enumerate(zip(LIFTS, away, strict=True)):
        values = {**(truth or {}), "stiffness": TRUTH["stiffness"] * float(np.exp(one))}
        trace = series(random, values, (lift,), samples, share, effects)[0]
        traces.append(trace._replace(name=f"drop {number}"))
    return task_of(traces, share)


def prepared(task: Task, noise: str = AS_A_FIT) -> PosteriorSetup:
    return prepare(task, ChainStart(fitted(task)), {}, PosteriorRequest(noise, settings=SETTINGS))


def mode_of(ready: PosteriorSetup, deviating: bool = True) -> Approximation:
    density = ready.density if deviating else replace(ready.density, random_effects=None)
    priors = ready.priors.each + noise_priors(ready.noise_model.likelihood)
    return find_mode(density, coordinates_of(density, ready.values), priors)[0]


@pytest.fixture(scope="module")
def ready() -> PosteriorSetup:
    return prepared(differing_series(AWAY))


@pytest.fixture(scope="module")
def posterior() -> Posterior:
    task = differing_series(AWAY)
    return sample_posterior(task, ChainStart(fitted(task)), PosteriorRequest(settings=SETTINGS))


@pytest.mark.slow
def test_intervals_of_records_that_differ_are_those_of_a_fit(ready: PosteriorSetup, posterior: Posterior) -> None:
    evidence = ready.deviations.evidence
    for index, name in enumerate(("stiffness", "damping", "friction")):
        low, high = np.exp(evidence.interval_95(index)) * evidence.mode.unknowns.reference[index]
        found = posterior.marginals[name]
        assert found.interval[1] - found.interval[0] == pytest.approx(high - low, rel=WIDTH), name
        assert abs(found.median - 0.5 * (low + high)) < WIDTH * (high - low), name
        assert found.interval[0] < TRUTH[name] < found.interval[1], name


@pytest.mark.slow
def test_how_much_they_differ_is_what_a_fit_says(ready: PosteriorSetup, posterior: Posterior) -> None:
    for name, expected in ready.deviations.evidence.between_records().items():
        found = posterior.between[name]
        assert found.agree == pytest.approx(expected.agree, abs=0.05), name
        assert found.sd == pytest.approx(expected.sd, rel=0.1, abs=1e-3), name
    assert posterior.between["stiffness"].agree < 1e-3
    assert 0.005 < posterior.between["stiffness"].sd < 0.02


@pytest.mark.slow
def test_the_bridge_finds_the_evidence_of_laplace(posterior: Posterior) -> None:
    mode = posterior.modes[0]
    assert mode.evidence.error < 0.05
    away = abs(mode.evidence.log_value - mode.approximation.log_evidence)
    assert away < SURE * mode.evidence.error + LAPLACE


@pytest.mark.slow
def test_what_slopes_promise_and_no_step_brings_is_no_evidence(
    ready: PosteriorSetup, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A search that takes no step: where it stands the density is lower, and so is what Laplace's method counts."""
    density, priors = ready.density, ready.priors.each + noise_priors(ready.noise_model.likelihood)
    top = mode_of(ready)
    monkeypatch.setattr(searches, "MOST_STEPS", 0)
    for side in (-1.0, 1.0):
        there, arrived = find_mode(density, top.centre + 0.4 * side * top.root[:, 0], priors)
        assert not arrived
        lower = top.log_density - there.log_density
        assert lower > 0.05
        assert top.log_evidence - there.log_evidence == pytest.approx(lower, rel=0.15)


@pytest.fixture(scope="module")
def apart() -> Task:
    """Fibres that differ by a sixth from record to record, beyond the levels that models are compared on."""
    return differing_series(FAR * AWAY)


def test_records_that_differ_much_are_integrated_as_far_as_a_fit_goes(apart: Task) -> None:
    seen = prepared(apart)
    evidence, effects = seen.deviations.evidence, seen.density.random_effects
    stiffness = effects.places.index(apart.problem.layout.free_names.index("stiffness"))
    assert evidence.grid.max(axis=0)[stiffness] == EXTENSION[-1]
    assert effects.sigma[:, stiffness].max() == EXTENSION[-1]
    weight = np.exp(effects.log_prior - effects.log_prior.max())
    known = seen.density.known_of_deviations(jnp.asarray(coordinates_of(seen.density, seen.values)))
    told = np.exp(np.asarray(known.logs) - float(known.logs.max()))
    likely = np.asarray(effects.sigma)[int(np.argmax(told)), stiffness]
    assert 0.08 <= likely <= EXTENSION[0]
    assert weight[np.argmax(effects.sigma[:, stiffness])] > 0.0
    assert [check.identifier for check in evidence.between_records_checks()] == ["between_records"]


@pytest.mark.slow
def test_intervals_of_records_that_differ_much_are_those_of_a_fit(apart: Task) -> None:
    found = sample_posterior(apart, ChainStart(fitted(apart)), PosteriorRequest(settings=SETTINGS))
    evidence = prepared(apart).deviations.evidence
    low, high = np.exp(evidence.interval_95(0)) * evidence.mode.unknowns.reference[0]
    interval = found.marginals["stiffness"].interval
    assert interval[1] - interval[0] == pytest.approx(high - low, rel=WIDTH)
    assert found.between["stiffness"].sd == pytest.approx(evidence.between_records()["stiffness"].sd, rel=0.1)
    assert found.between["stiffness"].interval_95[1] > SIGMA_LEVELS[-1]
    (check,) = (check for check in found.checks if check.identifier == "between_records")
    assert check.passed


@pytest.mark.slow
def test_draws_of_records_leave_noise_alone(posterior: Posterior) -> None:
    """The negative control: with the shared values alone more than noise is left."""
    density, points = posterior.density, posterior.thinned(20)

    def left(local: np.ndarray) -> float:
        rows = np.stack([np.asarray(density.problem.linearised_at(jnp.asarray(one)).residuals) for one in local])
        return float(np.sqrt(np.mean(rows**2)))

    assert left(records_at(density, points)) < 1.1
    assert left(records_at(replace(density, random_effects=None), points)) > 1.3


@pytest.mark.slow
def test_where_no_mode_with_deviations_is_reached_it_is_told_that_records_count_as_alike(posterior: Posterior) -> None:
    lost = replace(posterior, alike=True, density=replace(posterior.density, random_effects=None))
    assert "records_alike" in [one.identifier for one in lost.remarks]
    # The negative control: a posterior with deviations in it says nothing of the kind.
    assert "records_alike" not in [one.identifier for one in posterior.remarks]


@pytest.mark.slow
def test_errors_of_inputs_that_had_not_come_to_rest_are_told(posterior: Posterior) -> None:
    moving = replace(posterior, moving=0.3)
    (said,) = [one for one in moving.remarks if one.identifier == "inputs_moving"]
    assert "0.3 of their standard deviations" in remark(said)
    assert "inputs_moving" not in [one.identifier for one in posterior.remarks]


@pytest.mark.slow
def test_where_records_agree_nothing_widens(ready: PosteriorSetup) -> None:
    index = ready.target.names.index("stiffness")
    same = prepared(differing_series(np.zeros(5)))
    assert not same.deviations.found

    def sd(of: PosteriorSetup, deviating: bool) -> float:
        return float(np.sqrt(mode_of(of, deviating).covariance[index, index]))

    assert sd(same, True) < 1.1 * sd(same, False)
    assert sd(ready, True) > 5.0 * sd(ready, False)


@pytest.mark.slow
def test_plain_and_whitened_estimates_are_compared_record_by_record() -> None:
    """Records that differ set off no alarm; the negative control, viscous friction that the model lacks, does."""
    assert prepared(differing_series(AWAY, 1000)).hausman.chance > 0.01
    viscous = {"guide.viscous_friction.viscous_coefficient": 6.0}
    wrong = prepared(differing_series(AWAY, 1000, truth=viscous, effects=(ViscousFriction,)), "coloured")
    assert wrong.deviations.found
    assert wrong.hausman.chance < 1e-3


@pytest.mark.slow
def test_intervals_hold_only_where_the_density_knows_of_deviations(monkeypatch: pytest.MonkeyPatch) -> None:
    """Coverage of a population's mean over many series; the control leaves the deviations out of the density."""
    # One size of the grid for all, so that one program serves them.
    monkeypatch.setattr(latent, "ROWS", 1024)
    random = np.random.default_rng(11)
    held = {True: 0, False: 0}
    for number in range(SERIES):
        own = prepared(differing_series(0.01 * random.standard_normal(5), 300, seed=100 + number))
        index = own.target.names.index("stiffness")
        for deviating in held:
            found = mode_of(own, deviating)
            middle, spread = found.centre[index], np.sqrt(found.covariance[index, index])
            ends = np.stack([found.centre] * 2)
            ends[:, index] = middle + 1.96 * spread * np.array([-1.0, 1.0])
            low, high = own.target.values(ends)[:, index]
            held[deviating] += low < TRUTH["stiffness"] < high
    assert held[True] >= HELD, held
    assert held[False] <= MISSED, held


@pytest.mark.slow
def test_readings_in_coarse_steps_are_what_a_fit_takes_them_for(ready: PosteriorSetup) -> None:
    """As a fit: no level of the noise is unknown, and records do not differ for what rounding does to them."""
    steps = {"force": 1.5, "position": 5e-5}
    made = [
        trace._replace(channels={c: steps[c] * np.round(row / steps[c]) for c, row in trace.channels.items()})
        for trace in differing_series(np.zeros(5), share=0.0).traces
    ]
    task = task_of(made, 0.0)
    rms = {
        channel: np.full(len(made), np.hypot(NOISE[channel], size / np.sqrt(12.0))) for channel, size in steps.items()
    }
    coarse = replace(task, steps={channel: steps_of(made, channel, rms[channel]) for channel in steps})
    found = prepared(coarse)
    assert found.noise_model.likelihood.known == (True, True)
    assert not found.deviations.found
    before = {channel: float(step.noise[0]) for channel, step in found.density.problem.observations.steps.items()}
    assert before == pytest.approx(NOISE, rel=0.15)
    mode = mode_of(found)
    at = found.target.values(mode.centre[None])[0]
    for name, value in TRUTH.items():
        index = found.target.names.index(name)
        high = found.target.values((mode.centre + np.sqrt(np.diag(mode.covariance)))[None])[0]
        assert abs(at[index] - value) < SURE * abs(high[index] - at[index]), name


@pytest.mark.extra("blackjax")
@pytest.mark.slow
def test_nuts_finds_the_same_posterior(posterior: Posterior) -> None:
    from fibrefit.sampling.nuts import cross_check

    other = cross_check(posterior)
    assert other.agrees, other.scores
    # Of 800 draws, correlated.
    np.testing.assert_allclose(other.spread, 1.0, atol=0.25)


@pytest.mark.slow
def test_evidence_of_three_models_is_that_of_the_likelihood() -> None:
    """Base model, base with the effect that made the records, base with another: bridge, Laplace and the fit's own."""
    viscous = {"guide.viscous_friction.viscous_coefficient": 2.0}
    made = differing_series(AWAY, share=0.0, truth=viscous, effects=(ViscousFriction,))
    found = []
    for effects in ((), (ViscousFriction,), (QuadraticDrag,)):
        # Levels given and white: one density of the noise for all three.
        task = replace(task_of(list(made.traces), 0.0, effects), noise_given=("force", "position"))
        ready = prepared(task, "white")
        posterior = sample_posterior(
            task, ChainStart(ready.values), PosteriorRequest(noise="white", settings=Settings(seed=1, max_steps=400))
        )
        mode = posterior.modes[0]
        found.append((mode.evidence.log_value, mode.approximation.log_evidence, _of_fit(ready)))
        assert abs(found[-1][0] - found[-1][1]) < SURE * mode.evidence.error + LAPLACE, effects
    bridge, laplace, fit = np.array(found).T
    np.testing.assert_allclose(bridge - bridge[1], laplace - laplace[1], atol=0.3)
    np.testing.assert_allclose(bridge - bridge[1], fit - fit[1], atol=0.5)
    # The negative control: the evidence tells the models apart.
    assert bridge[1] > bridge[0] + 5.0


def _of_fit(ready: PosteriorSetup) -> float:
    """Evidence of the likelihood that fits share, with the posterior's priors in place of its flat ones."""
    evidence = ready.deviations.evidence
    unknowns, place = evidence.mode.unknowns, evidence.mode.place
    flat = -len(unknowns.shared) * (0.5 * np.log(2.0 * np.pi) + np.log(FLAT))
    priors = float(ready.priors.density.log_density(jnp.asarray(ready.values)))
    return evidence.log - flat + priors + float(np.sum(np.log(unknowns.slope(place.z))))
