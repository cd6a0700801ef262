"""The terminal report of what records could show."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import Protocol

from fibrefit.core.units import format_quantity
from fibrefit.report.checks import GLOSSARY

WIDTH = 80
ALIKE = 0.9
MOST_PAIRS = 12


class DirectionLike(Protocol):
    """What is reported of one effect."""

    effect: str
    parameter: str
    unit: str
    detectable: float
    unique: float


class SplitLike(Protocol):
    """The further record that splits a pair."""

    @property
    def says(self) -> str:
        """The record in a sentence."""


def confusion_report(name: str, found: object, split: SplitLike | None, remarks: Sequence[str] = ()) -> str:
    """Report of what records can distinguish, in at most 80 columns.

    Parameters
    ----------
    name : str
        Of the study.
    found : Confusion
    split : Split or None
    remarks : sequence of str

    Returns
    -------
    str
    """
    lines = [name, "=" * WIDTH]
    for remark in remarks:
        lines += ["", *textwrap.wrap(remark, WIDTH)]
    limits = "Detection limits: smallest strength that these records would show"
    lines += ["", limits, "-" * len(limits)]
    lines += [strength_line(one) for one in found.directions]  # type: ignore[attr-defined]
    pairs = found.pairs(ALIKE)  # type: ignore[attr-defined]
    heading = "Confounded pairs: |cosine| of their sensitivities (1: not separable)"
    lines += ["", heading, "-" * len(heading)]
    lines += [f"{cosine:.3f}  {first} / {second}" for first, second, cosine in pairs[:MOST_PAIRS]]
    if not pairs:
        lines.append(f"No two effects have sensitivities of |cosine| {ALIKE:g} or more.")
    if split is not None:
        lines += ["", *textwrap.wrap(split.says, WIDTH)]
    return "\n".join([*lines, "", GLOSSARY])


def strength_line(one: DirectionLike) -> str:
    """An effect, the parameter that tells its strength, and the smallest one that would be found."""
    return f"{one.effect:<34} {one.parameter:<24} {strength(one.detectable, one.unit)}"


def strength(detectable: float, unit: str) -> str:
    """Smallest strength that would be found, with its unit."""
    if not math.isfinite(detectable):
        return "not visible"
    return f"{detectable:.2g}" if unit == "-" else format_quantity(detectable, unit, 2)
