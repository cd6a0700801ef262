"""How the files of a study are to be read: what their columns are, and what they do not say themselves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, StrictStr, ValidationError

from fibrefit.core.declarations import ROLES
from fibrefit.core.errors import Mistakes
from fibrefit.study.channels import ChannelEntry, check_channels, plain_channels
from fibrefit.study.explain import explained
from fibrefit.study.overrides import apply_overrides
from fibrefit.study.places import Places
from fibrefit.study.quantity import Frequency
from fibrefit.study.table import StudyTable


class Files(StudyTable):
    """``[files]``: what has to be said of files that can be read in two ways, or have no headings."""

    columns: tuple[StrictStr, ...] = Field(default=(), description='Headings in order: ["time [s]", "force [N]"].')
    delimiter: StrictStr | None = Field(
        default=None, min_length=1, max_length=1, description="Character between columns."
    )
    sampling_rate: Frequency | None = Field(default=None, description="Where files have no times and no rate.")
    header: StrictStr | None = Field(default=None, description="File that holds the header of the records.")
    decimal: Literal[".", ","] | None = Field(default=None, description="Character before decimals.")


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
    place = Places(Path("command line"), None, apply_overrides(raw, overrides))
    try:
        reading = ReadingParts.model_validate(raw)
    except ValidationError as error:
        raise explained(error, raw, place) from None
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
        Heading by role, or a table with column, unit and scale.
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
        "channels": plain_channels(channels),
        "units": dict(units),
        "columns": files.columns,
        "delimiter": files.delimiter,
        "decimal": files.decimal,
        "rate": rate or files.sampling_rate,
    }
