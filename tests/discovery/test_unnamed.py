"""When a law of no name is compared against effects, and what it has to do to take their place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, NamedTuple, cast

import pytest

from fibrefit.core.limits import OutOfTimeError
from fibrefit.discovery import complete_law, unnamed
from fibrefit.discovery.comparison import Comparison
from fibrefit.discovery.complete_law import Unnamed
from fibrefit.discovery.curves.probes import COURSES, PROBES
from fibrefit.discovery.engine.effort import HARDLY, PROMISING
from fibrefit.discovery.engine.thresholds import BEYOND_DOUBT, NAMED
from fibrefit.discovery.laws.propose import PRICE_OF_LOOKS, Proposal
from fibrefit.discovery.laws.told import HeldLaw
from fibrefit.discovery.residuals.innovations import Alarm
from fibrefit.discovery.search.inputs import Confirmation
from fibrefit.discovery.search.starts import little_is_missing
from fibrefit.discovery.unnamed import effects_as_good, law_before_effects, law_beside_choice
from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.laws.ports import PORTS, port_of
from tests.discovery.test_pairs import Model

TOE, HARDENING, STRIBECK, LOAD, OFFSET, GAIN, DRIFT, VISCOUS, MAXWELL = (
    CATALOGUE[name]
    for name in (
        "fibre.toe_region",
        "fibre.hardening",
        "guide.stribeck_friction",
        "guide.load_dependent_friction",
        "sensor.force_offset",
        "sensor.position_gain",
        "guide.friction_drift",
        "guide.viscous_friction",
        "fibre.maxwell_branch",
    )
)
LAW: Any = type("Law", (), {"name": "fibre.law", "parameters": ("one",)})
BEFORE: Any = None
WORTH = 100.0
"""Nats that a law gains."""


def put(monkeypatch: pytest.MonkeyPatch, name: str, thing: Any) -> None:
    """Take the place of what the modules under test have by that name."""
    there = [module for module in (unnamed, complete_law) if hasattr(module, name)]
    assert there
    for module in there:
        monkeypatch.setattr(module, name, thing)


def alarm(nats: float) -> Alarm:
    """A test that sees so much beyond chance."""
    return Alarm("constancy", 1e-9, 1e-4, {"gain": 2.0 * nats + 9.0, "chance": 9})


class Drawn(str):
    """A free curve by what it is called."""

    probe: Any = PROBES[0]


class Looked(NamedTuple):
    """What slopes predict of the best free curve, and what of it their number cost."""

    promise: float
    price: float = 0.0

    def joined(self, other: Looked) -> Looked:
        return max(self, other)


class Bench:
    """Looks in which a law gains 100 nats, wherever it is weighed; alarms are as told for each model."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, **left: float) -> None:
        self.left, self.ports, self.searches = left, list[Any](), list[Any]()
        self.elsewhere, self.courses, self.courses_looked_at = 0.0, list[str](), 0
        self.curve = Drawn("a curve")
        self.gap, self.predicted, self.over_course = 1.0, 0.0, 0.0
        put(monkeypatch, "alarms_of", self.alarms)
        put(monkeypatch, "proposing", self.curves)
        put(monkeypatch, "proposed_by", lambda search, parent, looks: self.curves(None, None, None, PORTS))
        put(monkeypatch, "look_at", self.looked_at)
        self.held_by: dict[str, HeldLaw | None] = {}
        self.held: HeldLaw | None = HeldLaw(cast(Any, Model((LAW,), WORTH)), cast(Any, None), cast(Any, None))
        self.proposed_in: tuple[Any, Any] | None = None
        self.led = False
        self.needless = list[Any]()
        put(monkeypatch, "pruned", self.prune)
        put(monkeypatch, "held_laws", lambda *of: iter(filter(None, [self.hold(*of)])))
        put(monkeypatch, "described", lambda search, parent, held: "told")
        put(monkeypatch, "in_same_noise", self.same)
        put(monkeypatch, "in_one_noise", lambda search, parent, tried: self.same(search, parent, tried.found))
        put(monkeypatch, "overdispersion_corrected", lambda parent, one, factor: one)
        put(monkeypatch, "fitted_about", self.about)
        put(monkeypatch, "confirmed_where_it_settles", self.confirm)
        self.about_itself: tuple[float, float] | None = None
        self.second, self.least = 0.0, list[float]()
        self.slopes: dict[Any, float] = {HARDENING: 0.0}
        self.there = self.search()

    def alarms(self, search: Any, one: Model) -> list[Alarm]:
        self.searches.append(search)
        nats = self.left.get("+".join(one.names) or "base", 0.0)
        return [alarm(nats)] if nats else []

    def looked_at(self, search: Any, parent: Any, before: Any, ports: Any, *sets: Any) -> Looked:
        self.courses_looked_at += COURSES in sets
        return Looked(max(self.over_course if each is COURSES else self.predicted for each in sets or (PROBES,)))

    def curves(self, search: Any, parent: Any, before: Any, ports: Any, probes: Any = None) -> list[str]:
        if probes is COURSES:
            return list(self.courses)
        self.ports.append(set(ports))
        return [self.curve]

    def hold(self, search: Any, parent: Any, curves: Sequence[str]) -> HeldLaw | None:
        """A law of the best curve, compared there or where readings are linearised about the best of such laws."""
        held = self.held_by.get(str(curves[0]), self.held)
        proposal = Proposal(*(self.proposed_in or (search, parent)), [], cast(Any, curves), self.led)
        return held and held._replace(proposal=proposal)

    def prune(self, inference: Any, one: Model) -> Model:
        return replace(one, effects=tuple(effect for effect in one.effects if effect not in self.needless))

    def about(self, search: Any, other: Model, led: bool = False) -> Model:
        # A later round has another noise, in which nats count from elsewhere.
        return replace(other, log=other.log + self.elsewhere)

    def confirm(self, search: Any, parent: Any, law: Any) -> Any:
        """A law where readings are linearised about it: what it gains there, and what tests see left."""
        if self.about_itself is None:
            return None, 0.0
        gain, left = self.about_itself
        return Confirmation(self.there, replace(law, log=gain), cast(Any, BASE)), left

    def tried(self, parent: Model, effects: Any, what: str, least: float, near: Any = None) -> Any:
        """A second effect beside the first."""
        self.least.append(least)
        return SimpleNamespace(found=[Model((*parent.effects, *effects), self.second)], untried=())

    def search(self) -> Any:
        """Whose slopes predict of further effects what they are told to."""

        def predicted(parent: Any, slopes: Any, effects: Any, what: str, near: Any = None) -> dict[Any, Any]:
            return {effect: SimpleNamespace(promise=self.slopes[effect]) for effect in effects if effect in self.slopes}

        return SimpleNamespace(
            gap_left=lambda one: self.gap,
            lacks_little=lambda one, gained: little_is_missing(self.gap, gained),
            tried=self.tried,
            inference=SimpleNamespace(
                again=lambda one: one, slopes=lambda one: None, without=lambda one, rest: replace(one, effects=rest)
            ),
            extensions=lambda one: [each for each in self.slopes if each not in one.effects],
            swift_extensions=lambda one: [each for each in self.slopes if each not in one.effects],
            predicted_gains=predicted,
        )

    @staticmethod
    def same(search: Any, parent: Any, found: Sequence[Any]) -> Comparison:
        return Comparison(search, parent, tuple(sorted(found, key=lambda one: -one.log)))

    def asked(self, parent: Model, chosen: Model | None, seen: Confirmation | None = None) -> Any:
        comparison = Comparison(self.search(), cast(Any, parent), ())
        base = cast(Any, SimpleNamespace(effects=(), log=0.0, names=(), supermodel=SimpleNamespace(sensitivities=None)))
        return law_beside_choice(comparison, cast(Any, chosen), seen, Comparison(cast(Any, None), base, ()), BEFORE)


BASE = Model((), 0.0)


FAR = 1.5
"""Gap from which slopes say nothing of curves."""


@pytest.mark.parametrize(
    ("gain", "left", "fitted", "there"),
    [(17.0, 60.0, True, True), (17.0, 80.0, True, False), (90.0, 10.0, True, False), (17.0, 0.0, False, False)],
)
def test_a_law_has_to_gain_what_the_effect_does_and_what_is_left_beside_it(
    monkeypatch: pytest.MonkeyPatch, gain: float, left: float, fitted: bool, there: bool
) -> None:
    bench = Bench(monkeypatch, **{TOE.name: left})
    bench.gap = FAR
    found = bench.asked(BASE, Model((TOE,), gain))
    assert (bool(bench.ports), found is not None) == (fitted, there)
    if found is not None:
        assert (found.law[0].names, found.law[1], found.curves) == ((LAW.name,), "told", ["a curve"])


@pytest.mark.parametrize(("promised", "fitted"), [(PROMISING * 60.0, True), (PROMISING * 60.0 + 0.1, False)])
def test_a_further_effect_that_promises_what_is_left_is_tried_before_a_law(
    monkeypatch: pytest.MonkeyPatch, promised: float, fitted: bool
) -> None:
    bench = Bench(monkeypatch, **{TOE.name: 60.0})
    bench.gap, bench.slopes = FAR, {HARDENING: promised, OFFSET: -3.0}
    assert (bench.asked(BASE, Model((TOE,), 17.0)) is not None) is fitted
    assert bool(bench.ports) is fitted


@pytest.mark.parametrize(
    ("predicted", "gap", "fitted"),
    [
        (17.0 + NAMED + PRICE_OF_LOOKS + 0.1, 1.0, True),
        (17.0 + NAMED + PRICE_OF_LOOKS, 1.0, False),
        (500.0, 1.5, False),
    ],
)
def test_an_effect_that_gains_less_than_slopes_predict_of_a_curve_is_held_against_a_law(
    monkeypatch: pytest.MonkeyPatch, predicted: float, gap: float, fitted: bool
) -> None:
    bench = Bench(monkeypatch)
    bench.gap, bench.predicted = gap, predicted
    assert (bench.asked(BASE, Model((TOE,), 17.0)) is not None) is fitted
    assert len(bench.ports) == fitted


@pytest.mark.parametrize(
    ("curve", "effect", "fitted"), [(22.0, 21.9, True), (22.0, 22.0, False), (34.0, 500.0, False), (34.1, 500.0, True)]
)
def test_what_slopes_predict_of_a_curve_is_held_against_what_they_predict_of_the_effect(
    monkeypatch: pytest.MonkeyPatch, curve: float, effect: float, fitted: bool
) -> None:
    """Of one that gains nothing like it their prediction says nothing."""
    bench = Bench(monkeypatch)
    bench.predicted, bench.slopes[TOE] = curve + NAMED + PRICE_OF_LOOKS, effect
    assert (bench.asked(BASE, Model((TOE,), 17.0)) is not None) is fitted


@pytest.mark.parametrize(("curve", "fitted"), [(1.09, False), (1.11, True)])
def test_a_curve_that_promises_a_little_more_than_an_effect_is_no_sign_of_another_law(
    monkeypatch: pytest.MonkeyPatch, curve: float, fitted: bool
) -> None:
    """It was drawn over the tension where a friction grew with that, 2 % better, and the time ended before a law."""
    bench, gain = Bench(monkeypatch), 60.0 * NAMED
    bench.predicted, bench.slopes[TOE] = curve * gain + PRICE_OF_LOOKS, gain
    bench.asked(BASE, Model((TOE,), gain))
    assert bool(bench.ports) is fitted


@pytest.mark.parametrize(("further", "fitted"), [(PROMISING * 40.0, True), (PROMISING * 40.0 + 0.1, False)])
def test_a_further_effect_that_slopes_predict_half_of_a_curve_of_is_tried_before_that(
    monkeypatch: pytest.MonkeyPatch, further: float, fitted: bool
) -> None:
    """Of a lag and a drift of a gauge a curve promised 98 nats, the lag gained 52: a law took 78 s, a round took 20."""
    bench = Bench(monkeypatch)
    bench.predicted, bench.slopes = 57.0 + NAMED + PRICE_OF_LOOKS, {HARDENING: further}
    assert (bench.asked(BASE, Model((TOE,), 17.0)) is not None) is fitted
    assert bool(bench.ports) is fitted


@pytest.mark.parametrize(("predicted", "there"), [(0.0, False), (40.0, True), (80.0, False)])
def test_no_more_counts_as_left_beside_an_effect_than_slopes_said(
    monkeypatch: pytest.MonkeyPatch, predicted: float, there: bool
) -> None:
    """What linearised readings miss passes for something left, and a right law would have to gain that too."""
    bench = Bench(monkeypatch, **{TOE.name: 76.0})
    bench.predicted, bench.slopes[TOE] = predicted + 17.0 + NAMED + PRICE_OF_LOOKS, 0.0
    # Of the hundred that the law gains 73 are left beside the effect, the forms and the proof.
    assert (bench.asked(BASE, Model((TOE,), 17.0)) is not None) is there


@pytest.mark.parametrize(("predicted", "left"), [(500.0, 0.0), (0.0, 60.0)])
def test_an_effect_is_not_added_where_the_time_ends_before_a_curve_that_promises_more_was_drawn(
    monkeypatch: pytest.MonkeyPatch, predicted: float, left: float
) -> None:
    bench = Bench(monkeypatch, **{TOE.name: left})
    bench.predicted = predicted

    def late(*of: Any) -> None:
        raise OutOfTimeError

    put(monkeypatch, "proposing", late)
    if left:
        # A test objects to it by itself: with it the model is not complete, and so it is said.
        assert bench.asked(BASE, Model((TOE,), 17.0)) is None
    else:
        with pytest.raises(OutOfTimeError):
            bench.asked(BASE, Model((TOE,), 17.0))


@pytest.mark.parametrize(
    ("about_itself", "there"),
    [
        (None, False),  # inputs are exact, or a motion is lost there
        ((WORTH, 3.0), False),
        ((WORTH, 0.0), True),
        ((PRICE_OF_LOOKS + NAMED + 60.0 + 17.0, 0.0), False),  # what is left, and what the effect gains
        ((PRICE_OF_LOOKS + NAMED + 60.0 + 17.1, 0.0), True),
    ],
)
def test_a_law_to_which_tests_object_is_asked_with_readings_linearised_about_itself(
    monkeypatch: pytest.MonkeyPatch, about_itself: tuple[float, float] | None, there: bool
) -> None:
    bench = Bench(monkeypatch, **{TOE.name: 60.0, LAW.name: 9.0})
    bench.gap, bench.about_itself = FAR, about_itself
    found = bench.asked(BASE, Model((TOE,), 17.0))
    assert (found is not None) is there
    if found is not None:
        assert about_itself is not None
        assert (found.search, found.parent, found.law[0].log) == (bench.there, BASE, about_itself[0])


@pytest.mark.parametrize(
    ("worth", "measured", "about_itself", "there"),
    [
        (WORTH, False, None, True),  # inputs are exact: there is nothing to linearise
        (WORTH, True, None, False),  # no time was left to ask it about itself
        (WORTH, True, WORTH, True),
        (WORTH, True, 17.0 + NAMED + PRICE_OF_LOOKS, False),  # there it does no more than the effect does there
        (WORTH + BEYOND_DOUBT, True, None, True),
    ],
)
def test_a_law_that_gains_little_more_than_an_effect_is_asked_about_itself_on_a_measured_drive(
    monkeypatch: pytest.MonkeyPatch, worth: float, measured: bool, about_itself: float | None, there: bool
) -> None:
    """As an effect is: of one that is far better no bounce that is met elsewhere makes the difference."""
    bench = Bench(monkeypatch)
    bench.held = HeldLaw(cast(Any, Model((LAW,), worth)), cast(Any, None), cast(Any, None))
    bench.about_itself = None if about_itself is None else (about_itself, 0.0)
    parent: Any = Measured((), 0.0) if measured else BASE
    law = complete_law.law_of_curves(bench.there, parent, cast(Any, Model((TOE,), 17.0)), [drawn("fibre")], 0.0)
    assert (law is not None) is there


class Measured(Model):
    """A model whose readings are linearised in errors of its inputs."""

    @property
    def supermodel(self) -> Any:
        return SimpleNamespace(sensitivities=SimpleNamespace(far=False))


@pytest.mark.parametrize(("divided_off", "law"), [(0.0, True), (30.0, False)])
def test_what_slopes_predict_of_a_curve_is_held_against_an_undivided_gain(
    monkeypatch: pytest.MonkeyPatch, divided_off: float, law: bool
) -> None:
    """Of what is predicted no overdispersion is taken off: the law would be asked for in vain."""
    bench = Bench(monkeypatch)
    bench.predicted = 20.0 + NAMED + PRICE_OF_LOOKS + 20.0
    bench.slopes[TOE] = 0.0
    chosen = Model((TOE,), 20.0 - 1e-6, divided_off=divided_off)
    assert (bench.asked(BASE, chosen) is not None) is law


@pytest.mark.parametrize(("held_back", "asked"), [(False, True), (True, False)])
def test_no_law_of_what_comes_before_the_first_bounces_takes_the_place_of_two_effects(
    monkeypatch: pytest.MonkeyPatch, held_back: bool, asked: bool
) -> None:
    bench = Bench(monkeypatch)
    parent: Any = SimpleNamespace(supermodel=SimpleNamespace(sensitivities=SimpleNamespace(far=held_back)))
    first: Any = SimpleNamespace(search=bench.there, parent=parent)
    put(monkeypatch, "law_about", lambda *of: "a law")
    found = unnamed._law_instead(first, cast(Any, Model((TOE, HARDENING), 60.0)), BEFORE, {"fibre"})
    assert (found == "a law") is asked


@pytest.mark.parametrize(
    ("gain", "there_too", "there"),
    [(60.0, 0.0, True), (60.0, -50.0, True), (90.0, -80.0, False), (60.0, 40.0, False)],
)
def test_a_law_that_was_seen_about_itself_is_held_against_the_effect_there_and_where_that_was_found(
    monkeypatch: pytest.MonkeyPatch, gain: float, there_too: float, there: bool
) -> None:
    """Of two models the one that readings are linearised about is favoured: the law has to win in both places."""
    bench = Bench(monkeypatch, **{TOE.name: 17.0})
    parent = Model((), -5.0 if there_too >= 0.0 else 5.0)
    bench.gap, bench.elsewhere = FAR, there_too
    bench.proposed_in = bench.there, parent
    found = bench.asked(BASE, Model((TOE,), gain))
    needed = max(gain + there_too, parent.log + gain) + 17.0 + NAMED + PRICE_OF_LOOKS
    assert (needed < WORTH) is there is (found is not None)
    if found is not None:
        assert (found.search, found.parent) == bench.proposed_in


@pytest.mark.parametrize(
    ("needless", "left"), [((), (STRIBECK,)), ((STRIBECK,), ()), ((STRIBECK, LAW), (STRIBECK,)), ((LAW,), (STRIBECK,))]
)
def test_what_a_law_makes_needless_goes(
    monkeypatch: pytest.MonkeyPatch, needless: tuple[Any, ...], left: tuple[Any, ...]
) -> None:
    """As what a later effect makes needless does; a law itself never."""
    bench = Bench(monkeypatch, **{f"{STRIBECK.name}+{TOE.name}": 60.0})
    bench.gap, bench.needless = FAR, list(needless)
    bench.held = HeldLaw(cast(Any, Model((STRIBECK, LAW), WORTH)), cast(Any, None), cast(Any, None))
    found = bench.asked(Model((STRIBECK,), 0.0), Model((STRIBECK, TOE), 17.0))
    assert found is not None
    assert (found.parent.effects, found.law[0].effects) == (left, (*left, LAW))


def test_a_law_is_not_lost_with_the_time_that_what_it_makes_needless_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    def late(*of: Any) -> None:
        raise OutOfTimeError

    bench = Bench(monkeypatch, **{f"{STRIBECK.name}+{TOE.name}": 60.0})
    bench.gap, bench.held = FAR, HeldLaw(cast(Any, Model((STRIBECK, LAW), WORTH)), cast(Any, None), cast(Any, None))
    put(monkeypatch, "pruned", late)
    found = bench.asked(Model((STRIBECK,), 0.0), Model((STRIBECK, TOE), 17.0))
    assert found is not None
    assert found.law[0].effects == (STRIBECK, LAW)


@pytest.mark.parametrize("led", [True, False])
def test_an_effect_is_led_where_the_law_it_is_held_against_was(monkeypatch: pytest.MonkeyPatch, led: bool) -> None:
    said = list[bool]()

    def about(search: Any, other: Model, led: bool = False) -> Model:
        said.append(led)
        return other

    bench = Bench(monkeypatch, **{TOE.name: 17.0})
    bench.gap, bench.proposed_in, bench.led = FAR, (bench.there, Model((), 0.0)), led
    put(monkeypatch, "fitted_about", about)
    bench.asked(BASE, Model((TOE,), 50.0))
    assert said[0] is led


def test_where_no_effect_gains_enough_there_is_none_to_hold_a_law_against(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch, base=30.0)
    assert bench.asked(BASE, None) is None
    assert bench.ports == []


@pytest.mark.parametrize(
    ("curve", "effect", "there"),
    [(BEYOND_DOUBT + 20.0, 59.0, True), (BEYOND_DOUBT + 20.0, 61.0, False), (BEYOND_DOUBT, 0.0, False)],
)
def test_a_law_of_which_slopes_promise_twice_as_much_is_composed_before_effects_are_followed(
    monkeypatch: pytest.MonkeyPatch, curve: float, effect: float, there: bool
) -> None:
    """And only where that is beyond doubt: of little, the effects are soon asked."""
    bench = Bench(monkeypatch)
    bench.predicted, bench.slopes = curve, {HARDENING: effect, TOE: -4.0}
    found = law_before_effects(bench.search(), cast(Any, BASE), BEFORE)
    assert (found is not None) is there
    assert bool(bench.ports) is there


@pytest.mark.parametrize(
    ("state", "course", "effect", "looked", "there"),
    [
        (50.0, 566.0, 136.0, True, True),
        (50.0, 200.0, 136.0, True, False),
        (50.0, 566.0, 90.0, False, False),
        (120.0, 566.0, 90.0, True, True),
    ],
)
def test_curves_over_the_course_of_a_record_are_looked_at_where_something_is_promised_beyond_doubt(
    monkeypatch: pytest.MonkeyPatch, state: float, course: float, effect: float, looked: bool, there: bool
) -> None:
    bench = Bench(monkeypatch)
    bench.predicted, bench.over_course, bench.slopes = state, course, {HARDENING: effect}
    found = law_before_effects(bench.search(), cast(Any, BASE), BEFORE)
    assert bool(bench.courses_looked_at) is looked
    assert (found is not None) is there


@pytest.mark.parametrize(
    ("effect", "there"), [(WORTH - PRICE_OF_LOOKS - NAMED, False), (WORTH - PRICE_OF_LOOKS - NAMED - 0.1, True)]
)
def test_effects_that_come_near_a_law_are_asked_before_it_is_told(
    monkeypatch: pytest.MonkeyPatch, effect: float, there: bool
) -> None:
    """Of one slopes predicted a fifth of what it gained: those are not asked of which they predict hardly anything."""
    bench = Bench(monkeypatch)
    bench.predicted, bench.second = 500.0, effect
    put(monkeypatch, "_second_does_as_well", lambda found, best, near: False)
    found = law_before_effects(bench.search(), cast(Any, BASE), BEFORE)
    assert found is not None
    law, comparison = found
    assert (law is not None) is there
    assert bench.least == [pytest.approx(HARDLY * (WORTH - PRICE_OF_LOOKS - NAMED))]
    # What was found of effects is the round where there is no law.
    assert [one.log for one in comparison.found] == [effect]
    if law is not None:
        assert law.law[0].log == WORTH


@pytest.mark.parametrize(("share", "asked"), [(0.9 * PROMISING, False), (1.1 * PROMISING, True)])
@pytest.mark.parametrize("second", [False, True])
def test_a_further_effect_beside_one_that_does_half_of_a_law_is_asked_before_it_is_told(
    monkeypatch: pytest.MonkeyPatch, share: float, asked: bool, second: bool
) -> None:
    bench, beside = Bench(monkeypatch), list[float]()
    put(monkeypatch, "_second_does_as_well", lambda found, best, near: (beside.append(best.log), second)[1])
    bench.predicted, bench.second = 500.0, share * (WORTH - PRICE_OF_LOOKS - NAMED)
    found = law_before_effects(bench.search(), cast(Any, BASE), BEFORE)
    assert found is not None
    assert (found[0] is None) is (asked and second)
    assert beside == [bench.second] * asked


def test_a_law_is_not_lost_with_the_time_that_effects_against_it_need(monkeypatch: pytest.MonkeyPatch) -> None:
    """They are told as not tried."""

    def no_time(*of: Any) -> Any:
        raise OutOfTimeError

    bench = Bench(monkeypatch)
    bench.predicted = 500.0
    monkeypatch.setattr(bench, "tried", no_time)
    found = law_before_effects(bench.search(), cast(Any, BASE), BEFORE)
    assert found is not None
    assert found[1].untried == [HARDENING]


@pytest.mark.parametrize(
    ("effect", "known"), [(WORTH - PRICE_OF_LOOKS - NAMED, True), (WORTH - PRICE_OF_LOOKS - NAMED - 0.1, False)]
)
def test_effects_are_asked_where_a_law_was_found_before_it_is_told(
    monkeypatch: pytest.MonkeyPatch, effect: float, known: bool
) -> None:
    """Before the first bounces slopes predict nothing of an effect, the law of which is found in whole records."""
    bench = Bench(monkeypatch)
    bench.second = effect
    parent, law_there = cast(Any, Model((TOE,), 10.0)), cast(Any, Model((TOE, LAW), WORTH))
    law = Unnamed(bench.there, parent, (), (law_there, cast(Any, None)))
    found = effects_as_good(law)
    assert (found is not None) is known
    assert bench.least == [pytest.approx(PROMISING * (WORTH - PRICE_OF_LOOKS - NAMED - 10.0))]
    if found is not None:
        assert found.search is bench.there
        assert [one.names for one in found.found] == [(TOE.name, HARDENING.name)]


@pytest.mark.parametrize(("left", "gap"), [(4.0, FAR), (60.0, 1.0)])
def test_what_leaves_little_or_gains_more_than_slopes_predict_of_curves_is_added_first(
    monkeypatch: pytest.MonkeyPatch, left: float, gap: float
) -> None:
    bench = Bench(monkeypatch, **{TOE.name: left})
    bench.gap = gap
    assert bench.asked(BASE, Model((TOE,), 50.0)) is None
    assert bench.ports == []


@pytest.mark.parametrize(
    ("second", "there"), [(WORTH - PRICE_OF_LOOKS - NAMED, False), (WORTH - PRICE_OF_LOOKS - NAMED - 0.1, True)]
)
def test_two_effects_that_do_as_well_come_before_a_law_in_the_place_of_the_first(
    monkeypatch: pytest.MonkeyPatch, second: float, there: bool
) -> None:
    bench = Bench(monkeypatch)
    bench.predicted, bench.second = 500.0, second
    assert (bench.asked(BASE, Model((TOE,), 17.0)) is not None) is there
    assert bench.least == [pytest.approx(PROMISING * (WORTH - PRICE_OF_LOOKS - NAMED - 17.0))]


def drawn(port: str) -> Any:
    """A free curve of a port."""
    return SimpleNamespace(probe=next(probe for probe in PROBES if port_of(probe) == port))


@pytest.mark.parametrize(("left", "there"), [(60.0, True), (WORTH, False), (0.0, True)])
def test_a_law_beside_what_was_found_accounts_for_all_that_tests_see_left(
    monkeypatch: pytest.MonkeyPatch, left: float, there: bool
) -> None:
    bench = Bench(monkeypatch, base=left)
    found = unnamed.law_without_choice(cast(Any, Removing), cast(Any, BASE), BEFORE, [drawn("guide")])
    assert (found is not None) is there
    # Its curves are those at hand.
    assert bench.ports == []


def test_a_law_in_the_place_of_a_name_comes_before_one_beside_it(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    found = unnamed.law_without_choice(cast(Any, Removing), cast(Any, Model((TOE,), 20.0)), BEFORE, [drawn("fibre")])
    assert found is not None
    assert bench.ports == [{"fibre"}]
    assert found.parent.names == ()


def test_what_is_left_is_asked_where_readings_are_linearised_about_the_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch, **{TOE.name: 50.0})
    bench.gap = FAR
    there = Confirmation(bench.search(), cast(Any, Model((TOE,), 40.0)), cast(Any, BASE))
    assert bench.asked(BASE, Model((TOE,), 30.0), there) is not None
    assert bench.searches[0] is there.search


@pytest.mark.parametrize(
    ("first", "second", "ports"),
    [
        (TOE, HARDENING, {"fibre"}),
        (STRIBECK, LOAD, {"guide"}),
        (DRIFT, VISCOUS, {"guide"}),
        (MAXWELL, TOE, {"fibre"}),
        (TOE, STRIBECK, None),
        (OFFSET, GAIN, None),
    ],
)
def test_two_effects_of_one_place_are_held_against_one_law_of_it(
    monkeypatch: pytest.MonkeyPatch, first: Any, second: Any, ports: set[str] | None
) -> None:
    bench = Bench(monkeypatch)
    found = bench.asked(Model((first,), 60.0), Model((first, second), 80.0))
    assert bench.ports == ([] if ports is None else [ports])
    assert (found is not None) is (ports is not None)


@pytest.mark.parametrize(("less", "there"), [(PRICE_OF_LOOKS + NAMED + 0.1, True), (PRICE_OF_LOOKS + NAMED, False)])
def test_a_law_has_to_be_beyond_doubt_better_and_its_forms_are_paid_for(
    monkeypatch: pytest.MonkeyPatch, less: float, there: bool
) -> None:
    bench = Bench(monkeypatch)
    assert (bench.asked(Model((TOE,), 60.0), Model((TOE, HARDENING), WORTH - less)) is not None) is there


def test_two_effects_are_compared_in_the_noise_of_the_first_look_before_a_law_takes_their_place(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bench = Bench(monkeypatch)
    bench.elsewhere = 40_000.0
    assert bench.asked(Model((TOE,), 60.0 - 40_000.0), Model((TOE, HARDENING), WORTH - 1.0 - 40_000.0)) is None
    assert bench.asked(Model((TOE,), 60.0 - 40_000.0), Model((TOE, HARDENING), WORTH - 50.0 - 40_000.0)) is not None


def test_a_law_that_does_not_hold_on_left_out_records_takes_no_place(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    bench.held = None
    assert bench.asked(Model((TOE,), 60.0), Model((TOE, HARDENING), 80.0)) is None


def test_a_law_over_the_course_of_a_record_is_looked_for_where_none_over_a_state_does(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bench = Bench(monkeypatch)
    bench.held_by, bench.courses = {"a curve": None}, ["over time"]
    found = bench.asked(Model((TOE,), 60.0), Model((TOE, HARDENING), 80.0))
    assert found is not None
    assert found.curves == ["over time"]


def test_a_law_that_leaves_more_than_noise_takes_no_place(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch, **{LAW.name: 7.0})
    assert bench.asked(Model((TOE,), 60.0), Model((TOE, HARDENING), 80.0)) is None


class Removing:
    """A search whose models, with one effect less, are the base."""

    inference = SimpleNamespace(without=lambda best, rest: Model(tuple(rest), 0.0))


def in_place(monkeypatch: pytest.MonkeyPatch, gain: float, effects: Any = (TOE,), **left: float) -> Any:
    bench = Bench(monkeypatch, **left)
    found = unnamed.law_without_choice(cast(Any, Removing), cast(Any, Model(effects, gain)), BEFORE, [drawn("fibre")])
    return found if bench.ports else None


@pytest.mark.parametrize(("less", "there"), [(PRICE_OF_LOOKS + NAMED + 0.1, True), (PRICE_OF_LOOKS + NAMED, False)])
def test_a_name_is_lost_to_a_law_that_is_beyond_doubt_better(
    monkeypatch: pytest.MonkeyPatch, less: float, there: bool
) -> None:
    found = in_place(monkeypatch, WORTH - less)
    assert (found is not None) is there
    if found is not None:
        assert (found.law[0].names, found.parent.names) == ((LAW.name,), ())


def test_a_law_in_place_of_a_name_leaves_noise_and_more_than_what_is_left_beside_the_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert in_place(monkeypatch, WORTH - 20.0, **{LAW.name: 7.0}) is None
    assert in_place(monkeypatch, WORTH - 20.0, **{TOE.name: 15.0}) is None
    assert in_place(monkeypatch, 0.0, ()) is None


def test_a_name_that_no_curve_of_its_port_adds_to_is_held_against_no_law(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    unnamed.law_without_choice(cast(Any, Removing), cast(Any, Model((TOE,), WORTH - 20.0)), BEFORE, [drawn("guide")])
    assert bench.ports == []
