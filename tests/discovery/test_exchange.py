"""Effects exchanged for others, once those beside them are there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest

from fibrefit.discovery import exchange
from fibrefit.discovery.comparison import Comparison
from fibrefit.discovery.design.rivals import Rivals
from fibrefit.discovery.engine.effort import FAR_BEHIND
from fibrefit.discovery.engine.thresholds import APART, BEYOND_DOUBT, NAMED
from tests.discovery.test_pairs import EFFECTS, GAINS, Model, floors, in_one_noise, round_of

A, B, C, D, E = EFFECTS[:5]
F = EFFECTS[5]


@pytest.fixture(autouse=True)
def one_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    in_one_noise(monkeypatch, exchange)


def exchanged(
    together: dict[tuple[Any, Any], float],
    asked: list[Any],
    *,
    gains: dict[Any, float] = GAINS,
    last: dict[Any, float] | None = None,
    found: tuple[Any, ...] = (A, E),
    from_both: float = 60.0,
    rivals: Sequence[Rivals] = (),
) -> Comparison | None:
    """What takes the place of A, which was found first, beside E: 300 nats together; what is left of both has 60."""
    single = round_of(gains, together, asked)
    single.search.inference = SimpleNamespace(  # type: ignore[misc]
        without=lambda one, kept: Model(kept, from_both), again=lambda one: one
    )
    beside = tuple(Model((*found[:-1], effect), gain) for effect, gain in (last or {found[-1]: 60.0}).items())
    round_before = Comparison(single.search, Model(found[:-1], 0.0), beside)  # type: ignore[arg-type]
    models = exchange.with_exchanges(single, round_before, cast(Any, Model(found, 300.0)), rivals)
    return models if models is not None and exchange.is_better(models, cast(Any, Model(found, 300.0))) else None


def names(found: Comparison | None, number: int = 1) -> list[set[str]]:
    assert found is not None
    return [set(one.names) for one in found.found[:number]]


def of(*effects: Any) -> set[str]:
    return {effect.name for effect in effects}


def test_the_first_effect_is_exchanged_for_one_that_does_its_part_better() -> None:
    asked: list[Any] = []
    found = exchanged({(E, C): 304.0}, asked)
    assert names(found, 2) == [of(E, C), of(A, E)]
    # The best eight beside the two, however far behind, if slopes predict a fair share of what both gain.
    assert asked == [(E, effect) for effect in EFFECTS if effect not in (A, E)][:8]


@pytest.mark.parametrize(("from_both", "floor"), [(-600.0, 0.5 * (300.0 - GAINS[E])), (250.0, 0.5 * (300.0 - 250.0))])
def test_the_one_that_stays_is_where_it_is_more_probable(from_both: float, floor: float) -> None:
    """A motion that loses an effect at once may be lost itself: 600 nats below a model with neither."""
    exchanged({(E, C): 304.0}, [], from_both=from_both)
    assert floors[E] == floor


def test_one_that_was_not_found_by_itself_stays_from_where_both_are() -> None:
    exchanged({(E, C): 304.0}, [], gains={A: 240.0, B: 200.0, C: 190.0})
    assert floors[E] == 0.5 * (300.0 - 60.0)


def test_an_exchange_that_is_no_better_is_none() -> None:
    assert exchanged({(E, C): 299.0}, []) is None


def test_what_gained_nothing_is_not_tried_in_its_place() -> None:
    asked: list[Any] = []
    assert exchanged({(E, B): 900.0}, asked, gains={A: 240.0, B: NAMED, C: NAMED - 1.0}) is None
    assert asked == []


@pytest.mark.parametrize(("gain", "there"), [(58.0, True), (60.0 - FAR_BEHIND - 1.0, False), (NAMED, False)])
def test_beside_another_first_effect_another_last_one_may_do_better(gain: float, there: bool) -> None:
    """A and E stand in for C and F: neither of them is better beside one of the stand-ins, both together are."""
    found = exchanged({(E, C): 296.0, (C, F): 390.0}, [], last={E: 60.0, F: gain})
    if there:
        assert names(found) == [of(C, F)]
    else:
        assert found is None


def test_they_are_fitted_in_the_noise_that_the_models_are_compared_in(monkeypatch: pytest.MonkeyPatch) -> None:
    fitted: list[tuple[str, ...]] = []

    def in_another(search: Any, parent: Any, found: Sequence[Any]) -> Comparison:
        def tried(first: Any, *of: Any, **how: Any) -> Any:
            fitted.append(first.names)
            return search.tried(first, *of, **how)

        there = SimpleNamespace(**vars(search) | {"tried": tried})
        return Comparison(there, parent, tuple(sorted(found, key=lambda one: -one.log)))  # type: ignore[arg-type]

    monkeypatch.setattr(exchange, "in_same_noise", in_another)
    found = exchanged({(E, C): 296.0, (C, F): 390.0}, [], last={E: 60.0, F: 58.0})
    assert names(found) == [of(C, F)]
    assert fitted == [(C.name,)]


def test_of_three_each_but_the_last_is_exchanged() -> None:
    asked: list[Any] = []
    found = exchanged({(A, D): 320.0, (B, D): 280.0}, asked, found=(A, B, C), last={C: 60.0})
    # What stays is named by its first effect here: B and C where A goes, A and C where B does.
    assert {first for first, _ in asked} == {A, B}
    assert names(found) == [of(A, C, D)]


@pytest.mark.parametrize(("log", "there"), [(290.0, True), (300.0 - FAR_BEHIND - 1.0, False)])
def test_where_inputs_have_errors_near_ones_are_told_about_themselves(
    monkeypatch: pytest.MonkeyPatch, log: float, there: bool
) -> None:
    """Readings linearised about the first model put a viscous friction 26 nats before the drag that was there."""
    monkeypatch.setattr(Model, "supermodel", SimpleNamespace(sensitivities=SimpleNamespace(far=False)))
    found = exchanged({(E, C): log}, [])
    assert (found is not None) is there
    if there:
        assert names(found, 2) == [of(A, E), of(E, C)]


def test_an_exchange_that_makes_one_needless_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exchange, "pruned", lambda inference, best: replace(best, effects=best.effects[:1]))
    assert exchanged({(E, C): 304.0}, []) is None


def as_well(found: tuple[Any, ...], instead: tuple[Any, ...]) -> Rivals:
    (mine,), (theirs,) = set(found) - set(instead), set(instead) - set(found)
    return Rivals((mine.name, theirs.name), cast(Any, (Model(found, 100.0), Model(instead, 99.0))))


def test_what_the_last_round_found_and_what_did_as_well_before_is_tried_in_its_place() -> None:
    """An effect may do as well as another only beside those that came later, whatever it gained by itself."""
    asked: list[Any] = []
    exchanged({}, asked, gains={A: 240.0, B: 200.0}, last={E: 60.0, F: 55.0, C: NAMED}, rivals=[as_well((A,), (D,))])
    assert asked == [(E, B), (E, F), (E, D)]


@pytest.mark.parametrize(("log", "there"), [(300.0 - APART + 0.1, True), (300.0 - APART - 0.1, False)])
def test_rivals_are_those_beside_all_effects(log: float, there: bool) -> None:
    """D did as well as A before E was there, and C does now; what was not held beside both stays a rival."""
    single = round_of(GAINS, {(E, C): log, (E, D): 200.0}, [])
    single.search.inference = SimpleNamespace(without=lambda one, kept: Model(kept, 60.0), again=lambda one: one)  # type: ignore[misc]
    whole: Any = Model((A, E), 300.0)
    models = exchange.with_exchanges(single, single, whole)
    assert models is not None
    before = [as_well((A,), (D,)), as_well((A,), (E,)), as_well((A,), (EFFECTS[10],))]
    found = {rival.names for rival in exchange.rivals_beside(before, models, whole)}
    assert found == {(A.name, EFFECTS[10].name)} | ({(A.name, C.name)} if there else set())


@pytest.mark.parametrize(("from_both", "near"), [(60.0, True), (BEYOND_DOUBT + 150.0, False)])
def test_slopes_are_taken_in_the_first_model_where_that_lacks_little(
    monkeypatch: pytest.MonkeyPatch, from_both: float, near: bool
) -> None:
    """A program for every group of effects beside what stays takes seconds to make."""
    places: list[Any] = []
    single = round_of({A: 90.0, C: 80.0, E: 70.0}, {}, [])
    own = single.search.tried

    def tried(*of: Any, **how: Any) -> Any:
        places.append(how["near"])
        return own(*of, **how)

    single.search.tried = tried  # type: ignore[method-assign]
    single.search.inference = SimpleNamespace(without=lambda one, kept: Model(kept, from_both), again=lambda one: one)  # type: ignore[misc]
    exchange.with_exchanges(single, single, cast(Any, Model((A, E), 300.0)))
    assert places == [single.parent if near else None]
