"""What a user says of one channel: its column, the unit of its numbers, which is zero, and what one is worth."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fibrefit.core import units
from fibrefit.core.declarations import ROLES
from fibrefit.core.errors import DataError, did_you_mean
from fibrefit.core.units import Scale

_KEYS = ("column", "unit", "scale", "zero")


@dataclass(frozen=True, slots=True)
class Channel:
    """A channel as declared.

    Parameters
    ----------
    column : str or None
        Heading, or ``"column 3"``; None leaves the column to headings and units.
    unit : str or None
        Of the numbers in the column.
    scale : Scale or None
        What one of them is worth.
    zero : float
        Number of the column that stands for nothing, as a raw reading without load.
    """

    column: str | None = None
    unit: str | None = None
    scale: Scale | None = None
    zero: float = 0.0

    @classmethod
    def of(cls, role: str, said: str | Mapping[str, Any] | Channel, where: str) -> Channel:
        """Channel from a heading, or from a table with ``column``, ``unit``, ``scale`` and ``zero``.

        Parameters
        ----------
        role : str
            One of `ROLES`.
        said : str, mapping or Channel
            What the user says.
        where : str
            File to name in messages.

        Returns
        -------
        Channel
            As declared.

        Raises
        ------
        DataError
            For an unknown role or key, an unknown unit, or a scale or a zero that is none.
        """
        place = f'{where}, channel "{role}"'
        if role not in ROLES:
            raise DataError(place, "unknown role", f"one of {', '.join(ROLES)}", did_you_mean(role, ROLES))
        if isinstance(said, Channel):
            return said
        if isinstance(said, str):
            return cls(said)
        if not isinstance(said, Mapping):
            raise DataError(place, f"{said!r}", 'a heading, or a table such as { column = "U1", scale = "-200 N/V" }')
        for key in said:
            if key not in _KEYS:
                raise DataError(place, f'unknown key "{key}"', f"one of {', '.join(_KEYS)}", did_you_mean(key, _KEYS))
        unit, scale = said.get("unit"), said.get("scale")
        if unit is not None and units.expression(str(unit)) is None:
            expected = f"{units.ACCEPTED[ROLES[role]]}, or V, A or counts with a scale"
            raise DataError(
                place, f'unit "{unit}"', expected, did_you_mean(str(unit), ("N", "mm", "ms", "V", "A", "counts"))
            )
        parsed = None if scale is None else Scale.parse(scale, place, error=DataError)
        return cls(
            said.get("column"), None if unit is None else str(unit), parsed, _zero(said.get("zero"), role, place)
        )


def _zero(said: object, role: str, place: str) -> float:
    if said is None:
        return 0.0
    if role == "time":
        raise DataError(place, "a zero of the times", "none: a record begins with its first sample", "Drop it.")
    if isinstance(said, bool) or not isinstance(said, int | float) or not math.isfinite(said):
        raise DataError(place, f"zero {said!r}", "a number of the column, such as 1034655", "Write it without a unit.")
    return float(said)
