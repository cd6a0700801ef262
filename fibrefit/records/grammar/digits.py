"""Characters lost or doubled inside a number, found from how the rest of its column is written and runs.

A digit that turned into another digit cannot be seen by anybody. A digit that is missing or there twice can, where the
column always has the same number of decimals, or where one more or one fewer character puts a lone outlier back among
its neighbours.
"""

from __future__ import annotations

import math
import re

import numpy as np

from fibrefit.records.grammar.neighbours import neighbourhood, smallest_step, typical
from fibrefit.records.grammar.numbers import CODE, EMPTY_WHOLE, EXPONENT, Numbers
from fibrefit.records.grammar.tokens import NUMBER
from fibrefit.records.thresholds import (
    ALIKE_WRITTEN,
    FAR_OUT,
    FEWEST_WHOLE,
    FEWEST_WRITTEN,
    LOST_MARK,
    PUT_BACK,
    ROUND_BY_CHANCE,
)


def odd_numbers(numbers: Numbers) -> np.ndarray:
    """Samples whose digits do not look complete.

    Parameters
    ----------
    numbers : Numbers
        A column.

    Returns
    -------
    (n,) bool array
        True where the number cannot be relied on.
    """
    return oddly_written(numbers) | _mark_lost(numbers) | _outliers_explained(numbers)


def cut_short(numbers: Numbers) -> bool:
    """Whether the last number of a column may end too early, the file having no end of line after it.

    Parameters
    ----------
    numbers : Numbers
        The last column of a table.

    Returns
    -------
    bool
        False where it has as many decimals as any number of the column.
    """
    shapes = numbers.shapes
    return bool(shapes[-1] >= 0 and shapes[-1] < shapes.max())


def grouped_digits(numbers: Numbers) -> str:
    """A cell whose mark may separate thousands and no decimals, where no number of the column tells; empty for none.

    Every number with a mark has three digits behind it and is one or more, and whole numbers are below a thousand:
    readings that drop their last zeros have some with one or two decimals, and some below one.

    Parameters
    ----------
    numbers : Numbers
        A column.
    """
    values, shapes = np.abs(numbers.values), numbers.shapes
    marked, whole = shapes == 3, shapes == 0
    if not len(numbers.texts) or not marked.any() or not (marked | whole | (shapes < 0)).all():
        return ""
    counted = {*values[whole].tolist()} - {0.0}
    if len(counted) < FEWEST_WHOLE or max(counted) >= 1000.0 or values[marked].min() < 1.0:
        return ""
    first = numbers.texts[int(np.flatnonzero(marked)[0])]
    return first if re.fullmatch(r"\s*[+-]?[1-9]\d{0,2}[.,]\d{3}\s*", first) else ""


def oddly_written(numbers: Numbers) -> np.ndarray:
    """Numbers with other decimals than all the rest, where the column does not simply drop its last zeros.

    Parameters
    ----------
    numbers : Numbers
        A column.

    Returns
    -------
    (n,) bool array
        True where a digit is missing or there twice.
    """
    shapes = numbers.shapes
    present = shapes >= 0
    bare_zero = (numbers.values == 0) & (shapes == 0)
    candidates = present & ~bare_zero
    odd = np.zeros(shapes.size, bool)
    if candidates.sum() < FEWEST_WRITTEN or np.ptp(shapes[candidates]) == 0:
        return odd
    # Numbers of one decade are compared with each other: some instruments, and all programs that print significant
    # digits, spend fewer decimals on larger numbers.
    sizes = np.abs(np.where(candidates & (numbers.values != 0), numbers.values, 1.0))
    decades = np.floor(np.log10(sizes))
    groups = [candidates & (decades == decade) for decade in sorted(set(decades[candidates].tolist()))]
    groups = [group for group in groups if group.sum() >= FEWEST_WRITTEN]
    if len({_usual(shapes[group]) for group in groups}) <= 1:
        return _odd_among(numbers, candidates)
    for group in groups:
        odd |= _odd_among(numbers, group)
    return odd


def _odd_among(numbers: Numbers, rows: np.ndarray) -> np.ndarray:
    """Numbers with other decimals than nearly all of some rows, if zeros at the end are printed there."""
    shapes = numbers.shapes
    usual = _usual(shapes[rows])
    odd = rows & (shapes != usual)
    if not odd.any() or odd.sum() > (1 - ALIKE_WRITTEN) * rows.sum() or _as_it_takes(shapes[odd], usual):
        return np.zeros(shapes.size, bool)
    # A held weight repeats one number: only different ones show how often a last digit is zero.
    distinct, short = (_distinct(numbers, mask) for mask in (rows, odd))
    # Python prints the last zero of 1.0 and not that of 0.50: how the usual ones are written tells.
    complete = _keeps_zeros(numbers, rows & ~odd) or _too_few_to_be_round(short, distinct)
    return odd if complete else np.zeros(shapes.size, bool)


def _as_it_takes(odd: np.ndarray, usual: int) -> bool:
    """Whether decimals of the odd numbers say that as many are written as a number takes.

    A character written twice is one decimal more. Means of a few whole readings end after one or two decimals, or, such
    as a third, where those of a double end.
    """
    alike = odd // EMPTY_WHOLE == usual // EMPTY_WHOLE
    return bool(2 * np.count_nonzero(alike & (odd > usual + 1)) > odd.size)


def _distinct(numbers: Numbers, rows: np.ndarray) -> int:
    """How many different numbers are written, one with another number of decimals being another."""
    shapes = np.unique(numbers.shapes[rows])
    return sum(np.unique(numbers.values[rows & (numbers.shapes == shape)]).size for shape in shapes)


def _usual(shapes: np.ndarray) -> int:
    return int(np.bincount(shapes).argmax())


def _mark_lost(numbers: Numbers) -> np.ndarray:
    """Whole numbers far beyond all others in a column of decimals."""
    shapes, sizes = numbers.shapes, np.abs(numbers.values)
    present = shapes >= 0
    marked = present & (shapes % EMPTY_WHOLE > 0)
    if marked.sum() < ALIKE_WRITTEN * present.sum() or not marked.any():
        return np.zeros(shapes.size, bool)
    return present & ~marked & (sizes > LOST_MARK * sizes[marked].max())


def _keeps_zeros(numbers: Numbers, rows: np.ndarray) -> bool:
    """Whether decimals that are zero are printed: else a short number is a round one."""
    # Of numbers without an exponent only those with a zero at the end, by their value, need be looked at.
    shapes = numbers.shapes
    last = np.rint(np.where(rows, numbers.values, 1.0) * 10.0 ** (shapes % EMPTY_WHOLE)) % 10
    texts = (numbers.texts[i] for i in np.flatnonzero(rows & ((last == 0) | (shapes >= EXPONENT))).tolist())
    mantissas = (re.split("[eEdD]", text)[0] for text in texts)
    return any(numbers.mark in text and text.endswith("0") for text in mantissas)


def _too_few_to_be_round(odd: int, n: int) -> bool:
    """Whether fewer numbers are short than dropped zeros leave short: one in ten, or more where steps are coarse."""
    return odd < ROUND_BY_CHANCE * n - 3 * math.sqrt(ROUND_BY_CHANCE * (1 - ROUND_BY_CHANCE) * n)


def _outliers_explained(numbers: Numbers) -> np.ndarray:
    """Lone outliers that a lost character put back, or a doubled one taken out, would put among their neighbours."""
    values = numbers.values
    found = np.zeros(values.size, bool)
    good = np.flatnonzero(np.isfinite(values))
    if good.size < 6:
        return found
    run = values[good]
    middle, spread = neighbourhood(run)
    apart = np.abs(run - middle)
    # A logger with coarse steps that prints more digits than it reads goes over to the next step by chance.
    scatter = np.maximum(spread, max(1.4826 * typical(apart), numbers.resolution, smallest_step(run)))
    for k in np.flatnonzero(apart > FAR_OUT * scatter):
        limit = PUT_BACK * scatter[k]
        text = numbers.texts[good[k]]
        found[good[k]] = any(abs(value - middle[k]) <= limit for value in _one_character_away(text, numbers.mark))
    return found


def _one_character_away(text: str, mark: str) -> list[float]:
    """Numbers a text was before it lost a character, or before one was written twice."""
    texts = {text[:i] + text[i + 1 :] for i in range(1, len(text)) if text[i] == text[i - 1]}
    texts |= {text[:i] + char + text[i:] for i in range(len(text) + 1) for char in f"0123456789-{mark}"}
    return [float(re.sub("[dD]", "e", t.replace(mark, "."))) for t in texts if NUMBER[mark].fullmatch(t)]


def masked_with(numbers: Numbers, where: np.ndarray, reason: str) -> Numbers:
    """Numbers with some samples masked for a reason; a sample keeps the first reason it was given.

    Parameters
    ----------
    numbers : Numbers
        A column.
    where : (n,) bool array
        Samples to mask.
    reason : str
        One of `REASONS`.

    Returns
    -------
    Numbers
        A copy; the same where nothing is masked.
    """
    if not where.any():
        return numbers
    fresh = where & (numbers.reasons == 0)
    return Numbers(
        np.where(where, np.nan, numbers.values),
        np.where(fresh, np.uint8(CODE[reason]), numbers.reasons),
        np.where(where, -1, numbers.shapes),
        numbers.texts,
        numbers.mark,
    )
