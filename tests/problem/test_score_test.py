"""Score tests: how unknowns give way to a direction, and a relative change beside what a record differs by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fibrefit.problem.estimate.gauss_newton import Effort, mode
from fibrefit.problem.linear_model.normal_equations import ScoreTest
from fibrefit.problem.linear_model.unknowns import Place, Unknowns
from tests.problem.toys import gram_of, unknowns

TIMES = np.linspace(0.0, 1.0, 200)
PRECISE = 1e-3
SIGMA = np.array([0.05])


def _without_strength(whole: Unknowns) -> Unknowns:
    first = slice(0, 2)
    kept = {name: getattr(whole, name)[first] for name in ("log", "reference", "scale", "mean", "lower", "upper")}
    shared = {"shared": whole.shared[first]}
    names = (*whole.names[:2], *whole.names[3:])
    return replace(whole, names=names, precision=whole.precision[first, first], **kept, **shared)


def test_unknowns_give_way_to_a_direction_as_a_search_beside_it_says() -> None:
    whole = unknowns()
    random = np.random.default_rng(5)
    slopes, data = random.standard_normal((5, 60)), random.standard_normal((4, 60))

    def residuals(local: np.ndarray) -> np.ndarray:
        at = np.concatenate([np.log(local[:, :2] / whole.reference[:2]), local[:, 2:]], axis=1)
        return at @ slopes - data

    gram, rest = gram_of(residuals), np.array([[20.0, 3.0, 1.0, 0.0, 0.0]] * 4)

    def best(strength: float) -> Place:
        z = np.array([0.0, 0.0, strength])
        held = whole.fixed_at(2, z)
        start = Place(z, np.zeros((4, 2)), np.zeros((4, 1)), rest)
        return mode(held, start, gram, SIGMA, 1e-12).place

    lesser, place = _without_strength(whole), best(0.0)
    at = Place(place.z[:2], place.own, place.eta, rest)
    to = float(whole.value(np.array([0.0, 0.0, 0.02]))[2])
    grams = lesser.local_grams(at, gram, (np.array([2]), np.array([to])))
    test = ScoreTest.of(lesser, at, grams, 1, SIGMA)
    other = best(0.02)
    np.testing.assert_allclose(test.shared[0], (other.z - place.z)[:2], rtol=1e-3, atol=1e-7)
    own = np.concatenate([other.own - place.own, other.eta - place.eta], axis=1)
    np.testing.assert_allclose(test.own[0], own, rtol=1e-3, atol=1e-7)


def test_a_direction_of_which_slopes_are_no_numbers_gains_nothing() -> None:
    score, information = np.array([2.0, 1.0, np.nan, 3.0]), np.array([4.0, 0.0, 1.0, np.nan])
    test = ScoreTest(score, information, np.diag(information), np.zeros((4, 0)), np.zeros((4, 1, 0)))
    np.testing.assert_array_equal(test.gain, [0.5, -np.inf, -np.inf, -np.inf])


def _steps(relative: bool) -> int:
    """Until a relative change has taken the place of what a record differs by."""
    whole = replace(
        unknowns(records=4),
        mean=np.zeros(3),
        precision=np.diag([1e-2, 1e-2, 1.0]),
        log=np.array([True, True, relative]),
        reference=np.array([20.0, 3.0, 1.0 if relative else 0.0]),
        scale=np.array([1.0, 1.0, 1.0 if relative else 0.2]),
        lower=np.array([-5.0, -5.0, -3.0 if relative else -4.75]),
        offset=np.array([0.0, 0.0, 1.0 if relative else 0.0]),
    )
    true = np.array([21.0, 20.8, 11.0, 21.2])

    def residuals(local: np.ndarray) -> np.ndarray:
        changed = 1.0 + local[:, 2] * (np.arange(4) == 2)
        signal = local[:, 0] * changed
        seen = np.outer(np.log(signal / true), 1.0 + TIMES) / PRECISE
        others = np.outer(np.log(local[:, 1] / 3.0), np.cos(9.0 * TIMES)) / PRECISE
        return seen + others + local[:, 3:4] * np.sin(5.0 * TIMES) + local[:, 4:] * np.sin(11.0 * TIMES)

    eta = np.log(true / 20.0)[:, None]
    rest = np.array([[20.0, 3.0, 0.0, 0.0, 0.0]] * 4)
    start = Place(np.array([eta.mean(), 0.0, 0.0]), np.zeros((4, 2)), eta - eta.mean(), rest)
    found = mode(whole, start, gram_of(residuals), SIGMA, 1e-3, Effort(steps=100))
    assert whole.value(found.place.z)[2] == pytest.approx(11.0 / 21.0 - 1.0, abs=0.02)
    return found.steps


def test_a_relative_change_takes_the_place_of_what_a_record_differs_by_in_a_few_steps() -> None:
    """By its logarithm: beside a deviation, itself a logarithm, a change as such runs along a bend."""
    assert _steps(True) <= 15
    assert _steps(False) > 40


def test_coordinates_of_a_relative_change() -> None:
    relative = replace(unknowns(), log=np.array([True, True, True]), reference=np.array([20.0, 3.0, 1.0]))
    relative = replace(relative, offset=np.array([0.0, 0.0, 1.0]))
    z = np.array([0.1, -0.2, np.log(0.7)])
    value = relative.value(z)
    assert value[2] == pytest.approx(-0.3)
    np.testing.assert_allclose(relative.coordinate(value), z)
    step = 1e-6
    np.testing.assert_allclose(relative.slope(z), (relative.value(z + step) - relative.value(z - step)) / (2 * step))
