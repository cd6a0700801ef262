"""A smooth step of a stiff system, and its derivative.

The derivative is that of the true flow: the variational equation along the step, solved by a stiffly stable method of
the same order. Differentiating the step itself would need second derivatives of every law, and no one would see the
difference.

Source
------
Hairer and Wanner, Solving Ordinary Differential Equations II (1996), section IV.6: the SDIRK method of order 4.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp

from fibrefit.simulate.inputs import inputs_at
from fibrefit.simulate.rosenbrock import eliminate, jacobian, rosenbrock, substitute

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


@jax.custom_jvp
def stiff_flow(
    system: Any, state: Any, mode: Any, inputs: Any, times: jax.Array, step: jax.Array, start: jax.Array, end: jax.Array
) -> Any:
    """State at `end` from that at `start`; both lie in step `step` of the grid, and the mode lasts.

    Parameters
    ----------
    system : System
    state : pytree of ()
    mode : tuple of () int
    inputs : dict of Signals
    times : (n_time,) in s
    step : () int
    start, end : () in s

    Returns
    -------
    pytree of ()
    """
    leaves, tree = jax.tree.flatten(state)
    rate = partial(_rate(tree, mode, times, step), system, inputs)
    return jax.tree.unflatten(tree, rosenbrock(rate, leaves, start, end - start))


@stiff_flow.defjvp
def _stiff_flow_jvp(primals: tuple, tangents: tuple) -> tuple[Any, Any]:
    system, state, mode, inputs, times, step, start, end = primals
    d_system, d_state, _, d_inputs, _, _, d_start, d_end = tangents
    reached = stiff_flow(*primals)
    tree = jax.tree.structure(state)
    path = _Path(_rate(tree, mode, times, step), (system, inputs), (start, end), (state, reached))
    deviations = [d - rate * d_start for d, rate in zip(jax.tree.leaves(d_state), path.rates[0], strict=True)]
    deviations = path.carry(deviations, path.forced((d_system, d_inputs)))
    deviations = [d + rate * d_end for d, rate in zip(deviations, path.rates[1], strict=True)]
    return reached, jax.tree.unflatten(tree, deviations)


def stiff_map(
    system: Any,
    inputs: Any,
    mode: Any,
    times: jax.Array,
    step: jax.Array,
    span: tuple[jax.Array, jax.Array],
    ends: tuple[Any, Any],
    tangents: tuple,
) -> tuple[jax.Array, jax.Array]:
    """Derivative of a piece whose end is known.

    Parameters
    ----------
    system, inputs, mode, times, step
        As for `stiff_flow`.
    span : tuple of () in s
        Start and end.
    ends : tuple of pytrees of ()
        State at the start and at the end.
    tangents : tuple
        Of the system and of the inputs.

    Returns
    -------
    factor, offset : (n_state, n_state), (n_state,)
        ``d reached = factor · d state + offset``.
    """
    path = _Path(_rate(jax.tree.structure(ends[0]), mode, times, step), (system, inputs), span, ends)
    size = len(path.rates[0])
    # One after the other: together, the tangents of a batch would be carried along with the factor too.
    factor = path.carry(list(jnp.eye(size)), [[jnp.zeros(())] * size] * len(NODES))
    offset = path.carry([jnp.zeros(())] * size, path.forced(tangents))
    return jnp.stack(factor), jnp.stack(offset)


def _rate(tree: Any, mode: Any, times: jax.Array, step: jax.Array) -> Any:
    """Rates of the leaves of a state, ``(system, inputs, time, leaves)``."""

    def rate(system: Any, inputs: Any, time: jax.Array, leaves: list[jax.Array]) -> list[jax.Array]:
        here = inputs_at(inputs, times, step, time)
        return jax.tree.leaves(system.derivative(jax.tree.unflatten(tree, leaves), mode, here))

    return rate


class _Path:
    """A smooth piece of the motion, from its ends: a cubic between them.

    Parameters
    ----------
    rate : callable
        As made by `_rate`.
    laws : tuple
        System and inputs.
    span : tuple of () in s
        Start and end.
    states : tuple of pytrees
        At the start and at the end.
    """

    def __init__(self, rate: Any, laws: tuple, span: tuple, states: tuple) -> None:
        self.rate, self.laws, self.start, self.length = rate, laws, span[0], span[1] - span[0]
        self.ends = tuple(jax.tree.leaves(state) for state in states)
        self.rates = tuple(rate(*laws, time, leaves) for time, leaves in zip(span, self.ends, strict=True))
        self.instants = [(self.start + node * self.length, self._at(node)) for node in NODES]
        rows = [jacobian(partial(rate, *laws), *instant) for instant in self.instants]
        self.slopes = [(row, eliminate(row, DIAGONAL * self.length)) for row in rows]

    def _at(self, s: float) -> list[jax.Array]:
        """State after the share `s` of the piece."""

        def cubic(first: jax.Array, last: jax.Array, rate_first: jax.Array, rate_last: jax.Array) -> jax.Array:
            rise, m0, m1 = last - first, self.length * rate_first, self.length * rate_last
            return first + s * (m0 + s * (3.0 * rise - 2.0 * m0 - m1 + s * (m0 + m1 - 2.0 * rise)))

        return list(map(cubic, *self.ends, *self.rates))

    def forced(self, tangents: tuple) -> list[list[jax.Array]]:
        """Rates that tangents of the system and of the inputs add at each node."""
        return [jax.jvp(lambda *laws, at=at: self.rate(*laws, *at), self.laws, tangents)[1] for at in self.instants]

    def carry(self, deviations: list[jax.Array], forced: list[list[jax.Array]]) -> list[jax.Array]:
        """Deviations of the states, of any shape each, carried to the end."""
        stages: list[list[jax.Array]] = []

        def sum_of(weights: tuple[float, ...]) -> list[jax.Array]:
            total = deviations
            for weight, stage in zip(weights, stages, strict=True):
                total = [d + self.length * weight * k for d, k in zip(total, stage, strict=True)]
            return total

        for (rows, factors), weights, force in zip(self.slopes, WEIGHTS, forced, strict=True):
            now = sum_of(weights)
            right = [
                sum((slope * d for slope, d in zip(row, now, strict=True) if slope is not None), start=f)
                for row, f in zip(rows, force, strict=True)
            ]
            stages.append(substitute(factors, right))
        return sum_of((*WEIGHTS[-1], DIAGONAL))
