"""Three models of the same records: one set of parameters, parameters with a law of speed, parameters of each record.

All are compared in one noise. In the first two, records may differ by chance, as in a fit; in the third each record has
values of its own about which nothing is known beforehand but their order of magnitude. What no record has for itself,
such as a value with a prior, has that prior in all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fibrefit.core.limits import Progress, quiet
from fibrefit.discovery.comparison import Comparison, comparison_of
from fibrefit.discovery.engine.candidates import transferred, with_values
from fibrefit.discovery.engine.effort import FIRST_STARTS, slopes_tell
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.laplace_inference import LaplaceInference
from fibrefit.discovery.engine.priors import BASE_SD
from fibrefit.discovery.engine.refit import refit
from fibrefit.discovery.engine.supermodel import Supermodel
from fibrefit.discovery.pairs import pruned
from fibrefit.discovery.search.inputs import overdispersion_corrected, overdispersion_of, relinearised
from fibrefit.discovery.search.search import Search
from fibrefit.discovery.search.setup import prepared_search
from fibrefit.fitting.identify import How, identify
from fibrefit.fitting.result import Identification
from fibrefit.problem.estimate.evidence import MarginalLikelihood
from fibrefit.problem.estimate.gauss_newton import mode
from fibrefit.problem.linear_model.normal_equations import PosteriorMode
from fibrefit.problem.linear_model.unknowns import Unknowns
from fibrefit.problem.task import Task
from fibrefit.series.thresholds import MOST_LAWS, PREFERRED, SIMPLER_LAW
from fibrefit.series.together.laws import laws_on
from fibrefit.series.together.search import SpeedSearch

OF_SHARED = ("log", "reference", "scale", "mean", "lower", "upper")
"""What `Unknowns` say of each shared value."""


class TriedLaw(NamedTuple):
    """A law of speed by itself, on top of constant parameters.

    Parameters
    ----------
    found : LaplaceFit
    log : float
        Logarithm of the Bayes factor over constant parameters.
    linearised : bool
        Whether that is what linearisation predicts: it was not fitted.
    """

    found: LaplaceFit
    log: float
    linearised: bool


@dataclass(frozen=True)
class ThreeModels:
    """Three models of the same records, compared in one noise.

    Parameters
    ----------
    search : Search
        With the noise they were compared in.
    before : Identification
        Of constant parameters, in plain least squares.
    constant : LaplaceFit
    law : LaplaceFit
        The most probable one with a law of speed, whether or not it is more probable than constant parameters.
    own : LaplaceFit
        Values of each record: their deviations from the reference, with a standard deviation of `BASE_SD`.
    tried : tuple of TriedLaw
        All laws by themselves, the most probable first.
    beside : tuple of LaplaceFit
        Laws tried in the round in which the first one of `law` was found, the most probable first.
    """

    search: Search
    before: Identification
    constant: LaplaceFit
    law: LaplaceFit
    own: LaplaceFit
    tried: tuple[TriedLaw, ...]
    beside: tuple[LaplaceFit, ...]


def three_models(task: Task, seed: int = 0, tell: Progress = quiet) -> ThreeModels:
    """Fit the three models.

    Parameters
    ----------
    task : Task
        With constant parameters.
    seed : int
        Of the scatter of starts.
    tell : callable
        Called with what is being done and the share that is finished.
    """
    laws = laws_on(task.problem.model.rig)
    before = identify(task, FIRST_STARTS, seed, How(whiten=False, rivals=False), progress=tell)
    search, base = prepared_search(task, before, [law.effect for law in laws], tell)
    rounds, law = _grown(search, base, tell)
    search = rounds[-1].search
    tell("comparing constant parameters, and parameters of each record", None)
    constant = _constant(rounds[-1], law, base)
    law = law if law.divided_off else with_counted_gain(search.inference, constant, law)
    best = max(constant, law, key=lambda one: one.log)
    own = with_counted_gain(search.inference, best, own_values(search, law.supermodel, constant))
    return ThreeModels(search, before, constant, law, own, _tried(rounds[0], law, constant), _beside(rounds, law))


def _grown(search: Search, base: LaplaceFit, tell: Progress) -> tuple[list[Comparison], LaplaceFit]:
    """All rounds of trying laws, and the model with those that are needed; with the best one where none is.

    A law that stood in for another one is left out once that has been found. A model whose laws were taken in rounds is
    as it was fitted: what counts of its gain over constant parameters is not the sum of what counted in each round.
    """
    rounds = [comparison_of(SpeedSearch.of(search), base, "trying each law of speed")]
    while found := _simplest(rounds[-1]):
        search, found = _about(rounds[-1].search, found)
        law = pruned(search.inference, found)
        if not _may_grow(law, len(rounds)):
            return [*rounds, replace(rounds[-1], search=search, parent=law, found=())], law.undivided
        rounds.append(comparison_of(SpeedSearch.of(search), law, "trying a further law of speed"))
    last = rounds[-1]
    return rounds, last.parent.undivided if last.parent.effects else _at_its_mode(last)


def with_counted_gain(inference: LaplaceInference, lesser: LaplaceFit, richer: LaplaceFit) -> LaplaceFit:
    """A model with its gain over a lesser one as it counts in a search, see `overdispersion_corrected`.

    What was divided off the lesser one is taken off both.

    Parameters
    ----------
    inference : LaplaceInference
        In whose noise both were fitted.
    lesser, richer : LaplaceFit
        The richer one as it was fitted.
    """
    whole, taken = lesser.undivided, lesser.divided_off
    found = overdispersion_corrected(whole, richer, overdispersion_of(inference, whole, richer))
    return found.with_log(found.log - taken, found.divided_off + taken)


def _tried(first: Comparison, law: LaplaceFit, constant: LaplaceFit) -> tuple[TriedLaw, ...]:
    """Laws of the first round; that which was taken alone as it was fitted at last."""
    rows = [
        TriedLaw(law, law.log - constant.log, False)
        if one.effects == law.effects
        else TriedLaw(one, first.gain(one), not one.evidence.mode.steps)
        for one in first.found
    ]
    return tuple(sorted(rows, key=lambda row: -row.log))


def _beside(rounds: Sequence[Comparison], law: LaplaceFit) -> tuple[LaplaceFit, ...]:
    """Laws of the last round that tried the first law of a model."""
    rounds = [comparison for comparison in rounds if any(one.effects[-1] is law.effects[0] for one in comparison.found)]
    return rounds[-1].found if rounds else ()


def _simplest(comparison: Comparison) -> LaplaceFit | None:
    """The most probable law, or one as good with fewer parameters; None where none is preferred to none."""
    if not comparison.found or comparison.gain(comparison.found[0]) <= PREFERRED:
        return None
    near = [one for one in comparison.found if one.log > comparison.found[0].log - SIMPLER_LAW]
    return min(near, key=lambda one: (sum(len(effect.parameters) for effect in one.effects), -one.log))


def _at_its_mode(comparison: Comparison) -> LaplaceFit:
    """The most probable law where it is best, also where its slopes predicted too little for a search to look there."""
    first = comparison.found[0]
    if first.evidence.mode.steps:
        return first
    old = first.evidence.mode
    return comparison.search.inference.fitted(first.supermodel, first.effects, first.local, old.sigma, old.place.eta)


def _may_grow(found: LaplaceFit, rounds: int) -> bool:
    """Whether a further law is looked for: each may be found once, and once be made needless by another."""
    return len(found.effects) < MOST_LAWS and rounds < 2 * MOST_LAWS


def _about(search: Search, found: LaplaceFit) -> tuple[Search, LaplaceFit]:
    """Errors of measured inputs found anew about a better model, where there are such inputs."""
    anew = relinearised(search, found)
    return (search, found) if anew is None else anew


def _constant(comparison: Comparison, law: LaplaceFit, base: LaplaceFit) -> LaplaceFit:
    """Constant parameters in the noise of the law: as fitted beside it, or the best of two beginnings."""
    if not comparison.parent.effects:
        return comparison.parent
    inference = comparison.search.inference
    local = transferred(law.supermodel, base.supermodel, base.local, law.local)
    continued = inference.without_by_continuation(law, ())
    from_base = inference.fitted(law.supermodel, (), np.where(_of_laws(law.supermodel), continued.local, local))
    return max(continued, from_base, key=lambda one: one.log)


def _of_laws(supermodel: Supermodel) -> np.ndarray:
    return np.array(["." in name for name in supermodel.names])


def own_values(search: Search, supermodel: Supermodel, constant: LaplaceFit) -> LaplaceFit:
    """Each record with base parameters of its own.

    Law
    ---
    ``theta_r = reference exp(eta_r)``, ``eta_r ~ N(0, BASE_SD^2)``; the evidence is Laplace's.
    """
    unknowns = search.inference.unknowns(supermodel, ())
    held = unknowns.scattering
    unknowns = unknowns.holding(held, np.zeros_like(unknowns.lower))
    local = _alone(search, supermodel, transferred(supermodel, constant.supermodel, constant.local))
    endless = np.full_like(unknowns.lower, np.inf)
    free = replace(unknowns, lower=-endless, upper=endless)
    eta = free.coordinate(local[:, unknowns.shared])[:, held]
    start = unknowns.place_of(local, eta)
    start = start._replace(z=np.where(np.isin(np.arange(len(endless)), held), 0.0, start.z))
    found = mode(unknowns, start, search.inference.secant(supermodel), np.full(len(held), BASE_SD))
    return LaplaceFit((), supermodel, own_evidence(found))


def _alone(search: Search, supermodel: Supermodel, near: np.ndarray) -> np.ndarray:
    """Values of each record fitted by itself, from what suits all together.

    Where that leaves more than noise, horizons grow from what the record suggests, too.
    """
    context, own = search.context, search.context.subset(())
    suggested, found = with_values(supermodel, near, context.data_start), near.copy()
    for r in range(len(near)):
        mine = np.arange(len(near)) == r
        best = refit(supermodel, own, np.repeat(near[r : r + 1], len(near), axis=0), np.where(mine, context.whole, 0))
        if not slopes_tell(float(np.sqrt(best.cost / supermodel.samples[r]))):
            local = np.repeat(suggested[r : r + 1], len(near), axis=0)
            for counts in context.counts:
                end = refit(supermodel, own, local, np.where(mine, counts, 0))
                local = end.local
            best = min(best, end, key=lambda one: one.cost)
        found[r] = best.local[r]
    return found


def own_evidence(found: PosteriorMode) -> MarginalLikelihood:
    """Laplace's evidence of records that have base parameters of their own, up to what all models of them share.

    What they share beside these is paid for as in any other model.

    Parameters
    ----------
    found : PosteriorMode
        With the standard deviations of the deviations, which are known.
    """
    there = MarginalLikelihood.of(_with_own_parameters(found))
    rest, size = others_shared(found.unknowns), len(found.unknowns.shared)
    z, covariance = found.place.z.copy()[None], np.zeros((1, size, size))
    z[:, rest] = there.z
    covariance[0][np.ix_(rest, rest)] = there.covariance[0]
    log = there.log - len(found.place.eta) * float(np.log(found.sigma).sum())
    return MarginalLikelihood(found, log, found.sigma[None], np.array([log]), np.ones(1), z, covariance)


def others_shared(unknowns: Unknowns) -> np.ndarray:
    """Places among the shared values of those that do not deviate: effects, values with a prior."""
    return np.setdiff1d(np.arange(len(unknowns.shared)), unknowns.scattering)


def _with_own_parameters(found: PosteriorMode) -> PosteriorMode:
    """The same mode with deviations among each record's own values, what is believed of them among what it says.

    They are where they are best: what slopes predict of a further step, none has brought.
    """
    unknowns, place, normal = found.unknowns, found.place, found.normal
    rest, deviating = others_shared(unknowns), unknowns.scattering
    names = [unknowns.names[i] for i in (*rest, *range(len(unknowns.shared), len(unknowns.names)), *deviating)]
    precision = unknowns.own_precision(found.sigma)
    believed = np.sum((place.eta / found.sigma) ** 2, axis=1)
    return replace(
        found,
        unknowns=replace(
            unknowns,
            names=tuple(names),
            shared=unknowns.shared[rest],
            each=np.concatenate([unknowns.each, unknowns.shared[deviating]]),
            free=np.concatenate([unknowns.free, np.ones_like(place.eta, dtype=bool)], axis=1),
            scattering=deviating[:0],
            precision=unknowns.precision[np.ix_(rest, rest)],
            size=np.concatenate([unknowns.size, np.ones(len(deviating))]),
            offset=np.broadcast_to(unknowns.offset, len(unknowns.shared))[rest],
            **{name: getattr(unknowns, name)[rest] for name in OF_SHARED},
        ),
        place=place._replace(z=place.z[rest], own=np.concatenate([place.own, place.eta], axis=1), eta=place.eta[:, :0]),
        normal=normal._replace(
            shared=normal.shared[np.ix_(rest, rest)],
            cross=normal.cross[:, rest],
            blocks=normal.blocks + np.diag(precision),
            pull=normal.pull[rest],
            pulls=np.zeros_like(normal.pulls),
            cost=normal.cost + float(believed.sum()),
            costs=normal.costs + believed,
        ),
        sigma=found.sigma[:0],
        unmet=0.0,
    )
