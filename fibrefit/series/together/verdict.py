"""Which of the three models serves a series, and what it says, in numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fibrefit.core.limits import Progress, quiet
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.search.cross_validation import LeftOut, left_out
from fibrefit.problem.estimate.evidence import MarginalLikelihood
from fibrefit.problem.statement.matrices import inverses
from fibrefit.problem.task import Task
from fibrefit.series.population import Population, population
from fibrefit.series.together.laws import BY_EFFECT, SpeedLaw, factors, parameter_of
from fibrefit.series.together.left_out import own_left_out
from fibrefit.series.together.models import PREFERRED, ThreeModels, others_shared, three_models
from fibrefit.series.together.speeds import span, speeds_of

Answer = Literal["constant", "speed_law", "per_record"]
POINTS = 60
DRAWS = 400
BAND = (0.025, 0.975)


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
    """What a series says together.

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


def judged(task: Task, seed: int = 0, tell: Progress = quiet) -> Verdict:
    """Fit and compare the three models.

    Parameters
    ----------
    task : Task
        With constant parameters, of two records or more.
    seed : int
    tell : callable
        Called with what is being done and the share that is finished.
    """
    found = three_models(task, seed, tell)
    search, what = found.search, "predicting each record from the others"
    predicted: dict[Answer, LeftOut] = {
        "constant": left_out(search, found.constant, lambda share: tell(what, share / 2)),
        "speed_law": left_out(search, found.law, lambda share: tell(what, 0.5 + share / 2)),
        "per_record": own_left_out(search, found.own),
    }
    cost = float(found.own.supermodel.costs(found.own.local, search.context.whole).sum())
    gaps: dict[Answer, float] = {
        "constant": search.gap_left(found.constant),
        "speed_law": search.gap_left(found.law),
        "per_record": float(np.sqrt(cost / search.samples)),
    }
    answer = _answer(found, predicted)
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
        alike=_alike(found),
    )


def _answer(found: ThreeModels, predicted: Mapping[Answer, LeftOut]) -> Answer:
    """A law has to be more probable, and to predict records it has not seen better, than constant parameters."""
    gain, own = found.law.log - found.constant.log, found.own.log - found.constant.log
    gained = predicted["speed_law"].elpd.sum() - predicted["constant"].elpd.sum()
    lawful = gain > PREFERRED and gained > 0.0
    if own > max(gain if lawful else 0.0, 0.0) + PREFERRED:
        return "per_record"
    return "speed_law" if lawful else "constant"


def _alike(found: ThreeModels) -> tuple[str, ...]:
    """Other forms of the first law that are as probable within what tells explanations apart."""
    if not found.law.effects:
        return ()
    first = found.law.effects[0]
    mine = next((one.log for one in found.beside if one.effects[-1] is first), np.inf)
    return tuple(
        one.effects[-1].name for one in found.beside if one.effects[-1] is not first and one.log > mine - PREFERRED
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
    said = variance > 0.0
    weights = np.where(said, 1.0 / np.where(said, variance, 1.0), 0.0)
    follows = -np.einsum("rij,rkj->rik", inverse, normal.cross[:, rest])
    mean = np.einsum("ri,rik->ik", weights, follows) / np.maximum(weights.sum(axis=0), 1e-300)[:, None]
    spread = evidence.spread[np.ix_(rest, rest)]
    apart = np.where(said, _variance(follows - mean, spread), 0.0)
    relative, common = np.sqrt(variance + apart), np.sqrt(_variance(mean, spread))
    names = tuple(unknowns.names[k] for k in deviating)
    return OwnValues(names, values, values * relative, np.median(values, axis=0) * common)


def _variance(along: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Variances ``(...)`` along directions ``(..., n)``."""
    return np.maximum(np.einsum("...j,jk,...k->...", along, covariance, along), 0.0)


def _law_curve(found: LaplaceFit, law: SpeedLaw, speeds: Mapping[str, np.ndarray]) -> LawCurve:
    slow, fast = span(speeds[law.parameter])
    over = np.geomspace(slow, fast, POINTS)
    unknowns, place = found.evidence.mode.unknowns, found.evidence.mode.place
    root = np.linalg.cholesky(found.evidence.spread + 1e-18 * np.eye(len(place.z)))
    random = np.random.default_rng(0)
    drawn = place.z + random.standard_normal((DRAWS, len(place.z))) @ root.T
    drawn = np.clip(drawn, unknowns.lower, unknowns.upper)
    best, *others = (_over(law, unknowns.names, unknowns.value(z), over) for z in (place.z, *drawn))
    low, high = np.quantile(np.array(others), BAND, axis=0)
    return LawCurve(law, over, best, low, high)


def _over(law: SpeedLaw, names: tuple[str, ...], values: np.ndarray, speeds: np.ndarray) -> np.ndarray:
    named = dict(zip(names, values.tolist(), strict=False))
    return named[law.parameter] * factors(law, named, speeds)
