"""The mode of the posterior nearest to a fit, and a normal (Laplace) approximation of it.

The search is not `problem.estimate.gauss_newton`, whose objective is a sum of squares under normal priors: here levels
of the noise and degrees of freedom are among the unknowns, priors have any shape and curve differently at each place,
and deviations between records are integrated over a grid. The matrices of records are assembled by the same function.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.arrays import assembled
from fibrefit.core.errors import StudyError, UsageError
from fibrefit.core.matrices import equilibrated, scale_of
from fibrefit.core.programs import column_products
from fibrefit.sampling.density.log_posterior import Conditional, LogPosterior
from fibrefit.sampling.density.prior import Prior

MOST_STEPS = 100
"""Of a search, half of them in vain where it begins among other bounces: one that needs more is given up."""
BLIND = 1e-12
"""Curvature below which, against the largest one on a common scale, a direction counts as flat."""


@dataclass(frozen=True)
class Approximation:
    """Normal approximation of a log density: where walkers begin, what they propose, a first value of its integral.

    Parameters
    ----------
    centre : (n,)
    covariance : (n, n)
    log_density : float
        At the centre.
    log_mass : float or None
        Logarithm of the density's integral where more is known of it than these.
    """

    centre: np.ndarray
    covariance: np.ndarray
    log_density: float
    log_mass: float | None = None

    @cached_property
    def root(self) -> np.ndarray:
        """Lower triangular root of the covariance."""
        scale = scale_of(self.covariance)
        return scale[:, None] * np.linalg.cholesky(equilibrated(self.covariance, scale))

    @property
    def log_evidence(self) -> float:
        """Logarithm of the integral of the density by Laplace's method."""
        if self.log_mass is not None:
            return self.log_mass
        size = len(self.centre)
        return float(self.log_density + 0.5 * size * np.log(2.0 * np.pi) + np.sum(np.log(np.diag(self.root))))

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Mahalanobis distance of points ``(..., n)`` from the centre, in standard deviations."""
        whitened = np.linalg.solve(self.root, np.moveaxis(points - self.centre, -1, 0).reshape(len(self.centre), -1))
        return np.sqrt(np.sum(whitened**2, axis=0)).reshape(points.shape[:-1])

    def propose(self, points: np.ndarray, random: Any) -> tuple[np.ndarray, np.ndarray]:
        """Draws of Student's t around the centre, whatever the points, and what the detailed balance takes for it."""
        count, size = points.shape
        # Degrees of freedom: heavier tails than any posterior it is meant for, and still a good proposal.
        freedom = 12.0
        spread = np.sqrt(freedom / random.chisquare(freedom, size=(count, 1)))
        drawn = self.centre + spread * random.standard_normal((count, size)) @ self.root.T
        log_old, log_new = (
            -0.5 * (freedom + size) * np.log1p(self.distance(at) ** 2 / freedom) for at in (points, drawn)
        )
        return drawn, log_old - log_new

    def cloud(
        self, log_density: Callable[[np.ndarray], np.ndarray], count: int, random: Any
    ) -> tuple[np.ndarray, np.ndarray]:
        """Starting points, none of them impossible.

        Parameters
        ----------
        log_density : callable ``(n_point, n) -> (n_point,)``
        random : numpy.random.RandomState or numpy.random.Generator

        Returns
        -------
        points : (count, n)
        log_densities : (count,)

        Raises
        ------
        UsageError
            If the density is zero nearly everywhere around the centre.
        """
        points = np.empty((count, len(self.centre)))
        found = np.full(count, -np.inf)
        # Wider than the posterior at first, so that agreement has to be earned; after 40 tries a seventieth as wide.
        lost, width = np.ones(count, dtype=bool), 1.5
        for _ in range(40):
            points[lost] = self.centre + width * random.standard_normal((lost.sum(), len(self.centre))) @ self.root.T
            found[lost] = log_density(points[lost])
            lost = ~np.isfinite(found)
            if not lost.any():
                return points, found
            width *= 0.9
        raise UsageError(
            "start",
            f"{np.sum(lost)} of {count} walkers find no possible place around it",
            "a start inside all bounds and priors",
            "Check the priors against the fit.",
        )


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
    layout, likelihood, free, noise = density.problem.layout, density.likelihood, *density.split(point)
    inputs, random_effects = density.inputs, density.random_effects
    place = density.place(layout.values(free))

    # Innovations and how they move with the values of each record, its deviations and errors of inputs following.
    linear, whiten = density.problem.linearised_at(place.local), likelihood.whitening.whiten
    innovations, slopes = whiten(linear.residuals), jax.vmap(whiten, in_axes=-1, out_axes=-1)(linear.slopes)
    stretched = jnp.ones((len(place.local), len(layout.slots)))
    if random_effects is not None and place.eta is not None:
        stretched = stretched.at[:, jnp.array(random_effects.columns)].set(jnp.exp(place.eta))
    stretched = stretched[:, jnp.array(layout.local_free)]
    of_inputs: jax.Array | float = 0.0
    across: jax.Array | float = 0.0
    if inputs is None:
        slopes = slopes * stretched[:, None, None]
    else:
        moved = inputs.squares[:, :-1, :-1] * stretched[:, :, None]
        if random_effects is not None:
            places = inputs.places(random_effects.columns)
            across = moved[:, :, places] * inputs.local[:, None, places]
        slopes = (slopes + inputs.slopes) * stretched[:, None, None]
        innovations, of_inputs = inputs.at_best(innovations, place.local), moved * stretched[:, None]

    slope = jax.jvp(layout.values, (free,), (jnp.ones_like(free),))[1]
    value, gradient = jax.value_and_grad(density.log_likelihood)(point)
    of_prior, flat = jax.value_and_grad(density.log_prior)(point)
    # Priors are independent: the diagonal is all there is.
    bend = -jax.jvp(jax.grad(density.log_prior), (point,), (jnp.ones_like(point),))[1]

    # Expected curvature of minus the log likelihood, and products with the slopes of deviations.
    levels = likelihood.levels(noise)[:, None]
    weight = jnp.broadcast_to(1.0 / levels**2, innovations.shape)
    if likelihood.heavy:
        freedom = jnp.exp(noise[-1])
        weight = weight * (freedom + 1.0) / (freedom + (innovations / levels) ** 2)
    weighted = slopes * weight[..., None]
    rows, size = layout.local_columns, layout.size
    gram = assembled(_over_samples(weighted, slopes) + of_inputs, rows, size)
    whole = jnp.zeros((density.size, density.size)).at[:size, :size].set(gram * slope[:, None] * slope)
    cross = None
    if random_effects is not None:
        own = _over_samples(weighted, random_effects.slopes) + across
        number = jnp.arange(len(rows))[:, None]
        cross = jnp.zeros((len(rows), density.size, own.shape[-1])).at[number, rows].add(own, mode="drop")
        cross = cross.at[:, :size].multiply(slope[:, None]).at[:, size:].set(0.0)
    if likelihood.size:
        whole = whole.at[size:, size:].set(likelihood.information(innovations, noise))

    known = None if random_effects is None else density.conditional(innovations, noise, place)
    return _Local(value + of_prior, gradient + flat, whole, bend, cross, known)


def _over_samples(one: jax.Array, other: jax.Array) -> jax.Array:
    """Products ``(n_record, i, j)`` of columns ``(n_record, n_channel, n_time, i)`` and ``(..., j)``."""
    return column_products(*(array.reshape(len(array), -1, array.shape[-1]) for array in (one, other)))


class _Curvature(NamedTuple):
    """Curvature of minus the log density ``(n, n)``: without deviations, and with deviations integrated out.

    `grid` holds, under each standard deviation between records, the logarithm of its probability at the point
    ``(n_grid,)``, the curvature that deviations take off ``(n_grid, n, n)`` and the gradient that they add to the mean
    one ``(n_grid, n)``.
    """

    undeviating: np.ndarray
    marginal: np.ndarray
    grid: tuple[np.ndarray, np.ndarray, np.ndarray] | None


def _curvature(density: LogPosterior, here: _Local, floor: np.ndarray, proper: np.ndarray) -> _Curvature:
    """Curvature of likelihood and prior; flat directions of a proper prior get the precision of its spread.

    Raises
    ------
    StudyError
        If neither data nor priors limit some direction.
    """
    # One that is not proper limits nothing, however its density bends in these coordinates.
    of_prior = np.where(proper, np.maximum(np.nan_to_num(here.of_prior), floor), 0.0)
    undeviating = np.asarray(here.of_likelihood) + np.diag(of_prior)
    scale = scale_of(np.abs(undeviating))
    values, vectors = np.linalg.eigh(equilibrated(undeviating, scale))
    flat = vectors[:, values < BLIND * values.max()]
    # A component below a hundredth is rounding: the parameter is not named.
    lost = (np.abs(flat) > 0.01).any(axis=1) | (np.diag(undeviating) == 0.0)
    if lost.any():
        names = np.array(density.problem.layout.free_names + density.likelihood.names)[lost]
        raise StudyError(
            f"prior of {names[0]}",
            f"neither the data nor a prior limit {' with '.join(names)}: the posterior is not a distribution",
            "a proper prior, for one of them at least",
            'Give it one, such as kind = "normal" or "half_normal", or bounds on both sides.',
        )
    if here.known is None or here.cross is None or density.random_effects is None:
        return _Curvature(undeviating, undeviating, None)

    sigma = np.asarray(density.random_effects.sigma)[:, None, :]
    logs, pull, curvature = map(np.asarray, here.known)
    matrix = sigma[..., None] * curvature * sigma[..., None, :] + np.eye(sigma.shape[-1])
    inner = sigma[..., None] * np.linalg.inv(matrix) * sigma[..., None, :]
    taken = np.einsum("rik,grkl,rjl->gij", here.cross, inner, here.cross, optimize=True)
    pushed = np.einsum("rik,grkl,rl->gi", here.cross, inner, pull, optimize=True)
    log_weight = np.asarray(logs - np.logaddexp.reduce(logs))
    weight = np.exp(log_weight)
    marginal = undeviating - np.einsum("g,gij->ij", weight, taken)
    return _Curvature(undeviating, marginal, (log_weight, taken, pushed - weight @ pushed))


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
        step, gain = _step(_curvature(density, here, floor, proper).marginal, here.gradient, damping)
        # A gain of the log density that nothing shows.
        if arrived := gain < 1e-6:
            break
        trial = jax.tree.map(np.asarray, _local(density, jnp.asarray(point + step)))
        better = trial.value > here.value and np.isfinite(trial.gradient).all()
        if better:
            point, here = point + step, trial
        damping = damping / 10.0 if better else max(10.0 * damping, 1e-4)
        damping = 0.0 if damping < 1e-5 else damping
        # Steps too short to matter: a density that is rough at this scale has no higher place nearby.
        if arrived := damping > 1e6:
            break
    found, log_mass = _curvature(density, here, floor, proper), None
    if found.grid is None:
        covariance = _inverse(found.undeviating)
    else:
        # Covariance of all standard deviations together, and the logarithm of their integrals' sum (Laplace).
        log_weight, taken, added = found.grid
        each = np.stack([_inverse(found.undeviating - one) for one in taken])
        gradient = here.gradient + added
        moved = np.einsum("gij,gj->gi", each, gradient)
        logs = here.value + log_weight + 0.5 * np.einsum("gi,gi->g", gradient, moved)
        logs += 0.5 * (np.linalg.slogdet(2.0 * np.pi * each)[1])
        weight = np.exp(logs - logs.max())
        log_mass = float(logs.max() + np.log(weight.sum()))
        weight /= weight.sum()
        away = moved - weight @ moved
        covariance = np.einsum("g,gij->ij", weight, each) + np.einsum("g,gi,gj->ij", weight, away, away)
        # What slopes promise and no step brings, as where the density has a kink, is no part of it.
        log_mass -= max(_step(found.marginal, here.gradient, 0.0)[1], 0.0)
    return Approximation(point, covariance, float(here.value), log_mass), arrived


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
