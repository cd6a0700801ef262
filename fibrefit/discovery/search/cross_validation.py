"""Leave-one-record-out cross-validation: how each record is predicted by a model fitted to the others."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from fibrefit.discovery.engine.candidates import Hypothesis
from fibrefit.discovery.engine.refit import Subset, refit
from fibrefit.discovery.search.search import Search
from fibrefit.study.summaries.discovery import HeldOut

REFIT_STEPS = 15
"""Steps of a refit: the values without a record are near those with it."""


def cv_residuals(search: Search, hypothesis: Hypothesis) -> np.ndarray:
    """Normalised residual RMS of each record, ``(n_record,)``, all but its zero and start from the other records."""
    found = []
    for r in range(len(search.context.whole)):
        search.tell("predicting each record from the others", r / len(search.context.whole))
        found.append(search.recalled("left_out", hypothesis, r, partial(_cv_residual, search, hypothesis, r))())
    return np.array(found)


def _cv_residual(search: Search, hypothesis: Hypothesis, record: int) -> float:
    context = search.context
    others, alone = context.whole.copy(), np.zeros_like(context.whole)
    others[record], alone[record] = 0, context.whole[record]
    fitted = refit(hypothesis.supermodel, context.subset(hypothesis.effects), hypothesis.fit.local, others, REFIT_STEPS)
    own = refit(hypothesis.supermodel, Subset((), context.each), fitted.local, alone, REFIT_STEPS)
    return float(np.sqrt(own.cost / search.base.supermodel.samples[record]))


def held_out(search: Search, base: Hypothesis, best: Hypothesis) -> tuple[HeldOut, ...]:
    """Each record as predicted without and with what was found; none where there is but one."""
    records: Sequence[str] = search.task.problem.layout.records
    if len(records) == 1:
        return ()
    gaps = zip(records, cv_residuals(search, base), cv_residuals(search, best), strict=True)
    return tuple(HeldOut(record=name, gap_before=float(before), gap_after=float(after)) for name, before, after in gaps)
