"""How probable the records are, given a simulation: the kinds of noise, and the density of residuals under one of them.

Kinds are compared by their log likelihood at the same residuals, less half the logarithm of the number of samples for
each number they contain (Schwarz's Bayesian information criterion, BIC).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.programs import kept_program
from fibrefit.problem import Linearised, Noise, Observations, Problem, Whitening, innovations, log_probability
from fibrefit.sampling.density.filters import NoiseEvidence, White
from fibrefit.sampling.density.kinds import KINDS, noise_kind

TAIL_START = 10.0
"""Degrees of freedom of Student's t with which a search begins."""


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

    def of_innovations(self, innovations: jax.Array, noise: jax.Array) -> jax.Array:
        """Logarithm of the density of each sample given the earlier ones, up to the constants in `constant`.

        Parameters
        ----------
        innovations : (n_record, n_channel, n_time)
            Of residuals in units of the noise.
        noise : (n_noise,)

        Returns
        -------
        (n_record, n_channel, n_time)
            Zero where the innovation is.
        """
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
        across = -2.0 * freedom / beyond * counts
        levels = jnp.diag(2.0 * freedom / (freedom + 3.0) * counts)
        last = jnp.append(across, jnp.sum(self.counts) * of_freedom)
        return jnp.vstack([jnp.column_stack([levels, across]), last])

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
        # Highest density of a reading in coarse steps, over that of a normal law of variance one.
        half = 0.5 * jnp.asarray(steps.size) / jnp.asarray(steps.noise)
        log = log_probability(jnp.zeros(()), half) - jnp.log(jnp.asarray(steps.size)) + 0.5 * math.log(2.0 * math.pi)
        logs = logs.at[:, channels.index(channel)].set(log[:, None])
    log_unit = jnp.sum(jnp.where(valid, logs, 0.0))
    return Likelihood(whitening, jnp.sum(valid, axis=(0, 2)).astype(float), log_unit, channels, known, heavy)


def downweighted_likelihood(likelihood: Likelihood, data: Observations, downweight: np.ndarray) -> Likelihood:
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


@dataclass(frozen=True)
class NoiseModel:
    """The likelihood chosen, and why.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    requested : str
        ``"auto"`` where it was chosen; the kind requested; or ``"fit"`` where it is that of a fit.
    scores : dict of str to float
        Log likelihood less penalty of every kind that was tried, over that of white noise.
    parameters : object
        What the kind estimates, such as the spectrum of each channel in SI units.
    kurtosis : float
        Excess kurtosis of the innovations: the largest of all channels.
    """

    likelihood: Likelihood
    kind: str
    requested: str
    scores: dict[str, float]
    parameters: Any
    kurtosis: float = 0.0

    def described(self) -> tuple[str, tuple[float, ...]]:
        """Words with places for numbers, and the numbers; see `NoiseKind`."""
        return noise_kind(self.kind).describe(self.parameters, self.likelihood.channels)


def choose_noise_model(
    problem: Problem,
    linear: Linearised,
    kind: str = "auto",
    known: tuple[bool, ...] | None = None,
    heavy: bool = False,
    spectrum: Mapping[str, Noise] | None = None,
) -> NoiseModel:
    """Likelihood for a problem whose residuals near the optimum are known.

    Parameters
    ----------
    linear : Linearised
        At the optimum.
    kind : str
        One of `KINDS`, or ``"auto"``, which chooses among all.
    known : tuple of bool
        Whether the noise level of each channel is given and not to be inferred; none by default.
    heavy : bool
        Student's t for the innovations instead of a normal law.
    spectrum : mapping of channel to Noise
        Noise of the rests: where a kind is requested that is made of spectra, and that of all channels is given, it is
        taken as it is.
    """
    channels, data = problem.model.rig.channels, problem.observations
    known = known or (False,) * len(channels)
    valid = jnp.stack([data.weight[c] for c in channels], axis=1) > 0.0
    stated = tuple((spectrum or {})[c] for c in channels if c in (spectrum or {}))
    as_stated = kind != "auto" and len(stated) == len(channels)
    evidence = NoiseEvidence(problem, linear, valid, known, stated if as_stated else ())

    parameters, numbers, whitenings = {}, {}, {}
    for name in KINDS if kind == "auto" else (kind,):
        one = noise_kind(name)
        parameters[name], numbers[name] = one.estimate(evidence)
        whitenings[name] = one.whiten(parameters[name], evidence)
    white = _score(White(valid), evidence, len(channels))
    scores = {name: _score(whitening, evidence, numbers[name]) - white for name, whitening in whitenings.items()}
    # An autoregression of order zero is white noise: rounding must not choose between two names of one thing.
    best = max(scores, key=lambda name: round(scores[name], 6))

    fresh, inside = np.asarray(innovations(whitenings[best], linear.residuals)), np.asarray(valid)
    each = [fresh[:, c][inside[:, c]] for c in range(len(channels)) if inside[:, c].any()]
    kurtosis = max(float(np.mean(x**4) / max(np.mean(x**2), 1e-30) ** 2 - 3.0) for x in each)
    likelihood = likelihood_of(whitenings[best], data, channels, known, heavy)
    return NoiseModel(likelihood, best, kind, scores, parameters[best], kurtosis)


def _score(whitening: Whitening, evidence: NoiseEvidence, numbers: int) -> float:
    """Log likelihood at the best level of each channel, less the penalty."""
    squares, counts, log_scale = map(np.asarray, _squares(whitening, evidence.linear.residuals, evidence.valid))
    squares, counts = squares[counts > 0], counts[counts > 0]
    if (squares == 0.0).any():
        return -math.inf
    profile = -0.5 * np.sum(counts * (np.log(squares / counts) + 1.0))
    return float(profile - log_scale - 0.5 * numbers * np.log(counts.sum()))


@kept_program
def _squares(whitening: Whitening, residuals: jax.Array, valid: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
    return jnp.sum(whitening.whiten(residuals) ** 2, axis=(0, 2)), jnp.sum(valid, axis=(0, 2)), whitening.log_scale
