"""What is believed of candidates where the time ends before they are compared in one noise."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.core.limits import OutOfTimeError, check_time, time_limit
from fibrefit.discovery import choice, comparison
from fibrefit.discovery.choice import chosen_of
from fibrefit.discovery.engine.thresholds import BEYOND_DOUBT, NAMED, PRICE, Chance
from fibrefit.discovery.forward_selection import Selection, _near
from fibrefit.discovery.search.base import SearchState
from fibrefit.discovery.search.search import Tried
from fibrefit.discovery.search.starts import little_is_missing
from fibrefit.laws.catalogue import CATALOGUE
from tests.discovery.test_pairs import EFFECTS, Model

BASE = Model((), 0.0)


def searched(gap: float = 2.0, **what: Any) -> Any:
    """A search in which every model leaves one gap."""
    return SimpleNamespace(
        gap_left=lambda one: gap, lacks_little=lambda one, gained: little_is_missing(gap, gained), **what
    )


@pytest.mark.parametrize(
    ("gain", "parent_from_there", "refitted", "named"),
    [
        (BEYOND_DOUBT + 30.0, -5.0, True, True),
        # It led to where the parent, without it, is as probable: it is no help.
        (BEYOND_DOUBT + 30.0, BEYOND_DOUBT + 29.0, True, False),
        (BEYOND_DOUBT - 1.0, -5.0, False, False),
    ],
)
def test_what_is_beyond_doubt_is_so_over_the_parent_from_where_it_led(
    monkeypatch: pytest.MonkeyPatch, gain: float, parent_from_there: float, refitted: bool, named: bool
) -> None:
    asked = list[Any]()

    def without(one: Model, kept: Any) -> Model:
        check_time()  # the last step that all hangs on is done whatever the time
        asked.append(one.names)
        return Model(kept, parent_from_there)

    def ended(*of: Any) -> None:
        raise OutOfTimeError

    monkeypatch.setattr(comparison, "in_same_noise", ended)
    search: Any = SimpleNamespace(inference=SimpleNamespace(without=without))
    found = Tried(cast(Any, [Model(EFFECTS[:1], gain), Model(EFFECTS[1:2], 3.0)]), ())
    with time_limit(0.0):
        ranked = comparison.in_one_noise(search, cast(Any, BASE), found)
    assert asked == [(EFFECTS[0].name,)] * refitted
    assert ranked.parent.log == max(BASE.log, parent_from_there if refitted else BASE.log)
    assert (chosen_of(ranked, None) is not None) is named


def test_what_gained_most_by_itself_is_tried_first_in_later_rounds(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []

    def tried(parent: Any, effects: Sequence[Any], what: str, **how: Any) -> Tried:
        asked.append(tuple(effects))
        return Tried([], tuple(effects))

    monkeypatch.setattr(comparison, "_from_first", lambda search, parent, tried, *of: tried)
    one, two, three, four, beside = EFFECTS[:5]
    search = searched(extensions=lambda parent: (one, two, three, four), tried=tried)
    monkeypatch.setattr(
        comparison, "in_one_noise", lambda search, parent, tried: comparison.Comparison(search, parent, ())
    )
    found = tuple(Model((effect,), log) for effect, log in ((three, 90.0), (two, 5.0), (one, -3.0)))
    first = comparison.Comparison(search, cast(Any, BASE), cast(Any, found))
    comparison.comparison_of(search, cast(Any, Model((beside,), 200.0)), "trying", first)
    comparison.comparison_of(search, cast(Any, BASE), "trying")
    assert asked == [(three, two, four, one), (one, two, three, four)]


@pytest.mark.parametrize(("gain", "steps", "last"), [(240.0, 3, False), (60.0, 3, True), (240.0, 0, True)])
def test_a_costly_effect_that_explained_much_by_itself_does_not_wait_for_others(
    monkeypatch: pytest.MonkeyPatch, gain: float, steps: int, last: bool
) -> None:
    """What was not followed explained nothing, whatever slopes predict of it."""
    asked: list[Any] = []

    def tried(parent: Any, effects: Sequence[Any], *of: Any, **how: Any) -> Tried:
        asked.append(tuple(effects))
        return Tried([], tuple(effects))

    monkeypatch.setattr(comparison, "_from_first", lambda search, parent, tried, *of: tried)
    one, costly, beside = EFFECTS[:3]
    search = searched(extensions=lambda parent: (one, costly), tried=tried)
    monkeypatch.setattr(comparison, "is_costly", lambda effect: effect is costly)
    monkeypatch.setattr(comparison, "in_one_noise", lambda *of: comparison.Comparison(search, of[1], ()))
    monkeypatch.setattr(comparison, "_worth_following", lambda found: -1.0)
    monkeypatch.setattr(Model, "evidence", SimpleNamespace(mode=SimpleNamespace(steps=steps)))
    first = comparison.Comparison(search, cast(Any, BASE), cast(Any, (Model((costly,), gain), Model((one,), 5.0))))
    comparison.comparison_of(search, cast(Any, Model((beside,), 200.0)), "trying", first)
    assert asked == ([(one,), (costly,)] if last else [(costly, one)])


@pytest.mark.parametrize(
    ("together", "near", "expected"),
    [
        (90.0, None, [("two", 290.0), ("one", 215.0)]),
        (9.0, None, [("one", 215.0), ("two", 203.0)]),  # no more than what was found beside the first
        (90.0, BASE, [("one", 215.0), ("two", 203.0)]),  # slopes were taken in a model that is near already
    ],
)
def test_an_effect_that_another_has_taken_up_is_found_from_where_the_search_began(
    monkeypatch: pytest.MonkeyPatch, together: float, near: Any, expected: list[tuple[str, float]]
) -> None:
    """Slopes beside the first predict next to nothing of it; from the first model they have to predict more than that.

    That more is what is found so far, and what a name needs.
    """
    names = ("guide.viscous_friction", "guide.load_dependent_friction", "fibre.creep")
    one, two, first = (CATALOGUE[name] for name in names)
    parent, begun, floor = Model((first,), 200.0), Model((first,), 180.0), list[float]()

    def tried(at: Any, effects: Sequence[Any], what: str, least: float = -np.inf, **how: Any) -> Tried:
        floor.append(least)
        gains = {one: 15.0, two: 3.0} if at is parent else {one: 10.0, two: together + 20.0}
        return Tried(cast(Any, [Model((first, each), at.log + gains[each]) for each in effects]), ())

    inference = SimpleNamespace(begun_anew=lambda one, base: begun)
    search = searched(extensions=lambda at: (one, two), tried=tried, inference=inference)
    monkeypatch.setattr(
        comparison, "in_one_noise", lambda search, parent, tried: comparison.Comparison(search, parent, tried.found)
    )
    monkeypatch.setattr(comparison, "is_costly", lambda effect: False)
    singles = comparison.Comparison(search, cast(Any, BASE), ())
    found = comparison.comparison_of(search, cast(Any, parent), "", singles, near).found
    assert [(found.effects[-1], found.log) for found in found] == [
        ({"one": one, "two": two}[name], log) for name, log in expected
    ]
    assert floor[1:] == ([215.0 + NAMED - 180.0] if near is None else [])


PRESLIDING, DRAG, CREEP = (CATALOGUE[name] for name in ("guide.presliding", "guide.quadratic_drag", "fibre.creep"))


@pytest.mark.parametrize(("near", "least"), [(BASE, np.inf), (BASE, 20.0), (BASE, -np.inf), (None, -np.inf)])
def test_what_changes_a_models_kind_is_followed_beside_an_effect_only_where_more_is_missing(
    monkeypatch: pytest.MonkeyPatch, near: Any, least: float
) -> None:
    """Where slopes predict nothing of it. On a model that is far from the records slopes are not taken for anything."""
    asked: list[Any] = []
    parent = Model((CREEP,), 50.0)

    def tried(at: Any, effects: Sequence[Any], *of: Any, near: Any = None, of_singular: float = 0.0) -> Tried:
        asked.append((tuple(effects), near, of_singular))
        gains = {PRESLIDING: 9.0 if of_singular < 0.0 else -4.0, DRAG: -2.0}
        found = [Model((CREEP, each), parent.log + gains[each], steps=3 * (gains[each] > 0.0)) for each in effects]
        return Tried(cast(Any, found), ())

    search = searched(extensions=lambda at: (PRESLIDING, DRAG), tried=tried)
    as_found = lambda search, parent, tried: comparison.Comparison(search, parent, tuple(tried.found))  # noqa: E731
    monkeypatch.setattr(comparison, "in_one_noise", as_found)
    monkeypatch.setattr(comparison, "_worth_following", lambda found: least)
    ended = comparison.comparison_of(search, cast(Any, parent), "", None, near)
    found = {one.effects[-1]: one.log for one in ended.found}
    if near is None:
        assert asked == [((PRESLIDING, DRAG), None, -np.inf)]
    else:
        assert asked[0] == ((PRESLIDING, DRAG), BASE, 0.0)
        assert asked[1:] == [((PRESLIDING,), BASE, least)] * (least < np.inf)
    assert found == {PRESLIDING: 59.0 if least == -np.inf else 46.0, DRAG: 48.0}


MASS, SLIP = CATALOGUE["fibre.mass"], CATALOGUE["fibre.knot_slip"]


@pytest.mark.parametrize(("gap", "expected"), [(1.01, 0.05), (1.2, None)])
def test_what_changes_a_models_kind_waits_for_little_where_another_leaves_only_noise(
    monkeypatch: pytest.MonkeyPatch, gap: float, expected: float | None
) -> None:
    """A twentieth of what that one gained; where more than noise is left, it is followed whatever slopes say."""
    asked: list[Any] = []

    def tried(at: Any, effects: Sequence[Any], what: str, least: float = -np.inf, **how: Any) -> Tried:
        asked.append((tuple(effects), least, how["of_singular"]))
        return Tried([cast(Any, Model((DRAG,), BASE.log + 400.0, steps=3))] if DRAG in effects else [], ())

    search = searched(gap, extensions=lambda at: (DRAG, MASS, SLIP), tried=tried)
    as_found = lambda search, parent, tried: comparison.Comparison(search, parent, tuple(tried.found))  # noqa: E731
    monkeypatch.setattr(comparison, "in_one_noise", as_found)
    comparison.comparison_of(search, cast(Any, BASE), "")
    least = (200.0, 400.0 * expected) if expected is not None else (-np.inf, -np.inf)
    assert asked == [((DRAG,), -np.inf, -np.inf), ((MASS, SLIP), *map(pytest.approx, least))]


@pytest.mark.parametrize("came", [True, False])
def test_what_was_compared_is_kept_where_the_time_ends_while_slow_ones_are(
    monkeypatch: pytest.MonkeyPatch, came: bool
) -> None:
    drag, slip = Model((DRAG,), BASE.log + 40.0, steps=3), Model((SLIP,), BASE.log + 4.0, steps=3)
    search: Any = searched(1.03)
    before = comparison.Comparison(search, cast(Any, BASE), (cast(Any, drag),), frozenset({drag.names}))

    def in_one_noise(search: Any, parent: Any, tried: Tried) -> comparison.Comparison:
        names = frozenset(one.names for one in tried.found) if came else frozenset[tuple[str, ...]]()
        return comparison.Comparison(search, parent, tuple(tried.found), names)

    monkeypatch.setattr(comparison, "in_one_noise", in_one_noise)
    found = comparison._with_costly(before, before, Tried([cast(Any, slip)], ()))
    assert drag.names in found.compared
    assert [one.names for one in found.found] == ([drag.names, slip.names] if came else [drag.names])
    assert found.untried == (() if came else (SLIP,))


@pytest.mark.parametrize(
    ("gap", "gained", "expected"),
    [
        (1.05, (400.0, 90.0), "first"),
        (1.2, (60.0, 40.0), "first"),
        (1.2, (60.0, 41.0), "last"),
        (1.2, (60.0, 101.0), None),
        (1.5, (60.0, 40.0), None),
        (1.05, (), None),
    ],
)
def test_slopes_are_taken_in_the_first_model_that_lacks_little(
    gap: float, gained: tuple[float, ...], expected: str | None
) -> None:
    """Its programs are there; that of each model with what was found by then takes long to compile."""
    assert near_of(gap, gained, False) == expected


def near_of(gap: float, gained: tuple[float, ...], held_back: bool) -> str | None:
    """Which of two models slopes are taken in, where the first one was held to what comes before the first bounces."""
    seen = SimpleNamespace(sensitivities=SimpleNamespace(far=held_back)), SimpleNamespace(sensitivities=None)
    parents = [SimpleNamespace(name=name, supermodel=one) for name, one in zip(("first", "last"), seen, strict=True)]
    first, last = (cast(Any, SimpleNamespace(parent=one)) for one in parents)
    found = _near(Selection(searched(gap), cast(Any, BASE)), first, last, gained)
    return None if found is None else cast(Any, found).name


def test_what_saw_no_bounces_is_no_near_model() -> None:
    """What it leaves before them says nothing of whole records."""
    assert near_of(1.05, (400.0, 90.0), True) == "last"


@pytest.mark.parametrize(("moved", "gain", "begun"), [(True, -600.0, 2), (True, -3.0, 1), (False, -600.0, 1)])
def test_candidates_begin_anew_where_the_parent_was_led_away_from_all_of_them(
    monkeypatch: pytest.MonkeyPatch, moved: bool, gain: float, begun: int
) -> None:
    better, parents = Model((), 500.0), list[Any]()
    behind, ahead = (Model(EFFECTS[:1], 500.0 + nats) for nats in (gain, 40.0))

    def looked_at(search: Any, parent: Any, what: str, *of: Any) -> comparison.Comparison:
        parents.append(parent)
        there: Any = ((ahead,) if parent is better else (behind,), better)
        return comparison.Comparison(search, there[1], there[0], frozenset({behind.names}), moved=moved)

    monkeypatch.setattr(comparison, "_looked_at", looked_at)
    found = comparison.comparison_of(cast(Any, None), cast(Any, BASE), "trying")
    assert parents == [BASE, better][:begun]
    assert found.moved is moved
    assert found.found == ((ahead,) if begun == 2 else (behind,))


def test_what_was_not_followed_is_not_added_whatever_slopes_predict() -> None:
    unseen = SimpleNamespace(log=100.0, names=("a",), evidence=SimpleNamespace(mode=SimpleNamespace(steps=0)))
    ranked = comparison.Comparison(cast(Any, None), cast(Any, BASE), cast(Any, (unseen,)), frozenset({("b",)}))
    assert chosen_of(ranked, None) is None


def test_a_gap_is_over_the_samples_that_counted_where_it_was_fitted() -> None:
    """Of a model that saw but what comes before the first bounces, all samples of a later one would make it small."""
    before: Any = SimpleNamespace(
        fit=SimpleNamespace(cost=400.0), supermodel=SimpleNamespace(samples=np.array([60.0, 40.0]))
    )
    later: Any = SimpleNamespace(samples=10_000.0)
    assert SearchState.gap(later, before) == 2.0


def test_a_candidate_whose_motion_is_lost_costs_what_is_usual() -> None:
    """One that is no number would make every false alarm of its round none."""

    def one(objective: float, log: float, *added: Any) -> Any:
        evidence = SimpleNamespace(mode=SimpleNamespace(objective=objective), log=log)
        return SimpleNamespace(effects=added, names=("a",) * len(added), evidence=evidence, divided_off=0.0)

    viscous = CATALOGUE["guide.viscous_friction"]
    round_of: Any = SimpleNamespace(parent=one(100.0, -50.0), compared={("a",)})
    # Half of what the objective fell by, less what was gained.
    assert choice._chance(round_of, one(80.0, -45.0, viscous)) == Chance(1, 5.0)
    assert choice._chance(round_of, one(np.inf, -np.inf, viscous)) == Chance(1, PRICE)
