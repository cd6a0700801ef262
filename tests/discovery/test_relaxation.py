"""What a law costs beside a free curve, and where base parameters are with it: closed forms of a linear problem."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.discovery.curves.probes import FrictionOfSpeed
from fibrefit.discovery.engine.priors import Heights
from fibrefit.discovery.laws import relaxation
from fibrefit.discovery.laws.relaxation import beside, nearest_curve, places_along, quadratic_of
from fibrefit.problem.linear_model.unknowns import Place

KNOTS, BASE, SIZE, WALK = np.linspace(0.0, 0.4, 10), 3, 0.3, 0.2
RANDOM = np.random.default_rng(8)
SLOPES = RANDOM.standard_normal((60, BASE + len(KNOTS)))
READINGS = RANDOM.standard_normal(60) * 5.0
PRIOR = 0.25
"""Precision of the base parameters beforehand."""


def cost(base: np.ndarray, heights: np.ndarray) -> float:
    """Of readings that are linear in base parameters and heights, in twice nats, the heights' prior left out."""
    return float(np.sum((READINGS - SLOPES @ np.r_[base, heights / SIZE]) ** 2) + PRIOR * base @ base)


def base_with(heights: np.ndarray) -> np.ndarray:
    """Base parameters that cost least beside some heights."""
    own, left = SLOPES[:, :BASE], READINGS - SLOPES[:, BASE:] @ (heights / SIZE)
    return np.linalg.solve(own.T @ own + PRIOR * np.eye(BASE), own.T @ left)


def fitted_curve() -> Any:
    """The posterior of the curve, as a search has it."""
    walk = Heights(tuple(f"c{i}" for i in range(len(KNOTS))), SIZE, WALK)
    precision = SLOPES.T @ SLOPES
    precision[:BASE, :BASE] += PRIOR * np.eye(BASE)
    precision[BASE:, BASE:] += walk.precision()
    z = np.linalg.solve(precision, SLOPES.T @ READINGS)
    bounds = np.full(len(z), np.inf)
    # A descent ends before it is there; the mean is where a last step would lead.
    place = Place(z + 0.1 * RANDOM.standard_normal(len(z)), np.zeros((1, 0)), np.zeros((1, 0)), np.zeros((1, 0)))
    unknowns = SimpleNamespace(lower=-bounds, upper=bounds, local_of=lambda place: place.z)
    mode = SimpleNamespace(place=place, unknowns=unknowns)
    evidence = SimpleNamespace(spread=np.linalg.inv(precision), mean=z, mode=mode)
    fitted = SimpleNamespace(evidence=evidence, supermodel=None)
    return SimpleNamespace(probe=FrictionOfSpeed, knots=KNOTS, heights=SIZE * z[BASE:], walk=walk, fitted=fitted)


@pytest.mark.parametrize("seed", range(5))
def test_a_law_costs_what_it_does_with_base_parameters_refitted(seed: int) -> None:
    """Of two curves the difference, as what both cost alike says nothing."""
    random = np.random.default_rng(seed)
    quadratic = quadratic_of(fitted_curve())
    costs = []
    for heights in random.standard_normal((2, len(KNOTS))):
        values = np.interp(quadratic.places, KNOTS, heights)
        told = float(np.sum((quadratic.half @ values - quadratic.target) ** 2))
        costs.append((told, cost(base_with(heights), heights)))
    assert costs[0][0] - costs[1][0] == pytest.approx(costs[0][1] - costs[1][1], rel=1e-7)


def test_base_parameters_are_where_they_cost_least_beside_a_law(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(relaxation, "transferred", lambda supermodel, other, local: local)
    heights = RANDOM.standard_normal(len(KNOTS))
    values = np.interp(places_along(KNOTS), KNOTS, heights)
    found = beside(fitted_curve(), values, cast(Any, None))
    np.testing.assert_allclose(found[:BASE], base_with(heights), rtol=1e-7)


def test_base_parameters_stay_beside_the_curve_itself_and_inside_their_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(relaxation, "transferred", lambda supermodel, other, local: local)
    one = fitted_curve()
    values = np.interp(places_along(KNOTS), KNOTS, one.heights)
    z = one.fitted.evidence.mean
    np.testing.assert_allclose(beside(one, values, cast(Any, None))[:BASE], z[:BASE], rtol=1e-7)
    one.fitted.evidence.mode.unknowns.upper = z - 0.1
    np.testing.assert_allclose(beside(one, values, cast(Any, None))[:BASE], z[:BASE] - 0.1)


@pytest.mark.parametrize("pitch", [3.2, 4.7, 12.0])
def test_a_curve_that_turns_within_a_few_knots_is_higher_than_its_law(pitch: float) -> None:
    """By the orthogonal projection on linear splines (Unser, IEEE Signal Process. Mag. 16 (1999)), p knots a turn."""
    knots = np.arange(121.0)
    heights = nearest_curve(knots) @ np.sin(2.0 * np.pi * places_along(knots) / pitch)
    inner = slice(20, -20)
    sine, cosine = np.sin(2.0 * np.pi * knots / pitch)[inner], np.cos(2.0 * np.pi * knots / pitch)[inner]
    amplitude = np.hypot(*np.linalg.lstsq(np.stack([sine, cosine], axis=1), heights[inner], rcond=None)[0])
    assert amplitude == pytest.approx(3.0 * np.sinc(1.0 / pitch) ** 2 / (2.0 + np.cos(2.0 * np.pi / pitch)), rel=0.03)
