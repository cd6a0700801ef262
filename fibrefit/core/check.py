"""A check: a statistic, its threshold, the outcome and a sentence that explains it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Check:
    """One test a result was put to.

    Parameters
    ----------
    name : str
        Short name, e.g. ``"residuals are white"``.
    passed : bool
        Outcome.
    says : str
        What the outcome means, in plain words.
    statistic, threshold : float or None
        The number compared and the limit it was compared with, in `unit`.
    unit : str
        Unit of both; ``"-"`` for a pure number.
    fatal : bool
        Whether a failure of this check means that the result cannot be used at all.
    """

    name: str
    passed: bool
    says: str
    statistic: float | None = None
    threshold: float | None = None
    unit: str = "-"
    fatal: bool = False
