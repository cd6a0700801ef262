"""Order of an autoregression and the autocovariance it is made from, by what the residuals say."""

from __future__ import annotations

import numpy as np

LARGEST_ORDER = 40


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
    covariance = pooled_autocovariance(np.where(valid, residuals, 0.0), valid, LARGEST_ORDER + 1)
    count = int(valid.sum())
    cost = count * np.log(innovation_variances(covariance)) + np.arange(LARGEST_ORDER + 1) * np.log(count)
    order = int(np.argmin(cost))
    return order, covariance[: order + 1]


def pooled_autocovariance(residuals: np.ndarray, valid: np.ndarray, n_lag: int) -> np.ndarray:
    """Autocovariance ``(n_lag,)`` of all records together; masked samples count as zero, which keeps it definite."""
    size = 1 << (2 * residuals.shape[1] - 1).bit_length()
    power = np.abs(np.fft.rfft(residuals, size, axis=1)) ** 2
    return np.fft.irfft(power.sum(axis=0))[:n_lag] / valid.sum()


def innovation_variances(covariance: np.ndarray) -> np.ndarray:
    """Variance that is left when 0, 1, 2, ... last samples predict the next (Levinson and Durbin's recursion)."""
    variances = [covariance[0]]
    weights = np.zeros(0)
    for order in range(1, len(covariance)):
        partial = (covariance[order] - weights @ covariance[order - 1 : 0 : -1]) / variances[-1]
        weights = np.append(weights - partial * weights[::-1], partial)
        variances.append(variances[-1] * (1.0 - partial**2))
    return np.array(variances)
