"""Each record as the others predict it, by each of the three models.

Law
---
What a model says of a record beforehand is the difference of two marginal likelihoods, that of all records and that of
the others. What it is wrong by is the gap with the parameters that the others found; only the record's own zero and
start are its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fibrefit.discovery.engine.effort import descent
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.laplace_inference import LaplaceInference
from fibrefit.discovery.engine.refit import Subset, refit
from fibrefit.discovery.engine.secant import SecantGram
from fibrefit.discovery.engine.supermodel import Supermodel
from fibrefit.discovery.search.cross_validation import REFIT_STEPS
from fibrefit.discovery.search.search import Search
from fibrefit.problem.estimate.evidence import laplace
from fibrefit.problem.estimate.gauss_newton import NOTICED, mode
from fibrefit.problem.estimate.normal_equations import arranged, local_grams
from fibrefit.series.together.models import Own, log_evidence


@dataclass(frozen=True)
class LeftOut:
    """How well a model predicts records it was not fitted to.

    Parameters
    ----------
    gaps : (n_record,)
        Normalised residual RMS of each record.
    elpd : (n_record,)
        Log predictive density of each record given the others (leave-one-out), up to what all models share.
    """

    gaps: np.ndarray
    elpd: np.ndarray

    @property
    def gap(self) -> float:
        """Of all records, each counting alike."""
        return float(np.sqrt(np.mean(self.gaps**2)))


def left_out(search: Search, found: LaplaceFit, tell: Callable[[float], None] = lambda share: None) -> LeftOut:
    """Predictions of a model whose parameters all records share."""
    number, gaps, said, at = len(found.local), [], [], found.evidence.mode
    seen = search.inference.common_noise.whitened(found.supermodel)
    grams = local_grams(at.unknowns, at.place, lambda one, of, to: seen.grams(one, of, to, search.context.whole))
    for r in range(number):
        tell(r / number)
        shared, without = _without(search.inference, found, grams, r)
        local = found.local.copy()
        local[:, found.evidence.mode.unknowns.shared] = shared
        gaps.append(_gap(search, found.supermodel, local, r))
        said.append(found.evidence.log - without)
    return LeftOut(np.array(gaps), np.array(said))


def own_left_out(search: Search, own: Own) -> LeftOut:
    """Predictions where each record has values of its own: of another the others tell no more than their mean."""
    places, gaps, said = own.mode.unknowns.shared[own.mode.unknowns.scattering], [], []
    number = len(own.local)
    for r in range(number):
        others = np.delete(own.local[:, places], r, axis=0)
        local = own.local.copy()
        local[:, places] = np.exp(np.log(np.maximum(others, 1e-300)).mean(axis=0))
        gaps.append(_gap(search, own.supermodel, local, r))
        said.append(log_evidence(own.mode) - log_evidence(own.mode, np.arange(number) != r))
    return LeftOut(np.array(gaps), np.array(said))


def _without(
    inference: LaplaceInference, found: LaplaceFit, grams: np.ndarray, record: int
) -> tuple[np.ndarray, float]:
    """Shared values ``(n_shared,)`` in SI units and the evidence, one record saying nothing.

    The matrices of the others at the mode of all tell where they lead; only what these predict much of is followed.
    """
    kept, at = np.arange(len(grams)) != record, found.evidence.mode
    start = replace(at, normal=arranged(at.unknowns, grams * kept[:, None, None]))
    gram = SecantGram(inference.common_noise.whitened(found.supermodel), np.where(kept, inference.context.whole, 0))
    evidence = laplace(mode(at.unknowns, start, gram, at.sigma, NOTICED, descent()["effort"]))
    return at.unknowns.value(evidence.mean), evidence.log


def _gap(search: Search, supermodel: Supermodel, local: np.ndarray, record: int) -> float:
    only = np.where(np.arange(len(local)) == record, search.context.whole, 0)
    end = refit(supermodel, Subset((), search.context.each), local, only, REFIT_STEPS)
    return float(np.sqrt(end.cost / search.base.supermodel.samples[record]))
