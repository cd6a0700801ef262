"""Movements of the drive: rectangular, trapezoidal and quasi-sinusoidal, as fast as a drive of finite force allows."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import count
from typing import Literal

import numpy as np

from fibrefit.core.errors import UsageError

Shape = Literal["rectangle", "trapezoid", "quasi_sine"]

#: Greatest acceleration of the drive at the corners of a shape, in m/s^2, where none is given.
ACCELERATIONS = {"rectangle": 40.0, "trapezoid": 8.0, "quasi_sine": math.inf}


@dataclass(frozen=True)
class Excitation:
    """A movement that goes on until the record ends, unless its cycles are counted.

    Law
    ---
    Rectangle and trapezoid: up by the amplitude, hold, down, hold, and so on, at the rate given, with parabolic
    corners; a rectangle's are steeper. Quasi-sine: whole cycles of ``A/2 (1 - cos ω t)``, ``ω = 2 rate/A``, from rest.

    Parameters
    ----------
    shape : {"rectangle", "trapezoid", "quasi_sine"}
    amplitude : float in m
    rate : float in m/s
        Greatest speed.
    lead : float in s
        Time at rest before the movement.
    hold : float in s
        Time at rest at either end of a rectangle or trapezoid.
    acceleration : float in m/s^2, optional
        Of the corners.
    cycles : int, optional
        Number of times up and down.

    Raises
    ------
    UsageError
        Where a number is not positive, or a time negative.
    """

    shape: Shape
    amplitude: float
    rate: float
    lead: float = 0.3
    hold: float = 0.6
    acceleration: float | None = None
    cycles: int | None = None

    def __post_init__(self) -> None:
        if self.shape not in ACCELERATIONS:
            raise UsageError("excitation", f'shape "{self.shape}"', " or ".join(ACCELERATIONS))
        for name in ("amplitude", "rate", "acceleration"):
            value = getattr(self, name)
            if value is not None and not value > 0.0:
                raise UsageError(f"{name} of the excitation", f"{value}", "a positive number")
        for name in ("lead", "hold"):
            if not getattr(self, name) >= 0.0:
                raise UsageError(f"{name} of the excitation", f"{getattr(self, name)}", "a number that is not negative")

    def motion(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Position and rate of the drive.

        Parameters
        ----------
        times : (n_time,) in s
            From the start of the record.

        Returns
        -------
        position, rate : (n_time,) in m, (n_time,) in m/s
        """
        since = np.asarray(times, dtype=float) - self.lead
        if self.shape == "quasi_sine":
            omega = 2.0 * self.rate / self.amplitude
            period = 2.0 * math.pi / omega
            turns = math.floor(max(since[-1], 0.0) / period) if self.cycles is None else self.cycles
            angle = omega * np.clip(since, 0.0, turns * period)
            half = 0.5 * self.amplitude
            return half * (1.0 - np.cos(angle)), half * omega * np.sin(angle)
        # Pieces of constant acceleration, one after the other.
        acceleration = self.acceleration or ACCELERATIONS[self.shape]
        corner = min(self.rate / acceleration, math.sqrt(self.amplitude / acceleration))
        cruise = self.amplitude / (acceleration * corner) - corner
        starts, rows = [-math.inf], [(0.0, 0.0, 0.0)]
        now, position, rate = 0.0, 0.0, 0.0
        for leg in count():
            if now > since[-1] or (self.cycles is not None and leg == 2 * self.cycles):
                break
            up = -1.0 if leg % 2 else 1.0
            pieces = ((corner, up * acceleration), (cruise, 0.0), (corner, -up * acceleration), (self.hold, 0.0))
            for length, bend in pieces:
                starts.append(now)
                rows.append((position, rate, bend))
                position += length * (rate + 0.5 * length * bend)
                rate += length * bend
                now += length
        starts.append(now)
        rows.append((position, rate, 0.0))
        row = np.searchsorted(starts, since, side="right") - 1
        begin = np.where(np.isfinite(starts), starts, 0.0)[row]
        x, v, a = np.array(rows)[row].T
        t = since - begin
        return np.where(row > 0, x + t * (v + 0.5 * t * a), 0.0), np.where(row > 0, v + t * a, 0.0)
