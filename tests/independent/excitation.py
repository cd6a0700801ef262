"""What the drive of the pulley rig does: shapes with finite acceleration."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np


@dataclass(frozen=True)
class Excitation:
    """Motion of the drive.

    Parameters
    ----------
    shape : "trapezoid", "rectangle" (a trapezoid as steep as the drive can) or "quasi_sine"
    amplitude : m
    rate : m/s, greatest speed
    lead : s at rest before it starts
    hold : s at either end of a trapezoid
    acceleration : m/s^2 of a trapezoid's corners
    ramps : number of ramps of a trapezoid, up and down in turn; after the last one the drive stays where it is
    """

    shape: str = "trapezoid"
    amplitude: float = 0.06
    rate: float = 0.25
    lead: float = 0.3
    hold: float = 0.6
    acceleration: float = 8.0
    ramps: int = 3

    @property
    def ramp(self) -> float:
        """Time from one end to the other."""
        if self.acceleration * self.amplitude < self.rate**2:
            return 2.0 * math.sqrt(self.amplitude / self.acceleration)
        return self.amplitude / self.rate + self.rate / self.acceleration

    def motion(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Position and velocity at `times`."""
        if self.shape == "quasi_sine":
            return self._sine(times - self.lead)
        return self._steps(times - self.lead)

    def _sine(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        turn = 2.0 * self.rate / self.amplitude
        period = 2.0 * math.pi / turn
        # Whole periods only, so that the drive ends at rest.
        t = np.clip(t, 0.0, math.floor(t[-1] / period) * period)
        return 0.5 * self.amplitude * (1.0 - np.cos(turn * t)), 0.5 * self.amplitude * turn * np.sin(turn * t)

    def _steps(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        position, velocity = np.zeros(t.size), np.zeros(t.size)
        for i in range(self.ramps):
            gone, rate = self._ramp_at(t - i * (self.ramp + self.hold))
            position += gone if i % 2 == 0 else -gone
            velocity += rate if i % 2 == 0 else -rate
        return position, velocity

    def _ramp_at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        t = np.clip(t, 0.0, self.ramp)
        late = self.ramp - t
        corner = min(self.rate / self.acceleration, 0.5 * self.ramp)
        early = np.minimum(t, late)
        gone = np.where(
            early < corner,
            0.5 * self.acceleration * early**2,
            0.5 * self.acceleration * corner**2 + self.acceleration * corner * (early - corner),
        )
        return np.where(t <= late, gone, self.amplitude - gone), self.acceleration * np.minimum(early, corner)


@lru_cache(maxsize=24)
def fine_motion(excitation: Excitation, step: float, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Motion at the middle of each of `n` steps; kept, since series of one kind share their excitations."""
    position, velocity = excitation.motion((np.arange(n) + 0.5) * step)
    position.setflags(write=False)
    velocity.setflags(write=False)
    return position, velocity
