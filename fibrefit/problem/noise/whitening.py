"""Whitening (prewhitening): linear maps that turn residuals with a memory into innovations, which have none.

The likelihood of correlated Gaussian residuals is that of their innovations: what each sample adds to what the earlier
ones predicted, over the standard deviation of that. A sample that is masked is never needed.

Law
---
With the covariance ``C = L L'`` of the residuals r, lower triangular L: innovations ``e = L^-1 r`` are independent with
variance one, and the log density of r is ``-1/2 sum of e_t^2 - sum of ln L_tt``, up to a constant.
"""

from __future__ import annotations

from typing import Any, Protocol

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.programs import kept_program
from fibrefit.problem.statement.observations import Observations


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


def unit_of(data: Observations, channels: tuple[str, ...]) -> np.ndarray:
    """Noise rms in SI units that one unit of the residuals stands for, ``(n_record, n_channel)``."""
    largest = np.stack([np.asarray(data.weight[c]).max(axis=1) for c in channels], axis=1)
    return 1.0 / np.where(largest > 0.0, largest, 1.0)
