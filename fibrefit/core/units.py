"""Units: read from what people and loggers write, converted to SI, chosen for what a person reads.

The registry holds the units of this field and nothing else, so a spelling outside it is refused and never misread.
"""

from __future__ import annotations

import functools
import math
import re
from typing import TYPE_CHECKING

from fibrefit.core.errors import DataError, FibrefitError, StudyError, did_you_mean
from fibrefit.core.unit_names import ACCEPTED, DEFINITIONS, KINDS, SHOWN, SPELLINGS, USUAL, WHOLE, WORDS

if TYPE_CHECKING:
    import pint

_SAME = str.maketrans(
    {"\xb5": "u", "\u03bc": "u", "·": "*", "\u22c5": "*", "\xd7": "*", "\u2212": "-", "\xa0": " ", "\u202f": " "}
    | {"²": "^2", "³": "^3", "⁻": "^-", "¹": "1", "℃": "°C"}
)
_FACTOR = re.compile(r'([^\W\d_]+|[%°"]C?|1)(\^?-?\d+)?')
_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?![\d.])\s*(.*?)\s*", re.DOTALL)


@functools.cache
def _registry() -> pint.UnitRegistry:
    import pint  # an eighth of a second: only where a unit is really met

    registry: pint.UnitRegistry = pint.UnitRegistry(None)
    for symbol, definition in DEFINITIONS.items():
        registry.define(f"{symbol} = {definition}")
    return registry


@functools.cache
def expression(text: str) -> str | None:
    """Unit in the symbols of the registry, or None where the spelling is not known.

    Parameters
    ----------
    text : str
        As written: ``"kN/m"``, ``"Newtons"``, ``"Ns/m"``, ``"m/s²"``.

    Returns
    -------
    str or None
        An expression such as ``"N*s/m"``.
    """
    plain = text.translate(_SAME).replace("**", "^").strip()
    if not plain or len(plain) > 40:
        return None
    whole = WHOLE.get(plain) or WORDS.get(plain.casefold())
    return whole or _quotient(plain) or _product(plain)


def _quotient(plain: str) -> str | None:
    """``N/(mV/V)``: a unit divided by one in brackets; None where it is anything else."""
    match = re.fullmatch(r"([^()]+?)\s*/\s*\(([^()]+)\)", plain)
    parts = [expression(part) for part in match.groups()] if match else []
    return None if not parts or None in parts else f"({parts[0]})/({parts[1]})"


def _product(plain: str) -> str | None:
    """Product and quotient of known symbols; None if anything else is left over."""
    factors: list[str] = []
    position, divided = 0, False
    while position < len(plain):
        joint = re.compile(r"\s*([*/.]|\s)\s*" if factors else "()").match(plain, position)
        factor = joint and _FACTOR.match(plain, joint.end())
        if joint is None or factor is None:
            return None
        divide = joint.group(1) == "/"
        if divided and not divide:  # "N/m s" can be read in two ways
            return None
        divided = divided or divide
        symbol = _symbol(factor.group(1), first=not factors)
        if symbol is None:
            return None
        power = (factor.group(2) or "").lstrip("^")
        if power and not 1 <= abs(int(power)) <= 4:
            return None
        factors.append(("/" if divide else "*" if factors else "") + f"({symbol})" + (f"**({power})" if power else ""))
        position = factor.end()
    return "".join(factors)


def _symbol(word: str, *, first: bool) -> str | None:
    if word == "1":
        return "1" if first else None
    if word in DEFINITIONS:
        return word
    return SPELLINGS.get(word) or WORDS.get(word.casefold())


@functools.cache
def _in_base_units(text: str) -> tuple[float, str] | None:
    """Factor to base units and a text of the dimension; None where the unit is not known."""
    written = expression("1" if text == "-" else text)
    if written is None:
        return None
    return USUAL.get(written) or _by_registry(written)


def _by_registry(written: str) -> tuple[float, str]:
    """Factor to base units of an expression, and the powers of its dimensions in order of their names."""
    base = _registry().Quantity(1.0, written).to_base_units()
    powers = sorted(base.dimensionality.items())
    return float(base.magnitude), " ".join(f"{name}^{power:g}" for name, power in powers)


def is_si(unit: str) -> bool | None:
    """Whether a unit is a product of SI units without a factor; None where it is not known.

    Parameters
    ----------
    unit : str
        As written, e.g. ``"N s/m"``; ``"-"`` for a pure number.
    """
    base = _in_base_units(unit)
    return None if base is None else base[0] == 1.0


@functools.cache
def _si_of_dimension() -> dict[str, str]:
    found: dict[str, str] = {}
    for si in KINDS:
        base = _in_base_units(si)
        if base is not None:
            found.setdefault(base[1], si)
    return found


def si_unit(unit: str) -> str | None:
    """SI unit of the same kind, or None where `unit` is not known or of no kind met in this field.

    Parameters
    ----------
    unit : str
        As written, e.g. ``"kN"``.

    Returns
    -------
    str or None
        E.g. ``"N"``; ``"degC"`` for temperatures, which only accompany a record.
    """
    base = _in_base_units(unit)
    return None if base is None else _si_of_dimension().get(base[1])


def kind_of(unit: str) -> str | None:
    """Kind of quantity a unit measures: ``"force"``, ``"length"``, ``"time"`` ...; None where it is not known."""
    si = si_unit(unit)
    return None if si is None else KINDS[si]


def to_si(unit: str, si: str, where: str = "unit", *, do: str = "", error: type[FibrefitError] = DataError) -> float:
    """Factor that turns a number in `unit` into one in `si`.

    Parameters
    ----------
    unit : str
        As written.
    si : str
        SI unit wanted, e.g. ``"N"``.
    where : str
        File and column the message is to name.
    do : str
        What the message tells a person to do.
    error : type
        Class of the error.

    Returns
    -------
    float
        Multiplier, exact to rounding.

    Raises
    ------
    FibrefitError
        Of class `error`, if `unit` is not known or measures something else than `si` does.
    ValueError
        If `si` is no unit of this program.
    """
    found, wanted = _in_base_units(unit), _in_base_units(si)
    if wanted is None:
        raise ValueError(f"{si!r} is no unit of this program")
    if found is None or found[1] != wanted[1]:
        near = did_you_mean(unit, _offered(si)) if found is None else ""
        raise error(where, f'unit "{unit}"', ACCEPTED.get(si, f"a unit of the kind {si}"), do or near)
    # Clean decimals: 0.001 and not 0.0010000000000000002.
    return float(f"{found[0] / wanted[0]:.15g}")


def product_in(first: str, second: str, si: str) -> float | None:
    """Factor that turns a product of two units into one in `si`; None where it measures something else.

    Parameters
    ----------
    first, second : str
        Known units; ``"-"`` for a pure number.
    si : str
        SI unit wanted.

    Returns
    -------
    float or None
        Multiplier, exact to rounding.
    """
    written = [expression("1" if unit == "-" else unit) for unit in (first, second)]
    wanted = _in_base_units(si)
    if wanted is None or None in written:
        return None
    factor, dimension = _by_registry(f"({written[0]})*({written[1]})")
    return float(f"{factor / wanted[0]:.15g}") if dimension == wanted[1] else None


def usual(si: str) -> str:
    """First unit a message offers for a kind of quantity, e.g. ``"N"``."""
    return ACCEPTED.get(si, si).split(",")[0].split(" or ")[0]


def _offered(si: str) -> list[str]:
    return [word for word in re.split(r", | or ", ACCEPTED.get(si, si)) if " " not in word or word == si]


def parse_quantity(
    text: str | float, si: str, where: str = "value", *, error: type[FibrefitError] = StudyError
) -> float:
    """Number in SI from a quantity written with its unit.

    Parameters
    ----------
    text : str or float
        ``"3.096 kg"``, ``"30 kN/m"``, ``"90 deg"``. A bare number passes only where `si` is ``"-"``.
    si : str
        SI unit of the result.
    where : str
        File and key the message is to name.
    error : type
        Class of the error.

    Raises
    ------
    FibrefitError
        Of class `error`: no number, no unit, a unit of another kind, a decimal comma, or not finite.
    """
    accepted = ACCEPTED.get(si, si)
    if isinstance(text, bool) or not isinstance(text, str | int | float):
        raise error(where, f"{text!r} is not a quantity", f"a number with a unit ({accepted})")
    match = _NUMBER.fullmatch(str(text))
    if match is None:
        comma = re.match(r"\s*[+-]?\d+,\d", str(text))
        do = "Write a decimal point." if comma else ""
        raise error(where, f'"{text}" is not a quantity', f"a number with a unit ({accepted})", do)
    number, unit = float(match.group(1)), match.group(2)
    if unit.startswith(","):
        raise error(where, f'"{text}" has a decimal comma', f"a number with a unit ({accepted})", "Write a point.")
    if not math.isfinite(number):
        raise error(where, f'"{text}" is not finite', f"a number with a unit ({accepted})")
    if not unit and si == "-":
        return number
    if not unit:
        raise error(where, f'"{text}" has no unit', accepted, f'Write it with its unit, such as "{text} {usual(si)}".')
    return number * to_si(unit, si, where, error=error)


def shown_unit(value: float, si: str) -> tuple[str, float]:
    """Unit a person would choose for a value in SI.

    Parameters
    ----------
    value : float
        Size of the number, in `si`.
    si : str
        SI unit.

    Returns
    -------
    tuple of str and float
        The unit and what it is worth in `si`; the same pair suits the error bar of the value.
    """
    steps = SHOWN.get(si, ((si, 1.0),))
    fallback = min(steps, key=lambda step: abs(step[1] - (1e-3 if si == "m" else 1.0))) if value == 0 else steps[-1]
    return next((step for step in steps if abs(value) >= step[1] * (1 - 1e-12)), fallback)


def format_quantity(value: float, si: str, digits: int = 4) -> str:
    """Value with the unit a person would choose: ``34.21 kN/m``, ``13.8 mm``. ASCII only.

    Parameters
    ----------
    value : float
        In `si`.
    si : str
        SI unit; ``"-"`` for a pure number, which is shown bare.
    digits : int
        Significant digits.

    Returns
    -------
    str
        Text that `parse_quantity` reads back.
    """
    unit, worth = shown_unit(value, si)
    number = format_number(value / worth, digits)
    return number if unit == "-" else f"{number} {unit}"


def typeset_unit(unit: str) -> str:
    """A unit in the signs of print, or a quantity with one: ``µm``, ``N s/m``, ``m/s²``, ``45°``."""
    return unit.replace("um", "µm").replace("^2", "²").replace(" deg", "°").replace("deg", "°")


def format_number(value: float, digits: int = 4) -> str:
    """Number to some significant digits, without an exponent where it stays readable.

    Parameters
    ----------
    value : float
        Any number.
    digits : int
        Significant digits.

    Returns
    -------
    str
        E.g. ``"34210"`` for 34213.7 and four digits.
    """
    short = f"{value:.{digits}g}"
    if "e" not in short or not 1e-4 <= abs(value) < 1e7:
        return short
    return f"{float(short):.0f}" if abs(value) >= 1 else f"{float(short):.10f}".rstrip("0")


def format_share(share: float) -> str:
    """A share in percent; near the whole, to as many digits as tell it from the whole: ``99.94 %``.

    Parameters
    ----------
    share : float
        1 for the whole; below 0 where a model is worse than none.
    """
    percent = 100.0 * share
    for digits in (1, 2, 3, 4):
        if 100.0 - percent >= 2.0 * 10.0**-digits:
            return f"{percent:.{digits}f} %"
    return "over 99.999 %" if percent < 100.0 else "100 %"
