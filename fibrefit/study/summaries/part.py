"""What parts of a summary file have in common: one declaration is the object, its schema and its form in the file."""

from __future__ import annotations

import math
from typing import Annotated, Any, Self

from pydantic import (
    AfterValidator,
    AllowInfNan,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    PlainSerializer,
    WithJsonSchema,
)


def _known(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _both_known(ends: tuple[float, float] | None) -> tuple[float, float] | None:
    return ends if ends is not None and all(map(math.isfinite, ends)) else None


Interval = tuple[float, float]
Known = Annotated[float | None, BeforeValidator(_known)]
"""A number, or None where it is not known: what is computed says so by nan or infinity, for which JSON has no word."""
OrNan = Annotated[
    float,
    AllowInfNan(),
    BeforeValidator(lambda value: math.nan if value is None else value),
    PlainSerializer(_known, return_type=float | None, when_used="json"),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "null"}]}),
]
"""The same of a number that is computed with: null in a file, where it is not known, and nan in the program."""
Z_95 = 1.959964
"""Standard errors on either side of a value between which a normal law has 95 % of its probability."""
_End = Annotated[float, AllowInfNan()]
KnownInterval = Annotated[tuple[_End, _End] | None, AfterValidator(_both_known)]
"""The same of an interval, of which neither end is known where one is not."""

MOST_MINIMA = 8
"""Minima that a summary lists, the best first: what more there are tells nothing that these do not."""


class Part(BaseModel):
    """A part of a summary file: frozen, finite, closed to names it does not know."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, populate_by_name=True, from_attributes=True, defer_build=True
    )

    @classmethod
    def of(cls, found: object) -> Self:
        """The part with what `found` calls by the same names.

        Parameters
        ----------
        found : object
            With an attribute for each field that has no default.
        """
        return cls.model_validate(found)


class Measure(Part):
    """A number with its standard error."""

    value: float
    error: float
