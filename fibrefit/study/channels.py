"""``[channels]``: which column a role is in, the unit of its numbers, and what one of them is worth."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Discriminator, Field, StrictFloat, StrictInt, StrictStr, Tag, field_validator

from fibrefit.core import units
from fibrefit.core.declarations import ROLES
from fibrefit.core.errors import Mistakes, StudyError, did_you_mean
from fibrefit.core.units import Scale
from fibrefit.study.quantity import Instant, refusal
from fibrefit.study.table import StudyTable

SUGGESTED = ("N", "kN", "mm", "um", "s", "ms", "V", "mV", "A", "counts")


class ChannelTable(StudyTable):
    """A channel whose column needs more than its heading."""

    column: StrictStr | None = Field(default=None, description='Heading, or "column 3", counted in the file.')
    unit: StrictStr | None = Field(default=None, description="Of the numbers in the column: N, V, A, counts, ...")
    scale: StrictStr | StrictFloat | StrictInt | None = Field(
        default=None,
        description='What one unit of the column is worth: "-200 N/V", "17.857 um"; "2.07 +/- 0.29 N/A" '
        "is a parameter with that prior.",
        examples=["-200 N/V"],
    )
    zero: StrictFloat | StrictInt | None = Field(
        default=None,
        description="Number of the column that stands for nothing, as a raw reading without load; it is taken off "
        "before the scale.",
        examples=[1034655],
    )

    @field_validator("unit")
    @classmethod
    def _known_unit(cls, unit: str | None) -> str | None:
        if unit is not None and units.expression(unit) is None:
            raise refusal(f'unit "{unit}"', "a known unit, such as N, mm, V or counts", did_you_mean(unit, SUGGESTED))
        return unit

    @field_validator("scale")
    @classmethod
    def _a_scale(cls, scale: Any) -> Any:
        if scale is not None:
            try:
                Scale.parse(scale, "scale")
            except StudyError as error:
                raise refusal(error.got, error.expected, error.do) from None
        return scale


class BesideTable(StudyTable):
    """Another file of the same record, written by a logger with a clock of its own."""

    file: StrictStr = Field(description="Measured data; relative to the study file.")
    clock_offset: Instant | None = Field(
        default=None,
        description="Time of the record at which the clock of this file read zero; from the times of day of both files "
        "when absent, 0 s where they have none.",
    )


def _shape(said: Any) -> str:
    return "table" if isinstance(said, Mapping | ChannelTable) else "heading"


Heading = Annotated[StrictStr, Field(min_length=1)]
ChannelEntry = Annotated[
    Annotated[Heading, Tag("heading")] | Annotated[ChannelTable, Tag("table")], Discriminator(_shape)
]
"""A heading, or a table with column, unit, zero and scale."""


def plain_channels(channels: Mapping[str, Any]) -> dict[str, Any]:
    """Channels as readers take them: a heading, or a dict with ``column``, ``unit``, ``zero`` and ``scale``.

    Parameters
    ----------
    channels : mapping of str to heading or ChannelTable
        By role; None stands for nothing said.
    """
    return {
        role: said.model_dump(exclude_none=True) if isinstance(said, ChannelTable) else said
        for role, said in channels.items()
        if said
    }


def column_of(said: Any) -> str | None:
    """Heading of a channel, where one is said."""
    return said.column if isinstance(said, ChannelTable) else said


def check_channels(channels: Mapping[str, Any], declared: Mapping[str, str], where: str, mistakes: Mistakes) -> None:
    """Note each unit or scale that does not make the quantity of its role.

    Parameters
    ----------
    channels : mapping of str to heading or ChannelTable
        By role.
    declared : mapping of str to str
        Units by role or heading.
    where : str
        File and table to name in messages.
    mistakes : Mistakes
        Where they are noted, as StudyError.
    """
    for role, said in channels.items():
        if not isinstance(said, ChannelTable):
            continue
        unit = said.unit or declared.get(role) or declared.get(said.column or "")
        with mistakes.collect():
            if said.scale is None and unit is not None:
                units.to_si(unit, ROLES[role], f"{where}.{role}", error=StudyError, do="V, A and counts need a scale.")
            elif said.scale is not None and unit is not None:
                Scale.parse(said.scale, f"{where}.{role}").factor(unit, ROLES[role], f"{where}.{role}")
