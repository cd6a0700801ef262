"""Derivatives of smooth pieces of the motion, all pieces at once.

Where the system is stiff they are those of the true flow: the variational equation along a piece, solved by a stiffly
stable method of the same order. Differentiating the step itself would need second derivatives of every law, and no one
would see the difference.

Source
------
Hairer and Wanner, Solving Ordinary Differential Equations II (1996), section IV.6: the SDIRK method of order 4.
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from fibrefit.simulation.inputs import inputs_at
from fibrefit.simulation.steps import eliminate, explicit, reach, substitute

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
            for i, row in enumerate(rows):
                for slope, deviation in zip(row, now, strict=True):
                    if slope is not None:
                        right[i] = right[i] + slope * deviation
            stages.append(substitute(here(self.factors), right))
        return sum_of((*WEIGHTS[-1], DIAGONAL))
