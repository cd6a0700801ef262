"""Autoregressive noise: each sample is predicted by a weighted sum of the last ones.

Law
---
``r_t = a_1 r_{t-1} + ... + a_p r_{t-p} + s e_t`` with weights that solve the Yule-Walker equations of the pooled
autocovariance. The order p is that with the lowest BIC, ``n ln s_p^2 + p ln n``, the variances ``s_p^2`` of all orders
by the recursion of Levinson and Durbin.
"""

from __future__ import annotations

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.noise.whitening import NoiseEvidence

LARGEST_ORDER = 40
"""At a kHz such a memory reaches over 40 ms: slower noise is what first-order parts are for."""


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
        weights = np.stack([np.pad(w, (0, longest - len(w))) for w, _ in full])
        padded = np.stack([np.pad(c, (0, longest + 1 - len(c))) for c in covariances])
        rows, row_weights, row_scale = [], [], []
        for channel, covariance in enumerate(covariances):
            for record in range(len(valid)):
                for time, own, scale in _rows_after_gaps(covariance, valid[record, channel]):
                    rows.append((record, channel, time))
                    row_weights.append(np.pad(own, (0, longest - len(own))))
                    row_scale.append(scale)
        places = np.array(rows, dtype=np.int32).reshape(-1, 3).T
        after_gaps = places, np.array(row_weights).reshape(len(rows), longest), np.array(row_scale, dtype=float)
        return cls(*map(jnp.asarray, (valid, weights, np.array([s for _, s in full]), *after_gaps, padded)))

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


def _predictor(covariance: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, float]:
    """Weights of the last samples (latest first), those not `known` zero, and the prediction's standard deviation."""
    weights = np.zeros(len(known))
    index = np.flatnonzero(known)
    if len(index):
        weights[index] = np.linalg.solve(covariance[np.abs(index[:, None] - index)], covariance[index + 1])
    variance = covariance[0] - weights @ covariance[1 : len(known) + 1]
    return weights, float(np.sqrt(max(variance, 1e-12 * covariance[0])))


def _rows_after_gaps(covariance: np.ndarray, valid: np.ndarray) -> list[tuple[int, np.ndarray, float]]:
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


def order_and_covariance(residuals: np.ndarray, valid: np.ndarray) -> tuple[int, np.ndarray]:
    """Order with the best Bayesian information criterion (BIC), and the autocovariance up to that lag.

    Parameters
    ----------
    residuals : (n_record, n_time)
    valid : (n_record, n_time) bool

    Returns
    -------
    order : int
        0 for white noise.
    covariance : (order + 1,)
    """
    if not valid.any():
        return 0, np.ones(1)
    # All records together; masked samples count as zero, which keeps the autocovariance definite.
    size, count = 1 << (2 * residuals.shape[1] - 1).bit_length(), int(valid.sum())
    power = np.abs(np.fft.rfft(np.where(valid, residuals, 0.0), size, axis=1)) ** 2
    covariance = np.fft.irfft(power.sum(axis=0))[: LARGEST_ORDER + 1] / valid.sum()
    variances, weights = [covariance[0]], np.zeros(0)
    for order in range(1, len(covariance)):
        partial = (covariance[order] - weights @ covariance[order - 1 : 0 : -1]) / variances[-1]
        weights = np.append(weights - partial * weights[::-1], partial)
        variances.append(variances[-1] * (1.0 - partial**2))
    best = int(np.argmin(count * np.log(np.array(variances)) + np.arange(LARGEST_ORDER + 1) * np.log(count)))
    return best, covariance[: best + 1]


class AutoregressiveNoise:
    """Each sample is predicted by some last ones; its parameters are autocovariances up to the orders."""

    def estimate(self, evidence: NoiseEvidence) -> tuple[list[np.ndarray], int]:
        """Of each channel; where a level is known its autocovariance begins with one."""
        residuals, valid = evidence.linear.residuals, np.asarray(evidence.valid)
        found = [order_and_covariance(np.asarray(residuals[:, c]), valid[:, c]) for c in range(valid.shape[1])]
        covariances = [c / c[0] if known else c for (_, c), known in zip(found, evidence.known, strict=True)]
        return covariances, len(found) + sum(order for order, _ in found)

    def whiten(self, covariances: list[np.ndarray], evidence: NoiseEvidence) -> Autoregressive:
        """The filter of these orders."""
        return Autoregressive.of(covariances, np.asarray(evidence.valid))

    def describe(self, covariances: list[np.ndarray], channels: Sequence[str]) -> tuple[str, tuple[float, ...]]:
        """The orders."""
        orders = ", ".join(f"%d ({channel})" for channel in channels)
        return f"autoregressive noise of order {orders}", tuple(len(c) - 1 for c in covariances)
