"""Units: read from what people and loggers write, and converted to SI; with them factors and uncertainties.

The registry of pint holds the units of ``units.txt`` beside this file, those of this field and nothing else, so a
spelling outside them is refused and never misread. Before pint reads a unit it is brought to the symbols of the
registry, as one of few forms: what may be read in two ways is refused too.
"""

from __future__ import annotations

import functools
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from fibrefit.core.errors import DataError, FibrefitError, StudyError, did_you_mean

if TYPE_CHECKING:
    import pint

DEFINITIONS: dict[str, str] = {}
"""Of each symbol; those of ``units.txt``, as all tables below it."""
_SPELLINGS: dict[str, str] = {}
_WHOLE: dict[str, str] = {}
_WORDS: dict[str, str] = {}
"""Symbol for each spelling: of a part of a unit, of a whole unit, of either in any case."""
KINDS: dict[str, str] = {}
"""SI unit and the kind of quantity it measures."""
ACCEPTED: dict[str, str] = {}
"""What a message offers where a unit was not understood."""

USUAL: dict[str, tuple[float, str]] = {
    written: (factor, dimension)
    for dimension, units in {
        "": {"1": 1.0, "percent": 0.01},
        "[time]^1": {"(s)": 1.0, "(ms)": 0.001, "(us)": 1e-06, "(ns)": 1e-09, "(h)": 3600.0, "(min)": 60.0},
        "[length]^1 [mass]^1 [time]^-2": {"(N)": 1.0, "(kN)": 1000.0, "(mN)": 0.001},
        "[length]^1": {"(m)": 1.0, "(mm)": 0.001, "(um)": 1e-06},
        "[mass]^1": {"(kg)": 1.0, "(g)": 0.001, "(mg)": 1e-06},
        "[angle]^1": {"(rad)": 1.0, "(deg)": 0.017453292519943295},
        "[time]^-1": {"(Hz)": 1.0, "(kHz)": 1000.0},
        "[length]^1 [time]^-1": {"(m)/(s)": 1.0, "(mm)/(s)": 0.001},
        "[length]^1 [time]^-2": {"(m)/(s)**(2)": 1.0},
        "[angle]^1 [time]^-1": {"(rad)/(s)": 1.0, "(deg)/(s)": 0.017453292519943295},
        "[mass]^1 [time]^-2": {"(N)/(m)": 1.0, "(kN)/(m)": 1000.0, "(N)/(mm)": 1000.0},
        "[mass]^1 [time]^-1": {"(N)*(s)/(m)": 1.0},
        "[length]^1 [mass]^1 [time]^-1": {"(N)*(s)": 1.0},
        "[length]^2 [mass]^1 [time]^-2": {"(N)*(m)": 1.0},
        "[length]^2 [mass]^1": {"(kg)*(m)**(2)": 1.0},
        "[voltage]^1": {"(V)": 1.0, "(mV)": 0.001},
        "[current]^1": {"(A)": 1.0, "(mA)": 0.001},
        "[temperature]^1": {"(degC)": 1.0},
        "[length]^-1 [mass]^1 [time]^-2": {"(Pa)": 1.0},
        "[length]^1 [mass]^1 [time]^-3": {"(N)/(s)": 1.0},
        "[length]^-1": {"(1)/(m)": 1.0},
    }.items()
    for written, factor in units.items()
}
"""What the usual units are in base units: factor, and powers of the dimensions in order of their names. A study that
has no others is read without loading pint, which takes as long as reading five records."""

_SAME = str.maketrans(
    {"\xb5": "u", "\u03bc": "u", "·": "*", "\u22c5": "*", "\xd7": "*", "\u2212": "-", "\xa0": " ", "\u202f": " "}
    | {"²": "^2", "³": "^3", "⁻": "^-", "¹": "1", "℃": "°C"}
)
_WORD, _POWER = r'[^\W\d_]+|[%°"]C?|1', r"\^?-?\d+"
_FACTOR = re.compile(rf"([*/.]?)\s*({_WORD})({_POWER})?")
# Products first, then quotients: "N/m s" can be read in two ways.
_FORM = re.compile(r"F(?:(?:\s*[*.]\s*|\s+)F)*(?:\s*/\s*F)*".replace("F", f"(?:{_WORD})(?:{_POWER})?"))
_IN_BRACKETS = re.compile(r"([^()]+?)\s*/\s*\(([^()]+)\)")

_DECIMAL = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_QUANTITY = re.compile(rf"\s*({_DECIMAL})(?![\d.])\s*(.*?)\s*", re.DOTALL)
_WITHIN = r"(?:\+/-|\+-|±)"
# Compiled when they are first needed.
_SCALE = rf"(?s)\s*({_DECIMAL})(?:\s*{_WITHIN}\s*({_DECIMAL}))?(?![\d.,])\s*(.*?)\s*"
_UNIT = r"(?:1/)?[^\W\d%][^±%]*?|°"
_UNIT_TWICE = rf"(?s)\s*({_DECIMAL})\s*({_UNIT})\s*{_WITHIN}\s*({_DECIMAL})\s*([^±]*?)\s*"

IN_PERCENT = "an uncertainty in %, of which the value may be a percentage too"
NOT_IN_PERCENT = (
    'Write "2.07 +/- 0.04 N/A", or the share behind the unit, as in "2.07 N/A +/- 2 %"; of a pure number "1.02 +/- '
    '0.01".'
)


def _read_tables() -> None:
    """Fill the tables from the file; each line of it has columns, and one that is indented goes on with that before."""
    text = Path(__file__).with_name("units.txt").read_text(encoding="utf-8").replace("\n    ", " ")
    for line in text.splitlines():
        if not line or line.startswith("#"):
            continue
        first, *columns = (column.strip() for column in line.split("|"))
        if " : " in first:
            unit, KINDS[unit] = first.split(" : ")
            ACCEPTED.update((unit, offered) for offered in columns)
        else:
            symbol, sign, definition = first.partition(" = ")
            DEFINITIONS.update({symbol: definition} if sign else {})
            for known, spellings in zip((_SPELLINGS, _WHOLE, _WORDS), columns, strict=False):
                known.update((name.replace("_", " "), symbol) for name in spellings.split())


_read_tables()


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
        As written: ``"kN/m"``, ``"Newtons"``, ``"Ns/m"``, ``"m/s²"``, ``"N/(mV/V)"``.

    Returns
    -------
    str or None
        An expression such as ``"(N)*(s)/(m)"``.
    """
    plain = text.translate(_SAME).replace("**", "^").strip()
    if not plain or len(plain) > 40:
        return None
    if whole := _WHOLE.get(plain) or _WORDS.get(plain.casefold()):
        return whole
    if match := _IN_BRACKETS.fullmatch(plain):
        above, below = map(expression, match.groups())
        return f"({above})/({below})" if above and below else None
    if not _FORM.fullmatch(plain):
        return None
    written = ""
    for sign, word, power in _FACTOR.findall(plain):
        if word in DEFINITIONS or (word == "1" and not written):
            symbol: str | None = word
        else:
            symbol = _SPELLINGS.get(word) or _WORDS.get(word.casefold())
        exponent = power.lstrip("^") or "1"
        if symbol is None or not 1 <= abs(int(exponent)) <= 4:
            return None
        written += ("/" if sign == "/" else "*" if written else "") + f"({symbol})"
        written += f"**({exponent})" if power else ""
    return written


@functools.cache
def _in_base_units(text: str) -> tuple[float, str] | None:
    """Factor to base units and a text of the dimension; None where the unit is not known."""
    written = expression(text)
    return None if written is None else USUAL.get(written) or _by_registry(written)


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
    same = (si for si in KINDS if base is not None and (own := _in_base_units(si)) and own[1] == base[1])
    return next(same, None)


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
        accepted = ACCEPTED.get(si, si)
        offered = [word for word in re.split(r", | or ", accepted) if " " not in word or word == si]
        near = did_you_mean(unit, offered) if found is None else ""
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
    written = [expression(unit) for unit in (first, second)]
    wanted = _in_base_units(si)
    if wanted is None or None in written:
        return None
    factor, dimension = _by_registry(f"({written[0]})*({written[1]})")
    return float(f"{factor / wanted[0]:.15g}") if dimension == wanted[1] else None


def usual(si: str) -> str:
    """First unit a message offers for a kind of quantity, e.g. ``"N"``."""
    return ACCEPTED.get(si, si).split(",")[0].split(" or ")[0]


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
    match = _QUANTITY.fullmatch(str(text))
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


def uncertain(text: object) -> tuple[str, str] | None:
    """Value and standard uncertainty, each with its unit; None for what is not so written.

    Of ``"3.1 +/- 0.05 kg"``, ``"3.1 kg +/- 50 g"`` and ``"3.1 kg +/- 2 %"``.
    """
    if not isinstance(text, str) or in_percent(text):
        return None
    if (match := re.fullmatch(_SCALE, text)) is not None and match[2] is not None:
        return f"{match[1]} {match[3]}".strip(), f"{match[2]} {match[3]}".strip()
    if (match := re.fullmatch(_UNIT_TWICE, text)) is None:
        return None
    value, unit, spread, beside = match.groups()
    if beside == "%":
        return f"{value} {unit}", f"{abs(float(value)) * float(spread) / 100.0:.12g} {unit}"
    return f"{value} {unit}", f"{spread} {beside or unit}"


def in_percent(text: object) -> bool:
    """Whether a text is as ``"2.07 +/- 2 % N/A"``, which may be read in two ways."""
    match = re.fullmatch(_SCALE, text) if isinstance(text, str) else None
    return match is not None and match[2] is not None and match[3].startswith("%")


def _in_one_unit(text: object) -> tuple[float, float, str] | None:
    """Value, standard uncertainty and the unit of both; None for what is not so written."""
    if isinstance(text, bool) or not isinstance(text, str | int | float):
        return None
    if (parts := uncertain(text)) is not None:
        (value, *unit), (spread, *other) = (part.split(" ", 1) for part in parts)
        return (float(value), float(spread), "".join(unit)) if unit == other else None
    match = re.fullmatch(_SCALE, str(text))
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
        if expression(unit) is None:
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
        whole = product_in(of_column, self.unit, si)
        if whole is not None:
            return self.value * whole
        plain = product_in("-", of_column, "-") is not None
        wanted = usual(si) if plain else f"{usual(si)}/{of_column}"
        got = f'scale "{self.text}" for numbers {"without a unit" if plain else f"in {of_column}"}'
        if kind_of(of_column) == kind_of(si):
            wanted = "a pure number"
            do = f'The column is in {of_column} already. Counts would need unit = "counts" beside the scale.'
        elif plain and self.unit != "-":
            do = f"The numbers of the column are taken for {ACCEPTED.get(si, si)} only after a scale in {wanted}, or "
            do += 'after its unit is said, such as unit = "V" beside the scale.'
        else:
            do = "Correct the unit of the scale, or state the column's with unit = ... beside it."
        raise error(where, got, f"a scale in {wanted}" if wanted != "a pure number" else wanted, do)
