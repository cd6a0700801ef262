"""Quantities of a study file: text with a unit in the file, a float in SI inside."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import date, datetime
from typing import Annotated, Any, Self, get_args

from pydantic import (
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    PlainSerializer,
    PlainValidator,
    SerializationInfo,
    StrictFloat,
    StrictInt,
    WithJsonSchema,
)
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from fibrefit.core.errors import StudyError
from fibrefit.core.formatting import format_quantity
from fibrefit.core.limits import LARGEST_SIZE, SMALLEST_SIZE
from fibrefit.core.units import IN_PERCENT, NOT_IN_PERCENT, in_percent, parse_quantity, uncertain

CHECK_IT = "Check the exponent and the unit."
AS_WRITTEN = {"as_written": True}
"""Context of a dump in which quantities stand as the study wrote them, where it did; else they stand in SI units."""


class _Quoted(float):
    """A number in SI that knows the text it was read from; what is computed from it is a plain number."""

    text: str

    def __new__(cls, number: float, text: str = "") -> Self:
        made = super().__new__(cls, number)
        made.text = text
        return made


@dataclass(frozen=True, slots=True)
class Unit:
    """Annotation of a number that a file writes with its unit.

    Parameters
    ----------
    si : str
        Unit of the number inside the program.
    example : str
        What a file may hold, shown in schemas and messages.
    lower, upper : float
        Range of the number, in `si`.
    lower_allowed : bool
        Whether `lower` itself belongs to the range.
    """

    si: str
    example: str
    lower: float = -math.inf
    upper: float = math.inf
    lower_allowed: bool = True

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Validate text into SI and write SI back as text."""
        return core_schema.no_info_plain_validator_function(
            self.read,
            serialization=core_schema.plain_serializer_function_ser_schema(
                self.write, info_arg=True, when_used="json-unless-none", return_schema=core_schema.str_schema()
            ),
            json_schema_input_schema=core_schema.str_schema(),
        )

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Describe the text: JSON Schema cannot check units, so it names them."""
        return {"type": "string", "examples": [self.example], "x-unit": self.si}

    def read(self, value: Any) -> float:
        """Number in SI from what a file holds; a pydantic error with a reason otherwise."""
        try:
            number = quantity_in(value, self.si, self.example)
        except StudyError as error:
            raise refusal(error.got, error.expected, error.do) from None
        below = number < self.lower or (number == self.lower and not self.lower_allowed)
        if below or number > self.upper:
            expected = f"a value {'of at least' if self.lower_allowed else 'above'} {self.lower:g} {self.si}"
            if self.lower > -math.inf and self.upper < math.inf:
                expected = f"a value between {self.lower:g} and {self.upper:g} {self.si}"
            raise refusal(f'"{value}" is out of range', expected, "")
        if not self.lower_allowed and number < self.lower + SMALLEST_SIZE:
            raise refusal(f"{quoted(value)} is out of range", f"at least {SMALLEST_SIZE:g} {self.si}", CHECK_IT)
        return _Quoted(number, value)

    def write(self, value: float, info: SerializationInfo) -> str:
        """Text that reads back as exactly the same number: its own where the context is `AS_WRITTEN`, or in SI."""
        own = value.text if info.context == AS_WRITTEN and isinstance(value, _Quoted) else ""
        return own or f"{value!r} {self.si}"


def field_unit(field: FieldInfo) -> Unit | None:
    """Unit of a field that is a number, an optional one or a range of them; None where it has none."""
    parts = [*field.metadata, field.annotation]
    while parts:
        part = parts.pop(0)
        if isinstance(part, Unit):
            return part
        parts += get_args(part)
    return None


def quantity_in(value: Any, unit: str, example: str, where: str = "value") -> float:
    """Number in `unit` from a quantity written as text.

    Parameters
    ----------
    value : object
        What the file holds.
    unit : str
        SI unit wanted.
    example : str
        A quantity that would have been accepted, for the message.
    where : str
        File and key the message is to name.

    Raises
    ------
    StudyError
        If `value` is not text, carries no unit or the wrong one, or is not finite.
    """
    expected = f'a quantity such as "{example}"'
    if isinstance(value, bool | int | float):
        raise StudyError(where, f"{quoted(value)} without a unit", expected, "Write it as text with its unit.")
    if not isinstance(value, str):
        raise StudyError(where, f"{quoted(value)} is not a quantity", f'text such as "{example}"', "")
    if in_percent(value):
        raise StudyError(where, f"{quoted(value)}: {IN_PERCENT}", expected, NOT_IN_PERCENT)
    if uncertain(value):
        do = f'Under [rig], or as prior = "{value}" of a parameter, it is a prior; elsewhere leave the uncertainty out.'
        raise StudyError(where, f"{quoted(value)}, with an uncertainty", expected, do)
    number = parse_quantity(value, unit, where)
    if not math.isfinite(number):
        raise StudyError(where, f'"{value}" is not finite', expected, "")
    if abs(number) > LARGEST_SIZE:
        raise StudyError(where, f"{quoted(value)} is out of range", f"at most {LARGEST_SIZE:g} {unit}", CHECK_IT)
    return number


def refusal(got: str, expected: str, do: str) -> PydanticCustomError:
    """Error for pydantic that carries the parts of a message meant for a person."""
    return PydanticCustomError("refused", "{got}", {"got": got, "expected": expected, "do": do})


LONGEST_SHOWN = 60


def quoted(value: Any) -> str:
    """Short text of a value, for a message."""
    try:
        text = f'"{value}"' if isinstance(value, str) else repr(value)
    except ValueError:  # Python writes no integers of thousands of digits
        return "a number of thousands of digits"
    return text if len(text) <= LONGEST_SHOWN else f"{text[: LONGEST_SHOWN - 3]}..."


def as_stated(value: float, si: str) -> str:
    """A quantity as the file wrote it, or in the unit a person would choose."""
    return getattr(value, "text", "") or format_quantity(value, si)


MOMENT = "2026-03-14 09:30"
"""Example of a day and a time, as a study says when a record was taken."""


def moment_in(value: Any) -> datetime:
    """Day and time from text by ISO 8601, or from a date of TOML; a day alone stands for its first instant."""
    if isinstance(value, date):
        return value if isinstance(value, datetime) else datetime(value.year, value.month, value.day)
    try:
        return datetime.fromisoformat(value)
    except (TypeError, ValueError):
        raise refusal(quoted(value), f'a day, or a day and a time, such as "{MOMENT}"', "") from None


Mass = Annotated[float, Unit("kg", "3.096 kg", lower=0, lower_allowed=False)]
MassOrNone = Annotated[float, Unit("kg", "5.035 kg", lower=0)]
Length = Annotated[float, Unit("m", "599 mm", lower=0, lower_allowed=False)]
Distance = Annotated[float, Unit("m", "10 mm", lower=0)]
Position = Annotated[float, Unit("m", "-0.12 mm")]
Slope = Annotated[float, Unit("rad", "90 deg", lower=0, lower_allowed=False, upper=math.pi)]
"""Of a guide that something falls along."""
Angle = Annotated[float, Unit("rad", "30 deg", lower=-2 * math.pi, upper=2 * math.pi)]
Turn = Annotated[float, Unit("rad", "150 deg", lower=0)]
Instant = Annotated[float, Unit("s", "0.1432 s")]
Duration = Annotated[float, Unit("s", "4 s", lower=0, lower_allowed=False)]
Pause = Annotated[float, Unit("s", "0.5 s", lower=0)]
Frequency = Annotated[float, Unit("Hz", "2 kHz", lower=0, lower_allowed=False)]
Speed = Annotated[float, Unit("m/s", "200 mm/s", lower=0, lower_allowed=False)]
SpeedOrNone = Annotated[float, Unit("m/s", "200 mm/s", lower=0)]
Inertia = Annotated[float, Unit("kg m^2", "3.288 kg m^2", lower=0, lower_allowed=False)]
Points = Annotated[StrictInt, Field(ge=1, le=32)]
Gain = Annotated[StrictFloat, Field(gt=0)]
Load = Annotated[float, Unit("N", "200 N", lower=0)]
ForceNoise = Annotated[float, Unit("N", "0.4 N", lower=0, lower_allowed=False)]
LengthNoise = Annotated[float, Unit("m", "0.02 mm", lower=0, lower_allowed=False)]
SpeedNoise = Annotated[float, Unit("m/s", "0.1 mm/s", lower=0, lower_allowed=False)]
AngleNoise = Annotated[float, Unit("rad", "0.001 rad", lower=0, lower_allowed=False)]
Moment = Annotated[
    datetime,
    PlainValidator(moment_in),
    PlainSerializer(datetime.isoformat, return_type=str, when_used="json-unless-none"),
    WithJsonSchema({"type": "string", "examples": [MOMENT]}),
]
