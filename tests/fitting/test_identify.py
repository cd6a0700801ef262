"""Identification from start to verdict, on records whose truth is known."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fibrefit.core.errors import DataError
from fibrefit.fitting.identify import How, identify
from fibrefit.fitting.result import Identification, total
from fibrefit.fitting.search.solve import gram_at
from fibrefit.problem.task import Task
from fibrefit.report.sentences.fit import fit_sentence
from tests.fitting import made

FAR = 4.0
"""Standard errors beyond which an estimate is wrong: one in fifteen thousand."""


def passed(found: Identification) -> dict[str, bool]:
    return {check.name: check.passed for check in found.checks}


def errors(found: Identification) -> dict[str, float]:
    """Errors of the shared parameters in standard errors."""
    return {n: (e.value - made.TRUTH[n]) / e.std_error for n, e in found.parameters.items()}


def test_the_truth_is_found_and_the_verdict_is_ok(found: Identification) -> None:
    assert all(abs(error) < FAR for error in errors(found).values())
    for name, estimate in found.parameters.items():
        assert estimate.value == pytest.approx(made.TRUTH[name], rel=0.01)
        assert estimate.interval_95[0] < estimate.value < estimate.interval_95[1]
    assert total(found.gap) == pytest.approx(1.0, abs=0.08)
    assert found.status == "ok", [fit_sentence(check) for check in found.checks if not check.passed]


def test_what_each_record_has_for_itself_is_found_too(found: Identification) -> None:
    own = [estimate for estimate in found.estimates if estimate.record is not None]
    assert {(e.name, e.record) for e in own} == {
        (name, f"drop_{1e3 * lift:g}mm.csv") for name in made.NUISANCES for lift in made.LIFTS
    }
    for name, _, told in own:
        assert abs(told.value - made.NUISANCES[name]) < FAR * told.std_error


def test_all_starts_and_the_other_solver_agree(found: Identification) -> None:
    assert found.starts.tried == made.STARTS
    assert found.starts.agreeing == made.STARTS
    assert passed(found)["a second solver agrees"]
    assert found.starts.cost.min() == pytest.approx(gram_at(found.problem, found.plain.values)[-1, -1], rel=1e-6)


def test_the_same_seed_gives_the_same_numbers_and_another_one_the_same_minimum(
    task: Task, found: Identification
) -> None:
    again, other = identify(task, starts=made.STARTS), identify(task, starts=made.STARTS, seed=1)
    np.testing.assert_array_equal(again.values, found.values)
    np.testing.assert_array_equal(again.covariance, found.covariance)
    assert not np.array_equal(other.starts.began, found.starts.began)
    distance = (other.values - found.values) / np.sqrt(np.diag(found.covariance))
    assert np.abs(distance).max() < 0.01


def test_a_number_of_starts_that_is_no_multiple_of_a_chunk_is_kept(task: Task) -> None:
    some = identify(task, starts=made.STARTS + 3)
    assert some.starts.tried == made.STARTS + 3
    assert len(some.starts.values) == len(some.starts.basin) == made.STARTS + 3


def test_progress_is_told_in_order_and_ends_below_one(task: Task) -> None:
    told: list[tuple[str, float | None]] = []
    identify(task, starts=made.STARTS, progress=lambda what, share: told.append((what, share)))
    shares = [share for _, share in told if share is not None]
    assert shares == sorted(shares)
    assert shares[-1] <= 1.0
    assert {"searching from many starts", "second solver", "uncertainty"} <= {what for what, _ in told}


def with_nan(one: made.Made, channel: str, where: np.ndarray | slice) -> made.Made:
    values = one.channels[channel].copy()
    values[where] = np.nan
    return made.replace(one, **{channel: values})


def torn(one: made.Made) -> made.Made:
    """Forty samples are missing altogether."""
    keep = np.r_[0:500, 540 : one.time.size]
    channels = {name: values[keep] for name, values in one.channels.items()}
    return dataclasses.replace(one, time=one.time[keep], channels=channels)


DAMAGE: dict[str, Callable[[made.Made], made.Made]] = {
    "a gap in the middle": lambda r: with_nan(with_nan(r, "force", slice(400, 460)), "position", slice(400, 460)),
    "peaks saturated and masked": lambda r: with_nan(r, "force", r.channels["force"] > 60.0),
    "rows missing": torn,
    "bad tokens in the rest": lambda r: with_nan(with_nan(r, "position", slice(50, 60)), "force", slice(10, 11)),
    "a hole in the fall": lambda r: with_nan(r, "position", slice(270, 290)),
}


OFTEN = ("a gap in the middle", "peaks saturated and masked", "rows missing")


@pytest.mark.parametrize(
    "damage", [pytest.param(name, marks=() if name in OFTEN else pytest.mark.slow) for name in DAMAGE]
)
def test_masked_samples_do_not_disturb_the_fit(tmp_path: Path, found: Identification, damage: str) -> None:
    records = [DAMAGE[damage](one) for one in made.records(share=0.5, seed=3)]
    hurt = identify(made.task(tmp_path, records), starts=made.STARTS)
    assert hurt.status == "ok", [fit_sentence(check) for check in hurt.checks if not check.passed]
    assert all(abs(error) < FAR for error in errors(hurt).values())
    # What the masked samples knew is lost, and no more than that.
    for name, estimate in hurt.parameters.items():
        whole = found.parameters[name]
        assert abs(estimate.value - whole.value) < 2.0 * whole.std_error
        assert estimate.std_error < 1.6 * whole.std_error


@pytest.mark.slow
def test_unmasked_saturation_is_not_taken_for_a_good_model(tmp_path: Path) -> None:
    """The control: the same peaks cut off but not masked."""
    records = [made.replace(r, force=np.minimum(r.channels["force"], 60.0)) for r in made.records(share=0.5, seed=3)]
    cut = identify(made.task(tmp_path, records), starts=made.STARTS)
    assert cut.status != "ok"
    assert not passed(cut)["the gap is noise"]
    assert "search" in [one.identifier for one in cut.advice]


@pytest.mark.slow
def test_a_robust_loss_lets_outliers_count_less(tmp_path: Path) -> None:
    random = np.random.default_rng(5)
    spiked = []
    for one in made.records(share=0.5, seed=3):
        force, where = one.channels["force"].copy(), random.choice(np.arange(300, 1000), 12, replace=False)
        force[where] += 40.0 * random.choice([-1.0, 1.0], 12)
        spiked.append(made.replace(one, force=force))
    task = made.task(tmp_path, spiked)
    plain, robust = (identify(task, made.STARTS, how=How(robust=robust)) for robust in (False, True))
    far = {name: np.linalg.norm(list(errors(f).values())) for name, f in (("plain", plain), ("robust", robust))}
    assert far["robust"] < 0.5 * far["plain"] or far["robust"] < 2.0
    distance = [abs(robust.parameters[n].value / made.TRUTH[n] - 1.0) for n in made.TRUTH]
    control = [abs(plain.parameters[n].value / made.TRUTH[n] - 1.0) for n in made.TRUTH]
    assert sum(distance) < 0.7 * sum(control)
    # It does not hide them: the gap is that of all samples.
    assert not passed(robust)["the gap is noise"]


def test_a_bound_that_excludes_the_truth_is_reported(tmp_path: Path) -> None:
    more = '[parameters.damping]\nbounds = ["0 N s/m", "20 N s/m"]'
    stopped = identify(made.task(tmp_path, made.records(share=0.5, seed=3), more=more), starts=made.STARTS)
    assert stopped.parameters["damping"].at_bound
    assert not stopped.parameters["stiffness"].at_bound
    assert stopped.parameters["damping"].interval_95[1] <= 20.0
    assert stopped.status == "suspect"
    says = next(fit_sentence(check) for check in stopped.checks if check.identifier == "bounds")
    assert says.startswith("damping stopped at the bound")


def test_a_model_that_cannot_be_simulated_at_all_is_refused(task: Task) -> None:
    broken = dataclasses.replace(task, start=np.where(np.arange(len(task.start)) == 4, np.nan, task.start))
    with pytest.raises(DataError, match="no start of the search can be simulated"):
        identify(broken, starts=made.STARTS)


def test_noise_the_study_states_is_believed(tmp_path: Path) -> None:
    more = '[noise]\nforce = "0.8 N"\nposition = "0.04 mm"'
    loud = made.task(tmp_path, made.records(share=0.5, seed=3), more=more)
    assert set(loud.noise_given) == {"force", "position"}
    stated = identify(loud, starts=made.STARTS)
    assert total(stated.gap) == pytest.approx(0.5, abs=0.05)
    assert passed(stated)["the noise is known"]
