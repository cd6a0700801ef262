"""Whether a weight that nothing holds falls as gravity has it: clock, scale and slope of a study, put to a test.

A weight whose fibre is slack has two forces on it: its own and that of the guide, which turns round with the motion. On
its way up it is slowed by both, on its way down by their difference, so that flights in both directions tell gravity
itself, whatever the fibre and the friction are. Nothing in a study is known better: what differs from it is the clock,
the scale of the positions or the slope.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from fibrefit.core.capability import Capability
from fibrefit.core.roles import SLACK
from fibrefit.problem.diagnose.phases import Motion
from fibrefit.problem.diagnose.stretches import (
    FORCE,
    POSITION,
    SMOOTHED_LOAD,
    TURNED,
    SharedShapes,
    error_of_sum,
    fitted_shapes,
    measured_positions,
    stated_and_found,
    without_polynomial,
)
from fibrefit.problem.task import Task
from fibrefit.problem.thresholds import CARRIES_LOAD, SHORTEST_FLIGHT
from fibrefit.rigs.rig import STANDARD_GRAVITY
from fibrefit.rigs.signals.motion import integrated
from fibrefit.rigs.signals.rates import derivative
from fibrefit.rigs.signals.rest import runs
from fibrefit.rigs.signals.trace import Trace

EDGE = 0.1
"""Share of a flight at either end that is left out: a force may be late, and a contact begins gently."""
RESOLVED = 1e-4
"""Smallest singular value over the largest below which gravity and friction are not distinguished: flights one way."""


class Gravity(NamedTuple):
    """What free flight says of gravity along the guide.

    Parameters
    ----------
    excess : float
        By how much it is more than what the study says, relative.
    error : float
        Standard error of that, from the noise of the positions.
    """

    excess: float
    error: float


class _Flight(NamedTuple):
    """One flight: its record, its samples, their positions, NaN where they do not count, and speeds."""

    record: int
    samples: np.ndarray
    position: np.ndarray
    speed: np.ndarray

    @property
    def seen(self) -> np.ndarray:
        """Samples that count."""
        return np.isfinite(self.position)


def gravity_in_flight(task: Task, values: np.ndarray, motion: Motion) -> Gravity | None:
    """Gravity by the positions measured while the fibre is slack; None where no weight flies in both directions.

    Parameters
    ----------
    values : (n_free,) in SI units
    motion : Motion
        At these values.

    Law
    ---
    Positions of a flight are ``a + b t + γ g t² / 2 - (f ∬ sign(v) + c ∬ v) / m``, with friction that is constant or
    grows with the speed and the same f and c in all of them. Least squares of what was measured, over least squares of
    what was simulated: a clock or a scale that is in the model counts as stated. The error is that of noise with the
    spectrum of the rests, or as loud as what is left where that is louder.
    """
    rig = task.problem.model.rig
    if Capability.FALL not in rig.capabilities or not {POSITION, FORCE} <= set(rig.channels):
        return None
    local = np.asarray(task.problem.layout.local(np.asarray(values)))
    flights = _measured(task, motion)
    measured, simulated = _fitted(task, local, flights), _fitted(task, local, _simulated(task, motion))
    if measured is None or simulated is None:
        return None
    places = [(flight.record, flight.samples[flight.seen]) for flight in flights]
    error, ratio = error_of_sum(task, places, measured.weights[0], measured.left), float(simulated.sizes[0])
    return Gravity(float(measured.sizes[0]) / ratio - 1.0, error / ratio)


def _measured(task: Task, motion: Motion) -> list[_Flight]:
    """Flights by the force as well: simulated contacts are late or early where the model is wrong."""
    found = list[_Flight]()
    for r, trace in enumerate(task.traces):
        n = len(trace.times)
        force = derivative(trace.channels[FORCE], trace.times, SMOOTHED_LOAD, 0)
        free = (motion.phase[r, :n] == SLACK) & (force < CARRIES_LOAD * np.nanmax(force))
        found += _flights(trace, r, measured_positions(task, r), free)
    return found


def _simulated(task: Task, motion: Motion) -> list[_Flight]:
    readings, found = np.asarray(motion.readings[POSITION]), list[_Flight]()
    for r, trace in enumerate(task.traces):
        n = len(trace.times)
        found += _flights(trace, r, readings[r, :n], motion.phase[r, :n] == SLACK)
    return found


def _flights(trace: Trace, record: int, position: np.ndarray, free: np.ndarray) -> Iterator[_Flight]:
    if np.isfinite(position).sum() < SHORTEST_FLIGHT:
        return
    speed = derivative(position, trace.times, TURNED, 1)
    for start, end in _stretches(free):
        if np.isfinite(position[start:end]).sum() >= SHORTEST_FLIGHT:
            yield _Flight(record, np.arange(start, end), position[start:end], speed[start:end])


def _stretches(free: np.ndarray) -> list[tuple[int, int]]:
    """First sample of each flight and the one after its last, without its ends."""
    cut = [(start, end, round(EDGE * (end - start))) for start, end in runs(free).tolist()]
    return [(start + off, end - off) for start, end, off in cut if end - start - 2 * off >= SHORTEST_FLIGHT]


def _fitted(task: Task, local: np.ndarray, flights: list[_Flight]) -> SharedShapes | None:
    """Gravity over the stated one by all flights; None where they tell nothing."""
    if not flights:
        return None
    table = np.concatenate([_without_start(task, local, flight) for flight in flights])
    return fitted_shapes(table[:, 0], table[:, 1:], 1, RESOLVED)


def _without_start(task: Task, local: np.ndarray, flight: _Flight) -> np.ndarray:
    """Positions of a flight and what they consist of, ``(n_seen, 4)``, without what another start could be."""
    trace = task.traces[flight.record]
    stated = stated_and_found(task, local, flight.record)
    mass = stated["weight_mass"] + stated.get("added_mass", 0.0)
    gravity = STANDARD_GRAVITY * np.sin(stated["inclination"])
    time = trace.step * (flight.samples - flight.samples.mean())
    # Of the sample in which a weight turns round, the share that it goes one way.
    direction = np.clip(flight.speed / (0.5 * gravity * trace.step), -1.0, 1.0)
    turned = integrated(integrated(direction, trace.step), trace.step)
    path = integrated(flight.position, trace.step)
    table = np.column_stack([flight.position, 0.5 * gravity * time**2, turned / mass, path / mass])
    return without_polynomial(table, time, flight.seen, 1)
