"""Records that have two minima: which of them a hypothesis meets must not be chance."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from fibrefit.problem.estimate.gauss_newton import FAR_BELOW, FIRST_SIGMA, better_minima, beyond_the_parabola, mode
from fibrefit.problem.linear_model.normal_equations import PosteriorMode
from fibrefit.problem.linear_model.unknowns import Gram, Place
from tests.problem.toys import REFERENCE, Linear, begun, gram_of, unknowns

TRUTH = np.array([0.3, -0.2, 0.5])
SIGMA = np.full(1, FIRST_SIGMA)
APART = 1.2 * FIRST_SIGMA
"""Between two minima of a record: a standard deviation from one is on the other's side."""
BENT = 2
"""The record that has several."""
LOUD = 200.0


@dataclass(frozen=True)
class Resting:
    """Records of which one comes to rest in steps of what it deviates by: a sine of that, beside all else."""

    linear: Linear = field(default_factory=lambda: Linear.drawn(3, TRUTH, scatter=0.002, loud=LOUD))
    height: float = 15.0

    def residuals(self, local: np.ndarray) -> np.ndarray:
        """What is left at local values."""
        away = np.log(local[:, :1] / REFERENCE[0]) - TRUTH[0]
        steps = self.height * np.sin(np.pi * away / APART)
        return np.concatenate([self.linear.residuals(local), np.where(np.arange(4)[:, None] == BENT, steps, 0.0)], 1)

    @property
    def gram(self) -> Gram:
        """See `gram_of`."""
        return gram_of(self.residuals)

    def at(self, eta: float) -> PosteriorMode:
        """Where a descent ends that begins with the record at a deviation."""
        of = unknowns()
        start = mode(of, begun(of), self.linear.gram, SIGMA).place
        start.eta[BENT] = eta
        return mode(of, start, self.gram, SIGMA)


def never(*of: np.ndarray) -> np.ndarray:
    raise AssertionError("a simulation that tells nothing")


def other(found: PosteriorMode, resting: Resting) -> Place | None:
    return better_minima(found, resting.gram, resting.gram)


def test_a_record_in_a_worse_minimum_is_moved_to_the_better_one_and_the_others_stay() -> None:
    resting = Resting()
    ends = sorted((resting.at(eta) for eta in (-0.01, -0.005, 0.0, 0.005, 0.01)), key=lambda end: end.objective)
    lowest, worst = ends[0], ends[-1]
    assert worst.objective > lowest.objective + 20.0
    found = worst
    for _ in range(4):
        place = other(found, resting)
        if place is None:
            break
        rest = np.arange(4) != BENT
        np.testing.assert_array_equal(place.eta[rest], found.place.eta[rest])
        np.testing.assert_array_equal(place.z, found.place.z)
        moved = mode(unknowns(), place, resting.gram, SIGMA)
        assert moved.objective < found.objective
        found = moved
    assert found.objective == pytest.approx(lowest.objective, abs=0.1)
    assert other(lowest, resting) is None


def test_where_cost_is_the_parabola_that_slopes_predict_nothing_is_followed() -> None:
    linear = Linear.drawn(5, TRUTH, scatter=0.004, loud=LOUD)
    found = mode(unknowns(), begun(unknowns()), linear.gram, SIGMA)
    assert not beyond_the_parabola(found, linear.gram).any()
    assert better_minima(found, linear.gram, never) is None


def test_records_that_do_not_differ_are_not_asked() -> None:
    linear = Linear.drawn(5, TRUTH, loud=LOUD)
    found = mode(unknowns(), begun(unknowns()), linear.gram, np.zeros(1))
    assert better_minima(found, never, never) is None


@pytest.mark.parametrize("height", [0.0, 1.0, 15.0])
def test_a_record_is_begun_anew_only_where_its_cost_is_far_below_the_parabola(height: float) -> None:
    resting = Resting(height=height)
    found = resting.at(0.0)
    away = beyond_the_parabola(found, resting.gram)
    assert not away[np.arange(4) != BENT].any()
    step = FIRST_SIGMA * np.array([1.0, -1.0])
    rise, predicted = [], []
    for one in step:
        there = found.place._replace(eta=found.place.eta + np.where(np.arange(4) == BENT, one, 0.0)[:, None])
        local = found.local.copy()
        local[:, 0] = unknowns().value(there.z + np.pad(there.eta, ((0, 0), (0, 2))))[:, 0]
        rise.append(np.sum(resting.residuals(local)[BENT] ** 2) - found.normal.costs[BENT])
        predicted.append(found.normal.blocks[BENT, 2, 2] * one**2 + 2.0 * found.normal.pulls[BENT, 2] * one)
    share = np.array(rise) / predicted
    expected = step[np.argmin(share)] if share.min() < FAR_BELOW else 0.0
    assert away[BENT, 0] == pytest.approx(expected)


def test_costs_of_records_and_what_is_believed_of_what_they_share_are_all_of_q() -> None:
    linear, of = Linear.drawn(5, TRUTH, scatter=0.01, loud=LOUD), unknowns()
    found = mode(of, begun(of), linear.gram, SIGMA)
    away = found.place.z - of.mean
    assert found.record_costs().sum() + away @ of.precision @ away == pytest.approx(found.objective)


@pytest.mark.parametrize(("share", "begun_anew"), [(0.75, True), (0.85, False), (-1.0, True)])
def test_four_fifths_of_the_rise_that_slopes_predict_are_near_the_parabola(share: float, begun_anew: bool) -> None:
    linear = Linear.drawn(5, TRUTH, scatter=0.004, loud=LOUD)
    found = mode(unknowns(), begun(unknowns()), linear.gram, SIGMA)

    def gram(local: np.ndarray, columns: np.ndarray, targets: np.ndarray) -> np.ndarray:
        grams = linear.gram(local, columns, targets)
        rise = grams[BENT, 0, 0] + 2.0 * grams[BENT, 0, -1]
        grams[BENT, 0, 0] += (share - 1.0) * rise
        return grams

    away = beyond_the_parabola(found, gram)
    assert away[BENT, 0] == pytest.approx(FIRST_SIGMA if begun_anew else 0.0)
    assert not np.delete(away, BENT, axis=0).any()
