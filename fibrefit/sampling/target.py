"""What is sampled: a log density of points, and what the points mean."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.posterior.log_posterior import LogPosterior
from fibrefit.problem.posterior.prior import Prior


@dataclass(frozen=True)
class Target:
    """A log density over coordinates without limits.

    Parameters
    ----------
    names, units : tuple of str
        Of the values the coordinates stand for.
    log_density : callable ``(n_point, n) -> (n_point,)``
        Unscaled; minus infinity where a point is impossible. The same points give the same bits.
    values : callable ``(n_point, n) -> (n_point, n)``
        Values in SI units of points, coordinate by coordinate.
    priors : tuple of Prior
        Of the values; empty where there are none.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    log_density: Callable[[np.ndarray], np.ndarray]
    values: Callable[[np.ndarray], np.ndarray]
    priors: tuple[Prior, ...] = ()

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.names)


def target_of(
    density: LogPosterior, priors: tuple[Prior, ...], units: tuple[str, ...], noise_units: np.ndarray, batch: int
) -> Target:
    """Target of a problem's log posterior.

    Parameters
    ----------
    priors : tuple of Prior
        Of the free values in SI units, then of the exponentials of the noise coordinates.
    units : tuple of str
        Of all values.
    noise_units : (n_noise,)
        SI value that a noise coordinate of zero stands for.
    batch : int
        Points evaluated at once.
    """
    names = density.problem.layout.free_names + density.likelihood.names
    size = density.problem.layout.size
    scale = np.concatenate([np.ones(size), noise_units])
    return Target(
        names=names,
        units=units,
        log_density=Batched(density, batch),
        values=lambda points: np.asarray(_values(density, jnp.asarray(points))) * scale,
        priors=priors[:size] + tuple(scaled(p, s) for p, s in zip(priors[size:], noise_units, strict=True)),
    )


def scaled(prior: Prior, unit: float) -> Prior:
    """The prior of a value that is `unit` times as large."""
    spread = prior.spread if prior.log else prior.spread * unit
    lower, upper = prior.lower * unit, prior.upper * unit
    return replace(prior, centre=prior.centre * unit, spread=spread, lower=lower, upper=upper)


class Batched:
    """Log density of many points by one compiled program of fixed shape.

    Points are cut into batches of one size, so that nothing is compiled twice and a point's bits do not depend on its
    neighbours. On a CPU a batch is worked off point by point, as long as one simulation's arrays fit its cache.
    """

    def __init__(self, density: LogPosterior, batch: int) -> None:
        self._density, self._batch = density, batch
        self._many = _one_by_one if jax.default_backend() == "cpu" else _all_at_once

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Log densities ``(n_point,)`` of points ``(n_point, n)``."""
        points = np.atleast_2d(points)
        rest = -len(points) % self._batch
        filled = np.concatenate([points, np.repeat(points[-1:], rest, axis=0)])
        parts = filled.reshape(-1, self._batch, points.shape[1])
        found = [np.asarray(self._many(self._density, jnp.asarray(part))) for part in parts]
        return np.concatenate(found)[: len(points)]


@eqx.filter_jit
def _one_by_one(density: LogPosterior, points: jax.Array) -> jax.Array:
    return jax.lax.map(density, points)


@eqx.filter_jit
def _all_at_once(density: LogPosterior, points: jax.Array) -> jax.Array:
    return jax.vmap(density)(points)


@eqx.filter_jit
def _values(density: LogPosterior, points: jax.Array) -> jax.Array:
    return jax.vmap(density.values)(points)
