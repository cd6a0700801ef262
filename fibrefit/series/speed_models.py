"""Three models of the same records: one set of parameters, parameters with a law of speed, parameters of each record.

All are compared in one noise. In the first two, records may differ by chance, as in a fit; in the third each record has
values of its own about which nothing is known beforehand but their order of magnitude. What no record has for itself,
such as a value with a prior, has that prior in all of them. The law is searched for as a missing effect is, in one
supermodel that holds all laws.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Literal, NamedTuple

import numpy as np

from fibrefit.core.limits import Progress, quiet
from fibrefit.core.matrices import inverses
from fibrefit.discovery.comparison import Comparison, comparison_of
from fibrefit.discovery.engine.candidates import transferred, with_values
from fibrefit.discovery.engine.effort import FIRST_STARTS, slopes_tell
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.laplace_inference import LaplaceInference
from fibrefit.discovery.engine.priors import BASE_SD
from fibrefit.discovery.engine.refit import refit
from fibrefit.discovery.engine.supermodel import Supermodel, supermodel_of
from fibrefit.discovery.pairs import pruned
from fibrefit.discovery.search.cross_validation import LeftOut, gap_of_record, left_out
from fibrefit.discovery.search.inputs import overdispersion_corrected, overdispersion_of, relinearised
from fibrefit.discovery.search.search import Search
from fibrefit.discovery.search.setup import prepared_search
from fibrefit.fitting.identify import How, identify
from fibrefit.fitting.result import Identification
from fibrefit.laws.law import Effect
from fibrefit.problem import Arrowhead, MarginalLikelihood, PosteriorMode, Task, Unknowns, mode
from fibrefit.series.meta_analysis import Population, population
from fibrefit.series.speed_laws import BY_EFFECT, LAWS, SpeedLaw, factors, laws_on, parameter_of, span, speeds_of
from fibrefit.series.thresholds import PREFERRED, SIMPLER_LAW

Answer = Literal["constant", "speed_law", "per_record"]


@dataclass(frozen=True)
class SpeedSearch(Search):
    """A search whose candidates are laws of speed, at most one for each parameter."""

    @classmethod
    def of(cls, search: Search) -> SpeedSearch:
        """The same search with this way to try candidates."""
        return cls(**{one.name: getattr(search, one.name) for one in fields(Search)})

    def extensions(self, parent: LaplaceFit) -> tuple[type[Effect], ...]:
        """Laws of parameters that have none yet."""
        taken = {parameter_of(effect) for effect in (*self.task.problem.model.effects, *parent.effects)}
        return tuple(effect for effect in self.effects if parameter_of(effect) not in taken)

    def in_turn(self, ranked: Sequence[type[Effect]]) -> list[list[type[Effect]]]:
        """All forms of a law together, that of the parameter first of which slopes predict most."""
        parameters = dict.fromkeys(map(parameter_of, ranked))
        return [[effect for effect in ranked if parameter_of(effect) == name] for name in parameters]

    def supermodel_for(self, effect: type[Effect], others: Sequence[type[Effect]] = ()) -> Supermodel:
        """The one supermodel that holds all laws: they are few and quick, and one program serves every round."""
        with self.lock:
            for supermodel in self.supermodels:
                if supermodel.holds(self.effects) and supermodel.sensitivities is self.base.supermodel.sensitivities:
                    return supermodel
            self.supermodels.append(supermodel_of(self.task, self.effects, self.base.supermodel.sensitivities))
            return self.supermodels[-1]


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
    rivals : tuple of LaplaceFit
        Laws tried in the round in which the first one of `law` was found, the most probable first.
    """

    search: Search
    before: Identification
    constant: LaplaceFit
    law: LaplaceFit
    own: LaplaceFit
    tried: tuple[TriedLaw, ...]
    rivals: tuple[LaplaceFit, ...]


def three_models(task: Task, seed: int = 0, progress: Progress = quiet) -> ThreeModels:
    """Fit the three models.

    Parameters
    ----------
    task : Task
        With constant parameters.
    seed : int
        Of the scatter of starts.
    progress : callable
        Called with what is being done and the share that is finished.
    """
    laws = laws_on(task.problem.model.rig)
    before = identify(task, FIRST_STARTS, seed, How(whiten=False, rivals=False), progress=progress)
    search, base = prepared_search(task, before, [law.effect for law in laws], progress)
    rounds, law, rivals = _grown(search, base, progress)
    first, last = rounds[0], rounds[-1]
    search = last.search
    progress("comparing constant parameters, and parameters of each record", None)
    # Constant parameters in the noise of the law: as fitted with it, or the best of two starts.
    constant = last.parent
    if constant.effects:
        local = transferred(law.supermodel, base.supermodel, base.local, law.local)
        continued = search.inference.without_by_continuation(law, ())
        of_laws = np.array(["." in name for name in law.supermodel.names])
        from_base = search.inference.fitted(law.supermodel, (), np.where(of_laws, continued.local, local))
        constant = max(continued, from_base, key=lambda one: one.log)
    law = law if law.divided_off else with_counted_gain(search.inference, constant, law)
    best = max(constant, law, key=lambda one: one.log)
    own = with_counted_gain(search.inference, best, own_values(search, law.supermodel, constant))
    # Laws of the first round; that which was taken alone as it was fitted at last.
    tried = [
        TriedLaw(law, law.log - constant.log, False)
        if one.effects == law.effects
        else TriedLaw(one, first.gain(one), not one.evidence.mode.steps)
        for one in first.found
    ]
    tried.sort(key=lambda row: -row.log)
    return ThreeModels(search, before, constant, law, own, tuple(tried), rivals)


def _grown(
    search: Search, base: LaplaceFit, progress: Progress
) -> tuple[list[Comparison], LaplaceFit, tuple[LaplaceFit, ...]]:
    """All rounds of trying laws, the model with those that are needed, or with the best one, and rivals of its first.

    A law that stood in for another one is left out once that has been found. A model whose laws were taken in rounds is
    as it was fitted: what counts of its gain over constant parameters is not the sum of what counted in each round.
    """
    rounds = [comparison_of(SpeedSearch.of(search), base, "trying each law of speed")]
    # One law for each parameter, each of which may be found once, and once be made needless by another.
    most = len({law.parameter for law in LAWS})
    while found := _simplest(rounds[-1]):
        # Errors of measured inputs are found anew about a better model, where there are such inputs.
        search, found = relinearised(rounds[-1].search, found) or (rounds[-1].search, found)
        law = pruned(search.inference, found)
        if len(law.effects) >= most or len(rounds) >= 2 * most:
            rounds.append(replace(rounds[-1], search=search, parent=law, found=()))
            law = law.undivided
            break
        rounds.append(comparison_of(SpeedSearch.of(search), law, "trying a further law of speed"))
    else:
        last = rounds[-1]
        law = last.parent.undivided if last.parent.effects else last.found[0]
        old = law.evidence.mode
        if not last.parent.effects and not old.steps:
            # Its slopes predicted too little for a search to look where it is best.
            law = last.search.inference.fitted(law.supermodel, law.effects, law.local, old.sigma, old.place.eta)
    tried = [one.found for one in rounds if any(fit.effects[-1] is law.effects[0] for fit in one.found)]
    return rounds, law, tried[-1] if tried else ()


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


def _simplest(comparison: Comparison) -> LaplaceFit | None:
    """The most probable law, or one as good with fewer parameters; None where none is preferred to none."""
    if not comparison.found or comparison.gain(comparison.found[0]) <= PREFERRED:
        return None
    near = [one for one in comparison.found if one.log > comparison.found[0].log - SIMPLER_LAW]
    return min(near, key=lambda one: (sum(len(effect.parameters) for effect in one.effects), -one.log))


def own_values(search: Search, supermodel: Supermodel, constant: LaplaceFit) -> LaplaceFit:
    """Each record with base parameters of its own.

    Each is fitted by itself first, from what suits all together; where that leaves more than noise, horizons grow from
    what the record suggests, too.

    Law
    ---
    ``theta_r = reference exp(eta_r)``, ``eta_r ~ N(0, BASE_SD^2)``; the evidence is Laplace's.
    """
    near, context = transferred(supermodel, constant.supermodel, constant.local), search.context
    suggested, local, own = with_values(supermodel, near, context.data_start), near.copy(), context.subset(())
    for r in range(len(near)):
        mine = np.arange(len(near)) == r
        best = refit(supermodel, own, np.repeat(near[r : r + 1], len(near), axis=0), np.where(mine, context.whole, 0))
        if not slopes_tell(float(np.sqrt(best.cost / supermodel.samples[r]))):
            there = np.repeat(suggested[r : r + 1], len(near), axis=0)
            for counts in context.counts:
                end = refit(supermodel, own, there, np.where(mine, counts, 0))
                there = end.local
            best = min(best, end, key=lambda one: one.cost)
        local[r] = best.local[r]

    unknowns = search.inference.unknowns(supermodel, ())
    deviating = unknowns.scattering
    unknowns = unknowns.fixed_at(deviating, np.zeros_like(unknowns.lower))
    endless = np.full_like(unknowns.lower, np.inf)
    free = replace(unknowns, lower=-endless, upper=endless)
    eta = free.coordinate(local[:, unknowns.shared])[:, deviating]
    start = unknowns.place_of(local, eta)
    start = start._replace(z=np.where(np.isin(np.arange(len(endless)), deviating), 0.0, start.z))
    found = mode(unknowns, start, search.inference.secant(supermodel), np.full(len(deviating), BASE_SD))
    return LaplaceFit((), supermodel, own_evidence(found))


def own_evidence(found: PosteriorMode) -> MarginalLikelihood:
    """Laplace's evidence of records that have base parameters of their own, up to what all models of them share.

    What they share besides is penalised as in any other model.

    Parameters
    ----------
    found : PosteriorMode
        With the standard deviations of the deviations, which are known.
    """
    unknowns, place, normal = found.unknowns, found.place, found.normal
    rest, deviating, size = others_shared(unknowns), unknowns.scattering, len(unknowns.shared)
    # Deviations count among each record's own values, and their prior among what it says. They are where they are best:
    # what slopes predict of a further step, none has brought.
    names = [unknowns.names[i] for i in (*rest, *range(size, len(unknowns.names)), *deviating)]
    of_prior = np.sum((place.eta / found.sigma) ** 2, axis=1)
    with_own_parameters = replace(
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
            offset=np.broadcast_to(unknowns.offset, size)[rest],
            **{name: getattr(unknowns, name)[rest] for name in ("log", "reference", "scale", "mean", "lower", "upper")},
        ),
        place=place._replace(z=place.z[rest], own=np.concatenate([place.own, place.eta], axis=1), eta=place.eta[:, :0]),
        normal=normal._replace(
            shared=normal.shared[np.ix_(rest, rest)],
            cross=normal.cross[:, rest],
            blocks=normal.blocks + np.diag(unknowns.own_precision(found.sigma)),
            pull=normal.pull[rest],
            pulls=np.zeros_like(normal.pulls),
            cost=normal.cost + float(of_prior.sum()),
            costs=normal.costs + of_prior,
        ),
        sigma=found.sigma[:0],
        unmet=0.0,
    )
    there = MarginalLikelihood.of(with_own_parameters)
    z, covariance = place.z.copy()[None], np.zeros((1, size, size))
    z[:, rest] = there.z
    covariance[0][np.ix_(rest, rest)] = there.covariance[0]
    log = there.log - len(place.eta) * float(np.log(found.sigma).sum())
    return MarginalLikelihood(found, log, found.sigma[None], np.array([log]), np.ones(1), z, covariance)


def others_shared(unknowns: Unknowns) -> np.ndarray:
    """Places among the shared values of those that do not deviate: effects, values with a prior."""
    return np.setdiff1d(np.arange(len(unknowns.shared)), unknowns.scattering)


def own_left_out(search: Search, own: LaplaceFit) -> LeftOut:
    """Predictions where each record has values of its own: another one is predicted by the mean of the others."""
    at, whole = own.evidence.mode, search.context.whole
    places, number = at.unknowns.shared[at.unknowns.scattering], len(own.local)
    seen = search.inference.common_noise.whitened(own.supermodel)
    grams = at.unknowns.local_grams(at.place, lambda one, of, to: seen.grams(one, of, to, whole))

    def log_evidence(kept: np.ndarray) -> float:
        place = at.place._replace(eta=np.where(kept[:, None], at.place.eta, 0.0))
        normal = Arrowhead.of(at.unknowns, grams * kept[:, None, None])
        return own_evidence(replace(at, place=place, normal=normal)).log

    gaps, elpd = [], []
    for r in range(number):
        others = np.delete(own.local[:, places], r, axis=0)
        local = own.local.copy()
        local[:, places] = np.exp(np.log(np.maximum(others, 1e-300)).mean(axis=0))
        gaps.append(gap_of_record(search, own.supermodel, local, r))
        elpd.append(log_evidence(np.ones(number, dtype=bool)) - log_evidence(np.arange(number) != r))
    return LeftOut(np.array(gaps), np.array(elpd))


@dataclass(frozen=True)
class LawCurve:
    """A parameter over speed, as the law says.

    Parameters
    ----------
    law : SpeedLaw
    speeds : (n_speed,) in m/s
        Over the range the records cover.
    values, low, high : (n_speed,) in SI units
        With a band of 95 %.
    """

    law: SpeedLaw
    speeds: np.ndarray
    values: np.ndarray
    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True)
class OwnValues:
    """Base parameters of each record by itself.

    Parameters
    ----------
    names : tuple of str
    values, errors : (n_record, n_name) in SI units
        Errors are those of each record alone.
    common : (n_name,) in SI units
        Standard errors that all records share: of effects, exponents and values with a prior. More records leave them.
    """

    names: tuple[str, ...]
    values: np.ndarray
    errors: np.ndarray
    common: np.ndarray


@dataclass(frozen=True)
class Verdict:
    """Comparison of the three models, and what the one that answers says of each record.

    Parameters
    ----------
    answer : {"constant", "speed_law", "per_record"}
    models : ThreeModels
    left_out : mapping of answer to LeftOut
    gaps : mapping of answer to float
    curves : tuple of LawCurve
        A curve for each law of the model with laws.
    speeds : mapping of parameter to (n_record, 3) in m/s
        See `speeds_of`.
    own : OwnValues
        About the model that answers.
    populations : mapping of parameter to Population
    alike : tuple of str
        Forms of the law that are not distinguished from the one that was taken.
    """

    answer: Answer
    models: ThreeModels
    left_out: Mapping[Answer, LeftOut]
    gaps: Mapping[Answer, float]
    curves: tuple[LawCurve, ...]
    speeds: Mapping[str, np.ndarray]
    own: OwnValues
    populations: Mapping[str, Population]
    alike: tuple[str, ...]

    @property
    def best(self) -> LaplaceFit:
        """The model with shared parameters that serves best: with laws where they are preferred."""
        return self.models.law if self.answer == "speed_law" else self.models.constant

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each value of the models by name, as their laws and the rig declare it."""
        return {name: one.unit for name, one in self.best.supermodel.declared.items()}

    @property
    def logs(self) -> dict[Answer, float]:
        """Logarithms of the Bayes factors over constant parameters."""
        base = self.models.constant.log
        return {"constant": 0.0, "speed_law": self.models.law.log - base, "per_record": self.models.own.log - base}


def compare_models(task: Task, seed: int = 0, progress: Progress = quiet) -> Verdict:
    """Fit and compare the three models.

    Parameters
    ----------
    task : Task
        With constant parameters, of two records or more.
    seed : int
    progress : callable
        Called with what is being done and the share that is finished.
    """
    found = three_models(task, seed, progress)
    search, what = found.search, "predicting each record from the others"
    predicted: dict[Answer, LeftOut] = {
        "constant": left_out(search, found.constant, lambda share: progress(what, share / 2)),
        "speed_law": left_out(search, found.law, lambda share: progress(what, 0.5 + share / 2)),
        "per_record": own_left_out(search, found.own),
    }
    cost = float(found.own.supermodel.costs(found.own.local, search.context.whole).sum())
    gaps: dict[Answer, float] = {
        "constant": search.gap_left(found.constant),
        "speed_law": search.gap_left(found.law),
        "per_record": float(np.sqrt(cost / search.samples)),
    }
    # A law has to be more probable, and to predict records it has not seen better, than constant parameters.
    gain, own_gain = found.law.log - found.constant.log, found.own.log - found.constant.log
    lawful = gain > PREFERRED and predicted["speed_law"].elpd.sum() - predicted["constant"].elpd.sum() > 0.0
    answer: Answer = "speed_law" if lawful else "constant"
    if own_gain > max(gain if lawful else 0.0, 0.0) + PREFERRED:
        answer = "per_record"
    # Other forms of the first law that are as probable within what tells explanations apart.
    first = found.law.effects[0] if found.law.effects else None
    mine = next((one.log for one in found.rivals if one.effects[-1] is first), np.inf)
    others = [one for one in found.rivals if one.effects[-1] is not first and one.log > mine - PREFERRED]

    motion = found.before.motion
    speeds = speeds_of(motion, np.asarray(task.problem.observations.experiment.count))
    about: dict[Answer, LaplaceFit] = {"constant": found.constant, "speed_law": found.law, "per_record": found.own}
    own = own_values_about(about[answer].evidence)
    curves = tuple(
        _law_curve(found.law, BY_EFFECT[effect.name], speeds) for effect in found.law.effects if parameter_of(effect)
    )
    pooled = {
        name: population(own.values[:, j], own.errors[:, j], float(own.common[j])) for j, name in enumerate(own.names)
    }
    return Verdict(
        answer=answer,
        models=found,
        left_out=predicted,
        gaps=gaps,
        curves=curves,
        speeds=speeds,
        own=own,
        populations={name: one for name, one in pooled.items() if one is not None},
        alike=tuple(one.effects[-1].name for one in others if first is not None),
    )


def own_values_about(evidence: MarginalLikelihood) -> OwnValues:
    """Base parameters that each record by itself asks for, one step from a mode by the record's own matrix.

    All else that records share is as all of them together have it. Where that is off, so are their values: by as much
    as each asks for, of which the mean is an error of all and the rest one of each.
    """
    at = evidence.mode
    unknowns, normal, n = at.unknowns, at.normal, len(at.unknowns.each)
    deviating, rest = unknowns.scattering, others_shared(unknowns)
    inverse = inverses(normal.blocks)[:, n:]
    step = -np.einsum("rij,rj->ri", inverse, normal.pulls)
    z = at.place.z[deviating] + at.place.eta + np.clip(step, -1.0, 1.0)
    values = unknowns.reference[deviating] * np.exp(z)
    variance = np.maximum(np.einsum("rii->ri", inverse[:, :, n:]), 0.0)
    known = variance > 0.0
    weights = np.where(known, 1.0 / np.where(known, variance, 1.0), 0.0)
    follows = -np.einsum("rij,rkj->rik", inverse, normal.cross[:, rest])
    mean = np.einsum("ri,rik->ik", weights, follows) / np.maximum(weights.sum(axis=0), 1e-300)[:, None]
    spread = evidence.spread[np.ix_(rest, rest)]
    of_others = np.where(known, _variance(follows - mean, spread), 0.0)
    relative, common = np.sqrt(variance + of_others), np.sqrt(_variance(mean, spread))
    names = tuple(unknowns.names[k] for k in deviating)
    return OwnValues(names, values, values * relative, np.median(values, axis=0) * common)


def _variance(along: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Variances ``(...)`` along directions ``(..., n)``."""
    return np.maximum(np.einsum("...j,jk,...k->...", along, covariance, along), 0.0)


def _law_curve(found: LaplaceFit, law: SpeedLaw, speeds: Mapping[str, np.ndarray]) -> LawCurve:
    slow, fast = span(speeds[law.parameter])
    over = np.geomspace(slow, fast, 60)
    unknowns, place = found.evidence.mode.unknowns, found.evidence.mode.place
    root = np.linalg.cholesky(found.evidence.spread + 1e-18 * np.eye(len(place.z)))
    # Of 400 draws ten lie beyond either end of the band.
    drawn = place.z + np.random.default_rng(0).standard_normal((400, len(place.z))) @ root.T
    rows = []
    for z in (place.z, *np.clip(drawn, unknowns.lower, unknowns.upper)):
        named = dict(zip(unknowns.names, unknowns.value(z).tolist(), strict=False))
        rows.append(named[law.parameter] * factors(law, named, over))
    low, high = np.quantile(np.array(rows[1:]), (0.025, 0.975), axis=0)
    return LawCurve(law, over, rows[0], low, high)
