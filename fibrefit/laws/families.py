"""Effects of which there is one for each record of a series: something happens in the third, or from the third on."""

from __future__ import annotations

import functools
from typing import ClassVar

from fibrefit.laws.law import Effect

MARK = "@"
"""Between the name of an effect and the place of its record: ``fibre.knot_slip@3``."""


@functools.cache
def of_record(effect: type[Effect], place: int) -> type[Effect]:
    """The member of a family that belongs to one record.

    Parameters
    ----------
    effect : Effect class
        With a `family`.
    place : int
        Of the record in its study, from 1.
    """

    class Member(effect):  # type: ignore[valid-type, misc]
        __doc__ = effect.__doc__
        name: ClassVar[str] = f"{effect.name}{MARK}{place}"
        record: ClassVar[int | None] = place
        _made_of: ClassVar[tuple[type[Effect], int]] = (effect, place)

    Member.__name__ = f"{effect.__name__}{place}"
    return Member


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
    return tuple(of_record(effect, place) for place in range(first, records + 1))


def family_of(effect: type[Effect]) -> str:
    """Name of an effect without the place of its record."""
    return effect.name.partition(MARK)[0]
