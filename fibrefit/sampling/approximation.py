"""A normal approximation of one mode: where walkers begin, what they propose, and a first value of its weight."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fibrefit.core.errors import UsageError
from fibrefit.problem.statement.matrices import equilibrated, scale_of

FREEDOM = 12.0
"""Degrees of freedom of the proposal: heavier tails than any posterior it is meant for, and still a good one."""
WIDER = 1.5
"""Walkers begin in a cloud wider than the posterior by this factor, so that agreement has to be earned."""
PATIENCE = 40


@dataclass(frozen=True)
class Approximation:
    """Normal approximation of a log density.

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
        spread = np.sqrt(FREEDOM / random.chisquare(FREEDOM, size=(count, 1)))
        drawn = self.centre + spread * random.standard_normal((count, size)) @ self.root.T
        return drawn, self._log_proposal(points) - self._log_proposal(drawn)

    def _log_proposal(self, points: np.ndarray) -> np.ndarray:
        return -0.5 * (FREEDOM + len(self.centre)) * np.log1p(self.distance(points) ** 2 / FREEDOM)

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
        lost, width = np.ones(count, dtype=bool), WIDER
        for _ in range(PATIENCE):
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
