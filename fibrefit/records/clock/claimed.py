"""What a file claims of its times and rows, held against those that were read."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fibrefit.core import units as registry
from fibrefit.core.errors import DataError
from fibrefit.records.clock.base import TimeBase
from fibrefit.records.columns.bearing import LASTING, MISTAKEN_TIMES, NEWEST, NO_ROWS, OF_ROWS, PER_SECOND, THINNED
from fibrefit.records.columns.lexicon import OF_THE_RATE
from fibrefit.records.columns.raw import Raw, Told
from fibrefit.records.grammar.claims import WORDED, claims_of
from fibrefit.records.grammar.phrases import GIVE_RATE
from fibrefit.records.grammar.words import tokens
from fibrefit.records.thresholds import LONGEST_HEADING, SAME_LENGTH


def rows_of_several(told: Sequence[Told], rate: float, rows: int, mark: str = ".") -> Told | None:
    """What says of samples, scans or rows a number that is neither their count nor their rate; or None.

    Parameters
    ----------
    told : sequence of Told
        All the file says beside its numbers.
    rate : float
        By which the rows are counted, in Hz.
    rows : int
        How many there are.
    mark : str
        Decimal mark of its lines.
    """
    known = (0.0, 1.0, float(rows), rate, rate / 1e3, 1.0 / rate, 1e3 / rate, 1e6 / rate)
    for one in told:
        if len(one.text) > LONGEST_HEADING or not OF_ROWS.search(one.text) or NO_ROWS.search(one.text):
            continue
        bare = [a.value for c in claims_of(one.text, mark) for a in c.amounts if not a.unit and OF_ROWS.search(c.about)]
        bare += [WORDED[word] for word in tokens(one.text) if word in WORDED]
        if any(all(abs(value - k) > 1e-6 * k for k in known) for value in bare):
            return one
    return None


def contradicted_length(told: Sequence[Told], lasting: float, mark: str = ".") -> Told | None:
    """What claims that a record lasted so many times longer or shorter that its rate must be another one; or None.

    Parameters
    ----------
    told : sequence of Told
        All the file says beside its numbers.
    lasting : float
        Time from the first sample to the last and one step more, in s.
    mark : str
        Decimal mark of its lines.
    """
    for one in told:
        for claim in claims_of(one.text, mark) if len(one.text) <= LONGEST_HEADING else ():
            amounts = [a for a in claim.amounts if a.kind == "time" and a.value > 0]
            if len(amounts) == 1 and LASTING.search(claim.about):
                ratio = amounts[0].value * registry.to_si(amounts[0].unit, "s") / lasting
                if any(abs(ratio / r - 1.0) < SAME_LENGTH for f in MISTAKEN_TIMES for r in (f, 1.0 / f)):
                    return one
    return None


def _is_short(one: Told) -> bool:
    return len(one.text) <= LONGEST_HEADING and not one.of


def contradicted_rate(told: Sequence[Told], rate: float, mark: str = ".") -> Told | None:
    """What tells how often rows were taken, with another rate than that of the times that stand beside them; or None.

    Parameters
    ----------
    told : sequence of Told
        All the file says beside its numbers.
    rate : float
        Of the times, in Hz.
    mark : str
        Decimal mark of its lines.
    """
    for one in told:
        for claim in claims_of(PER_SECOND.sub(" Hz", one.text), mark) if _is_short(one) else ():
            words = tokens(claim.about)
            amounts = [a for a in claim.amounts if a.kind in ("time", "frequency") and a.value > 0]
            if len(amounts) != 1 or not words or not all(map(OF_THE_RATE.fullmatch, words)):
                continue
            si = "s" if amounts[0].kind == "time" else "Hz"
            stated = amounts[0].value * registry.to_si(amounts[0].unit, si)
            if words[-1] == "time" and words[:1] != ["sample"]:
                continue  # how long it lasted
            ratio = rate * stated if si == "s" else rate / stated
            if any(abs(ratio / r - 1.0) < SAME_LENGTH for f in MISTAKEN_TIMES for r in (f, 1.0 / f)):
                return one
    return None


def first_row_told(raw: Raw, bases: Sequence[TimeBase]) -> list[Told]:
    """The first row, where its time is none and its numbers are whole as those below are not, as factors are.

    Parameters
    ----------
    raw : Raw
        The file.
    bases : sequence of TimeBase
        Its times.
    """
    lost = len(raw.rows) > 1 and any(0 in rows for base in bases for rows in base.lost.values())
    numbers = [c.numbers.values for c in raw.columns if not c.clock and c.numbers.values.size > 1]
    whole = lost and all(v[0] == np.round(v[0]) for v in numbers)
    odd = whole and any(2 * np.count_nonzero(v[1:] != np.round(v[1:])) > v.size for v in numbers)
    return [Told(f"line {raw.lines[0]}", raw.rows[0], row=True)] if odd else []


def newest_first(raw: Raw, bases: Sequence[TimeBase], where: str) -> dict[str, DataError]:
    """Doubt about rows that are counted from the first one on, and of which the file says that the last comes first.

    Parameters
    ----------
    raw : Raw
        The file.
    bases : sequence of TimeBase
        Its times.
    where : str
        File to name in messages.
    """
    counted = all(base.header is None and base.unit == "counted" for base in bases)
    for one in raw.told if counted else ():
        if NEWEST.search(one.text) and OF_ROWS.search(one.text):
            do = "Sort the rows as they were measured and take the line out, or export them with a time column."
            got = f'"{one.text.strip()[:60]}", and no column holds the time'
            return {"time": DataError(f"{where}, {one.place}", got, "the oldest row first", do)}
    return {}


def wrong_times(raw: Raw, bases: Sequence[TimeBase], where: str, mark: str) -> dict[str, DataError]:
    """Doubt about times that contradict how long a record lasted, or how its rows came about; none where they do not.

    Parameters
    ----------
    raw : Raw
        The file.
    bases : sequence of TimeBase
        Its times.
    where : str
        File to name in messages.
    mark : str
        Decimal mark of its lines.
    """
    for base in bases:
        present = base.time[np.isfinite(base.time)]
        lasting = float(present[-1] - present[0]) + 1.0 / base.rate if base.unit is not None and present.size else 0.0
        one = contradicted_length(raw.told, lasting, mark) if lasting > 0 else None
        if one is not None:
            got = f'"{one.text.strip()[:60]}", and the record lasts {registry.format_quantity(lasting, "s", 6)}'
            do = 'Say which it is: time = "ms" under [units], or sampling_rate = "2 kHz" under [files].'
            return {"time": DataError(f"{where}, {one.place}", got, "one length of the record", do)}
        thinned = any(THINNED.search(one.text) for one in raw.told)
        one = None if thinned or base.header is None else contradicted_rate(raw.told, base.rate, mark)
        if one is not None:
            got = f'"{one.text.strip()[:60]}", and "{base.header}" has {registry.format_number(base.rate, 7)} Hz'
            do = f'Say what one number is worth: time = {{ column = "{base.header}", scale = "1" }} under [channels].'
            return {"time": DataError(f"{where}, {one.place}", got, "one rate of the rows", do)}
        counted = base.header is None and base.unit == "counted" and raw.facts.rate is not None
        one = rows_of_several(raw.told, base.rate, present.size, mark) if counted else None
        if one is not None:
            got = (
                f'"{one.text.strip()[:60]}" beside {registry.format_number(base.rate, 7)} Hz, from "{raw.facts.quoted}"'
            )
            return {"time": DataError(f"{where}, {one.place}", got, "the rate of the rows that are here", GIVE_RATE)}
    return {}
