"""How sure an estimate is when the noise is not white: several answers side by side.

All start from the sandwich ``H^-1 S H^-1``: H = J'J is what the model sees of the parameters, S the variance of the
score J'r. They differ in what they believe of the residuals r.

Source
------
White, Econometrica 48 (1980); Whittle, Ark. Mat. 2 (1953); Newey and West, Econometrica 55 (1987); Kuensch, Ann.
Statist. 17 (1989).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from fibrefit.core.arrays import assembled, gathered
from fibrefit.core.matrices import equilibrated, least_squares, scale_of
from fibrefit.core.spectra import half_weights, periodogram, products_of_spectra, whittle
from fibrefit.fitting.thresholds import BLIND_PART
from fibrefit.problem import Linearised, Problem

MEMORY = 1.0 / 8.0
"""Longest correlation allowed for, as a share of a record: the slow noise of a logger has no time scale of its own."""


@dataclass(frozen=True)
class Scores:
    """Residuals and slopes at the optimum, as arrays of NumPy.

    Parameters
    ----------
    residuals : (n_record, n_channel, n_time) in units of the noise
    slopes : (n_record, n_channel, n_time, n_local)
        Per unit of the local free values.
    counts : (n_record,) samples of each record
    columns : (n_record, n_local)
        Place of each local value among the free ones.
    size : int
        Number of free values.
    prior : (n_record, n_local, n_local), optional
        What is to be added to each record's normal matrix for unknowns that were eliminated and have a prior.
    belief : (n_free + 1, n_free + 1), optional
        What is believed of the values themselves, see `Layout.prior_gram`.
    """

    residuals: np.ndarray
    slopes: np.ndarray
    counts: np.ndarray
    columns: np.ndarray
    size: int
    prior: np.ndarray | None = None
    belief: np.ndarray | None = None

    @classmethod
    def of(cls, problem: Problem, linear: Linearised, values: np.ndarray) -> Scores:
        """From what a problem says at its optimum, `values` ``(n_free,)`` in SI units."""
        layout, counts = problem.layout, np.asarray(problem.observations.experiment.count)
        residuals, slopes = np.asarray(linear.residuals), np.asarray(linear.slopes)
        return cls(residuals, slopes, counts, layout.local_columns, layout.size, belief=layout.prior_gram(values))

    def prior_matrix(self) -> np.ndarray:
        """The part of the normal matrix that is due to priors; as a score's variance it is the same."""
        whole = np.zeros((self.size, self.size)) if self.prior is None else self._placed(self.prior)
        return whole if self.belief is None else whole + self.belief[:-1, :-1]

    def assembled(self, local: Callable[[int], np.ndarray]) -> np.ndarray:
        """Sum of the records' matrices ``local(record)``, ``(n_local, n_local)``, in the places of the free values."""
        return self._placed(np.stack([local(record) for record in range(len(self.columns))]))

    def _placed(self, local: np.ndarray) -> np.ndarray:
        return assembled(local, self.columns, self.size)

    def gradient(self) -> np.ndarray:
        """``J'r``, ``(n_free,)``."""
        local = np.stack([self.of_record(record).sum(axis=0) for record in range(len(self.columns))])
        found = gathered(local, self.columns, self.size)
        return found if self.belief is None else found + self.belief[:-1, -1]

    def normal_matrix(self) -> np.ndarray:
        """``J'J``, ``(n_free, n_free)``."""
        return self.seen + self.prior_matrix()

    @cached_property
    def seen(self) -> np.ndarray:
        """The part of the normal matrix that records tell: all methods ask for it."""
        return self.assembled(lambda r: np.einsum("cti,ctj->ij", self.slopes[r], self.slopes[r]))

    def variance(self) -> float:
        """Mean square of the residuals, for the number of values that were fitted to them."""
        return float(np.sum(self.residuals**2) / max(np.count_nonzero(self.residuals) - self.size, 1))

    def predicted_reduction(self, moving: np.ndarray) -> float:
        """Reduction of the cost predicted of one Gauss-Newton step of the values ``moving``, over the variance."""
        normal, gradient = self.normal_matrix()[moving][:, moving], self.gradient()[moving]
        if not moving.any():
            return 0.0
        found = float(least_squares(normal, gradient) @ gradient / max(self.variance(), 1e-300))
        # Where a motion has no slopes, nothing says that the search has arrived.
        return np.inf if np.isnan(found) else found

    def of_record(self, record: int) -> np.ndarray:
        """Scores ``(n_time, n_local)`` of one record, its channels summed."""
        count = self.counts[record]
        return np.einsum("cti,ct->ti", self.slopes[record, :, :count], self.residuals[record, :, :count])


def white(scores: Scores) -> np.ndarray:
    """Score variance if residuals were independent with one variance."""
    prior = scores.prior_matrix()
    return scores.variance() * (scores.normal_matrix() - prior) + prior


def stationary(scores: Scores, rate: float) -> np.ndarray:
    """Score variance of stationary noise that is white and pink, as the residuals' spectrum has it.

    Parameters
    ----------
    rate : float
        Samples a second, in Hz.
    """
    return scores.assembled(stationary_parts(scores, rate))


def stationary_parts(scores: Scores, rate: float) -> Callable[[int], np.ndarray]:
    """The same of single records, ``(n_local, n_local)``, the noise of all being that of each.

    Law
    ---
    ``S = integral of P(f) X(f)* X(f) df`` with X the transform of the slopes, and P = white + pink / f of each channel
    by maximum likelihood from the residuals of all records. Below one over the length of a record P stays as it is
    there: noise that is slower than a record lasts is an offset in it, which no part of that record can tell.
    """
    # White and pink level of each channel's residuals, in units of the noise squared over Hz, and at 1 Hz.
    levels = []
    for channel in range(scores.residuals.shape[1]):
        frequencies, powers = [], []
        for record, count in enumerate(scores.counts):
            values = scores.residuals[record, channel, :count]
            frequency, power = periodogram(values, rate)
            frequencies.append(frequency)
            # Masked samples are zero and bring no power.
            powers.append(power * count / max(np.count_nonzero(values), 1))
        levels.append(whittle(np.concatenate(frequencies), np.concatenate(powers)))

    def local(record: int) -> np.ndarray:
        count = int(scores.counts[record])
        # Twice as many frequencies, or eight times, change error bars by a thousandth.
        size = 2 << count.bit_length()
        frequency = np.fft.rfftfreq(size, 1.0 / rate)
        slow = np.maximum(frequency, rate / count)
        found = np.zeros((scores.columns.shape[1],) * 2)
        # Channel by channel: the transforms of all of a long record at once are beyond the fast memory.
        for channel, (white_level, pink_level) in enumerate(levels):
            spectra = rfft(scores.slopes[record, channel, :count].T, size)
            spectra *= np.sqrt(0.5 * rate * half_weights(size) * (white_level + pink_level / slow))
            found += products_of_spectra(spectra, spectra)
        return found

    return local


def newey_west(scores: Scores) -> np.ndarray:
    """Score variance from the scores' own autocovariance, with Bartlett's weights."""
    return scores.assembled(lambda record: newey_west_of(scores.of_record(record)))


def newey_west_of(score: np.ndarray) -> np.ndarray:
    """The part of one record, from its scores ``(n_time, n_local)``."""
    score, lags = score - score.mean(axis=0), max(round(MEMORY * len(score)), 1)
    size = next_fast_len(len(score) + lags, real=True)
    spectrum = rfft(np.ascontiguousarray(score.T), size)
    # The Bartlett-weighted sum of autocovariances is a weighted sum over the periodogram: one pass instead of `lags`.
    weight = np.zeros(size)
    taper = 1.0 - np.arange(lags + 1) / (lags + 1.0)
    weight[: lags + 1] = taper
    weight[-lags:] = taper[:0:-1]
    return products_of_spectra(spectrum, spectrum * (rfft(weight).real * half_weights(size)))


def block_bootstrap(scores: Scores) -> np.ndarray:
    """Score variance from resampled blocks of residuals, circular within each record.

    Law
    ---
    Every place of a block draws its residuals from anywhere in the record, independently of the others. The variance
    over all draws is then ``sum over blocks of s'C s`` with C the residuals' circular autocovariance between channels,
    of which a block sees lags up to its own length: what infinitely many resamples would give, without drawing one.
    """

    def local(record: int) -> np.ndarray:
        count = int(scores.counts[record])
        length = max(round(MEMORY * count), 1)
        size = next_fast_len(2 * length, real=True)
        seen = rfft(_cut(np.moveaxis(scores.slopes[record, :, :count], -1, 1), length), size)
        residuals = scores.residuals[record, :, :count]
        waves = rfft(residuals - residuals.mean(axis=-1, keepdims=True))
        lags = irfft(waves[:, None] * waves.conj(), count) / count
        kept = np.zeros((*lags.shape[:2], size))
        kept[..., :length] = lags[..., :length]
        if length > 1:
            kept[..., 1 - length :] = lags[..., 1 - length :]
        # Scaled so that sums over the frequencies of a real transform of `size` are those over its lags.
        between = rfft(kept) * half_weights(size)
        # Of each channel the sum over all that its residuals go with.
        moved = np.stack([np.sum(row[:, None, None] * seen, axis=0) for row in between])
        return products_of_spectra(np.moveaxis(seen, 1, 0), np.moveaxis(moved, 1, 0))

    return scores.assembled(local)


def by_windows(scores: Scores, window: int) -> np.ndarray:
    """Score variance where a motion is begun anew in each window: what grows inside a window ends with it.

    Law
    ---
    ``S = Σ_w J_w' C J_w`` with J_w the slopes of window w and C the mean of ``r_w r_w'`` over all windows of all
    records: any window might have had the residuals of any other, instant by instant. The error of a measured force
    grows along a window as the slopes do, so that residuals are not stationary. Each r_w is what the rest of the
    records leaves of that window, ``(I - J_w H^-1 J_w')^-1`` times its residual: values fitted to few windows leave
    too little of them (as in the jackknife).

    Parameters
    ----------
    window : int
        Samples of each; the last of a record may hold fewer.
    """
    found = []
    for r, columns in enumerate(scores.columns):
        count = int(scores.counts[r])
        rows = np.concatenate([scores.residuals[r, :, :count, None], scores.slopes[r, :, :count]], axis=-1)
        cut = _cut(np.moveaxis(rows, -1, 1), window)  # (n_channel, 1 + n_local, n_window, window)
        cut = np.moveaxis(cut, (2, 0, 3), (0, 1, 2)).reshape(cut.shape[2], -1, cut.shape[1])
        placed = np.zeros((*cut.shape[:2], 1 + scores.size + 1))
        placed[..., 0] = cut[..., 0]
        placed[..., 1 + np.minimum(columns, scores.size)] = cut[..., 1:]
        found.append(placed[..., : 1 + scores.size])
    # Residuals ``(n_window, n_row)`` and slopes ``(n_window, n_row, n_free)``, the rows of all channels in turn.
    whole = np.concatenate(found)
    slopes, residuals = whole[..., 1:], whole[..., 0]
    root = inverse_root(scores.normal_matrix())
    turned = slopes @ root
    share, axes = np.linalg.eigh(np.einsum("wti,wtj->wij", turned, turned))
    share = np.clip(share, 0.0, 1.0 - BLIND_PART)
    along = np.einsum("wti,wt->wi", turned, residuals)
    grown = np.einsum("wij,wj,wkj,wk->wi", axes, 1.0 / (1.0 - share), axes, along)
    own = residuals + np.einsum("wti,wi->wt", turned, grown)
    counted = np.sqrt((residuals != 0.0).sum(axis=0))
    own = own / np.where(counted > 0.0, counted, 1.0)
    if len(own) < window:
        score = np.einsum("wti,vt->wvi", slopes, own).reshape(-1, scores.size)
        return score.T @ score
    covariance = own.T @ own
    return np.einsum("wti,wtj->ij", slopes, covariance @ slopes)


def inverse_root(normal: np.ndarray) -> np.ndarray:
    """A root L ``(n, n_seen)`` of the inverse of a normal matrix, ``L L' = H^-1``; what data do not see is left out."""
    if not np.isfinite(normal).all():
        return np.zeros((len(normal), 0))  # where slopes are no numbers nothing is known
    scale = scale_of(normal)
    values, vectors = np.linalg.eigh(equilibrated(normal, scale))
    seen = values > 1e-12 * max(values.max(), 1e-300)
    return vectors[:, seen] / np.sqrt(values[seen]) / scale[:, None]


def _cut(rows: np.ndarray, length: int) -> np.ndarray:
    """Rows ``(..., n)`` in blocks of a length, ``(..., n_block, length)``; the last is filled up with zeros."""
    spare = -rows.shape[-1] % length
    return np.pad(rows, [(0, 0)] * (rows.ndim - 1) + [(0, spare)]).reshape(*rows.shape[:-1], -1, length)


def sandwich(normal: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """Covariance ``H^-1 S H^-1``; directions the data do not see get an infinite variance, not a large one.

    Parameters
    ----------
    normal, middle : (n_free, n_free)
    """
    if not (np.isfinite(normal).all() and np.isfinite(middle).all()):
        return np.diag(np.full(len(normal), np.inf))  # where slopes are no numbers nothing is known
    seen, scale = np.diag(normal) > 0.0, scale_of(normal)
    values, vectors = np.linalg.eigh(equilibrated(normal, scale))
    blind = values < 1e-12 * values.max()
    inverse = equilibrated((vectors / np.where(blind, np.inf, values)) @ vectors.T, scale)
    covariance = inverse @ middle @ inverse
    lost = (np.abs(vectors[:, blind]) > BLIND_PART).any(axis=1) | ~seen
    covariance[np.diag_indices_from(covariance)] = np.where(lost, np.inf, np.diag(covariance))
    return covariance


@dataclass(frozen=True)
class ErrorBars:
    """Covariances ``(n_free, n_free)`` of one estimate.

    Parameters
    ----------
    covariances : mapping of method to (n_free, n_free)
    method : str
        The one that is believed.
    of_noise : str
        The one that was believed before what the model lacks was allowed for; empty where nothing was.
    inverse : (n_free, n_free), optional
        Of the normal matrix, by which values follow the centres of their priors; None where that is the covariance.
    """

    covariances: Mapping[str, np.ndarray]
    method: str
    of_noise: str = ""
    inverse: np.ndarray | None = None

    @property
    def covariance(self) -> np.ndarray:
        """The one that is believed."""
        return self.covariances[self.method]

    @property
    def errors(self) -> dict[str, np.ndarray]:
        """Standard errors ``(n_free,)`` by method."""
        return {name: np.sqrt(np.diag(matrix)) for name, matrix in self.covariances.items()}


class Freedom(NamedTuple):
    """Degrees of freedom of F, the law of a mean square that errors of values leave, over what is expected of it.

    Parameters
    ----------
    directions : float
        Independent directions in which readings are off: one where the error of one value outweighs all others.
    known : float
        With which the variance of the values is known; infinite where that is integrated over.
    """

    directions: float
    known: float = np.inf


def predictive_slopes(problem: Problem, local: np.ndarray, names: Sequence[str]) -> np.ndarray:
    """Change of predicted readings by each value, ``(n_record, n_channel, n_time, n_name)`` in units of the noise's.

    Parameters
    ----------
    problem : Problem
        Of the records that are predicted, its parameters free.
    local : (n_record, n_local) in SI units
    names : sequence of str
        Parameters that are not known exactly.

    Law
    ---
    ``P S``, with S the slopes of the readings by the values. P takes out what each record's own values, which are
    fitted to it, make up for.
    """
    slopes = np.asarray(problem.linearised_at(jnp.asarray(local)).slopes)
    free = [problem.layout.names[i] for i in problem.layout.local_free]
    known = [free.index(name) for name in names]
    declared = {parameter.name for parameter in problem.model.parameters}
    own = [i for i, name in enumerate(free) if name not in declared]
    moved = np.zeros((*slopes.shape[:-1], len(known)))
    for r, record in enumerate(slopes):
        rows = np.nan_to_num(record.reshape(-1, len(free)))
        # Columns of the values less their best fit by those of the record's own.
        size = np.linalg.norm(rows[:, own], axis=0)
        used, found = rows[:, own][:, size > 0.0] / size[size > 0.0], rows[:, known]
        if used.size:
            found = found - used @ np.linalg.lstsq(used, found, rcond=None)[0]
        moved[r] = found.reshape(moved[r].shape)
    return moved


def predictive_variance(slopes: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Variance of predicted readings ``(...)``, the diagonal of ``P S C S' P``.

    Parameters
    ----------
    slopes : (..., n_name)
        Of `predictive_slopes`.
    covariance : (n_name, n_name)
    """
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return np.asarray(np.sum((slopes @ root) ** 2, axis=-1))


def freedom_of(slopes: np.ndarray, covariance: np.ndarray, own: np.ndarray, known: np.ndarray) -> Freedom:
    """Degrees of freedom of the mean square of errors that values leave in the readings of some records.

    Parameters
    ----------
    slopes : (n_record, n_time, n_name)
        Of the readings that count, each in units in which their squares are added.
    covariance : (n_name, n_name)
        Of the values that are predicted with, what a new record differs by included.
    own : (n_name,)
        Part of each variance that every record has for itself; the rest is off alike in all.
    known : (n_name,)
        Degrees of freedom with which each variance is known.

    Law
    ---
    The mean square is ``sum_r e_r'e_r`` with ``Cov(e_r, e_s) = S_r (A + [r = s] W) S_s'``, A what is common and W what
    is a record's own: its degrees of freedom are those of the chi-square law of the same mean and variance. Variances
    that are known with degrees of freedom of their own add up likewise.

    Source
    ------
    Satterthwaite, Biometrics Bulletin 2 (1946).
    """
    gram = np.einsum("rti,rtj->rij", slopes, slopes)
    shares = np.diagonal(covariance) * np.einsum("rii->i", gram)
    mean = float(np.einsum("rij,ji->", gram, covariance))
    if not mean > 0.0:
        return Freedom(1.0)
    common = covariance - np.diag(own)
    half = _square(common @ gram.sum(axis=0)) + np.sum(_square(covariance @ gram) - _square(common @ gram))
    unsure = float(np.sum((shares / mean) ** 2 / known))
    return Freedom(mean**2 / float(half), 1.0 / unsure if unsure > 0.0 else np.inf)


def _square(matrices: np.ndarray) -> np.ndarray:
    """Trace of the squares of matrices ``(..., n, n)``."""
    return np.einsum("...ij,...ji->...", matrices, matrices)
