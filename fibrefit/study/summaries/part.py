"""What parts of a summary file have in common: one declaration is the object, its schema and its form in the file."""

from __future__ import annotations

import math
from typing import Annotated, Any, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict


def _known(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


Known = Annotated[float | None, BeforeValidator(_known)]
"""A number, or None where it is not known: what is computed says so by nan or infinity, for which JSON has no word."""


class Part(BaseModel):
    """A part of a summary file: frozen, finite, closed to names it does not know."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, populate_by_name=True, from_attributes=True
    )

    @classmethod
    def of(cls, found: object) -> Self:
        """The part with what `found` calls by the same names.

        Parameters
        ----------
        found : object
            With an attribute for each field that has no default.

        Returns
        -------
        Part
        """
        return cls.model_validate(found)
