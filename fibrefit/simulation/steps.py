"""One step of a system in one mode: smooth, of fixed length, without switches."""

from __future__ import annotations

from typing import Any, Protocol

import jax

from fibrefit.simulation.inputs import inputs_at
from fibrefit.simulation.rosenbrock import rosenbrock

State = Any
Mode = Any


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


def runge_kutta(system: System, state: State, mode: Mode, span: Any, length: jax.Array) -> State:
    """Classical fourth-order step of `length` [s]; `span` gives the inputs at its start, middle and end."""
    first, middle, last = span
    d1 = system.derivative(state, mode, first)
    d2 = system.derivative(plus(state, 0.5 * length, d1), mode, middle)
    d3 = system.derivative(plus(state, 0.5 * length, d2), mode, middle)
    d4 = system.derivative(plus(state, length, d3), mode, last)
    return jax.tree.map(lambda y, a, b, c, d: y + (length / 6.0) * (a + 2.0 * (b + c) + d), state, d1, d2, d3, d4)


def explicit(system: System, state: State, mode: Mode, inputs: Any, times: jax.Array, arc: Any) -> State:
    """As `flow`, for a system whose rates are slow against the step."""
    step, start, end = arc
    span = tuple(inputs_at(inputs, times, step, time) for time in (start, 0.5 * (start + end), end))
    return runge_kutta(system, state, mode, span, end - start)


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
