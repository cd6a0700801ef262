"""Densities whose integrals are known, as targets."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fibrefit.sampling.chains import Target
from fibrefit.sampling.density.prior import Prior
from fibrefit.sampling.mode import Approximation


def target(log_density: Callable[[np.ndarray], np.ndarray], size: int, priors: tuple[Prior, ...] = ()) -> Target:
    """Target whose coordinates are its values."""
    names = tuple("abcdefghijkl"[:size])
    return Target(names, ("m",) * size, log_density, lambda points: points, priors)


def normal(centre: np.ndarray, covariance: np.ndarray, log_mass: float = 0.0) -> Callable[[np.ndarray], np.ndarray]:
    """Log density of a normal distribution with the given integral."""
    root = np.linalg.cholesky(covariance)
    constant = log_mass - 0.5 * len(centre) * np.log(2.0 * np.pi) - np.log(np.diag(root)).sum()
    return lambda x: constant - 0.5 * np.sum(np.linalg.solve(root, (x - centre).T) ** 2, axis=0)


def around(
    log_density: Callable[[np.ndarray], np.ndarray], centre: np.ndarray, covariance: np.ndarray
) -> Approximation:
    """Approximation with the density at its centre."""
    return Approximation(centre, covariance, float(log_density(centre[None])[0]))


def correlated(size: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """A centre and a covariance with scales over six decades."""
    random = np.random.default_rng(seed)
    mix = random.standard_normal((size, size)) + 2.0 * np.eye(size)
    scale = np.logspace(-3, 3, size)
    return scale * random.standard_normal(size), (mix @ mix.T) * np.outer(scale, scale)
