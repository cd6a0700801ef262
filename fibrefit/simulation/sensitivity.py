"""Derivatives of the switched integrator.

They are those of the true hybrid flow: the instant of a switch moves with the parameters, and the implicit function
theorem at the located margin carries this through (the "saltation" of the hybrid-systems literature). Tangents are
propagated along the stored motion in one pass (forward sensitivity), step by step and arc by arc, all of them at once.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import jax
import numpy as np

from fibrefit.simulation.batching import materialise, nonzero_leaves, sequential
from fibrefit.simulation.forward_sensitivity import Tangents, TrajectoryTangents, propagate_tangents
from fibrefit.simulation.steps import Mode, State, System
from fibrefit.simulation.switched import Inputs, Solution, integrate


@partial(jax.custom_jvp)
def solve(
    system: System, start: State, start_time: jax.Array, mode: Mode, times: jax.Array, count: jax.Array, inputs: Inputs
) -> Solution:
    """Integrate a switched system over a grid of instants.

    Parameters
    ----------
    system : System
        Pytree of parameter values.
    start : pytree
        State at `start_time`; it is held until then.
    start_time : () in s
        Not before ``times[0]``.
    mode : pytree of () int
        Mode at `start_time`.
    times : (n_time,) in s
        Increasing. A point is also a bound on the step: nothing finer than a few steps is resolved.
    count : () int
        Number of points that matter; the rest is padding and keeps the starting state.
    inputs : dict of Course
        Measured inputs, between the same points.

    Returns
    -------
    Solution
        Its states and arcs are differentiable in `system`, `start`, `start_time` and `inputs`, in forward mode.
    """
    return integrate(system, start, mode, start_time, times, count, inputs)


@partial(solve.defjvp, symbolic_zeros=True)
def _solve_jvp(primals: Any, tangents: Any) -> tuple[Solution, Solution]:
    d_system, d_start, d_start_time, *_, d_inputs = tangents
    which = nonzero_leaves((d_system, d_inputs))
    laws = [jax.tree.leaves((d_system, d_inputs))[i] for i in which]
    inward = Tangents(laws, jax.tree.leaves(jax.tree.map(materialise, d_start)), materialise(d_start_time))
    solution, moved = sequential(partial(_solution_and_tangents, which))(
        primals, jax.tree.map(lambda d: d[None], inward)
    )
    return solution, _as_tangent(solution, jax.tree.map(lambda d: d[0], moved))


def _solution_and_tangents(
    which: tuple[int, ...], given: tuple, tangents: Tangents
) -> tuple[Solution, TrajectoryTangents]:
    system, start, start_time, mode, times, count, inputs = given
    solution = integrate(system, start, mode, start_time, times, count, inputs)
    return solution, propagate_tangents(which, system, inputs, times, count, solution, tangents)


def _as_tangent(solution: Solution, moved: TrajectoryTangents) -> Solution:
    state = partial(jax.tree.unflatten, jax.tree.structure(solution.states))
    blank = jax.tree.map(lambda value: np.zeros(value.shape, jax.dtypes.float0), solution)
    arcs = blank.arcs._replace(start=moved.start, state=state(moved.state), end=moved.end, reached=state(moved.reached))
    return blank._replace(states=state(moved.states), arcs=arcs)
