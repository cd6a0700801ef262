"""One step of a system in one mode: smooth, of fixed length, without switches.

Where rates are slow against the step it is the classical Runge-Kutta step; else a stiffly stable one, in which rates
far above the inverse of its length die out, as they do in nature, and do not ring.

Law
---
Rosenbrock's method with six stages, of order 4, L-stable and stiffly accurate. Each stage is a linear equation with one
matrix, ``1 - γ h J``. States are scalars and the elimination is written out, so that a loop over steps stays one
function.

Source
------
Hairer and Wanner, Solving Ordinary Differential Equations II (1996), section IV.7: the method RODAS.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import jax
import jax.extend.core as jex
import jax.numpy as jnp

from fibrefit.simulation.inputs import inputs_at

State = Any
Mode = Any
Scalars = list[jax.Array]
Row = list[Any]
Function = Callable[[jax.Array, Scalars], Scalars]

GAMMA = 0.25
NODES = (0.0, 0.386, 0.21, 0.63, 1.0, 1.0)
"""Instant of each stage, in steps."""
SLOPES = (0.25, -0.1043, 0.1035, -0.0362, 0.0, 0.0)
"""Share of the explicit dependence on time in each stage."""
POINTS: tuple[tuple[float, ...], ...] = (
    (),
    (1.544,),
    (0.9466785280815826, 0.2557011698983284),
    (3.314825187068521, 2.896124015972201, 0.9986419139977817),
    (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950),
    (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1.0),
)
"""Weights of the earlier stages in the point at which the rate is taken; with one more of 1, those of the result."""
COUPLINGS: tuple[tuple[float, ...], ...] = (
    (),
    (-5.6688,),
    (-2.430093356833875, -0.2063599157091915),
    (-0.1073529058151375, -9.594562251023355, -20.47028614809616),
    (7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160),
    (8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054),
)
"""Weights of the earlier stages on the right side, per step length."""


class System(Protocol):
    """What the integrator needs to know of a mechanical system.

    A system is a pytree whose leaves are its parameter values; states are pytrees of scalars, a mode is a pytree of
    integer scalars, one for each switch.
    """

    def derivative(self, state: State, mode: Mode, inputs: Any) -> State:
        """Rate of the state while the mode lasts."""

    def margins(self, state: State, mode: Mode, inputs: Any) -> Mode:
        """One number for each switch, in the place of its mode; negative where that no longer holds."""

    def switch(self, state: State, mode: Mode, crossed: Mode, inputs: Any) -> tuple[State, Mode]:
        """State and mode after the switches `crossed` have left their modes."""

    def stiff(self) -> jax.Array | None:
        """Whether rates occur that are fast against a step of the grid; None if there never are any."""


def plus(state: State, factor: jax.Array, rate: State) -> State:
    """``state + factor * rate``."""
    return jax.tree.map(lambda y, d: y + factor * d, state, rate)


def explicit(system: System, state: State, mode: Mode, inputs: Any, times: jax.Array, arc: Any) -> State:
    """As `flow`, for a system whose rates are slow against the step: the classical fourth-order step."""
    step, start, end = arc
    first, middle, last = (inputs_at(inputs, times, step, time) for time in (start, 0.5 * (start + end), end))
    length = end - start
    d1 = system.derivative(state, mode, first)
    d2 = system.derivative(plus(state, 0.5 * length, d1), mode, middle)
    d3 = system.derivative(plus(state, 0.5 * length, d2), mode, middle)
    d4 = system.derivative(plus(state, length, d3), mode, last)
    return jax.tree.map(lambda y, a, b, c, d: y + (length / 6.0) * (a + 2.0 * (b + c) + d), state, d1, d2, d3, d4)


def stiff(system: System, state: State, mode: Mode, inputs: Any, times: jax.Array, arc: Any) -> State:
    """As `flow`, whatever the rates of the system."""
    step, start, end = arc
    leaves, tree = jax.tree.flatten(state)

    def rate(time: jax.Array, leaves: list[jax.Array]) -> list[jax.Array]:
        here = inputs_at(inputs, times, step, time)
        return jax.tree.leaves(system.derivative(jax.tree.unflatten(tree, leaves), mode, here))

    return jax.tree.unflatten(tree, rosenbrock(rate, leaves, start, end - start))


def flow(system: System, state: State, mode: Mode, inputs: Any, times: jax.Array, arc: Any) -> State:
    """State after the arc ``(step, start, end)``: one smooth step inside one mode, within one step of the grid."""
    whole = (system, state, mode, inputs, times, arc)
    if (is_stiff := system.stiff()) is None:
        return explicit(*whole)
    return jax.lax.cond(is_stiff, lambda: stiff(*whole), lambda: explicit(*whole))


def rosenbrock(rate: Function, state: Scalars, start: jax.Array, length: jax.Array) -> Scalars:
    """One step.

    Parameters
    ----------
    rate : callable ``(time, state) -> rates``
    start, length : () in s
        The length may be zero.

    Returns
    -------
    list of ()
        State at ``start + length``.
    """
    first, by_time, rows = _slopes(rate, start, state)
    factors = eliminate(rows, GAMMA * length)
    stages: list[Scalars] = []
    for node, slope, points, couplings in zip(NODES, SLOPES, POINTS, COUPLINGS, strict=True):
        point = _combine(state, points, stages)
        right = [length * r for r in (rate(start + node * length, point) if stages else first)]
        if slope:
            right = [r if t is None else r + slope * length**2 * t for r, t in zip(right, by_time, strict=True)]
        stages.append(substitute(factors, [GAMMA * r for r in _combine(right, couplings, stages)]))
    return _combine(state, (*POINTS[-1], 1.0), stages)


def _slopes(rate: Function, time: jax.Array, state: Scalars) -> tuple[Scalars, Row, list[Row]]:
    """Rates, their explicit dependence on time, and rows of their derivatives by the states.

    None where there is none, whatever the values.
    """
    enters, size = reach(rate, time, state), len(state)

    def along(direction: jax.Array) -> tuple[Scalars, Scalars]:
        return jax.jvp(rate, (time, state), (direction[0], list(direction[1:])))

    # All directions in one go: the program is that of one.
    rates, slopes = jax.vmap(along, out_axes=(None, 0))(jnp.eye(1 + size))
    entries = [[slope[i] if j in enters[i] else None for i in range(1 + size)] for j, slope in enumerate(slopes)]
    return rates, [row[0] for row in entries], [row[1:] for row in entries]


def reach(rate: Function, time: jax.Array, state: Scalars) -> list[set[int]]:
    """Numbers of the rates that time and each state enter, read off the program."""
    program = jax.make_jaxpr(rate)(time, state).jaxpr
    enters: dict[Any, set[int]] = {variable: {i} for i, variable in enumerate(program.invars)}
    for equation in program.eqns:
        sources = [enters.get(v, set()) for v in equation.invars if not isinstance(v, jex.Literal)]
        enters |= {variable: set().union(*sources) for variable in equation.outvars}
    results = [set() if isinstance(v, jex.Literal) else enters.get(v, set()) for v in program.outvars]
    return [{j for j, sources in enumerate(results) if i in sources} for i in range(1 + len(state))]


def _combine(base: Scalars, weights: tuple[float, ...], stages: list[Scalars]) -> Scalars:
    for weight, stage in zip(weights, stages, strict=True):
        base = [b + weight * s for b, s in zip(base, stage, strict=True)]
    return base


def eliminate(rows: list[Row], scale: jax.Array) -> list[Row]:
    """Triangular factors of ``1 - scale · rows``, row by row; None stands for an entry that is zero.

    No pivoting: in a system that loses energy the diagonal grows.
    """
    size = len(rows)
    factors: list[Row] = [
        [_plus(1.0 if i == j else None, None if entry is None else -scale * entry) for j, entry in enumerate(row)]
        for i, row in enumerate(rows)
    ]
    for k in range(size):
        for i in range(k + 1, size):
            if factors[i][k] is None:
                continue
            factors[i][k] = factors[i][k] / factors[k][k]
            for j in range(k + 1, size):
                if factors[k][j] is not None:
                    factors[i][j] = _plus(factors[i][j], -factors[i][k] * factors[k][j])
    return factors


def substitute(factors: list[Row], right: Scalars) -> Scalars:
    """Solution for one right side."""
    size = len(right)
    x = list(right)
    for i in range(size):
        for j in range(i):
            if factors[i][j] is not None:
                x[i] = x[i] - factors[i][j] * x[j]
    for i in reversed(range(size)):
        for j in range(i + 1, size):
            if factors[i][j] is not None:
                x[i] = x[i] - factors[i][j] * x[j]
        x[i] = x[i] / factors[i][i]
    return x


def _plus(one: Any, other: Any) -> Any:
    if one is None or other is None:
        return other if one is None else one
    return one + other
