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

from fibrefit.simulate.inputs import inputs_at
from fibrefit.simulate.rosenbrock import eliminate, reach, substitute
from fibrefit.simulate.steps import explicit

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
    """Derivatives of the state each piece reaches, by the state it starts from and by what the laws are told.

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
    # One after the other: together, the tangents of a batch would be carried along with the factor too.
    factor = path.carry([jnp.eye(size)[:, i, None] for i in range(size)], None)
    return factor, path.carry([jnp.zeros(()) for _ in range(size)], path.forced(tangents))


class _Path:
    """Pieces as cubics between their ends, and the variational equation along them.

    Arrays run over nodes first and pieces last: what the processor does in one go are neighbours.
    """

    def __init__(self, system: Any, inputs: Any, times: jax.Array, pieces: Piece) -> None:
        tree = jax.tree.structure(pieces.state)

        def rate(system: Any, inputs: Any, time: jax.Array, leaves: Leaves, step: jax.Array, mode: Any) -> Leaves:
            here = inputs_at(inputs, times, step, time)
            return jax.tree.leaves(system.derivative(jax.tree.unflatten(tree, leaves), mode, here))

        self.rate, self.laws, self.where = rate, (system, inputs), (pieces.step, pieces.mode)
        self.length = pieces.end - pieces.start
        ends = tuple(jax.tree.leaves(state) for state in (pieces.state, pieces.reached))
        along = jax.vmap(partial(rate, *self.laws))
        rates = [
            along(time, leaves, *self.where) for time, leaves in zip((pieces.start, pieces.end), ends, strict=True)
        ]

        def at(node: jax.Array) -> tuple[jax.Array, Leaves]:
            cubics = map(partial(_cubic, node, self.length), *ends, *rates)
            return pieces.start + node * self.length, list(cubics)

        self.instants = jax.vmap(at)(jnp.array(NODES))
        self.rows = self._jacobian(jax.tree.map(lambda leaf: leaf[0], (pieces.start, ends[0], *self.where)))
        self.factors = eliminate(self.rows, DIAGONAL * self.length)

    def _jacobian(self, example: tuple) -> list[list[Any]]:
        """Rows of the Jacobian; an entry is ``(n_node, n_piece)``, or None where it is nil whatever the values."""
        time, leaves, *where = example
        size = len(leaves)
        enters = reach(lambda t, y: self.rate(*self.laws, t, y, *where), time, leaves)[1:]

        def slopes(direction: jax.Array, time: jax.Array, leaves: Leaves, step: jax.Array, mode: Any) -> Leaves:
            rate = lambda y: self.rate(*self.laws, time, y, step, mode)  # noqa: E731
            return jax.jvp(rate, (leaves,), (list(direction),))[1]

        of_pieces = jax.vmap(slopes, (None, 0, 0, 0, 0))
        of_nodes = jax.vmap(of_pieces, (None, 0, 0, None, None))
        columns = jax.vmap(of_nodes, (0, None, None, None, None))(jnp.eye(size), *self.instants, *self.where)
        return [[columns[i][j] if i in enters[j] else None for j in range(size)] for i in range(size)]

    def forced(self, tangents: tuple) -> Leaves:
        """Rates that tangents of the system and of the inputs add, ``(n_node, n_piece)`` for each state."""

        def at(time: jax.Array, leaves: Leaves, step: jax.Array, mode: Any) -> Leaves:
            rate = partial(self.rate, time=time, leaves=leaves, step=step, mode=mode)
            return jax.jvp(rate, self.laws, tangents)[1]

        return jax.vmap(jax.vmap(at), (0, 0, None, None))(*self.instants, *self.where)

    def carry(self, deviations: Leaves, forced: Leaves | None) -> Leaves:
        """Deviations of the states, ``(..., n_piece)`` each, carried to the end."""
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


def _cubic(s: Any, length: Any, first: Any, last: Any, rate_first: Any, rate_last: Any) -> jax.Array:
    """Cubic from `first` to `last`, at the share `s` of the way."""
    rise, m0, m1 = last - first, length * rate_first, length * rate_last
    return first + s * (m0 + s * (3.0 * rise - 2.0 * m0 - m1 + s * (m0 + m1 - 2.0 * rise)))
