"""Search for the mode of the posterior nearest to a fit, and its Laplace approximation.

It is not `problem.estimate.gauss_newton`, whose objective is a sum of squares under normal priors: here levels of the
noise and degrees of freedom are among the unknowns, priors have any shape and curve differently at each place, and
deviations between records are integrated over a grid. The matrices of records are assembled by the same function.
"""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.errors import StudyError
from fibrefit.core.programs import column_products
from fibrefit.problem.posterior.log_posterior import Conditional, LogPosterior, RecordPlace
from fibrefit.problem.posterior.prior import Prior
from fibrefit.problem.statement.layout import assembled
from fibrefit.problem.statement.matrices import equilibrated, scale_of
from fibrefit.sampling.approximation import Approximation
from fibrefit.sampling.thresholds import FLAT_PART

MOST_STEPS = 100
"""Of a search, half of them in vain where it begins among other bounces: one that needs more is given up."""
SETTLED = 1e-6
"""Gain of the log density promised by one more step, below which the mode is found."""
STUCK_AT = 1e6
"""Damping of steps that are too short to matter: a density that is rough at this scale has no higher place nearby."""
BLIND = 1e-12
"""Curvature below which, against the largest one on a common scale, a direction counts as flat."""


class _Local(NamedTuple):
    """Value, gradient ``(n,)`` and curvatures ``(n, n)``, of the likelihood by Gauss and Newton, and of the prior.

    The curvature of the likelihood is that without deviations between records; ``cross`` ``(n_record, n,
    n_scattering)`` holds the products of slopes with those of the deviations, ``known`` what is known of them.
    """

    value: jax.Array
    gradient: jax.Array
    of_likelihood: jax.Array
    of_prior: jax.Array
    cross: jax.Array | None
    known: Conditional | None


@eqx.filter_jit
def _local(density: LogPosterior, point: jax.Array) -> _Local:
    layout, free, noise = density.problem.layout, *density.split(point)
    place = density.place(layout.values(free))
    seen = _seen(density, place)
    slope = jax.jvp(layout.values, (free,), (jnp.ones_like(free),))[1]
    value, gradient = jax.value_and_grad(density.log_likelihood)(point)
    of_prior, flat = jax.value_and_grad(density.log_prior)(point)
    # Priors are independent: the diagonal is all there is.
    bend = -jax.jvp(jax.grad(density.log_prior), (point,), (jnp.ones_like(point),))[1]
    curvature, cross = _curvature(density, seen, slope, noise)
    known = None if density.random_effects is None else density.conditional(seen.innovations, noise, place)
    return _Local(value + of_prior, gradient + flat, curvature, bend, cross, known)


class _Seen(NamedTuple):
    """Innovations at a place and how they move with what records share and have of their own.

    Parameters
    ----------
    innovations : (n_record, n_channel, n_time)
    slopes : (n_record, n_channel, n_time, n_local_free)
    beside, across : (n_record, n_local_free, n_local_free) and (n_record, n_local_free, n_scattering)
        Products of the slopes of errors of inputs that follow, and with those that follow a deviation; 0 without them.
    """

    innovations: jax.Array
    slopes: jax.Array
    beside: jax.Array | float = 0.0
    across: jax.Array | float = 0.0


def _seen(density: LogPosterior, place: RecordPlace) -> _Seen:
    layout, inputs, random_effects = density.problem.layout, density.inputs, density.random_effects
    linear, whiten = density.problem.linearised_at(place.local), density.likelihood.whitening.whiten
    innovations, slopes = whiten(linear.residuals), jax.vmap(whiten, in_axes=-1, out_axes=-1)(linear.slopes)
    stretched = jnp.ones((len(place.local), len(layout.slots)))
    if random_effects is not None and place.eta is not None:
        stretched = stretched.at[:, jnp.array(random_effects.columns)].set(jnp.exp(place.eta))
    stretched = stretched[:, jnp.array(layout.local_free)]
    if inputs is None:
        return _Seen(innovations, slopes * stretched[:, None, None])
    moved = inputs.squares[:, :-1, :-1] * stretched[:, :, None]
    across: jax.Array | float = 0.0
    if random_effects is not None:
        places = inputs.places(random_effects.columns)
        across = moved[:, :, places] * inputs.local[:, None, places]
    slopes = (slopes + inputs.slopes) * stretched[:, None, None]
    return _Seen(inputs.at_best(innovations, place.local), slopes, moved * stretched[:, None], across)


def _curvature(
    density: LogPosterior, seen: _Seen, slope: jax.Array, noise: jax.Array
) -> tuple[jax.Array, jax.Array | None]:
    """Expected curvature of minus the log likelihood, ``(n, n)``, and products with the slopes of deviations."""
    layout, likelihood = density.problem.layout, density.likelihood
    levels = likelihood.levels(noise)[:, None]
    weight = jnp.broadcast_to(1.0 / levels**2, seen.innovations.shape)
    if likelihood.heavy:
        freedom = jnp.exp(noise[-1])
        weight = weight * (freedom + 1.0) / (freedom + (seen.innovations / levels) ** 2)
    weighted = seen.slopes * weight[..., None]
    local = _over_samples(weighted, seen.slopes) + seen.beside
    rows, size = layout.local_columns, layout.size
    gram = assembled(local, rows, size)
    whole = jnp.zeros((density.size, density.size)).at[:size, :size].set(gram * slope[:, None] * slope)
    cross = None
    if density.random_effects is not None:
        own = _over_samples(weighted, density.random_effects.slopes) + seen.across
        number = jnp.arange(len(rows))[:, None]
        cross = jnp.zeros((len(rows), density.size, own.shape[-1])).at[number, rows].add(own, mode="drop")
        cross = cross.at[:, :size].multiply(slope[:, None]).at[:, size:].set(0.0)
    if not likelihood.size:
        return whole, cross
    return whole.at[size:, size:].set(likelihood.information(seen.innovations, noise)), cross


def _over_samples(one: jax.Array, other: jax.Array) -> jax.Array:
    """Products ``(n_record, i, j)`` of columns ``(n_record, n_channel, n_time, i)`` and ``(..., j)``."""
    return column_products(*(array.reshape(len(array), -1, array.shape[-1]) for array in (one, other)))


class _OfGrid(NamedTuple):
    """Under each standard deviation between records: its probability at the point, curvature taken off, gradient."""

    logs: np.ndarray
    less: np.ndarray
    beside: np.ndarray

    @property
    def log_weight(self) -> np.ndarray:
        return np.asarray(self.logs - np.logaddexp.reduce(self.logs))

    @property
    def weight(self) -> np.ndarray:
        return np.exp(self.log_weight)


def _of_grid(density: LogPosterior, here: _Local) -> _OfGrid | None:
    """What deviations take off the curvature ``(n_grid, n, n)`` and add to the mean gradient ``(n_grid, n)``."""
    if here.known is None or here.cross is None or density.random_effects is None:
        return None
    sigma = np.asarray(density.random_effects.sigma)[:, None, :]
    logs, pull, curvature = map(np.asarray, here.known)
    matrix = sigma[..., None] * curvature * sigma[..., None, :] + np.eye(sigma.shape[-1])
    inner = sigma[..., None] * np.linalg.inv(matrix) * sigma[..., None, :]
    less = np.einsum("rik,grkl,rjl->gij", here.cross, inner, here.cross, optimize=True)
    pushed = np.einsum("rik,grkl,rl->gi", here.cross, inner, pull, optimize=True)
    found = _OfGrid(logs, less, pushed)
    return found._replace(beside=pushed - found.weight @ pushed)


def _mixed(here: _Local, curvature: np.ndarray, of_grid: _OfGrid) -> tuple[np.ndarray, float]:
    """Covariance of all standard deviations together, and the logarithm of their integrals' sum (Laplace)."""
    each = np.stack([_inverse(curvature - less) for less in of_grid.less])
    gradient = here.gradient + of_grid.beside
    moved = np.einsum("gij,gj->gi", each, gradient)
    gain = 0.5 * np.einsum("gi,gi->g", gradient, moved)
    logs = here.value + of_grid.log_weight + gain
    logs += 0.5 * (np.linalg.slogdet(2.0 * np.pi * each)[1])
    top = logs.max()
    weight = np.exp(logs - top)
    total = float(top + np.log(weight.sum()))
    weight /= weight.sum()
    away = moved - weight @ moved
    return np.einsum("g,gij->ij", weight, each) + np.einsum("g,gi,gj->ij", weight, away, away), total


def find_mode(density: LogPosterior, start: np.ndarray, priors: tuple[Prior, ...]) -> tuple[Approximation, bool]:
    """The mode nearest to a start, by damped Gauss-Newton steps.

    Parameters
    ----------
    start : (n,)
    priors : tuple of Prior
        Of all coordinates' values; where the data say nothing, they shape the cloud the walkers begin in.

    Returns
    -------
    approximation : Approximation
    arrived : bool
        Whether no step leads higher. A search that is given up stands on a slope: what Laplace's method counts there
        lies at the top of it, and may be another mode's.

    Raises
    ------
    StudyError
        If neither data nor priors limit some direction: there is no posterior.
    """
    point = np.asarray(start, dtype=float)
    floor = _prior_precision(density, priors, point)
    proper = np.array([prior.proper for prior in priors])
    here = jax.tree.map(np.asarray, _local(density, jnp.asarray(point)))
    damping, arrived = 0.0, False
    for _ in range(MOST_STEPS):
        curvature = _sum(here, floor, proper, density)
        of_grid = _of_grid(density, here)
        if of_grid is not None:
            curvature = curvature - np.einsum("g,gij->ij", of_grid.weight, of_grid.less)
        step, gain = _step(curvature, here.gradient, damping)
        if arrived := gain < SETTLED:
            break
        trial = jax.tree.map(np.asarray, _local(density, jnp.asarray(point + step)))
        better = trial.value > here.value and np.isfinite(trial.gradient).all()
        if better:
            point, here = point + step, trial
        damping = damping / 10.0 if better else max(10.0 * damping, 1e-4)
        damping = 0.0 if damping < 1e-5 else damping
        if arrived := damping > STUCK_AT:
            break
    curvature = _sum(here, floor, proper, density)
    of_grid, log_mass = _of_grid(density, here), None
    if of_grid is None:
        covariance = _inverse(curvature)
    else:
        covariance, log_mass = _mixed(here, curvature, of_grid)
        # What slopes promise and no step brings, as where the density has a kink, is no part of it.
        curvature = curvature - np.einsum("g,gij->ij", of_grid.weight, of_grid.less)
        log_mass -= max(_step(curvature, here.gradient, 0.0)[1], 0.0)
    return Approximation(point, covariance, float(here.value), log_mass), arrived


def _sum(here: _Local, floor: np.ndarray, proper: np.ndarray, density: LogPosterior) -> np.ndarray:
    """Curvature of likelihood and prior; flat directions of a proper prior get the precision of its spread."""
    # One that is not proper limits nothing, however its density bends in these coordinates.
    of_prior = np.where(proper, np.maximum(np.nan_to_num(here.of_prior), floor), 0.0)
    curvature = np.asarray(here.of_likelihood) + np.diag(of_prior)
    _refuse_flat(curvature, density)
    return curvature


def _refuse_flat(curvature: np.ndarray, density: LogPosterior) -> None:
    scale = scale_of(np.abs(curvature))
    values, vectors = np.linalg.eigh(equilibrated(curvature, scale))
    flat = vectors[:, values < BLIND * values.max()]
    lost = (np.abs(flat) > FLAT_PART).any(axis=1) | (np.diag(curvature) == 0.0)
    if lost.any():
        names = np.array(density.problem.layout.free_names + density.likelihood.names)[lost]
        raise StudyError(
            f"prior of {names[0]}",
            f"neither the data nor a prior limit {' with '.join(names)}: the posterior is not a distribution",
            "a proper prior, for one of them at least",
            'Give it one, such as kind = "normal" or "half_normal", or bounds on both sides.',
        )


def _step(curvature: np.ndarray, gradient: np.ndarray, damping: float) -> tuple[np.ndarray, float]:
    scale = scale_of(np.abs(curvature))
    matrix = equilibrated(curvature, scale) + damping * np.eye(len(scale))
    step = np.linalg.solve(matrix, gradient / scale) / scale
    return step, float(0.5 * step @ gradient)


def _inverse(curvature: np.ndarray) -> np.ndarray:
    scale = scale_of(np.abs(curvature))
    values, vectors = np.linalg.eigh(equilibrated(curvature, scale))
    values = np.maximum(np.abs(values), BLIND)
    return equilibrated((vectors / values) @ vectors.T, scale)


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
