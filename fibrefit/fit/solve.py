"""One descent: optimistix on the compressed residuals of a problem."""

from __future__ import annotations

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx

from fibrefit.problem.problem import Linearised, Problem, gram_root

DIFFERENCE = 1e-6
"""Step in a free coordinate for the slope of its value: widths need few digits."""


class Descent(NamedTuple):
    """Where a solver ended; leaves may carry a leading axis of starts.

    Parameters
    ----------
    free : (n_free,) free coordinates
    cost : () sum of squared residuals; infinite where it has none
    steps : () int
    success : () bool, the solver's own word
    """

    free: jax.Array
    cost: jax.Array
    steps: jax.Array
    success: jax.Array


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


def linearised(problem: Problem, values: np.ndarray) -> Linearised:
    """`Problem.linearised` in NumPy: the one compiled program that answers all questions about a single place.

    Parameters
    ----------
    problem : Problem
    values : (n_free,) in SI units
    """
    return jax.tree.map(np.asarray, problem.linearised(jnp.asarray(values)))


def gram_at(problem: Problem, values: np.ndarray) -> np.ndarray:
    """`Problem.gram` in NumPy, ``(n_free + 1, n_free + 1)`` per SI units of the values ``(n_free,)``."""
    linear, layout = linearised(problem, values), problem.layout
    columns = np.concatenate([linear.slopes, linear.residuals[..., None]], axis=-1)
    columns = columns.reshape(len(layout.records), -1, columns.shape[-1])
    places = np.column_stack([layout.local_columns, np.full(len(layout.records), layout.size)])
    whole = np.zeros((layout.size + 2, layout.size + 2))
    np.add.at(whole, (places[:, :, None], places[:, None, :]), columns.transpose(0, 2, 1) @ columns)
    return whole[:-1, :-1]


def widths(problem: Problem, free: np.ndarray) -> np.ndarray:
    """Steps ``(n_free,)`` that change the cost by about one each; solvers move in units of them."""
    values = problem.layout.values
    slope = (values(free + DIFFERENCE) - values(free - DIFFERENCE)) / (2.0 * DIFFERENCE)
    curvature = np.diag(gram_at(problem, values(free)))[:-1] * slope**2
    return 1.0 / np.sqrt(np.where(curvature > 0.0, curvature, 1.0))


@eqx.filter_jit
def descend(problem: Problem, start: Any, width: Any, counts: Any, max_steps: int = 60) -> Descent:
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
    max_steps : int
        For each horizon.

    Returns
    -------
    Descent
        A pure function of arrays: map it over starts, or over problems of equal shape.
    """

    def stage(carry: tuple[jax.Array, jax.Array], horizon: tuple[jax.Array, Any]) -> Any:
        (free, steps), (count, near) = carry, horizon
        solution: Any = optx.least_squares(
            lambda step, part: compressed_residuals(free + width * step, part),
            optx.LevenbergMarquardt(rtol=1e-3 * near**2, atol=0.1 * near),
            jnp.zeros_like(free),
            args=problem.until(count),
            max_steps=max_steps,
            throw=False,
        )
        end = free + width * solution.value
        cost = jnp.sum(solution.state.f_info.residual**2)
        sound = jnp.isfinite(end).all() & jnp.isfinite(cost)
        steps = steps + solution.stats["num_steps"]
        success = sound & (solution.result == optx.RESULTS.successful)
        return (jnp.where(sound, end, free), steps), (jnp.where(sound, cost, jnp.inf), success)

    # What an early horizon teaches is good enough to a tenth of its error; only the last has to be exact.
    near = jnp.where(jnp.arange(len(counts)) < len(counts) - 1, 1.0, 1e-3)
    (free, steps), (cost, success) = jax.lax.scan(stage, (start, jnp.zeros((), dtype=int)), (counts, near))
    return Descent(free, cost[-1], steps, success[-1])


@eqx.filter_jit
def descend_all(problem: Problem, starts: Any, width: Any, counts: Any) -> Descent:
    """`descend` from many starts ``(n_start, n_free)``, each with horizons of its own ``(n_start, n_stage, n_record)``.

    Returns
    -------
    Descent
        Leaves ``(n_start, ...)``.
    """
    # One after the other: starts need very different numbers of steps, and in lock step all would wait for the slowest.
    return jax.lax.map(lambda pair: descend(problem, pair[0], width, pair[1]), (starts, counts))
