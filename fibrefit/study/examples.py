"""Studies that ship with the program."""

from __future__ import annotations

from pathlib import Path

from fibrefit.core.errors import UsageError, did_you_mean

PACKAGE = Path(__file__).resolve().parents[1]

#: Where they are: in an installed package, and beside it in a checkout.
PLACES = (PACKAGE / "shipped_studies", PACKAGE.parent / "configs")


def examples() -> tuple[str, ...]:
    """Names of the studies that ship with the program.

    Returns
    -------
    tuple of str

    Examples
    --------
    >>> "drop_series" in fibrefit.examples()
    True
    """
    return tuple(sorted(file.parent.name for file in _place().glob("*/study.toml")))


def example(name: str) -> Path:
    """Folder of a study that ships with the program, with its records.

    Parameters
    ----------
    name : str
        Such as ``"drop_series"``; `examples` lists them.

    Returns
    -------
    pathlib.Path
        To be given to whatever takes a study. Files there are part of the program: copy the folder to change them.

    Raises
    ------
    UsageError
        If there is no such example.

    Examples
    --------
    >>> fibrefit.load_study(fibrefit.example("drop_series")).name
    'drop series, vertical and 45 degrees'
    """
    known = examples()
    if name not in known:
        raise UsageError(f'example "{name}"', "not known", f"one of {', '.join(known)}", did_you_mean(name, known))
    return _place() / name


def _place() -> Path:
    return next((place for place in PLACES if place.is_dir()), PLACES[0])
