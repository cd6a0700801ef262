"""Errors of measured inputs in a posterior, integrated out: the same model as a fit's, with no further coordinates.

Law
---
Innovations of a record are linear in the coefficients c of its inputs' errors, ``e(c) = e + W (c - c')`` where the
motion is simulated with the inputs corrected by c', and ``c ~ N(0, 1)``. About the values theta* of the record at the
mode the best coefficients follow the values, ``c(theta) = c* + F (theta - theta*)`` with ``F = -(1 + W'W)^-1 W'J`` and
J the slopes of the innovations. The density with c integrated out, that of noise of covariance ``1 + W W'``, is the
one at c(theta), times ``exp(-|c(theta)|^2 / 2) / sqrt(det(1 + W'W))``: exact where e is linear in the values, and off
by the second order of what bends in e where it is not, since c(theta) is best. W, J and F stay those of the mode, e is
simulated anew at each point. As the noise of a channel grows its readings tell less of c, and ``det(1 + W'W)`` falls:
its logarithm is taken for linear in that of the noise. Under Student's t this is Laplace's approximation.
"""

from __future__ import annotations

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.noise.likelihood import Likelihood


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
