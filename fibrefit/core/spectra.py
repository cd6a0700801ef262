"""Periodograms, their likelihood under white and 1/f (pink) noise, lines, and products of transforms.

Law
---
Ordinates ``P_k`` of a periodogram are independent and exponentially distributed about the density ``S(f_k)``: minus the
log likelihood of a spectrum is ``sum of ln S(f_k) + P_k / S(f_k)`` (Whittle). With ``S = exp(a) + exp(b) / f`` its
gradient is ``sum of s_i (1 - P / S)`` and its expected curvature ``sum of s_i s_j``, ``s_i`` the share of each part in
S: damped Gauss-Newton steps in the logarithms a and b find the minimum.

Source
------
Whittle, Ark. Mat. 2 (1953).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fibrefit.core.arrays import RAN_AWAY

MAINS = (50.0, 60.0)
"""Frequencies in Hz of the grids of the world: a line that is not known better lies at one of them."""


def periodogram(values: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies [Hz] between zero and half the rate, and the one-sided power density of `values` ``(n,)`` there.

    Returns
    -------
    (n_ordinate,) in Hz, (n_ordinate,) in unit²/Hz
    """
    n = len(values)
    power = 2.0 * np.abs(np.fft.rfft(values - values.mean())) ** 2 / (n * rate)
    frequency = np.fft.rfftfreq(n, 1.0 / rate)
    inner = slice(1, (n + 1) // 2)
    return frequency[inner], power[inner]


def without_lines(values: np.ndarray, times: np.ndarray, lines: Sequence[float]) -> np.ndarray:
    """What is left of readings ``(..., n)`` by the sinusoids of some frequencies in Hz that they hold most likely."""
    angle = 2.0 * np.pi * np.multiply.outer(times, lines)
    sinusoids = np.concatenate([np.cos(angle), np.sin(angle)], axis=1)
    # A level is no part of a line, of which a short record need not hold whole periods.
    basis = np.linalg.qr(sinusoids - sinusoids.mean(axis=0))[0]
    return values - (values @ basis) @ basis.T


def whittle(frequency: np.ndarray, power: np.ndarray) -> tuple[float, float]:
    """White level in unit²/Hz and pink level in unit² by maximum likelihood of a periodogram ``(n_ordinate,)``."""
    floor, shape = 1e-6 * power.mean(), np.stack([np.ones_like(frequency), 1.0 / frequency])
    # The median of an exponential law is ln 2 of its mean; pink noise begins far below white noise, as it, and above.
    level = np.log(np.median(power[frequency > 0.5 * frequency.max()]) / np.log(2.0) + floor)
    starts = [np.array([level, level + shift]) for shift in (-4.0, 0.0, 4.0)]
    logs = min(starts, key=lambda start: _misfit(start, shape, power, floor)[0])
    here, damping = _misfit(logs, shape, power, floor), 1e-3
    while damping < 1e9:
        bend = here[2] * (1.0 + damping * np.eye(2)) + 1e-12 * np.eye(2)
        # A level changes by a factor of seven a step at the most: far away the curvature says little.
        there = logs + np.clip(-np.linalg.solve(bend, here[1]), -2.0, 2.0)
        found = _misfit(there, shape, power, floor)
        gain = here[0] - found[0]
        logs, here, damping = (there, found, 0.1 * damping) if gain > 0.0 else (logs, here, 10.0 * damping)
        if 0.0 < gain < 1e-9:
            break
    return float(np.exp(logs[0])), float(np.exp(logs[1]))


def _misfit(logs: np.ndarray, shape: np.ndarray, power: np.ndarray, floor: float) -> tuple[float, np.ndarray, Any]:
    """Minus the log likelihood of logarithms of white and pink level, its slope ``(2,)`` and its bend ``(2, 2)``."""
    parts = np.exp(logs)[:, None] * shape
    density = parts.sum(axis=0) + floor
    share, pull = power / density, parts / density
    return float(np.sum(np.log(density) + share)), pull @ (1.0 - share), pull @ pull.T


def half_weights(size: int) -> np.ndarray:
    """Weights ``(size // 2 + 1,)`` of the frequencies of a real transform of `size` samples in the mean over all."""
    found = np.full(size // 2 + 1, 2.0 / size)
    found[0] = 1.0 / size
    if size % 2 == 0:
        found[-1] = 1.0 / size
    return found


@RAN_AWAY
def products_of_spectra(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Real parts of the sums of ``conj(left[i]) right[j]`` over all but the first axis, ``(n_left, n_right)``."""
    # Real and imaginary parts as so many numbers: their products are the real part.
    pairs = [np.ascontiguousarray(part).reshape(len(part), -1).view(float) for part in (left, right)]
    return pairs[0] @ pairs[1].T
