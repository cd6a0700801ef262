"""Leave-one-record-out cross-validation: how each record is predicted by a model fitted to the others.

Law
---
What a model says of a record beforehand is the difference of two marginal likelihoods, that of all records and that of
the others. What it is wrong by is the gap with the parameters that the others found; only the record's own zero and
start are its own.

Source
------
Gelfand and Dey, J. R. Stat. Soc. B 56 (1994), on the predictive density of what was left out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

from fibrefit.discovery.engine.candidates import Hypothesis
from fibrefit.discovery.engine.effort import descent
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.laplace_inference import LaplaceInference
from fibrefit.discovery.engine.refit import Subset, refit
from fibrefit.discovery.engine.secant import SecantGram
from fibrefit.discovery.engine.supermodel import Supermodel
from fibrefit.discovery.search.search import Search
from fibrefit.problem import NOTICEABLE_FALL, Arrowhead, MarginalLikelihood, mode
from fibrefit.study.summaries.discovery import HeldOut

REFIT_STEPS = 15
"""Steps of a refit: the values without a record are near those with it."""


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
    number, said = len(found.local), list[tuple[float, float]]()
    known = cache(partial(_known, search, found))  # Where all is in the journal, nothing is simulated.
    for r in range(number):
        tell(r / number)
        foresee = partial(_foreseen, search, found, known, r)
        said.append(search.recalled("elpd", found, r, foresee, found.supermodel)())
    gaps, elpd = np.array(said).T
    return LeftOut(gaps, elpd)


def _known(search: Search, found: LaplaceFit) -> tuple[np.ndarray, float]:
    """Matrices of all records at the mode of a model, and its evidence of them."""
    at, seen = found.evidence.mode, search.inference.common_noise.whitened(found.supermodel)
    grams = at.unknowns.local_grams(at.place, lambda one, of, to: seen.grams(one, of, to, search.context.whole))
    return grams, _evidence(search.inference, found, grams, np.ones(len(grams), dtype=bool)).log


def _foreseen(
    search: Search, found: LaplaceFit, known: Callable[[], tuple[np.ndarray, float]], record: int
) -> tuple[float, float]:
    """Gap of a record as the others predict it, and the logarithm of its predictive density."""
    grams, whole = known()
    others = _evidence(search.inference, found, grams, np.arange(len(grams)) != record)
    local, unknowns = found.local.copy(), found.evidence.mode.unknowns
    local[:, unknowns.shared] = unknowns.value(others.mean)
    return gap_of_record(search, found.supermodel, local, record), whole - others.log


def _evidence(
    inference: LaplaceInference, found: LaplaceFit, grams: np.ndarray, kept: np.ndarray
) -> MarginalLikelihood:
    """Evidence where only records that are `kept` say something; of all and of some it is found in the same way.

    The matrices of these at the mode of all tell where they lead; only what these predict much of is followed.
    """
    at = found.evidence.mode
    start = replace(at, normal=Arrowhead.of(at.unknowns, grams * kept[:, None, None]))
    gram = SecantGram(inference.common_noise.whitened(found.supermodel), np.where(kept, inference.context.whole, 0))
    return MarginalLikelihood.of(mode(at.unknowns, start, gram, at.sigma, NOTICEABLE_FALL, descent()["effort"]))


def gap_of_record(search: Search, supermodel: Supermodel, local: np.ndarray, record: int) -> float:
    """Normalised residual RMS of a record at values ``(n_record, n_local)`` in SI units, its own ones refitted."""
    alone = np.where(np.arange(len(local)) == record, search.context.whole, 0)
    own = refit(supermodel, Subset((), search.context.each), local, alone, REFIT_STEPS)
    return float(np.sqrt(own.cost / search.base.supermodel.samples[record]))


def cv_residuals(search: Search, hypothesis: Hypothesis) -> np.ndarray:
    """Normalised residual RMS of each record, ``(n_record,)``, all but its zero and start from the other records."""
    found = []
    for r in range(len(search.context.whole)):
        search.tell("predicting each record from the others", r / len(search.context.whole))
        found.append(search.recalled("left_out", hypothesis, r, partial(_cv_residual, search, hypothesis, r))())
    return np.array(found)


def _cv_residual(search: Search, hypothesis: Hypothesis, record: int) -> float:
    others, subset = search.context.whole.copy(), search.context.subset(hypothesis.effects)
    others[record] = 0
    fitted = refit(hypothesis.supermodel, subset, hypothesis.fit.local, others, REFIT_STEPS)
    return gap_of_record(search, hypothesis.supermodel, fitted.local, record)


def held_out(search: Search, base: Hypothesis, best: Hypothesis) -> tuple[HeldOut, ...]:
    """Each record as predicted without and with what was found; none where there is but one."""
    records: Sequence[str] = search.task.problem.layout.records
    if len(records) == 1:
        return ()
    gaps = zip(records, cv_residuals(search, base), cv_residuals(search, best), strict=True)
    return tuple(HeldOut(record=name, gap_before=float(before), gap_after=float(after)) for name, before, after in gaps)
