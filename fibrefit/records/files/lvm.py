"""LabVIEW measurement files (.lvm): tagged headers, several segments, with or without a column of times."""

from __future__ import annotations

import datetime
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.records.columns.raw import Annotation, Raw, RawColumn
from fibrefit.records.columns.said import unread_cells
from fibrefit.records.files.decode import Text
from fibrefit.records.grammar.facts import Facts
from fibrefit.records.grammar.headings import known_unit, split_heading
from fibrefit.records.grammar.numbers import Numbers, parse_column
from fibrefit.records.grammar.phrases import Aside, count
from fibrefit.records.grammar.worth import contradicted
from fibrefit.records.thresholds import FEWEST_ROWS

_MAGIC = "labview measurement"
_END = "***End_of_Header***"
_SEPARATORS = {"tab": "\t", "comma": ",", "semicolon": ";", "space": " "}


@dataclass(frozen=True, slots=True)
class _Segment:
    """One stretch of samples with what its header says, tag by tag."""

    tags: dict[str, list[str]]
    names: list[str]
    cells: list[list[str]]
    numbers: list[int]
    unplaced: list[int]


def is_lvm(text: Text) -> bool:
    """Whether a text begins as these files do."""
    return bool(text.lines) and text.lines[0].strip().casefold().startswith(_MAGIC)


def read_lvm(text: Text, where: str) -> Raw:
    """Columns of a LabVIEW measurement file.

    Parameters
    ----------
    text : Text
        Its lines.
    where : str
        File to name in messages.

    Returns
    -------
    Raw
        Columns with units; a column of times where the file has one, or several segments, else rates by column.

    Raises
    ------
    DataError
        If the header is incomplete, or segments do not belong together.
    """
    head = _file_tags(text.lines, where)
    separator = _SEPARATORS.get(head.get("separator", ["tab"])[0].casefold(), "\t")
    mark = (head.get("decimal_separator") or ["."])[0] or "."
    if mark not in (".", ","):
        got, do = f'Decimal_Separator "{mark[:20]}" in the header', "Correct the line, or export the file again."
        raise DataError(where, got, '"." or ","', do)
    x_columns = (head.get("x_columns") or ["One"])[0].casefold()
    segments = _segments(text.lines, separator, where, timeless=x_columns == "no")
    _refuse_spectra(segments, where)
    if x_columns == "no":
        _refuse_uncertain(segments, where)
    first = segments[0]
    for segment in segments[1:]:
        if segment.names != first.names or segment.tags.get("y_unit_label") != first.tags.get("y_unit_label"):
            got = f"line {segment.numbers[0]} begins a segment with other channels"
            raise DataError(where, got, "one set of channels", "Split the file.")
    cells = list(zip(*(row for segment in segments for row in segment.cells), strict=True))
    lines = np.array([n for segment in segments for n in segment.numbers])
    if lines.size < FEWEST_ROWS:
        raise DataError(where, f"only {lines.size} rows of numbers", f"at least {FEWEST_ROWS} samples")
    inside, notes = unread_cells(columns := _channels(segments, cells, lines, mark, where, x_columns), lines, {})
    return Raw(
        columns=columns,
        facts=Facts(),
        lines=lines,
        rows=[text.lines[n - 1] for n in lines],
        layout={
            "format": "LVM",
            "encoding": text.encoding,
            "delimiter": {v: k for k, v in _SEPARATORS.items()}[separator],
            "decimal": "comma" if mark == "," else "point",
            "first_row": int(lines[0]),
            "last_row": int(lines[-1]),
            "rows": int(lines.size),
            "unreadable_lines": [n for segment in segments for n in segment.unplaced],
            "segments": len(segments),
        },
        notes=[*text.notes, *_notes(segments), *notes],
        annotations=[*_annotations(text.lines, int(lines[0])), *inside],
    )


_FREQUENCY = ("frequency", "frequenz", "fréquence", "frecuencia")
#: Tags of the format itself, which it tells the use of.
_TAGS = re.compile(
    r"(?:labview|writer_|reader_|separator|decimal_|multi_|x_col|time_pref|operator|date|time|channels|samples|y_unit|x_dim"
    r"|x0|delta_x|x_value|y_dim|\*\*\*)",
    re.IGNORECASE,
)


def _annotations(lines: Sequence[str], first: int) -> list[Annotation]:
    """Lines above the numbers with tags that are not the format's own: remarks, descriptions, special blocks."""
    above = enumerate(lines[: first - 1], 1)
    return [Annotation(f"line {i}", line) for i, line in above if line.strip() and not _TAGS.match(line.strip())]


def _notes(segments: Sequence[_Segment]) -> list[str]:
    unplaced = sum(len(segment.unplaced) for segment in segments)
    notes: list[str] = [Aside(f"{len(segments)} segments are joined.")] if len(segments) > 1 else []
    return notes + ([f"{count(unplaced, 'line')} with too many or too few cells left out."] if unplaced else [])


def _file_tags(lines: Sequence[str], where: str) -> dict[str, list[str]]:
    tags: dict[str, list[str]] = {}
    for line in lines:
        if line.startswith(_END):
            return tags
        parts = re.split(r"[\t,;]", line.strip(), maxsplit=1)
        # A comma after the tag may be the decimal separator itself.
        tags[parts[0].strip().casefold()] = [parts[1].strip("\t ") if len(parts) > 1 else ""]
    raise DataError(where, "the header does not end", f"a line {_END}", "Export the file again.")


def _segments(lines: Sequence[str], separator: str, where: str, *, timeless: bool) -> list[_Segment]:
    lines = _without_special(lines)
    ends = [i for i, line in enumerate(lines) if line.startswith(_END)]
    heads = [i for i, line in enumerate(lines) if line.split(separator)[0].strip() == "Channels"]
    segments = []
    for end in ends[1:] or ends[:1]:
        start = max((i for i in heads if i < end), default=ends[0])
        stop = min((i for i in heads if i > end), default=len(lines))
        tags = {
            cells[0].strip().casefold(): [c.strip() for c in cells[1:]]
            for cells in (x.split(separator) for x in lines[start:end])
        }
        body = [(i + 1, lines[i].split(separator)) for i in range(end + 1, stop) if lines[i].strip()]
        if not body or not any(word in cell for cell in body[0][1] for word in ("X_Value", "Comment")):
            raise DataError(where, f"no names of channels after line {end + 1}", "a line that begins with X_Value", "")
        segments.append(_segment(tags, body, timeless=timeless))
    if not segments:
        got = "***Start_Special*** without ***End_Special***: nothing is left behind it"
        raise DataError(where, got, "both, or a table", "Export the file again.")
    return segments


def _without_special(lines: Sequence[str]) -> list[str]:
    """Lines with those between the marks of a special block emptied."""
    kept, special = [], False
    for line in lines:
        special = special or line.startswith("***Start_Special***")
        kept.append("" if special else line)
        special = special and not line.startswith("***End_Special***")
    return kept


def _segment(tags: dict[str, list[str]], body: list[tuple[int, list[str]]], *, timeless: bool) -> _Segment:
    names = [name.strip() for name in body[0][1]]
    widths = {len(names)}
    while names and names[-1] in ("Comment", ""):
        names.pop()
        widths.add(len(names))
    rows, numbers, unplaced = [], [], []
    for number, cells in body[1:]:
        # Without times the first cell is empty: one that is not belongs to a line that lost its first separator.
        beyond = [cell.strip() for cell in cells[len(names) :]]  # a remark, if anything
        shifted = any(cell[:1].isdigit() or cell[:1] in ("-", "+") for cell in beyond)
        if len(cells) in widths and not shifted and not (timeless and cells[0].strip()):
            rows.append([cell.strip() for cell in cells[: len(names)]])
            numbers.append(number)
        else:
            unplaced.append(number)
    return _Segment(tags, names, rows, numbers, unplaced)


def _refuse_uncertain(segments: Sequence[_Segment], where: str) -> None:
    """Without a column of times, one row more or less moves all later samples."""
    do = "Later times are uncertain: export the file again."
    for segment in segments:
        if segment.unplaced:
            raise DataError(f"{where}, line {segment.unplaced[0]}", "a row with too many or too few cells", "", do)
        announced = [int(cell) for cell in segment.tags.get("samples", []) if cell.isdecimal()]
        if announced and max(announced) != len(segment.cells):
            got = f"the header announces {max(announced)} samples, and {len(segment.cells)} are there"
            raise DataError(where, got, "", do)


def _refuse_spectra(segments: Sequence[_Segment], where: str) -> None:
    """Refuse what is written over frequencies: its steps pass for those of time."""
    said = next((x for one in segments for x in one.tags.get("x_dimension", []) if x.casefold() in _FREQUENCY), None)
    if said is not None:
        got, do = f'X_Dimension "{said}" in the header', "Write the signals themselves, and no spectra of them."
        raise DataError(where, got, "channels over time", do)


def _channels(
    segments: Sequence[_Segment],
    cells: Sequence[tuple[str, ...]],
    lines: np.ndarray,
    mark: str,
    where: str,
    x_columns: str,
) -> list[RawColumn]:
    first = segments[0]
    places = [i for i, name in enumerate(first.names) if name != "X_Value"]
    units = first.tags.get("y_unit_label", [])
    columns = []
    for channel, place in enumerate(places):
        (name, within), own = split_heading(first.names[place]), _own(units, place, channel, len(places))
        unit, twice = own or within, contradicted([own or None, within])
        numbers = parse_column(cells[place], mark, lines, f'{where}, column "{first.names[place]}"')
        header = f"{name} [{unit}]" if unit else first.names[place]
        known = None if unit is None else known_unit(name, unit) or unit
        column = RawColumn(header, name, known, numbers, resolution=numbers.resolution, contradicted=twice)
        if x_columns == "multi":
            columns.append(_time_column(cells[place - 1], mark, lines, where))
        elif x_columns == "one" and channel == 0:
            columns.append(_time_column(cells[0], mark, lines, where))
        elif x_columns == "no" and len(segments) == 1:
            column = _with_rate(column, first, (place, channel), mark, where)
        columns.append(column)
    if x_columns == "no" and len(segments) > 1:
        columns.insert(0, _joined_times(segments, mark, where))
    return columns


def _time_column(cells: Sequence[str], mark: str, lines: np.ndarray, where: str) -> RawColumn:
    numbers = parse_column(cells, mark, lines, f'{where}, column "X_Value"')
    return RawColumn("X_Value", "X_Value", "s", numbers, resolution=numbers.resolution)


def _with_rate(column: RawColumn, segment: _Segment, at: tuple[int, int], mark: str, where: str) -> RawColumn:
    step = _tag(segment, "delta_x", at, mark)
    if not step or step <= 0:
        got = "the header gives no step in time (Delta_X) and there is no column of times"
        raise DataError(where, got, "one of the two", "Export the file again.")
    announced = _tag(segment, "samples", at, ".")
    if announced is not None and announced < 0.0:
        raise DataError(where, f"Samples {announced:g} in the header", "how many there are", "Export the file again.")
    n = int(announced) if announced else len(segment.cells)
    whole = column.numbers
    numbers = Numbers(whole.values[:n], whole.reasons[:n], whole.shapes[:n], whole.texts[:n], whole.mark)
    start = _tag(segment, "x0", at, mark) or 0.0
    rate = float(f"{1 / step:.12g}")
    return replace(column, numbers=numbers, rate=rate, start=start)


def _cell(values: Sequence[str], place: int) -> str:
    """What stands in a channel's own column, if anything."""
    return values[place - 1] if 0 < place <= len(values) else ""


def _own(values: Sequence[str], place: int, channel: int, channels: int) -> str:
    """Unit of a channel: it stands in the channel's own column, or in order where each channel has one."""
    filled = [value for value in values if value]
    return _cell(values, place) or (filled[channel] if len(filled) == channels else "")


def _at(values: Sequence[str], place: int, channel: int) -> str:
    """Value of a tag for a channel: it stands in the channel's own column, or in order where columns are left out."""
    filled = [value for value in values if value]
    return _cell(values, place) or (filled[min(channel, len(filled) - 1)] if filled else "")


def _tag(segment: _Segment, tag: str, at: tuple[int, int], mark: str) -> float | None:
    """Number a tag gives for a channel at a column."""
    try:
        number = float(_at(segment.tags.get(tag, []), *at).replace(mark, "."))
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def _joined_times(segments: Sequence[_Segment], mark: str, where: str) -> RawColumn:
    """Times of all segments: each begins where its header says, or at its hour if all begin at zero."""
    times: list[np.ndarray] = []
    for segment in segments:
        _refuse_own_steps(segment, where)
    hours = [_hour(segment, mark) for segment in segments]
    starts = [_tag(segment, "x0", (1, 0), mark) or 0.0 for segment in segments]
    if len(set(starts)) == 1 and all(hour is not None for hour in hours):
        starts = [(hour or 0.0) - (hours[0] or 0.0) for hour in hours]
    for segment, start in zip(segments, starts, strict=True):
        step = _tag(segment, "delta_x", (1, 0), mark) or 0.0
        times.append(start + step * np.arange(len(segment.cells)))
    joined = np.concatenate(times)
    if not (np.diff(joined) > 0).all():
        got = f"{len(segments)} segments that do not follow on one another"
        raise DataError(where, got, "one recording", "Split the file.")
    return RawColumn("X_Value", "X_Value", "s", Numbers.of_array(joined), resolution=1e-7)


def _refuse_own_steps(segment: _Segment, where: str) -> None:
    """Refuse channels that stand side by side and were sampled at different times."""
    for tag, said in (("delta_x", "Delta_X"), ("samples", "Samples")):
        filled = [value for value in segment.tags.get(tag, []) if value]
        if len(set(filled)) > 1:
            got = f"channels that were sampled at different times ({said} {' and '.join(sorted(set(filled)))})"
            raise DataError(where, got, "one rate", "Write channels of one rate to a file of their own.")


def _hour(segment: _Segment, mark: str) -> float | None:
    """Seconds since the year 1 at which a segment begins."""
    day, hour = (next(iter(segment.tags.get(tag, [])), "") for tag in ("date", "time"))
    match = re.fullmatch(r"(\d{1,2}):(\d{2}):(\d{2}(?:\.\d+)?)", hour.replace(mark, "."))
    date = re.fullmatch(r"(\d{4})/(\d{1,2})/(\d{1,2})", day)
    if match is None or date is None:
        return None
    try:
        days = datetime.date(*map(int, date.groups())).toordinal()
    except ValueError:
        return None
    return 86400.0 * days + 3600 * int(match.group(1)) + 60 * int(match.group(2)) + float(match.group(3))
