"""What a file claims of its times and rows, held against those that were read."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fibrefit.core import units as registry
from fibrefit.core.errors import DataError
from fibrefit.core.formatting import format_number, format_quantity
from fibrefit.records.clock.base import TimeBase
from fibrefit.records.columns.bearing import LASTING, MISTAKEN_TIMES, NEWEST, OF_ROWS
from fibrefit.records.columns.raw import Annotation, Raw
from fibrefit.records.grammar.claims import claims_of
from fibrefit.records.thresholds import CONTRADICTS, LONGEST_HEADING, SAME_LENGTH


def contradicted_length(annotations: Sequence[Annotation], lasting: float, mark: str = ".") -> Annotation | None:
    """What claims that a record lasted so many times longer or shorter that its rate must be another one; or None.

    Parameters
    ----------
    annotations : sequence of Annotation
        All the file says beside its numbers.
    lasting : float
        Time from the first sample to the last and one step more, in s.
    mark : str
        Decimal mark of its lines.
    """
    for one in annotations:
        for claim in claims_of(one.text, mark) if len(one.text) <= LONGEST_HEADING else ():
            amounts = [a for a in claim.amounts if a.kind == "time" and a.value > 0]
            if len(amounts) == 1 and LASTING.search(claim.about):
                ratio = amounts[0].value * registry.to_si(amounts[0].unit, "s") / lasting
                if any(abs(ratio / r - 1.0) < SAME_LENGTH for f in MISTAKEN_TIMES for r in (f, 1.0 / f)):
                    return one
    return None


def annotated_first_row(raw: Raw, bases: Sequence[TimeBase]) -> list[Annotation]:
    """The first row, where its time is none and its numbers are whole as those below are not, as factors are."""
    lost = len(raw.rows) > 1 and any(0 in rows for base in bases for rows in base.lost.values())
    numbers = [c.numbers.values for c in raw.columns if not c.clock and c.numbers.values.size > 1]
    whole = lost and all(v[0] == np.round(v[0]) for v in numbers)
    odd = whole and any(2 * np.count_nonzero(v[1:] != np.round(v[1:])) > v.size for v in numbers)
    return [Annotation(f"line {raw.lines[0]}", raw.rows[0], row=True)] if odd else []


def newest_first(raw: Raw, bases: Sequence[TimeBase], where: str) -> dict[str, DataError]:
    """Doubt about rows that are counted from the first one on, and of which the file says that the last comes first."""
    counted = all(base.header is None and base.unit == "counted" for base in bases)
    for one in raw.annotations if counted else ():
        if NEWEST.search(one.text) and OF_ROWS.search(one.text):
            do = "Sort the rows as they were measured and take the line out, or export them with a time column."
            got = f'"{one.text.strip()[:60]}", and no column holds the time'
            return {"time": DataError(f"{where}, {one.place}", got, "the oldest row first", do)}
    return {}


def wrong_times(raw: Raw, bases: Sequence[TimeBase], where: str, mark: str) -> dict[str, DataError]:
    """Doubt about times that contradict how long a record lasted, or run at a share of a rate; none elsewhere."""
    for base in bases:
        present = base.time[np.isfinite(base.time)]
        lasting = float(present[-1] - present[0]) + 1.0 / base.rate if base.unit is not None and present.size else 0.0
        one = contradicted_length(raw.annotations, lasting, mark) if lasting > 0 else None
        if one is not None:
            got = f'"{one.text.strip()[:60]}", and the record lasts {format_quantity(lasting, "s", 6)}'
            do = 'Say which it is: time = "ms" under [units], or sampling_rate = "2 kHz" under [files].'
            return {"time": DataError(f"{where}, {one.place}", got, "one length of the record", do)}
        ratio = (raw.facts.rate or 0.0) / base.rate if base.header is not None and base.unit is not None else 0.0
        if any(abs(ratio / kept - 1.0) < CONTRADICTS for kept in (2, 4, 5, 10)):  # rows left out
            got = f'"{raw.facts.quoted}", and "{base.header}" has {format_number(base.rate, 7)} Hz'
            do = f'Say what one is worth: time = {{ column = "{base.header}", scale = "1" }} under [channels].'
            return {"time": DataError(where, got, "one rate", do)}
    return {}
