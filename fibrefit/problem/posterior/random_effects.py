"""Deviations between records in a posterior, integrated out: the same model as a fit's, with no further coordinates.

Law
---
In record r the rig's parameters are ``theta exp(eta_r)`` with ``eta_r ~ N(0, diag sigma^2)``, sigma on the grid of
`fibrefit.problem.estimate.evidence` with its prior. Whitened residuals are linear in a deviation about a place that
follows the shared values: ``e_r(eta) = e_r + J_r (eta - eta*_r)``. It follows as the best deviations do under each
sigma, in the mean over the sigma that are probable there: far off the mode records differ by much, or are lost. With
``A = J'J``, ``b = J'e - A eta*`` and ``M = 1 + sigma A sigma`` the density of a record is that at ``eta*`` times
``exp(eta*'J'e - eta*'A eta* / 2 + b' sigma M^-1 sigma b / 2) / sqrt(det M)``, and that of all the sum over the grid.
Slopes J stay those of the mode, residuals are simulated anew at each point. Under Student's t the same holds with the
gradient of its density and its expected curvature (Laplace's approximation).

Where inputs were measured, e is that with the best errors of theirs, which follow a deviation as they follow any change
of the record's values; their coefficients are further residuals, whose slopes and whose products count with the others
(see `input_effects`).
"""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.noise.likelihood import Likelihood


class Conditional(NamedTuple):
    """What is known of the deviations at one point.

    Parameters
    ----------
    logs : (n_grid,)
        Logarithm of the probability of each standard deviation and of the records under it, less the log density of
        the residuals at the place of linearisation.
    pull : (n_record, n_scattering)
        Half the gradient of the cost at no deviation.
    curvature : (n_record, n_scattering, n_scattering)
    """

    logs: jax.Array
    pull: jax.Array
    curvature: jax.Array


class Mixture(NamedTuple):
    """Normal laws of the logarithms of shared values about the mode, one of each standard deviation between records.

    Parameters
    ----------
    logs : (n_grid,)
        Logarithm of the probability of each, over the square root of the determinant of its covariance.
    middle : (n_grid, n_scattering)
    root : (n_grid, n_scattering, n_scattering)
        Upper roots R of the inverse covariances ``R'R``.
    """

    logs: jax.Array
    middle: jax.Array
    root: jax.Array

    def share(self, away: jax.Array) -> jax.Array:
        """Probability ``(n_grid,)`` of each at logarithms ``(n_scattering,)`` that are so far off the mode."""
        off = jnp.einsum("gij,gj->gi", self.root, away - self.middle)
        return jax.nn.softmax(self.logs - 0.5 * jnp.sum(off**2, axis=1))


class RandomEffects(eqx.Module):
    """What is needed to integrate the deviations out.

    Parameters
    ----------
    slopes : (n_record, n_channel, n_time, n_scattering)
        Innovations per unit of a deviation.
    products : (n_record, n_channel, n_scattering, n_scattering)
        Of these.
    middle : (n_scattering,)
        Logarithms of the shared values at the mode.
    eta : (n_record, n_scattering)
        Deviations there.
    follow : (n_grid, n_record, n_scattering, n_scattering)
        How they fall as the logarithms of the shared values rise, under each standard deviation.
    where : Mixture
        How probable each standard deviation is at shared values, roughly.
    sigma : (n_grid, n_scattering)
    log_prior : (n_grid,)
    places : tuple of int
        Of the deviating parameters among the free values.
    columns : tuple of int
        The same among a record's values.
    bend : (n_record, n_scattering, n_scattering)
        Curvature beside that of the innovations: of the prior of errors of inputs that follow.
    """

    slopes: jax.Array
    products: jax.Array
    middle: jax.Array
    eta: jax.Array
    follow: jax.Array
    where: Mixture
    sigma: jax.Array
    log_prior: jax.Array
    places: tuple[int, ...] = eqx.field(static=True)
    columns: tuple[int, ...] = eqx.field(static=True)
    bend: jax.Array | float = 0.0

    def deviations(self, values: jax.Array) -> jax.Array:
        """Where residuals are linearised, ``(n_record, n_scattering)``, given the free values."""
        chosen = values[np.array(self.places)]
        away = jnp.log(jnp.where(chosen > 0.0, chosen, jnp.exp(self.middle))) - self.middle
        return self.eta - jnp.einsum("g,grij,j->ri", self.where.share(away), self.follow, away, optimize="optimal")

    def moved(self, local: jax.Array, eta: jax.Array) -> jax.Array:
        """Values of each record ``(n_record, n_local)`` with its deviations in them."""
        return local.at[:, np.array(self.columns)].multiply(jnp.exp(eta), unique_indices=True)

    def conditional(
        self,
        likelihood: Likelihood,
        innovations: jax.Array,
        noise: jax.Array,
        eta: jax.Array,
        beside: jax.Array | float = 0.0,
    ) -> Conditional:
        """What innovations ``(n_record, n_channel, n_time)`` at deviations ``(n_record, n_scattering)`` say of them.

        Parameters
        ----------
        beside : (n_record, n_scattering)
            Half the gradient of the prior of errors of inputs that follow.
        """
        push = likelihood.push(innovations, noise)
        curvature = jnp.einsum("rcij,c->rij", self.products, likelihood.curvature(noise)) + self.bend
        here = jnp.einsum("rctk,rct->rk", self.slopes, push) + beside
        bent = jnp.einsum("rij,rj->ri", curvature, eta)
        pull = here - bent
        gain, log_det = self.integrated(pull, curvature)
        at_none = jnp.sum(eta * (here - 0.5 * bent))
        return Conditional(self.log_prior + at_none + 0.5 * jnp.sum(gain - log_det, axis=1), pull, curvature)

    def integrated(self, pull: jax.Array, curvature: jax.Array) -> tuple[jax.Array, jax.Array]:
        """``b' sigma M^-1 sigma b`` and ``ln det M``, ``(n_grid, n_record)`` each."""
        size = self.sigma.shape[1]
        sigma = [self.sigma[:, i, None] for i in range(size)]
        right = [sigma[i] * pull[:, i] for i in range(size)]
        matrix = {
            (i, j): sigma[i] * curvature[:, i, j] * sigma[j] + float(i == j) for i in range(size) for j in range(i + 1)
        }
        gain = log_det = jnp.zeros((len(self.sigma), len(pull)))
        # Elimination written out: the matrices are small, positive definite and many.
        for i in range(size):
            pivot = matrix[i, i]
            gain, log_det = gain + right[i] ** 2 / pivot, log_det + jnp.log(pivot)
            for j in range(i + 1, size):
                factor = matrix[j, i] / pivot
                right[j] = right[j] - factor * right[i]
                for k in range(i + 1, j + 1):
                    matrix[j, k] = matrix[j, k] - factor * matrix[k, i]
        return gain, log_det


def drawn_deviations(random_effects: RandomEffects, known: Conditional, random: np.random.Generator) -> np.ndarray:
    """One draw of the deviations of all records, ``(n_record, n_scattering)``, from what is known of them."""
    logs, pull, curvature = map(np.asarray, known)
    weight = np.exp(logs - logs.max())
    sigma = np.asarray(random_effects.sigma)[random.choice(len(weight), p=weight / weight.sum())]
    matrix = sigma[:, None] * curvature * sigma + np.eye(len(sigma))
    middle = -sigma * np.linalg.solve(matrix, (sigma * pull)[..., None])[..., 0]
    root = np.linalg.cholesky(np.linalg.inv(matrix))
    return middle + sigma * np.einsum("rij,rj->ri", root, random.standard_normal(middle.shape))
