"""From what the sensors feel to what the logger writes: gauge dynamics and delay, then gains and offsets.

A force gauge and its amplifier are linear: a sum of first-order lags, complex ones for a gauge that rings. Each lag is
solved exactly on every piece of the force, which is a cubic there; nothing is lost at a snap inside a step.

A tension jumps where a fibre goes taut or slack, somewhere inside a step of the grid: one that goes taut at speed bears
its damping force at once. The pieces end there, so that what follows, a filter or a delay, meets a smooth quantity on
each of them.
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from fibrefit.laws.law import Effect, SensorLaw
from fibrefit.simulation.inputs import inputs_at
from fibrefit.simulation.steps import Mode, State, System
from fibrefit.simulation.switched import ARCS, Inputs, Solution, take

Cubic = tuple[jax.Array, ...]
Observe = Callable[[State, Mode, Any], jax.Array]
ObserveAll = Callable[[State, Mode, Any], dict[str, jax.Array]]
Sides = tuple[dict[str, jax.Array], dict[str, jax.Array]]


class Pieces(NamedTuple):
    """Pieces in the order of time, without gaps; those of no length fill the end.

    Parameters
    ----------
    start, end : (n_piece,) in s
    cubic : four of (n_piece,) in the unit of the quantity
        Coefficients of 1, s, s^2, s^3, where s runs from 0 to 1 over the piece.
    """

    start: jax.Array
    end: jax.Array
    cubic: Cubic


def pieces_of(
    observe: Observe, system: System, times: jax.Array, count: jax.Array, inputs: Inputs, solution: Solution
) -> Pieces:
    """Pieces of the scalar ``observe(state, mode, inputs)`` along a solution.

    Parameters
    ----------
    observe : callable
        Quantity at one instant, whose inputs are pairs of value and rate.
    system, times, count, inputs
        As given to `solve`.

    Returns
    -------
    Pieces
        ``n_time + ARCS`` of them.
    """

    def value_and_rate(step: jax.Array, mode: Mode, time: jax.Array, state: State) -> tuple[jax.Array, jax.Array]:
        def at(time: jax.Array, state: State) -> jax.Array:
            return observe(state, mode, inputs_at(inputs, times, step, time))

        change = system.derivative(state, mode, inputs_at(inputs, times, step, time))
        return jax.jvp(at, (time, state), (jnp.ones(()), change))

    n_steps, arcs = times.shape[0] - 1, solution.arcs
    steps = jnp.arange(n_steps, dtype=arcs.step.dtype)
    grid, modes = (times, solution.states), take(solution.modes, slice(None, -1))
    at_start = _joined((take(grid, slice(None, -1)), modes), ((arcs.start, arcs.state), arcs.mode))
    at_end = _joined(take(grid, slice(1, None)), (arcs.end, arcs.reached))
    which = jnp.concatenate([steps, arcs.step])
    # In a loop, so that the law is in the program once, and its values in memory before they are used.
    ends = jax.tree.map(lambda *both: jnp.stack(both), at_start[0], at_end)
    (p0, p1), (m0, m1) = jax.lax.map(lambda end: jax.vmap(value_and_rate)(which, at_start[1], *end), ends)
    length = at_end[0] - at_start[0][0]
    m0, m1 = m0 * length, m1 * length
    cubics = p0, m0, 3.0 * (p1 - p0) - 2.0 * m0 - m1, 2.0 * (p0 - p1) + m0 + m1
    of_steps, of_arcs = (tuple(term[part] for term in cubics) for part in (slice(None, n_steps), slice(n_steps, None)))
    held = (steps < arcs.step[0]) | (steps >= count - 1)
    of_steps = (of_steps[0], *(jnp.where(held, 0.0, term) for term in of_steps[1:]))
    waiting = _constant(of_arcs[0][0])
    return _in_order(solution, times, of_steps, of_arcs, waiting)


def _joined(steps: Any, arcs: Any) -> Any:
    return jax.tree.map(lambda a, b: jnp.concatenate([a, b]), steps, arcs)


def _in_order(solution: Solution, times: jax.Array, of_steps: Cubic, of_arcs: Cubic, waiting: Cubic) -> Pieces:
    """Steps without a switch, arcs, and the time the start is waited for inside the first step, sorted by time."""
    arcs, n_steps = solution.arcs, times.shape[0] - 1
    valid = jnp.arange(ARCS) < solution.n_arcs
    first = arcs.step[0]
    arcs_in = jnp.zeros(n_steps, jnp.int32).at[jnp.where(valid, arcs.step, n_steps)].add(1, mode="drop")
    pieces_in = jnp.maximum(arcs_in, 1).at[first].add(1)
    before = jnp.cumsum(pieces_in) - pieces_in
    rank = jnp.arange(ARCS) - (jnp.cumsum(arcs_in) - arcs_in)[arcs.step] + (arcs.step == first)
    size = n_steps + ARCS + 1
    # Rows that are not wanted go out of range, each to a place of its own: scattering backwards needs that.
    row_of_steps = jnp.where(arcs_in > 0, size + jnp.arange(n_steps), before)
    row_of_arcs = jnp.where(valid, before[arcs.step] + rank, size + jnp.arange(ARCS))

    def place(blank: jax.Array, steps: jax.Array, arcs: jax.Array, waiting: jax.Array) -> jax.Array:
        rows = jnp.broadcast_to(blank, (size,))
        rows = rows.at[row_of_steps].set(steps, mode="drop", unique_indices=True)
        rows = rows.at[row_of_arcs].set(arcs, mode="drop", unique_indices=True)
        return rows.at[before[first]].set(waiting, unique_indices=True)

    end = _constant(of_steps[0][-1] + of_steps[1][-1] + of_steps[2][-1] + of_steps[3][-1])
    return Pieces(
        place(times[-1], times[:-1], arcs.start, times[first]),
        place(times[-1], times[1:], arcs.end, arcs.start[0]),
        tuple(map(place, end, of_steps, of_arcs, waiting)),
    )


def _constant(value: jax.Array) -> Cubic:
    return value, jnp.zeros_like(value), jnp.zeros_like(value), jnp.zeros_like(value)


class Jumps(NamedTuple):
    """What the switches of a motion do to the readings.

    Parameters
    ----------
    instants : (ARCS,) in s
    heights : dict of (ARCS,) in SI units
        By channel; zero where a switch leaves the reading as it is, and in rows without a switch.
    number : () int
        Rows that may hold a switch.
    """

    instants: jax.Array
    heights: dict[str, jax.Array]
    number: jax.Array


def jumps_of(
    observe: ObserveAll,
    inputs_at: Callable[[jax.Array, jax.Array], Any],
    solution: Solution,
    sensed: Callable[[Sides, jax.Array], Sides] = lambda sides, _: sides,
) -> Jumps:
    """Jumps of the readings at all switches of a motion.

    Parameters
    ----------
    observe : callable ``(state, mode, inputs) -> {channel: value}``
    inputs_at : callable ``(step, instant) -> inputs``
    sensed : callable ``(sides, instants) -> sides``
        Readings before and after, of what is observed.
    """
    arcs = solution.arcs
    state, mode = jax.tree.map(lambda rows: jnp.roll(rows, -1, axis=0), (arcs.state, arcs.mode))
    inputs = jax.vmap(inputs_at)(arcs.step, arcs.end)
    felt = jax.vmap(observe)(state, arcs.mode, inputs), jax.vmap(observe)(state, mode, inputs)
    before, after = sensed(felt, arcs.end)
    switched = (arcs.ended_by >= 0) & (jnp.arange(ARCS) < solution.n_arcs - 1)
    heights = {channel: jnp.where(switched, value - before[channel], 0.0) for channel, value in after.items()}
    return Jumps(arcs.end, heights, jnp.minimum(solution.n_arcs, ARCS))


SERIES_TERMS = 16
"""Terms of the series for slow lags: the next one is below 1e-16 of the sum."""


Parallel = tuple[tuple[jax.Array, jax.Array], ...]


class Lags(NamedTuple):
    """Reading = direct · force + Re Σ weight · (force behind a first-order lag).

    Parameters
    ----------
    direct : () a pure number
    weights : tuple of () complex
    constants : tuple of () complex, in s
    """

    direct: jax.Array
    weights: tuple[jax.Array, ...]
    constants: tuple[jax.Array, ...]


def in_series(first: Lags, second: Parallel) -> Lags:
    """One after the other, by partial fractions.

    Two lags of no time constant at all are a case of their own: to first order they simply add.
    """
    own = list(zip(first.weights, first.constants, strict=True))
    if own:
        second = _both_of_each_pair(second)
    direct, kept, added = first.direct * 0.0, [0.0 * w for w, _ in own], [first.direct * w for w, _ in second]
    for i, (w, a) in enumerate(own):
        for j, (v, b) in enumerate(second):
            both_nil = (a == 0.0) & (b == 0.0)
            apart = jnp.where(both_nil, 1.0, a - b)
            # b/(a - b) rather than a/(a - b): exactly nothing, and exactly one, where the second lag is zero.
            share = jnp.where(both_nil, 0.0, b / apart)
            kept[i] += w * v * (1.0 + share)
            added[j] += w * v * jnp.where(both_nil, 1.0, -share)
            direct += jnp.where(both_nil, -jnp.real(w * v), 0.0)
    return Lags(direct, (*kept, *added), (*first.constants, *(b for _, b in second)))


def _both_of_each_pair(lags: Parallel) -> Parallel:
    whole: list[tuple[jax.Array, jax.Array]] = []
    for weight, constant in lags:
        if jnp.iscomplexobj(constant):
            whole += [(0.5 * weight, constant), (0.5 * jnp.conj(weight), jnp.conj(constant))]
        else:
            whole.append((weight, constant))
    return tuple(whole)


def _slow(w: jax.Array) -> list[jax.Array]:
    """Moments ``∫ exp(-w (1 - x)) x^k dx`` over 0 to 1, k = 0 to 3; the series for the last gives all others."""
    moment = jnp.zeros_like(w)
    for n in reversed(range(SERIES_TERMS)):
        moment = 6.0 / math.factorial(n + 4) - w * moment
    moments = [moment]
    for k in (3, 2, 1):
        moments.insert(0, (1.0 - w * moments[0]) / k)
    return moments


def _weights(ratio: jax.Array, s: jax.Array) -> tuple[jax.Array, list[jax.Array]]:
    """Remainder of the reading at 0, and what each of the four terms of the cubic adds."""
    zero = ratio == 0.0
    remainder = jnp.where(zero, 0.0, jnp.exp(-s / jnp.where(zero, 1.0, ratio)))
    # Slow against the piece: the convolution itself; the particular solution would be a difference of large terms.
    slow = jnp.abs(ratio) > 1.0
    w = s / jnp.where(slow, ratio, 1.0)
    # Else the particular solution, which ends by itself for a cubic.
    r = jnp.where(slow, 1.0, ratio)
    at_0, at_s, power, weights = jnp.ones_like(r), jnp.ones_like(r), jnp.ones_like(r), []
    for k, moment in enumerate(_slow(w)):
        if k:
            power = power * s
            at_0, at_s = -k * r * at_0, power - k * r * at_s
        weights.append(jnp.where(slow, w * power * moment, at_s - remainder * at_0))
    return remainder, weights


@jax.custom_jvp
def lag(cubic: Cubic, ratio: jax.Array, s: jax.Array) -> tuple[jax.Array, jax.Array]:
    """A first-order lag over the part 0 to s of a piece: ``reading = factor · (reading at 0) + offset``.

    Parameters
    ----------
    cubic : four of (...)
        The force on the piece.
    ratio : (...)
        Time constant over the length of the piece.

    Returns
    -------
    factor, offset : (...)
    """
    factor, weights = _weights(ratio, s)
    return factor, _dot(weights, cubic)


@lag.defjvp
def _lag_jvp(primals: tuple, tangents: tuple) -> tuple[tuple, tuple]:
    # The derivatives are taken once, whatever the number of tangents, and contracted before the tangents meet them.
    cubic, ratio, s = primals
    d_cubic, d_ratio, d_s = tangents
    factor, weights = _weights(ratio, s)
    by_ratio = jax.jvp(lambda r: _weights(r, s), (ratio,), (jnp.ones_like(ratio),))[1]
    by_s = jax.jvp(lambda x: _weights(ratio, x), (s,), (jnp.ones_like(s),))[1]
    d_factor = by_ratio[0] * d_ratio + by_s[0] * d_s
    d_offset = _dot(weights, d_cubic) + _dot(by_ratio[1], cubic) * d_ratio + _dot(by_s[1], cubic) * d_s
    return (factor, _dot(weights, cubic)), (d_factor, d_offset)


def _dot(weights: Iterable[jax.Array], terms: Iterable[jax.Array]) -> jax.Array:
    return functools.reduce(operator.add, map(operator.mul, weights, terms))


def behind(pieces: Pieces, lags: Lags, late_by: jax.Array, times: jax.Array) -> jax.Array:
    """Force behind a chain of lags and a delay, at the points of the grid.

    Parameters
    ----------
    late_by : () in s
    times : (n_time,) in s

    Returns
    -------
    (n_time,) in N
    """
    length = pieces.end - pieces.start
    per_length = 1.0 / jnp.where(length > 0.0, length, 1.0)
    instants = jnp.clip(times - late_by, times[0], times[-1])
    row = jnp.clip(jnp.searchsorted(pieces.start, instants, side="right") - 1, 0, length.size - 1)
    s = jnp.where(length[row] > 0.0, (instants - pieces.start[row]) * per_length[row], 0.0)
    here = take(pieces.cubic, row)
    reading = lags.direct * _dot((jnp.ones_like(s), s, s * s, s * s * s), here)
    whole = jnp.where(length > 0.0, 1.0, 0.0)
    maps = [lag(pieces.cubic, constant * per_length, whole) for constant in lags.constants]

    def forward(values: list[jax.Array], piece: list[tuple[jax.Array, jax.Array]]) -> Any:
        return [factor * value + offset for value, (factor, offset) in zip(values, piece, strict=True)], values

    # Readings behind each lag at the start of each piece; at rest before the first.
    first = pieces.cubic[0][0]
    at_rest = [jnp.asarray(first, factor.dtype) for factor, _ in maps]
    starts = jax.lax.scan(forward, at_rest, maps)[1] if maps else []
    for weight, constant, start in zip(lags.weights, lags.constants, starts, strict=True):
        factor, offset = lag(here, constant * per_length[row], s)
        reading += jnp.real(weight * (factor * start[row] + offset))
    return reading


class SensorChain(NamedTuple):
    """Sensors that need the force between the samples, one after the other.

    Parameters
    ----------
    lags : Lags
    late_by : () in s
    zero : () bool
        Whether all of them are at their null.
    """

    lags: Lags
    late_by: jax.Array
    zero: jax.Array

    def at_once(self, step: jax.Array) -> jax.Array:
        """Share of a jump of the force that comes through within a `step` [s]."""
        share = self.lags.direct
        for weight, constant in zip(self.lags.weights, self.lags.constants, strict=True):
            none = constant == 0.0
            share += jnp.real(weight * (1.0 - jnp.where(none, 0.0, jnp.exp(-step / jnp.where(none, 1.0, constant)))))
        return jnp.where(self.zero, 1.0, share)


def chain_of(laws: tuple[Effect, ...]) -> SensorChain | None:
    """The chain of the sensors that need the force between the samples; None where there is none."""
    dynamic = [law for law in laws if isinstance(law, SensorLaw) and law.dynamic]
    if not dynamic:
        return None
    lags, late_by, zero = Lags(jnp.ones(()), (), ()), jnp.zeros(()), jnp.array(True)
    # Linear and time-invariant, so any order will do; complex lags first are fewer in all.
    for law in sorted(dynamic, key=lambda law: not any(jnp.iscomplexobj(constant) for _, constant in law.lags())):
        if parallel := law.lags():
            lags = in_series(lags, parallel)
        late_by = late_by + law.late_by()
        zero &= law.absent()
    return SensorChain(lags, late_by, zero)
