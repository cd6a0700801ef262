"""Cells of one column to numbers, and what was wrong with each cell that is none."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.records.grammar.tokens import NUMBER, THOUSANDS, clean, kind_of_cell, shapes_of
from fibrefit.records.thresholds import OTHER_MARKS

#: Reasons a sample is masked, in the order of their codes; code 0 is a good sample.
REASONS = (
    "",
    "empty",
    "not a number",
    "overflow",
    "unreadable",
    "other decimal mark",
    "digit lost or doubled",
    "cut short",
    "absurd",
    "time unusable",
    "saturated",
    "stuck",
    "held over",
    "out of range",
)
CODE = {reason: code for code, reason in enumerate(REASONS)}


@dataclass(frozen=True, slots=True)
class Numbers:
    """Numbers of a column.

    Parameters
    ----------
    values : (n,) float array
        In the unit of the file; NaN where there is no number.
    reasons : (n,) uint8 array
        Index into `REASONS`; 0 where the sample is good.
    shapes : (n,) int array
        How the number is written: decimals and exponent in one code; -1 where there is none.
    texts : sequence of str
        The cells.
    mark : str
        Decimal mark.
    """

    values: np.ndarray
    reasons: np.ndarray
    shapes: np.ndarray
    texts: Sequence[str]
    mark: str

    @classmethod
    def of_array(cls, values: np.ndarray) -> Numbers:
        """Numbers of a binary file: NaN and infinity are masked.

        Parameters
        ----------
        values : (n,) array
            Any real type.

        Returns
        -------
        Numbers
            Without texts.
        """
        values = values.astype(float)
        reasons = np.where(np.isnan(values), CODE["not a number"], np.where(np.isinf(values), CODE["overflow"], 0))
        values = np.where(np.isfinite(values), values, np.nan)
        return cls(values, reasons.astype(np.uint8), np.full(values.size, -1), (), ".")

    @property
    def resolution(self) -> float:
        """What the last printed digit is worth: in the finest number, or in the largest with an exponent."""
        shapes = self.shapes
        if shapes.size and shapes.min() < 0:
            shapes = shapes[shapes >= 0]
        if not shapes.size:
            return 0.0
        if not (shapes // EXPONENT).any():
            return float(10.0 ** -int((shapes % EMPTY_WHOLE).max()))
        largest = float(np.nanmax(np.abs(self.values)))
        return float(10.0 ** (np.floor(np.log10(largest)) - int((shapes % EMPTY_WHOLE).max()))) if largest else 0.0


#: Parts of the code of how a number is written, above the count of its decimals: characters of the exponent, and no
#: digit before the mark.
EXPONENT, EMPTY_WHOLE = 1000, 100


#: Between groups of three digits: it is no decimal mark anywhere.
_APOSTROPHE = re.compile(r"(?<=\d)['\u2019](?=\d{3}(?!\d))")


#: A negative number as book-keepers write it.
_MINUS_BEHIND = re.compile(r"\(\d[\d.,]*\)|\d[\d.,]*\s?-")


def parse_column(texts: Sequence[str], mark: str, lines: np.ndarray, where: str) -> Numbers:
    """Numbers of a column of cells.

    Parameters
    ----------
    texts : sequence of str
        Cells, one a row.
    mark : str
        Decimal mark.
    lines : (n,) int array
        Line of each row, for messages.
    where : str
        File and column to name in messages.

    Returns
    -------
    Numbers
        Values and the reason for each gap among them.

    Raises
    ------
    DataError
        For thousands separators, and for two decimal marks in one column.
    """
    joined = "\n".join(texts)
    if re.fullmatch(rf"[\d+\-eE{re.escape(mark)}\n]*", joined) and joined:
        try:
            values = np.fromiter(map(float, joined.replace(mark, ".").split("\n")), float, len(texts))
        except ValueError:
            pass
        else:
            return _numbers(values, np.zeros(len(texts), np.uint8), texts, mark)
    return _one_by_one(texts, mark, lines, where)


def _one_by_one(texts: Sequence[str], mark: str, lines: np.ndarray, where: str) -> Numbers:
    values = np.full(len(texts), np.nan)
    reasons = np.zeros(len(texts), np.uint8)
    cleaned = [_APOSTROPHE.sub("", clean(text)) for text in texts]
    number, grouped = NUMBER[mark], []
    for i, text in enumerate(cleaned):
        if number.fullmatch(text):
            values[i] = float(text.replace(mark, ".").replace("d", "e").replace("D", "e"))
            continue
        reason = _reason(text, mark)
        reasons[i] = CODE.get(reason, CODE["unreadable"])
        if reason == "thousands":
            grouped.append(i)
    _refuse_thousands(cleaned, grouped, values, mark, lines, where)
    other = reasons == CODE["other decimal mark"]
    if other.sum() > max(2, OTHER_MARKS * len(texts)):
        first = int(np.flatnonzero(other)[0])
        got = f'"{texts[first]}" beside numbers with a decimal "{mark}"'
        raise DataError(f"{where}, line {lines[first]}", got, "one decimal mark throughout", "Export the file again.")
    behind = [i for i in np.flatnonzero(reasons == CODE["unreadable"]).tolist() if _MINUS_BEHIND.fullmatch(cleaned[i])]
    if len(behind) > max(2, OTHER_MARKS * len(texts)):
        got = f'"{texts[behind[0]]}", whose minus does not stand before it'
        raise DataError(f"{where}, line {lines[behind[0]]}", got, "plain numbers", "Export the file again.")
    return _numbers(values, reasons, cleaned, mark)


def _reason(text: str, mark: str) -> str:
    kind = kind_of_cell(text, mark)
    other = "," if mark == "." else "."
    if kind == "thousands" and re.fullmatch(r"[+-]?\d{1,3}[.,]\d{3}", text):
        return "other decimal mark"  # perhaps thousands: the rest of the column decides
    return "other decimal mark" if kind == "text" and NUMBER[other].fullmatch(text) else kind


def _refuse_thousands(
    texts: Sequence[str], grouped: list[int], values: np.ndarray, mark: str, lines: np.ndarray, where: str
) -> None:
    """Refuse digits in groups of three; a lone ``1.012`` among whole numbers is one too."""
    if not grouped:
        whole = [text for text in texts if text and NUMBER[mark].fullmatch(text)]
        alone = [i for i, text in enumerate(texts) if np.isnan(values[i]) and THOUSANDS[mark].fullmatch(text)]
        if not alone or (whole and any(mark in text for text in whole)):
            return
        grouped = alone
    where = f"{where}, line {lines[grouped[0]]}"
    got = f'"{texts[grouped[0]]}" has a thousands separator'
    raise DataError(where, got, "plain digits", "Export the file without thousands separators.")


def _numbers(values: np.ndarray, reasons: np.ndarray, texts: Sequence[str], mark: str) -> Numbers:
    infinite = np.isinf(values)
    if infinite.any():
        reasons = np.where(infinite, np.uint8(CODE["overflow"]), reasons)
        values = np.where(infinite, np.nan, values)
    shapes = _shapes(texts, mark)
    shapes[np.isnan(values)] = -1
    return Numbers(values, reasons, shapes, texts, mark)


def _shapes(texts: Sequence[str], mark: str) -> np.ndarray:
    """Code of how each number is written: decimals, whether digits stand before the mark, length of the exponent."""
    shapes = shapes_of(texts)
    known = {shape: _shape(shape, mark) for shape in dict.fromkeys(shapes)}
    return np.fromiter(map(known.__getitem__, shapes), int, len(texts))


def _shape(text: str, mark: str) -> int:
    mantissa = re.split("[eEdD]", text, maxsplit=1)[0]
    place = mantissa.find(mark)
    found = (0 if place < 0 else len(mantissa) - place - 1) + EXPONENT * (len(text) - len(mantissa))
    bare = place in (0, 1) and not text[0].isdigit() and text.lstrip("+-").startswith(mark)
    return found + EMPTY_WHOLE if bare else found
