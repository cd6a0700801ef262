"""The posterior as one writes it without this program: SciPy's LSODA from event to event, one process a core.

Free of JAX, so that worker processes start quickly and fork is safe.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

GRAVITY = 9.81
RELATIVE, ABSOLUTE = 1e-8, 1e-10


@dataclass(frozen=True)
class Record:
    """One record of a drop, SI units."""

    times: np.ndarray
    force: np.ndarray
    position: np.ndarray
    mass: float
    inclination: float
    lift: float


def readings(record: Record, k: float, b: float, friction: float, release: float) -> tuple[np.ndarray, np.ndarray]:
    """Force and position at the record's samples."""
    pull = record.mass * GRAVITY * np.sin(record.inclination)
    times = record.times
    position, force = np.full(len(times), -record.lift), np.zeros(len(times))
    y, taut, direction, now = np.array([-record.lift, 0.0]), False, 1, release
    while now < times[-1]:

        def rate(_t: float, y: np.ndarray, taut: bool = taut, direction: int = direction) -> list[float]:
            if direction == 0:
                return [0.0, 0.0]
            tension = k * y[0] + b * y[1] if taut else 0.0
            return [y[1], (pull - tension - direction * friction) / record.mass]

        def load(_t: float, y: np.ndarray, taut: bool = taut) -> float:
            return min(y[0], y[0] + b * y[1] / k) * (1 if taut else -1)

        def slide(_t: float, y: np.ndarray, taut: bool = taut, direction: int = direction) -> float:
            if direction:
                return direction * y[1]
            return friction - abs(pull - (k * y[0] + b * y[1] if taut else 0.0))

        load.terminal = slide.terminal = True
        load.direction = slide.direction = -1
        inside = (times > now) & (times <= times[-1])
        found = solve_ivp(
            rate, (now, times[-1]), y, "LSODA", t_eval=times[inside], events=[load, slide], rtol=RELATIVE, atol=ABSOLUTE
        )
        at = np.searchsorted(times, found.t)
        position[at] = found.y[0]
        force[at] = k * found.y[0] + b * found.y[1] if taut else 0.0
        if found.status != 1:
            break
        event = 0 if found.t_events[0].size else 1
        y, now = found.y_events[event][0].copy(), found.t_events[event][0]
        if event == 0:
            taut = not taut
        else:
            y[1] = 0.0
            net = pull - (k * y[0] + b * y[1] if taut else 0.0)
            direction = int(np.sign(net)) if abs(net) > friction else 0
            if direction == 0:
                rest = times > now
                position[rest], force[rest] = y[0], k * y[0] if taut else 0.0
                break
    return force, position


RECORDS: list[Record] = []
NOISE = (0.4, 2e-5)


def log_density(point: np.ndarray) -> float:
    """White log likelihood of the logarithms of stiffness, damping, friction, then zero and release of each record."""
    k, b, friction = np.exp(point[:3])
    total = 0.0
    for record, (zero, release) in zip(RECORDS, point[3:].reshape(-1, 2), strict=True):
        force, position = readings(record, k, b, friction, release)
        total += np.sum(((force - record.force) / NOISE[0]) ** 2)
        total += np.sum(((position + zero - record.position) / NOISE[1]) ** 2)
    return -0.5 * float(total)


def receive(records: list[Record]) -> None:
    """Give a worker process its records."""
    RECORDS[:] = records
