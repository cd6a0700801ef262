"""The log posterior density in coordinates without limits, deviations of records and errors of inputs integrated out.

Law of deviations between records
---------------------------------
In record r the rig's parameters are ``theta exp(eta_r)`` with ``eta_r ~ N(0, diag sigma^2)``, sigma on the grid of
`fibrefit.problem.estimate.evidence` with its prior. Whitened residuals are linear in a deviation about a place that
follows the shared values: ``e_r(eta) = e_r + J_r (eta - eta*_r)``. It follows as the best deviations do under each
sigma, in the mean over the sigma that are probable there: far off the mode records differ by much, or are lost. With
``A = J'J``, ``b = J'e - A eta*`` and ``M = 1 + sigma A sigma`` the density of a record is that at ``eta*`` times
``exp(eta*'J'e - eta*'A eta* / 2 + b' sigma M^-1 sigma b / 2) / sqrt(det M)``, and that of all the sum over the grid.
Slopes J stay those of the mode, residuals are simulated anew at each point. Under Student's t the same holds with the
gradient of its density and its expected curvature (Laplace's approximation).

Law of errors of measured inputs
--------------------------------
Innovations of a record are linear in the coefficients c of its inputs' errors, ``e(c) = e + W (c - c')`` where the
motion is simulated with the inputs corrected by c', and ``c ~ N(0, 1)``. About the values theta* of the record at the
mode the best coefficients follow the values, ``c(theta) = c* + F (theta - theta*)`` with ``F = -(1 + W'W)^-1 W'J`` and
J the slopes of the innovations. The density with c integrated out, that of noise of covariance ``1 + W W'``, is the
one at c(theta), times ``exp(-|c(theta)|^2 / 2) / sqrt(det(1 + W'W))``: exact where e is linear in the values, and off
by the second order of what bends in e where it is not, since c(theta) is best. W, J and F stay those of the mode, e is
simulated anew at each point. As the noise of a channel grows its readings tell less of c, and ``det(1 + W'W)`` falls:
its logarithm is taken for linear in that of the noise. Under Student's t this is Laplace's approximation.

Both have no further coordinates. Where there are both, e is that with the best errors of inputs, which follow a
deviation as they follow any change of the record's values; their coefficients are further residuals, whose slopes and
products count with the others.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem import Problem
from fibrefit.sampling.density.likelihood import Likelihood
from fibrefit.sampling.density.prior import Density, Prior, log_slope


class InputEffects(eqx.Module):
    """What is needed to integrate the errors of measured inputs out.

    Parameters
    ----------
    local : (n_record, n_local_free) in SI units
        Values of each record at the mode.
    offset : (n_record, n_channel, n_time)
        What the best errors there add to innovations of inputs as they are corrected.
    slopes : (n_record, n_channel, n_time, n_local_free)
        What they add to these per SI unit of the values, which they follow.
    squares : (n_record, n_local_free + 1, n_local_free + 1)
        Products of how the best coefficients move per SI unit of the values and, last, of what they are at the mode.
    log_det : ()
        Logarithm of the determinant of their curvature, all records together.
    told : (n_channel,)
        Number of coefficients that the readings of each channel tell.
    curvature : (n_channel,)
        Of the density of innovations, at which these hold.
    columns : tuple of int
        Of these values among all values of a record.
    """

    local: jax.Array
    offset: jax.Array
    slopes: jax.Array
    squares: jax.Array
    log_det: jax.Array
    told: jax.Array
    curvature: jax.Array
    columns: tuple[int, ...] = eqx.field(static=True)

    def at_best(self, innovations: jax.Array, local: jax.Array) -> jax.Array:
        """Innovations ``(n_record, n_channel, n_time)`` with the errors best at values ``(n_record, n_local)``."""
        return innovations + self.offset + jnp.einsum("rcti,ri->rct", self.slopes, self._away(local))

    def log_density(self, likelihood: Likelihood, noise: jax.Array, local: jax.Array) -> jax.Array:
        """What the density with errors integrated out has beside that of innovations at the best ones."""
        away = self._with_one(local)
        prior = jnp.einsum("ri,rij,rj->", away, self.squares, away)
        log_det = self.log_det + jnp.sum(self.told * jnp.log(likelihood.curvature(noise) / self.curvature))
        return -0.5 * (prior + log_det)

    def pull(self, local: jax.Array, columns: Sequence[int]) -> jax.Array:
        """Half the gradient of the squared coefficients, ``(n_record, n_column)``, per relative change of values."""
        places = self.places(columns)
        return jnp.einsum("rij,rj->ri", self.squares[:, places], self._with_one(local)) * self.local[:, places]

    def bend(self, columns: Sequence[int]) -> jax.Array:
        """Half their second derivative ``(n_record, n_column, n_column)``, per relative changes."""
        places, local = self.places(columns), self.local[:, self.places(columns)]
        return self.squares[:, places[:, None], places] * local[:, :, None] * local[:, None, :]

    def places(self, columns: Sequence[int]) -> np.ndarray:
        """Of some of a record's values among these, ``(n_column,)`` int."""
        return np.searchsorted(np.array(self.columns), np.array(columns, dtype=int))

    def _away(self, local: jax.Array) -> jax.Array:
        return local[:, np.array(self.columns)] - self.local

    def _with_one(self, local: jax.Array) -> jax.Array:
        away = self._away(local)
        return jnp.concatenate([away, jnp.ones((len(away), 1))], axis=1)


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

    def drawn(self, known: Conditional, random: np.random.Generator) -> np.ndarray:
        """One draw of the deviations of all records, ``(n_record, n_scattering)``, from what is known of them."""
        logs, pull, curvature = map(np.asarray, known)
        weight = np.exp(logs - logs.max())
        sigma = np.asarray(self.sigma)[random.choice(len(weight), p=weight / weight.sum())]
        matrix = sigma[:, None] * curvature * sigma + np.eye(len(sigma))
        middle = -sigma * np.linalg.solve(matrix, (sigma * pull)[..., None])[..., 0]
        root = np.linalg.cholesky(np.linalg.inv(matrix))
        return middle + sigma * np.einsum("rij,rj->ri", root, random.standard_normal(middle.shape))


TAIL_PRIOR = Prior(True, 15.0, 1.0, 2.0, 200.0, "default")
"""Of the degrees of freedom: from tails as heavy as can be, with a variance still, to none at all."""


class RecordPlace(NamedTuple):
    """Where records are simulated at a point.

    Parameters
    ----------
    local : (n_record, n_local) in SI units
    eta : (n_record, n_scattering)
        Deviations between records that these hold; None where there are none.
    """

    local: jax.Array
    eta: jax.Array | None


class LogPosterior(eqx.Module):
    """Log posterior density at points that hold free coordinates, then noise coordinates.

    Parameters
    ----------
    prior : Density
        Of the free values.
    noise_prior : Density
        Of the exponentials of the noise coordinates.
    random_effects : RandomEffects or None
        Deviations between records, integrated out; None where records share all they share.
    inputs : InputEffects or None
        Errors of measured inputs, integrated out; None where inputs are exact.
    """

    problem: Problem
    prior: Density
    noise_prior: Density
    likelihood: Likelihood
    random_effects: RandomEffects | None = None
    inputs: InputEffects | None = None

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return self.problem.layout.size + self.likelihood.size

    def split(self, point: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Free coordinates and noise coordinates."""
        size = self.problem.layout.size
        return point[:size], point[size:]

    def values(self, point: jax.Array) -> jax.Array:
        """Values in SI units, then noise levels over the assumed ones and degrees of freedom; ``(n,)``."""
        free, noise = self.split(point)
        return jnp.concatenate([self.problem.layout.values(free), jnp.exp(noise)])

    def log_prior(self, point: jax.Array) -> jax.Array:
        """Log prior density in these coordinates; minus infinity outside the support."""
        free, noise = self.split(point)
        values = self.problem.layout.values(free)
        of_free = self.prior.log_density(values) + log_slope(self.problem.layout, free)
        of_noise = self.noise_prior.log_density(jnp.exp(noise)) + jnp.sum(noise)
        return jnp.where(jnp.isnan(of_free), -jnp.inf, of_free) + of_noise

    def log_likelihood(self, point: jax.Array) -> jax.Array:
        """Log density of the measured values."""
        free, noise = self.split(point)
        place = self.place(self.problem.layout.values(free))
        innovations = self.innovations(place.local)
        total = jnp.sum(self.likelihood.of_innovations(innovations, noise)) + self.likelihood.constant(noise)
        if self.inputs is not None:
            total = total + self.inputs.log_density(self.likelihood, noise, place.local)
        if self.random_effects is not None:
            total = total + jax.nn.logsumexp(self.conditional(innovations, noise, place).logs)
        return total

    def place(self, values: jax.Array) -> RecordPlace:
        """Where records are simulated, given the free values ``(n_free,)`` in SI units: deviations linearised there."""
        local = self.problem.layout.local(values)
        if self.random_effects is None:
            return RecordPlace(local, None)
        eta = self.random_effects.deviations(values)
        return RecordPlace(self.random_effects.moved(local, eta), eta)

    def innovations(self, local: jax.Array) -> jax.Array:
        """Innovations ``(n_record, n_channel, n_time)`` at values of each record, errors of inputs at their best."""
        white = self.likelihood.whitening.whiten(residuals_at(self.problem, local))
        return white if self.inputs is None else self.inputs.at_best(white, local)

    def conditional(self, innovations: jax.Array, noise: jax.Array, place: RecordPlace) -> Conditional:
        """What innovations at a place say of the deviations of records."""
        assert self.random_effects is not None
        assert place.eta is not None
        beside = 0.0 if self.inputs is None else self.inputs.pull(place.local, self.random_effects.columns)
        return self.random_effects.conditional(self.likelihood, innovations, noise, place.eta, beside)

    def known_of_deviations(self, point: jax.Array) -> Conditional:
        """What the records say of their deviations at a point."""
        free, noise = self.split(point)
        place = self.place(self.problem.layout.values(free))
        return self.conditional(self.innovations(place.local), noise, place)

    def __call__(self, point: jax.Array) -> jax.Array:
        """Log posterior density, unscaled; minus infinity where it is not a number."""
        prior = self.log_prior(point)
        total = prior + self.log_likelihood(point)
        return jnp.where(jnp.isfinite(prior) & jnp.isfinite(total), total, -jnp.inf)


@jax.custom_vjp
def residuals_at(problem: Problem, local: jax.Array) -> jax.Array:
    """`Problem.residuals_at`, whose gradient is taken forwards.

    A simulation's Jacobian with respect to the few values a record depends on costs a few simulations; the gradient
    of a density is then one product with it, and no loop runs backwards.
    """
    return problem.residuals_at(local)


def _forwards(problem: Problem, local: jax.Array) -> tuple[jax.Array, tuple]:
    linear = problem.linearised_at(local)
    return linear.residuals, (linear.slopes, problem, local)


def _product(kept: tuple, cotangent: jax.Array) -> tuple[None, jax.Array]:
    slopes, problem, local = kept
    own = jnp.sum(slopes * cotangent[..., None], axis=(1, 2))
    return None, jnp.zeros_like(local).at[:, jnp.array(problem.layout.local_free)].set(own)


residuals_at.defvjp(_forwards, _product)


def noise_priors(likelihood: Likelihood) -> tuple[Prior, ...]:
    """Default priors of the noise coordinates' exponentials."""
    levels = sum(not known for known in likelihood.known)
    # Of an unknown level: log-normal around the estimate, a factor e either way.
    level = Prior(True, 1.0, 1.0, 0.0, math.inf, "default")
    return (level,) * levels + ((TAIL_PRIOR,) if likelihood.heavy else ())
