"""What readers of binary formats share: packages installed on request, damaged files, what is stated of columns."""

from __future__ import annotations

import contextlib
import importlib
import itertools
import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from types import ModuleType
from typing import Any

from fibrefit.core.errors import DataError
from fibrefit.records.columns.raw import Annotation, RawColumn
from fibrefit.records.grammar.headings import unit_by_key
from fibrefit.records.grammar.worth import contradicted, shown_list, tells_factor
from fibrefit.records.thresholds import HEADER_DEPTH

_OF_UNITS = re.compile(r"units?(?![^\W_])|einheit", re.IGNORECASE)


def require(package: str, extra: str, where: str, what: str) -> ModuleType:
    """Import a package of an optional extra.

    Parameters
    ----------
    package : str
        Name to import.
    extra : str
        Name of the extra that installs it.
    where : str
        File to name in messages.
    what : str
        Kind of file.

    Returns
    -------
    module
        The package.

    Raises
    ------
    DataError
        If it is not installed; the message names the extra.
    """
    try:
        return importlib.import_module(package)
    except ImportError:
        do = f"Install it: pip install 'fibrefit[{extra}]'."
        raise DataError(where, f"{what} needs the package {package}, which is not installed", "", do) from None


@contextlib.contextmanager
def damage_as_error(
    where: str, what: str, expected: str = "a complete file", do: str = "Export it again."
) -> Iterator[None]:
    """Whatever a library raises while it reads, as an error that says which file is damaged.

    Parameters
    ----------
    where : str
        File to name in messages.
    what : str
        Kind of file.
    expected, do : str
        As of the error.

    Raises
    ------
    DataError
        For any error; one that is a `DataError` already stays as it is.
    """
    try:
        yield
    except DataError:
        raise
    except Exception as error:  # a library raises whatever a damaged file provokes
        raise DataError(where, f"{what} is damaged ({damage_of(error)})", expected, do) from None


def damage_of(error: Exception) -> str:
    """What an error says in its first line, in short."""
    return (str(error).splitlines() or [""])[0][:80] or type(error).__name__


def json_object(text: str) -> dict[str, Any]:
    """Object that a text is in JSON; empty where it is none."""
    try:
        found = json.loads(text) if text[:1] == "{" else {}
    except (json.JSONDecodeError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def stated_in(key: str, text: str) -> list[tuple[str, str]]:
    """Statements of a property, each a path and a value: an object of JSON makes many, anything else one.

    Parameters
    ----------
    key : str
        Name of the property.
    text : str
        Its value.
    """
    said = json_object(text)
    return list(itertools.islice(_leaves(key, said), HEADER_DEPTH)) if said else [(key, text)]


def _leaves(path: str, node: Any) -> Iterator[tuple[str, str]]:
    if isinstance(node, dict):
        for key, value in node.items():
            yield from _leaves(f"{path}.{key}", value)
    else:
        yield path, str(node)


def factors_among(others: Sequence[RawColumn], channels: int) -> Iterator[Annotation]:
    """What short vectors beside the channels say of them: each is called a factor or an offset.

    Parameters
    ----------
    others : sequence of RawColumn
        Vectors that are no channels.
    channels : int
        How many channels there are; what has more numbers is not one for each of them.
    """
    for column in others:
        values = column.numbers.values
        if values.size <= channels and tells_factor(column.header):
            yield Annotation(f'"{column.header}"', f"{column.header} = {shown_list(values)}")


def with_stated_units(columns: Sequence[RawColumn], annotations: Sequence[Annotation]) -> list[RawColumn]:
    """Columns with the units that a property states by their names, such as ``units: {force: N, position: mm}``.

    Parameters
    ----------
    columns : sequence of RawColumn
        Of the file.
    annotations : sequence of Annotation
        All it says beside them.
    """
    lines = [one.text for one in annotations if _OF_UNITS.search(one.text)]
    found = [unit_by_key(column.name, lines) if lines else None for column in columns]
    return [
        replace(c, unit=c.unit or unit, contradicted=c.contradicted or contradicted([c.unit, unit])) if unit else c
        for c, unit in zip(columns, found, strict=True)
    ]
