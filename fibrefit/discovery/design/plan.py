"""The next record: what each that could be taken would add to those at hand.

Source
------
Error bars: the geometric mean of standard errors, each with the others unknown, so that no unit counts; of the optimal
designs in Pukelsheim, Optimal Design of Experiments (1993), it is nearest to A. Rivals: where the one that is wrong, at
its best, still misses most (T-optimal design), Atkinson and Fedorov, Biometrika 62 (1975) 57-70.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from scipy.special import expit
from scipy.stats import norm

from fibrefit.core.matrices import equilibrated, scale_of
from fibrefit.discovery.design.apart import Explanation, nats_apart
from fibrefit.discovery.design.beside import Beside
from fibrefit.discovery.design.distinguish import confusion
from fibrefit.discovery.design.grams import grams_with, likeness, little_sizes, read_exactly, strengths_of
from fibrefit.discovery.design.menu import menu_of
from fibrefit.discovery.design.thresholds import CONCERNED, UNKNOWN
from fibrefit.discovery.engine.candidates import transferred
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.supermodel import supermodel_of
from fibrefit.discovery.engine.thresholds import APART, PRICE, UNIQUE, gate
from fibrefit.discovery.model.finding import Choice
from fibrefit.discovery.search.search import Search
from fibrefit.laws.law import Effect
from fibrefit.problem import Task

Purpose = Literal["errors", "rivals", "power"]


@dataclass(frozen=True)
class Worth:
    """What a further record would add.

    Parameters
    ----------
    choice : Choice
    errors : dict of str to float
        Factor on the standard error of each shared parameter that the records at hand determine.
    limits : dict of str to float
        Factor on the detection limit of each effect that the records at hand show.
    nats : float
        Expected logarithm of the likelihood ratio of two rivals with it, the smaller of both ways round; nan without.
    distinguished : float
        Probability that the rivals are distinguished with it, see `Standing`.
    determined : tuple of str
        Shared parameters that are determined with it, and not by the records at hand.
    shown : tuple of str
        Effects that show with it, and not in the records at hand.
    refitted : bool
        Whether the rivals were fitted to it too; slopes, which mostly promise too much, say the nats where not.
    minutes : float
        What it costs.
    """

    choice: Choice
    errors: dict[str, float]
    limits: dict[str, float]
    nats: float = float("nan")
    distinguished: float = 0.0
    determined: tuple[str, ...] = ()
    shown: tuple[str, ...] = ()
    refitted: bool = False
    minutes: float = 0.0

    @property
    def error(self) -> float:
        """Mean factor on standard errors."""
        return _mean(self.errors)

    @property
    def limit(self) -> float:
        """Mean factor on detection limits."""
        return _mean(self.limits)


def _mean(factors: Mapping[str, float]) -> float:
    return float(np.exp(np.mean(np.log(list(factors.values()))))) if factors else 1.0


@dataclass(frozen=True)
class Standing:
    """How two rivals stand in the records at hand.

    Parameters
    ----------
    nats : float or (2,)
        Expected logarithm of their likelihood ratio in these records, where the first one is true and where the second
        one is; nan without rivals.
    ahead : float or None
        Nats by which the records make the first one more probable than the second; None where that is not known, as
        nothing is measured, or they do not show both.
    price : float
        Nats that the one with more parameters pays for them, where it is not known by how much one is ahead.
    """

    nats: Any = float("nan")
    ahead: float | None = None
    price: float = 0.0

    def distinguished(self, nats: Any) -> float:
        """Probability that the right one comes out ahead beyond doubt, with records of which so much is expected.

        Twice the logarithm of a likelihood ratio is normal about the noncentrality with twice its root as standard
        deviation. What is measured is known, and each rival is as probable as that makes it; of records that are yet to
        be taken the rival counts of which less is expected, the one with more parameters.

        Parameters
        ----------
        nats : float or (2,)
            As `nats` of the records at hand, with a further one.
        """
        if self.ahead is None:
            least = float(np.min(nats))
            return _exceeds(least - self.price, least)
        first, second = np.maximum(np.broadcast_to(np.asarray(nats) - np.asarray(self.nats), (2,)), 0.0).tolist()
        share = float(expit(self.ahead))
        return share * _exceeds(self.ahead + first, first) + (1.0 - share) * _exceeds(second - self.ahead, second)

    @property
    def now(self) -> float | None:
        """Probability that records like those at hand distinguish them; None where they are measured and known to."""
        return None if self.ahead is not None else self.distinguished(self.nats)


def _exceeds(mean: float, nats: float) -> float:
    """Probability that a log ratio of such a mean is beyond doubt, chance being that of so many nats."""
    if not nats > 0.0:
        return float(mean > APART)
    return float(norm.cdf((mean - APART) / np.sqrt(2.0 * nats)))


def by_worth(purpose: Purpose, found: Sequence[Worth]) -> list[Worth]:
    """Records, the most useful first; of those of which a sentence tells the same the cheapest one.

    What is determined or shown for the first time gains more than any factor. Slopes alone mostly promise too much: a
    record of which they do counts for no more than the best of those to which the rivals were fitted.

    Parameters
    ----------
    purpose : {"errors", "rivals", "power"}
    found : sequence of Worth
    """
    most = max((worth.distinguished for worth in found if worth.refitted), default=1.0)

    def key(worth: Worth) -> tuple[float, ...]:
        if purpose == "rivals":
            known = worth.distinguished if worth.refitted else min(worth.distinguished, most)
            as_told, minutes, exactly = _rank(known, worth.minutes, worth.nats)
            return as_told, minutes, not worth.refitted, exactly
        new, factor = {"errors": (worth.determined, worth.error), "power": (worth.shown, worth.limit)}[purpose]
        return -len(new), _as_told(factor), worth.minutes, factor

    return sorted(found, key=key)


def _rank(distinguished: float, minutes: float, nats: float) -> tuple[float, float, float]:
    """Rank of a record that tells rivals apart with such a probability, the lowest first."""
    return -_as_told(distinguished), minutes, -nats


def _as_told(share: float) -> float:
    """A share as far as a report tells it."""
    return round(float(share), 2)


def options_of(task: Task) -> list[Choice]:
    """Records that could be taken: each of those at hand once more, and the rig's menu."""
    again = [Choice(record, {}) for record in range(len(task.problem.layout.records))]
    return [*again, *menu_of(task)]


def worths(
    search: Search,
    rivals: Sequence[Explanation],
    choices: Sequence[tuple[Choice, float]],
    beside: Beside,
    ahead: float | None = None,
) -> tuple[list[Worth], Standing]:
    """What each of some records would add, and how the rivals stand in those at hand.

    Errors of measured inputs are as open in a further record as in the one it is like. Records that cannot be simulated
    are left out.

    Parameters
    ----------
    search : Search
        With all effects whose detection limits count in one supermodel, see `set_up`.
    rivals : sequence of Explanation
        Two, or none.
    choices : sequence of (Choice, float)
        Each with its cost in minutes.
    beside : Beside
        Of the records at hand.
    ahead : float, optional
        Nats by which these make the first rival more probable, see `Standing`.
    """
    menu = [choice for choice, _ in choices]
    supermodel, sizes = read_exactly(search.base.supermodel, beside), little_sizes(search.effects)
    at_hand, added, own = grams_with(search, supermodel, beside, menu, (search.effects, sizes))
    found = [
        replace(_worth(search, (at_hand, gram), own, choice), minutes=minutes)
        for (choice, minutes), gram in zip(choices, added, strict=True)
        if np.isfinite(gram).all()
    ]
    standing = Standing(float("nan"), ahead, _price_of_more(rivals))
    if not (rivals and found):
        return found, standing

    def ranked(now: np.ndarray, nats: np.ndarray) -> list[tuple[float, ...]]:
        told = replace(standing, nats=now).distinguished
        return [_rank(told(of), one.minutes, float(of.min())) for one, of in zip(found, nats.T, strict=True)]

    now, nats, refitted = nats_apart(search, rivals, [worth.choice for worth in found], beside, ranked)
    standing = replace(standing, nats=now)
    told = [
        replace(worth, nats=float(of.min()), distinguished=standing.distinguished(of), refitted=i in refitted)
        for i, (worth, of) in enumerate(zip(found, nats.T, strict=True))
    ]
    return [worth for worth in told if np.isfinite(worth.nats)], standing


def _price_of_more(rivals: Sequence[Explanation]) -> float:
    """Nats that the rival with more parameters pays for them."""
    numbers = [len(one.effect.parameters) for one in rivals]
    return PRICE * (max(numbers) - min(numbers)) if numbers else 0.0


def _worth(search: Search, grams: tuple[np.ndarray, np.ndarray], own: int, choice: Choice) -> Worth:
    """What a record adds to error bars and detection limits, from Gram matrices of those at hand and its own.

    Parameters
    ----------
    search : Search
    grams : ((n_record, n, n), (n, n))
        Columns as of `changed_values`, with deviations of a record, see `Beside.held`.
    own : int
        Number of columns that are each record's own.
    choice : Choice
    """
    context, whole = search.context, np.concatenate([grams[0], grams[1][None]])
    shared = len(context.base)
    before, after = (_errors(each, shared, own) for each in (grams[0], whole))
    (norms, unique, _), (norms_then, unique_then, _) = (likeness(each, shared, own) for each in (grams[0], whole))
    names, known, shows = [effect.name for effect in search.effects], np.isfinite(before), unique > UNIQUE
    # What was seen is seen still where far more of a change is imitated in a further record.
    most = np.maximum(norms, np.where(unique_then > UNIQUE, norms_then, norms))
    less = np.divide(norms, most, out=np.ones_like(norms), where=shows)
    return Worth(
        choice,
        {name: float(after[i] / before[i]) for i, name in enumerate(context.base) if known[i]},
        {name: float(less[i]) for i, name in enumerate(names) if shows[i]},
        determined=tuple(name for i, name in enumerate(context.base) if not known[i] and np.isfinite(after[i])),
        shown=tuple(name for i, name in enumerate(names) if not shows[i] and unique_then[i] > UNIQUE),
    )


def _errors(grams: np.ndarray, shared: int, own: int) -> np.ndarray:
    """Standard errors of the shared columns, in units of their changes, each record's own eliminated.

    Infinite for a parameter that is not determined, be it by itself or beside others.
    """
    information = np.zeros((shared, shared))
    for gram in grams:
        mine = gram[shared : shared + own, shared : shared + own]
        unit = scale_of(mine)
        cross = gram[:shared, shared : shared + own] / unit
        inverse = np.linalg.pinv(equilibrated(mine, unit), rcond=UNKNOWN, hermitian=True)
        information += gram[:shared, :shared] - cross @ inverse @ cross.T
    size = scale_of(information)
    values, vectors = np.linalg.eigh(equilibrated(information, size))
    seen = values > UNKNOWN * values.max(initial=0.0)
    variance = (vectors[:, seen] ** 2 / values[seen]).sum(axis=1)
    known = (vectors[:, ~seen] ** 2).sum(axis=1) < CONCERNED
    return np.where(known, np.sqrt(variance) / size, np.inf)


def just_found(search: Search, base: LaplaceFit, effect: type[Effect]) -> Explanation | None:
    """A model with an effect so strong that the records at hand would just show it; None where they cannot show it.

    Parameters
    ----------
    search : Search
    base : LaplaceFit
        The model without it.
    effect : Effect class
    """
    plain = supermodel_of(search.task, (effect,), search.base.supermodel.sensitivities)
    supermodel = search.inference.common_noise.whitened(plain)
    local = transferred(supermodel, base.supermodel, base.local)
    (found,) = confusion(supermodel, search.context, local, (effect,), gate, Beside.of(search, base)).directions
    if (strength := found.smallest_detectable) is None:
        return None
    ((_, declared),) = strengths_of((effect,))
    if not declared.reciprocal:
        strength = declared.null + np.sign(declared.typical - declared.null) * strength
    mean = base.shared | {f"{effect.name}.{declared.name}": strength}
    return Explanation.by(effect, supermodel.names, local, mean)
