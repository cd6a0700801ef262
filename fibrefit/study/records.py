"""What studies of all kinds of rig have in common: their records, and the limits of what a rig can do.

Every constant may stand under ``[rig]`` or in a record, and a record overrides the rig. The fields are therefore
optional for the file; `required` marks those that `load_study` refuses to do without once both places have been read.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any, Literal, Self

from pydantic import Field, JsonValue, StrictStr, model_validator

from fibrefit.core.declarations import ROLES
from fibrefit.core.errors import StudyError
from fibrefit.core.formatting import Card, Shown, format_quantity
from fibrefit.core.units import uncertain
from fibrefit.study.quantity import (
    Distance,
    Duration,
    Frequency,
    Moment,
    SpeedOrNone,
    Unit,
    as_stated,
    field_unit,
    quantity_in,
    quoted,
    refusal,
)
from fibrefit.study.reading import BesideTable, ChannelEntry
from fibrefit.study.table import Name, StudyTable

NO_CONDITION: dict[str, JsonValue] = {"x-condition": False}
"""Mark of a field that is no condition of a record."""


def required(description: str) -> Any:
    """Field that must stand under ``[rig]`` or in each record."""
    return Field(default=None, description=description, json_schema_extra={"x-needed": True})


def optional(description: str) -> Any:
    """Field that may be absent."""
    return Field(default=None, description=description)


def no_condition(description: str | None = None) -> Any:
    """Field that may be absent and is no condition: what a file tells by itself, or what is done with it."""
    return Field(default=None, description=description, json_schema_extra=NO_CONDITION)


OF_A_FILE = ("parts", "beside", "header")
"""Keys of a record that name further files of its measured data."""


class RecordTable(Shown, StudyTable):
    """What all records have in common: a measured file, or the conditions of one that is planned."""

    file: Name | None = None
    """Measured data; relative to the study file."""
    name: Name | None = None
    """Name in results; the file's name when absent."""
    taken: Moment | None = None
    """Day and time of the test; values are set against it."""
    sampling_rate: Frequency | None = no_condition("Where the file has no time column, or no file exists yet.")
    duration: Duration | None = no_condition("Length of a planned record.")
    parts: tuple[StrictStr, ...] | None = None
    """Further files that continue this one, in their order."""
    beside: BesideTable | None = None
    """Another file of the same record, with a clock of its own."""
    header: StrictStr | None = None
    """File that holds the header of this one; relative to the study file."""
    channels: dict[Literal[tuple(ROLES)], ChannelEntry] | None = None  # type: ignore[valid-type]
    """Columns of this record alone; what it does not say stands under [channels]."""

    uncertainties: dict[Name, StrictStr] | None = None
    """Standard uncertainties of conditions: lift = "0.1 mm" here, or lift = "5 +/- 0.1 mm" of the record. Trends of a
    series weigh them; a fit takes conditions for exact."""

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
        errors = {key: f" +/- {text}" for key, text in (self.uncertainties or {}).items()}
        rows = []
        for key, text in said.items():
            if isinstance(text, str):
                number, _, unit = text.partition(" ")
                with suppress(ValueError):  # of a text that is no quantity
                    text = format_quantity(float(number), unit)
                rows.append((key.replace("_", " "), f"{text}{errors.get(key, '')}"))
        line = ", ".join(f"{key} {text}" for key, text in rows) or "no conditions of its own"
        title = f'Record "{self.label}" as the study states it{"" if self.file else ", planned"}'
        return Card(title, line, ("condition", "value") if rows else (), rows)

    @classmethod
    def conditions(cls) -> dict[str, Unit]:
        """Units of the conditions that are numbers."""
        found = {name: field_unit(info) for name, info in cls._may_be_conditions().items()}
        return {name: unit for name, unit in found.items() if unit is not None}

    @classmethod
    def _may_be_conditions(cls) -> dict[str, Any]:
        return {name: info for name, info in cls.model_fields.items() if info.json_schema_extra != NO_CONDITION}

    def in_numbers(self) -> dict[str, tuple[float, str]]:
        """Its conditions that are stated in numbers, and their SI units; of a complete study those of the rig too."""
        units = {name: unit.si for name, unit in self.conditions().items()}
        found = {name: getattr(self, name) for name in self._may_be_conditions()}
        return {name: (value, units.get(name, "-")) for name, value in found.items() if isinstance(value, float)}

    def uncertainty(self, condition: str) -> float:
        """Standard uncertainty that is stated of a condition, in SI units; 0 where none is."""
        said = (self.uncertainties or {}).get(condition)
        return 0.0 if said is None else quantity_in(said, self.conditions()[condition].si, said)

    @model_validator(mode="before")
    @classmethod
    def _separated(cls, data: Any) -> Any:
        """``lift = "5 +/- 0.1 mm"`` is a lift and its uncertainty."""
        written = data if isinstance(data, dict) else {}
        parts = {name: found for name in cls.conditions() if (found := uncertain(written.get(name)))}
        beside = written.get("uncertainties") or {}
        if not parts or not isinstance(beside, dict):
            return data
        for name in parts.keys() & beside.keys():
            raise refusal(f"the uncertainty of {name} twice", "one of them", "")
        more = {name: said for name, (_, said) in parts.items()}
        return written | {name: said for name, (said, _) in parts.items()} | {"uncertainties": beside | more}

    @model_validator(mode="after")
    def _of_conditions(self) -> Self:
        known = self.conditions()
        for name, said in (self.uncertainties or {}).items():
            if name not in known:
                raise refusal(f"the uncertainty of {quoted(name)}", f"a condition: {', '.join(known)}", "")
            try:
                error = quantity_in(said, known[name].si, known[name].example)
            except StudyError as caught:
                raise refusal(f"uncertainty of {name}: {caught.got}", caught.expected, caught.do) from None
            if error < 0.0:
                raise refusal(f"{quoted(said)} as the uncertainty of {name}", "a positive one", "")
        return self

    @model_validator(mode="after")
    def _measured_or_planned(self) -> Self:
        if self.file is None and None in (self.name, self.sampling_rate, self.duration):
            raise refusal("no file", "a file, or name, sampling_rate and duration of a planned record", "")
        if self.file is not None and self.duration is not None:
            do = "Leave duration out: of a file all is used."
            raise refusal("a file and a duration", "a file, or the duration of a planned record", do)
        if self.file is None and (further := [key for key in OF_A_FILE if getattr(self, key) is not None]):
            raise refusal(f"{' and '.join(further)} without a file", "the file that it belongs to", "State file too.")
        return self


class RigLimits(StudyTable):
    """``[limits]``: what the rig can do, the least and the most of each condition that a further record may have."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        for name, ends in self:
            unit = field_unit(type(self).model_fields[name])
            if ends is not None and unit is not None and ends[0] > ends[1]:
                got = f"{name} from {as_stated(ends[0], unit.si)} to {as_stated(ends[1], unit.si)}"
                raise refusal(got, "the least first, and the most behind it", "Swap them.")
        return self


class DriveLimits(RigLimits):
    """What a rig with a drive can do."""

    drive_travel: tuple[Distance, Distance] | None = None
    """Way between the ends of a motion of the drive."""
    drive_speed: tuple[SpeedOrNone, SpeedOrNone] | None = None
    """Largest speed of the drive in a record."""
