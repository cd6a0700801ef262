"""The drop rig's base model with sensors, solved by SciPy from event to event: slow, exact, and nothing in common."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

GRAVITY = 9.81


@dataclass(frozen=True)
class Drop:
    """Weight that falls on a fibre; the gauge adds a lag and a resonance, a lag of zero is left out."""

    stiffness: float = 20e3
    damping: float = 25.0
    friction: float = 4.0
    mass: float = 3.096
    lift: float = 0.012
    lag: float = 0.0
    period: float = 0.0
    damping_ratio: float = 0.05

    def tension(self, y: np.ndarray, taut: bool) -> float:
        return self.stiffness * y[0] + self.damping * y[1] if taut else 0.0

    def rate(self, y: np.ndarray, taut: bool, direction: int) -> list[float]:
        force = self.tension(y, taut)
        moving = direction != 0
        net = self.mass * GRAVITY - force - direction * self.friction
        gauge = self.period / (2.0 * np.pi)
        ring = (force - y[3] - 2.0 * self.damping_ratio * gauge * y[4]) / gauge**2 if gauge else 0.0
        felt = y[3] if gauge else force
        slow = (felt - y[2]) / self.lag if self.lag else 0.0
        return [moving * y[1], moving * net / self.mass, slow, y[4], ring]

    def events(self, taut: bool, direction: int) -> list:
        def load(_t: float, y: np.ndarray) -> float:
            return min(y[0], self.tension(y, True) / self.stiffness) * (1 if taut else -1)

        def slide(_t: float, y: np.ndarray) -> float:
            if direction:
                return direction * y[1]
            return self.friction - abs(self.mass * GRAVITY - self.tension(y, taut))

        for event in (load, slide):
            event.terminal, event.direction = True, -1
        return [load, slide]

    def settle(self, y: np.ndarray, taut: bool) -> int:
        net = self.mass * GRAVITY - self.tension(y, taut)
        return int(np.sign(net)) if abs(net) > self.friction else 0

    def reading(self, times: np.ndarray, late_by: float = 0.0) -> np.ndarray:
        """Force after the sensors at `times` - `late_by`, zero before the release at t = 0."""
        instants = times - late_by
        force = np.zeros(times.shape)
        y, taut, direction, now = np.array([-self.lift, 0.0, 0.0, 0.0, 0.0]), False, 1, 0.0
        end = instants[-1]
        while now < end:
            found = solve_ivp(
                lambda _t, y, taut=taut, direction=direction: self.rate(y, taut, direction),
                (now, end), y, events=self.events(taut, direction), dense_output=True,
                method="DOP853", rtol=1e-11, atol=1e-13, max_step=2e-3,
            )  # fmt: skip
            inside = (instants >= now) & (instants <= found.t[-1])
            if inside.any():
                states = found.sol(instants[inside])
                plain = self.stiffness * states[0] + self.damping * states[1] if taut else np.zeros(states.shape[1])
                force[inside] = states[2] if self.lag else states[3] if self.period else plain
            y, now = found.y[:, -1].copy(), found.t[-1]
            if found.status != 1:
                break
            if found.t_events[0].size:
                taut = not taut
            else:
                y[1] = 0.0
                direction = self.settle(y, taut)
        return force
