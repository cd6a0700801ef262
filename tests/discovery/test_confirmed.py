"""Where inputs have errors, gains are believed where readings are linearised about what gains them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest

from fibrefit.core.limits import Budget, check_time, time_limit
from fibrefit.discovery import choice, comparison, final_fit, forward_selection
from fibrefit.discovery.choice import believed
from fibrefit.discovery.engine.thresholds import NAMED
from fibrefit.discovery.forward_selection import Limits, Selection, _further
from fibrefit.discovery.search import inputs, setup
from fibrefit.discovery.search.inputs import Confirmation
from fibrefit.fitting.search import rescue
from fibrefit.report.sentences.discovery import discovery_sentence
from tests.discovery.test_pairs import Model, round_of

A, B, C = (type(letter, (), {"name": f"fibre.{letter}", "parameters": ("one",), "sudden": False}) for letter in "abc")
FIRST: dict[Any, float] = {A: 60.0, B: 40.0, C: 2.0}


def with_log(self: Model, log: float, divided_off: float = 0.0) -> Model:
    return replace(self, log=log)


@pytest.fixture(autouse=True)
def fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Model, "with_log", with_log, raising=False)
    followed = SimpleNamespace(mode=SimpleNamespace(steps=1))
    monkeypatch.setattr(Model, "evidence", followed, raising=False)


def with_gaps(search: Any, gaps: dict[tuple[str, ...], float] | None = None) -> Any:
    """A search in which hypotheses leave these gaps, by their names; 1 where nothing is said."""
    told = {"gap_left": lambda one: (gaps or {}).get(one.names, 1.0), "inference": None}
    return SimpleNamespace(**(vars(search) | told))


def first_round(moved: bool = False) -> Any:
    ranked = round_of(FIRST, {}, [])
    return replace(
        ranked, search=with_gaps(ranked.search), compared=frozenset(one.names for one in ranked.found), moved=moved
    )


def confirmation(monkeypatch: pytest.MonkeyPatch, gains: dict[Any, float]) -> list[str]:
    """What each effect gains about itself; the names that were asked for."""
    asked: list[str] = []

    def confirmed(search: Any, parent: Model, found: Model) -> Confirmation:
        asked.append(found.names[-1])
        assert len(asked) < 10, "asked without end"
        gain = gains[found.effects[-1]]
        return Confirmation(search, replace(found, log=1000.0), replace(parent, log=1000.0 - gain))  # type: ignore[arg-type]

    monkeypatch.setattr(choice, "confirmed", confirmed)
    seen_from_there(monkeypatch, {})
    return asked


def seen_from_there(monkeypatch: pytest.MonkeyPatch, gains: dict[Any, dict[Any, float]]) -> None:
    """What others gain where readings are linearised about an effect; nothing where nothing is said."""

    def about(search: Any, other: Model, led: bool) -> Model:
        last = search.about[-1]
        return replace(other, log=search.parent.log + gains.get(last, {}).get(other.effects[-1], 0.0))

    def compared(ranked: Any, seen: Any) -> Any:
        search = SimpleNamespace(**(vars(seen.search) | {"about": seen.found.effects, "parent": seen.parent}))
        return own(ranked, replace(seen, search=search))

    own = comparison.compared_about
    monkeypatch.setattr(comparison, "fitted_about", about)
    monkeypatch.setattr(comparison, "overdispersion_of", lambda inference, parent, one: 1.0)
    monkeypatch.setattr(comparison, "overdispersion_corrected", lambda parent, one, overdispersion: one)
    monkeypatch.setattr(choice, "compared_about", compared)


def test_what_gains_about_itself_is_taken_and_the_next_is_not_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = confirmation(monkeypatch, {A: 30.0})
    found = believed(first_round(), None)
    assert found.chosen is not None
    assert found.chosen.names == (A.name,)
    assert found.seen is not None
    assert found.seen.gain == 30.0
    assert asked == [A.name]


def test_what_gains_only_about_another_model_is_passed_over_and_told_with_what_is_left_of_its_gain(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    confirmation(monkeypatch, {A: NAMED - 0.1, B: 35.0})
    found = believed(first_round(), None)
    assert found.chosen is not None
    assert found.chosen.names == (B.name,)
    assert {one.names[0]: found.comparison.gain(one) for one in found.comparison.found} == {
        B.name: 35.0, A.name: pytest.approx(NAMED - 0.1), C.name: 2.0,
    }  # fmt: skip


def test_where_none_is_believed_nothing_is_added(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = confirmation(monkeypatch, {A: 1.0, B: -3.0})
    assert believed(first_round(), None).chosen is None
    assert asked == [A.name, B.name]


def test_the_simpler_of_two_is_not_asked_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    """Passed over, it is still as near to the first as what is simpler is taken for."""
    ranked = first_round()
    near = [replace(one, log={A: 6.5, B: 6.0, C: 2.0}[one.effects[0]]) for one in ranked.found]
    monkeypatch.setattr(A, "name", "guide.a")
    monkeypatch.setattr(B, "name", "study.b")
    asked = confirmation(monkeypatch, {A: 4.8, B: 4.5})
    found = believed(replace(ranked, found=tuple(near), compared=frozenset(one.names for one in near)), None)
    assert found.chosen is None
    assert asked == ["study.b", "guide.a"]


def test_when_the_time_is_over_the_first_is_asked_about_and_no_further_one(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = confirmation(monkeypatch, {A: 1.0, B: 30.0})
    own = choice.confirmed

    def confirmed(*of: Any) -> Confirmation | None:
        check_time()
        return own(*of)

    monkeypatch.setattr(choice, "confirmed", confirmed)
    with time_limit(0.0):
        assert believed(first_round(), None).chosen is None
    assert asked == [A.name]
    confirmation(monkeypatch, {A: 30.0})
    monkeypatch.setattr(choice, "confirmed", lambda *of, own=choice.confirmed: (check_time(), own(*of))[1])
    with time_limit(0.0):
        assert believed(first_round(), None).chosen is not None


@pytest.mark.parametrize(("gain", "asks"), [(60.0, True), (130.0, False)])
def test_what_is_beyond_doubt_is_not_asked_where_the_time_left_is_short_of_that(
    monkeypatch: pytest.MonkeyPatch, gain: float, asks: bool
) -> None:
    asked = confirmation(monkeypatch, {A: gain})
    ranked = first_round()
    alone = replace(ranked.found[0], log=gain)
    ranked = replace(ranked, found=(alone,), compared=frozenset({alone.names}), seconds=50.0)
    with time_limit(20.0):
        found = believed(ranked, None)
    assert found.chosen is not None
    assert bool(asked) is asks
    with time_limit(80.0):
        believed(ranked, None)
    assert asked


@pytest.mark.parametrize(("exact", "gain", "kept"), [(True, 60.0, True), (False, 60.0, False), (False, 130.0, True)])
def test_where_a_motion_is_lost_about_a_candidate_its_gain_has_to_be_beyond_doubt(
    monkeypatch: pytest.MonkeyPatch, exact: bool, gain: float, kept: bool
) -> None:
    monkeypatch.setattr(Model, "supermodel", SimpleNamespace(sensitivities=None if exact else ()), raising=False)
    monkeypatch.setattr(choice, "confirmed", lambda *of: None)
    ranked = first_round()
    (first, *_) = ranked.found
    alone = replace(first, log=gain)
    found = believed(replace(ranked, found=(alone,), compared=frozenset({alone.names})), None)
    assert (found.chosen is not None) is kept
    assert found.comparison.gain(found.comparison.found[0]) == (gain if kept else 0.0)


def test_the_best_is_the_one_that_is_so_where_readings_are_linearised_about_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """A gains most about the parent; about A, B does better, and about B it still does."""
    asked = confirmation(monkeypatch, {A: 30.0, B: 45.0})
    seen_from_there(monkeypatch, {A: {B: 44.0}, B: {A: 31.0}})
    found = believed(first_round(), None)
    assert found.chosen is not None
    assert found.seen is not None
    assert found.chosen.names == found.seen.found.names == (B.name,)
    assert asked == [A.name, B.name]
    gains = {one.names[0]: found.comparison.gain(one) for one in found.comparison.found}
    assert gains == {B.name: pytest.approx(45.0), A.name: pytest.approx(31.0), C.name: pytest.approx(2.0)}
    assert found.comparison.compared == {(A.name,), (B.name,)}


def test_gaps_seen_about_another_model_are_told_as_shares_of_the_gap(monkeypatch: pytest.MonkeyPatch) -> None:
    """C was seen about the parent alone, where errors of inputs take most of any gap along."""
    about_parent = {(): 0.9, (A.name,): 0.6, (B.name,): 0.7, (C.name,): 0.81}
    ranked = replace(first_round(), search=with_gaps(SimpleNamespace(), about_parent))
    seen_from_there(monkeypatch, {A: {B: 20.0}})
    about_a = with_gaps(SimpleNamespace(), {(): 1.3, (A.name,): 1.0, (B.name,): 1.1})
    seen = Confirmation(about_a, cast(Any, Model((A,), 30.0)), cast(Any, Model((), 0.0)))
    found = choice.compared_about(ranked, seen)
    assert found is not None
    gaps = {one.names[0]: found.gap_of(one) for one in found.found}
    assert gaps == pytest.approx({A.name: 1.0, B.name: 1.1, C.name: 1.3 * 0.81 / 0.9})


@pytest.mark.parametrize("led", [True, False])
def test_rivals_are_led_where_the_one_they_are_held_against_was(monkeypatch: pytest.MonkeyPatch, led: bool) -> None:
    """Where it was before the first bounces no rival meets the later ones, however right it is."""
    said = list[bool]()

    def about(search: Any, other: Model, led: bool) -> Model:
        said.append(led)
        return other

    seen_from_there(monkeypatch, {})
    monkeypatch.setattr(comparison, "fitted_about", about)
    here = with_gaps(SimpleNamespace(inference=None), {})
    seen = Confirmation(here, cast(Any, Model((A,), 30.0)), cast(Any, Model((), 0.0)), led=led)
    comparison._about(seen, cast(Any, Model((B,), 20.0)))
    assert said == [led]


@pytest.mark.parametrize(("about_a", "about_b", "taken"), [(44.0, 44.0, B), (31.0, 44.0, A), (44.0, 31.0, B)])
def test_of_two_that_each_win_about_the_other_the_one_that_is_behind_by_less_is_taken(
    monkeypatch: pytest.MonkeyPatch, about_a: float, about_b: float, taken: Any
) -> None:
    """Of a viscous friction a drag was 15 nats before it about that, and 505 behind it about itself; it was named."""
    asked = confirmation(monkeypatch, {A: 30.0, B: 30.0})
    seen_from_there(monkeypatch, {A: {B: about_a}, B: {A: about_b}})
    found = believed(first_round(), None)
    assert asked == [A.name, B.name]
    assert found.seen is not None
    assert found.chosen is not None
    assert found.seen.found.names == found.chosen.names == (taken.name,)


def test_what_is_better_about_another_but_nothing_about_itself_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    confirmation(monkeypatch, {A: 30.0, B: 1.0})
    seen_from_there(monkeypatch, {A: {B: 44.0}})
    found = believed(first_round(), None)
    assert found.seen is not None
    assert found.seen.found.names == (A.name,)


def test_what_a_person_chooses_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    confirmation(monkeypatch, {B: -3.0})
    monkeypatch.setattr(choice, "candidates", lambda ranked: ())
    found = believed(first_round(), lambda ranking: B.name)
    assert found.chosen is not None
    assert found.chosen.names == (B.name,)


@pytest.mark.parametrize("moved", [True, False])
def test_a_parent_that_was_led_elsewhere_is_tested_where_readings_are_linearised_about_it(
    monkeypatch: pytest.MonkeyPatch, moved: bool
) -> None:
    confirmation(monkeypatch, {A: 1.0, B: 1.0})
    there, searched = Model((), 5.0), SimpleNamespace(inference=None)
    monkeypatch.setattr(forward_selection, "comparison_of", lambda *of: first_round(moved))
    monkeypatch.setattr(forward_selection, "relinearised", lambda search, best: (searched, there))
    monkeypatch.setattr(forward_selection, "alarms_of", lambda search, one: [])
    monkeypatch.setattr(Model, "supermodel", SimpleNamespace(sensitivities=SimpleNamespace(far=False)))
    tested: list[Any] = []

    def incomplete(ranked: Any, before: Any) -> tuple[bool, list[Any]]:
        tested.append(ranked.parent)
        return False, []

    monkeypatch.setattr(forward_selection, "incomplete", incomplete)
    monkeypatch.setattr(forward_selection, "law_before_effects", lambda *of: None)
    monkeypatch.setattr(forward_selection, "law_beside_choice", lambda ranked, *of: tested.append(ranked.parent))
    monkeypatch.setattr(forward_selection, "law_without_choice", lambda *of: None)
    ranked = first_round()
    after, grown = _further(Selection(ranked.search, ranked.parent), SimpleNamespace(), Limits())  # type: ignore[arg-type]
    assert not grown
    assert (after.best is there, after.search is searched) == (moved, moved)
    assert (tested == [there, there]) is moved


@pytest.mark.parametrize(
    ("after", "cut", "exact", "kept", "told"),
    [
        (1.2, False, False, True, ""),
        (3.0, False, False, False, "loses a bounce of b.csv: the normalised residual RMS there rises from 1 to 3"),
        (3.0, True, False, True, ""),
        (1.05, False, True, True, ""),
        (3.0, False, True, True, "with a normalised residual RMS of 1.01; the final fit ends at 3"),
    ],
)
def test_what_a_fit_loses_the_motion_with_is_taken_out_where_inputs_are_not_exact(
    monkeypatch: pytest.MonkeyPatch, after: float, cut: bool, exact: bool, kept: bool, told: str
) -> None:
    before, ended = (
        SimpleNamespace(
            gap=gap, record_gaps={"a.csv": 1.0, "b.csv": gap}, checks=(), cut_short=cut, running=1.0, input_errors={}
        )
        for gap in (1.0, after)
    )
    monkeypatch.setattr(final_fit, "final_fit", lambda *of: ended)
    monkeypatch.setattr(final_fit, "total", lambda gap: gap)
    monkeypatch.setattr(rescue, "total", lambda gap: gap)
    seen = SimpleNamespace(sensitivities=None if exact else ())
    monkeypatch.setattr(Model, "supermodel", seen, raising=False)
    inference = SimpleNamespace(without=lambda one, effects: Model(effects, 0.0))
    search: Any = SimpleNamespace(inference=inference, gap_left=lambda one: 1.01)
    best, fit, said = final_fit.fit_of_found(
        search, cast(Any, Model((A,), 40.0)), cast(Any, before), Limits(), Budget(100.0), 0.0
    )
    assert best.names == ((A.name,) if kept else ())
    assert fit is (ended if kept else before)
    assert bool(said) is bool(told)
    assert all(told in discovery_sentence(one) for one in said)


FIRST_LOSES, SECOND_LOSES, IN_DOUBT = "first", "second", "in doubt"


@pytest.mark.parametrize("which", [FIRST_LOSES, SECOND_LOSES, IN_DOUBT])
def test_what_loses_a_bounce_without_those_added_later_is_to_blame(monkeypatch: pytest.MonkeyPatch, which: str) -> None:
    """Where the time ends in the fit without the one that was added later, it is not known which of them is."""
    gaps = {(): 1.0, (A.name,): 1.0 if which == SECOND_LOSES else 3.0, (A.name, B.name): 3.0}

    def fit(search: Any, best: Any, *of: Any) -> Any:
        gap, cut = gaps[best.names], which == IN_DOUBT and best.names == (A.name,)
        return SimpleNamespace(gap=gap, record_gaps={"a.csv": gap}, checks=(), cut_short=cut)

    monkeypatch.setattr(final_fit, "final_fit", fit)
    monkeypatch.setattr(final_fit, "total", lambda gap: gap)
    monkeypatch.setattr(rescue, "total", lambda gap: gap)
    monkeypatch.setattr(Model, "supermodel", SimpleNamespace(sensitivities=()), raising=False)
    search: Any = SimpleNamespace(inference=SimpleNamespace(without=lambda one, effects: Model(effects, 0.0)))
    before: Any = SimpleNamespace(record_gaps={"a.csv": 1.0})
    best, _, said = final_fit.fit_of_found(search, cast(Any, Model((A, B), 40.0)), before, Limits(), Budget(100.0), 0.0)
    (told,) = (discovery_sentence(one) for one in said)
    assert best.names == (() if which == FIRST_LOSES else (A.name,))
    blamed = {FIRST_LOSES: A.name, SECOND_LOSES: B.name, IN_DOUBT: f"{A.name} and {B.name}"}[which]
    assert told.startswith(f"A fit with {blamed} loses a bounce of a.csv")
    ends = {
        FIRST_LOSES: f"{B.name} was added later, and was not fitted without it.",
        SECOND_LOSES: "so it is not what is missing.",
        IN_DOUBT: f"Which of them does is not known: the time ended in the fit without {B.name}.",
    }
    assert told.endswith(ends[which])


@pytest.mark.parametrize(
    ("lost", "held_back", "found", "anew"),
    [(2.0, False, 1.0, True), (2.0, True, 1.0, False), (1.0, False, 1.0, False), (2.0, False, 2.5, False)],
)
def test_where_the_first_fit_lost_a_motion_that_the_search_found_the_model_is_fitted_again(
    monkeypatch: pytest.MonkeyPatch, lost: float, held_back: bool, found: float, anew: bool
) -> None:
    """Nothing is missing of whole records then, and not only of what comes before their first bounces."""
    before, ended = (SimpleNamespace(gap=gap, expected_gap=1.0, input_errors={"drive": 1.0}) for gap in (lost, found))
    monkeypatch.setattr(setup, "total", lambda gap: gap)
    monkeypatch.setattr(final_fit, "total", lambda gap: gap)
    monkeypatch.setattr(final_fit, "final_fit", lambda *of: ended)
    best: Any = SimpleNamespace(effects=(), supermodel=SimpleNamespace(sensitivities=SimpleNamespace(far=held_back)))
    nothing = cast(Any, None)
    fit = final_fit.fit_without_effects(nothing, best, cast(Any, before), Limits(), Budget(60.0))
    assert fit is (ended if anew else before)


@pytest.mark.parametrize(
    ("far", "rms", "comes", "moved"),
    [(True, 2.0, True, True), (True, 2.0, False, False), (True, 4.0, True, False), (False, 2.0, True, False)],
)
def test_a_model_that_leads_through_bounces_which_its_first_fit_lost_is_asked_about_whole_records(
    monkeypatch: pytest.MonkeyPatch, far: bool, rms: float, comes: bool, moved: bool
) -> None:
    """Where it meets them all in plain squares (MET), and loses no motion with errors of the inputs."""
    ahead, asked = SimpleNamespace(fit=SimpleNamespace(cost=100 * rms**2)), list[Any]()
    monkeypatch.setattr(inputs, "through_all_bounces", lambda search, plain: ahead)

    def relinearised(search: Any, held: Any, lead: bool) -> Any:
        asked.append(lead)
        return ("there", "the model", True) if comes else None

    monkeypatch.setattr(inputs, "_relinearised", relinearised)
    task = SimpleNamespace(problem=SimpleNamespace(n_measured=100))
    search: Any = SimpleNamespace(plain=lambda held: held, task=task)
    held: Any = SimpleNamespace(supermodel=SimpleNamespace(sensitivities=SimpleNamespace(far=far)))
    assert inputs.led_through_bounces(search, held) == (("there", "the model") if moved else None)
    assert asked == ([True] if far and rms < 3.0 else [])


@pytest.mark.parametrize(("slower", "searched"), [(2.0, True), (12.0, False)])
def test_a_final_fit_whose_simulations_are_slow_begins_where_the_search_ended(
    monkeypatch: pytest.MonkeyPatch, slower: float, searched: bool
) -> None:
    asked: list[int] = []
    before: Any = SimpleNamespace(gap=1.0, record_gaps={"a.csv": 1.0}, checks=(), cut_short=False, running=2.0)
    monkeypatch.setattr(final_fit, "final_fit", lambda search, best, starts, *of: asked.append(starts) or before)
    monkeypatch.setattr(final_fit, "slowdown", lambda *of: slower)
    monkeypatch.setattr(final_fit, "total", lambda gap: gap)
    best = cast(Any, Model((A,), 40.0))
    longer = final_fit.takes_longer(cast(Any, None), best, before)
    final_fit.fit_of_found(cast(Any, None), best, before, Limits(), Budget(60.0), longer)
    assert [bool(starts) for starts in asked] == [searched]


@pytest.mark.parametrize(
    ("moved", "objects", "anew"), [(False, True, True), (True, False, True), (False, False, False)]
)
def test_a_model_that_a_test_objects_to_is_tested_about_itself(
    monkeypatch: pytest.MonkeyPatch, moved: bool, objects: bool, anew: bool
) -> None:
    """What readings linearised in errors of their inputs miss looks like a change of the parameters."""
    first = first_round(moved)
    parent: Any = SimpleNamespace(supermodel=SimpleNamespace(sensitivities=SimpleNamespace(far=False)), names=())
    first = replace(first, parent=parent)
    monkeypatch.setattr(forward_selection, "alarms_of", lambda search, one: [SimpleNamespace(nats=50.0)] * objects)
    monkeypatch.setattr(forward_selection, "relinearised", lambda search, one: ("there", one))
    at = Selection(search=first.search, best=parent)
    found = SimpleNamespace(chosen=None, comparison=first, _replace=lambda comparison: comparison)
    after, _ = forward_selection._where_it_is(at, cast(Any, found))
    assert (after.search == "there") is anew
