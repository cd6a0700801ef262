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

from fibrefit.rigs.rig import Start
from fibrefit.simulation.batching import materialise, nonzero_leaves, sequential
from fibrefit.simulation.forward_sensitivity import Tangents, TrajectoryTangents, propagate_tangents
from fibrefit.simulation.steps import System
from fibrefit.simulation.switched import Grid, Solution, integrate


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
    which = nonzero_leaves((d_system, d_grid.inputs))
    laws = [jax.tree.leaves((d_system, d_grid.inputs))[i] for i in which]
    inward = Tangents(laws, jax.tree.leaves(jax.tree.map(materialise, d_begin.state)), materialise(d_begin.time))
    solution, moved = sequential(partial(_solution_and_tangents, which))(
        primals, jax.tree.map(lambda d: d[None], inward)
    )
    return solution, _as_tangent(solution, jax.tree.map(lambda d: d[0], moved))


def _solution_and_tangents(
    which: tuple[int, ...], given: tuple, tangents: Tangents
) -> tuple[Solution, TrajectoryTangents]:
    system, begin, grid = given
    solution = integrate(system, begin, grid)
    return solution, propagate_tangents(which, system, grid, solution, tangents)


def _as_tangent(solution: Solution, moved: TrajectoryTangents) -> Solution:
    state = partial(jax.tree.unflatten, jax.tree.structure(solution.states))
    blank = jax.tree.map(lambda value: np.zeros(value.shape, jax.dtypes.float0), solution)
    arcs = blank.arcs._replace(start=moved.start, state=state(moved.state), end=moved.end, reached=state(moved.reached))
    return blank._replace(states=state(moved.states), arcs=arcs)
