"""How files are read: ``[channels]``, which column a role is in and what its numbers are worth, and ``[files]``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, StrictFloat, StrictInt, StrictStr, Tag, ValidationError, field_validator

from fibrefit.core import units
from fibrefit.core.declarations import ROLES
from fibrefit.core.errors import Mistakes, StudyError, did_you_mean
from fibrefit.core.units import Scale
from fibrefit.study.overrides import apply_overrides
from fibrefit.study.quantity import Frequency, Instant, refusal
from fibrefit.study.table import KeyLocator, StudyTable, study_error

SUGGESTED = ("N", "kN", "mm", "um", "s", "ms", "V", "mV", "A", "counts")


class ChannelTable(StudyTable):
    """A channel whose column needs more than its heading."""

    column: StrictStr | None = None
    """Heading, or "column 3", counted in the file."""
    unit: StrictStr | None = None
    """Of the numbers in the column: N, V, A, counts, ..."""
    scale: StrictStr | StrictFloat | StrictInt | None = Field(default=None, examples=["-200 N/V"])
    """What one unit of the column is worth: "-200 N/V", "17.857 um"; "2.07 +/- 0.29 N/A" is a parameter with that
    prior."""
    zero: StrictFloat | StrictInt | None = Field(default=None, examples=[1034655])
    """Number of the column that stands for nothing, as a raw reading without load; it is taken off before the scale."""

    @field_validator("unit")
    @classmethod
    def _known_unit(cls, unit: str) -> str:
        if units.expression(unit) is None:
            raise refusal(f'unit "{unit}"', "a known unit, such as N, mm, V or counts", did_you_mean(unit, SUGGESTED))
        return unit

    @field_validator("scale")
    @classmethod
    def _a_scale(cls, scale: Any) -> Any:
        try:
            Scale.parse(scale, "scale")
        except StudyError as error:
            raise refusal(error.got, error.expected, error.do) from None
        return scale


class BesideTable(StudyTable):
    """Another file of the same record, written by a logger with a clock of its own."""

    file: StrictStr
    """Measured data; relative to the study file."""
    clock_offset: Instant | None = None
    """Time of the record at which the clock of this file read zero; from the times of day of both files when absent, 0
    s where they have none."""


Heading = Annotated[StrictStr, Field(min_length=1)]
ChannelEntry = Annotated[
    Annotated[Heading, Tag("heading")] | Annotated[ChannelTable, Tag("table")],
    Discriminator(lambda said: "table" if isinstance(said, Mapping | ChannelTable) else "heading"),
]
"""A heading, or a table with column, unit, zero and scale."""


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


class Files(StudyTable):
    """``[files]``: what has to be said of files that can be read in two ways, or have no headings."""

    columns: tuple[StrictStr, ...] = ()
    """Headings in order: ["time [s]", "force [N]"]."""
    delimiter: StrictStr | None = Field(default=None, min_length=1, max_length=1)
    """Character between columns."""
    sampling_rate: Frequency | None = None
    """Where files have no times and no rate."""
    header: StrictStr | None = None
    """File that holds the header of the records."""
    decimal: Literal[".", ","] | None = None
    """Character before decimals."""


class ReadingParts(StudyTable):
    """The parts of a study that tell how to read a file; all that counts for bare files."""

    channels: dict[Literal[tuple(ROLES)], ChannelEntry] = Field(default_factory=dict)  # type: ignore[valid-type]
    units: dict[str, StrictStr] = Field(default_factory=dict)
    files: Files = Files()


def reading_of(overrides: Sequence[str]) -> dict[str, Any]:
    """Arguments for the reader of bare files.

    Parameters
    ----------
    overrides : sequence of str
        Such as ``units.force=kN``, ``channels.force=Kraft`` or ``files.decimal=,``.

    Raises
    ------
    StudyError
        If an override is not known or has a wrong value.
    """
    raw: dict[str, Any] = {}
    locate = KeyLocator(Path("command line"), None, apply_overrides(raw, overrides))
    try:
        reading = ReadingParts.model_validate(raw)
    except ValidationError as error:
        raise study_error(error, raw, locate) from None
    with Mistakes("command line") as mistakes:
        check_channels(reading.channels, reading.units, "command line, channels", mistakes)
    return reading_arguments(reading.channels, reading.units, reading.files)


def reading_arguments(
    channels: Mapping[str, Any], units: Mapping[str, str], files: Files, rate: float | None = None
) -> dict[str, Any]:
    """Arguments for the reader of a file.

    Parameters
    ----------
    channels : mapping
        Heading by role, or a table with column, unit, zero and scale; None stands for nothing said.
    units : mapping of str to str
        Unit by role or header.
    files : Files
        What the files do not say themselves.
    rate : float or None
        Sampling rate in Hz, where the file does not tell.

    Returns
    -------
    dict
        ``channels``, ``units``, ``columns``, ``header``, ``delimiter``, ``decimal`` and ``rate``.
    """
    return {
        "header": files.header,
        "channels": {
            role: said.model_dump(exclude_none=True) if isinstance(said, ChannelTable) else said
            for role, said in channels.items()
            if said
        },
        "units": dict(units),
        "columns": files.columns,
        "delimiter": files.delimiter,
        "decimal": files.decimal,
        "rate": rate or files.sampling_rate,
    }
