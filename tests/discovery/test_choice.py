"""Where a search looks for a frequency, and the weak starts of a descent in the marginal likelihood."""

from __future__ import annotations

import numpy as np
import pytest

from fibrefit.discovery.engine.candidates import FREQUENCIES, MANY, SHAPES, _starts, absent_values
from fibrefit.discovery.engine.screening import (
    LEAST_SHARE,
    SLIGHT_CHANGE,
    WEAK,
    PredictedGain,
    best_of,
    cannot_be_opposite,
    directions,
    rings,
    slightly,
    starting_strength,
)
from fibrefit.discovery.engine.supermodel import supermodel_of
from fibrefit.discovery.engine.thresholds import PRICE
from fibrefit.laws.catalogue import CATALOGUE, find_effect
from fibrefit.problem.task import Task


def test_a_frequency_is_looked_for_near_wherever_it_may_be(task: Task) -> None:
    resonance = find_effect("sensor.gauge_resonance")
    supermodel = supermodel_of(task, (resonance,))
    starts = _starts(supermodel, absent_values(supermodel, 1), (resonance,))
    begun = {float(start[0, supermodel.names.index("sensor.gauge_resonance.natural_frequency")]) for start in starts}
    screened = {value for way in directions(resonance) for _, value in way.strengths}
    assert len(starts) > MANY
    for tried in (begun, screened):
        assert len(tried) == len(FREQUENCIES)
        for frequency in np.geomspace(30.0, 12000.0, 60):
            # Where a ring is sampled often its valley is wide in proportion, above that as wide in hertz.
            assert min(abs(frequency - near) for near in tried) < max(0.15 * min(frequency, 2000.0), 151.0)


@pytest.mark.parametrize("name", ["guide.stribeck_friction", "sensor.force_delay", "sensor.dial_gauge_force"])
def test_an_effect_is_screened_weakly_with_each_shape(name: str) -> None:
    effect = CATALOGUE[name]
    declared = {parameter.name: parameter for parameter in effect.parameters}
    ways = directions(effect)
    for way in ways:
        assert {strength for strength, _ in way.strengths} == set(effect.strength)
        assert set(way.shapes) == set(declared) - set(effect.strength)
        for strength, value in way.strengths:
            away = abs(value - declared[strength].null) / abs(declared[strength].typical - declared[strength].null)
            assert 0.0 < away <= max(WEAK, effect.singular) * (1.0 + 1e-9)
    shapes = [parameter for parameter in effect.parameters if parameter.name not in effect.strength and parameter.log]
    assert len(ways) == len(SHAPES) ** len(shapes)


def test_a_start_is_where_slopes_see_a_minimum_inside_the_bounds(task: Task) -> None:
    viscous = CATALOGUE["guide.viscous_friction"]
    supermodel, name = supermodel_of(task, (viscous,)), "guide.viscous_friction.viscous_coefficient"
    weak = WEAK * viscous.parameters[0].typical
    assert starting_strength(supermodel, name, weak, 3.0) == pytest.approx(3.0 * weak)
    # A strength that cannot be negative enters weakly whatever slopes say, and none enters beyond its typical size.
    assert starting_strength(supermodel, name, weak, -5.0) == pytest.approx(weak)
    assert starting_strength(supermodel, name, weak, 1e6) == pytest.approx(viscous.parameters[0].typical)


def test_what_vanishes_at_infinity_starts_at_its_share_by_its_inverse(task: Task) -> None:
    presliding = CATALOGUE["guide.presliding"]
    supermodel, name = supermodel_of(task, (presliding,)), "guide.presliding.bristle_stiffness"
    stiffness = next(parameter for parameter in presliding.parameters if parameter.name == "bristle_stiffness")
    weak = stiffness.typical / WEAK**0.5
    assert starting_strength(supermodel, name, weak, 0.25) == pytest.approx(4.0 * weak)
    assert starting_strength(supermodel, name, weak, -1.0) == pytest.approx(weak / LEAST_SHARE)
    assert starting_strength(supermodel, name, weak, 1e6) == pytest.approx(stiffness.typical)


@pytest.mark.parametrize(
    ("name", "strength", "share"),
    [
        ("guide.viscous_friction", "viscous_coefficient", SLIGHT_CHANGE),
        ("sensor.force_gain", "gain", SLIGHT_CHANGE),
        ("guide.presliding", "bristle_stiffness", 1.0),
        ("sensor.gauge_resonance", "natural_frequency", 1.0),
    ],
)
def test_slopes_are_taken_over_little_of_a_weak_strength_unless_it_changes_the_model(
    task: Task, name: str, strength: str, share: float
) -> None:
    effect = CATALOGUE[name]
    supermodel, null = supermodel_of(task, (effect,)), {p.name: p.null for p in effect.parameters}[strength]
    weak = next(value for way in directions(effect) for found, value in way.strengths if found == strength)
    there = slightly(supermodel, effect, f"{name}.{strength}", weak)
    assert there == (weak if share == 1.0 else pytest.approx(null + share * (weak - null), rel=1e-12))


def test_what_rings_is_followed_from_the_frequencies_that_most_is_predicted_of() -> None:
    found = [PredictedGain(gain, {"f": gain}, {}, {}) for gain in (1.0, -4.0, 9.0, 3.0, 2.0, 0.5)]
    assert best_of(found, valleys=False) == found[2]
    best = best_of(found, valleys=True)
    assert best._replace(elsewhere=()) == found[2]
    assert [one["f"] for one in best.elsewhere] == [3.0, 2.0, 1.0]
    # What nothing is predicted of is no place to begin.
    assert best_of(found[1:3], valleys=True).elsewhere == ()
    # Nor is one at which records ask for less than none of it, though it comes before another such.
    less = [one._replace(opposite=one.gain > 5.0) for one in found]
    assert best_of(less, valleys=True).gain == 3.0
    assert best_of([one for one in less if one.opposite or one.gain < 0.0], valleys=True).gain == 9.0
    assert rings(CATALOGUE["sensor.gauge_resonance"])
    assert not rings(CATALOGUE["guide.loose_mass"])


def test_nothing_is_promised_of_an_effect_that_cannot_be_what_records_ask_for() -> None:
    asked = PredictedGain(40.0, {}, {}, {})
    assert asked.promise == 40.0
    assert asked._replace(opposite=True).promise == -PRICE
    assert asked._replace(gain=-np.inf, opposite=True).promise == -np.inf


@pytest.mark.parametrize(
    ("name", "strength", "one_sided"),
    [
        ("guide.viscous_friction", "viscous_coefficient", True),
        ("fibre.hysteresis", "hysteretic_stiffness", True),
        ("sensor.force_delay", "delay", True),
        ("fibre.hardening", "hardening", False),
        ("sensor.force_offset", "offset", False),
        ("guide.presliding", "bristle_stiffness", False),  # slopes at its null say nothing of it
    ],
)
def test_which_strengths_have_one_sign(task: Task, name: str, strength: str, one_sided: bool) -> None:
    effect = CATALOGUE[name]
    assert strength in effect.strength
    assert cannot_be_opposite(supermodel_of(task, (effect,)), effect, f"{name}.{strength}") is one_sided
