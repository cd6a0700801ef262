"""The same fit with the tools at hand: SciPy with located events, and lmfit on odeint.

Each solves the problem of `problem.Fit`: stiffness, damping and friction of all records, zero of position and release
of each, residuals of force and position over their noise.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.integrate import odeint, solve_ivp
from scipy.optimize import least_squares
from scipy.sparse import csr_array

from tests.benchmarks.problem import Drop, Fit

RELATIVE, ABSOLUTE = 1e-6, 1e-8
"""Tolerances of the integrator at which its readings are as close to the truth as ours are (see the table)."""
DIFFERENCE = 1e-4
"""Relative step of finite differences: far above what the integrator leaves, far below what bends the residuals."""
CREEP = 1e-7
"""Speed, m/s, over which regularised friction comes up where a program knows no sticking; the error grows with it."""
MOST_SWITCHES = 2000

Simulate = Callable[[Drop, np.ndarray], tuple[np.ndarray, np.ndarray]]


def simulate_events(record: Drop, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Force and position by LSODA from switch to switch; `values`: stiffness, damping, friction, zero, release."""
    k, b, friction, zero, release = values
    times, n = record.times, record.times.size
    force, position = np.zeros(n), np.full(n, -record.lift)
    state, now, taut = [-record.lift, 0.0], release, False
    direction = _settled(state, taut, k, b, friction, record.pull)
    at, end = int(np.searchsorted(times, release, side="right")), times[-1]
    for _ in range(MOST_SWITCHES):
        if direction == 0:
            force[at:], position[at:] = (k * state[0] if taut else 0.0), state[0]
            break
        found = _arc(record, state, (now, end), times[at:], taut, direction, (k, b, friction))
        got = len(found.t)
        if got:  # of an arc between two samples SciPy gives lists of nothing
            position[at : at + got] = found.y[0]
            force[at : at + got] = k * found.y[0] + b * found.y[1] if taut else 0.0
        at += got
        if found.status == 0:
            break
        which = next(i for i, instants in enumerate(found.t_events) if instants.size)
        now, state = float(found.t_events[which][0]), list(found.y_events[which][0])
        if which == 0:
            state[1] = 0.0
            direction = _settled(state, taut, k, b, friction, record.pull)
        else:
            taut = not taut
    return force, position + zero


def _arc(record: Drop, state: list, span: tuple, times: np.ndarray, taut: bool, direction: int, laws: tuple):
    k, b, friction = laws
    rest, stiff, damp = (record.pull - direction * friction) / record.mass, k / record.mass, b / record.mass
    if taut:

        def rate(t, y):
            return (y[1], rest - stiff * y[0] - damp * y[1])

        events = [_stops(direction), _falls(lambda y: y[0]), _falls(lambda y: k * y[0] + b * y[1])]
    else:

        def rate(t, y):
            return (y[1], rest)

        events = [_stops(direction), _rises(lambda y: y[0])]
    return solve_ivp(
        rate, span, state, method="LSODA", t_eval=times, events=events, rtol=RELATIVE, atol=ABSOLUTE, dense_output=False
    )


def _settled(state: list, taut: bool, k: float, b: float, friction: float, pull: float) -> int:
    net = pull - (k * state[0] + b * state[1] if taut else 0.0)
    return 0 if abs(net) <= friction else int(math.copysign(1, net))


def _event(function: Callable, direction: float) -> Callable:
    def event(t, y):
        return function(y)

    event.terminal, event.direction = True, direction
    return event


def _falls(function: Callable) -> Callable:
    return _event(function, -1.0)


def _rises(function: Callable) -> Callable:
    return _event(function, 1.0)


def _stops(direction: int) -> Callable:
    return _falls(lambda y: direction * y[1])


def simulate_smooth(record: Drop, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Force and position by odeint, which knows no events: friction regularised, corners stepped over."""
    k, b, friction, zero, release = values
    times, mass, pull = record.times, record.mass, record.pull

    def rate(y, t):
        load = k * y[0] + b * y[1]
        tension = load if y[0] > 0.0 and load > 0.0 else 0.0
        return (y[1], (pull - tension - friction * math.tanh(y[1] / CREEP)) / mass)

    at = int(np.searchsorted(times, release, side="right"))
    grid = np.concatenate([[release], times[at:]])
    motion = odeint(rate, (-record.lift, 0.0), grid, rtol=RELATIVE, atol=ABSOLUTE, hmax=times[1] - times[0])
    position = np.concatenate([np.full(at, -record.lift), motion[1:, 0]])
    load = k * motion[1:, 0] + b * motion[1:, 1]
    tension = np.where((motion[1:, 0] > 0.0) & (load > 0.0), load, 0.0)
    return np.concatenate([np.zeros(at), tension]), position + zero


def residuals(fit: Fit, values: np.ndarray, simulate: Simulate) -> np.ndarray:
    """All residuals over their noise."""
    parts = []
    for r, record in enumerate(fit.records):
        force, position = simulate(record, np.concatenate([values[:3], values[3 + 2 * r : 5 + 2 * r]]))
        parts.append((force - record.force) * record.force_weight)
        parts.append((position - record.position) * record.position_weight)
    return np.nan_to_num(np.concatenate(parts))


def touched(fit: Fit) -> np.ndarray:
    """Which residuals depend on which parameter: the own ones of a record on that record's only."""
    sizes = [2 * record.times.size for record in fit.records]
    pattern = np.zeros((sum(sizes), fit.start.size), dtype=bool)
    pattern[:, :3] = True
    for r, end in enumerate(np.cumsum(sizes)):
        pattern[end - sizes[r] : end, 3 + 2 * r : 5 + 2 * r] = True
    return pattern


def fit_scipy(fit: Fit, sparse: bool = False) -> np.ndarray:
    """`least_squares` with finite differences of LSODA with events; `sparse`: told what `touched` knows."""
    low = np.concatenate([[10.0, 0.0, 0.0], np.full(2 * len(fit.records), -np.inf)])
    found = least_squares(
        lambda scaled: residuals(fit, scaled * fit.scale, simulate_events),
        fit.start / fit.scale,
        bounds=(low / fit.scale, np.inf),
        diff_step=DIFFERENCE,
        x_scale=1.0,
        jac_sparsity=csr_array(touched(fit)) if sparse else None,
        ftol=1e-8,
        xtol=1e-8,
    )
    return found.x * fit.scale


def fit_lmfit(fit: Fit) -> np.ndarray:
    """lmfit's Levenberg-Marquardt with finite differences of odeint."""
    import lmfit

    parameters = lmfit.Parameters()
    for i, value in enumerate(fit.start / fit.scale):
        parameters.add(f"p{i}", value=value, **({"min": 0.0} if i < 3 else {}))

    def away(given: lmfit.Parameters) -> np.ndarray:
        values = np.array([given[f"p{i}"].value for i in range(fit.start.size)])
        return residuals(fit, values * fit.scale, simulate_smooth)

    found = lmfit.minimize(away, parameters, method="leastsq", epsfcn=DIFFERENCE**2, ftol=1e-8, xtol=1e-8)
    return np.array([found.params[f"p{i}"].value for i in range(fit.start.size)]) * fit.scale
