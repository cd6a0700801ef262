"""Tests of innovations: whether what a model leaves is noise, whatever it may be that is missing.

The residuals' spectrum can always be fitted, so it says little. What says much is whether the parameters, each free to
be another one in every part of a motion, would be the same throughout, and whether noise in motion is that at rest.

Source
------
Constancy of parameters by cumulated scores: Nyblom, J. Am. Stat. Assoc. 84 (1989); Hansen, J. Policy Model. 14 (1992).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from scipy.special import fdtr, fdtrc

from fibrefit.core.declarations import Statement
from fibrefit.core.matrices import equilibrated, pseudo_inverse, scale_of
from fibrefit.core.spectra import periodogram, without_lines
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.laplace_inference import LaplaceInference
from fibrefit.discovery.engine.remaining import residuals_of
from fibrefit.discovery.engine.supermodel import STRETCHES
from fibrefit.discovery.engine.thresholds import (
    ALARM,
    CONTRADICTED,
    FAST_ABOVE,
    FEWEST_ORDINATES,
    QUANTISED,
    RANK,
    SLOW_BELOW,
)
from fibrefit.discovery.level_shifts import LevelShift, joint_probability, level_shifts
from fibrefit.discovery.residuals.thresholds import FEWEST_TELLING
from fibrefit.problem import DIFFERENCE_STEP, Noise, unbroken
from fibrefit.rigs.signals.rest import rests
from fibrefit.rigs.signals.trace import Trace

WINDOWS = 6
"""Parts of a motion that hold equal information."""
WAVES = 3
"""Half periods of the slow changes in time that parameters are tested for."""


@dataclass(frozen=True)
class Alarm:
    """Outcome of a test of innovations.

    Parameters
    ----------
    test : str
        Its identifier: ``constancy``, ``drift``, ``jump`` or ``rest``.
    probability : float
        Of something as strange, if nothing were missing.
    threshold : float
    facts : mapping of str to object
        What else was found.
    """

    test: str
    probability: float
    threshold: float
    facts: Mapping[str, Any] = field(default_factory=dict)

    @property
    def raised(self) -> bool:
        """Whether the model is not complete."""
        return self.probability < self.threshold

    @property
    def nats(self) -> float:
        """What the alternatives of the test explain beyond chance, in nats; 0 for a test without any."""
        return 0.5 * float(self.facts.get("gain", 0.0) - self.facts.get("chance", 0.0))

    @property
    def statement(self) -> Statement:
        """What a report says of it."""
        return Statement(self.test, {**self.facts, "probability": self.probability})


def tests_of(
    inference: LaplaceInference,
    best: LaplaceFit,
    traces: Sequence[Trace],
    channels: Sequence[str],
    coarse: Collection[str],
) -> tuple[Alarm, ...]:
    """Tests of the innovations of a hypothesis.

    Parameters
    ----------
    inference : LaplaceInference
    best : LaplaceFit
    traces : sequence of Trace
    channels : sequence of str
    coarse : collection of str
        Channels read in coarse steps. A reading that stays in a step lies off by a part of it for as long, and by
        another part in the next: it jumps without anything that does.
    """
    tested = list[Alarm]()
    if len(best.evidence.mode.unknowns.scattering):
        scores = _scores(inference, best)
        tested += [_windows(scores), _drifts(scores, _names(best))]
    residuals, counts = residuals_of(inference.common_noise, best, inference.context.whole)[0], inference.context.whole
    fine = [c for c, channel in enumerate(channels) if channel not in coarse]
    seen = [one for one in level_shifts(inference.common_noise.whitening, residuals, counts) if one.channel in fine]
    if seen:
        tested.append(_jumping(seen, traces, channels))
    pairs = [(c, noise) for c, noise in zip(channels, inference.common_noise.noise, strict=True) if c not in coarse]
    return (*tested, *(alarm for c, noise in pairs if (alarm := against_rest(traces, c, noise)) is not None))


def _names(best: LaplaceFit) -> tuple[str, ...]:
    unknowns = best.evidence.mode.unknowns
    return tuple(unknowns.names[i] for i in unknowns.scattering)


class _Scores(NamedTuple):
    """Scores of what may vary, in parts of each record.

    Parameters
    ----------
    information : (n_record, n_stretch, p, p)
    score : (n_record, n_stretch, p)
        Of a noise as large as the innovations are where each combination of parameters is seen.
    freedom : (n_record,)
        Degrees of freedom from which that size is known, see `_freedom`.
    """

    information: np.ndarray
    score: np.ndarray
    freedom: np.ndarray

    @property
    def told(self) -> _Scores:
        """Those of the records whose readings are enough to know how much they scatter."""
        enough = self.freedom >= FEWEST_TELLING
        return _Scores(self.information[enough], self.score[enough], self.freedom[enough])


def _scores(inference: LaplaceInference, best: LaplaceFit) -> _Scores:
    """Scores of what may vary."""
    unknowns, place = best.evidence.mode.unknowns, best.evidence.mode.place
    columns = unknowns.shared[unknowns.scattering]
    local = best.local
    targets = local[:, columns] * np.exp(DIFFERENCE_STEP)
    supermodel = inference.common_noise.whitened(best.supermodel)
    rows = supermodel.slopes(local, columns, targets, inference.context.whole).whitened(supermodel.sensitivities)
    assert place.eta.shape[1] == len(columns)
    rows = rows / np.r_[1.0, np.full(len(columns), DIFFERENCE_STEP)][:, None]
    return _in_stretches(rows, len(supermodel.problem.observations.weight))


def _in_stretches(rows: np.ndarray, channels: int) -> _Scores:
    """Scores of whitened residuals and slopes ``(n_record, 1 + p, n_channel * n_time)``, the residuals first."""
    whole = rows.reshape(*rows.shape[:2], channels, -1)
    size = -(-whole.shape[-1] // STRETCHES)
    parts = [whole[..., size * i : size * (i + 1)].reshape(*rows.shape[:2], -1) for i in range(STRETCHES)]
    products = np.stack([part @ np.swapaxes(part, 1, 2) for part in parts], axis=1)
    information, score = products[:, :, 1:, 1:], products[:, :, 1:, 0]
    single = rows[:, 1:] * rows[:, :1]
    pairs = zip(information.sum(axis=1), single @ np.swapaxes(single, 1, 2), strict=True)
    levelled = np.einsum("rpq,rsq->rsp", np.array([_levelled(*pair) for pair in pairs]), score)
    return _Scores(information, levelled, np.array([_freedom(one) for one in single]))


def _freedom(single: np.ndarray) -> float:
    """Degrees of freedom from which the variance of the scores of single readings ``(p, n)`` is known.

    Law
    ---
    With d the share of each reading in the variance of all combinations, ``d = s' (S S')^-1 s``, whose sum is p: the
    variance of a combination is known to the root of ``sum(d^2) / p``, noise with heavy tails and slopes that act
    in bursts included. Of Satterthwaite's number, twice the inverse square of that, half is taken: what scatters most
    is in the sum that it is held against, too.
    """
    if not np.isfinite(single).all():
        return 0.0
    rows = single / scale_of(single @ single.T)[:, None]
    values, vectors = np.linalg.eigh(rows @ rows.T)
    seen = values > RANK * RANK * values[-1]
    share = np.sum((vectors[:, seen].T @ rows) ** 2 / values[seen, None], axis=0)
    return float(seen.sum() / max(np.sum(share**2), 1e-300)) if seen.any() else 0.0


def _levelled(information: np.ndarray, squares: np.ndarray) -> np.ndarray:
    """The symmetric matrix ``(p, p)`` that brings scores to the variance which the information takes them to have.

    Noise that is louder in some readings than in others is not one factor for all parameters: a combination of them
    that only a few readings tell of is judged by the noise of these.

    Parameters
    ----------
    information : (p, p)
    squares : (p, p)
        Sum of the outer products of the scores of single readings: their variance, whatever the noise is.

    Source
    ------
    White, Econometrica 50 (1982); the map between two covariances is that of Olkin and Pukelsheim, Linear Algebra
    Appl. 48 (1982).
    """
    if not (np.isfinite(information).all() and np.isfinite(squares).all()):
        return np.eye(len(information))
    scale = scale_of(information)
    values, vectors = np.linalg.eigh(equilibrated(information, scale))
    seen = values > RANK
    root = vectors[:, seen] * np.sqrt(values[seen])
    inner = root.T @ equilibrated(squares, scale) @ root
    sizes, along = np.linalg.eigh(inner)
    if not seen.any() or not sizes[0] > RANK * RANK * sizes[-1]:
        return np.eye(len(information))  # without noise there is nothing to be levelled
    way = root @ along
    return (way / np.sqrt(sizes)) @ way.T * np.outer(scale, 1.0 / scale)


def _by_chance(gain: float, rank: int, scores: _Scores) -> float:
    """Probability of such a gain, whose variance is known from the very readings: F in place of chi-squared."""
    return float(fdtrc(rank, scores.freedom.sum(), max(gain, 0.0) / rank)) if rank > 0 else 1.0


def _windows(scores: _Scores) -> Alarm:
    """Whether parameters of their own in every part of a motion explain more than chance."""
    scores, total, freedom = scores.told, 0.0, 0
    for i, g, _ in zip(*scores, strict=True):
        whole = i.sum(axis=0)
        scale = scale_of(whole)
        progress = np.cumsum(np.einsum("spp,p->s", i, scale**-2.0))
        part = np.minimum((WINDOWS * progress / max(progress[-1], 1e-300)).astype(int), WINDOWS - 1)
        each = [_gain(i[part == w].sum(axis=0), g[part == w].sum(axis=0), scale) for w in range(WINDOWS)]
        lost = _gain(whole, g.sum(axis=0), scale)
        total += sum(gain for gain, _ in each) - lost[0]
        freedom += sum(rank for _, rank in each) - lost[1]
    probability = _by_chance(total, freedom, scores)
    return Alarm("constancy", probability, ALARM, {"parts": WINDOWS, "gain": total, "chance": freedom})


def _gain(information: np.ndarray, score: np.ndarray, scale: np.ndarray) -> tuple[float, int]:
    if not (np.isfinite(information).all() and np.isfinite(score).all()):
        return 0.0, 0  # where slopes are no numbers they tell nothing
    values, vectors = np.linalg.eigh(equilibrated(information, scale))
    seen = values > RANK
    along = vectors.T @ (score / scale)
    return float(np.sum(along[seen] ** 2 / values[seen])), int(seen.sum())


def _drifts(scores: _Scores, names: tuple[str, ...]) -> Alarm:
    """Whether parameters that change slowly with time, alike in all records, explain more than chance."""
    scores, p = scores.told, len(names)
    normal, pull = np.zeros((WAVES * p, WAVES * p)), np.zeros(WAVES * p)
    for i, g, _ in zip(*scores, strict=True):
        whole = i.sum(axis=0)
        scale = scale_of(whole)
        progress = np.cumsum(np.einsum("spp,p->s", i, scale**-2.0))
        moment = progress / max(progress[-1], 1e-300)
        coefficients = np.cos(np.pi * np.arange(1, WAVES + 1)[:, None] * moment)
        inside = np.einsum("js,ks,spq->jpkq", coefficients, coefficients, i).reshape(WAVES * p, WAVES * p)
        cross = np.einsum("js,spq->jpq", coefficients, i).reshape(WAVES * p, p)
        held = pseudo_inverse(whole)
        normal += inside - cross @ held @ cross.T
        pull += np.einsum("js,sp->jp", coefficients, g).ravel() - cross @ held @ g.sum(axis=0)
    scale = scale_of(normal)
    gain, rank = _gain(normal, pull, scale)
    probability = _by_chance(gain, rank, scores)
    each = [_gain(normal[j::p, j::p], pull[j::p], scale[j::p])[0] for j in range(p)]
    return Alarm("drift", probability, ALARM, {"worst": names[int(np.argmax(each))], "gain": gain, "chance": rank})


def _jumping(found: Sequence[LevelShift], traces: Sequence[Trace], channels: Sequence[str]) -> Alarm:
    """Whether readings jump more than noise does, taking all records together."""
    worst = min(found, key=lambda one: one.probability)
    trace = traces[worst.record]
    facts = {"record": trace.name, "channel": channels[worst.channel], "instant": float(trace.times[worst.sample])}
    return Alarm("jump", joint_probability(found), ALARM, facts)


def against_rest(traces: Sequence[Trace], channel: str, noise: Noise) -> Alarm | None:
    """Whether the slow noise that a model leaves is that at rest; None where there is too little rest to tell.

    The slow ordinates are held against the fast ones, which are as few where a logger is slow: the ratio of their means
    follows F.

    Parameters
    ----------
    traces : sequence of Trace
    channel : str
    noise : Noise
        What the model leaves.
    """
    slow, fast, number = 0.0, [], 0
    for trace in traces:
        rate = trace.rate
        for rest in rests(trace):
            values = unbroken(trace.channels[channel][rest])
            if not len(values) or np.ptp(values) == 0.0:
                continue
            known = [line for line, _ in noise.lines]
            frequency, power = periodogram(without_lines(values, trace.times[rest][: len(values)], known), rate)
            lines = [abs(frequency - line) < rate / len(values) * 2.0 for line in known]
            clear = ~np.logical_or.reduce([np.zeros(len(frequency), dtype=bool), *lines])
            against = power / noise.density(frequency)
            slow += float(against[clear & (frequency < SLOW_BELOW)].sum())
            number += int((clear & (frequency < SLOW_BELOW)).sum())
            fast += against[clear & (frequency > FAST_ABOVE)].tolist()
    if min(number, len(fast)) < FEWEST_ORDINATES or (level := float(np.mean(fast))) < QUANTISED:
        return None
    share = slow / number / level
    probability = float(fdtr(2 * number, 2 * len(fast), share))
    facts = {"channel": channel, "below": SLOW_BELOW, "times": 1.0 / max(share, 1e-300)}
    return Alarm("rest", probability, CONTRADICTED, facts)
