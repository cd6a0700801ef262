"""What a person may have meant by a key that a table does not know: one of another table, or of another rig."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, get_args

from fibrefit.study.study import Study
from fibrefit.study.table import StudyTable


def belongs(key: str, study: type[Study], others: Iterable[tuple[str, type[Study]]]) -> str:
    """Sentence on where a key or the name of a parameter belongs; empty where no table of a study knows it.

    Parameters
    ----------
    key : str
        As written.
    study : type of Study
        What a study of its rig may say.
    others : iterable of (str, type of Study)
        The same of other kinds of rig, which are asked only where this one does not know the key.
    """
    if key in study.base_parameters:
        return f"Write [parameters.{key}]."
    if places := [place for place, table in _tables(study) if key in table.known_keys()]:
        return f"It stands under {' or '.join(places)}."
    kinds = [kind for kind, other in others if any(key in table.known_keys() for _, table in _tables(other))]
    return f"It is a key of {' and '.join(kinds)}." if kinds else ""


def _tables(study: type[Study]) -> Iterator[tuple[str, type[StudyTable]]]:
    """Each table of a study with its heading; what holds further tables only is none."""
    for name, field in study.model_fields.items():
        for model in _models(field.annotation):
            heading = {"records": "[[records]]", "parameters": "[parameters.NAME]"}.get(name, f"[{name}]")
            yield heading, model


def _models(annotation: Any) -> Iterator[type[StudyTable]]:
    if isinstance(annotation, type) and issubclass(annotation, StudyTable):
        yield annotation
    for inner in get_args(annotation):
        yield from _models(inner)
