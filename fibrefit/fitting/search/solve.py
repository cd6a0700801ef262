"""One descent: optimistix on the compressed residuals of a problem."""

from __future__ import annotations

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.arrays import assembled, gram_root
from fibrefit.core.programs import kept_program
from fibrefit.problem import Linearised, Problem

MAX_STEPS = 60
ROUGH_STEPS = 12
"""The same where inputs are noisy: the cost of a motion that follows their errors is rough, and a descent creeps from
kink to kink towards a place that is none of the likelihood's. Twelve come into its valley, in a fifth of the time."""
FOR_A_HORIZON, TO_THE_END = 1.0, 1e-3
"""What an early horizon teaches is good enough to a tenth of its error; only the last has to be exact."""
STRIDE = 10.0
"""Unit of the solver's variables in widths: its first damping is one part in a hundred of the curvature."""
BOLDNESS = {"high_cutoff": 0.75, "low_cutoff": 0.1, "high_constant": 10.0, "low_constant": 0.1}
"""Of the trust region: measured on drops, a third fewer steps than with what the solver brings."""
ROUNDING = 1e-12
"""Share of the cost below which its changes are rounding: of a step, a predicted reduction of no more is not tested."""
DIFFERENCE = 1e-6
"""Step in a free coordinate for the slope of its value: widths need few digits."""


class Stopping(NamedTuple):
    """When a descent ends.

    Parameters
    ----------
    near : ()
        How exact it is, in units of the width of its steps: `FOR_A_HORIZON` or `TO_THE_END`.
    steps : int
        At the most.
    """

    near: Any
    steps: int = MAX_STEPS


class Descent(NamedTuple):
    """Where a solver ended, in NumPy or JAX; leaves may carry a leading axis of starts.

    Parameters
    ----------
    free : (n_free,) free coordinates
    cost : () sum of squared residuals; infinite where it has none
    steps : () int
    success : () bool, the solver's own word
    """

    free: Any
    cost: Any
    steps: Any
    success: Any


@jax.custom_jvp
def compressed_residuals(free: jax.Array, problem: Problem) -> jax.Array:
    """A vector of ``n_free + 1`` numbers with the cost and the Gauss-Newton model of all residuals.

    Law
    ---
    From ``G = [J r]'[J r] = R'R`` it is the last column of R, and its Jacobian the others: the same cost ``r'r``, the
    same gradient ``J'r``, the same normal matrix ``J'J``, without a solver ever seeing the tens of thousands of rows.

    Parameters
    ----------
    free : (n_free,) free coordinates
    problem : Problem

    Returns
    -------
    (n_free + 1,)
    """
    return _root(free, problem)[:, -1]


@compressed_residuals.defjvp
def _compressed_jvp(primals: tuple, tangents: tuple) -> tuple[jax.Array, jax.Array]:
    root = _root(*primals)
    return root[:, -1], root[:, :-1] @ tangents[0]


def _root(free: jax.Array, problem: Problem) -> jax.Array:
    values, slope = jax.jvp(problem.layout.values, (free,), (jnp.ones_like(free),))
    slope = jnp.append(slope, 1.0)
    return gram_root(problem.gram(values) * slope[:, None] * slope)


def linearised(problem: Problem, local: np.ndarray) -> Linearised:
    """`Problem.linearised_at` in NumPy: the one compiled program that answers all questions about a single place.

    Parameters
    ----------
    problem : Problem
    local : (n_record, n_local) in SI units
    """
    return jax.tree.map(np.asarray, problem.evaluate(local)[0])


def gram_at(problem: Problem, values: np.ndarray) -> np.ndarray:
    """`Problem.gram` in NumPy, ``(n_free + 1, n_free + 1)`` per SI units of the values ``(n_free,)``."""
    layout = problem.layout
    linear = linearised(problem, layout.local(np.asarray(values)))
    columns = np.concatenate([linear.slopes, linear.residuals[..., None]], axis=-1)
    columns = columns.reshape(len(layout.records), -1, columns.shape[-1])
    places = np.column_stack([layout.local_columns, np.full(len(layout.records), layout.size)])
    # A value held in a record has the place behind that of the residuals.
    # Where a motion runs away products are beyond all numbers, and so is the cost: what asks for it goes elsewhere.
    with np.errstate(over="ignore", invalid="ignore"):
        products = columns.transpose(0, 2, 1) @ columns
    return assembled(products, places, layout.size + 1) + layout.prior_gram(values)


def widths(problem: Problem, free: np.ndarray) -> np.ndarray:
    """Steps ``(n_free,)`` that change the cost by about one each; solvers move in units of them."""
    values = problem.layout.values
    slope = (values(free + DIFFERENCE) - values(free - DIFFERENCE)) / (2.0 * DIFFERENCE)
    curvature = np.diag(gram_at(problem, values(free)))[:-1] * slope**2
    return 1.0 / np.sqrt(np.where(curvature > 0.0, curvature, 1.0))


@kept_program
def descend(problem: Problem, start: Any, width: Any, counts: Any) -> Descent:
    """Levenberg-Marquardt from one start, over horizons that grow to the whole record.

    A wrong stiffness mistimes every later bounce, and the cost over a whole record has a minimum for each bounce that
    can be matched by mistake. Over the first contact it has one; what that teaches times the next contacts well
    enough, and so on.

    Parameters
    ----------
    problem : Problem
    start : (n_free,) free coordinates
    width : (n_free,) unit of the steps, see `widths`
    counts : (n_stage, n_record) int
        Number of samples of each horizon.

    Returns
    -------
    Descent
        A pure function of arrays: map it over starts, or over problems of equal shape.
    """

    def stage(carry: tuple[jax.Array, jax.Array], horizon: tuple[jax.Array, jax.Array]) -> Any:
        found = _descend(problem, carry[0], width, horizon[0], Stopping(horizon[1]))
        return (found.free, carry[1] + found.steps), (found.cost, found.success)

    near = jnp.where(jnp.arange(len(counts)) < len(counts) - 1, FOR_A_HORIZON, TO_THE_END)
    (free, steps), (cost, success) = jax.lax.scan(stage, (start, jnp.zeros((), dtype=int)), (counts, near))
    return Descent(free, cost[-1], steps, success[-1])


@kept_program
def descend_all(problem: Problem, starts: Any, width: Any, counts: Any, active: Any, stopping: Stopping) -> Descent:
    """Levenberg-Marquardt over one horizon from many starts.

    Parameters
    ----------
    problem : Problem
    starts : (n_start, n_free) free coordinates
    width : (n_free,) unit of the steps, see `widths`
    counts : (n_start, n_record) int
        Number of samples of each start's horizon.
    active : (n_start,) bool
        Starts that are not stay where they are, at no cost of time.
    stopping : Stopping

    Returns
    -------
    Descent
        Leaves ``(n_start, ...)``.
    """

    def one(row: tuple[Any, Any, Any]) -> Descent:
        start, count, active = row
        still = Descent(start, jnp.asarray(jnp.inf), jnp.zeros((), dtype=int), jnp.asarray(False))
        return jax.lax.cond(active, lambda: _descend(problem, start, width, count, stopping), lambda: still)

    # One after the other: starts need very different numbers of steps, and in lock step all would wait for the slowest.
    return jax.lax.map(one, (starts, counts, active))


def _descend(problem: Problem, start: Any, width: Any, count: Any, stopping: Stopping) -> Descent:
    """One horizon; where that ends nowhere, the start is kept."""
    # A program that was compiled before does without.
    import optimistix as optx

    from fibrefit.fitting.search.trust_region import TrustRegion

    rtol, atol = 1e-3 * stopping.near**2, 0.1 * stopping.near / STRIDE
    search: Any = TrustRegion(**BOLDNESS, rounding=ROUNDING)
    solver = eqx.tree_at(lambda solver: solver.search, optx.LevenbergMarquardt(rtol=rtol, atol=atol), search)
    stride = STRIDE * width
    solution: Any = optx.least_squares(
        lambda step, part: compressed_residuals(start + stride * step, part),
        solver,
        jnp.zeros_like(start),
        args=problem.until(count),
        max_steps=stopping.steps,
        throw=False,
    )
    end = start + stride * solution.value
    cost = jnp.sum(solution.state.f_info.residual**2)
    sound = jnp.isfinite(end).all() & jnp.isfinite(cost)
    success = sound & (solution.result == optx.RESULTS.successful)
    return Descent(jnp.where(sound, end, start), jnp.where(sound, cost, jnp.inf), solution.stats["num_steps"], success)
