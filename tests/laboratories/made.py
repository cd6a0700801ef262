"""Records of rigs of other laboratories, integrated by SciPy: nothing of it is shared with the program."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

GRAVITY = 9.81
PENDULUM = {"length": 0.31, "damping": 0.012, "friction": 0.03}
"""Equivalent length in m; damping and friction over the inertia, in 1/s and 1/s^2."""
CART = {"mass": 1.9, "stiffness": 420.0, "zero": 0.012, "viscous": 3.1, "friction": 0.7}


def sign_switched(
    rate: Callable[[float, np.ndarray, float], np.ndarray], start: np.ndarray, times: np.ndarray, held: Callable
) -> np.ndarray:
    """A motion with dry friction, cut at each standstill: state ``(n_time, 2)`` of ``y' = rate(t, y, direction)``.

    `held` says of an instant and a place what the other forces come to over the level of the friction.
    """
    y, now = np.array(start, dtype=float), float(times[0])
    rows = np.empty((len(times), 2))
    rows[0], filled = y, 1
    direction = np.sign(y[1]) or _set_off(held(now, y[0]))
    while filled < len(times):
        if direction == 0.0:
            rows[filled], now = (y[0], 0.0), float(times[filled])
            filled, direction = filled + 1, _set_off(held(now, y[0]))
            continue

        def standstill(t: float, y: np.ndarray, direction: float) -> float:
            return float(y[1])

        standstill.terminal, standstill.direction = True, -direction  # type: ignore[attr-defined]
        ahead = times[filled:]
        begun = y + np.array([0.0, 1e-9 * direction])
        way = {"t_eval": ahead, "rtol": 1e-9, "atol": 1e-12, "max_step": 0.05}
        done = solve_ivp(rate, (now, times[-1]), begun, args=(direction,), events=standstill, **way)
        count = len(done.t)
        rows[filled : filled + count], filled = done.y.T, filled + count
        if done.status != 1:
            break
        now, y = float(done.t_events[0][0]), done.y_events[0][0] * np.array([1.0, 0.0])
        direction = _set_off(held(now, y[0]))
    return rows


def _set_off(force: float) -> float:
    """Direction in which a force over the level of the friction sets off what stands; nought where it stays."""
    return float(np.sign(force)) if abs(force) > 1.0 else 0.0


def pendulum(seconds: float = 20.0, rate: float = 100.0, start: float = 0.6, drag: float = 0.0) -> np.ndarray:
    """Time and angle of a pendulum that is let go, ``(n_time, 2)``."""
    pull, c, f = GRAVITY / PENDULUM["length"], PENDULUM["damping"], PENDULUM["friction"]

    def turning(t: float, y: np.ndarray, direction: float) -> np.ndarray:
        return np.array([y[1], -pull * np.sin(y[0]) - c * y[1] - drag * y[1] * abs(y[1]) - f * direction])

    times = np.arange(round(seconds * rate) + 1) / rate
    motion = sign_switched(turning, np.array([start, 0.0]), times, lambda t, angle: -pull * np.sin(angle) / f)
    return np.column_stack([times, motion[:, 0]])


def cart(
    seconds: float, rate: float, drive: Callable[[float], float], start: tuple[float, float], added: float = 0.0
) -> np.ndarray:
    """Time, driving force and position of a cart on a spring, ``(n_time, 3)``."""
    mass, k, u0, c, f = CART["mass"] + added, CART["stiffness"], CART["zero"], CART["viscous"], CART["friction"]

    def moving(t: float, y: np.ndarray, direction: float) -> np.ndarray:
        return np.array([y[1], (drive(t) - k * (y[0] - u0) - c * y[1] - f * direction) / mass])

    times = np.arange(round(seconds * rate) + 1) / rate
    motion = sign_switched(moving, np.array(start), times, lambda t, place: (drive(t) - k * (place - u0)) / f)
    return np.column_stack([times, [drive(t) for t in times], motion[:, 0]])


def write(path: Path, head: str, rows: np.ndarray, digits: str = "%.9g") -> None:
    """A table with its header."""
    np.savetxt(path, rows, delimiter=",", header=head, comments="", fmt=digits)


def study(folder: Path, text: str) -> Path:
    """A study file with the first lines that all have."""
    path = folder / "study.toml"
    path.write_text(f'schema = "fibrefit/study/1"\nname = "made"\n{text}', encoding="utf-8")
    return path
