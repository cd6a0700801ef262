"""Derivatives of the switched integrator: forward sensitivity along the stored trajectory.

They are those of the true hybrid flow: the instant of a switch moves with the parameters, and the implicit function
theorem at the located margin carries this through (the "saltation" of the hybrid-systems literature). Tangents are
propagated in one pass through the steps of the motion and, at switches, its arcs, all of them at once.

Each run of a batch meets its switches at instants of its own; in lock step all would wait for each. Hence a batching
rule: runs go one after the other, and the tangents of one run, which share everything but themselves, in one batch.

Smooth pieces of the motion go all at once. Where the system is stiff, their derivatives are those of the true flow: the
variational equation along a piece, solved by a stiffly stable method of the same order. Differentiating the step itself
would need second derivatives of every law, and no one would see the difference.

Source
------
Hairer and Wanner, Solving Ordinary Differential Equations II (1996), section IV.6: the SDIRK method of order 4.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial, reduce
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_batching import custom_vmap
from jax.custom_derivatives import SymbolicZero

from fibrefit.rigs.rig import Start
from fibrefit.simulation.inputs import inputs_at, row
from fibrefit.simulation.steps import System, eliminate, explicit, plus, reach, substitute
from fibrefit.simulation.switched import ARCS, Arcs, Grid, Inputs, Solution, integrate, select, take, write

DIAGONAL = 1.0 / 4.0
NODES = (1.0 / 4.0, 3.0 / 4.0, 11.0 / 20.0, 1.0 / 2.0, 1.0)
WEIGHTS: tuple[tuple[float, ...], ...] = (
    (),
    (1.0 / 2.0,),
    (17.0 / 50.0, -1.0 / 25.0),
    (371.0 / 1360.0, -137.0 / 2720.0, 15.0 / 544.0),
    (25.0 / 24.0, -49.0 / 48.0, 125.0 / 16.0, -85.0 / 12.0),
)
"""Weights of the earlier stages; those of the result are the last row with `DIAGONAL`."""

CORRECTIONS = 2
"""Newton steps for the slope at a node; laws are linear in the fast states, or nearly so."""

Leaves = list[jax.Array]


class Piece(NamedTuple):
    """A smooth piece of the motion, a whole step of the grid or an arc: where, when, from which state to which."""

    step: jax.Array
    start: jax.Array
    end: jax.Array
    state: Any
    reached: Any
    mode: Any


def explicit_maps(system: Any, inputs: Any, times: jax.Array, pieces: Piece, tangents: tuple) -> tuple[Leaves, Leaves]:
    """As `stiff_maps`, for a system whose rates are slow against the step: the derivatives of the step itself."""

    def move(leaves: Leaves, laws: tuple, piece: Piece) -> Leaves:
        system, inputs = laws
        state = jax.tree.unflatten(jax.tree.structure(piece.state), leaves)
        arc = (piece.step, piece.start, piece.end)
        return jax.tree.leaves(explicit(system, state, piece.mode, inputs, times, arc))

    def along(direction: jax.Array, piece: Piece) -> Leaves:
        start = jax.tree.leaves(piece.state)
        return jax.jvp(lambda leaves: move(leaves, (system, inputs), piece), (start,), (list(direction),))[1]

    def forced(piece: Piece) -> Leaves:
        start = jax.tree.leaves(piece.state)
        return jax.jvp(lambda *laws: move(start, laws, piece), (system, inputs), tangents)[1]

    size = len(jax.tree.leaves(pieces.state))
    return jax.vmap(jax.vmap(along, (None, 0)), (0, None))(jnp.eye(size), pieces), jax.vmap(forced)(pieces)


def stiff_maps(system: Any, inputs: Any, times: jax.Array, pieces: Piece, tangents: tuple) -> tuple[Leaves, Leaves]:
    """Derivatives of the state each piece reaches: by the state it starts from, and by parameters and inputs.

    Parameters
    ----------
    system : System
    inputs : dict of Course
    times : (n_time,) in s
    pieces : Piece of (n_piece, ...)
    tangents : tuple
        Of the system and of the inputs.

    Returns
    -------
    factor, offset : lists of (n_state, n_piece), of (n_piece,), one for each state
        ``d reached_i = Σ_j factor_i[j] d state_j + offset_i``.
    """
    path = _Path(system, inputs, times, pieces)
    size = len(path.rows)
    # One after the other: together, the tangents of a batch would be propagated along with the factor too.
    factor = path.propagate([jnp.eye(size)[:, i, None] for i in range(size)], None)
    return factor, path.propagate([jnp.zeros(()) for _ in range(size)], path.forced(tangents))


class _Path:
    """The method's own way through each piece, and the variational equation along it.

    Arrays run over nodes first and pieces last: what the processor does in one go are neighbours.
    """

    def __init__(self, system: Any, inputs: Any, times: jax.Array, pieces: Piece) -> None:
        tree = jax.tree.structure(pieces.state)

        def rate(system: Any, inputs: Any, time: jax.Array, leaves: Leaves, step: jax.Array, mode: Any) -> Leaves:
            here = inputs_at(inputs, times, step, time)
            return jax.tree.leaves(system.derivative(jax.tree.unflatten(tree, leaves), mode, here))

        self.rate, self.laws, self.where = rate, (system, inputs), (pieces.step, pieces.mode)
        self.start, self.length = pieces.start, pieces.end - pieces.start
        leaves = jax.tree.leaves(pieces.state)
        first = jax.tree.map(lambda leaf: leaf[0], (pieces.start, leaves, *self.where))
        self.enters = reach(lambda t, y: rate(*self.laws, t, y, *first[2:]), *first[:2])[1:]
        self.instants = self._stages(leaves)
        self.rows = jax.vmap(self._jacobian)(*self.instants)
        self.factors = eliminate(self.rows, DIAGONAL * self.length)

    def _stages(self, start: Leaves) -> tuple[jax.Array, Leaves]:
        """Instant and state at each node, ``(n_node, n_piece)``: those of the method itself.

        What is over within a small part of a piece is over at its nodes too; a curve through both ends is not.
        """
        rates = jax.vmap(partial(self.rate, *self.laws))
        weights = jnp.array([[*row, *[0.0] * (len(WEIGHTS) - len(row))] for row in WEIGHTS])

        def stage(slopes: Leaves, node: jax.Array) -> tuple[Leaves, tuple[jax.Array, Leaves]]:
            time = self.start + jnp.array(NODES)[node] * self.length
            before = [y + self.length * (weights[node] @ k) for y, k in zip(start, slopes, strict=True)]
            factors = eliminate(self._jacobian(time, before), DIAGONAL * self.length)
            slope = [jnp.zeros_like(y) for y in start]
            for _ in range(CORRECTIONS):
                here = [y + self.length * DIAGONAL * k for y, k in zip(before, slope, strict=True)]
                error = [f - k for f, k in zip(rates(time, here, *self.where), slope, strict=True)]
                slope = [k + d for k, d in zip(slope, substitute(factors, error), strict=True)]
            here = [y + self.length * DIAGONAL * k for y, k in zip(before, slope, strict=True)]
            return [store.at[node].set(k) for store, k in zip(slopes, slope, strict=True)], (time, here)

        blank = [jnp.zeros((len(NODES), *y.shape)) for y in start]
        return jax.lax.scan(stage, blank, jnp.arange(len(NODES)))[1]

    def _jacobian(self, time: jax.Array, leaves: Leaves) -> list[list[Any]]:
        """Rows of the Jacobian; an entry is ``(n_piece,)``, or None where it is zero whatever the values."""
        size = len(leaves)

        def slopes(direction: jax.Array, time: jax.Array, leaves: Leaves, step: jax.Array, mode: Any) -> Leaves:
            rate = lambda y: self.rate(*self.laws, time, y, step, mode)  # noqa: E731
            return jax.jvp(rate, (leaves,), (list(direction),))[1]

        of_pieces = jax.vmap(slopes, (None, 0, 0, 0, 0))
        columns = jax.vmap(of_pieces, (0, None, None, None, None))(jnp.eye(size), time, leaves, *self.where)
        return [[columns[i][j] if i in self.enters[j] else None for j in range(size)] for i in range(size)]

    def forced(self, tangents: tuple) -> Leaves:
        """Rates that tangents of the system and of the inputs add, ``(n_node, n_piece)`` for each state."""

        def at(time: jax.Array, leaves: Leaves, step: jax.Array, mode: Any) -> Leaves:
            rate = partial(self.rate, time=time, leaves=leaves, step=step, mode=mode)
            return jax.jvp(rate, self.laws, tangents)[1]

        return jax.vmap(jax.vmap(at), (0, 0, None, None))(*self.instants, *self.where)

    def propagate(self, deviations: Leaves, forced: Leaves | None) -> Leaves:
        """Deviations of the states, ``(..., n_piece)`` each, propagated to the end by the variational equation."""
        stages: list[Leaves] = []

        def sum_of(weights: tuple[float, ...]) -> Leaves:
            total = deviations
            for weight, stage in zip(weights, stages, strict=True):
                total = [d + self.length * weight * k for d, k in zip(total, stage, strict=True)]
            return total

        for node, weights in enumerate(WEIGHTS):
            # An entry that is the same everywhere is a plain number.
            here = partial(jax.tree.map, lambda entry, node=node: entry[node] if jnp.ndim(entry) else entry)
            now, rows = sum_of(weights), here(self.rows)
            right = [jnp.zeros(()) for _ in rows] if forced is None else here(forced)
            for i, slopes in enumerate(rows):
                for slope, deviation in zip(slopes, now, strict=True):
                    if slope is not None:
                        right[i] = right[i] + slope * deviation
            stages.append(substitute(here(self.factors), right))
        return sum_of((*WEIGHTS[-1], DIAGONAL))


PACK = 4
"""Tangents are propagated in multiples of this, which the processor does in one go."""
MANY = 24
"""Tangents from which maps of all steps, made once for all of them, pay."""
Push = Callable[[Any, Any], tuple[Any, Any]]


@partial(jax.custom_jvp)
def solve(system: System, begin: Start, grid: Grid) -> Solution:
    """Integrate a switched system over a grid of instants.

    Parameters
    ----------
    system : System
        Pytree of parameter values.
    begin : Start
        State and mode at its time, not before the first instant; the state is held until then.

    Returns
    -------
    Solution
        Its states and arcs are differentiable in `system`, in state and time of `begin`, and in the inputs, forwards.
    """
    return integrate(system, begin, grid)


@partial(solve.defjvp, symbolic_zeros=True)
def _solve_jvp(primals: Any, tangents: Any) -> tuple[Solution, Solution]:
    d_system, d_begin, d_grid = tangents
    # The leaves whose tangents are not symbolically zero.
    leaves = jax.tree.leaves((d_system, d_grid.inputs))
    which = tuple(i for i, d in enumerate(leaves) if not isinstance(d, SymbolicZero))
    laws = [leaves[i] for i in which]
    inward = Tangents(laws, jax.tree.leaves(jax.tree.map(materialise, d_begin.state)), materialise(d_begin.time))
    solution, moved = sequential(partial(_solution_and_tangents, which))(
        primals, jax.tree.map(lambda d: d[None], inward)
    )
    moved = jax.tree.map(lambda d: d[0], moved)
    state = partial(jax.tree.unflatten, jax.tree.structure(solution.states))
    blank = jax.tree.map(lambda value: np.zeros(value.shape, jax.dtypes.float0), solution)
    arcs = blank.arcs._replace(start=moved.start, state=state(moved.state), end=moved.end, reached=state(moved.reached))
    return solution, blank._replace(states=state(moved.states), arcs=arcs)


def _solution_and_tangents(
    which: tuple[int, ...], given: tuple, tangents: Tangents
) -> tuple[Solution, TrajectoryTangents]:
    system, begin, grid = given
    solution = integrate(system, begin, grid)
    return solution, propagate_tangents(which, system, grid, solution, tangents)


def sequential(push: Push) -> Push:
    """A function with a batching rule of its own: vmap over runs is sequential, over tangents it is one larger batch.

    Parameters
    ----------
    push : callable ``(given, tangents) -> (found, moved)``
        Each leaf of `tangents` and of `moved` has an axis of tangents in front; `found` does not depend on them.
    """

    def merged(size: int, tangent: jax.Array, flag: bool) -> jax.Array:
        rows = tangent if flag else jnp.broadcast_to(tangent, (size, *tangent.shape))
        return rows.reshape(-1, *rows.shape[2:])

    @custom_vmap
    def both(given: Any, tangents: Any) -> tuple[Any, Any]:
        return push(given, tangents)

    @both.def_vmap
    def rule(size: int, batched: Any, given: Any, tangents: Any) -> Any:
        tangents_only = not any(jax.tree.leaves(batched[0]))
        if tangents_only:
            # A batch of batches of tangents is one batch.
            found, moved = both(given, jax.tree.map(partial(merged, size), tangents, batched[1]))
            moved = jax.tree.map(lambda rows: rows.reshape(size, -1, *rows.shape[1:]), moved)
        else:
            leaves, tree = jax.tree.flatten((given, tangents))
            flags = jax.tree.leaves(batched)

            def one(rows: list[jax.Array]) -> tuple[Any, Any]:
                own = iter(rows)
                whole = [next(own) if flag else leaf for leaf, flag in zip(leaves, flags, strict=True)]
                return both(*jax.tree.unflatten(tree, whole))

            found, moved = jax.lax.map(one, [leaf for leaf, flag in zip(leaves, flags, strict=True) if flag])
        return (found, moved), (jax.tree.map(lambda _: not tangents_only, found), jax.tree.map(lambda _: True, moved))

    return both


def materialise(tangent: Any) -> jax.Array:
    """A tangent as an array: zeros for a symbolic zero."""
    return jnp.zeros(tangent.shape, tangent.dtype) if isinstance(tangent, SymbolicZero) else tangent


def partition(whole: Any, which: tuple[int, ...]) -> tuple[list[Any], Callable[[list[Any]], Any]]:
    """Partition of a pytree: the leaves of the given numbers, and the function that puts others in their place."""
    leaves, tree = jax.tree.flatten(whole)

    def with_(some: list[Any]) -> Any:
        now = dict(zip(which, some, strict=True))
        return jax.tree.unflatten(tree, [now.get(i, leaf) for i, leaf in enumerate(leaves)])

    return [leaves[i] for i in which], with_


class Tangents(NamedTuple):
    """Input tangents: of the system, the inputs and the initial state of a motion, ``(n_tangent, ...)`` each.

    Parameters
    ----------
    laws : list, of those leaves of ``(system, inputs)`` that have any
    start : list of (n_tangent,), of the leaves of the initial state
    start_time : (n_tangent,)
    """

    laws: Leaves
    start: Leaves
    start_time: jax.Array


class TrajectoryTangents(NamedTuple):
    """Forward sensitivity: tangents of a motion.

    Parameters
    ----------
    states : list of (n_tangent, n_time), of the leaves of the state
    start, end : (n_tangent, ARCS)
    state, reached : list of (n_tangent, ARCS)
    """

    states: Leaves
    start: jax.Array
    state: Leaves
    end: jax.Array
    reached: Leaves


class _Pass(NamedTuple):
    """State of the loops: tangents `now`, at the point `step` of the grid, and in its arcs those of the instant.

    `found` holds rows of all tangents, so that each is written in one go.
    """

    step: jax.Array
    arc: jax.Array
    now: Leaves
    instant: jax.Array
    settled: jax.Array
    found: TrajectoryTangents


def propagate_tangents(
    which: tuple[int, ...], system: System, grid: Grid, solution: Solution, tangents: Tangents
) -> TrajectoryTangents:
    """Forward sensitivity of a motion, from the tangents of its system, inputs and initial state.

    Parameters
    ----------
    which : tuple of int
        Leaves of ``(system, grid.inputs)`` that have tangents.
    system, grid
        As given to `solve`.
    """
    number, (times, count, inputs) = tangents.start_time.shape[0], grid

    def padded(tangent: jax.Array) -> jax.Array:
        short = -len(tangent) % PACK if len(tangent) > 1 else 0
        more = (short, *tangent.shape[1:])
        return jnp.concatenate([tangent, jnp.zeros(more, tangent.dtype)]) if short else tangent

    tangents = jax.tree.map(padded, tangents)
    flow = _LinearFlow(which, system, inputs, times, solution, tangents.laws)
    arcs, last = solution.arcs, count.astype(jnp.int32) - 1
    n_arcs = jnp.minimum(solution.n_arcs, ARCS)

    def through_arc(now: _Pass) -> _Pass:
        arc: Arcs = jax.tree.map(lambda rows: row(rows, now.arc), arcs)
        after, end, moved = flow.through_arc(now.arc, arc, now.now, now.instant)
        at, found = partial(write, index=now.arc), now.found
        found = found._replace(
            start=at(found.start, item=now.instant),
            state=at(found.state, item=now.now),
            end=at(found.end, item=end),
            reached=at(found.reached, item=moved),
        )
        return now._replace(arc=now.arc + 1, now=after, instant=end, found=found)

    def through_step(now: _Pass) -> _Pass:
        after = flow.through_step(now.step, now.now)
        same = reduce(jnp.logical_and, [jnp.all(a == b) for a, b in zip(after, now.now, strict=True)])
        return _at_point(now._replace(now=after, settled=same & (now.step >= solution.rest)))

    def stretch(now: _Pass) -> _Pass:
        inside = lambda p: (p.arc < n_arcs) & (row(arcs.step, p.arc) == p.step)  # noqa: E731
        now = jax.lax.while_loop(inside, through_arc, now)
        now = _at_point(now._replace(instant=jnp.zeros_like(now.instant)))
        until = jnp.where(now.arc < n_arcs, row(arcs.step, now.arc), last)
        return jax.lax.while_loop(lambda p: (p.step < until) & ~p.settled, through_step, now)

    # Until it is let go, a motion has the tangents of its start.
    states = [jnp.broadcast_to(d[:number], (times.shape[0], number)) for d in tangents.start]
    rows = jnp.zeros((ARCS, tangents.start_time.size))
    blank = TrajectoryTangents(states, rows, [rows for _ in states], rows, [rows for _ in states])
    now = _Pass(arcs.step[0], jnp.int32(0), tangents.start, tangents.start_time, jnp.array(False), blank)
    now = jax.lax.while_loop(lambda p: (p.step < last) & ~p.settled, stretch, now)
    # At rest, and in the padding, nothing moves.
    held = jnp.arange(times.shape[0])[:, None] > now.step
    states = [jnp.where(held, d[:number], rows) for d, rows in zip(now.now, now.found.states, strict=True)]
    return jax.tree.map(lambda rows: rows.T[:number], now.found._replace(states=states))


def _at_point(now: _Pass) -> _Pass:
    """The next point of the grid is reached."""
    number = now.found.states[0].shape[1]
    states = write(now.found.states, now.step + 1, [d[:number] for d in now.now])
    return now._replace(step=now.step + 1, found=now.found._replace(states=states))


class _Maps(NamedTuple):
    """Linear maps of all pieces of a motion, its steps and then its arcs.

    Parameters and inputs of the laws are made of units: a number of the system, which is the same throughout, or a
    coefficient of an input, of which a piece knows that of its own step. The maps are those of
    units, however many the tangents.

    Parameters
    ----------
    factor : list of lists of (n_piece,), for each state that of each state before
    offset : list of (n_piece, n_unit), for each state that of each unit
    same : list of (n_tangent,), the tangents of each number of the system
    moving : list of (n_time - 1, n_tangent), those of each coefficient of the inputs
    """

    factor: list[Leaves]
    offset: Leaves
    same: Leaves
    moving: Leaves

    def through(self, piece: jax.Array, step: jax.Array, tangents: Leaves) -> Leaves:
        """Tangents after a piece."""
        shares = [*self.same, *(row(rows, step) for rows in self.moving)]
        moved = []
        for factors, units in zip(self.factor, self.offset, strict=True):
            parts = [row(factor, piece) * d for factor, d in zip(factors, tangents, strict=True)]
            parts += [offset * d for offset, d in zip(row(units, piece), shares, strict=True)]
            moved.append(reduce(jnp.add, parts))
        return moved


class _LinearFlow:
    """Linear maps of tangents along a motion: the flow of the variational equation.

    Those of smooth steps are taken on the way. For many tangents, or a system that may be stiff, they are made for all
    pieces beforehand.
    """

    def __init__(
        self, which: tuple[int, ...], system: System, inputs: Inputs, times: jax.Array, solution: Solution, laws: Leaves
    ) -> None:
        self.times, self.solution, self.laws = times, solution, laws
        self.primals, self.whole = partition((system, inputs), which)
        self.state = partial(jax.tree.unflatten, jax.tree.structure(solution.states))
        few = system.stiff() is None and laws[0].shape[0] < MANY if laws else True
        self.maps = None if few else self._maps(which, system, inputs)

    def through_step(self, step: jax.Array, tangents: Leaves) -> Leaves:
        """Tangents ``(n_tangent,)`` after a step of the grid that holds no switch."""
        state, mode = jax.tree.map(lambda rows: row(rows, step), (self.solution.states, self.solution.modes))
        span = (step, row(self.times, step), row(self.times, step + 1))
        return self._along(step, span, state, mode, tangents)

    def through_arc(
        self, number: jax.Array, arc: Arcs, tangents: Leaves, instant: jax.Array
    ) -> tuple[Leaves, jax.Array, Leaves]:
        """Tangents after an arc, of the instant of its end, and of the state before the switch."""
        system, inputs = self.whole(self.primals)
        # An arc that starts later has less time: its start moves back along the motion.
        rates = jax.tree.leaves(
            system.derivative(arc.state, arc.mode, inputs_at(inputs, self.times, arc.step, arc.start))
        )
        tangents = [d - rate * instant for d, rate in zip(tangents, rates, strict=True)]
        piece = self.times.shape[0] - 1 + number
        tangents = self._along(piece, (arc.step, arc.start, arc.end), arc.state, arc.mode, tangents)

        def end(leaves: Leaves, laws: Leaves) -> tuple[Leaves, jax.Array, Leaves]:
            system, inputs = self.whole(laws)
            return _arc_end(system, inputs, self.times, arc, self.state(leaves))

        return self._pushed(end, jax.tree.leaves(arc.reached), tangents)

    def _along(self, piece: jax.Array, span: tuple, state: Any, mode: Any, tangents: Leaves) -> Leaves:
        if self.maps is not None:
            return self.maps.through(piece, span[0], tangents)

        def move(leaves: Leaves, laws: Leaves) -> Leaves:
            system, inputs = self.whole(laws)
            return jax.tree.leaves(explicit(system, self.state(leaves), mode, inputs, self.times, span))

        return self._pushed(move, jax.tree.leaves(state), tangents)

    def _pushed(self, function: Callable, leaves: Leaves, tangents: Leaves) -> Any:
        def push(d_leaves: Leaves, d_laws: Leaves) -> Any:
            return jax.jvp(function, (leaves, self.primals), (d_leaves, d_laws))[1]

        return jax.vmap(push)(tangents, self.laws)

    def _maps(self, which: tuple[int, ...], system: System, inputs: Inputs) -> _Maps:
        times, solution, arcs = self.times, self.solution, self.solution.arcs
        n_steps = times.shape[0] - 1
        first, last = (take(solution.states, slice(*ends)) for ends in ((None, -1), (1, None)))
        modes = take(solution.modes, slice(None, -1))
        steps = Piece(jnp.arange(n_steps, dtype=arcs.step.dtype), times[:-1], times[1:], first, last, modes)
        of_arcs = Piece(arcs.step, arcs.start, arcs.end, arcs.state, arcs.reached, arcs.mode)
        pieces = jax.tree.map(lambda a, b: jnp.concatenate([a, b]), steps, of_arcs)

        def zero(leaf: Any) -> Any:
            if jnp.issubdtype(jnp.result_type(leaf), jnp.floating):
                return jnp.zeros_like(leaf)
            return np.zeros(jnp.shape(leaf), jax.dtypes.float0)

        with_tangents = partition(jax.tree.map(zero, (system, inputs)), which)[1]
        of_system = sum(i < len(jax.tree.leaves(system)) for i in which)
        units, same, moving = _units(self.laws, of_system)

        def maps(kind: Callable, d_laws: Leaves) -> tuple[Leaves, Leaves]:
            return kind(system, inputs, times, pieces, with_tangents(d_laws))

        def of(kind: Callable) -> Callable[[], Any]:
            # The factors are the same for all units.
            return lambda: jax.vmap(partial(maps, kind), out_axes=(None, -1))(units)

        is_stiff = system.stiff()
        made = of(explicit_maps)() if is_stiff is None else jax.lax.cond(is_stiff, of(stiff_maps), of(explicit_maps))
        factor, offset = made
        return _Maps([list(rows) for rows in factor], offset, same, moving)


def _units(laws: Leaves, of_system: int) -> tuple[Leaves, Leaves, Leaves]:
    """Units of parameters and inputs, ``(n_unit, ...)`` for each leaf, and the share of the tangents in each: `_Maps`.

    Parameters
    ----------
    laws : list of (n_tangent, ...)
        Tangents of leaves of the system, then of the inputs.
    of_system : int
        Number of the former.
    """
    sizes = [int(np.prod(leaf.shape[1:])) if i < of_system else 1 for i, leaf in enumerate(laws)]
    number, before, units = sum(sizes), 0, []
    for i, (leaf, size) in enumerate(zip(laws, sizes, strict=True)):
        own = jnp.eye(size) if i < of_system else jnp.ones((1, *leaf.shape[1:]))
        blank = jnp.zeros((number, *leaf.shape[1:]))
        units.append(blank.at[before : before + size].set(own.reshape(size, *leaf.shape[1:])))
        before += size
    same = [column for leaf in laws[:of_system] for column in leaf.reshape(leaf.shape[0], -1).T]
    return units, same, [leaf.T for leaf in laws[of_system:]]


def _arc_end(
    system: System, inputs: Inputs, times: jax.Array, arc: Arcs, state: Any
) -> tuple[Leaves, jax.Array, Leaves]:
    """State after an arc, the instant of its end, and the state before the switch, from the state that was found there.

    An arc that the grid ends has a fixed end. One that a switch ends moves with the margin: the value of the
    correction is zero, its derivative is that of the root.
    """

    def margin(state: Any, instant: jax.Array) -> jax.Array:
        here = inputs_at(inputs, times, arc.step, instant)
        return jnp.stack(jax.tree.leaves(system.margins(state, arc.mode, here)))[arc.ended_by]

    here = inputs_at(inputs, times, arc.step, arc.end)
    rate = jax.lax.stop_gradient(system.derivative(state, arc.mode, here))
    value, slope = jax.jvp(margin, (state, arc.end), (rate, jnp.ones(())))
    slope = jax.lax.stop_gradient(slope)
    moves = (arc.ended_by >= 0) & (jnp.abs(slope) > 1e-12)
    shift = jnp.where(moves, -(value - jax.lax.stop_gradient(value)) / jnp.where(moves, slope, 1.0), 0.0)
    moved = plus(state, shift, rate)
    switches, tree = jax.tree.flatten(arc.mode)
    crossed = jax.tree.unflatten(tree, [arc.ended_by == i for i in range(len(switches))])
    switched, _ = system.switch(moved, arc.mode, crossed, here)
    after = select(arc.ended_by >= 0, switched, moved)
    return jax.tree.leaves(after), arc.end + shift, jax.tree.leaves(moved)
