"""Kinds of noise that are compared: white, autoregressive and coloured, and what they are estimated from.

Autoregressive noise: each sample is predicted by a weighted sum of the last ones.

Law
---
``r_t = a_1 r_{t-1} + ... + a_p r_{t-p} + s e_t`` with weights that solve the Yule-Walker equations of the pooled
autocovariance. The order p is that with the lowest BIC, ``n ln s_p^2 + p ln n``, the variances ``s_p^2`` of all orders
by the recursion of Levinson and Durbin.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.matrices import least_squares
from fibrefit.problem import (
    Layout,
    Linearised,
    Noise,
    Problem,
    Whitening,
    noise_of_residuals,
    normal_equations,
    unit_of,
    whitening_of,
)

LARGEST_ORDER = 40
"""At a kHz such a memory reaches over 40 ms: slower noise is what first-order parts are for."""


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


class ColouredNoise:
    """White, 1/f, first-order parts and lines; its parameters are a spectrum for each channel, in SI units."""

    def estimate(self, evidence: NoiseEvidence) -> tuple[tuple[Noise, ...], int]:
        """Spectra that are stated, or else those of the residuals; they tell the shape alone where a level is known."""
        problem, experiment = evidence.problem, evidence.problem.observations.experiment
        noise = evidence.stated or noise_of_residuals(problem, evidence.best_residuals())
        times, counts = np.asarray(experiment.times), np.asarray(experiment.count)
        duration = float(max(t[n - 1] - t[0] for t, n in zip(times, counts, strict=True)))
        rate = 1.0 / float(np.diff(times[0][: counts[0]]).mean())
        unit = unit_of(problem.observations, problem.model.rig.channels)
        noise = tuple(
            of.scaled(float(unit[:, c].mean()) / of.rms(duration, rate)) if known else of
            for c, (of, known) in enumerate(zip(noise, evidence.known, strict=True))
        )
        # Its levels, and two for each first-order part and each line.
        return noise, sum(1 + (of.pink > 0.0) + 2 * len(of.slow) + 2 * len(of.all_lines) for of in noise)

    def whiten(self, noise: Sequence[Noise], evidence: NoiseEvidence) -> Whitening:
        """The filter of these spectra."""
        return whitening_of(evidence.problem, noise)

    def describe(self, noise: Sequence[Noise], channels: Sequence[str]) -> tuple[str, tuple[float, ...]]:
        """The corners at which slow parts and white noise are equal."""
        corners = {channel: corner for channel, of in zip(channels, noise, strict=True) if (corner := of.corner())}
        if not corners:
            return "noise of a spectrum without slow parts", ()
        equal = "".join(f", equal at %.3g Hz in {channel}" for channel in corners)
        return f"coloured noise (white and slow parts{equal})", tuple(corners.values())


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
