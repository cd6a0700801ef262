"""The table every model of a file is made of: frozen, and closed to keys it does not know."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ModelWrapValidatorHandler,
    StrictStr,
    ValidationError,
    model_validator,
)
from pydantic_core import ErrorDetails, InitErrorDetails, PydanticCustomError

from fibrefit.core.errors import did_you_mean

Name = Annotated[StrictStr, Field(min_length=1, pattern=r"^[^\x00]*$")]
"""What something is called: files of results hold no NUL."""
OWN = ("refused", "unknown_key")
"""Kinds of errors that are ours, and not pydantic's."""
SAME = 0.8
"""Likeness of words beyond which a key is taken for a slip of the pen, and below for one of another table first."""


class StudyTable(BaseModel):
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
        found = [InitErrorDetails(type=_unknown(key, known), loc=(), input=data) for key in unknown]
        try:
            read({key: value for key, value in data.items() if key in known})
        except ValidationError as error:
            details = error.errors(include_url=False)
            found += [_anew(one) for one in details if one["loc"] and not _is_meant(one, unknown, known)]
        raise ValidationError.from_exception_data(cls.__name__, found)


def _unknown(key: str, known: list[str]) -> PydanticCustomError:
    near = did_you_mean(key, known)
    same = bool(did_you_mean(key, known, SAME))  # and thus meant, whatever else may be called so
    said = {"key": key, "expected": f"one of {', '.join(known)}", "do": near, "same": same}
    return PydanticCustomError("unknown_key", "{key}", said)


def _is_meant(detail: ErrorDetails, unknown: list[str], known: list[str]) -> bool:
    """Whether what is missing is there in another spelling."""
    if detail["type"] != "missing" or len(detail["loc"]) > 1:
        return False
    return any(f'"{detail["loc"][0]}"' in did_you_mean(key, known) for key in unknown)


def _anew(detail: ErrorDetails) -> InitErrorDetails:
    """One of pydantic's errors as it takes them; those of our own tell their parts themselves."""
    kind, context = detail["type"], detail.get("ctx", {})
    own = PydanticCustomError(kind, "", context) if kind in OWN else kind
    return InitErrorDetails(type=own, loc=detail["loc"], input=detail["input"], ctx=context)
