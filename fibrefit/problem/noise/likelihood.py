"""How probable the records are, given a simulation: the density of the residuals' innovations."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.noise.whitening import Whitening
from fibrefit.problem.statement.observations import Observations, Steps, log_probability

TAIL_START = 10.0


class Likelihood(eqx.Module):
    """Density of residuals.

    Parameters
    ----------
    counts : (n_channel,)
        Number of valid samples.
    log_unit : ()
        Logarithm of the volume of residuals per volume of measured values in SI units.
    known : tuple of bool
        Whether the noise level of each channel is known; where it is not, it is a coordinate of its own.
    heavy : bool
        Whether innovations follow Student's t, its degrees of freedom being a coordinate, instead of a normal law.
    """

    whitening: Whitening
    counts: jax.Array
    log_unit: jax.Array
    channels: tuple[str, ...] = eqx.field(static=True)
    known: tuple[bool, ...] = eqx.field(static=True)
    heavy: bool = eqx.field(static=True, default=False)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the noise coordinates: unknown levels, then the degrees of freedom."""
        levels = tuple(f"noise.{c}" for c, known in zip(self.channels, self.known, strict=True) if not known)
        return levels + (("noise.degrees_of_freedom",) if self.heavy else ())

    @property
    def size(self) -> int:
        """Number of noise coordinates."""
        return len(self.names)

    def levels(self, noise: jax.Array) -> jax.Array:
        """Noise of each channel over what the residuals' unit assumes, ``(n_channel,)``.

        Parameters
        ----------
        noise : (n_noise,)
            Logarithms of the unknown levels, then of the degrees of freedom.
        """
        place = jnp.array([i for i, known in enumerate(self.known) if not known], dtype=int)
        return jnp.ones(len(self.known)).at[place].set(jnp.exp(noise[: len(place)]))

    def pointwise(self, residuals: jax.Array, noise: jax.Array) -> jax.Array:
        """Logarithm of the density of each sample given the earlier ones, up to the constants in `constant`.

        Parameters
        ----------
        residuals : (n_record, n_channel, n_time) in units of the noise
        noise : (n_noise,)

        Returns
        -------
        (n_record, n_channel, n_time)
            Zero where the innovation is.
        """
        return self.of_innovations(self.whitening.whiten(residuals), noise)

    def of_innovations(self, innovations: jax.Array, noise: jax.Array) -> jax.Array:
        """The same of residuals that were whitened."""
        innovations = innovations / self.levels(noise)[:, None]
        if not self.heavy:
            return -0.5 * innovations**2
        freedom = jnp.exp(noise[-1])
        return -0.5 * (freedom + 1.0) * jnp.log1p(innovations**2 / freedom)

    def push(self, innovations: jax.Array, noise: jax.Array) -> jax.Array:
        """Minus the derivative of that with respect to the innovations."""
        levels = self.levels(noise)[:, None]
        if not self.heavy:
            return innovations / levels**2
        freedom = jnp.exp(noise[-1])
        return (freedom + 1.0) * innovations / (freedom * levels**2 + innovations**2)

    def curvature(self, noise: jax.Array) -> jax.Array:
        """Expectation of minus its second derivative, ``(n_channel,)``."""
        if not self.heavy:
            return self.levels(noise) ** -2
        freedom = jnp.exp(noise[-1])
        return (freedom + 1.0) / (freedom + 3.0) * self.levels(noise) ** -2

    def information(self, innovations: jax.Array, noise: jax.Array) -> jax.Array:
        """Curvature of minus the log density in the noise coordinates, ``(n_noise, n_noise)``.

        Parameters
        ----------
        innovations : (n_record, n_channel, n_time)
        noise : (n_noise,)

        Law
        ---
        Of a normal law that of the innovations at hand. Of Student's t its expectation, Fisher's information: away from
        its maximum that at hand may bend the other way. With the scale s and ν degrees of freedom a sample adds
        ``2 ν / (ν + 3)`` in ln s, ``-2 ν / ((ν + 1) (ν + 3))`` beside ln ν and in ln ν, ψ' being the trigamma function,
        ``ν² (ψ'(ν/2) - ψ'((ν + 1)/2)) / 4 - ν (ν + 5) / (2 (ν + 1) (ν + 3))``.
        """
        if not self.heavy:
            return -jax.hessian(lambda x: jnp.sum(self.of_innovations(innovations, x)) + self.constant(x))(noise)
        freedom = jnp.exp(noise[-1])
        beyond = (freedom + 1.0) * (freedom + 3.0)
        trigamma = partial(jax.scipy.special.polygamma, 1)
        of_freedom = 0.25 * freedom**2 * (trigamma(0.5 * freedom) - trigamma(0.5 * freedom + 0.5))
        of_freedom -= 0.5 * freedom * (freedom + 5.0) / beyond
        counts = self.counts[jnp.array([i for i, known in enumerate(self.known) if not known], dtype=int)]
        beside = -2.0 * freedom / beyond * counts
        levels = jnp.diag(2.0 * freedom / (freedom + 3.0) * counts)
        last = jnp.append(beside, jnp.sum(self.counts) * of_freedom)
        return jnp.vstack([jnp.column_stack([levels, beside]), last])

    def constant(self, noise: jax.Array) -> jax.Array:
        """The part of the log density that does not depend on the residuals."""
        levels = jnp.sum(self.counts * jnp.log(self.levels(noise)))
        total = jnp.sum(self.counts)
        if self.heavy:
            half = 0.5 * jnp.exp(noise[-1])
            gamma = jax.scipy.special.gammaln
            each = gamma(half + 0.5) - gamma(half) - 0.5 * jnp.log(2.0 * half * jnp.pi)
        else:
            each = jnp.array(-0.5 * math.log(2.0 * math.pi))
        return total * each - levels - self.whitening.log_scale + self.log_unit

    def log_density(self, residuals: jax.Array, noise: jax.Array) -> jax.Array:
        """Logarithm of the density of the measured values, in SI units.

        Parameters
        ----------
        residuals : (n_record, n_channel, n_time) in units of the noise
        noise : (n_noise,)
        """
        return jnp.sum(self.pointwise(residuals, noise)) + self.constant(noise)


def likelihood_of(
    whitening: Whitening, data: Observations, channels: tuple[str, ...], known: tuple[bool, ...], heavy: bool = False
) -> Likelihood:
    """Likelihood of the observations a problem holds.

    Parameters
    ----------
    channels : tuple of str
        In the order of the residuals.
    known : tuple of bool
        Whether each channel's noise level is known.
    heavy : bool
        Student's t instead of a normal law.
    """
    weight = jnp.stack([data.weight[c] for c in channels], axis=1)
    valid = weight > 0.0
    logs = jnp.log(jnp.where(valid, weight, 1.0))
    for channel, steps in data.steps.items():
        logs = logs.at[:, channels.index(channel)].set(_log_unit_in_steps(steps)[:, None])
    log_unit = jnp.sum(jnp.where(valid, logs, 0.0))
    return Likelihood(whitening, jnp.sum(valid, axis=(0, 2)).astype(float), log_unit, channels, known, heavy)


def counted_in_part(likelihood: Likelihood, data: Observations, downweight: np.ndarray) -> Likelihood:
    """A likelihood of residuals that are smaller by factors, in which no sample gains or loses by its factor.

    What does not count of a sample is as probable as noise is on the average, and so is one that the whitening masks:
    models whose samples count otherwise are compared by densities of the same readings.

    Parameters
    ----------
    data : Observations
        Every sample counted in full.
    downweight : (n_record, n_channel, n_time)
    """
    whole = likelihood_of(likelihood.whitening, data, likelihood.channels, likelihood.known, likelihood.heavy)
    valid = np.stack([np.asarray(data.weight[c]) > 0.0 for c in likelihood.channels], axis=1)
    scales = np.asarray(likelihood.whitening.scales)
    used = valid & (scales > 0.0)
    counts = np.sum(np.where(used, downweight, 0.0) ** 2, axis=(0, 2))
    # Of noise with a memory innovations are smaller than residuals, by as much where they are masked.
    seen, masked = (mask.sum(axis=(0, 2)) for mask in (used, valid & ~used))
    logs = np.sum(np.log(np.where(used, scales, 1.0)), axis=(0, 2)) / np.maximum(seen, 1)
    rest = 0.5 * math.log(2.0 * math.pi * math.e) * (valid.sum() - counts.sum()) + float(masked @ logs)
    return replace(whole, counts=jnp.asarray(counts), log_unit=whole.log_unit - rest)


def _log_unit_in_steps(steps: Steps) -> jax.Array:
    """Logarithm of the highest density of a reading in coarse steps, over that of a normal law of variance one."""
    half = 0.5 * jnp.asarray(steps.size) / jnp.asarray(steps.noise)
    return log_probability(jnp.zeros(()), half) - jnp.log(jnp.asarray(steps.size)) + 0.5 * math.log(2.0 * math.pi)


def unit_of(data: Observations, channels: tuple[str, ...]) -> np.ndarray:
    """Noise rms in SI units that one unit of the residuals stands for, ``(n_record, n_channel)``."""
    largest = np.stack([np.asarray(data.weight[c]).max(axis=1) for c in channels], axis=1)
    return 1.0 / np.where(largest > 0.0, largest, 1.0)
