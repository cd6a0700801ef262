"""The last step of a fit: the likelihood of the search, whitened, with records that may differ."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fibrefit.core.limits import time_limit
from fibrefit.fitting import identify as last_step
from fibrefit.fitting.evaluated import EvaluatedEstimate, How
from fibrefit.fitting.gls import cost_with_one_held, error_of_objective
from fibrefit.fitting.identify import identify
from fibrefit.fitting.result import Identification, total
from fibrefit.fitting.search.optimum import Ended
from fibrefit.laws.guide.drag import ViscousFriction
from fibrefit.problem.noise.whitening import innovations
from fibrefit.problem.task import Task
from fibrefit.report.sentences.fit import estimator_sentence
from fibrefit.study.summaries.check import Check
from tests.fitting import made

VAGUE = "viscous_coefficient"
STIFFNESSES = [made.TRUTH["stiffness"] * np.exp(away) for away in (-0.03, 0.01, 0.02)]


def fitted(
    folder: Path, more: str = "", robust: bool = False, profile: bool = False, **made_of: object
) -> Identification:
    options = {"share": 0.5, "seed": 3, **made_of}
    return identify(made.task(folder, made.records(**options), more=more), starts=1, how=How(robust, profile))


def test_where_noise_wanders_the_estimate_is_whitened_and_surer(found: Identification) -> None:
    assert found.estimator == "generalised least squares"
    assert estimator_sentence(found.why).startswith("Generalised least squares (GLS, residuals pre-whitened")
    for name, estimate in found.parameters.items():
        assert abs(estimate.value - estimate.plain_value) < 3.0 * estimate.plain_error
        assert estimate.std_errors["alike"] < estimate.plain_error, name
        assert estimate.std_errors["alike"] <= estimate.std_error * (1.0 + 1e-9)
        assert set(estimate.std_errors) == {"white", "alike", "whitened"}
        assert estimate.interval_95[0] < made.TRUTH[name] < estimate.interval_95[1]
    check = next(check for check in found.checks if check.name == "plain and whitened estimates agree")
    assert check.passed


def test_what_is_white_has_no_memory_left(found: Identification) -> None:
    fresh, before = np.asarray(innovations(found.gls.seen.whitening, found.gls.residuals)), found.residuals
    for channel in range(2):
        # 2000 samples: a correlation of two samples scatters by 0.02.
        assert abs(_correlation(fresh[:, channel])) < 0.08
        assert _correlation(before[:, channel]) > 0.1


def _correlation(rows: np.ndarray) -> float:
    """Of means of four samples with the next ones."""
    means = rows[:, : rows.shape[1] // 4 * 4].reshape(len(rows), -1, 4).mean(axis=2)
    return float(np.sum(means[:, 1:] * means[:, :-1]) / np.sum(means**2))


def test_a_profile_of_the_objective_is_its_normal_interval(task: Task, found: Identification) -> None:
    index = task.problem.layout.free_names.index("damping")
    unknowns, evidence = found.gls.evidence.mode.unknowns, found.gls.evidence
    place = unknowns.names.index("damping")
    which = int(np.argmin(np.abs(evidence.grid - evidence.mode.sigma).sum(axis=1)))
    error = np.sqrt(evidence.covariance[which, place, place])
    assert error_of_objective(found.gls, index) == pytest.approx(error * evidence.mode.values[place], rel=1e-6)
    cost = cost_with_one_held(found.gls, index)
    for sign in (-1.0, 1.0):
        moved = found.values.copy()
        moved[index] = evidence.mode.values[place] * np.exp(2.0 * sign * error)
        # Two standard errors raise a sum of squares by four.
        assert cost(moved) - evidence.mode.objective == pytest.approx(4.0, rel=0.1)


@pytest.fixture(scope="module")
def differing(tmp_path_factory: pytest.TempPathFactory) -> Task:
    """Drops of 3 % stiffer and softer fibres; the other parameters are the same."""
    lifts = (5e-3, 1e-2, 7e-3)
    records = [
        made.record(f"drop_{i}.csv", lift, seed=i, share=0.5, stiffness=each)
        for i, (lift, each) in enumerate(zip(lifts, STIFFNESSES, strict=True))
    ]
    return made.task(tmp_path_factory.mktemp("differing"), records, lifts=lifts)


def test_records_that_differ_are_told(differing: Task) -> None:
    found = identify(differing, starts=1)
    assert found.estimator == "generalised least squares"
    assert all(check.passed for check in found.checks if check.name != "the best minimum was found")
    between = found.between["stiffness"]
    assert between.agree < 1e-6
    assert 0.01 < between.sd < 0.06
    assert between.interval_95[0] < np.std([-0.03, 0.01, 0.02], ddof=1) < between.interval_95[1]
    estimate = found.parameters["stiffness"]
    assert estimate.interval_kind == "population"
    assert {one.found.interval_kind for one in found.estimates if one.record is not None} == {"record"}
    # Three records: the mean is known to half their spread and worse, and plain least squares does not know that.
    assert estimate.std_error > 0.5 * between.sd * estimate.value > 3.0 * estimate.std_errors["white"]
    place = found.gls.evidence.mode.unknowns.names.index("stiffness")
    eta = found.gls.local[:, found.problem.layout.names.index("stiffness")]
    assert place == 0
    np.testing.assert_allclose(eta, STIFFNESSES, rtol=2e-3)


def test_where_no_time_is_left_for_records_that_differ_a_search_is_told_as_it_ended(differing: Task) -> None:
    """Values that all share lose bounces, and would be called noise of twice its size."""
    local = np.asarray(differing.problem.layout.local(differing.start)).copy()
    names = differing.problem.layout.names
    for name, value in {**made.TRUTH, **made.NUISANCES, "stiffness": np.array(STIFFNESSES)}.items():
        local[:, names.index(name)] = value
    there = dataclasses.replace(differing, start=differing.problem.layout.means_of(local))

    def left(differ: bool) -> float:
        with time_limit(0.0):
            found = identify(there, 1, 0, How(ended=Ended(local, differ, {})))
        assert (found.gls, found.why.identifier) == (None, "no_time")
        return total(found.gap)

    assert left(True) < 1.1
    assert left(False) > 2.0


@pytest.mark.slow
def test_missing_physics_keeps_the_plain_estimate(tmp_path: Path) -> None:
    missing = {"effects": (ViscousFriction,), f"guide__viscous_friction__{VAGUE}": 2.0}
    found = fitted(tmp_path, **missing)
    failed = {check.identifier: check.about for check in found.checks if not check.passed}
    # The model lacks something and says so; both records ask for the same values, and most of the signal is explained.
    assert failed["residual_size"] == "model"
    assert found.status == ("suspect" if "numbers" in failed.values() else "ok")
    assert found.estimator == "ordinary least squares"
    assert estimator_sentence(found.why).startswith(
        "Ordinary least squares (OLS), no GLS step: residuals are not noise"
    )
    assert found.between == {}


@pytest.mark.parametrize(
    ("own", "alike", "stands"),
    [
        ("size structure", "", True),
        ("structure", "", True),  # noise a little louder than at rest
        ("size", "", True),  # a spectrum that is not quite right
        ("", "", False),  # a model that lacks something, whichever values it has
        ("structure", "structure", False),
        ("size", "size", False),
    ],
)
def test_values_of_each_record_stand_where_they_leave_noise_and_shared_ones_do_not(
    own: str, alike: str, stands: bool
) -> None:
    def left(passed: str) -> Any:
        return SimpleNamespace(passed=lambda identifier: "size" in passed, like_noise="structure" in passed)

    assert EvaluatedEstimate.is_noise_unlike(left(own), left(alike)) is stands


@pytest.mark.slow
def test_a_robust_fit_stays_plain_and_one_that_a_bound_stops_is_told(tmp_path: Path) -> None:
    assert "a robust (soft-L1) loss was requested" in estimator_sentence(fitted(tmp_path / "robust", robust=True).why)
    stopped = fitted(tmp_path / "bound", '[parameters.damping]\nbounds = ["0 N s/m", "20 N s/m"]')
    assert stopped.status == "suspect"
    assert [estimate.name for estimate in stopped.estimates if estimate.found.at_bound] == ["damping"]
    (bound,) = (check for check in stopped.checks if check.quantity == "distance of the parameters from their bounds")
    assert not bound.passed


def test_where_both_estimates_part_the_plain_one_stands(
    task: Task, found: Identification, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same records, and a comparison that finds them apart."""
    hausman_test = Check(
        name="the estimates agree", passed=False, statistic=1e-6, threshold=1e-3, quantity="Hausman test"
    )
    monkeypatch.setattr(last_step.HausmanTest, "check", lambda found, names: hausman_test)
    again = identify(task, starts=1)
    assert again.estimator == "ordinary least squares"
    assert "(failed: Hausman test)" in estimator_sentence(again.why)
    assert hausman_test in again.checks
    assert again.status == "suspect"
    assert again.gls is None
    np.testing.assert_allclose(again.values, found.plain.values, rtol=1e-6)


def test_a_mode_that_is_not_reached_keeps_the_plain_one(task: Task, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(last_step, "gls_estimate", lambda *_: None)
    kept = identify(task, starts=1)
    assert estimator_sentence(kept.why) == "Ordinary least squares (OLS), no GLS step: it did not converge."
    assert kept.status == "ok" or all(
        check.passed for check in kept.checks if check.name != "the best minimum was found"
    )


@pytest.mark.parametrize(("predicted", "kept"), [(0.04, True), (0.2, False)])
def test_a_mode_short_of_which_a_step_would_gain_is_not_taken_for_one(
    task: Task, found: Identification, monkeypatch: pytest.MonkeyPatch, predicted: float, kept: bool
) -> None:
    assert found.gls is not None
    short = dataclasses.replace(
        found.gls.evidence, mode=dataclasses.replace(found.gls.evidence.mode, predicted_reduction=predicted)
    )
    stand_in = dataclasses.replace(found.gls, evidence=short)
    monkeypatch.setattr(last_step, "gls_estimate", lambda *_: stand_in)
    again = identify(task, starts=1)
    assert (again.estimator == "generalised least squares") == kept
    assert kept or "Its search did not quite come to its end." in estimator_sentence(again.why)


@pytest.mark.parametrize("kind", [pytest.param("hum", marks=pytest.mark.slow), "slow"])
def test_noise_of_other_kinds_is_noise(tmp_path: Path, kind: str) -> None:
    records = []
    for i, lift in enumerate(made.LIFTS):
        one = made.record(f"drop_{i}.csv", lift, seed=10 + i, samples=2000)
        records.append(
            dataclasses.replace(one, channels={c: v + _more(kind, c, one.time, i) for c, v in one.channels.items()})
        )
    found = identify(made.task(tmp_path, records), starts=2)
    assert [check.name for check in found.checks if not check.passed] == []
    assert found.estimator == "generalised least squares"


def _more(kind: str, channel: str, time: np.ndarray, seed: int) -> np.ndarray:
    """A mains hum, or noise whose memory is that of 8 Hz."""
    random, size = np.random.default_rng([seed, len(channel)]), made.NOISE[channel]
    if kind == "hum":
        tones = [np.sin(2.0 * np.pi * (f * time + random.random())) for f in (50.1, 150.3)]
        return size * (0.7 * tones[0] + 0.35 * tones[1])
    decay, slow = np.exp(-2.0 * np.pi * 8.0 / made.RATE), np.zeros(len(time) + 1)
    slow[0] = random.standard_normal()
    for t in range(len(time)):
        slow[t + 1] = decay * slow[t] + np.sqrt(1.0 - decay**2) * random.standard_normal()
    return 0.5 * size * slow[1:]
