"""A check: a statistic, its threshold and the outcome, as it is made and as ``summary.json`` has it.

Its sentence, `says`, is made by `fibrefit.report.sentences` where a result is written.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence, Sized
from typing import Annotated, Any, Literal

from pydantic import AllowInfNan, Field, PlainSerializer
from pydantic.json_schema import SkipJsonSchema

from fibrefit.study.summaries.part import Part

Status = Literal["ok", "suspect", "failed"]
_Number = Annotated[float, AllowInfNan()]
_Compared = Annotated[
    _Number | None,
    PlainSerializer(lambda value: value if value is None or math.isfinite(value) else None, return_type=float | None),
]
"""A number, of which the file says nothing where it is not finite."""


class Check(Part):
    """A test the result was put to; `name` is what is true where it passed."""

    name: str
    passed: bool
    says: str = ""
    statistic: _Compared = None
    threshold: _Compared = None
    unit: str = "-"
    fatal: bool = False
    """Whether the result cannot be used at all where it failed."""
    identifier: str = ""
    """Stable name, which stays where wording changes; may be empty."""
    quantity: str = ""
    """What was tested: a failed check is listed under it; may be empty."""
    about: Literal["numbers", "model"] = "numbers"
    """numbers: a failure means that the values may mislead; model: it says that more than noise is left, that the noise
    is not known, or that a measured input is not as measured."""
    # What a sentence needs besides the numbers, such as the channel that is worst: not in the file.
    facts: SkipJsonSchema[Mapping[str, Any]] = Field(default_factory=dict, exclude=True, repr=False)

    @classmethod
    def none_of(cls, found: Sized, **fields: Any) -> Check:
        """Passed where nothing was `found`; the statistic is how many were. The other fields as they are given."""
        return cls(passed=not found, statistic=float(len(found)), threshold=0.0, **fields)


OTHERWISE = "otherwise"
"""Identifier of the check that names one thing more which explains the records."""
SIZE = "residual_size"
"""Identifier of the check that what is left is no larger than the noise."""


def failed_model_checks(checks: Sequence[Check]) -> list[Check]:
    """Failed checks of the model, which leave the numbers alone."""
    return [check for check in checks if check.about == "model" and not check.passed]


def above_noise(checks: Sequence[Check]) -> bool:
    """Whether the model leaves more than the noise; that its noise is not known, or not white, does not say so."""
    return any(check.identifier == SIZE for check in failed_model_checks(checks))


def status_by(checks: Sequence[Check]) -> Status:
    """``failed`` where a fatal check failed, ``suspect`` where one about the numbers did, else ``ok``."""
    failed = [check for check in checks if not check.passed]
    if any(check.fatal for check in failed):
        return "failed"
    return "suspect" if any(check.about == "numbers" for check in failed) else "ok"
