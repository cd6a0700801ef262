"""When something happens in each record that happens once in all of them: instants by the score test, all together."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from fibrefit.discovery.engine.candidates import transferred
from fibrefit.discovery.engine.effort import happens_in_several
from fibrefit.discovery.engine.screening import (
    INSTANTS_FINER,
    Approach,
    PredictedGain,
    between_instants,
    directions,
    slightly,
)
from fibrefit.discovery.engine.supermodel import Supermodel
from fibrefit.discovery.search.screen import Screen
from fibrefit.laws.families import family_of, instants_of
from fibrefit.laws.law import INSTANTS, Effect
from fibrefit.problem import ScoreTest


def may_recur(effect: type[Effect], known: Mapping[type[Effect], PredictedGain]) -> bool:
    """Whether slopes predict something of an effect in more than one record.

    Parameters
    ----------
    effect : Effect class
        One that recurs.
    known : mapping of Effect class to PredictedGain
        Of others, those of the same family in single records among them.
    """
    family = family_of(effect)
    return happens_in_several(
        sum(found.gain > 0.0 for one, found in known.items() if one.records and family_of(one) == family)
    )


def predicted_recurrence(screen: Screen, supermodel: Supermodel, effect: type[Effect]) -> PredictedGain:
    """Score test of an effect that recurs, at the instants at which it predicts most.

    What a record says of an instant does not depend on those of others: slopes at a few instants in all records give
    the score test of any combination.

    Parameters
    ----------
    screen : Screen
        Of a parent.
    supermodel : Supermodel
        One that holds the effect too.
    effect : Effect class
    """
    parent, gram, unknowns = screen.parent, screen.gram(supermodel), screen.unknowns(supermodel)
    base, found = transferred(supermodel, parent.supermodel, parent.local), parent.evidence.mode
    ((strength, weak),) = directions(effect)[0].strengths
    name = f"{effect.name}.{strength}"
    further = np.array([supermodel.names.index(name)]), np.array([slightly(supermodel, effect, name, weak)])
    names = instants_of(effect)[: len(base)]
    columns = [supermodel.names.index(f"{effect.name}.{instant}") for instant in names]

    def products(instants: np.ndarray) -> np.ndarray:
        local = base.copy()
        local[:, columns] = instants[: len(columns)]
        return unknowns.local_grams(unknowns.place_of(local, found.place.eta), gram, further)

    def gain(grams: np.ndarray) -> float:
        return float(ScoreTest.of(unknowns, found.place, grams, 1, found.sigma).gain[0])

    # An effect may have fewer instants than there are records: those beyond them say nothing of any.
    looked = np.repeat(np.array(INSTANTS)[:, None], len(base), axis=1)
    known = np.array([products(row) for row in looked])
    best = best_combination(known, gain)
    for _ in range(INSTANTS_FINER):
        more = between_instants(looked, best)
        looked, known = np.concatenate([looked, more]), np.concatenate([known, [products(row) for row in more]])
        best = best_combination(known, gain, best)
    at = dict(zip(names, looked[best, np.arange(len(base))].tolist(), strict=False))
    way = Approach(at, ((strength, weak),))
    return screen.predicted(supermodel, [effect], {effect: way})[effect]


def best_combination(
    known: np.ndarray, gain: Callable[[np.ndarray], float], start: np.ndarray | None = None
) -> np.ndarray:
    """Which of the products of each record to take so that all together gain most, one record after the other.

    Parameters
    ----------
    known : (n_choice, n_record, n, n)
    gain : callable
        Of products ``(n_record, n, n)``.
    start : (n_record,) int, optional
        Where to begin; the same for all records by default.

    Returns
    -------
    (n_record,) int
    """
    records = np.arange(known.shape[1])
    if start is None:
        start = np.full(len(records), int(np.argmax([gain(grams) for grams in known])))
    best, most = start.copy(), gain(known[start, records])
    moved = True
    while moved:
        moved = False
        for record in records:
            for choice in range(len(known)):
                other = best.copy()
                other[record] = choice
                if (there := gain(known[other, records])) > most:
                    best, most, moved = other, there, True
    return best
