"""The log posterior density of a problem in coordinates without limits, and its gradient."""

from __future__ import annotations

import math
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from fibrefit.problem.noise.likelihood import Likelihood
from fibrefit.problem.posterior.input_effects import InputEffects
from fibrefit.problem.posterior.prior import Density, Prior, log_slope
from fibrefit.problem.posterior.random_effects import Conditional, RandomEffects
from fibrefit.problem.statement.problem import Problem

LEVEL_SPREAD = 1.0
"""Default prior of an unknown noise level: log-normal around the estimate, a factor e either way."""
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
    level = Prior(True, 1.0, LEVEL_SPREAD, 0.0, math.inf, "default")
    return (level,) * levels + ((TAIL_PRIOR,) if likelihood.heavy else ())
