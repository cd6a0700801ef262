"""What a parameter means: unit, range, scale and source. Never a fitted value."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple


@dataclass(frozen=True, slots=True)
class Parameter:
    """Declaration of one number a model contains.

    Parameters
    ----------
    name : str
        Name in the study, the results and every message; dotted for effects
        (``guide.stribeck_friction.breakaway_excess``).
    unit : str
        SI unit of the value, e.g. ``"N/m"``.
    doc : str
        One sentence that says what it is.
    typical : float
        A plausible size, in `unit`; sets scales and search ranges.
    lower, upper : float
        Physical range, in `unit`; infinite where there is no limit.
    null : float
        Value at which the effect vanishes exactly, in `unit`.
    log : bool
        Whether the value spans decades and is searched on a logarithmic scale.
    reciprocal : bool
        Whether it is searched by its inverse, because the effect vanishes where the value is infinite. A model takes
        such a value as `ByInverse` too, and has a finite derivative in the inverse there.
    relative : bool
        Whether it is a relative change of a parameter: a search takes it by the logarithm of what it multiplies by, as
        it does what that parameter differs by from record to record.
    starts : tuple of float
        Where a search for it begins, in `unit`; about the typical size where empty.
    spread : float
        How far from the typical value a shape may well be, in `unit`; as far as that is from zero where it is 0.
    source : str
        Where the law or the range comes from.
    symbol : str
        In the equation of its law.
    """

    name: str
    unit: str
    doc: str
    typical: float
    lower: float = -math.inf
    upper: float = math.inf
    null: float = 0.0
    log: bool = False
    reciprocal: bool = False
    relative: bool = False
    starts: tuple[float, ...] = ()
    spread: float = 0.0
    source: str = ""
    symbol: str = ""


class ByInverse(NamedTuple):
    """A value given by its inverse, so that an infinite one is a plain zero.

    Parameters
    ----------
    inverse : () in the inverse of the parameter's unit
    """

    inverse: Any


def inverse_of(value: Any) -> Any:
    """Inverse of a value that may be given by it."""
    return value.inverse if isinstance(value, ByInverse) else 1.0 / value
