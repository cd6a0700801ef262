"""What parts of a summary file have in common: one declaration is the object, its schema and its form in the file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Self

import numpy as np
from pydantic import (
    AfterValidator,
    AllowInfNan,
    BeforeValidator,
    ConfigDict,
    PlainSerializer,
    WithJsonSchema,
)

from fibrefit.core.formatting import format_quantity, typeset_unit
from fibrefit.study.table import DescribedModel


def _known(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


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
KnownInterval = Annotated[
    tuple[_End, _End] | None,
    AfterValidator(lambda ends: ends if ends is not None and all(map(math.isfinite, ends)) else None),
]
"""The same of an interval, of which neither end is known where one is not."""

MOST_MINIMA = 8
"""Minima that a summary lists, the best first: what more there are tells nothing that these do not."""


class Part(DescribedModel):
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


@dataclass(frozen=True, slots=True)
class Variable:
    """An array with its dimensions and unit.

    Parameters
    ----------
    values : numpy.ndarray
        Real numbers, integers, booleans or text, of any shape.
    dims : tuple of str
        Name of each dimension; a variable named like its only dimension holds that dimension's coordinates.
    unit : str
        SI unit of the values; ``"-"`` for a pure number or text.
    doc : str
        One sentence that says what they are.
    """

    values: np.ndarray
    dims: tuple[str, ...] = ()
    unit: str = "-"
    doc: str = ""


Groups = Mapping[str, Mapping[str, Variable]]
"""Group to name to variable."""
AXES = ("record", "sample", "time")
"""Variables of a group of samples that are coordinates of the others."""
CONDITIONS = ("lift", "inclination", "added_mass")
"""Conditions worth a word beside a record's name."""


def conditions_text(constants: Mapping[str, Variable], record: int) -> str:
    """What tells a record from its neighbours: ``lift 10 mm, inclination 45°``.

    Parameters
    ----------
    constants : mapping of str to Variable
        Group ``constant_data`` of a result, ``(n_record,)`` each.
    record : int
        Place of the record.
    """
    stated = {name: constants[name] for name in CONDITIONS if name in constants}
    return ", ".join(
        f"{name.replace('_', ' ')} {typeset_unit(format_quantity(float(one.values[record]), one.unit))}"
        for name, one in stated.items()
        if one.values[record] != 0.0
    )
