"""Whether the force reads zero before the release, where the fibre of a weight that falls is slack.

Nothing pulls at the gauge then, so that the mean of what it reads is its zero. Noise moves that mean by as much as the
means of pieces of the rest differ, slow noise by no more than its size over the record.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fibrefit.core.declarations import Capability
from fibrefit.fitting.thresholds import CHANCE, ZERO_OVER_NOISE, ZERO_SHARE
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.task import Task
from fibrefit.rigs.signals.rest import rests
from fibrefit.rigs.signals.trace import Trace
from fibrefit.rigs.thresholds import SHORTEST_REST
from fibrefit.study.summaries.check import Check

PIECES_OF_HOLD = 8
"""Pieces of a rest whose means tell how well the mean of all is known."""
FOUND_BY = ("sensor.force_offset", "sensor.force_drift")
"""Effects by which a model finds the zero itself."""


class SlackZero(NamedTuple):
    """What the force of a record reads while its fibre is slack, and its error, in N."""

    record: str
    zero: float
    error: float


class SlackZeros(NamedTuple):
    """The zeros that are off, and of the worst by how much more than passes, `beyond` and `most` in N."""

    zeros: tuple[SlackZero, ...]
    beyond: float
    most: float


def slack_zeros(task: Task) -> SlackZeros | None:
    """The records whose force has a zero that is surely off; None where there is none, or nobody can tell."""
    model = task.problem.model
    found_too = any(effect.name in FOUND_BY for effect in model.effects)
    if found_too or Capability.FALL not in model.rig.capabilities or "force" not in model.rig.channels:
        return None
    told = [_off(trace, task.noise["force"]) for trace in task.traces]
    found = [one for one in told if one is not None]
    if not found:
        return None
    _, beyond, most = max(found, key=lambda one: one[1] - one[2])
    return SlackZeros(tuple(zero for zero, _, _ in found), beyond, most)


def judge_zero(found: SlackZeros) -> Check:
    """What is said of a force that does not read zero where nothing pulls."""
    return Check(
        name="the force is zero while the fibre is slack",
        passed=False,
        statistic=found.beyond,
        threshold=found.most,
        unit="N",
        identifier="slack_zero",
        quantity="zero of the force",
        facts={"zeros": found.zeros},
    )


def _off(trace: Trace, noise: Noise) -> tuple[SlackZero, float, float] | None:
    """The zero of a record if it is off, how far it is, chance allowed for, and how far it may be."""
    force = trace.channels["force"]
    held = np.concatenate([np.zeros(0), *(force[rest] for rest in rests(trace) if rest.start == 0)])
    held = held[np.isfinite(held)]
    if len(held) < SHORTEST_REST:
        return None
    means = [float(piece.mean()) for piece in np.array_split(held, PIECES_OF_HOLD)]
    zero, error = float(np.mean(means)), float(np.std(means, ddof=1)) / np.sqrt(PIECES_OF_HOLD)
    most = zero_allowed(noise.rms(trace.duration, trace.rate), float(np.nanmax(np.abs(force))))
    beyond = abs(zero) - CHANCE * error
    return (SlackZero(trace.name, zero, error), beyond, most) if beyond > most else None


def zero_allowed(noise: float, largest: float) -> float:
    """How far a zero may be off beside noise and the largest reading of a force, all in N."""
    return max(ZERO_OVER_NOISE * noise, ZERO_SHARE * largest)
