"""Effects of which there is one for each record of a series: something happens in the third, or from the third on.

What happens at an instant may happen in every record, at an instant of its own each time: that is one more member. What
holds in one record may hold in several: of these there are too many to look at, and the records have to say which.
"""

from __future__ import annotations

import dataclasses
import functools
import types
from collections.abc import Callable, Iterable
from typing import Any, ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.law import Effect, quantity

MARK, TO, AND = "@", "-", "+"
"""Between the name of an effect and the place of its record, ``fibre.knot_slip@3``, or those of the first and the last
record in each of which it happens, ``fibre.knot_slip@1-5``; and between the places of records that share it,
``study.other_fibre@2+4``."""
NEVER = 2.0
"""Share of a record after which what does not happen in it would: it has ended by then."""

SOME_DURATION, FAR_ON = 3.0, 1000.0
"""Of a record, in s, and a place in a series: between the first and it a law is looked at that may go by the place."""


@functools.cache
def of_records(effect: type[Effect], *places: int) -> type[Effect]:
    """The member of a family that belongs to one record, or to some that share it.

    Parameters
    ----------
    effect : Effect class
        With a `family`.
    *places : int
        Of the records in their study, from 1, in their order.
    """

    class Member(effect):  # type: ignore[valid-type, misc]
        __doc__ = effect.__doc__
        name: ClassVar[str] = f"{effect.name}{MARK}{AND.join(map(str, places))}"
        records: ClassVar[tuple[int, ...]] = places
        _made_of: ClassVar[tuple[Any, ...]] = (effect, *places)

    Member.__name__ = f"{effect.__name__}{'And'.join(map(str, places))}"
    return Member


def may_be_shared(effect: type[Effect]) -> bool:
    """Whether there are members of its family that belong to several records."""
    return effect.family == "in" and not effect.sudden


def shared_by(effect: type[Effect], places: Iterable[int]) -> type[Effect]:
    """The member of an effect's family that belongs to some records.

    Parameters
    ----------
    effect : Effect class
        A member of it.
    places : iterable of int
        Of the records in their study, from 1, in their order.
    """
    return of_records(effect._made_of[0], *places)  # type: ignore[attr-defined]


def number_of_sets(records: int) -> float:
    """Ways of parting a series into two sets of records, neither of them a single one."""
    return max(2.0 ** (records - 1) - 1.0 - records, 1.0)


@functools.cache
def of_each(effect: type[Effect], records: int) -> type[Effect]:
    """A sudden effect that happens once in each record of a series, as large in all, at an instant of its own in each.

    Parameters
    ----------
    effect : Effect class
        Sudden, with a `family`.
    records : int
        Of the series, at least two; a further record, left out or held out, has no instant and is without it.
    """
    later = tuple(f"instant_{place}" for place in range(2, records + 1))

    def in_record(self: Any, number: jax.Array, duration: jax.Array) -> Any:
        """The law as it is in one record, at the instant that this has."""
        own = jnp.stack([self.instant, *(getattr(self, name) for name in later), jnp.asarray(NEVER)])
        at = own[jnp.clip(jnp.asarray(number, dtype=jnp.int32), 1, records + 1) - 1]
        return effect.in_record(dataclasses.replace(self, instant=at), number, duration)

    says = "share of record {} after which it happens"
    quantities = {
        name: quantity("-", says.format(place), 0.5, lower=0.0, upper=1.0, symbol=f"t_s{place}")
        for place, name in enumerate(later, start=2)
    }
    content = {
        "__module__": __name__,
        "__doc__": effect.__doc__,
        "__annotations__": dict.fromkeys(later, jax.Array),
        "name": f"{effect.name}{MARK}1{TO}{records}",
        "recurs": records,
        "excludes": (*effect.excludes, *(f"{effect.name}{MARK}{place}" for place in range(1, records + 1))),
        "_made_of": (effect, records),
        "in_record": in_record,
    }
    return types.new_class(
        f"{effect.__name__}InEach{records}", (effect,), exec_body=lambda of: of.update(content | quantities)
    )


def instants(effects: Iterable[type[Effect]]) -> frozenset[str]:
    """Names of all values of a model that are instants."""
    return frozenset(f"{effect.name}.{name}" for effect in effects if effect.sudden for name in instants_of(effect))


def instants_of(effect: type[Effect]) -> tuple[str, ...]:
    """Parameters of a sudden effect: the instant, or that in each record."""
    return ("instant", *(f"instant_{place}" for place in range(2, effect.recurs + 1)))


MOST_DIGITS = 9
"""Of the number of a record: no series is longer, and Python does not read thousands of them."""


def member(effect: type[Effect], where: str) -> type[Effect] | None:
    """The member of a family by what stands behind the mark in its name; None where there is no such."""
    first, to, last = where.partition(TO)
    if not to:
        places = [int(place) if place.isdecimal() and len(place) <= MOST_DIGITS else 0 for place in where.split(AND)]
        known = 0 not in places and places == sorted(set(places)) and (len(places) == 1 or may_be_shared(effect))
        return of_records(effect, *places) if known else None
    # A law with thousands of instants takes minutes to make, and is a slip of the pen.
    counts = first == "1" and last.isdecimal() and len(last) <= 3 and int(last) > 1
    return of_each(effect, int(last)) if effect.sudden and counts else None


def called_with_place(name: str, called: Callable[[str], type[Effect] | None]) -> type[Effect] | None:
    """An effect by its name, or the member of a family by that of the family and the place behind it.

    Parameters
    ----------
    name : str
        ``fibre.creep``, ``fibre.knot_slip@3``, ``my_effects.py:MyEffect@2``.
    called : callable
        The effect of a name without a place; None where nothing is called so.
    """
    family, mark, place = name.rpartition(MARK)
    if not mark or ".py:" in place:  # In the path of a file it is no mark.
        return called(name)
    found = called(family)
    return None if found is None or not found.family else member(found, place)


def members(effect: type[Effect], records: int) -> tuple[type[Effect], ...]:
    """The members of a family that say anything of a series; the effect itself where it is no family.

    Parameters
    ----------
    effect : Effect class
    records : int
        Of the series.
    """
    if not effect.family:
        return (effect,)
    # What holds from the first record on, or in the only one, is what the base model has already.
    first = 2 if effect.family == "since" else 1
    if not effect.sudden and records < 2:
        return ()
    each = tuple(of_records(effect, place) for place in range(first, records + 1))
    return (*each, of_each(effect, records)) if effect.sudden and records > 1 else each


def goes_by_place(effect: type[Effect]) -> bool:
    """Whether it goes by the place of a record in its series: it says nothing of a record that is not of it."""
    if effect.records or effect.recurs:
        return True
    if effect.in_record is Effect.in_record:
        return False
    # A law's own may go by the duration of a record alone. A value that is usually zero could hide what it does.
    law = effect(**{parameter.name: jnp.asarray(parameter.typical or 1.0) for parameter in effect.parameters})
    there = jax.vmap(lambda number: law.in_record(number, jnp.asarray(SOME_DURATION)))(jnp.arange(1.0, FAR_ON))
    return any(bool(jnp.any(leaf != leaf[0])) for leaf in jax.tree.leaves(there))


def family_of(effect: type[Effect]) -> str:
    """Name of an effect without the places of its records."""
    return effect.name.partition(MARK)[0]
