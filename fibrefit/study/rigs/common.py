"""What studies of all kinds of rig have in common: their records, channels and noise.

Every constant may stand under ``[rig]`` or in a record, and a record overrides the rig. The fields are therefore
optional for the file; `required` marks those that `load_study` refuses to do without once both places have been read.
"""

from __future__ import annotations

from typing import Any, Literal, Self

from pydantic import Field, StrictStr, model_validator

from fibrefit.core.roles import ROLES
from fibrefit.core.shown import Card, Shown
from fibrefit.core.units import format_quantity
from fibrefit.study.channels import BesideTable, Said
from fibrefit.study.quantity import (
    Duration,
    ForceNoise,
    Frequency,
    LengthNoise,
    Moment,
    refusal,
)
from fibrefit.study.table import Name, StudyTable


def required(description: str) -> Any:
    """Field that must stand under ``[rig]`` or in each record."""
    return Field(default=None, description=description, json_schema_extra={"x-needed": True})


def optional(description: str) -> Any:
    """Field that may be absent."""
    return Field(default=None, description=description)


class RecordTable(Shown, StudyTable):
    """What all records have in common: a measured file, or the conditions of one that is planned."""

    file: Name | None = optional("Measured data; relative to the study file.")
    name: Name | None = optional("Name in results; the file's name when absent.")
    taken: Moment | None = optional("Day and time of the test; values are set against it.")
    sampling_rate: Frequency | None = optional("Where the file has no time column, or no file exists yet.")
    duration: Duration | None = optional("Length of a planned record.")
    parts: tuple[StrictStr, ...] | None = optional("Further files that continue this one, in their order.")
    beside: BesideTable | None = optional("Another file of the same record, with a clock of its own.")
    header: StrictStr | None = optional("File that holds the header of this one; relative to the study file.")
    channels: dict[Literal[tuple(ROLES)], Said] | None = optional(  # type: ignore[valid-type]
        "Columns of this record alone; what it does not say stands under [channels]."
    )

    @property
    def files(self) -> tuple[str, ...]:
        """Every file of measured data of the record."""
        own = (self.file,) if self.file else ()
        return (*own, *(self.parts or ()), *((self.beside.file,) if self.beside else ()))

    @property
    def label(self) -> str:
        """Name of the record in results and messages."""
        return self.name or self.file or ""

    def _card(self) -> Card:
        """What the study states of it: its conditions, with units."""
        said = self.model_dump(mode="json", exclude_none=True, exclude={"file", "name", "header"})
        rows = [(key.replace("_", " "), _readable(text)) for key, text in said.items() if isinstance(text, str)]
        line = ", ".join(f"{key} {text}" for key, text in rows) or "no conditions of its own"
        title = f'Record "{self.label}" as the study states it{"" if self.file else ", planned"}'
        return Card(title, line, ("condition", "value") if rows else (), rows)

    @model_validator(mode="after")
    def _measured_or_planned(self) -> Self:
        if self.file is None and None in (self.name, self.sampling_rate, self.duration):
            raise refusal("no file", "a file, or name, sampling_rate and duration of a planned record", "")
        return self


class Channels(StudyTable):
    """Column header of each role; found by the headers' own words where absent."""

    time: Said | None = None
    force: Said | None = None
    position: Said | None = None


class NoiseLevels(StudyTable):
    """Standard deviation of each channel's noise; estimated from the records where absent."""

    force: ForceNoise | None = None
    position: LengthNoise | None = None


def _readable(text: str) -> str:
    """A quantity in the unit a person would choose; any other text as it is."""
    number, _, unit = text.partition(" ")
    try:
        return format_quantity(float(number), unit)
    except ValueError:
        return text
