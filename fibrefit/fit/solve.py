"""One descent: optimistix on the compressed residuals of a problem."""

from __future__ import annotations

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx

from fibrefit.problem.problem import Problem, gram_root


class Descent(NamedTuple):
    """Where a solver ended; leaves may carry a leading axis of starts.

    Parameters
    ----------
    free : (n_free,) free coordinates
    steps : () int
    success : () bool, the solver's own word
    """

    free: jax.Array
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
    return gram_root(free_gram(problem, free))


@eqx.filter_jit
def free_gram(problem: Problem, free: jax.Array) -> jax.Array:
    """`Problem.gram` per unit of the free coordinates."""
    slope = jax.jvp(problem.layout.values, (free,), (jnp.ones_like(free),))[1]
    slope = jnp.append(slope, 1.0)
    return problem.gram(problem.layout.values(free)) * slope[:, None] * slope


def widths(problem: Problem, free: jax.Array) -> jax.Array:
    """Steps ``(n_free,)`` that change the cost by about one each; solvers move in units of them."""
    curvature = jnp.diag(free_gram(problem, free))[:-1]
    return 1.0 / jnp.sqrt(jnp.where(curvature > 0.0, curvature, 1.0))


@eqx.filter_jit
def descend(problem: Problem, start: jax.Array, width: jax.Array, counts: jax.Array, max_steps: int = 60) -> Descent:
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

    def stage(carry: tuple[jax.Array, jax.Array], count: jax.Array) -> Any:
        free, steps = carry
        solution = optx.least_squares(
            lambda step, part: compressed_residuals(free + width * step, part),
            optx.LevenbergMarquardt(rtol=1e-9, atol=1e-4),
            jnp.zeros_like(free),
            args=problem.until(count),
            max_steps=max_steps,
            throw=False,
        )
        end = free + width * solution.value
        sound = jnp.isfinite(end).all()
        steps = steps + solution.stats["num_steps"]
        return (jnp.where(sound, end, free), steps), sound & (solution.result == optx.RESULTS.successful)

    (free, steps), success = jax.lax.scan(stage, (start, 0), counts)
    return Descent(free, steps, success[-1])


@eqx.filter_jit
def descend_all(problem: Problem, starts: jax.Array, width: jax.Array, counts: jax.Array) -> Descent:
    """`descend` from many starts ``(n_start, n_free)``, each with horizons of its own ``(n_start, n_stage, n_record)``.

    Returns
    -------
    Descent
        Leaves ``(n_start, ...)``.
    """
    # One after the other: starts need very different numbers of steps, and in lock step all would wait for the slowest.
    return jax.lax.map(lambda pair: descend(problem, pair[0], width, pair[1]), (starts, counts))


@eqx.filter_jit
def costs(problem: Problem, frees: jax.Array) -> jax.Array:
    """Sums of squared residuals, ``(n_start,)``, at free coordinates ``(n_start, n_free)``."""
    return jax.lax.map(lambda free: jnp.sum(problem.residuals(problem.layout.values(free)) ** 2), frees)
