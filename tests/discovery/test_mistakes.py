"""A mistake of the study that leads through the bounces which the model of a driven rig loses without it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.core.limits import quiet
from fibrefit.discovery import forward_selection
from fibrefit.discovery import mistakes as module
from fibrefit.discovery.engine.candidates import Hypothesis
from fibrefit.discovery.engine.effort import LED, MET, NEARLY, TOO_FAR
from fibrefit.discovery.engine.refit import Refit
from fibrefit.discovery.engine.thresholds import BEYOND_DOUBT, NAMED
from fibrefit.discovery.forward_selection import Limits, Selection
from fibrefit.discovery.search import inputs
from fibrefit.discovery.search.inputs import confirmed
from fibrefit.discovery.search.setup import prepared_search
from fibrefit.fitting.identify import How, identify
from fibrefit.laws.catalogue import CATALOGUE, find_effect
from fibrefit.study import load_study
from fibrefit.workflow.prepare import task_of
from tests.discovery.test_pairs import Model
from tests.validation.mistakes import mistakes

CLOCK, SLOPE, MASS, DRAG = (
    find_effect(name) for name in ("study.clock", "study.inclination", "study.weight_mass", "guide.quadratic_drag")
)

SAMPLES = 100
"""That are measured: a model that leaves a cost of 1000 has not met all bounces."""


@dataclass(frozen=True)
class Base(Model):
    """A model as far from the records as it is told to be."""

    far: bool = True

    @property
    def supermodel(self) -> Any:
        return SimpleNamespace(sensitivities=SimpleNamespace(far=self.far))


class Bench:
    """Mistakes that lead to given costs, and gain what is told where readings are linearised about them."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, **costs: float) -> None:
        self.costs, self.led, self.asked = costs, list[str](), list[str]()
        self.gains, self.gaps = dict[str, float](), dict[str, float]()
        monkeypatch.setattr(module, "_led", self.lead)
        monkeypatch.setattr(module, "confirmed", self.confirm)
        self.compared = True
        monkeypatch.setattr(module, "among_rivals", self.rivals)

    def lead(self, search: Any, parent: Any, effects: tuple[Any, ...]) -> Any:
        name = effects[0].name.partition(".")[2] if effects else "base"
        self.led.append(name)
        cost = self.costs.get(name, 1000.0)
        return SimpleNamespace(effects=effects, supermodel="plain", fit=SimpleNamespace(cost=cost, local=None))

    def confirm(self, search: Any, parent: Any, found: Model, lead: bool) -> Any:
        assert lead
        self.asked += found.names
        there = SimpleNamespace(gap_left=lambda one: self.gaps.get(one.names[0], 1.0))
        return SimpleNamespace(found=found, gain=self.gains.get(found.names[0], 100.0), search=there)

    def rivals(self, found: Any) -> Any:
        if not self.compared:
            return found
        return found._replace(comparison=replace(found.comparison, moved=True))

    def search(self, effects: Sequence[Any]) -> Any:
        inference = SimpleNamespace(without_descent=lambda supermodel, effects, local, parent: Model(effects, 0.0))
        return SimpleNamespace(
            tell=lambda what, share: None,
            extensions=lambda parent: effects,
            inference=inference,
            supermodel_for=lambda effect: "whole",
            task=SimpleNamespace(problem=SimpleNamespace(n_measured=SAMPLES)),
        )

    def found(self, effects: Sequence[Any] = (DRAG, CLOCK, SLOPE, MASS)) -> Any:
        return module.mistaken(cast(Any, self.search(effects)), cast(Any, Base((), 0.0)))


def test_the_mistake_that_leaves_least_of_whole_records_is_asked_about(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch, base=1000.0, clock=400.0, inclination=20.0, weight_mass=900.0)
    found = bench.found()
    assert bench.led == ["base", "clock", "inclination", "weight_mass"]
    assert bench.asked == [SLOPE.name]
    assert found.chosen.names == (SLOPE.name,)
    # What leaves ten times as much is no rival.
    assert [one.names for one in found.comparison.found] == [(SLOPE.name,)]


def test_mistakes_that_lead_to_like_places_are_compared_and_the_next_is_asked_where_the_first_is_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Plain squares hold errors of the drive: which of two is the right one they do not say."""
    bench = Bench(monkeypatch, base=1000.0, inclination=20.0, weight_mass=21.0)
    bench.gains = {SLOPE.name: 0.0}
    found = bench.found()
    assert bench.asked == [SLOPE.name, MASS.name]
    assert found.chosen.names == (MASS.name,)
    # What was refused is no rival any more.
    logs = {one.names[0]: one.log for one in found.comparison.found}
    assert logs == {SLOPE.name: 0.0, MASS.name: BEYOND_DOUBT}


def test_what_no_time_was_left_to_compare_is_told_alone_with_what_it_gains(monkeypatch: pytest.MonkeyPatch) -> None:
    """That plain squares lead somewhere is worth no number."""
    bench = Bench(monkeypatch, base=1000.0, inclination=20.0, weight_mass=21.0)
    bench.compared, bench.gains = False, {SLOPE.name: 30.0}
    found = bench.found()
    assert [(one.names, one.log) for one in found.comparison.found] == [((SLOPE.name,), 30.0)]
    assert found.chosen is found.comparison.found[0]


def test_all_mistakes_that_were_led_count_in_the_false_alarm(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch, base=1000.0, clock=21.0, inclination=20.0)
    found = bench.found().comparison
    assert (len(found.found), found.others) == (2, 1)
    bench.compared = False
    alone = bench.found().comparison
    assert (len(alone.found), alone.others) == (1, 2)


def test_a_base_model_without_any_motion_leaves_all_to_the_mistakes(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch, base=np.inf, clock=np.inf, inclination=20.0, weight_mass=np.inf)
    assert bench.found().chosen.names == (SLOPE.name,)
    assert Bench(monkeypatch, base=np.inf, clock=np.inf, inclination=np.inf, weight_mass=np.inf).found() is None


@pytest.mark.parametrize(("share", "asked"), [(0.99 * LED, True), (1.01 * LED, False)])
def test_a_mistake_that_leads_through_no_bounce_is_not_asked_about(
    monkeypatch: pytest.MonkeyPatch, share: float, asked: bool
) -> None:
    bench = Bench(monkeypatch, base=1000.0, clock=1000.0 * share)
    assert (bench.found() is not None) is asked
    assert bool(bench.asked) is asked


@pytest.mark.parametrize(("gain", "there"), [(NAMED + 0.1, True), (NAMED, False)])
def test_it_has_to_be_more_than_chance_about_itself(monkeypatch: pytest.MonkeyPatch, gain: float, there: bool) -> None:
    bench = Bench(monkeypatch, base=1000.0, clock=10.0)
    bench.gains = {CLOCK.name: gain}
    assert (bench.found() is not None) is there


@pytest.mark.parametrize(("gap", "asked"), [(MET - 0.01, True), (MET + 0.01, False)])
def test_a_mistake_that_meets_not_all_bounces_is_not_asked_about(
    monkeypatch: pytest.MonkeyPatch, gap: float, asked: bool
) -> None:
    """Where a friction was missing, the best of the mistakes left half of what the base model did, and lost as many."""
    bench = Bench(monkeypatch, base=1e4, clock=gap**2 * SAMPLES)
    assert (bench.found() is not None) is asked
    assert bool(bench.asked) is asked


@pytest.mark.parametrize(("gap", "there"), [(NEARLY, True), (NEARLY + 0.01, False)])
def test_it_has_to_account_for_nearly_all_to_come_before_every_effect(
    monkeypatch: pytest.MonkeyPatch, gap: float, there: bool
) -> None:
    bench = Bench(monkeypatch, base=1000.0, clock=10.0)
    bench.gaps = {CLOCK.name: gap}
    assert (bench.found() is not None) is there


def test_a_mistake_in_one_record_alone_and_physics_are_none_of_the_study(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch, base=1000.0)
    others = [effect for effect in CATALOGUE.values() if effect.family or not effect.name.startswith("study.")]
    assert bench.found(others) is None
    assert bench.led == ["base"]


@pytest.mark.parametrize("far", [False, None])
def test_a_model_that_keeps_its_motion_or_has_exact_inputs_is_searched_as_ever(far: bool | None) -> None:
    parent = Model((), 0.0) if far is None else Base((), 0.0, far=far)
    assert module.mistaken(cast(Any, None), cast(Any, parent)) is None


@pytest.mark.slow
def test_a_slope_that_the_study_states_wrong_is_found_where_the_base_model_loses_its_motion(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two degrees, as of a series whose base model is in a minimum of other bounces."""
    series = mistakes("2026-11-27p", "inclination", ("pulley_drive",))
    next(one for one in series if one.index == 9).write(tmp_path)
    study = load_study(tmp_path)
    task = task_of(study.model_copy(update={"records": study.records[1:3]}))
    before = identify(task, 2, 0, How(whiten=False, rivals=False))
    search, base = prepared_search(task, before, (CLOCK, SLOPE, MASS), quiet)
    known = base.supermodel.sensitivities
    assert known is not None
    assert known.far
    found = module.mistaken(search, base)
    assert found is not None
    assert found.chosen is not None
    assert found.chosen.names == (SLOPE.name,)
    assert found.chosen.shared[f"{SLOPE.name}.error"] == pytest.approx(-np.radians(2.0), abs=np.radians(0.1))
    # The negative control: linearised about what suits the first bounces, readings lose the later ones.
    monkeypatch.setattr(module, "confirmed", lambda *of, lead: confirmed(*of, lead=False))
    assert module.mistaken(search, base) is None


@pytest.mark.parametrize("chosen_by_hand", [False, True])
def test_what_it_leads_to_is_added_before_any_effect_is_tried_and_is_linearised_about_again(
    monkeypatch: pytest.MonkeyPatch, chosen_by_hand: bool
) -> None:
    said = list[str]()

    def mistaken(search: Any, parent: Any) -> Any:
        return SimpleNamespace(comparison="of mistakes")

    def grown(at: Any, found: Any, single: Any, before: Any, limits: Any) -> Any:
        said.append(single)
        return replace(at, best=Base((SLOPE,), 50.0), about=Base((SLOPE,), 50.0))

    def compared(*of: Any) -> Any:
        raise LookupError("effects are tried")

    anew: Any = Base((SLOPE,), 60.0)
    monkeypatch.setattr(forward_selection, "relinearised", lambda search, best: ("a search about it", anew))
    monkeypatch.setattr(forward_selection, "mistaken", mistaken)
    monkeypatch.setattr(forward_selection, "_grown", grown)
    monkeypatch.setattr(forward_selection, "comparison_of", compared)
    begun = Selection(cast(Any, None), cast(Any, Base((), 0.0)))
    limits = Limits(choose=(lambda ranking: None) if chosen_by_hand else None)
    if chosen_by_hand:
        with pytest.raises(LookupError):
            forward_selection._further(begun, cast(Any, None), limits)
        return
    after, there = forward_selection._further(begun, cast(Any, None), limits)
    assert there
    assert said == ["of mistakes"]
    assert after.best is after.about is anew


@pytest.mark.parametrize(
    ("known", "gap", "led"),
    [(True, TOO_FAR, True), (True, 1.01 * TOO_FAR, False), (False, 1.0, False), (None, 1.0, False)],
)
def test_what_leaves_little_before_the_first_bounces_is_led_on(known: bool | None, gap: float, led: bool) -> None:
    sensitivities = None if known is None else SimpleNamespace(far=known)
    plain = SimpleNamespace(supermodel=SimpleNamespace(sensitivities=sensitivities))
    search = SimpleNamespace(gap=lambda one: gap)
    assert inputs._is_led_on(cast(Any, search), cast(Any, plain)) is led


@pytest.mark.parametrize(("led_to", "led"), [(9.0, True), (11.0, False), (np.inf, False)])
def test_a_hypothesis_is_led_where_that_leaves_less_of_whole_records(
    monkeypatch: pytest.MonkeyPatch, led_to: float, led: bool
) -> None:
    supermodel: Any = SimpleNamespace(costs=lambda local, counts: np.array([4.0, 6.0]))
    monkeypatch.setattr(inputs, "transferred", lambda supermodel, source, local: local)
    monkeypatch.setattr(
        inputs, "through_all_bounces", lambda search, plain: Hypothesis((), Refit(np.ones((2, 1)), led_to), supermodel)
    )
    search: Any = SimpleNamespace(context=SimpleNamespace(whole=None))
    there, moved = inputs._ahead(search, Hypothesis((), Refit(np.zeros((2, 1)), 3.0), supermodel))
    assert moved is led
    assert there.fit.cost == (led_to if led else 10.0)
    np.testing.assert_array_equal(there.fit.local, float(led))
