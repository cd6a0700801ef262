"""Sentences of what else would explain a fit: one thing more, or a value that may be off by a factor."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from fibrefit.core.formatting import format_quantity
from fibrefit.study.summaries.check import Check

if TYPE_CHECKING:
    from fibrefit.fitting.misstatements import Alternative, Misstated


def otherwise_sentence(check: Check) -> str:
    """What one thing more explains, and what it makes of the values."""
    found = check.facts["alternative"]
    name = found.name.rpartition(".")[2].replace("_", " ")
    value, without = (format_quantity(size, found.value_unit, 3) for size in (found.value, found.without))
    stated = found.effect in STATED_OTHERWISE
    also = "".join(f" or {stated_otherwise(one)} ({one.effect})," for one in found.alike)
    of = f" ({found.effect})," if stated else ""
    first = ", with the first of them" if also else ""
    says = (
        f"With {stated_otherwise(found)}{of}{also} the model would leave nothing but noise, and the {name} would be "
        f"{without} in place of {value}{first}"
    )
    do = "run fibrefit discover" if not stated else "look at what the study states"
    if not check.fatal:
        return f"{says}: {do}."
    return f"{says}: another by a factor of {found.factor:.2g}. Until that is settled, the fit is of no use: {do}."


def correct_advice(found: Alternative) -> str:
    """What to check of a study that states something wrong; only one of several such faults is the true one."""
    faults: list[Alternative | Misstated] = [found, *found.alike]
    told = [stated_otherwise(one) for one in faults]
    explain = f"Look at what the study states: {', or '.join(told)} would explain the records to their noise"
    checks = "; ".join(CHECKED_BY.get(one.effect, "check what is stated of it") for one in faults)
    if not found.alike:
        return f"{explain}. First {checks}; correct it if it is so, and fit again."
    return (
        f"{explain}. The records do not tell these apart, and the values hang on which it is: {checks}. Correct only "
        "what turns out to be wrong, and fit again."
    )


CHECKED_BY = {
    "study.clock": "check the clock or the sampling rate",
    "study.inclination": "measure the slope",
    "study.lift": "measure the lift",
    "study.weight_mass": "weigh the weight with all that moves with it",
    "sensor.position_gain": "check the calibration of the position",
    "sensor.force_gain": "check the calibration of the force with a known load",
    "sensor.force_delay": "check filters and triggers of the two channels",
}
"""How a fault in what a study states is told from others that explain the records alike, by its law."""


def stated_otherwise(found: Alternative | Misstated) -> str:
    """What one thing more is: how the study is wrong, or a law with its size."""
    stated = STATED_OTHERWISE.get(found.effect)
    return f"{found.effect} ({format_quantity(found.size, found.unit, 3)})" if stated is None else stated(found.size)


def _than(size: float, unit: str, more: str, less: str) -> str:
    return f"{abs(size):.2g} {unit} {more if size > 0.0 else less}"


STATED_OTHERWISE: dict[str, Callable[[float], str]] = {
    "study.clock": lambda size: f"times that are {_than(100.0 * size, '%', 'longer', 'shorter')} than given",
    "study.inclination": lambda size: f"a slope {_than(math.degrees(size), 'deg', 'more', 'less')} than stated",
    "study.lift": lambda size: f"a lift {_than(1e3 * size, 'mm', 'larger', 'smaller')} than stated",
    "study.weight_mass": lambda size: f"a mass {_than(100.0 * size, '%', 'larger', 'smaller')} than stated",
    "sensor.position_gain": lambda size: f"positions that are read {size:.3g} times as large as they are",
    "sensor.force_gain": lambda size: f"a force that is read {size:.3g} times as large as it is",
    "sensor.force_delay": lambda size: f"a force that is {1e3 * size:.2g} ms late",
}
"""What a fault in what a study states comes to, by its law."""


def doubtful_sentence(check: Check) -> str:
    """Which value may be off by a factor."""
    found = check.facts["doubtful"]
    name, most = found.name.rpartition(".")[2].replace("_", " "), f"a factor of {check.facts['factor']:g}"
    if check.passed:
        return f"By the error bars that allow for what the model lacks, no value is off by more than {most}."
    value, error = (format_quantity(size, found.unit, 2) for size in (found.value, found.error))
    return (
        f"What the model lacks may put the {name} of {value} off by more than {most}: the standard error that allows "
        f"for it is {error}. Until the model has it, the fit is of no use: run discover."
    )
