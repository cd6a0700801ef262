"""Values of each record: what is paid for them and for what records share beside them, and what errors they have."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.search import inputs
from fibrefit.laws.functions_of_speed import DampingSpeedExponent
from fibrefit.problem.estimate.evidence import MarginalLikelihood, laplace_evidence
from fibrefit.problem.estimate.gauss_newton import mode
from fibrefit.problem.linear_model.normal_equations import PosteriorMode
from fibrefit.problem.linear_model.unknowns import Unknowns
from fibrefit.series import speed_models as models
from fibrefit.series.meta_analysis import population
from fibrefit.series.speed_models import own_evidence, own_values_about, with_counted_gain
from tests.problem.toys import REFERENCE, SIZE, BareMode, Linear, begun, unknowns

EXACT = 1e-4
"""Nats: differences are good to six digits of a sum of squares of a few hundred."""
FLAT = 1e3
"""Standard deviation of a nuisance that stands for an infinite one."""
TRUTH = np.array([0.3, -0.2, 0.5])
RECORDS = 4


def with_own_stiffness() -> Unknowns:
    """Each record with a stiffness of its own, damping and a strength shared."""
    of = replace(unknowns((0,), RECORDS), precision=np.diag([1.0, 2.0, 4.0]))
    lower, upper = of.lower.copy(), of.upper.copy()
    lower[0] = upper[0] = 0.0
    return replace(of, lower=lower, upper=upper)


def own_mode(linear: Linear) -> PosteriorMode:
    of = with_own_stiffness()
    return mode(of, begun(of), linear.gram, np.ones(1), 1e-9)


def exact(linear: Linear, kept: list[int]) -> float:
    """Logarithm of the density of some records, on the scale of `MarginalLikelihood.log`."""
    of, size = with_own_stiffness(), 2 + 3 * len(kept)
    design, prior = np.zeros((len(kept), SIZE, size)), np.zeros(size)
    prior[:2] = 1.0 / np.diag(of.precision)[1:]
    design[:, :, :2] = linear.slopes[kept, :, 1:3]
    for i, r in enumerate(kept):
        here = slice(2 + 3 * i, 5 + 3 * i)
        design[i, :, here], prior[here] = linear.slopes[r][:, [3, 4, 0]], (FLAT**2, FLAT**2, 1.0)
    flat = design.reshape(-1, size)
    factor = np.linalg.cholesky(flat * prior @ flat.T + np.eye(len(flat)))
    left = np.linalg.solve(factor, linear.measured[kept].ravel() - flat[:, :2] @ of.mean[1:])
    return float(-0.5 * left @ left - np.log(np.diag(factor)).sum() + 2 * len(kept) * np.log(FLAT))


def test_what_records_share_beside_their_own_values_is_paid_for() -> None:
    """By its prior and its determinant, as in the other models; of linear records the evidence is known."""
    linear = Linear.drawn(1, TRUTH, scatter=0.5)
    found = own_evidence(own_mode(linear))
    assert found.log == pytest.approx(exact(linear, list(range(RECORDS))), abs=EXACT)
    assert found.spread[0].tolist() == [0.0, 0.0, 0.0]
    # The negative control: of the records' own blocks alone it would be some nats more.
    blocks = found.mode.normal.blocks + np.diag([0.0, 0.0, 1.0])
    unpaid = -0.5 * (found.mode.objective + np.linalg.slogdet(blocks)[1].sum())
    assert unpaid > found.log + 2.0


def test_what_is_said_of_a_record_left_out_is_the_difference_of_two_evidences(monkeypatch: pytest.MonkeyPatch) -> None:
    linear = Linear.drawn(2, TRUTH, scatter=0.5)
    at = own_mode(linear)
    own = LaplaceFit((), cast(Any, None), own_evidence(at))
    seen = SimpleNamespace(grams=lambda local, columns, targets, counts: linear.gram(local, columns, targets))
    noise = SimpleNamespace(whitened=lambda supermodel: seen)
    search = SimpleNamespace(context=SimpleNamespace(whole=None), inference=SimpleNamespace(common_noise=noise))
    monkeypatch.setattr(models, "gap_of_record", lambda *of: 1.0)
    said = models.own_left_out(cast(Any, search), own).elpd
    every = list(range(RECORDS))
    wanted = [exact(linear, every) - exact(linear, [s for s in every if s != r]) for r in every]
    # Up to what a record without readings leaves of its nuisances, which is alike in all models and records.
    assert np.ptp(said - np.array(wanted)) < EXACT
    assert np.ptp(wanted) > 1.0


def joint(asks: np.ndarray, errors: np.ndarray, prior: float) -> tuple[MarginalLikelihood, np.ndarray]:
    """Records that tell ln stiffness - asks times ln mass to their errors, the mass by its prior alone."""
    of = replace(unknowns((0,), len(asks)), precision=np.diag([1e-6, prior**-2.0, 4.0]))
    slopes = np.zeros((len(asks), SIZE, 5))
    slopes[:, 0, 0], slopes[:, 0, 1] = 1.0 / errors, -asks / errors
    slopes[:, 1, 2] = slopes[:, 2, 3] = slopes[:, 3, 4] = 1.0
    truth = np.random.default_rng(3).standard_normal(len(asks)) * errors
    measured = np.zeros((len(asks), SIZE))
    measured[:, 0] = truth / errors
    found = laplace_evidence(of, begun(of, records=len(asks)), Linear(slopes, measured).gram, tolerance=1e-9)
    return found, truth


def test_a_prior_of_what_records_share_is_an_error_of_their_mean() -> None:
    """Free decay with a mass known to 5 %: frequencies known to 0.1 % leave 5 % of the mean of the stiffness."""
    errors = np.array([1e-3, 2e-3, 1e-3, 1e-3, 2e-3, 1e-3])
    found, _ = joint(np.ones(6), errors, 0.05)
    own = own_values_about(found)
    np.testing.assert_allclose(own.errors[:, 0], errors * own.values[:, 0], rtol=1e-4)
    assert own.common[0] == pytest.approx(0.05 * np.median(own.values), rel=1e-4)
    told, untold = (population(own.values[:, 0], own.errors[:, 0], one) for one in (float(own.common[0]), 0.0))
    assert told is not None
    assert untold is not None
    half = 0.5 * (told.mean_interval[1] - told.mean_interval[0]) / told.mean
    assert half == pytest.approx(1.96 * 0.05, rel=0.02)
    # What records differ by is not blurred by it; and the negative control, which is what the mean was told to.
    assert told.sd_interval == untold.sd_interval
    assert untold.mean_interval[1] - untold.mean_interval[0] < 0.05 * (told.mean_interval[1] - told.mean_interval[0])


def test_what_records_ask_for_differently_is_an_error_of_each() -> None:
    """As an exponent does to values at one speed of records that were taken at others."""
    asks, errors = np.array([-1.0, -0.2, 0.4, 1.0, 2.0]), np.array([1e-3, 2e-3, 1e-3, 4e-3, 1e-3])
    found, _ = joint(asks, errors, 0.05)
    own, sd = own_values_about(found), np.sqrt(found.spread[1, 1])
    mean = np.average(asks, weights=errors**-2.0)
    relative = np.hypot(errors, (asks - mean) * sd)
    np.testing.assert_allclose(own.errors[:, 0] / own.values[:, 0], relative, rtol=1e-4)
    assert own.common[0] == pytest.approx(abs(mean) * sd * np.median(own.values), rel=1e-4)


def test_what_the_records_alone_tell_has_no_common_error() -> None:
    found, truth = joint(np.zeros(4), np.full(4, 1e-3), 0.05)
    own = own_values_about(found)
    assert own.common[0] == pytest.approx(0.0, abs=1e-6 * REFERENCE[0])
    np.testing.assert_allclose(own.values[:, 0], REFERENCE[0] * np.exp(truth), rtol=1e-5)


def fitted(effects: tuple, log: float, *costs: float) -> LaplaceFit:
    """A model by its evidence and the sum of squares that it leaves of each record; nothing is paid for parameters."""
    at = BareMode(
        normal=SimpleNamespace(costs=np.array(costs)),
        place=SimpleNamespace(eta=np.zeros((len(costs), 0))),
        sigma=np.zeros(0),
        objective=-2.0 * log,
    )
    evidence = MarginalLikelihood(cast(Any, at), log, *(np.zeros(0) for _ in range(5)))
    return LaplaceFit(effects, cast(Any, None), evidence)


LAW = (DampingSpeedExponent,)
HALVING: Any = SimpleNamespace(overdispersion=lambda parent, one, names: 2.0)
"""Inference in whose noise scores scatter twice as much as they should."""


@pytest.mark.parametrize(("gain", "left"), [(8.0, 4.0), (60.0, 30.0), (-3.0, -3.0), (150.0, 150.0)])
def test_the_gain_of_a_law_counts_as_in_a_search(gain: float, left: float) -> None:
    constant, law = fitted((), -1000.0, 0.0), fitted(LAW, gain - 1000.0, 0.0)
    assert with_counted_gain(HALVING, constant, law).log - constant.log == pytest.approx(left)


def test_a_law_that_a_record_objects_to_gains_nothing() -> None:
    constant, law = fitted((), 0.0, 100.0, 100.0), fitted(LAW, 50.0, 140.0, 20.0)
    assert with_counted_gain(HALVING, constant, law).log == 0.0


def test_values_of_each_record_are_held_against_a_law_in_the_same_scores() -> None:
    """Of 60 nats of the law and 10 more of each record's own values half are left, of both."""
    constant, law, own = fitted((), 0.0, 0.0), fitted(LAW, 60.0, 0.0), fitted((), 70.0, 0.0)
    law = with_counted_gain(HALVING, constant, law)
    own = with_counted_gain(HALVING, law, own)
    assert (law.log, own.log, own.undivided.log) == pytest.approx((30.0, 35.0, 70.0))


def test_a_law_that_was_taken_counts_by_what_its_scores_leave(monkeypatch: pytest.MonkeyPatch) -> None:
    """The next round fits it anew, by which what an overdispersion took off is lost."""
    constant, law, own = fitted((), 0.0, 0.0), fitted(LAW, 12.0, 0.0), fitted((), 14.0, 0.0)
    search: Any = SimpleNamespace(inference=HALVING)
    steps = {
        "laws_on": lambda rig: (),
        "identify": lambda *of, **options: None,
        "prepared_search": lambda *of: (search, constant),
        "_grown": lambda *of: ([SimpleNamespace(search=search, parent=constant, found=())], law, ()),
        "own_values": lambda *of: own,
    }
    for name, step in steps.items():
        monkeypatch.setattr(models, name, step)
    task: Any = SimpleNamespace(problem=SimpleNamespace(model=SimpleNamespace(rig=None)))
    found = models.three_models(task)
    assert (found.law.log, found.own.log) == pytest.approx((6.0, 7.0))
    # The negative control: scores that scatter as they should take nothing off.
    monkeypatch.setattr(inputs, "BEYOND_DOUBT", 0.0)
    assert models.three_models(task).law.log == pytest.approx(12.0)
