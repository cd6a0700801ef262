"""What records show of their lifts beside what is stated of them, and which two are stated in each other's place."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

from fibrefit.core.formatting import format_quantity
from fibrefit.rigs.thresholds import LIFT_AGREES

LIFTS_TOLD = 8
"""Records of which both lifts are told."""


class LiftShown(NamedTuple):
    """Of a record, in m: the lift that is stated, and the fall after which the force rises."""

    record: str
    stated: float
    measured: float

    @property
    def agrees(self) -> bool:
        """Whether the two are of one lift."""
        return abs(self.measured - self.stated) <= LIFT_AGREES * self.stated


def told_of_lifts(lifts: Sequence[LiftShown]) -> str:
    """Stated and measured lifts of records, if some differ, and which two would agree if they were exchanged."""
    off = [lift for lift in lifts if not lift.agrees]
    if not off:
        return ""
    each = [
        f"{lift.record} {format_quantity(lift.stated, 'm', 3)} and {format_quantity(lift.measured, 'm', 3)}"
        for lift in lifts[:LIFTS_TOLD]
    ]
    others = len(lifts[LIFTS_TOLD:])
    more = f"; and {others} more" if others else ""
    said = f"Lifts as stated, and falls after which the force rises: {'; '.join(each)}{more}."
    swapped = [
        f"{one.record} and {other.record}"
        for one, other in combinations(off, 2)
        if one._replace(stated=other.stated).agrees and other._replace(stated=one.stated).agrees
    ]
    return f"{said} With the lifts of {', or of '.join(swapped)} exchanged they would agree." if swapped else said
