"""Sentences of what to do about records and what is stated of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from fibrefit.core.formatting import format_number, format_quantity
from fibrefit.study.summaries.check import Check

if TYPE_CHECKING:
    from fibrefit.fitting.misstatements import SlackZero
    from fibrefit.fitting.residuals import LoneSamples

SAMPLES_NAMED = 3
"""Samples, or records, that are named; a count tells the others."""


def lone_samples_advice(alone: LoneSamples, robust: bool) -> str:
    """Which samples carry most of the misfit, and what to do about them."""
    named = [
        f"{one.channel} of {one.record} at {format_quantity(one.time, 's', 5)} ({format_number(one.size, 3)} times the "
        "noise)"
        for one in alone.samples[:SAMPLES_NAMED]
    ]
    one, others = len(alone.samples) == 1, len(alone.samples) - SAMPLES_NAMED
    more = f" and {others} more" if others > 0 else ""
    carry = "1 sample, far from its neighbours, carries" if one else f"{len(alone.samples)} samples, far from their "
    carry = carry if one else f"{carry}neighbours, carry"
    it = "it" if one else "them"
    again = f"mask {it} in the file" if robust else f"look at {it}, and fit again with --robust: such count less then"
    return (
        f"{carry} {100.0 * alone.share:.0f} % of what is left beyond the noise: {', '.join(named)}{more}. No law "
        f"explains {it}: {again}."
    )


def slack_zero_sentence(check: Check) -> str:
    """What the force reads while nothing pulls."""
    zeros, most = check.facts["zeros"], format_quantity(check.threshold or 0.0, "N", 2)
    return (
        f"{_read_slack(zeros)}; chance allowed for, at most {most} passes. Every force is off by as much, and the "
        "values take it up: they may mislead."
    )


def slack_zero_advice(zeros: Sequence[SlackZero]) -> str:
    """What to state of the zero."""
    size = format_number(zeros[0].zero, 3)
    return (
        f"{_read_slack(zeros)}. State that reading as the zero of the channel, in the numbers of its column: force = "
        f'{{ column = "..", zero = .. }} under [channels], zero = {size} where they are newtons; then fit again. Where '
        'it has to be found as a value, name the effect "sensor.force_offset".'
    )


def _read_slack(zeros: Sequence[SlackZero]) -> str:
    each = [
        f"{format_quantity(one.zero, 'N', 3)} +/- {format_quantity(one.error, 'N', 1)}"
        f"{f' in {one.record}' if len(zeros) > 1 else ''}"
        for one in zeros[:SAMPLES_NAMED]
    ]
    others = len(zeros) - SAMPLES_NAMED
    more = f" and so on in {others} more" if others > 0 else ""
    return f"The force reads {', '.join(each)}{more} before release, where the fibre is slack"
