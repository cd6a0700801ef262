"""What one unit of a column is worth: ``"-200 N/V"``, ``"17.857 um"``, ``"2.07 +/- 0.29 N/A"``; and uncertainties."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from fibrefit.core import units
from fibrefit.core.errors import FibrefitError, StudyError
from fibrefit.core.units import ACCEPTED

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_SCALE = re.compile(rf"\s*({_NUMBER})(?:\s*(?:\+/-|\+-|±)\s*({_NUMBER}))?(?![\d.,])\s*(.*?)\s*", re.DOTALL)


def uncertain(text: object) -> tuple[str, str] | None:
    """Value and standard uncertainty of ``"3.1 +/- 0.05 kg"``, each with the unit; None for what is not so written."""
    match = _SCALE.fullmatch(text) if isinstance(text, str) else None
    if match is None or match[2] is None:
        return None
    return f"{match[1]} {match[3]}".strip(), f"{match[2]} {match[3]}".strip()


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
        expected = 'a number with a unit, such as "-200 N/V", "17.857 um" or "2.07 +/- 0.29 N/A"'
        match = _SCALE.fullmatch(str(text)) if isinstance(text, str | int | float) and text is not True else None
        if match is None:
            raise error(where, f'scale "{text}"', expected, "Write a decimal point." if "," in str(text) else "")
        value, spread, unit = float(match[1]), float(match[2] or 0.0), match[3] or "-"
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
