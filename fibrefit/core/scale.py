"""What one unit of a column is worth: ``"-200 N/V"``, ``"17.857 um"``, ``"2.07 +/- 0.29 N/A"``; and uncertainties."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from fibrefit.core import units
from fibrefit.core.errors import FibrefitError, StudyError
from fibrefit.core.units import ACCEPTED

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_WITHIN = r"(?:\+/-|\+-|±)"
_SCALE = re.compile(rf"\s*({_NUMBER})(?:\s*{_WITHIN}\s*({_NUMBER}))?(?![\d.,])\s*(.*?)\s*", re.DOTALL)
_UNIT = r"(?:1/)?[^\W\d%][^±%]*?|°"
_UNIT_TWICE = re.compile(rf"\s*({_NUMBER})\s*({_UNIT})\s*{_WITHIN}\s*({_NUMBER})\s*([^±]*?)\s*", re.DOTALL)

IN_PERCENT = "an uncertainty in %, of which the value may be a percentage too"
NOT_IN_PERCENT = (
    'Write "2.07 +/- 0.04 N/A", or the share behind the unit, as in "2.07 N/A +/- 2 %"; of a pure number "1.02 +/- '
    '0.01".'
)


def uncertain(text: object) -> tuple[str, str] | None:
    """Value and standard uncertainty, each with its unit; None for what is not so written.

    Of ``"3.1 +/- 0.05 kg"``, ``"3.1 kg +/- 50 g"`` and ``"3.1 kg +/- 2 %"``.
    """
    if not isinstance(text, str) or in_percent(text):
        return None
    if (match := _SCALE.fullmatch(text)) is not None and match[2] is not None:
        return f"{match[1]} {match[3]}".strip(), f"{match[2]} {match[3]}".strip()
    if (match := _UNIT_TWICE.fullmatch(text)) is None:
        return None
    value, unit, spread, beside = match.groups()
    if beside == "%":
        return f"{value} {unit}", f"{abs(float(value)) * float(spread) / 100.0:.12g} {unit}"
    return f"{value} {unit}", f"{spread} {beside or unit}"


def in_percent(text: object) -> bool:
    """Whether a text is as ``"2.07 +/- 2 % N/A"``, which may be read in two ways."""
    match = _SCALE.fullmatch(text) if isinstance(text, str) else None
    return match is not None and match[2] is not None and match[3].startswith("%")


def _in_one_unit(text: object) -> tuple[float, float, str] | None:
    """Value, standard uncertainty and the unit of both; None for what is not so written."""
    if isinstance(text, bool) or not isinstance(text, str | int | float):
        return None
    if (parts := uncertain(text)) is not None:
        (value, *unit), (spread, *other) = (part.split(" ", 1) for part in parts)
        return (float(value), float(spread), "".join(unit)) if unit == other else None
    match = _SCALE.fullmatch(str(text))
    return None if match is None else (float(match[1]), 0.0, match[3])


@dataclass(frozen=True, slots=True)
class Scale:
    """Factor between a column and the quantity it measures.

    Parameters
    ----------
    value : float
        Of either sign, in `unit`.
    error : float
        Its standard uncertainty, in `unit`; 0 where none is stated.
    unit : str
        Such as ``"N/V"``; ``"-"`` for a pure number.
    text : str
        As stated.
    """

    value: float
    error: float
    unit: str
    text: str

    @classmethod
    def parse(cls, text: str | float, where: str, *, error: type[FibrefitError] = StudyError) -> Scale:
        """Scale from what a person wrote.

        Parameters
        ----------
        text : str or float
            A number, perhaps with its uncertainty, and a unit.
        where : str
            File and key the message is to name.
        error : type
            Class of the error.

        Raises
        ------
        FibrefitError
            Of class `error`: no number, zero, not finite, a negative uncertainty, or a unit that is not known.
        """
        expected = 'a number with a unit, such as "-200 N/V", "17.857 um" or "2.07 +/- 0.29 N/A", both in one unit'
        if in_percent(text):
            raise error(where, f'scale "{text}": {IN_PERCENT}', expected, NOT_IN_PERCENT)
        if (stated := _in_one_unit(text)) is None:
            raise error(where, f'scale "{text}"', expected, "Write a decimal point." if "," in str(text) else "")
        value, spread, unit = stated[0], stated[1], stated[2] or "-"
        if not (math.isfinite(value) and math.isfinite(spread)) or value == 0 or spread < 0:
            raise error(where, f'scale "{text}"', f"{expected}; neither zero nor infinite", "")
        if units.expression("1" if unit == "-" else unit) is None:
            do = "Counts have no unit: write what one of them is worth."
            raise error(where, f'unit "{unit}" of the scale "{text}"', "a known unit, such as N/V, N/A or um", do)
        return cls(value, spread, unit, str(text).strip())

    @property
    def relative_error(self) -> float:
        """Standard uncertainty as a share of the value."""
        return abs(self.error / self.value)

    def factor(self, column_unit: str | None, si: str, where: str, *, error: type[FibrefitError] = StudyError) -> float:
        """What a number of the column is worth in SI.

        Parameters
        ----------
        column_unit : str or None
            Known unit of the column; None for counts.
        si : str
            SI unit wanted.
        where : str
            File and column the message is to name.
        error : type
            Class of the error.

        Returns
        -------
        float
            Multiplier in `si` per number of the column.

        Raises
        ------
        FibrefitError
            Of class `error`, if the two units do not make the one wanted.
        """
        divided = re.fullmatch(r"[^/]+/\s*\(?([^/()]+(?:/[^()]+)?)\)?", self.unit) if column_unit is None else None
        # Numbers without a unit are in what the scale divides by.
        of_column = column_unit or (divided[1].strip() if divided else "-")
        whole = units.product_in(of_column, self.unit, si)
        if whole is not None:
            return self.value * whole
        plain = units.product_in("-", of_column, "-") is not None
        wanted = units.usual(si) if plain else f"{units.usual(si)}/{of_column}"
        got = f'scale "{self.text}" for numbers {"without a unit" if plain else f"in {of_column}"}'
        if units.kind_of(of_column) == units.kind_of(si):
            wanted = "a pure number"
            do = f'The column is in {of_column} already. Counts would need unit = "counts" beside the scale.'
        elif plain and self.unit != "-":
            do = f"The numbers of the column are taken for {ACCEPTED.get(si, si)} only after a scale in {wanted}, or "
            do += 'after its unit is said, such as unit = "V" beside the scale.'
        else:
            do = "Correct the unit of the scale, or state the column's with unit = ... beside it."
        raise error(where, got, f"a scale in {wanted}" if wanted != "a pure number" else wanted, do)
