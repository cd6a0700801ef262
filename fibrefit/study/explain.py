"""Turning what pydantic found wrong into a message a person can act on."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from fibrefit.core.errors import StudyError, as_one, did_you_mean
from fibrefit.study.quantity import shown

PAIR = "two values, the lower and the upper one"
"""What stands in a list of limits."""

#: What was expected, for the kinds of pydantic's errors whose own words say less.
EXPECTED = {
    "string_type": "text",
    "bool_type": "true or false",
    "model_type": "a table",
    "dict_type": "a table",
    "tuple_type": "a list",
    "string_too_short": "some text",
    "string_pattern_mismatch": "text without a NUL",
    "string_too_long": "one character",
    "model_attributes_type": 'a table with its kind, or text such as "3.1 +/- 0.05 kg"',
    "too_long": PAIR,
}


def explained(
    error: ValidationError, raw: Any, place: Callable[[str], str], belongs: Callable[[str], str] = lambda key: ""
) -> StudyError:
    """Error for all that is wrong, a line each.

    Parameters
    ----------
    error : pydantic.ValidationError
        What the models found.
    raw : object
        The content that was validated.
    place : callable
        Gives file and place for a key such as ``"records[1].lift"``.
    belongs : callable
        Gives a sentence on where a key that is not known here belongs; an empty one where it does not know.
    """
    details = error.errors(include_url=False)
    # An unknown key often explains what seems to be missing beside it.
    details.sort(key=lambda detail: detail["type"] != "unknown_key")
    found: dict[str, StudyError] = {}
    for detail in details:
        if _follows(detail, details):
            continue
        keys = _keys(detail["loc"], raw, missing=detail["type"] == "missing")
        got, expected, do = _parts(detail)
        if detail["type"] == "unknown_key":
            keys.append(key := detail["ctx"]["key"])
            do = do if detail["ctx"]["same"] else belongs(key) or do
        # Each alternative that a value may be has an error of its own: the first stands for all.
        found.setdefault(_of_all_rows(keys, detail), StudyError(place(key_text(keys)), got, expected, do))
    return as_one(list(found.values()), place(""))


def _of_all_rows(keys: Sequence[str | int], detail: ErrorDetails) -> str:
    """What a mistake is known by: a key that nobody knows is one, in however many rows of a table it stands."""
    unknown = detail["type"] == "unknown_key"
    return key_text([key for key in keys if not (unknown and isinstance(key, int))])


def _follows(detail: ErrorDetails, details: Sequence[ErrorDetails]) -> bool:
    """Whether a list is too short only because something is wrong with what stands in it, which is told itself."""
    place = detail["loc"]
    return detail["type"] == "too_short" and any(
        other["loc"][: len(place)] == place and len(other["loc"]) > len(place) for other in details
    )


def meant_as(key: str, given: Mapping[str, Any], known: Collection[str], values: Collection[str] = ()) -> str | None:
    """The key of a table that seems to be a misspelt one; None where none does.

    Parameters
    ----------
    key : str
        The one that is missing.
    given : mapping
        The table.
    known : collection of str
        All keys it may have: none of these is taken for a misspelt one.
    values : collection of str
        What the missing one may say: a key of another name that says it is meant.
    """
    unknown = [other for other in given if other not in known]
    said = [other for other in unknown if isinstance(given[other], str) and given[other] in values]
    return next((other for other in said or unknown if other in said or did_you_mean(other, [key])), None)


def in_place_of(key: str, given: Mapping[str, Any], known: Collection[str], values: Collection[str] = ()) -> str:
    """Sentence on the key that seems to be a misspelt one, as `meant_as` finds it; empty where none does."""
    meant = meant_as(key, given, known, values)
    return f'Did you mean {key} in place of "{meant}"?' if meant else ""


def key_text(keys: Iterable[str | int]) -> str:
    """Key path as written in messages and after ``--set``: ``records[1].lift``."""
    text = ""
    for key in keys:
        text += f"[{key}]" if isinstance(key, int) else f".{key}"
    return text.removeprefix(".")


def _keys(location: tuple[str | int, ...], raw: Any, missing: bool) -> list[str | int]:
    """Location without the names of alternatives that pydantic puts between and behind the keys."""
    keys: list[str | int] = []
    for i, part in enumerate(location):
        inside = (isinstance(raw, dict) and part in raw) or (
            isinstance(raw, list) and isinstance(part, int) and part < len(raw)
        )
        if inside:
            raw = raw[part]
        if inside or (missing and i == len(location) - 1 and isinstance(raw, dict)):
            keys.append(part)
    return keys


def _parts(detail: ErrorDetails) -> tuple[str, str, str]:
    """What was found, what was expected and what to do, of one of pydantic's errors."""
    kind, context, found = detail["type"], detail.get("ctx", {}), detail["input"]
    if kind in ("missing", "too_short") and detail["loc"] == ("records",):
        return "no [[records]]", "at least one", 'Write [[records]] and below it file = "drop.csv".'
    if kind == "refused":
        return context["got"], context["expected"], context["do"]
    if kind == "unknown_key":
        return "unknown key", context["expected"], context["do"]
    if kind == "missing" and isinstance(detail["loc"][-1], int):
        return shown(found), PAIR, ""
    if kind == "string_type" and detail["loc"][-1] == "heading":
        return shown(found), "the heading of a column, or a table with column, unit and scale", ""
    if kind in ("missing", "union_tag_not_found"):
        key = str(detail["loc"][-1]) if kind == "missing" else context["discriminator"].strip("'")
        tags = re.findall(r"'([^']*)'", context.get("expected_tags", ""))
        return f'no "{key}"', "it to be given", in_place_of(key, found, (), tags) if isinstance(found, dict) else ""
    if kind in ("literal_error", "union_tag_invalid"):
        choices = context["expected"] if kind == "literal_error" else context["expected_tags"]
        known = re.findall(r"'([^']*)'", choices)
        word = context.get("tag", found)
        do = did_you_mean(word, known) if isinstance(word, str) else ""
        return shown(word), " or ".join(f'"{name}"' for name in known), do
    if kind == "tuple_type" and isinstance(found, dict) and detail["loc"][-1:] == ("records",):
        return "one table", EXPECTED[kind], "Write [[records]] before each record."
    return shown(found), EXPECTED.get(kind, detail["msg"][:1].lower() + detail["msg"][1:]), ""
