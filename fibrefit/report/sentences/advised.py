"""Sentences of what to do about records and what is stated of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fibrefit.core.units import format_number, format_quantity

if TYPE_CHECKING:
    from fibrefit.fitting.misfit.lone_samples import LoneSamples

SAMPLES_NAMED = 3
"""Samples that are named; a count tells the others."""


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
