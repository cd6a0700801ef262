"""Ways in which an effect enters a model: shapes, directions, and where slopes say to begin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from fibrefit.core.declarations import Parameter
from fibrefit.discovery.engine.candidates import SEEN_FOLDED, starting_sizes
from fibrefit.discovery.engine.effort import is_followed_elsewhere
from fibrefit.discovery.engine.supermodel import Supermodel
from fibrefit.discovery.engine.thresholds import PRICE
from fibrefit.laws.families import instants_of
from fibrefit.laws.law import Effect
from fibrefit.problem import DIFFERENCE_STEP, Gram, Place, ScoreTest, Unknowns

WEAK = 0.02
"""Strength, as a share of the typical one, at which an effect enters a model that is nearly right."""
SLIGHT_CHANGE = 1.0 / 64.0
"""Share of that over which slopes are taken: a motion that bounces multiplies any change, and over more the cost bends.
Of a breakaway friction that gains 22 nats on a driven rig -3 were predicted over the whole of it, and 16 over this."""
LEAST_SHARE = 0.1
"""Least share of a weak strength that vanishes at infinity from which it is followed."""
LADDER = (1.0, 5.0, 25.0)
"""Sizes at which an effect that changes a model's kind is looked at, over the smallest one: what it does at one of
them, a resonance that passes through the motion's own, tells little of what it does at another."""

BETWEEN = (0.25, 0.5, 0.75)
"""Where further instants are looked at, in shares of the way from the best one of a record to the next ones."""
EVERYWHERE = (np.arange(32) + 0.5) / 32.0
"""Shares of a record at which an instant is looked for with the effect there: between any two bounces is a valley."""
INSTANTS_FINER = 3
"""Times that is done: instants come to lie within some thousandths of a record, which a descent leads on from."""


class Accompaniment(NamedTuple):
    """How the unknowns of a parent give way to an effect, by slopes.

    Parameters
    ----------
    strength : str
        Of the effect, from its null to where slopes were taken.
    names : tuple of str
        Of the shared unknowns.
    shared : (n_shared,)
    own : (n_record, n_own)
        Of each record, its deviations last.
    """

    strength: str
    names: tuple[str, ...]
    shared: np.ndarray
    own: np.ndarray


class PredictedGain(NamedTuple):
    """What the score test predicts of an effect.

    Parameters
    ----------
    gain : float
        In nats, what the effect costs beforehand taken off.
    values : mapping of str to float
        Its parameters there, in SI units.
    weak : mapping of str to float
        The same with the effect hardly there.
    slight : mapping of str to float
        The same where slopes were taken.
    accompaniment : Accompaniment, optional
        None where the effect does not grow in proportion to its strength.
    elsewhere : tuple of mappings of str to float
        Other frequencies, and shapes, of which nearly as much is predicted: it is followed from all of them.
    opposite : bool
        Whether records ask for less than none of an effect that cannot be less.
    """

    gain: float
    values: dict[str, float]
    weak: dict[str, float]
    slight: dict[str, float]
    accompaniment: Accompaniment | None = None
    elsewhere: tuple[dict[str, float], ...] = ()
    opposite: bool = False

    @property
    def promise(self) -> float:
        """Nats that it may gain: nothing where records ask for the opposite."""
        return min(self.gain, -PRICE) if self.opposite else self.gain

    @property
    def starts(self) -> list[dict[str, float]]:
        """Where it is followed from, each only if the one before ends in a wrong minimum.

        A strength that slopes predict may lose a bounce at once; where they were taken the model is hardly another one.
        """
        places = (self.values, self.weak, self.slight)
        return [place for i, place in enumerate(places) if place not in places[:i]]


def rings(effect: type[Effect]) -> bool:
    """Whether an effect is as strong as its frequency is low: one by itself does nothing like another."""
    return any(parameter.unit == "Hz" for parameter in effect.parameters if parameter.name in effect.strength)


def best_of(found: Sequence[PredictedGain], valleys: bool) -> PredictedGain:
    """What most is predicted of, of an effect at several shapes; with the next ones where it has valleys.

    A ring that is sampled seldom is seen alike at several frequencies: of a resonance of 4.8 kHz slopes predicted 26
    nats at 4.3 kHz and 21 to 25 at ten others, from which it gained 0.7 to 18.
    """
    ranked = sorted(found, key=lambda one: (-one.promise, -one.gain))
    others = [one.values for i, one in enumerate(ranked) if i > 0 and one.promise > 0.0 and is_followed_elsewhere(i)]
    return ranked[0]._replace(elsewhere=tuple(others if valleys else ()))


PredictedGains = Mapping[type[Effect], PredictedGain]


class Approach(NamedTuple):
    """A shape of an effect, and the ways in which it enters a model then.

    Parameters
    ----------
    shapes : mapping of str to float
        Parameters besides the strengths, in SI units.
    strengths : tuple of (str, float)
        What is moved, and to where, in SI units.
    """

    shapes: dict[str, float]
    strengths: tuple[tuple[str, float], ...]


def directions(effect: type[Effect]) -> list[Approach]:
    """Every shape of an effect, each of its strengths moved by itself."""
    others = [p for p in effect.parameters if p.name not in effect.strength]
    strengths = []
    for parameter in effect.parameters:
        if parameter.name in effect.strength:
            weak = _weak(effect, parameter)
            # A negative strength does the opposite of a positive one, but each frequency something of its own, and so
            # does each size of what changes a model's kind.
            several = parameter.unit == "Hz" or effect.singular
            strengths += [(parameter.name, value) for value in (weak if several else weak[:1])]
    found = []
    for sizes in product(*(_weak(effect, parameter) for parameter in others)):
        shapes = dict(zip((parameter.name for parameter in others), sizes, strict=True))
        # How what is seen folded is damped tells little: it has died away in a sample or two.
        usual = all(parameter.typical == size for parameter, size in zip(others, sizes, strict=True))
        seen = [way for way in strengths if usual or not _is_folded(effect, *way)]
        found.append(Approach(shapes, tuple(seen)))
    return found


def _is_folded(effect: type[Effect], name: str, value: float) -> bool:
    """Whether a strength is a frequency so far above the usual one that it rings between samples."""
    parameter = next(one for one in effect.parameters if one.name == name)
    return parameter.unit == "Hz" and value in SEEN_FOLDED * parameter.typical


def cannot_be_opposite(supermodel: Supermodel, effect: type[Effect], name: str) -> bool:
    """Whether a strength has one sign, and slopes at its null tell which one the records ask for."""
    declared = supermodel.declared[name]
    return not effect.singular and not (declared.lower < declared.null < declared.upper)


def grows_in_proportion(supermodel: Supermodel, name: str) -> bool:
    """Whether slopes tell what a strength does elsewhere."""
    declared = supermodel.declared[name]
    return not declared.reciprocal and declared.unit != "Hz"


def accompaniment_of(
    supermodel: Supermodel, unknowns: Unknowns, name: str, test: ScoreTest, number: int
) -> Accompaniment | None:
    """How the unknowns of a parent give way to a strength, the direction of that number in a score test."""
    if not grows_in_proportion(supermodel, name) or not test.information[number] > 0.0:
        return None
    names = unknowns.names[: len(unknowns.shared)]
    return Accompaniment(name, names, test.shared[number], test.own[number])


def accompanied(unknowns: Unknowns, start: Place, prediction: PredictedGain) -> Place:
    """A place with all other unknowns where slopes see them beside the strength that an effect has there.

    What a record is off by is taken over by an effect that stands for it; left where it was, it would count twice.

    Parameters
    ----------
    unknowns : Unknowns
        Of the parent and the effect.
    start : Place
        With the effect, all else as it was.
    prediction : PredictedGain
        Of the effect.
    """
    by = prediction.accompaniment
    if by is None:
        return start
    strength = unknowns.names.index(by.strength)
    slight = unknowns.value(start.z)
    slight[strength] = prediction.slight[by.strength]
    times = start.z[strength] / unknowns.coordinate(slight)[strength]
    z, own, number = start.z.copy(), times * by.own, start.own.shape[1]
    z[[unknowns.names.index(name) for name in by.names]] += times * by.shared
    inside = np.clip(z, unknowns.lower, unknowns.upper)
    return start._replace(z=inside, own=start.own + own[:, :number], eta=start.eta + own[:, number:])


def between_instants(looked: np.ndarray, best: np.ndarray) -> np.ndarray:
    """Instants ``(n_more, n_instant)`` between the best of each column and those next to it, or the record's ends.

    Parameters
    ----------
    looked : (n_choice, n_instant)
        Shares of a record.
    best : (n_instant,) int
    """
    more = []
    for instants, at in zip(looked.T, best, strict=True):
        here = instants[at]
        before = max((one for one in instants if one < here), default=0.0)
        after = min((one for one in instants if one > here), default=1.0)
        more.append([here + share * (end - here) for end in (before, after) for share in BETWEEN])
    return np.array(more).T


def likeliest_instants(unknowns: Unknowns, place: Place, effect: type[Effect], gram: Gram) -> Place:
    """A place with each instant of a sudden effect where its records are most probable, what they share as it is.

    It is the place itself where all instants are there already.

    Slopes of a model without the effect choose them first, and where much is missing they err. A descent does not mend
    it, as it follows an instant by a few samples only. What is a record's own gives way, as slopes there say: at a
    wrong instant that has taken up a part of the effect.

    Parameters
    ----------
    unknowns : Unknowns
        Of the model with the effect.
    place : Place
    effect : Effect class
        With one instant, or one in each record.
    gram : callable
        Products of slopes and residuals.
    """
    at = [unknowns.names.index(f"{effect.name}.{name}") for name in instants_of(effect)[: len(place.eta)]]

    def moved(instants: np.ndarray) -> Place:
        values = unknowns.value(place.z)
        values[at] = instants
        return place._replace(z=unknowns.coordinate(values))

    def cost(instants: np.ndarray) -> np.ndarray:
        each = _own_eliminated(unknowns, moved(instants), gram)
        return each[: len(at)] if len(at) > 1 else each.sum(keepdims=True)

    here = unknowns.value(place.z)[at]
    looked = np.concatenate([here[None], np.repeat(EVERYWHERE[:, None], len(at), axis=1)])
    known = np.array([cost(instants) for instants in looked])
    for _ in range(INSTANTS_FINER):
        more = between_instants(looked, known.argmin(axis=0))
        looked, known = np.concatenate([looked, more]), np.concatenate([known, [cost(one) for one in more]])
    best = known.argmin(axis=0)
    return moved(looked[best, np.arange(len(at))]) if best.any() else place


def _own_eliminated(unknowns: Unknowns, place: Place, gram: Gram) -> np.ndarray:
    """What each record costs ``(n_record,)`` with its own values where slopes see them; infinite of a lost motion."""
    local, number = unknowns.local_of(place), len(unknowns.each)
    steps = unknowns.coordinate_steps(place)[:, len(unknowns.shared) :] * unknowns.size
    products = gram(local, unknowns.each, local[:, unknowns.each] + np.where(unknowns.free, steps, 0.0))
    sound = np.asarray(np.isfinite(products).all(axis=(1, 2)))
    scale = np.sqrt(np.maximum(np.diagonal(products, axis1=1, axis2=2), 1e-300))[:, :number]
    pulls = products[:, :number, -1] / scale
    blocks = products[:, :number, :number] / (scale[:, :, None] * scale[:, None, :])
    inverse = np.linalg.pinv(np.where(sound[:, None, None], blocks, 0.0), rcond=1e-10, hermitian=True)
    return np.where(sound, products[:, -1, -1] - np.einsum("ri,rij,rj->r", pulls, inverse, pulls), np.inf)


def stands_for_differences(effect: type[Effect]) -> bool:
    """Whether it changes what records may differ by anyway, as a deviation of that record does."""
    return bool(effect.parameters) and all(parameter.relative for parameter in effect.parameters)


def slightly(supermodel: Supermodel, effect: type[Effect], name: str, weak: float) -> float:
    """Strength at which slopes are taken, for one at which an effect is weak.

    What changes a model's kind is looked at where it is weak: slopes nearer to its null are those of another model. A
    relative change in one record is what that record deviates by: over another step it would seem to be more.
    """
    declared = supermodel.declared[name]
    if declared.relative:
        return float(np.expm1(DIFFERENCE_STEP))
    if effect.singular or not grows_in_proportion(supermodel, name):
        return weak
    return declared.null + SLIGHT_CHANGE * (weak - declared.null)


def starting_strength(supermodel: Supermodel, name: str, weak: float, share: float) -> float:
    """Strength at which slopes see a minimum, a `share` of the way to a `weak` one; no more than typical.

    What vanishes at infinity goes there by its inverse. A frequency stays: between two of them is none of its valleys.
    """
    declared = supermodel.declared[name]
    if declared.unit == "Hz":
        return weak
    if declared.reciprocal:
        return float(np.clip(weak / np.clip(share, LEAST_SHARE, weak / declared.typical), declared.lower, np.inf))
    most = max(abs((declared.typical - declared.null) / (weak - declared.null)), 1.0)
    least = 1.0 if declared.lower >= declared.null or declared.upper <= declared.null else -most
    return float(
        np.clip(declared.null + np.clip(share, least, most) * (weak - declared.null), declared.lower, declared.upper)
    )


def _weak(effect: type[Effect], parameter: Parameter) -> list[float]:
    times = LADDER if effect.singular else LADDER[:1]
    if parameter.reciprocal:
        strengths = [parameter.typical / WEAK**0.5 / factor for factor in times]
    else:
        steps = [max(WEAK, effect.singular) * factor for factor in times]
        whole = parameter.typical - parameter.null
        # Nothing is looked at beyond five times the typical size.
        strengths = [parameter.null + step * whole for step in steps if step <= max(LADDER[1], steps[0])]
        both = parameter.lower < parameter.null < parameter.upper
        strengths += [parameter.null - steps[0] * whole] if both else []
    return starting_sizes(effect, parameter, strengths)
