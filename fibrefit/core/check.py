"""Checks and other statements as numbers and names; `fibrefit.report.sentences` puts them into words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

Status = Literal["ok", "suspect", "failed"]


@dataclass(frozen=True, slots=True)
class Check:
    """One test a result was put to.

    Parameters
    ----------
    name : str
        What is true where it passes, e.g. ``"the residuals are noise"``.
    passed : bool
        Outcome.
    statistic, threshold : float or None
        The number compared and the limit it was compared with, in `unit`.
    unit : str
        Unit of both; ``"-"`` for a pure number.
    fatal : bool
        Whether a failure of this check means that the result cannot be used at all.
    identifier : str
        Stable name for programs, e.g. ``"residual_size"``: stays where wording changes. Empty where there is none.
    quantity : str
        What is tested, e.g. ``"residual size"``: a failed check is listed under it, for `name` would then say the
        opposite of what was found. Empty where there is none.
    about : str
        ``"numbers"`` where a failure means that the values may mislead; ``"model"`` where it only says that the model
        leaves more than noise, as every model of a real rig does once the noise is small enough.
    facts : mapping of str to object
        What else was found, such as the channel that is worst: what a sentence needs besides the numbers.
    """

    name: str
    passed: bool
    statistic: float | None = None
    threshold: float | None = None
    unit: str = "-"
    fatal: bool = False
    identifier: str = ""
    quantity: str = ""
    about: Literal["numbers", "model"] = "numbers"
    facts: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Statement:
    """What was found besides the checks.

    Parameters
    ----------
    identifier : str
        By which its sentence is found.
    facts : mapping of str to object
        What the sentence needs, in SI units.
    """

    identifier: str
    facts: Mapping[str, Any] = field(default_factory=dict)


def status_by(checks: Sequence[Check]) -> Status:
    """``failed`` where a fatal check failed, ``suspect`` where one about the numbers did, else ``ok``."""
    failed = [check for check in checks if not check.passed]
    if any(check.fatal for check in failed):
        return "failed"
    return "suspect" if any(check.about == "numbers" for check in failed) else "ok"
