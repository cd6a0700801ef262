"""The table every model of a file is made of, and messages on what is wrong with one.

Tables are frozen, and closed to keys they do not know.
"""

from __future__ import annotations

import ast
import inspect
import re
import sys
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    ModelWrapValidatorHandler,
    StrictStr,
    ValidationError,
    model_validator,
)
from pydantic_core import CoreSchema, ErrorDetails, InitErrorDetails, PydanticCustomError

from fibrefit.core.errors import StudyError, as_one, did_you_mean
from fibrefit.study.quantity import quoted

Name = Annotated[StrictStr, Field(min_length=1, pattern=r"^[^\x00]*$")]
"""What something is called: files of results hold no NUL."""
OWN = ("refused", "unknown_key")
"""Kinds of errors that are ours, and not pydantic's."""
SAME = 0.8
"""Likeness of words beyond which a key is taken for a slip of the pen, and below for one of another table first."""
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


class DescribedModel(BaseModel):
    """A model whose schema describes a field by the text below it."""

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Schema with these descriptions: they are read only here, since that takes a tenth of a second.

        Parameters
        ----------
        schema : pydantic_core.CoreSchema
            Of the class.
        handler : pydantic.GetJsonSchemaHandler
            Makes the schema without descriptions.
        """
        described = handler(schema)
        properties = handler.resolve_ref_schema(described)["properties"]
        for base in reversed(cls.__mro__[: cls.__mro__.index(DescribedModel)]):
            for name, text in _field_texts(base.__module__).get(base.__name__, {}).items():
                properties[name]["description"] = text
        return described


@cache
def _field_texts(module: str) -> dict[str, dict[str, str]]:
    """Text below each field of the classes of a module, as one line, by class and field."""
    tree = ast.parse(inspect.getsource(sys.modules[module]))
    return {
        one.name: {
            ast.unparse(field.target): " ".join(str(ast.literal_eval(text.value)).split())
            for field, text in pairwise(one.body)
            if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr)
        }
        for one in tree.body
        if isinstance(one, ast.ClassDef)
    }


class StudyTable(DescribedModel):
    """A table of a file a user writes."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, populate_by_name=True, defer_build=True)

    @classmethod
    def known_keys(cls) -> list[str]:
        """Keys the table may hold, as written in the file."""
        return [field.alias or name for name, field in cls.model_fields.items()]

    @classmethod
    def needed(cls) -> list[str]:
        """Keys that must be given in one of the places where they may stand."""
        extras = {name: field.json_schema_extra for name, field in cls.model_fields.items()}
        return [name for name, extra in extras.items() if isinstance(extra, dict) and extra.get("x-needed")]

    @model_validator(mode="wrap")
    @classmethod
    def _refuse_unknown_keys(cls, data: Any, read: ModelWrapValidatorHandler[Self]) -> Self:
        """Refuse every key that is not known, and what is wrong with the values of the others.

        What is wrong with the table as a whole may come from a key that is misspelt, and is not told beside it.
        """
        known = cls.known_keys()
        unknown = [key for key in data if key not in known] if isinstance(data, dict) else []
        if not unknown:
            return read(data)
        found = []
        for key in unknown:
            same = bool(did_you_mean(key, known, SAME))  # and thus meant, whatever else may be called so
            said = {"key": key, "expected": f"one of {', '.join(known)}", "do": did_you_mean(key, known), "same": same}
            error = PydanticCustomError("unknown_key", "{key}", said)
            found.append(InitErrorDetails(type=error, loc=(), input=data))
        try:
            read({key: value for key, value in data.items() if key in known})
        except ValidationError as error:
            for detail in error.errors(include_url=False):
                kind, context, place = detail["type"], detail.get("ctx", {}), detail["loc"]
                # What is missing may be there in another spelling, which is told already.
                alone = kind == "missing" and len(place) == 1
                if place and not (alone and any(f'"{place[0]}"' in did_you_mean(key, known) for key in unknown)):
                    own = PydanticCustomError(kind, "", context) if kind in OWN else kind
                    found.append(InitErrorDetails(type=own, loc=place, input=detail["input"], ctx=context))
        raise ValidationError.from_exception_data(cls.__name__, found)


@dataclass(frozen=True, slots=True)
class KeyLocator:
    """Finds a key in the study file, in its table of records, or on the command line, for messages.

    Parameters
    ----------
    source : pathlib.Path
        The study file.
    table : pathlib.Path or None
        The table of records, where there is one.
    changed : mapping of str to str
        Key path of every override, and the override as it was typed.
    """

    source: Path
    table: Path | None = None
    changed: Mapping[str, str] = field(default_factory=dict)

    def __call__(self, key: str) -> str:
        """Place of the key, such as ``study.toml, records[1].lift``."""
        for changed, override in self.changed.items():
            if key == changed or key.startswith((f"{changed}.", f"{changed}[")):
                return override
        row = re.fullmatch(r"records\[(\d+)\]\.?(.*)", key)
        if self.table is not None and row:
            return f"{self.table}, record {int(row[1]) + 1}" + (f', column "{row[2]}"' if row[2] else "")
        return f"{self.source}, {key}" if key else str(self.source)


def study_error(
    error: ValidationError, raw: Any, locate: Callable[[str], str], belongs: Callable[[str], str] = lambda key: ""
) -> StudyError:
    """Error for all that is wrong, a line each.

    Parameters
    ----------
    error : pydantic.ValidationError
        What the models found.
    raw : object
        The content that was validated.
    locate : callable
        Gives file and place for a key such as ``"records[1].lift"``.
    belongs : callable
        Gives a sentence on where a key that is not known here belongs; an empty one where it does not know.
    """
    details = error.errors(include_url=False)
    # An unknown key often explains what seems to be missing beside it.
    details.sort(key=lambda detail: detail["type"] != "unknown_key")
    found: dict[str, StudyError] = {}
    for detail in details:
        place, unknown = detail["loc"], detail["type"] == "unknown_key"
        inside = (len(other["loc"]) > len(place) and other["loc"][: len(place)] == place for other in details)
        if detail["type"] == "too_short" and any(inside):
            continue  # what is wrong with the entries of a list is told itself, and makes it too short
        keys = _keys(place, raw, missing=detail["type"] == "missing")
        got, expected, do = _got_expected_do(detail)
        if unknown:
            keys.append(key := detail["ctx"]["key"])
            do = do if detail["ctx"]["same"] else belongs(key) or do
        # An unknown key is one mistake in however many rows of a table it stands. Each alternative that a value may
        # be has an error of its own: the first stands for all.
        known_by = key_text([key for key in keys if not (unknown and isinstance(key, int))])
        found.setdefault(known_by, StudyError(locate(key_text(keys)), got, expected, do))
    return as_one(list(found.values()), locate(""))


def misspelt_key(
    key: str, given: Mapping[str, Any], known: Collection[str], values: Collection[str] = ()
) -> str | None:
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


def misspelling_hint(key: str, given: Mapping[str, Any], values: Collection[str]) -> str:
    """Sentence on the key that seems to be a misspelt one, as `misspelt_key` finds it; empty where none does."""
    meant = misspelt_key(key, given, (), values)
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


def _got_expected_do(detail: ErrorDetails) -> tuple[str, str, str]:
    """What was found, what was expected and what to do, of one of pydantic's errors."""
    kind, context, found = detail["type"], detail.get("ctx", {}), detail["input"]
    if kind in ("missing", "too_short") and detail["loc"] == ("records",):
        return "no [[records]]", "at least one", 'Write [[records]] and below it file = "drop.csv".'
    if kind == "refused":
        return context["got"], context["expected"], context["do"]
    if kind == "unknown_key":
        return "unknown key", context["expected"], context["do"]
    if kind == "missing" and isinstance(detail["loc"][-1], int):
        return quoted(found), PAIR, ""
    if kind == "string_type" and detail["loc"][-1] == "heading":
        return quoted(found), "the heading of a column, or a table with column, unit and scale", ""
    if kind in ("missing", "union_tag_not_found"):
        key = str(detail["loc"][-1]) if kind == "missing" else context["discriminator"].strip("'")
        tags = re.findall(r"'([^']*)'", context.get("expected_tags", ""))
        return f'no "{key}"', "it to be given", misspelling_hint(key, found, tags) if isinstance(found, dict) else ""
    if kind in ("literal_error", "union_tag_invalid"):
        choices = context["expected"] if kind == "literal_error" else context["expected_tags"]
        known = re.findall(r"'([^']*)'", choices)
        word = context.get("tag", found)
        do = did_you_mean(word, known) if isinstance(word, str) else ""
        return quoted(word), " or ".join(f'"{name}"' for name in known), do
    if kind == "tuple_type" and isinstance(found, dict) and detail["loc"][-1:] == ("records",):
        return "one table", EXPECTED[kind], "Write [[records]] before each record."
    return quoted(found), EXPECTED.get(kind, detail["msg"][:1].lower() + detail["msg"][1:]), ""
