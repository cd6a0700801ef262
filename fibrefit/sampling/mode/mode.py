"""Search for the mode of the posterior nearest to a fit, and its Laplace approximation."""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.errors import StudyError
from fibrefit.problem.posterior.log_posterior import LogPosterior
from fibrefit.problem.posterior.prior import Prior
from fibrefit.problem.statement.problem import Linearised
from fibrefit.sampling.approximation import Approximation

MOST_STEPS = 40
SETTLED = 1e-6
"""Gain of the log density promised by one more step, below which the mode is found."""
BLIND = 1e-12
"""Curvature below which, against the largest one on a common scale, a direction counts as flat."""


class _Local(NamedTuple):
    """Value, gradient ``(n,)`` and curvatures ``(n, n)``, of the likelihood by Gauss and Newton, and of the prior."""

    value: jax.Array
    gradient: jax.Array
    of_likelihood: jax.Array
    of_prior: jax.Array


@eqx.filter_jit
def _local(density: LogPosterior, point: jax.Array) -> _Local:
    problem, likelihood = density.problem, density.likelihood
    free, noise = density.split(point)
    linear = problem.linearised(problem.layout.values(free))
    slope = jax.jvp(problem.layout.values, (free,), (jnp.ones_like(free),))[1]
    log_density, push = jax.value_and_grad(likelihood.log_density, (0, 1))(linear.residuals, noise)
    rows = problem.layout.local_columns
    of_values = jnp.zeros_like(free).at[rows].add(jnp.sum(linear.slopes * push[0][..., None], axis=(1, 2)), mode="drop")
    of_prior, flat = jax.value_and_grad(density.log_prior)(point)
    # Priors are independent: the diagonal is all there is.
    bend = -jax.jvp(jax.grad(density.log_prior), (point,), (jnp.ones_like(point),))[1]
    gradient = flat + jnp.concatenate([of_values * slope, push[1]])
    return _Local(log_density + of_prior, gradient, _curvature(density, linear, slope, noise), bend)


def _curvature(density: LogPosterior, linear: Linearised, slope: jax.Array, noise: jax.Array) -> jax.Array:
    """Expected curvature of minus the log likelihood, ``(n, n)``."""
    layout, likelihood = density.problem.layout, density.likelihood
    innovations = likelihood.whitening.whiten(linear.residuals)
    slopes = jax.vmap(likelihood.whitening.whiten, in_axes=-1, out_axes=-1)(linear.slopes)
    levels = likelihood.levels(noise)[:, None]
    weight = jnp.broadcast_to(1.0 / levels**2, innovations.shape)
    if likelihood.heavy:
        freedom = jnp.exp(noise[-1])
        weight = weight * (freedom + 1.0) / (freedom + (innovations / levels) ** 2)
    local = jnp.einsum("rcti,rctj->rij", slopes * weight[..., None], slopes)
    rows, size = layout.local_columns, layout.size
    gram = jnp.zeros((size, size)).at[rows[:, :, None], rows[:, None, :]].add(local, mode="drop")
    whole = jnp.zeros((density.size, density.size)).at[:size, :size].set(gram * slope[:, None] * slope)
    if not likelihood.size:
        return whole
    of_noise = -jax.hessian(lambda x: likelihood.log_density(linear.residuals, x))(noise)
    return whole.at[size:, size:].set(of_noise)


def find_mode(density: LogPosterior, start: np.ndarray, priors: tuple[Prior, ...]) -> tuple[Approximation, np.ndarray]:
    """The mode nearest to a start, by damped Gauss-Newton steps.

    Parameters
    ----------
    density : LogPosterior
    start : (n,)
    priors : tuple of Prior
        Of all coordinates' values; where the data say nothing, they shape the cloud the walkers begin in.

    Returns
    -------
    approximation : Approximation
    from_likelihood : (n,)
        Share of each coordinate's precision that comes from the likelihood, 0 to 1.

    Raises
    ------
    StudyError
        If neither data nor priors limit some direction: there is no posterior.
    """
    point = np.asarray(start, dtype=float)
    floor = _prior_precision(density, priors, point)
    proper = np.array([prior.proper for prior in priors])
    here = jax.tree.map(np.asarray, _local(density, jnp.asarray(point)))
    damping = 0.0
    for _ in range(MOST_STEPS):
        curvature = _sum(here, floor, proper, density)
        step, gain = _step(curvature, here.gradient, damping)
        if gain < SETTLED:
            break
        trial = jax.tree.map(np.asarray, _local(density, jnp.asarray(point + step)))
        better = trial.value > here.value and np.isfinite(trial.gradient).all()
        if better:
            point, here = point + step, trial
        damping = damping / 10.0 if better else max(10.0 * damping, 1e-4)
        damping = 0.0 if damping < 1e-5 else damping
        if damping > 1e6:
            break
    curvature = _sum(here, floor, proper, density)
    covariance = _inverse(curvature)
    curved = np.clip(np.diag(here.of_likelihood), 0.0, None)
    from_likelihood = curved / np.where(np.diag(curvature) > 0.0, np.diag(curvature), 1.0)
    return Approximation(point, covariance, float(here.value)), from_likelihood


def _sum(here: _Local, floor: np.ndarray, proper: np.ndarray, density: LogPosterior) -> np.ndarray:
    """Curvature of likelihood and prior; flat directions of a proper prior get the precision of its spread."""
    # One that is not proper limits nothing, however its density bends in these coordinates.
    of_prior = np.where(proper, np.maximum(np.nan_to_num(here.of_prior), floor), 0.0)
    curvature = np.asarray(here.of_likelihood) + np.diag(of_prior)
    _refuse_flat(curvature, density)
    return curvature


def _refuse_flat(curvature: np.ndarray, density: LogPosterior) -> None:
    scale = np.sqrt(np.abs(np.diag(curvature)))
    safe = np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.eigh(curvature / np.outer(safe, safe))
    flat = vectors[:, values < BLIND * values.max()]
    lost = (np.abs(flat) > 1e-2).any(axis=1) | (scale == 0.0)
    if lost.any():
        names = np.array(density.problem.layout.free_names + density.likelihood.names)[lost]
        raise StudyError(
            f"prior of {names[0]}",
            f"neither the data nor a prior limit {' with '.join(names)}: the posterior is not a distribution",
            "a proper prior, for one of them at least",
            'Give it one, such as kind = "normal" or "half_normal", or bounds on both sides.',
        )


def _step(curvature: np.ndarray, gradient: np.ndarray, damping: float) -> tuple[np.ndarray, float]:
    scale = np.sqrt(np.abs(np.diag(curvature)))
    matrix = curvature / np.outer(scale, scale) + damping * np.eye(len(scale))
    step = np.linalg.solve(matrix, gradient / scale) / scale
    return step, float(0.5 * step @ gradient)


def _inverse(curvature: np.ndarray) -> np.ndarray:
    scale = np.sqrt(np.abs(np.diag(curvature)))
    values, vectors = np.linalg.eigh(curvature / np.outer(scale, scale))
    values = np.maximum(np.abs(values), BLIND)
    return (vectors / values) @ vectors.T / np.outer(scale, scale)


def _prior_precision(density: LogPosterior, priors: tuple[Prior, ...], point: np.ndarray) -> np.ndarray:
    """One over the variance of each coordinate under its prior; zero where the prior is not proper."""
    shares = (np.arange(200) + 0.5) / 200
    size = density.problem.layout.size
    values = np.asarray(density.values(jnp.asarray(point)))
    precision = np.zeros(len(priors))
    for i, prior in enumerate(priors):
        if not prior.proper:
            continue
        column = np.tile(values[:size], (len(shares), 1))
        if i < size:
            column[:, i] = prior.quantile(shares)
            coordinate = np.asarray(jax.vmap(density.problem.layout.free)(jnp.asarray(column)))[:, i]
        else:
            coordinate = np.log(prior.quantile(shares))
        precision[i] = 1.0 / coordinate.var()
    return precision
