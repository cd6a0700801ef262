"""Which noise the records hold: white, autoregressive or coloured; chosen by what the residuals of a fit say.

The candidates are compared by their log likelihood at the same residuals, less half the logarithm of the number of
samples for each number they contain (Schwarz's Bayesian information criterion, BIC).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.programs import kept_program
from fibrefit.problem.noise.autoregressive import order_and_covariance
from fibrefit.problem.noise.coloured import longest
from fibrefit.problem.noise.likelihood import Likelihood, likelihood_of, unit_of
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.noise.whitening import Autoregressive, White, Whitening, innovations
from fibrefit.problem.noise.whittle import noise_of_residuals, whitening_of
from fibrefit.problem.statement.layout import Layout, normal_equations
from fibrefit.problem.statement.matrices import least_squares
from fibrefit.problem.statement.problem import Linearised, Problem

TINY = 1e-30


@dataclass(frozen=True)
class NoiseModel:
    """The likelihood chosen, and why.

    Parameters
    ----------
    kind : {"white", "autoregressive", "coloured"}
    requested : str
        ``"auto"`` where it was chosen; the kind requested; or ``"fit"`` where it is that of a fit.
    scores : dict of str to float
        Log likelihood less penalty of every kind that was tried, over that of white noise.
    noise : tuple of Noise
        Spectrum of each channel in SI units, where the kind is coloured.
    orders : tuple of int
        Of the autoregression of each channel, where one was tried.
    kurtosis : float
        Excess kurtosis of the innovations: the largest of all channels.
    """

    likelihood: Likelihood
    kind: str
    requested: str
    scores: dict[str, float]
    noise: tuple[Noise, ...] = ()
    channels: tuple[str, ...] = ()
    orders: tuple[int, ...] = ()
    kurtosis: float = 0.0


class _Evidence(NamedTuple):
    """What the noise is judged by.

    Parameters
    ----------
    residuals : (n_record, n_channel, n_time) in units of the noise
    slopes : (n_record, n_channel, n_time, n_local)
        Scaled to length one, since only their directions count.
    valid : (n_record, n_channel, n_time) bool
    columns : (n_record, n_local) int
    unit : (n_record, n_channel)
    """

    residuals: jax.Array
    slopes: jax.Array
    valid: jax.Array
    columns: jax.Array
    unit: Any


def choose_noise_model(
    problem: Problem,
    linear: Linearised,
    kind: str = "auto",
    known: tuple[bool, ...] | None = None,
    heavy: bool = False,
    spectrum: Mapping[str, Noise] | None = None,
) -> NoiseModel:
    """Likelihood for a problem whose residuals near the optimum are known.

    Parameters
    ----------
    linear : Linearised
        At the optimum.
    kind : {"auto", "white", "autoregressive", "coloured"}
        ``"auto"`` chooses among all.
    known : tuple of bool
        Whether the noise level of each channel is given and not to be learnt; none by default.
    heavy : bool
        Student's t for the innovations instead of a normal law.
    spectrum : mapping of channel to Noise
        Noise of the rests: where the kind is ``"coloured"`` and that of all channels is given, it is taken as it is.
    """
    channels = problem.model.rig.channels
    known = known or (False,) * len(channels)
    evidence = _evidence(problem, linear)
    found: dict[str, Whitening] = {}
    noise: tuple[Noise, ...] = ()
    orders: tuple[int, ...] = ()
    if kind in ("auto", "white"):
        found["white"] = White(evidence.valid)
    if kind in ("auto", "autoregressive"):
        found["autoregressive"], orders = _autoregressive(evidence, known)
    if kind in ("auto", "coloured"):
        given = [(spectrum or {}).get(c) for c in channels]
        stated = tuple(n for n in given if n is not None)
        as_given = kind == "coloured" and len(stated) == len(channels)
        noise = stated if as_given else noise_of_residuals(problem, at_best(problem.layout, linear).residuals)
        noise = _as_known(problem, noise, known, np.asarray(evidence.unit))
        found["coloured"] = whitening_of(problem, noise)
    white = _score(White(evidence.valid), evidence, len(channels))
    numbers = {
        "white": len(channels),
        "autoregressive": len(channels) + sum(orders),
        "coloured": sum(_numbers_of(of) for of in noise),
    }
    scores = {name: _score(whitening, evidence, numbers[name]) - white for name, whitening in found.items()}
    # An autoregression of order zero is white noise: rounding must not choose between two names of one thing.
    best = max(scores, key=lambda name: round(scores[name], 6))
    likelihood = likelihood_of(found[best], problem.observations, channels, known, heavy)
    tails = _kurtosis(found[best], evidence)
    return NoiseModel(likelihood, best, kind, scores, noise if best == "coloured" else (), channels, orders, tails)


def _numbers_of(noise: Noise) -> int:
    """Numbers a spectrum was fitted with: its levels, and two for each first-order part and each line."""
    return 1 + (noise.pink > 0.0) + 2 * len(noise.slow) + 2 * len(noise.all_lines)


def _evidence(problem: Problem, linear: Linearised) -> _Evidence:
    data, channels = problem.observations, problem.model.rig.channels
    valid = jnp.stack([data.weight[c] for c in channels], axis=1) > 0.0
    length = jnp.sqrt(jnp.sum(linear.slopes**2, axis=(0, 1, 2), keepdims=True))
    slopes = linear.slopes / jnp.where(length > 0.0, length, 1.0)
    columns = jnp.asarray(problem.layout.local_columns)
    return _Evidence(linear.residuals, slopes, valid, columns, unit_of(data, channels))


def _autoregressive(evidence: _Evidence, known: tuple[bool, ...]) -> tuple[Autoregressive, tuple[int, ...]]:
    valid = np.asarray(evidence.valid)
    found = [
        order_and_covariance(np.asarray(evidence.residuals[:, c]), valid[:, c]) for c in range(evidence.valid.shape[1])
    ]
    covariances = [c / c[0] if fixed else c for (_, c), fixed in zip(found, known, strict=True)]
    return Autoregressive.of(covariances, valid), tuple(order for order, _ in found)


def at_best(layout: Layout, linear: Linearised) -> Linearised:
    """Residuals where the slopes say that their sum of squares is smallest: what parameters can do is no noise."""
    return after_step(layout, linear, least_squares_step(layout, linear))


def after_step(layout: Layout, linear: Linearised, step: np.ndarray) -> Linearised:
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


def _as_known(
    problem: Problem, noise: tuple[Noise, ...], known: tuple[bool, ...], unit: np.ndarray
) -> tuple[Noise, ...]:
    """Spectra that tell the colour only where the level of a channel was given."""
    experiment = problem.observations.experiment
    times, counts = np.asarray(experiment.times), np.asarray(experiment.count)
    duration, rate = longest(times, counts), 1.0 / float(np.diff(times[0][: counts[0]]).mean())
    return tuple(
        of.scaled(float(unit[:, c].mean()) / of.rms(duration, rate)) if fixed else of
        for c, (of, fixed) in enumerate(zip(noise, known, strict=True))
    )


def _score(whitening: Whitening, evidence: _Evidence, numbers: int) -> float:
    """Log likelihood at the best level of each channel, less the penalty."""
    squares, counts, log_scale = map(np.asarray, _squares(whitening, evidence.residuals, evidence.valid))
    squares, counts = squares[counts > 0], counts[counts > 0]
    if (squares == 0.0).any():
        return -math.inf
    profile = -0.5 * np.sum(counts * (np.log(squares / counts) + 1.0))
    return float(profile - log_scale - 0.5 * numbers * np.log(counts.sum()))


@kept_program
def _squares(whitening: Whitening, residuals: jax.Array, valid: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
    return jnp.sum(whitening.whiten(residuals) ** 2, axis=(0, 2)), jnp.sum(valid, axis=(0, 2)), whitening.log_scale


def _kurtosis(whitening: Whitening, evidence: _Evidence) -> float:
    """Excess kurtosis of the innovations, the largest of all channels."""
    fresh, valid = np.asarray(innovations(whitening, evidence.residuals)), np.asarray(evidence.valid)
    each = [fresh[:, c][valid[:, c]] for c in range(valid.shape[1]) if valid[:, c].any()]
    return max(float(np.mean(x**4) / max(np.mean(x**2), TINY) ** 2 - 3.0) for x in each)
