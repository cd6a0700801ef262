"""A parent with a further effect, followed from where slopes predict most of it."""

from __future__ import annotations

from functools import partial

from fibrefit.discovery.engine.candidates import transferred
from fibrefit.discovery.engine.effort import descent, in_wrong_minimum, instants_are_looked_for
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.laplace_inference import LaplaceInference
from fibrefit.discovery.engine.priors import with_held
from fibrefit.discovery.engine.screening import (
    PredictedGain,
    accompanied,
    likeliest_instants,
    stands_for_differences,
)
from fibrefit.discovery.engine.secant import Seed
from fibrefit.discovery.engine.supermodel import Supermodel
from fibrefit.laws.families import instants_of
from fibrefit.laws.law import Effect
from fibrefit.problem import MarginalLikelihood, laplace_evidence, mode


def extended(
    inference: LaplaceInference,
    parent: LaplaceFit,
    supermodel: Supermodel,
    effect: type[Effect],
    prediction: PredictedGain,
    slopes: Seed | None = None,
) -> LaplaceFit:
    """A parent with a further effect, from where slopes predict most of it.

    Parameters
    ----------
    inference : LaplaceInference
    parent : LaplaceFit
    supermodel : Supermodel
        One that holds the effect too.
    effect : Effect class
    prediction : PredictedGain
        Of the effect on that parent.
    slopes : Seed, optional
        Of the parent, see `LaplaceInference.slopes`.
    """
    found = parent.evidence.mode
    effects, how = (*parent.effects, effect), descent(found.objective)
    if stands_for_differences(effect) and found.sigma.any():
        at, gram = inference.absent_beside(parent, supermodel, effect, slopes)
        evidence = laplace_evidence(at.unknowns, at, gram, MarginalLikelihood.of(at).most_probable_sigma, **how)
        return LaplaceFit(effects, supermodel, evidence)
    local = transferred(supermodel, parent.supermodel, parent.local)
    unknowns = inference.unknowns(supermodel, effects)

    def followed(values: dict[str, float]) -> LaplaceFit:
        for name, value in values.items():
            local[:, supermodel.names.index(name)] = value
        start = accompanied(unknowns, unknowns.place_of(local, found.place.eta), prediction)
        gram = inference.secant(supermodel, slopes)
        if effect.sudden:
            # Slopes along an instant are those of a few samples about it: a step meant for all else leads astray.
            start = mode(with_held(unknowns, start, _instants(effect)), start, gram, found.sigma, **how).place
        return LaplaceFit(effects, supermodel, laplace_evidence(unknowns, start, gram, found.sigma, **how))

    ends: list[LaplaceFit] = []
    # Where slopes lead to another minimum, the effect is followed from where it is hardly there.
    for values in prediction.starts:
        ends.append(followed(values))
        if not in_wrong_minimum(ends[-1].log, parent.log):
            break
    ends += [followed(values) for values in prediction.elsewhere]
    best = inference.in_better_minima(max(ends, key=lambda end: end.log), found.objective)
    return at_likeliest_instants(inference, parent, best)


def at_likeliest_instants(inference: LaplaceInference, parent: LaplaceFit, found: LaplaceFit) -> LaplaceFit:
    """A candidate that explains something, with the instants of what it adds looked for again, all else refitted.

    They were chosen by slopes of its parent, and where much is missing these err: of two slips one began at half its
    place in the record and ended there, 390 nats below.

    Parameters
    ----------
    inference : LaplaceInference
    parent : LaplaceFit
    found : LaplaceFit
        It with a further effect.
    """
    effect, supermodel = found.effects[-1], found.supermodel
    if not effect.sudden:
        return found
    names, how = _instants(effect), descent(parent.evidence.mode.objective)
    anew = partial(inference.common_noise.whitened(supermodel).grams, counts=inference.context.whole)
    turn, fall = 0, parent.evidence.mode.objective - found.evidence.mode.objective
    while instants_are_looked_for(turn, fall):
        at, gram = found.evidence.mode, inference.secant(supermodel)
        moved = likeliest_instants(at.unknowns, at.place, effect, anew)
        if moved is at.place:
            break
        start = mode(with_held(at.unknowns, moved, names), moved, gram, at.sigma, **how).place
        evidence = laplace_evidence(at.unknowns, start, gram, at.sigma, **how)
        turn, fall = turn + 1, at.objective - evidence.mode.objective
        found = LaplaceFit(found.effects, supermodel, evidence) if fall > 0.0 else found
    return found


def _instants(effect: type[Effect]) -> list[str]:
    return [f"{effect.name}.{instant}" for instant in instants_of(effect)]
