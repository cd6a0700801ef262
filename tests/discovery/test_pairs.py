"""When effects are tried two at a time, and what such a pair has to gain."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import ModuleType, SimpleNamespace
from typing import Any, cast
from unittest.mock import Mock

import pytest

from fibrefit.core.limits import OutOfTimeError
from fibrefit.discovery import choice, forward_selection, pairs
from fibrefit.discovery.comparison import Comparison
from fibrefit.discovery.engine.thresholds import BEYOND_DOUBT, NAMED
from fibrefit.discovery.forward_selection import Limits, Selection
from fibrefit.discovery.pairs import best_pair, incomplete
from fibrefit.discovery.search.search import Tried

own_pruned = pairs.pruned
EFFECTS: tuple[Any, ...] = tuple(
    type(letter, (), {"name": f"fibre.{letter}", "parameters": ("one",), "sudden": False}) for letter in "abcdefghijk"
)
A, B, C, D, E = EFFECTS[:5]


@dataclass(frozen=True)
class Model:
    """Effects and their evidence."""

    effects: tuple[Any, ...]
    log: float
    steps: int = 3
    divided_off: float = 0.0
    has_a_place: bool = True

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(effect.name for effect in self.effects)

    @property
    def evidence(self) -> Any:
        return SimpleNamespace(mode=SimpleNamespace(steps=self.steps))

    @property
    def supermodel(self) -> Any:
        return SimpleNamespace(sensitivities=None)

    @property
    def undivided(self) -> Model:
        return replace(self, log=self.log + self.divided_off, divided_off=0.0) if self.divided_off else self

    def with_log(self, log: float, divided_off: float = 0.0) -> Model:
        return replace(self, log=log, divided_off=divided_off)


floors: dict[Any, float] = {}
"""Nats that slopes had to predict beside an effect, when it was last tried."""


def round_of(gains: dict[Any, float], together: dict[tuple[Any, Any], float], asked: list[Any]) -> Comparison:
    """A first round in which effects gain so much one by one, and two together gain nothing beyond but as told."""

    def tried(first: Model, effects: Sequence[Any], what: str, least: float = -math.inf, near: Any = None) -> Tried:
        asked.extend((first.effects[0], effect) for effect in effects)
        floors[first.effects[0]] = least
        ends = [Model((*first.effects, e), together.get((first.effects[0], e), first.log - 4.0)) for e in effects]
        return Tried(cast("Any", ends), ())

    def others(first: Model) -> list[Any]:
        return [effect for effect in EFFECTS if effect not in first.effects]

    search: Any = SimpleNamespace(
        tried=tried,
        extensions=others,
        shares_a_program=EFFECTS[:9].__contains__,
        inference=None,
        lacks_little=lambda parent, gained: gained <= BEYOND_DOUBT,
    )
    found = sorted((Model((effect,), gain) for effect, gain in gains.items()), key=lambda one: -one.log)
    return Comparison(search, Model((), 0.0), tuple(found))  # type: ignore[arg-type]


def in_one_noise(monkeypatch: pytest.MonkeyPatch, module: ModuleType) -> None:
    """All that a module compares is in one noise already, and nothing is needless."""

    def same(search: Any, parent: Any, found: Sequence[Any]) -> Comparison:
        return Comparison(search, parent, tuple(sorted(found, key=lambda one: -one.log)))

    monkeypatch.setattr(module, "in_same_noise", same)
    monkeypatch.setattr(module, "fitted_about", lambda search, other: other)
    monkeypatch.setattr(module, "pruned", lambda inference, best: best)


@pytest.fixture(autouse=True)
def one_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    in_one_noise(monkeypatch, pairs)


GAINS = {effect: 240.0 - 10.0 * i for i, effect in enumerate(EFFECTS)}


def test_a_pair_of_effects_that_are_not_first_by_themselves_is_found() -> None:
    asked: list[Any] = []
    comparison = round_of(GAINS, {(B, C): 290.0}, asked)
    found = best_pair(comparison, comparison.found[0])
    assert found is not None
    assert found.found[0].names == (B.name, C.name)
    # Each two of the best eight, once, and each of them with a ninth that is quick to simulate.
    assert len(asked) == len(set(asked)) == 8 * 7 // 2 + 8
    assert {second for _, second in asked} == set(EFFECTS[1:9])


def test_what_has_no_place_is_the_second_of_its_pairs() -> None:
    """Nothing can be linearised beside an effect at infinity: its pairs are asked from the other one."""
    asked: list[Any] = []
    whole = round_of(GAINS, {(C, B): 290.0}, asked)
    nowhere = [replace(one, has_a_place=one.effects != (B,)) for one in cast(Any, whole.found)]
    found = best_pair(replace(whole, found=tuple(nowhere)), whole.found[0])
    assert found is not None
    assert found.found[0].names == (C.name, B.name)
    assert B not in {first for first, _ in asked}
    assert len(asked) == len({frozenset(pair) for pair in asked}) == 8 * 7 // 2 + 7


def test_an_effect_that_gains_nothing_by_itself_is_found_beside_another() -> None:
    comparison = round_of({effect: GAINS[effect] for effect in EFFECTS[:3]}, {(B, E): 310.0}, [])
    found = best_pair(comparison, comparison.found[0])
    assert found is not None
    assert found.found[0].names == (B.name, E.name)


@pytest.mark.parametrize("together", [240.0, 290.0])
def test_pairs_that_the_time_did_not_suffice_for_are_told_unless_another_is_found(
    monkeypatch: pytest.MonkeyPatch, together: float
) -> None:
    comparison = round_of(GAINS, {(B, C): together}, [])
    own = comparison.search.tried

    def ended(first: Any, *of: Any) -> Tried:
        if first.effects[0] is D:
            raise OutOfTimeError
        return own(first, *of)

    comparison.search.tried = ended  # type: ignore[method-assign]
    if together > 250.0:
        assert best_pair(comparison, comparison.found[0]) is not None
    else:
        with pytest.raises(OutOfTimeError):
            best_pair(comparison, comparison.found[0])


@pytest.mark.parametrize(("raw", "needed"), [(38.0, True), (9.0, False)])
def test_an_effect_is_needless_by_evidence_of_one_kind(
    monkeypatch: pytest.MonkeyPatch, raw: float, needed: bool
) -> None:
    """What was named has its gain divided by an overdispersion; what is left without an effect has not."""
    left, named = 47.0, Model((A, B), 47.0 + 3.7)
    inference: Any = SimpleNamespace(
        again=lambda one: replace(one, log=left + raw), without=lambda one, rest: Model(rest, left)
    )
    for one in (A, B):
        monkeypatch.setattr(one, "needs", (), raising=False)
    monkeypatch.setattr(pairs, "overdispersion_of", lambda *of: 2.0)
    monkeypatch.setattr(
        pairs,
        "overdispersion_corrected",
        lambda lesser, one, by: one.with_log(lesser.log + (one.log - lesser.log) / by),
    )
    assert (own_pruned(inference, cast("Any", named)).log == named.log) is needed


@pytest.mark.parametrize(("more", "there"), [(NAMED, False), (NAMED + 3.5, False), (NAMED + 3.7, True)])
def test_a_pair_has_to_gain_more_than_what_it_replaces_and_its_number_is_paid_for(more: float, there: bool) -> None:
    # The logarithm of 36 pairs is 3.6.
    comparison = round_of(GAINS, {(B, C): 240.0 + more}, [])
    assert (best_pair(comparison, comparison.found[0]) is not None) is there


def test_beside_an_effect_slopes_have_to_predict_half_of_what_it_is_behind() -> None:
    comparison = round_of(GAINS, {(B, C): 310.0}, [])
    assert best_pair(comparison, cast(Any, Model((A, E), 300.0))) is not None
    assert (floors[A], floors[C]) == (30.0, 40.0)


def test_a_pair_one_of_which_is_needless_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pairs, "pruned", lambda inference, best: replace(best, effects=best.effects[:1]))
    comparison = round_of(GAINS, {(B, C): 290.0}, [])
    assert best_pair(comparison, comparison.found[0]) is None


@pytest.mark.parametrize(("here", "there"), [(285.0, True), (299.0, True), (305.0, False)])
def test_two_found_one_after_the_other_are_compared_in_the_noise_of_the_pairs(
    monkeypatch: pytest.MonkeyPatch, here: float, there: bool
) -> None:
    # In the noise of a later round they have 40 000 nats less: that says nothing of them.
    later = cast(Any, Model((A, E), -39_700.0))
    comparison = round_of(GAINS, {(B, C): 300.0}, [])
    monkeypatch.setattr(pairs, "fitted_about", lambda search, other: replace(other, log=here))
    found = best_pair(comparison, later)
    assert (found is not None) is there
    if found is not None:
        assert [(one.names, one.log) for one in found.found[:2]] == [
            ((B.name, C.name), 300.0),
            ((A.name, E.name), here),
        ]


@pytest.mark.parametrize("better", [True, False])
def test_two_that_were_found_one_after_the_other_are_seen_with_the_first_exchanged(
    monkeypatch: pytest.MonkeyPatch, better: bool
) -> None:
    first = round_of(GAINS, {}, [])
    pair = Comparison(first.search, first.parent, (Model((D, B), 900.0),), frozenset({(D.name, B.name)}))  # type: ignore[arg-type]
    found = after_a_look(monkeypatch, first, first.found[0], False, 500.0, exchanged=pair if better else None)
    assert found == ((D.name, B.name) if better else (A.name, D.name), True)


@pytest.mark.parametrize(("alarm", "curve"), [(True, False), (False, True), (False, False)])
def test_alarms_and_curves_say_that_something_is_missing(
    monkeypatch: pytest.MonkeyPatch, alarm: bool, curve: bool
) -> None:
    monkeypatch.setattr(pairs, "alarms_of", lambda search, best: [object()] * alarm)
    monkeypatch.setattr(pairs, "curves_beyond", lambda *of: ["curve"] * curve)
    missing, curves = incomplete(round_of(GAINS, {}, []), SimpleNamespace())  # type: ignore[arg-type]
    assert (missing, curves) == (alarm or curve, ["curve"] * curve)


def test_where_no_time_was_left_for_curves_it_is_not_known_that_nothing_is_missing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def late(*of: Any) -> Any:
        raise OutOfTimeError

    monkeypatch.setattr(pairs, "alarms_of", lambda search, best: [])
    monkeypatch.setattr(pairs, "curves_beyond", late)
    assert incomplete(round_of(GAINS, {}, []), SimpleNamespace()) == (True, None)  # type: ignore[arg-type]


def test_a_pair_that_was_found_is_the_same_in_any_order(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of two that were found one after the other the second may be the better one by itself."""
    first = round_of(GAINS, {(B, C): 290.0}, [])
    monkeypatch.setattr(pairs, "pruned", lambda inference, best: best)
    assert best_pair(first, cast(Any, Model((C, B), 290.0))) is None
    other = best_pair(first, cast(Any, Model((C, D), 250.0)))
    assert other is not None
    assert other.found[0].names == (B.name, C.name)


def after_a_look(
    monkeypatch: pytest.MonkeyPatch,
    first: Comparison,
    best: Any,
    missing: bool,
    gain: float = 1.0,
    paired: bool = False,
    exchanged: Comparison | None = None,
    law: Any = None,
    instead: Any = None,
    gained: float = math.inf,
    known: Comparison | None = None,
) -> tuple[tuple[str, ...], bool]:
    """Effects after a round in which the best further one gains so much, and whether any are new."""
    nothing = Comparison(first.search, best, (Model((*best.effects, D), best.log + gain),))  # type: ignore[arg-type]
    monkeypatch.setattr(forward_selection, "relinearised", lambda search, best: None)
    monkeypatch.setattr(choice, "confirmed", lambda search, parent, found: None)
    names = nothing.found[0].names
    monkeypatch.setattr(forward_selection, "comparison_of", lambda *of: replace(nothing, compared=frozenset({names})))
    monkeypatch.setattr(forward_selection, "incomplete", lambda comparison, before: (missing, ["curve"]))
    monkeypatch.setattr(forward_selection, "_near", lambda *of: None)
    monkeypatch.setattr(forward_selection, "law_before_effects", lambda *of: None)
    monkeypatch.setattr(forward_selection, "law_beside_choice", Mock(side_effect=[law]))
    monkeypatch.setattr(forward_selection, "law_without_choice", lambda *of: instead)
    monkeypatch.setattr(forward_selection, "effects_as_good", lambda law: known)
    monkeypatch.setattr(forward_selection, "_round", lambda *of: SimpleNamespace(added=""))
    monkeypatch.setattr(forward_selection, "rivals_of", lambda *of: ())
    monkeypatch.setattr(forward_selection, "pruned", lambda inference, best: best)
    monkeypatch.setattr(forward_selection, "with_exchanges", lambda single, last, found, rivals: exchanged)
    monkeypatch.setattr(forward_selection, "is_better", lambda models, found: True)
    at = Selection(first.search, best, singles=first, comparison=first, paired=paired, gained=(gained,))
    after, grown = forward_selection._further(at, SimpleNamespace(), Limits())  # type: ignore[arg-type]
    return after.best.names, grown


def test_a_law_of_no_name_ends_the_search_without_effects(monkeypatch: pytest.MonkeyPatch) -> None:
    first = round_of(GAINS, {(B, C): 290.0}, [])
    law = SimpleNamespace(search=first.search, parent=first.parent, curves=["curve"], law=("model", "told"))
    assert after_a_look(monkeypatch, first, first.found[0], True, gain=8.0, law=law) == ((), False)


@pytest.mark.parametrize("beside", [True, False])
def test_an_effect_that_makes_the_records_as_probable_as_a_law_is_added_in_its_place(
    monkeypatch: pytest.MonkeyPatch, beside: bool
) -> None:
    """Beside a name, and in the place of one: what the law stands beside is what the effect is added to."""
    first = round_of(GAINS, {(B, C): 290.0}, [])
    parent: Any = first.found[0] if beside else first.parent
    law = SimpleNamespace(search=first.search, parent=parent, curves=["curve"], law=("model", "told"))
    as_good = Model((*parent.effects, E), parent.log + 60.0)
    known = Comparison(first.search, parent, (as_good,), frozenset({as_good.names}))  # type: ignore[arg-type]
    for how in ({"gain": 8.0, "law": law}, {"instead": law}):
        found = after_a_look(monkeypatch, first, first.found[0], True, known=known, **how)
        assert found == (as_good.names, True)


def test_an_effect_is_not_added_where_the_time_ends_before_a_law_that_promises_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    first = round_of(GAINS, {}, [])
    best = first.found[0]
    assert after_a_look(monkeypatch, first, best, False, 500.0) == ((A.name, D.name), True)
    assert after_a_look(monkeypatch, first, best, False, 500.0, law=OutOfTimeError()) == ((A.name,), False)


def test_a_law_is_tried_before_pairs_where_no_effect_gains_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []
    first = round_of(GAINS, {(B, C): 290.0}, asked)
    law = SimpleNamespace(search=first.search, parent=first.parent, curves=["curve"], law=("model", "told"))
    assert after_a_look(monkeypatch, first, first.found[0], True, instead=law) == ((), False)
    assert asked == []


@pytest.mark.parametrize(("pair", "added"), [((A, B), False), ((B, A), False), ((A, C), True)])
def test_a_pair_that_is_there_already_is_not_added_once_more(
    monkeypatch: pytest.MonkeyPatch, pair: tuple[Any, ...], added: bool
) -> None:
    first = round_of(GAINS, {}, [])
    at = Selection(first.search, cast(Any, Model((A, B), 300.0)), comparison=first)
    found = forward_selection.Believed(first, None, None)
    both = forward_selection.Believed(first, cast(Any, Model(pair, 301.0)), None)
    monkeypatch.setattr(forward_selection, "best_pair", lambda *of: first)
    monkeypatch.setattr(forward_selection, "believed", lambda *of: both)
    after, told = forward_selection._together(at, found, first, Limits())
    assert after.paired
    assert told is (both if added else found)


@pytest.mark.parametrize(("missing", "names"), [(True, (B.name, C.name)), (False, (A.name,))])
def test_a_pair_takes_the_place_of_one_in_a_wrong_minimum_where_something_is_missing(
    monkeypatch: pytest.MonkeyPatch, missing: bool, names: tuple[str, ...]
) -> None:
    first = round_of(GAINS, {(B, C): 290.0}, [])
    assert after_a_look(monkeypatch, first, first.found[0], missing) == (names, missing)


@pytest.mark.parametrize(
    ("log", "paired", "replaced"),
    # 290 or less: two that were found are one of the pairs, and the best of them is taken.
    [(270.0, False, True), (288.0, False, True), (291.0, False, False), (270.0, True, False)],
)
def test_a_pair_takes_the_place_of_two_that_were_found_one_after_the_other(
    monkeypatch: pytest.MonkeyPatch, log: float, paired: bool, replaced: bool
) -> None:
    first, stand_in = round_of(GAINS, {(B, C): 290.0}, []), Model((A, E), log)
    expected = ((B.name, C.name), True) if replaced else (stand_in.names, False)
    assert after_a_look(monkeypatch, first, stand_in, True, paired=paired) == expected


@pytest.mark.parametrize(("gained", "replaced"), [(10.0, True), (BEYOND_DOUBT + 1.0, False)])
def test_a_second_effect_that_gained_little_is_held_against_pairs_once_nothing_more_is_found(
    monkeypatch: pytest.MonkeyPatch, gained: float, replaced: bool
) -> None:
    """The first may stand in for two others, and the second for what it does otherwise than they."""
    asked: list[Any] = []
    first, stand_in = round_of(GAINS, {(B, C): 290.0}, asked), Model((A, E), 270.0)
    found = after_a_look(monkeypatch, first, stand_in, False, gained=gained)
    assert found == ((B.name, C.name) if replaced else stand_in.names, replaced)
    assert bool(asked) is replaced


def test_what_is_found_next_comes_before_such_a_doubt(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []
    first = round_of(GAINS, {(B, C): 290.0}, asked)
    assert after_a_look(monkeypatch, first, Model((A, E), 270.0), False, 10.0, gained=10.0) == (
        (A.name, E.name, D.name),
        True,
    )
    assert asked == []
