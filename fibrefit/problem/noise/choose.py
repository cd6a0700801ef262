"""Which noise the records hold: white, autoregressive or coloured; chosen by what the residuals of a fit say.

The candidates are compared by their log likelihood at the same residuals, less half the logarithm of the number of
samples for each number they contain (Schwarz's criterion).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.noise.autoregressive import order_and_covariance
from fibrefit.problem.noise.coloured import Bank, Coloured, bank_for, coloured_of, longest, variances_of
from fibrefit.problem.noise.likelihood import Likelihood, likelihood_of, unit_of
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.noise.whitening import Autoregressive, White, Whitening, innovations
from fibrefit.problem.statement.problem import Linearised, Problem

KINDS = ("white", "autoregressive", "coloured")
TINY = 1e-30
HEAVY_TAILS = 1.0
"""Excess kurtosis of the innovations above which a normal law is called into question."""


@dataclass(frozen=True)
class NoiseModel:
    """The likelihood chosen, and why.

    Parameters
    ----------
    likelihood : Likelihood
    kind : str
        One of `KINDS`.
    says : str
        The choice and its reason.
    scores : dict of str to float
        Log likelihood less penalty of every kind that was tried, over that of white noise.
    noise : tuple of Noise
        Spectrum of each channel in SI units, where the kind is coloured.
    """

    likelihood: Likelihood
    kind: str
    says: str
    scores: dict[str, float]
    noise: tuple[Noise, ...] = ()


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
    bank : Bank
    """

    residuals: jax.Array
    slopes: jax.Array
    valid: jax.Array
    columns: jax.Array
    unit: Any
    bank: Bank


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
    problem : Problem
    linear : Linearised
        At the optimum.
    kind : str
        One of `KINDS`, or ``"auto"`` to choose among all.
    known : tuple of bool
        Whether the noise level of each channel is given and not to be learnt; none by default.
    heavy : bool
        Student's t for the innovations instead of a normal law.
    spectrum : mapping of channel to Noise
        Noise of the rests. Where the kind is ``"coloured"`` it is taken as it is; where it is ``"auto"`` it is only
        where the search for the spectrum of the residuals begins.

    Returns
    -------
    NoiseModel
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
        start = [(spectrum or {}).get(c) for c in channels]
        given = kind == "coloured" and all(n is not None for n in start)
        noise = tuple(n for n in start if n is not None) if given else _restricted_likelihood(evidence, start)
        found["coloured"] = _coloured(
            evidence, noise, known, longest(*map(np.asarray, problem.observations.experiment[:2]))
        )
    white = _score(White(evidence.valid), evidence, len(channels))
    numbers = {"white": len(channels), "autoregressive": len(channels) + sum(orders), "coloured": 3 * len(channels)}
    scores = {name: _score(whitening, evidence, numbers[name]) - white for name, whitening in found.items()}
    # An autoregression of order nil is white noise: rounding must not choose between two names of one thing.
    best = max(scores, key=lambda name: round(scores[name], 6))
    likelihood = likelihood_of(found[best], problem.observations, channels, known, heavy)
    says = _says(best, kind, scores, orders, noise, channels) + _tails(found[best], evidence, heavy)
    return NoiseModel(likelihood, best, says, scores, noise if best == "coloured" else ())


def _evidence(problem: Problem, linear: Linearised) -> _Evidence:
    data, channels = problem.observations, problem.model.rig.channels
    valid = jnp.stack([data.weight[c] for c in channels], axis=1) > 0.0
    length = jnp.sqrt(jnp.sum(linear.slopes**2, axis=(0, 1, 2), keepdims=True))
    slopes = linear.slopes / jnp.where(length > 0.0, length, 1.0)
    columns = jnp.asarray(problem.layout.local_columns)
    bank = bank_for(*map(np.asarray, (*data.experiment[:2], linear.residuals)))
    return _Evidence(linear.residuals, slopes, valid, columns, unit_of(data, channels), bank)


def _autoregressive(evidence: _Evidence, known: tuple[bool, ...]) -> tuple[Autoregressive, tuple[int, ...]]:
    valid = np.asarray(evidence.valid)
    found = [
        order_and_covariance(np.asarray(evidence.residuals[:, c]), valid[:, c]) for c in range(evidence.valid.shape[1])
    ]
    covariances = [c / c[0] if fixed else c for (_, c), fixed in zip(found, known, strict=True)]
    return Autoregressive.of(covariances, valid), tuple(order for order, _ in found)


def _coloured(evidence: _Evidence, noise: tuple[Noise, ...], known: tuple[bool, ...], duration: float) -> Coloured:
    band = float(np.mean(evidence.bank.band))
    unit = np.array(evidence.unit)
    for channel, fixed in enumerate(known):
        if fixed:  # the spectrum tells the colour only: its sum is what was given
            unit[:, channel] = noise[channel].rms(duration, 2.0 * band)
    return coloured_of(evidence.bank, variances_of(evidence.bank, noise, unit), evidence.valid)


def _score(whitening: Whitening, evidence: _Evidence, numbers: int) -> float:
    """Log likelihood at the best level of each channel, less the penalty."""
    squares, counts, log_scale = map(np.asarray, _squares(whitening, evidence.residuals, evidence.valid))
    squares, counts = squares[counts > 0], counts[counts > 0]
    if (squares == 0.0).any():
        return -math.inf
    profile = -0.5 * np.sum(counts * (np.log(squares / counts) + 1.0))
    return float(profile - log_scale - 0.5 * numbers * np.log(counts.sum()))


@jax.jit
def _squares(whitening: Whitening, residuals: jax.Array, valid: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
    return jnp.sum(whitening.whiten(residuals) ** 2, axis=(0, 2)), jnp.sum(valid, axis=(0, 2)), whitening.log_scale


def _restricted_likelihood(evidence: _Evidence, start: list[Noise | None]) -> tuple[Noise, ...]:
    """Spectra by restricted maximum likelihood: what the parameters have absorbed is not taken for quiet."""
    from scipy.optimize import minimize

    band, unit = float(np.mean(evidence.bank.band)), evidence.unit.mean(axis=0)
    guess = [_guess(evidence, channel, band) if n is None else n for channel, n in enumerate(start)]
    # Of the order of one each: variances in units of the residuals that hiss, wander over an e-fold, and line hold.
    size = np.stack([unit**-2 * band, unit**-2, unit**-2])
    levels = np.array([[n.white, n.pink, n.line] for n in guess]).T * size
    logs = np.log(np.maximum(levels, 1e-8))
    value = partial(_restricted, evidence=evidence._replace(unit=jnp.asarray(evidence.unit)), size=jnp.asarray(size))
    bounds = [(-20.0, 12.0)] * logs.size
    found = minimize(lambda x: float(value(jnp.asarray(x))), logs.ravel(), method="L-BFGS-B", bounds=bounds, tol=1e-7)
    white, pink, line = np.exp(found.x.reshape(3, -1)) / size
    samples = np.asarray(evidence.valid).sum(axis=(0, 2))
    found_rows = zip(white, pink, line, samples, strict=True)
    return tuple(Noise(float(w), float(p), float(v), int(n)) for w, p, v, n in found_rows)


@jax.jit
def _restricted(logs: jax.Array, evidence: _Evidence, size: jax.Array) -> jax.Array:
    """Minus the restricted log likelihood of logarithms of white, pink and line ``(3 n_channel,)``."""
    white, pink, line = jnp.exp(logs.reshape(3, -1)) / size
    noise = [Noise(white[c], pink[c], line[c], 0) for c in range(len(white))]
    bank = evidence.bank
    whitening = coloured_of(bank, variances_of(bank, noise, evidence.unit), evidence.valid)
    fresh = whitening.whiten(evidence.residuals)
    slopes = jax.vmap(whitening.whiten, in_axes=-1, out_axes=-1)(evidence.slopes)
    local = jnp.einsum("rcti,rctj->rij", slopes, slopes)
    rows = evidence.columns
    free = rows.size + 1
    gram = jnp.zeros((free, free)).at[rows[:, :, None], rows[:, None, :]].add(local, mode="drop")
    # Directions nobody sees, and places no value has, weigh nothing and add a constant.
    volume = jnp.linalg.slogdet(gram + 1e-9 * jnp.eye(free))[1]
    return 0.5 * jnp.sum(fresh**2) + whitening.log_scale + 0.5 * volume


def _guess(evidence: _Evidence, channel: int, band: float) -> Noise:
    """Three quarters hiss, one quarter wander."""
    residuals, valid = np.asarray(evidence.residuals[:, channel]), np.asarray(evidence.valid[:, channel])
    variance = float(np.sum(residuals**2) / max(valid.sum(), 1) * evidence.unit[:, channel].mean() ** 2)
    return Noise(0.75 * variance / band, 0.03 * variance, 1e-3 * variance, 0)


def _says(
    best: str,
    kind: str,
    scores: dict[str, float],
    orders: tuple[int, ...],
    noise: tuple[Noise, ...],
    channels: tuple[str, ...],
) -> str:
    words = {
        "white": "white noise",
        "autoregressive": "autoregressive noise of order "
        + ", ".join(f"{order} ({c})" for c, order in zip(channels, orders, strict=False)),
        "coloured": "coloured noise: hiss and slow wander"
        + "".join(f", equal at {n.pink / n.white:.3g} Hz in {c}" for c, n in zip(channels, noise, strict=False)),
    }
    if kind != "auto":
        return f"Likelihood: {words[best]}, as asked for."
    others = [f"{name} is {scores[best] - score:.4g}" for name, score in scores.items() if name != best]
    return (
        f"Likelihood: {words[best]}; chosen because it explains the residuals best: "
        f"{' and '.join(others)} less likely (log likelihood, corrected for the numbers each contains)."
    )


def _tails(whitening: Whitening, evidence: _Evidence, heavy: bool) -> str:
    """A remark where single samples stray further than a normal law allows."""
    fresh, valid = np.asarray(innovations(whitening, evidence.residuals)), np.asarray(evidence.valid)
    each = [fresh[:, c][valid[:, c]] for c in range(valid.shape[1]) if valid[:, c].any()]
    kurtosis = max(float(np.mean(x**4) / max(np.mean(x**2), TINY) ** 2 - 3.0) for x in each)
    if heavy:
        return f" Student's t for single samples, as asked for (excess kurtosis {kurtosis:.2g})."
    if kurtosis < HEAVY_TAILS:
        return ""
    return (
        f" Single samples stray further than normal noise does (excess kurtosis {kurtosis:.2g}): "
        "where no missing physics explains this, Student's t is the better law."
    )
