"""Starting values from the data themselves, by the kind of rig: no simulation, no search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.core.formatting import format_quantity
from fibrefit.rigs.rig import STANDARD_GRAVITY, Initial, Starting, Stated
from fibrefit.rigs.signals.rates import derivative
from fibrefit.rigs.signals.regression import spring_and_damper
from fibrefit.rigs.signals.rest import first_rest, mean_at_rest
from fibrefit.rigs.signals.trace import Trace
from fibrefit.rigs.starting.stated_lifts import LiftShown, told_of_lifts
from fibrefit.rigs.thresholds import FALLEN, FALLS_AT_ALL, FEWEST_FALLING, FORCE_RISES

SMOOTHED_DROP = 8e-3
"""Length [s] of the windows by which the rate of a stretch is found, and where a signal crosses a level."""
LIKE_A_FALL = 0.25
"""Share of its whole way down along which a weight moves nearly as if it fell, even where the fibre is taut from the
start: the root of the way is then a sine of time, there 4 % off its line."""
SWING = 2.5
"""Length of a first contact over the time to its peak, where the fibre does not go slack after it."""


@dataclass(frozen=True)
class _Drop:
    """What a drop shows before and during its fall."""

    zero: float
    lift: float
    release: float
    acceleration: float


def starting_fibre_mass(traces: Sequence[Trace], stated: Stated, initial: Initial) -> Starting:
    """Rest gives the zero, the fall gives release and friction, the first contacts give stiffness and damping."""
    try:
        return _started(traces, stated)
    except DataError as error:
        if lifts := told_of_lifts([lift for trace in traces for lift in _lifts(trace)]):
            raise DataError(error.where, error.got, error.expected, f"{lifts} {error.do}") from None
        raise


def _lifts(trace: Trace) -> list[LiftShown]:
    """The lift that is stated beside the one that a record shows; nothing where there is one of them at most."""
    with suppress(DataError):
        level = _mean_held(trace, "position", _held(trace))
        lift = LiftShown(trace.name, trace.conditions["lift"], _onset(trace, level) - level)
        return [] if np.isnan(lift.stated) else [lift]
    return []


def _started(traces: Sequence[Trace], stated: Stated) -> Starting:
    drops = [_fall(trace, said) for trace, said in zip(traces, stated or [{}] * len(traces), strict=True)]
    friction = [_friction(trace, drop) for trace, drop in zip(traces, drops, strict=True)]
    stiffness, damping = _fibre(traces, drops)
    settled = [_first_contact_over(trace, drop) for trace, drop in zip(traces, drops, strict=True)]
    return Starting(
        shared={"stiffness": stiffness, "damping": damping, "friction": float(np.median(friction))},
        each={
            "position_zero": np.array([drop.zero for drop in drops]),
            "release": np.array([drop.release for drop in drops]),
            "lift": np.array([drop.lift for drop in drops]),
        },
        moving=np.array([drop.release for drop in drops]),
        settled=np.array(settled),
        spread={"stiffness": 2.0, "damping": 5.0, "friction": 5.0},
    )


def _fall(trace: Trace, stated: Mapping[str, float]) -> _Drop:
    position, time = trace.channels["position"], trace.times
    lift = trace.conditions["lift"]
    if np.nanmax(position) - np.nanmin(position) < FALLS_AT_ALL * lift:
        raise _no_drop(trace, "does not fall by its lift")
    if "release" in stated and "position_zero" in stated and not np.isnan(lift):
        level, after, noise = stated["position_zero"] - lift, time >= stated["release"], 0.0
    else:
        held = _held(trace)
        level, after = _mean_held(trace, "position", held), np.arange(len(time)) >= held.stop
        noise = float(np.nanstd(position[held]))
        lift = _onset(trace, level) - level if np.isnan(lift) else lift
    fallen = position - level
    # The square root of the way fallen is a line in time, whose foot is the release.
    # Of two samples the smaller: a lone outlier is no way down.
    deepest = float(np.nanmax(np.fmin(fallen[1:], fallen[:-1])))
    fall = max(lift, LIKE_A_FALL * deepest)
    begun = 0.05 * fall if fall == lift else max(0.05 * fall, FORCE_RISES * noise)
    below = _first(after & (fallen > FALLEN * fall), trace, "does not fall by its lift")
    early = after & (np.arange(len(time)) < below) & (fallen > begun)
    if early.sum() < FEWEST_FALLING:
        do = "Check lift, and the unit of the position channel."
        raise DataError(
            trace.name, f"fewer than {FEWEST_FALLING} samples of the fall", "a fall of some milliseconds", do
        )
    slope, foot = np.polyfit(time[early], np.sqrt(fallen[early]), 1)
    release = float(np.clip(-foot / slope, time[0], time[below]))
    zero, release = stated.get("position_zero", level + lift), stated.get("release", release)
    return _Drop(zero, lift, release, float(2.0 * slope**2))


def _held(trace: Trace) -> slice:
    return first_rest(
        trace,
        "the weight moves from the first sample",
        "a rest before the release, from which zero and release are found",
        'Give lift, release = "... s" and position_zero = "... mm" for the record, or let it begin earlier.',
    )


def _onset(trace: Trace, level: float) -> float:
    """Position at which the force first rises, in m."""
    force = trace.channels["force"]
    held = _held(trace)
    mean = _mean_held(trace, "force", held)
    rising = _first(force > mean + FORCE_RISES * np.nanstd(force[held]), trace, "shows no force")
    if trace.channels["position"][rising] <= level:
        raise DataError(
            trace.name,
            "the position falls while the weight does",
            "a position that grows away from the frame",
            "Check the sign of the position channel.",
        )
    return float(trace.channels["position"][rising])


def _mean_held(trace: Trace, channel: str, held: slice) -> float:
    """Mean of a channel while the weight is held, in its SI unit; a `DataError` where nothing of it was read."""
    return mean_at_rest(
        trace,
        channel,
        held,
        "hold",
        "a rest before the release, from which zero and release are found",
        f"Set the range of the {channel} sensor so that it reads the hold. For this record give "
        'lift = ".. mm", release = ".. s" and position_zero = ".. mm"; fibrefit inspect says what was masked, and why.',
    )


def _first(flags: np.ndarray, trace: Trace, otherwise: str) -> int:
    if not flags.any():
        raise _no_drop(trace, otherwise)
    return int(np.argmax(flags))


def _no_drop(trace: Trace, otherwise: str) -> DataError:
    lift = "" if np.isnan(trace.conditions.get("lift", np.nan)) else "lift, and "
    do = f"Check {lift}the sign and unit of the position and force channels."
    return DataError(trace.name, f"the record {otherwise}", "a weight that is released, falls and is caught", do)


def _friction(trace: Trace, drop: _Drop) -> float:
    mass = trace.conditions["weight_mass"] + trace.conditions["added_mass"]
    weight = mass * STANDARD_GRAVITY
    return float(max(weight * np.sin(trace.conditions["inclination"]) - mass * drop.acceleration, 0.01 * weight))


def _fibre(traces: Sequence[Trace], drops: Sequence[_Drop]) -> tuple[float, float]:
    """Stiffness and damping by regression of force on stretch and its rate, wherever the fibre carries load."""
    rows, forces = [], []
    for trace, drop in zip(traces, drops, strict=True):
        stretch = trace.channels["position"] - drop.zero
        rate = derivative(stretch, trace.times, SMOOTHED_DROP, 1)
        force = trace.channels["force"]
        loaded = (stretch > 0.1 * np.nanmax(stretch)) & (force > 0.1 * np.nanmax(force)) & np.isfinite(rate)
        rows.append(np.column_stack([stretch[loaded], rate[loaded]]))
        forces.append(force[loaded])
    refused = DataError(
        traces[0].name,
        f"the force does not grow as the fibre is stretched{_lift_read(traces[0], drops[0])}",
        "a force that grows with position",
        "Check lift; then the sign and unit of the force and position channels.",
    )
    return spring_and_damper(rows, forces, refused)


def _lift_read(trace: Trace, drop: _Drop) -> str:
    """What a record shows of its lift beside the one that is stated; empty where it shows none."""
    if np.isnan(trace.conditions["lift"]):
        return ""
    level = drop.zero - drop.lift
    with suppress(DataError):
        fallen = format_quantity(_onset(trace, level) - level, "m", 3)
        stated = format_quantity(drop.lift, "m", 3)
        return f" (a lift of {stated} is stated, and the force begins to rise after a fall of {fallen})"
    return ""


def _first_contact_over(trace: Trace, drop: _Drop) -> float:
    # Where samples lie closer than the noise is wide, the readings themselves cross the taut point many times.
    time, position = trace.times, derivative(trace.channels["position"], trace.times, SMOOTHED_DROP, 0)
    first = _first(position > drop.zero, trace, "does not reach the taut point")
    slack = (position < drop.zero) & (np.arange(len(time)) > first)
    # A weight that the fibre never lets go again swings: a little more than half a period counts as the contact.
    swing = time[first] + SWING * (time[np.argmax(position)] - time[first])
    return float(min(time[np.argmax(slack)] if slack.any() else time[-1], swing, time[-1]))
