"""Starting values of a guided mass: a regression of the force on what opposes the motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.rigs.rig import Initial, Starting, Stated
from fibrefit.rigs.signals.rates import derivative, period_of, rates_of
from fibrefit.rigs.signals.trace import Trace
from fibrefit.rigs.thresholds import FEWEST_SLIDING, PROVEN

SMOOTH = 0.03
"""Length in s of the stretches over which position is taken for a parabola."""
FREE_SMOOTH = 0.15
"""The same for a free decay, as a share of its period."""
PERIODS = 1.5
"""Length of the first horizon of a free decay, in periods."""
VISCOUS = "guide.viscous_friction.viscous_coefficient"
SPRING, ZERO = "guide.spring.spring_stiffness", "guide.spring.spring_zero"
SLOW = 0.05
"""Share of the largest speed below which the direction of motion is not believed."""


class _Columns(NamedTuple):
    """Terms of the force by the parameter that multiplies each, ``(n_moving,)``; and the force."""

    terms: dict[str, np.ndarray]
    force: np.ndarray


def starting_guided_mass(traces: Sequence[Trace], stated: Stated, initial: Initial) -> Starting:
    """Mass, frictions, spring and offset by least squares wherever the mass moves; what is stated as it is."""
    free = not traces[0].inputs
    parts = [_columns(trace, SPRING in initial, free) for trace in traces]
    terms = {name: np.concatenate([part.terms[name] for part in parts]) for name in parts[0].terms}
    found = _solved(terms, np.concatenate([part.force for part in parts]), initial, traces[0].name)
    shared = {name: found[name] for name in ("mass", "force_offset")}
    shared |= {name: max(found[name], 1e-2) for name in ("friction", VISCOUS)}
    if SPRING in found:
        stiffness = max(found[SPRING], 1e-3 * shared["mass"])
        shared |= {SPRING: stiffness, ZERO: -found["force_offset"] / stiffness, "force_offset": 0.0}
    begin, end = (np.array([trace.times[i] for trace in traces]) for i in (0, -1))
    return Starting(
        shared=shared,
        each=_starts(traces) if free else {},
        moving=begin,
        settled=np.minimum(begin + _horizon(traces), end) if free else end,
        spread=dict.fromkeys(("mass", "friction", "force_offset", VISCOUS), 1.5) | {SPRING: 1.2, ZERO: 1.5},
        # Windows do not get longer: there is nothing to be learnt from a part of them first.
        horizons=((1.0, 3.0, 9.0), (2.0, 6.0, 18.0)) if free else ((),),
    )


def _horizon(traces: Sequence[Trace]) -> np.ndarray:
    return np.array([PERIODS * _length(trace) / FREE_SMOOTH for trace in traces])


def _length(trace: Trace) -> float:
    """Length in s over which the position of a free decay is smoothed."""
    values = trace.channels["position"]
    seen = np.isfinite(values)
    period = period_of(np.interp(trace.times, trace.times[seen], values[seen]), trace.times)
    return FREE_SMOOTH * (period if np.isfinite(period) else float(np.ptp(trace.times)))


def _starts(traces: Sequence[Trace]) -> dict[str, np.ndarray]:
    begun = [rates_of(trace.channels["position"], trace.times, _length(trace)) for trace in traces]
    return {
        "start_position": np.array([position[0] for position, _, _ in begun]),
        "start_speed": np.array([speed[0] for _, speed, _ in begun]),
    }


def _columns(trace: Trace, spring: bool, free: bool) -> _Columns:
    """Terms of the force of one record, where its mass moves."""
    position, speed, acceleration = _motion(trace)
    moving = np.abs(speed) > SLOW * np.nanmax(np.abs(speed))
    if moving.sum() < FEWEST_SLIDING:
        raise DataError(trace.name, "the mass hardly moves", "a position that changes", "Check its column and unit.")
    terms = {"mass": acceleration, "friction": np.sign(speed), VISCOUS: speed}
    terms |= ({SPRING: position} if spring else {}) | {"force_offset": np.ones_like(speed)}
    force = np.zeros_like(speed)
    if not free:
        measured = trace.inputs["force"][:, 0] if "force" in trace.inputs else trace.channels["force"]
        force = trace.conditions["gain"] * measured
        moving = moving & np.isfinite(force)
    force = force - trace.conditions["added_mass"] * acceleration
    return _Columns({name: term[moving] for name, term in terms.items()}, force[moving])


def _motion(trace: Trace) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, speed and acceleration of one record."""
    if "speed" in trace.inputs:
        return trace.inputs["position"][:, 0], trace.inputs["speed"][:, 0], trace.inputs["speed"][:, 1]
    if "velocity" in trace.channels:
        speed, acceleration = (derivative(trace.channels["velocity"], trace.times, SMOOTH, order) for order in (0, 1))
        return trace.inputs["position"][:, 0], speed, acceleration
    if "anchor" in trace.inputs:
        return rates_of(trace.inputs["anchor"][:, 0], trace.times, SMOOTH)
    return rates_of(trace.channels["position"], trace.times, _length(trace))


def _solved(terms: Mapping[str, np.ndarray], force: np.ndarray, initial: Initial, where: str) -> dict[str, float]:
    """Values of all terms; those that are stated as they are."""
    known = {name: value for name in terms if (value := initial.get(name)) is not None}
    if ZERO in initial and SPRING in known and initial[ZERO] is not None:
        known["force_offset"] = -known[SPRING] * float(initial[ZERO] or 0.0)
    force = force - sum((value * terms[name] for name, value in known.items()), np.zeros_like(force))
    sought = [name for name in terms if name not in known]
    columns = np.column_stack([terms[name] for name in sought]) if sought else np.zeros((len(force), 0))
    size = np.linalg.norm(columns, axis=0)
    values = np.linalg.lstsq(columns / np.where(size > 0.0, size, 1.0), force, rcond=1e-8)[0]
    found = known | dict(zip(sought, (values / np.where(size > 0.0, size, 1.0)).tolist(), strict=True))
    if not found["mass"] > 0.0:
        if _explains(columns, force, sought.index("mass")) > PROVEN:
            raise DataError(
                where,
                "the force does not go with the acceleration",
                "a force that is positive where the position speeds up",
                "Check the sign and unit of the force and position channels; a negative scale of a channel turns it.",
            )
        # The motion is too slow, or too regular, to tell: a mass that hardly matters beside the other terms.
        found["mass"] = 0.1 * float(np.std(force) / max(np.std(terms["mass"]), 1e-12)) or 1.0
    return found


def _explains(columns: np.ndarray, force: np.ndarray, place: int) -> float:
    """Share of what the other columns leave of the force that one column explains."""
    others = np.delete(columns, place, axis=1)
    left = force - others @ np.linalg.lstsq(others, force, rcond=None)[0]
    own = columns[:, place] - others @ np.linalg.lstsq(others, columns[:, place], rcond=None)[0]
    return float((own @ left) ** 2 / max((own @ own) * (left @ left), 1e-300))
