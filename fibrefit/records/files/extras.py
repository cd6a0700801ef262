"""Packages that read binary formats: those installed on request, and what they say of damaged files."""

from __future__ import annotations

import contextlib
import importlib
from collections.abc import Iterator
from types import ModuleType

from fibrefit.core.errors import DataError


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
