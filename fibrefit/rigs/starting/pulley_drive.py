"""Starting values of the pulley-drive rig: rests give tension and zero, loads the fibre, sliding the friction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.rigs.rig import STANDARD_GRAVITY, Initial, Starting, Stated
from fibrefit.rigs.signals.newton import Pull
from fibrefit.rigs.signals.rates import derivative
from fibrefit.rigs.signals.regression import spring_and_damper
from fibrefit.rigs.signals.rest import first_rest, mean_at_rest
from fibrefit.rigs.signals.trace import Trace
from fibrefit.rigs.thresholds import DRIVE_BEGINS, DRIVE_STANDS

SMOOTHING = 0.020
"""Window in s over which positions are differentiated."""
SLIDES = 0.02
"""Speed in m/s from which the weight is taken to slide."""
FIRST = 0.25
"""Length in s of motion that the guesses can be trusted to predict."""


def starting_pulley_drive(traces: Sequence[Trace], stated: Stated, initial: Initial) -> Starting:
    """First guesses without simulation."""
    still = [_rest(trace) for trace in traces]
    places, tensions = (
        np.array([_mean_at_rest(trace, channel, rest) for trace, rest in zip(traces, still, strict=True)])
        for channel in ("position", "force")
    )
    stiffness, damping = _fibre(traces, still, places, tensions)
    zeros = [
        place - np.mean(t.inputs["drive"][rest, 0]) + tension / stiffness
        for t, rest, place, tension in zip(traces, still, places, tensions, strict=True)
    ]
    begins = np.array([_begins(trace, rest) for trace, rest in zip(traces, still, strict=True)])
    return Starting(
        shared={"stiffness": stiffness, "damping": damping, "friction": _friction(traces)},
        each={"position_zero": np.array(zeros), "start_tension": tensions},
        moving=begins,
        settled=begins + FIRST,
        spread={"stiffness": 1.5, "damping": 5.0, "friction": 3.0},
        # Every stroke brings new contacts to time: longer horizons than a single drop needs.
        horizons=((1.0, 2.5, 5.0), (2.0, 4.0, 8.0)),
    )


def drawn_up(conditions: Mapping[str, float], position: np.ndarray) -> Pull:
    """The fibre draws the weight up the slope, as far as it lies along it; gravity draws it down.

    Parameters
    ----------
    position : (n_time,) in m
    """
    mass, offset = conditions["weight_mass"] + conditions["added_mass"], conditions["lateral_offset"]
    along = conditions["guide_distance"] - position
    lever = along / np.hypot(along, offset) if offset else np.ones(len(position))
    return Pull(mass, -STANDARD_GRAVITY * float(np.sin(conditions["inclination"])), lever)


def balance(conditions: Mapping[str, float]) -> float:
    """Tension that holds the weight where it begins, without friction, in N: more than its pull if the fibre slants."""
    pull = drawn_up(conditions, np.zeros(1))
    return float(-pull.mass * pull.gravity / pull.lever[0])


def _rest(trace: Trace) -> slice:
    return first_rest(
        trace,
        "the rig moves from the first sample",
        "a rest before the drive starts, from which tension and zero are found",
        "Let the record begin earlier, with a rest of some hundred samples, or cut it so that it begins at one.",
    )


def _mean_at_rest(trace: Trace, channel: str, rest: slice) -> float:
    expected = "a rest before the drive starts, from which tension and zero are found"
    do = f"Set the range of the {channel} sensor so that it reads the rest; fibrefit inspect says what was masked."
    return mean_at_rest(trace, channel, rest, "rest", expected, do)


def _begins(trace: Trace, rest: slice) -> float:
    drive = trace.inputs["drive"][:, 0]
    away = np.abs(drive - drive[rest].mean()) > max(DRIVE_BEGINS * drive[rest].std(), DRIVE_STANDS)
    if not away.any():
        raise DataError(
            trace.name, "the drive does not move", "a motion that stretches the fibre", "Check the drive channel."
        )
    return float(trace.times[int(np.argmax(away))])


def _fibre(
    traces: Sequence[Trace], still: Sequence[slice], places: np.ndarray, tensions: np.ndarray
) -> tuple[float, float]:
    """Stiffness and damping by regression of force on stretch and its rate, wherever the fibre carries load."""
    rows, forces = [], []
    for trace, rest, place, tension in zip(traces, still, places, tensions, strict=True):
        drive, position = trace.inputs["drive"][:, 0], trace.channels["position"]
        stretch = (drive - drive[rest].mean()) - (position - place)
        rate = trace.inputs["drive"][:, 1] - _derivative(trace, 1)
        force = trace.channels["force"] - tension
        loaded = (trace.channels["force"] > 0.15 * np.nanmax(trace.channels["force"])) & np.isfinite(
            force + rate + stretch
        )
        rows.append(np.column_stack([stretch[loaded], rate[loaded]]))
        forces.append(force[loaded])
    refused = DataError(
        traces[0].name,
        "the force does not grow as the fibre is stretched",
        "a force that grows as the drive takes fibre in",
        "Check the sign and unit of the force, position and drive channels.",
    )
    return spring_and_damper(rows, forces, refused)


def _friction(traces: Sequence[Trace]) -> float:
    """Mean of what opposes the sliding weight besides gravity and inertia."""
    opposed, weight = [], 0.0
    for trace in traces:
        mass = trace.conditions["weight_mass"] + trace.conditions["added_mass"]
        weight = mass * STANDARD_GRAVITY
        velocity, acceleration = _derivative(trace, 1), _derivative(trace, 2)
        driving = trace.channels["force"] - weight * np.sin(trace.conditions["inclination"]) - mass * acceleration
        slides = np.abs(velocity) > SLIDES
        opposed.append((np.sign(velocity) * driving)[slides & np.isfinite(driving)])
    mean = float(np.mean(np.concatenate(opposed))) if any(len(part) for part in opposed) else 0.0
    return max(mean, 0.01 * weight)


def _derivative(trace: Trace, order: int) -> np.ndarray:
    position = trace.channels["position"]
    found = derivative(position, trace.times, SMOOTHING, order, degree=3)
    return np.where(np.isfinite(position), found, np.nan)
