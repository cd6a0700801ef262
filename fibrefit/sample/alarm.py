"""Where physics is missing, a model of the noise explains it away; this tells the one from the other.

Plain and whitened least squares weigh the samples differently. Where the model is right and only the noise is coloured
both find the same values up to an error that is known; where the model lacks something they are led to different ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from fibrefit.core.check import Check
from fibrefit.problem.layout import Layout
from fibrefit.problem.problem import Linearised
from fibrefit.problem.whitening import Whitening, innovations

UNLIKELY = 1e-3
"""Probability below which the difference of the two estimates is not taken for chance."""
LOUD = 1.1
"""Noise in the residuals over the noise at rest that still passes."""


@dataclass(frozen=True)
class Parting:
    """Difference of the plain and the whitened estimate, in units of its standard error.

    Parameters
    ----------
    scores : (n_free,)
        NaN where the difference has no error to speak of.
    chance : float
        Probability of a difference as large as this, of all values together, if the model is right.
    efficiency : (n_free,)
        Standard error of the whitened estimate over that of the plain one, on the same noise.
    """

    scores: np.ndarray
    chance: float
    efficiency: np.ndarray


def parting(layout: Layout, linear: Linearised, whitening: Whitening, level: np.ndarray) -> Parting:
    """Compare the plain estimate with the one a whitened step leads to from there.

    Law
    ---
    d = -(J'C^-1 J)^-1 J'C^-1 r at the plain optimum, where J'r = 0; if the model is right, d has the covariance of the
    plain estimate less that of the whitened one.

    Parameters
    ----------
    layout : Layout
    linear : Linearised
        At the plain estimate.
    whitening : Whitening
    level : (n_channel,)
        Noise over what the whitening assumes.

    Returns
    -------
    Parting
    """
    slopes = np.asarray(linear.slopes)
    sharp = np.asarray(innovations(whitening, jnp.asarray(slopes))) / level[:, None, None]
    fresh = np.asarray(innovations(whitening, jnp.asarray(linear.residuals))) / level[:, None]
    bread = inverse(assembled(layout, _products(slopes, slopes)))
    middle = assembled(layout, _products(slopes, correlated(slopes, whitening, level)))
    best = inverse(assembled(layout, _products(sharp, sharp)))
    step = -best @ gathered(layout, np.einsum("rcti,rct->ri", sharp, fresh))
    return parted(step, bread @ middle @ bread, best)


def parted(difference: np.ndarray, of_plain: np.ndarray, of_whitened: np.ndarray) -> Parting:
    """Judge the difference of two estimates, the second of which is efficient.

    Parameters
    ----------
    difference : (n_free,)
    of_plain, of_whitened : (n_free, n_free)
        Their covariances, if the model is right.

    Returns
    -------
    Parting

    Source
    ------
    Hausman, Econometrica 46 (1978).
    """
    from scipy.stats import chi2

    seen = np.diag(of_plain) > 0.0
    unit = np.where(seen, 1.0 / np.sqrt(np.where(seen, np.diag(of_plain), 1.0)), 0.0)
    excess, difference = (of_plain - of_whitened) * np.outer(unit, unit), difference * unit
    spare = np.diag(excess) > SLIGHT
    scores = np.where(spare, difference / np.sqrt(np.where(spare, np.diag(excess), 1.0)), np.nan)
    values, vectors = np.linalg.eigh(excess)
    used = values > SLIGHT
    statistic = np.sum((vectors[:, used].T @ difference) ** 2 / values[used])
    chance = float(chi2.sf(statistic, max(used.sum(), 1)))
    return Parting(scores, chance, np.sqrt(np.clip(np.diag(of_whitened), 0.0, None)) * unit)


SLIGHT = 0.02
"""Share of the plain estimate's variance below which both methods are one, and their difference says nothing."""


def inverse(matrix: np.ndarray) -> np.ndarray:
    """Pseudo-inverse of a symmetric matrix whose rows may have any units; nil where there is nothing."""
    scale = np.sqrt(np.where(np.diag(matrix) > 0.0, np.diag(matrix), 1.0))
    return np.linalg.pinv(matrix / np.outer(scale, scale), rcond=1e-10, hermitian=True) / np.outer(scale, scale)


def assembled(layout: Layout, local: np.ndarray) -> np.ndarray:
    """Sum of matrices ``(n_record, n_local, n_local)`` in the places of the free values, ``(n_free, n_free)``."""
    total = np.zeros((layout.size + 2, layout.size + 2))
    for own, place in zip(local, layout.local_columns, strict=True):
        np.add.at(total, (place[:, None], place[None, :]), own)
    return total[: layout.size, : layout.size]


def gathered(layout: Layout, local: np.ndarray) -> np.ndarray:
    """Sum of vectors ``(n_record, n_local)`` in the places of the free values, ``(n_free,)``."""
    total = np.zeros(layout.size + 2)
    np.add.at(total, layout.local_columns, local)
    return total[: layout.size]


def correlated(slopes: np.ndarray, whitening: Whitening, level: np.ndarray) -> np.ndarray:
    """Covariance of the noise times columns ``(n_record, n_channel, n_time, n)``, by convolution."""
    size = slopes.shape[2]
    lags = whitening.autocovariance(size) * level[:, None] ** 2
    wrapped = np.concatenate([lags, np.zeros_like(lags[..., :1]), lags[..., :0:-1]], axis=-1)
    spectrum = np.fft.rfft(wrapped, axis=-1)[..., None] * np.fft.rfft(slopes, 2 * size, axis=2)
    seen = np.any(slopes != 0.0, axis=-1, keepdims=True)
    return np.where(seen, np.fft.irfft(spectrum, 2 * size, axis=2)[:, :, :size], 0.0)


def _products(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    return np.einsum("rcti,rctj->rij", left, right)


def parting_check(names: tuple[str, ...], found: Parting) -> Check:
    """Whether both estimates agree within the error of their difference."""
    passed = found.chance >= UNLIKELY
    if passed:
        says = "Plain and whitened estimates agree within their errors: the noise model hides no physics that shows."
    else:
        order = np.argsort(-np.nan_to_num(np.abs(found.scores)))[:3]
        worst = ", ".join(f"{names[i]} by {abs(found.scores[i]):.2g}" for i in order if np.isfinite(found.scores[i]))
        says = (
            f"Plain and whitened estimates part by more than their errors ({worst} standard errors of the difference): "
            "the model lacks something, and the noise model is explaining it away. Run discover before you trust this."
        )
    return Check("plain and whitened estimates agree", passed, says, found.chance, UNLIKELY)


def loudness_check(channels: tuple[str, ...], ratio: np.ndarray) -> Check:
    """Whether the residuals are as quiet as the records at rest.

    Parameters
    ----------
    channels : tuple of str
    ratio : (n_channel,)
        Rms of the residuals over what the noise at rest, or stated by the study, and that of inputs account for.
    """
    worst = int(np.argmax(ratio))
    passed = bool(ratio[worst] <= LOUD)
    says = (
        "The residuals are as quiet as the records at rest."
        if passed
        else f"The residuals of {channels[worst]} are {ratio[worst]:.3g} times as loud as the record at rest: what the "
        "model lacks is counted as noise, and the intervals are those of a model that is wrong. Run discover."
    )
    return Check("the residuals are noise", passed, says, float(ratio[worst]), LOUD)
