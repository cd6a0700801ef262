"""Readings in coarse steps: what a logger says that tells of a signal no more than the step it lies in.

Law
---
A reading ``y`` in steps of ``q`` says that the signal ``x`` and its noise, normal with standard deviation ``s``, lay
within half a step of it: ``P(y | x) = Phi((y + q/2 - x) / s) - Phi((y - q/2 - x) / s)``. Its residual is the signed
root of ``2 (max log P - log P)``, so that the sum of their squares is twice the log likelihood, as it is for fine
readings. Errors of rounding are no noise: where a signal is slow they last for many samples, and depend on where it is.

Source
------
Likelihoods of rounded data: Vardeman and Lee, Technometrics 47 (2005). Deviance residuals: McCullagh and Nelder,
Generalized Linear Models (1989), section 2.4.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax.scipy.special import log_ndtr

NEAR = 1e-3
"""Distance from a reading, in units of the noise before rounding, up to which its residual is taken as straight."""


class Steps(NamedTuple):
    """Readings of one channel in coarse steps, ``(n_record,)`` each, in SI units.

    Parameters
    ----------
    size : of a step
    noise : standard deviation of the noise before rounding
    level : noise by which the channel's samples are weighed, that of rounding in it
    """

    size: Any
    noise: Any
    level: Any


def log_probability(distance: jax.Array, half: jax.Array) -> jax.Array:
    """Logarithm of the probability of readings.

    Parameters
    ----------
    distance : (...)
        Of the signal from the reading, in units of the noise before rounding.
    half : ()
        Of a step, in the same units.
    """
    away = jnp.abs(distance)
    inside, beyond = log_ndtr(half - away), log_ndtr(-half - away)
    return inside + jnp.log1p(-jnp.exp(beyond - inside))


def step_residuals(distance: jax.Array, steps: Steps) -> jax.Array:
    """Deviance residuals of readings in coarse steps, their signs those of the distances.

    Parameters
    ----------
    distance : (n_time,) in SI units
        Simulated less measured.
    steps : Steps
        Of one record.
    """
    half, away = 0.5 * steps.size / steps.noise, distance / steps.noise
    best = log_probability(jnp.zeros(()), half)
    bend = 2.0 * half * jax.scipy.stats.norm.pdf(half) / jnp.exp(best)
    far = jnp.where(jnp.abs(away) > NEAR, away, NEAR)
    residual = jnp.sign(far) * jnp.sqrt(jnp.maximum(2.0 * (best - log_probability(far, half)), 1e-300))
    return jnp.where(jnp.abs(away) > NEAR, residual, away * jnp.sqrt(bend))


def rows_in_steps(rows: jax.Array, weight: jax.Array, steps: Steps) -> jax.Array:
    """Residuals of readings as if they were fine, and their changes, as those of readings in coarse steps.

    Their slope is taken at the residuals: that of a difference would be off by the bend of the likelihood, and always
    to the same side.

    Parameters
    ----------
    rows : (n_record, n_row, n_time) in units of the noise
        Residuals first.
    weight : (n_record, n_time) per SI unit
    """
    distance = jnp.where(weight > 0.0, rows[:, 0] / jnp.where(weight > 0.0, weight, 1.0), 0.0)
    each = jax.vmap(step_residuals)
    residuals, slope = jax.jvp(lambda away: each(away, steps), (distance,), (jnp.ones_like(distance),))
    level = jnp.asarray(steps.level)[:, None]
    return jnp.concatenate([(residuals * weight * level)[:, None], rows[:, 1:] * (slope * level)[:, None]], axis=1)
