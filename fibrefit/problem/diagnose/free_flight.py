"""Whether a weight that nothing holds falls as gravity has it: clock, scale and slope of a study, put to a test.

A weight whose fibre is slack has two forces on it: its own and that of the guide, which turns round with the motion. On
its way up it is slowed by both, on its way down by their difference, so that flights in both directions tell gravity
itself, whatever the fibre and the friction are. Nothing in a study is known better: what differs from it is the clock,
the scale of the positions or the slope.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from fibrefit.core.capability import Capability
from fibrefit.core.roles import SLACK
from fibrefit.problem.diagnose.phases import Motion
from fibrefit.problem.task import Task
from fibrefit.rigs.rig import STANDARD_GRAVITY
from fibrefit.rigs.signals.motion import integrated

POSITION = "position"
EDGE = 0.1
"""Share of a flight at either end that is left out: the simulated instants of contact are off where the model is."""
SHORTEST = 8
"""Samples of the shortest flight that has a curvature."""
RESOLVED = 1e-4
"""Smallest singular value over the largest below which gravity and friction are not told apart: flights one way."""


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
    """One flight: its record, its samples that count, what is left of their positions, and what may be left there."""

    record: int
    samples: np.ndarray
    left: np.ndarray
    shapes: np.ndarray


def gravity_in_flight(task: Task, values: np.ndarray, motion: Motion) -> Gravity | None:
    """Gravity by the positions measured while the fibre is slack; None where no weight flies in both directions.

    Parameters
    ----------
    task : Task
    values : (n_free,) in SI units
    motion : Motion
        At these values.

    Law
    ---
    What is left of the positions of a flight is ``a + b t + δ g t² / 2 + (f ∬ sign(v) + c ∫ v) / m``: another start,
    another gravity, and friction other than the model's, constant or growing with the speed. Least squares; the error
    is that of noise with the spectrum of the rests, or as loud as what is left here where that is louder.
    """
    rig = task.problem.model.rig
    if Capability.FALL not in rig.capabilities or POSITION not in rig.channels:
        return None
    flights = list(_flights(task, values, motion))
    if not flights:
        return None
    shapes = np.concatenate([flight.shapes for flight in flights])
    missing = np.concatenate([flight.left for flight in flights])
    scale = np.maximum(np.linalg.norm(shapes, axis=0), np.finfo(float).tiny)
    left, size, right = np.linalg.svd(shapes / scale, full_matrices=False)
    if not size[-1] > RESOLVED * size[0]:
        return None
    weights = left @ (right[:, 0] / size) / scale[0]
    rest = missing - left @ (left.T @ missing)
    return Gravity(float(weights @ missing), _error(task, flights, weights, rest))


def _flights(task: Task, values: np.ndarray, motion: Motion) -> Iterator[_Flight]:
    data = task.problem.observations
    local = np.asarray(task.problem.layout.local(jnp.asarray(values)))
    counted = np.asarray(data.weight[POSITION]) > 0.0
    missing = np.asarray(data.measured[POSITION]) - np.asarray(motion.readings[POSITION])
    for r, trace in enumerate(task.traces):
        stated = {**trace.conditions, **dict(zip(task.problem.layout.names, local[r], strict=True))}
        mass, gravity = stated["weight_mass"] + stated["added_mass"], STANDARD_GRAVITY * np.sin(stated["inclination"])
        for start, end in _slack(motion.phase[r, : len(trace.times)]):
            inside = np.arange(start, end)
            seen = counted[r, inside]
            time = trace.step * (inside - inside.mean())
            speed = motion.states["speed"][r, inside]
            turned = integrated(integrated(np.sign(speed), trace.step), trace.step)
            path = integrated(motion.states["position"][r, inside], trace.step)
            shapes = [missing[r, inside], 0.5 * gravity * time**2, turned / mass, path / mass]
            line, _ = np.linalg.qr(np.column_stack([np.ones_like(time), time])[seen])
            left, *shapes = (shape[seen] - line @ (line.T @ shape[seen]) for shape in shapes)
            yield _Flight(r, inside[seen], left, np.column_stack(shapes))


def _slack(phase: np.ndarray) -> list[tuple[int, int]]:
    """First sample of each flight and the one after its last, without its ends."""
    edges = np.diff((phase == SLACK).astype(int), prepend=0, append=0)
    found = []
    for start, end in zip(np.flatnonzero(edges > 0), np.flatnonzero(edges < 0), strict=True):
        cut = round(EDGE * (end - start))
        if end - start - 2 * cut >= SHORTEST:
            found.append((int(start) + cut, int(end) - cut))
    return found


def _error(task: Task, flights: list[_Flight], weights: np.ndarray, rest: np.ndarray) -> float:
    noise, variance, place = task.noise[POSITION], 0.0, 0
    for r, trace in enumerate(task.traces):
        of_record = np.zeros(len(trace.times))
        for flight in flights:
            if flight.record == r:
                of_record[flight.samples] = weights[place : place + len(flight.samples)]
                place += len(flight.samples)
        variance += noise.variance_of_sum(of_record, trace.rate)
    longest = max(len(flight.samples) for flight in flights)
    rate = task.traces[0].rate
    louder = float(np.sqrt(np.mean(rest**2))) / noise.rms(longest / rate, rate)
    return float(np.sqrt(variance)) * max(1.0, louder)
