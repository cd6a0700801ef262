"""The table every model of a file is made of: frozen, and closed to keys it does not know."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, StrictStr, model_validator
from pydantic_core import PydanticCustomError

from fibrefit.core.errors import did_you_mean

Name = Annotated[StrictStr, Field(min_length=1, pattern=r"^[^\x00]*$")]
"""What something is called: files of results hold no NUL."""
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

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, data: Any) -> Any:
        for key in data if isinstance(data, dict) else ():
            if key not in cls.known_keys():
                known = cls.known_keys()
                near = did_you_mean(key, known)
                same = bool(did_you_mean(key, known, SAME))  # and thus meant, whatever else may be called so
                said = {"key": key, "expected": f"one of {', '.join(known)}", "do": near, "same": same}
                raise PydanticCustomError("unknown_key", "{key}", said)
        return data
