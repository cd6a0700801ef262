"""How loud noise of a known colour gets by chance, in as many trials as are made.

Law
---
The mean square of n samples of normal noise with autocorrelation R is ``Σ λ_i z_i²`` with the eigenvalues λ of
``R_ij / n`` and independent normal z. It exceeds q with a probability of at most ``exp(-t q) Π (1 - 2 t λ_i)^(-1/2)``,
for any t up to ``1 / (2 max λ)``; the best t is taken, and each trial is given an equal part of the error (Bonferroni).

Source
------
Chernoff, Ann. Math. Stat. 23 (1952); for sums of squares Laurent and Massart, Ann. Stat. 28 (2000), Lemma 1.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from fibrefit.discovery.engine.thresholds import KNOWN, WRONGLY
from fibrefit.discovery.residuals.eigenvalues import autocorrelation, eigenvalues
from fibrefit.problem import Noise

TRIED = 400
"""Values of t of which the best is taken."""


@lru_cache(maxsize=512)
def loudest(noise: Noise, width: int, count: int, rate: float, trials: int) -> float:
    """Mean square, in units of the noise, that noise alone exceeds in one of many windows once in a hundred times.

    Parameters
    ----------
    noise : Noise
        Where its colour is not known it is taken for white.
    width : int
        Samples of a window.
    count : int
        Samples of the record.
    rate : float
        In Hz.
    trials : int
        Number of windows that are looked at.
    """
    sizes = eigenvalues(autocorrelation(noise, count, rate)[:width])
    t = np.linspace(0.0, 1.0, TRIED)[1:-1] / (2.0 * sizes.max())
    # One after the other: of a window of a million samples all of them together take gigabytes.
    bound = np.log(trials / WRONGLY) - 0.5 * np.array([np.log1p(-2.0 * one * sizes).sum() for one in t])
    doubt = 1.0 + KNOWN * np.sqrt(2.0 / noise.samples) if noise.samples else 1.0
    return float(doubt * np.min(bound / t))
