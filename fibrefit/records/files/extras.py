"""Packages that read binary formats and are installed on request."""

from __future__ import annotations

import importlib
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
