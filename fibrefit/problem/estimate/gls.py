"""Generalised least squares, and the Hausman test of its estimate against that of plain least squares.

Where noise is autocorrelated, plain least squares listens to it for as long as a record lasts. Residuals and slopes are
whitened instead, and the same Gauss-Newton step taken on what they become: no unbiased estimate is surer.

Where physics is missing, a model of the noise explains it away; the test tells the one from the other. Both estimates
weigh the samples differently. Where the model is right and only the noise is coloured both find the same values up to
an error that is known; where the model lacks something they are led to different ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from scipy.fft import next_fast_len, rfft
from scipy.special import chdtrc

from fibrefit.core.arrays import assembled, gathered
from fibrefit.core.matrices import pseudo_inverse
from fibrefit.core.spectra import half_weights, products_of_spectra
from fibrefit.problem.inputs.sensitivities import InputSensitivities
from fibrefit.problem.noise.whitening import Levelled, Whitening, innovations
from fibrefit.problem.statement.layout import Layout, normal_equations
from fibrefit.problem.statement.problem import Linearised
from fibrefit.problem.thresholds import SLIGHT, UNLIKELY
from fibrefit.study.summaries.check import Check


def level_of(whitening: Whitening, residuals: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Noise of residuals over what a whitening assumes, ``(n_channel,)``.

    Parameters
    ----------
    residuals : (n_record, n_channel, n_time)
    counts : (n_channel,)
        Samples that count.
    """
    return _level(np.asarray(innovations(whitening, residuals)), counts)


def _level(fresh: np.ndarray, counts: np.ndarray) -> np.ndarray:
    # A channel that says nothing has a level too: what is divided by it stays a number.
    return np.maximum(np.sqrt(np.sum(fresh**2, axis=(0, 2)) / counts), 1e-6)


@dataclass(frozen=True)
class HausmanTest:
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

    @classmethod
    def at(
        cls,
        layout: Layout,
        linear: Linearised,
        whitening: Whitening,
        level: np.ndarray | None,
        belief: np.ndarray | None = None,
        moving: np.ndarray | None = None,
    ) -> HausmanTest:
        """Compare the plain estimate with the one a whitened step leads to from there.

        Law
        ---
        d = -(J'C^-1 J)^-1 J'C^-1 r at the plain optimum, where J'r = 0; if the model is right, d has the covariance of
        the plain estimate less that of the whitened one.

        Parameters
        ----------
        linear : Linearised
            At the plain estimate.
        level : (n_channel,) or None
            Noise over what the whitening assumes; None: as large as the residuals are.
        belief : (n_free + 1, n_free + 1), optional
            At the plain estimate, see `Layout.prior_gram`; both estimates share it.
        moving : (n_free,) bool, optional
            Values that no bound stops; all by default. At a bound J'r is not 0, and what lies beyond it is no estimate:
            both hold such a value there.
        """
        if moving is not None:
            # Places beyond the free values stand for nothing.
            counts = np.append(moving, [True, True])
            linear = linear._replace(slopes=np.asarray(linear.slopes) * counts[layout.local_columns][:, None, None, :])
            belief = None if belief is None else belief * np.outer(counts[:-1], counts[:-1])
        slopes, residuals = np.asarray(linear.slopes), np.asarray(linear.residuals)
        white = np.asarray(innovations(whitening, np.concatenate([slopes, residuals[..., None]], axis=-1)))
        if level is None:
            level = _level(white[..., -1], np.maximum(np.count_nonzero(residuals, axis=(0, 2)), 1))
        white = white / level[:, None, None]
        normal, gradient = normal_equations(layout, white[..., :-1], white[..., -1], belief)
        covariance = pseudo_inverse(normal)
        prior = 0.0 if belief is None else belief[:-1, :-1]
        bread = pseudo_inverse(normal_equations(layout, slopes, residuals)[0] + prior)
        middle = assembled(scattered(slopes, whitening, level), layout.local_columns, layout.size) + prior
        return cls.of(-covariance @ gradient, bread @ middle @ bread, covariance)

    @classmethod
    def with_input_errors(
        cls,
        layout: Layout,
        linear: Linearised,
        seen: InputSensitivities,
        noise: tuple[Whitening, np.ndarray],
        belief: np.ndarray,
    ) -> HausmanTest:
        """`at` where errors of measured inputs are unknown: both estimates have those that suit them best.

        Law
        ---
        With ``P`` and ``P_c`` what takes off what errors can imitate, in plain least squares and under the noise, the
        plain estimate has the covariance ``A^-1 J'P (C + W W') P J A^-1``, ``A = J'PJ``; that of the whitened one is
        ``(J'P_c J)^-1``.

        Parameters
        ----------
        linear : Linearised
            Anywhere near both; at errors of nothing, linearised.
        seen : InputSensitivities
            Not whitened.
        noise : (Whitening, (n_channel,))
            And its level over what the whitening assumes.
        belief : (n_free + 1, n_free + 1)
            See `Layout.prior_gram`; both estimates share it.
        """
        size, columns, shape = layout.size, layout.local_columns, np.shape(linear.residuals)

        def normal(left: np.ndarray, right: np.ndarray) -> np.ndarray:
            """Products of rows ``(n_record, n_local, n)`` in the places of the free values."""
            return assembled(np.einsum("rin,rjn->rij", left, right), columns, size)

        def gradient(left: np.ndarray, right: np.ndarray) -> np.ndarray:
            return gathered(np.einsum("rin,rn->ri", left, right), columns, size)

        rows = np.concatenate([np.asarray(linear.slopes), np.asarray(linear.residuals)[..., None]], axis=-1)
        flat = np.moveaxis(rows, -1, 1).reshape(len(rows), rows.shape[-1], -1)
        plain = seen.without_errors(flat)
        prior, pull = belief[:-1, :-1], belief[:-1, -1]
        bread = pseudo_inverse(normal(flat[:, :-1], plain[:, :-1]) + prior)
        step = -bread @ (gradient(flat[:, :-1], plain[:, -1]) + pull)
        slopes = np.moveaxis(plain[:, :-1].reshape(shape[0], -1, *shape[1:]), 1, -1)
        by_errors = np.stack([own @ own.T for own in seen.products(plain[:, :-1])])
        middle = assembled(scattered(slopes, *noise) + by_errors, columns, size) + prior
        levelled = Levelled(noise[0], jnp.asarray(noise[1]))
        white = np.moveaxis(np.asarray(innovations(levelled, rows)), -1, 1).reshape(flat.shape)
        kept = seen.through(levelled).without_errors(white)
        covariance = pseudo_inverse(normal(white[:, :-1], kept[:, :-1]) + prior)
        further = -covariance @ (gradient(white[:, :-1], kept[:, -1]) + pull)
        return cls.of(further - step, bread @ middle @ bread, covariance)

    @classmethod
    def of(cls, difference: np.ndarray, of_plain: np.ndarray, of_whitened: np.ndarray) -> HausmanTest:
        """Judge the difference of two estimates, the second of which is efficient.

        Parameters
        ----------
        difference : (n_free,)
        of_plain, of_whitened : (n_free, n_free)
            Their covariances, if the model is right.

        Source
        ------
        Hausman, Econometrica 46 (1978).
        """
        seen = np.diag(of_plain) > 0.0
        unit = np.where(seen, 1.0 / np.sqrt(np.where(seen, np.diag(of_plain), 1.0)), 0.0)
        excess, difference = (of_plain - of_whitened) * np.outer(unit, unit), difference * unit
        spare = np.diag(excess) > SLIGHT
        scores = np.where(spare, difference / np.sqrt(np.where(spare, np.diag(excess), 1.0)), np.nan)
        values, vectors = np.linalg.eigh(excess)
        used = values > SLIGHT
        statistic = np.sum((vectors[:, used].T @ difference) ** 2 / values[used])
        chance = float(chdtrc(max(used.sum(), 1), statistic))
        return cls(scores, chance, np.sqrt(np.clip(np.diag(of_whitened), 0.0, None)) * unit)

    def check(self, names: tuple[str, ...]) -> Check:
        """Whether both estimates agree within the error of their difference."""
        order = np.argsort(-np.nan_to_num(np.abs(self.scores)))[:3]
        worst = tuple((names[i], float(abs(self.scores[i]))) for i in order if np.isfinite(self.scores[i]))
        return Check(
            name="plain and whitened estimates agree",
            passed=self.chance >= UNLIKELY,
            statistic=self.chance,
            threshold=UNLIKELY,
            identifier="hausman",
            quantity="OLS against GLS estimate (Hausman test)",
            about="model",
            facts={"worst": worst},
        )


def scattered(slopes: np.ndarray, whitening: Whitening, level: np.ndarray) -> np.ndarray:
    """Variance ``(n_record, n, n)`` of the products of noise and slopes ``(n_record, n_channel, n_time, n)``."""
    size = next_fast_len(2 * slopes.shape[2] - 1, real=True)
    lags = whitening.autocovariance(slopes.shape[2]) * level[:, None] ** 2
    # Over a range of twice its length no lag of a record comes round again; the density is that of both signs of lags.
    density = 2.0 * rfft(lags, size).real - lags[..., :1]
    density *= half_weights(size)
    spectra = rfft(np.moveaxis(slopes, -1, 1), size)
    return np.stack([products_of_spectra(one, one * power) for one, power in zip(spectra, density, strict=True)])
