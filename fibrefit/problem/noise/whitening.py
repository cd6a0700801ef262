"""Whitening (prewhitening): linear maps that turn residuals with a memory into innovations, which have none.

The likelihood of correlated Gaussian residuals is that of their innovations: what each sample adds to what the earlier
ones predicted, over the standard deviation of that. A sample that is masked is never needed.
"""

from __future__ import annotations

from typing import Any, Protocol

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.programs import kept_program

BLANK = 1e-12


class Whitening(Protocol):
    """What all whitenings can do; residuals are ``(n_record, n_channel, n_time)`` in units of the noise."""

    @property
    def log_scale(self) -> jax.Array:
        """Sum of the logarithms of the innovations' standard deviations over all valid samples."""
        ...

    def whiten(self, residuals: jax.Array) -> jax.Array:
        """Innovations of unit variance, of the same shape; zero where a sample is masked."""
        ...

    @property
    def scales(self) -> jax.Array:
        """Standard deviations ``(n_record, n_channel, n_time)`` of the innovations; zero where a sample is masked."""
        ...

    def autocovariance(self, n_lag: int) -> np.ndarray:
        """Autocovariance ``(n_record, n_channel, n_lag)`` of the residuals from lag 0 on."""
        ...


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


class Autoregressive(eqx.Module):
    """Each sample is predicted by a weighted sum of the last ones, with weights of its own after a gap.

    Law
    ---
    e_t = (r_t - a_1 r_{t-1} - ... - a_p r_{t-p}) / s. At the start of a record and after a gap, where some of the last
    p samples are missing, the weights and s are those of the best prediction from the others.

    Parameters
    ----------
    valid : (n_record, n_channel, n_time) bool
    weights : (n_channel, p)
        Zero beyond the order of the channel.
    scale : (n_channel,)
        Standard deviation of the innovations.
    rows : (3, n_row) int
        Record, channel and time of the samples with weights of their own.
    row_weights : (n_row, p)
    row_scale : (n_row,)
    covariance : (n_channel, p + 1)
        Autocovariance the weights were made from.
    """

    valid: jax.Array
    weights: jax.Array
    scale: jax.Array
    rows: jax.Array
    row_weights: jax.Array
    row_scale: jax.Array
    covariance: jax.Array

    @classmethod
    def of(cls, covariances: list[np.ndarray], valid: np.ndarray) -> Autoregressive:
        """From the autocovariance at lags 0 to p of each channel, p its order, and the samples that are valid."""
        longest = max(2, *(len(c) for c in covariances)) - 1
        full = [_predictor(c, np.ones(len(c) - 1, dtype=bool)) for c in covariances]
        weights = np.stack([_filled(w, longest) for w, _ in full])
        rows, row_weights, row_scale = [], [], []
        for channel, covariance in enumerate(covariances):
            for record in range(len(valid)):
                own = _special_rows(covariance, valid[record, channel])
                rows += [(record, channel, time) for time, _, _ in own]
                row_weights += [_filled(w, longest) for _, w, _ in own]
                row_scale += [s for _, _, s in own]
        padded = np.stack([_filled(c, longest + 1) for c in covariances])
        return cls(
            jnp.asarray(valid),
            jnp.asarray(weights),
            jnp.asarray([s for _, s in full]),
            jnp.asarray(np.array(rows, dtype=np.int32).reshape(-1, 3).T),
            jnp.asarray(np.array(row_weights).reshape(len(rows), longest)),
            jnp.asarray(row_scale, dtype=float),
            jnp.asarray(padded),
        )

    @property
    def _scales(self) -> jax.Array:
        scales = jnp.broadcast_to(self.scale[:, None], self.valid.shape)
        return scales.at[tuple(self.rows)].set(self.row_scale)

    @property
    def scales(self) -> jax.Array:
        """Standard deviations ``(n_record, n_channel, n_time)`` of the innovations; zero where a sample is masked."""
        return jnp.where(self.valid, self._scales, 0.0)

    @property
    def log_scale(self) -> jax.Array:
        """Sum of the logarithms of the innovations' standard deviations over all valid samples."""
        return jnp.sum(jnp.where(self.valid, jnp.log(self._scales), 0.0))

    def whiten(self, residuals: jax.Array) -> jax.Array:
        """Innovations of unit variance; zero where a sample is masked."""
        kept = jnp.where(self.valid, residuals, 0.0)
        order = self.weights.shape[1]
        before = jnp.pad(kept, ((0, 0), (0, 0), (order, 0)))
        size = kept.shape[-1]
        predicted = jnp.zeros_like(kept)
        for j in range(order):
            predicted += self.weights[:, j, None] * before[..., order - 1 - j : order - 1 - j + size]
        record, channel, time = self.rows
        last = before[record[:, None], channel[:, None], time[:, None] + order - 1 - jnp.arange(order)]
        predicted = predicted.at[record, channel, time].set(jnp.sum(self.row_weights * last, axis=1))
        return jnp.where(self.valid, (kept - predicted) / self._scales, 0.0)

    def autocovariance(self, n_lag: int) -> np.ndarray:
        """Beyond its order the autocovariance follows from the weights (Yule-Walker)."""
        found = []
        for weights, start in zip(np.asarray(self.weights), np.asarray(self.covariance), strict=True):
            order = int(np.flatnonzero(weights)[-1]) + 1 if weights.any() else 0
            lags = np.zeros(max(n_lag, order + 1))
            lags[: order + 1] = start[: order + 1]
            for k in range(order + 1, n_lag):
                lags[k] = weights[:order] @ lags[k - order : k][::-1]
            found.append(lags[:n_lag])
        return np.broadcast_to(np.stack(found), (self.valid.shape[0], len(found), n_lag)).copy()


@kept_program
def innovations(whitening: Whitening, residuals: jax.Array) -> jax.Array:
    """`Whitening.whiten` as a compiled program; any axes behind ``(n_record, n_channel, n_time)`` are mapped over."""
    whiten = whitening.whiten
    for _ in range(residuals.ndim - 3):
        whiten = jax.vmap(whiten, in_axes=-1, out_axes=-1)
    return whiten(residuals)


def _predictor(covariance: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, float]:
    """Weights of the last samples (latest first), those not `known` zero, and the prediction's standard deviation."""
    weights = np.zeros(len(known))
    index = np.flatnonzero(known)
    if len(index):
        weights[index] = np.linalg.solve(covariance[np.abs(index[:, None] - index)], covariance[index + 1])
    variance = covariance[0] - weights @ covariance[1 : len(known) + 1]
    return weights, float(np.sqrt(max(variance, BLANK * covariance[0])))


def _special_rows(covariance: np.ndarray, valid: np.ndarray) -> list[tuple[int, np.ndarray, float]]:
    """Time, weights and scale of the valid samples that have a gap, or the start, among the last ones."""
    order = len(covariance) - 1
    before = np.concatenate([np.zeros(order, dtype=bool), valid])
    windows = np.lib.stride_tricks.sliding_window_view(before, order + 1)
    found, memory = [], {}
    for time in np.flatnonzero(valid & ~windows.all(axis=1)):
        known = windows[time, :-1][::-1]
        key = known.tobytes()
        if key not in memory:
            memory[key] = _predictor(covariance, known)
        found.append((int(time), *memory[key]))
    return found


def _filled(values: np.ndarray, size: int) -> np.ndarray:
    return np.concatenate([values, np.zeros(size - len(values))])


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
