"""Values at a bound: by chance, or because the records would have them beyond it."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fibrefit.fitting.checks import check as judge
from fibrefit.fitting.error_bars import error_bars, estimates
from fibrefit.fitting.thresholds import CHANCE
from fibrefit.fitting.uncertainty import ErrorBars, Scores
from fibrefit.fitting.values import AtBound, at_bounds, beyond_bounds, pulls_of_gls, pulls_of_plain, with_ends
from fibrefit.problem.estimate.evidence import MarginalLikelihood
from fibrefit.problem.linear_model.normal_equations import Arrowhead, PosteriorMode
from fibrefit.problem.linear_model.unknowns import Place, Unknowns
from fibrefit.problem.statement.layout import Layout, Range, Slot
from fibrefit.report.sentences.fit import fit_sentence
from fibrefit.study.summaries.check import Check

SAMPLES = 400
LAYOUT = Layout(
    (Slot("stiffness", "N/m", Range(-np.inf, np.inf, 1.0)), Slot("friction", "N", Range(0.0, np.inf, 1.0))), ("a.csv",)
)


PROBLEM: Any = SimpleNamespace(layout=LAYOUT, model=SimpleNamespace(pieces=None))
RATE = 1000.0


def slopes() -> np.ndarray:
    t = np.linspace(0.0, 1.0, SAMPLES)
    return np.stack([np.sin(7.0 * t) + 0.3, np.cos(3.0 * t)], axis=-1)


def fitted(truth: float, seed: int) -> tuple[np.ndarray, Scores, float]:
    """Least squares of a line with friction not below zero: values, scores there, and what friction would be else."""
    columns, random = slopes(), np.random.default_rng(seed)
    measured = columns @ [1.0, truth] + random.standard_normal(SAMPLES)
    free = np.linalg.lstsq(columns, measured, rcond=None)[0]
    values = free
    if free[1] < 0.0:
        values = np.array([columns[:, 0] @ measured / (columns[:, 0] @ columns[:, 0]), 0.0])
    left = columns @ values - measured
    scores = Scores(left[None, None], columns[None, None], np.array([SAMPLES]), np.array([[0, 1]]), 2)
    return values, scores, float(free[1])


def judged(truth: float, seed: int) -> tuple[Check, tuple[AtBound, ...], float, float]:
    values, scores, free = fitted(truth, seed)
    covariance = np.linalg.inv(scores.normal_matrix())
    found = estimates(PROBLEM, values, ErrorBars({"white": covariance}, "white"))
    places = at_bounds(LAYOUT, found, partial(pulls_of_plain, PROBLEM, scores, RATE))
    return judge("bounds", beyond_bounds(places)), places, free, float(np.sqrt(covariance[1, 1]))


def test_a_friction_that_truly_is_zero_is_not_said_to_be_stopped() -> None:
    """In half of all fits it lies at zero, and how far it would go beyond is chance: what the free fit finds there."""
    found = [judged(0.0, seed) for seed in range(300)]
    assert all(check.passed for check, *_ in found)
    stopped = [(places[0], free, error) for _, places, free, error in found if places]
    assert 0.4 < len(stopped) / 300 < 0.65
    for place, free, error in stopped:
        # In the errors of the residuals and the method that are believed beyond the bound.
        assert 0.4 < place.pull / max(-free / error, 1e-9) < 1.3 or free >= 0.0
        assert place.end == pytest.approx(max(free, 0.0) + 1.959964 * error, rel=1e-6)


def test_one_that_a_bound_stops_is() -> None:
    """The negative control: a truth six errors beyond the bound."""
    error = judged(0.0, 0)[3]
    found = [judged(-6.0 * error, seed)[0] for seed in range(100)]
    assert sum(not check.passed for check in found) > 95
    check = next(check for check in found if not check.passed)
    assert check.facts["parameters"] == ("friction",)
    assert check.statistic == pytest.approx(6.0, abs=3.0)
    assert fit_sentence(check).startswith("friction stopped at the bound: the data want a value beyond it, by")


def test_what_is_known_of_a_value_at_its_bound_is_told() -> None:
    near = AtBound("friction", "N", 0.0, 0.35, True, 1.2)
    check = judge("bounds", beyond_bounds((near,)))
    assert fit_sentence(check) == "friction is not distinguishable from 0 N, at most 0.35 N (95 %)."
    above = AtBound("damping[sub/Fall 10mm.csv]", "N s/m", 20.0, 18.5, False, 0.0)
    assert fit_sentence(judge("bounds", beyond_bounds((above,)))) == (
        'damping of "Fall 10mm" is not distinguishable from 20 N s/m, at least 18.5 N s/m (95 %).'
    )
    far = near._replace(name="damping[b.csv]", pull=8.0)
    assert fit_sentence(judge("bounds", beyond_bounds((near, far)))) == (
        'damping of "b" stopped at the bound: the data want a value beyond it, by 8 standard errors; chance explains '
        "3.3 at the most. The model or the bound is wrong. friction is not distinguishable from 0 N, at most 0.35 N "
        "(95 %)."
    )
    assert fit_sentence(judge("bounds", beyond_bounds(()))) == "No parameter lies at a bound."


def test_what_a_bound_keeps_from_being_explained_is_no_error_of_the_value() -> None:
    """A large misfit at the bound makes the errors there as large as the step: they are those beyond the bound."""
    _, scores, free = fitted(-3.0, 1)
    pull = -pulls_of_plain(PROBLEM, scores, RATE)[1]
    at_bound = error_bars(PROBLEM, scores, RATE)
    assert pull > 2.0 * -free / at_bound.errors[at_bound.method][1]
    assert pull > 20.0


def test_a_value_that_no_record_sees_is_stopped_by_nothing() -> None:
    blind = ErrorBars({"white": np.diag([1.0, np.inf])}, "white")
    found = estimates(PROBLEM, np.array([1.0, 0.0]), blind)
    (place,) = at_bounds(LAYOUT, found, lambda: np.zeros(2))
    assert (place.pull, place.end) == (0.0, np.inf)
    assert fit_sentence(judge("bounds", beyond_bounds((place,)))) == "friction is not distinguishable from 0 N."
    columns = slopes() * [1.0, 0.0]
    unseen = Scores(np.ones((1, 1, SAMPLES)), columns[None, None], np.array([SAMPLES]), np.array([[0, 1]]), 2)
    assert pulls_of_plain(PROBLEM, unseen, RATE)[1] == 0.0
    lost = replace(unseen, residuals=np.full((1, 1, SAMPLES), np.nan))
    np.testing.assert_array_equal(pulls_of_plain(PROBLEM, lost, RATE), np.zeros(2))


def likelihood(layout: Layout, values: np.ndarray, local: np.ndarray, left: list[np.ndarray]) -> Any:
    """A likelihood of white noise at a place, residuals of each record being known there."""
    unknowns, columns = Unknowns.of_fit(layout, values, np.full(2, 0.01)), slopes()
    # A record may deviate to beyond a bound, the value that all share may not.
    logs = np.log(np.maximum(local, 1e-9) / np.where(unknowns.log, unknowns.reference, 1.0))
    coordinates = np.where(unknowns.log, logs, (local - unknowns.reference) / unknowns.scale)
    z = np.clip(coordinates.mean(axis=0), unknowns.lower, unknowns.upper)
    place = Place(z, np.zeros((len(local), 0)), (coordinates - z)[:, unknowns.scattering], local)
    grams = []
    for own, residuals in zip(local, left, strict=True):
        slope = np.where(unknowns.log, own, unknowns.scale)
        rows = np.concatenate([columns * slope, residuals[:, None]], axis=1)
        grams.append(rows.T @ rows)
    sigma = np.full(len(unknowns.scattering), 0.08)
    mode = PosteriorMode(unknowns, place, Arrowhead.of(unknowns, np.stack(grams)), sigma, 0.0, 1)
    evidence = MarginalLikelihood.of(mode).extended()
    return SimpleNamespace(evidence=evidence, seen=SimpleNamespace(problem=SimpleNamespace(layout=layout)))


def test_the_pull_of_the_likelihood_is_that_of_its_normal_equations() -> None:
    values, scores, free = next(found for seed in range(20) if (found := fitted(0.0, seed))[2] < 0.0)
    gls = likelihood(LAYOUT, values, values[None], [scores.residuals[0, 0]])
    error = float(np.sqrt(np.linalg.inv(scores.normal_matrix())[1, 1]))
    # A flat prior of a thousand scales is felt in the last digits.
    assert pulls_of_gls(gls)[1] == pytest.approx(free / error, rel=1e-3)


def test_records_that_a_bound_keeps_from_their_common_value_do_not_hide_it() -> None:
    """Each deviates to the same value beyond the bound; among records that differ so much it would be no surprise."""
    slots = (LAYOUT.slots[0], Slot("damping", "N s/m", Range(0.0, 20.0, 10.0)))
    layout, truth = Layout(slots, ("a.csv", "b.csv")), np.array([1.0, 25.0])
    random = np.random.default_rng(0)
    gls = likelihood(
        layout,
        np.array([1.0, 20.0]),
        np.array([truth, truth]),
        [random.standard_normal(SAMPLES) for _ in range(2)],
    )
    # In the error at the bound, which holds how much these seem to differ, the step would be chance.
    assert np.log(25.0 / 20.0) / np.sqrt(gls.evidence.spread[1, 1]) < CHANCE
    assert pulls_of_gls(gls)[1] > 3.0 * CHANCE


@pytest.mark.parametrize(("value", "passes"), [(-0.1, True), (-5.0, False)])
def test_what_a_record_has_for_itself_lies_as_far_beyond_its_bound_as_it_would(value: float, passes: bool) -> None:
    """A likelihood stops it nowhere: no step leads beyond the bound, as it is there already."""
    one: Any = SimpleNamespace(value=value, std_error=0.1, interval_95=(value - 0.2, value + 0.2), at_bound=True)
    free: Any = SimpleNamespace(at_bound=False)
    found: Any = [SimpleNamespace(found=free), SimpleNamespace(found=one)]
    (place,) = at_bounds(LAYOUT, found, lambda: np.zeros(2))
    check = judge("bounds", beyond_bounds((place,)))
    assert check.passed is passes
    assert check.statistic == pytest.approx(-value / 0.1)
    # It is told as at most what may be.
    assert place.end == max(value + 0.2, 0.0)


def test_the_end_that_is_told_is_that_of_the_interval_that_is_reported() -> None:
    """Intervals are widened, or profiled, after it was asked whether the value is at its bound by chance."""
    places = (AtBound("friction", "N", 0.0, 0.35, True, 1.2), AtBound("gone", "N", 0.0, 0.1, True, 0.0))
    found: Any = [SimpleNamespace(found=SimpleNamespace(interval_95=(0.0, end))) for end in (9.0, 0.8)]
    assert [one.end for one in with_ends(places, LAYOUT, found)] == [0.8, 0.1]
