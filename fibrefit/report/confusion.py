"""The terminal report of what records could show."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from typing import Protocol

from fibrefit.core.units import format_quantity

WIDTH = 80
ALIKE = 0.9
MOST_PAIRS = 12
ANGLE = "inclination"


class DirectionLike(Protocol):
    """What is told of one effect."""

    effect: str
    parameter: str
    unit: str
    detectable: float
    unique: float


def confusion_report(
    name: str, found: object, split: object | None, conditions: Mapping[str, float], remarks: Sequence[str] = ()
) -> str:
    """Report of at most 80 columns.

    Parameters
    ----------
    name : str
        Of the study.
    found : Confusion
    split : Split or None
    conditions : mapping of str to float, in SI units
    remarks : sequence of str

    Returns
    -------
    str
    """
    lines = [name, "=" * WIDTH]
    for remark in remarks:
        lines += ["", *textwrap.wrap(remark, WIDTH)]
    lines += ["", "Smallest strength that these records would show", "-" * 47]
    for one in found.directions:  # type: ignore[attr-defined]
        lines.append(f"{one.effect:<34} {one.parameter:<24} {_strength(one)}")
    pairs = found.pairs(ALIKE)  # type: ignore[attr-defined]
    lines += ["", "What they would confuse (1 is inseparable)", "-" * 42]
    lines += [f"{cosine:.3f}  {first} / {second}" for first, second, cosine in pairs[:MOST_PAIRS]]
    if not pairs:
        lines.append("No two effects change these records in nearly the same way.")
    if split is not None:
        lines += ["", *_further(split, conditions)]
    return "\n".join(lines)


def _strength(one: DirectionLike) -> str:
    if not math.isfinite(one.detectable):
        return "not visible"
    return f"{one.detectable:.2g}" if one.unit == "-" else format_quantity(one.detectable, one.unit, 2)


def _further(split: object, conditions: Mapping[str, float]) -> list[str]:
    pair, before, after = split.pair, split.before, split.after  # type: ignore[attr-defined]
    stated = ", ".join(f"{name} {_condition(name, value)}" for name, value in conditions.items())
    text = f"To tell {pair[0]} from {pair[1]}, the best further record has {stated}: {before:.3f} becomes {after:.3f}."
    if after > 0.97 * before:
        text += " That is little: it takes another kind of test."
    return textwrap.wrap(text, WIDTH)


def _condition(name: str, value: float) -> str:
    if name == ANGLE:
        return f"{math.degrees(value):.3g} deg"
    return format_quantity(value, "kg" if name.endswith("mass") else "m", 3)
