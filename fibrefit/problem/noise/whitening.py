"""Whitening (prewhitening): linear maps that turn residuals with a memory into innovations, which have none.

The likelihood of correlated Gaussian residuals is that of their innovations: what each sample adds to what the earlier
ones predicted, over the standard deviation of that. A sample that is masked is never needed.

Law
---
With the covariance ``C = L L'`` of the residuals r, lower triangular L: innovations ``e = L^-1 r`` are independent with
variance one, and the log density of r is ``-1/2 sum of e_t^2 - sum of ln L_tt``, up to a constant.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.matrices import least_squares
from fibrefit.core.programs import kept_program
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.statement.layout import Layout, normal_equations
from fibrefit.problem.statement.observations import Observations
from fibrefit.problem.statement.problem import Linearised, Problem


class Whitening(Protocol):
    """What all whitenings can do; residuals are ``(n_record, n_channel, n_time)`` in units of the noise."""

    @property
    def log_scale(self) -> jax.Array:
        """Sum of the logarithms of the innovations' standard deviations over all valid samples."""

    def whiten(self, residuals: jax.Array) -> jax.Array:
        """Innovations of unit variance, of the same shape; zero where a sample is masked."""

    @property
    def scales(self) -> jax.Array:
        """Standard deviations ``(n_record, n_channel, n_time)`` of the innovations; zero where a sample is masked."""

    def autocovariance(self, n_lag: int) -> np.ndarray:
        """Autocovariance ``(n_record, n_channel, n_lag)`` of the residuals from lag 0 on."""


class NoiseEvidence(NamedTuple):
    """What noise is estimated from.

    Parameters
    ----------
    problem : Problem
    linear : Linearised
        At the optimum; residuals ``(n_record, n_channel, n_time)`` in units of the noise.
    valid : (n_record, n_channel, n_time) bool
        Samples that count.
    known : tuple of bool
        Whether the noise level of each channel is given, and is one unit of the residuals.
    stated : tuple of Noise
        Spectra of all channels in SI units where they are to be taken as they are; else empty.
    """

    problem: Problem
    linear: Linearised
    valid: jax.Array
    known: tuple[bool, ...]
    stated: tuple[Noise, ...] = ()

    def best_residuals(self) -> np.ndarray:
        """Residuals where the slopes say that their sum of squares is smallest: what parameters can do is no noise."""
        layout = self.problem.layout
        return linearised_after_step(layout, self.linear, least_squares_step(layout, self.linear)).residuals


class White(eqx.Module):
    """Residuals are innovations already.

    Parameters
    ----------
    valid : (n_record, n_channel, n_time) bool
    """

    valid: jax.Array

    @property
    def log_scale(self) -> jax.Array:
        """Zero."""
        return jnp.zeros(())

    @property
    def scales(self) -> jax.Array:
        """One where a sample is valid, ``(n_record, n_channel, n_time)``; zero where not."""
        return jnp.where(self.valid, 1.0, 0.0)

    def whiten(self, residuals: jax.Array) -> jax.Array:
        """The residuals where they are valid."""
        return jnp.where(self.valid, residuals, 0.0)

    def autocovariance(self, n_lag: int) -> np.ndarray:
        """One at lag 0."""
        return np.broadcast_to(np.arange(n_lag) == 0, (*self.valid.shape[:2], n_lag)).astype(float)


class WhiteNoise:
    """Residuals without a memory; the level of each channel is all there is to know."""

    def estimate(self, evidence: NoiseEvidence) -> tuple[None, int]:
        """Nothing: a filter's level is that of the residuals' unit."""
        return None, len(evidence.known)

    def whiten(self, _: None, evidence: NoiseEvidence) -> White:
        """No filter."""
        return White(evidence.valid)

    def describe(self, *_: object) -> tuple[str, tuple[float, ...]]:
        """No numbers."""
        return "white noise", ()


class Levelled(eqx.Module):
    """A whitening of noise that is louder or quieter than it assumes.

    Parameters
    ----------
    whitening : Whitening
    level : (n_channel,)
        Noise over what it assumes.
    """

    whitening: Any
    level: jax.Array

    @property
    def log_scale(self) -> jax.Array:
        """That of the whitening itself: the levels are left out."""
        return self.whitening.log_scale

    @property
    def scales(self) -> jax.Array:
        """Those of the whitening itself."""
        return jnp.asarray(self.whitening.scales)

    def whiten(self, residuals: jax.Array) -> jax.Array:
        """Innovations of unit variance; zero where a sample is masked."""
        return self.whitening.whiten(residuals) / self.level[:, None]

    def whiten_rows(self, rows: jax.Array) -> jax.Array:
        """Innovations of many residuals at once, ``(n_row, n_record, n_channel, n_time)``."""
        return jax.vmap(self.whiten)(rows)

    def autocovariance(self, n_lag: int) -> np.ndarray:
        """That of the whitening times the levels, ``(n_record, n_channel, n_lag)``."""
        return self.whitening.autocovariance(n_lag) * np.asarray(self.level)[:, None] ** 2


@kept_program
def innovations(whitening: Whitening, residuals: jax.Array) -> jax.Array:
    """`Whitening.whiten` as a compiled program; any axes behind ``(n_record, n_channel, n_time)`` are mapped over."""
    whiten = whitening.whiten
    for _ in range(residuals.ndim - 3):
        whiten = jax.vmap(whiten, in_axes=-1, out_axes=-1)
    return whiten(residuals)


def linearised_after_step(layout: Layout, linear: Linearised, step: np.ndarray) -> Linearised:
    """What the slopes say of the residuals after a step ``(n_free,)`` in SI units."""
    local, slopes = np.append(step, [0.0, 0.0])[layout.local_columns], np.asarray(linear.slopes)
    return Linearised(np.asarray(linear.residuals) + np.einsum("rcti,ri->rct", slopes, local), slopes)


def least_squares_step(layout: Layout, linear: Linearised, belief: np.ndarray | None = None) -> np.ndarray:
    """Step ``(n_free,)`` in SI units to where a linearised problem has the smallest sum of squares.

    Parameters
    ----------
    belief : (n_free + 1, n_free + 1), optional
        See `Layout.prior_gram`.
    """
    normal, pull = normal_equations(layout, np.asarray(linear.slopes), np.asarray(linear.residuals), belief)
    return least_squares(normal, -pull)


def unit_of(data: Observations, channels: tuple[str, ...]) -> np.ndarray:
    """Noise rms in SI units that one unit of the residuals stands for, ``(n_record, n_channel)``."""
    largest = np.stack([np.asarray(data.weight[c]).max(axis=1) for c in channels], axis=1)
    return 1.0 / np.where(largest > 0.0, largest, 1.0)
