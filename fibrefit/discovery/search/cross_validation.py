"""How each record is foreseen by a model fitted to the others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fibrefit.discovery.engine.candidates import Hypothesis
from fibrefit.discovery.engine.refit import Subset, refit
from fibrefit.discovery.model.finding import HeldOut
from fibrefit.discovery.search.search import Search

SHORT = 3
"""Candidates by which records are foreseen, to compare them."""
STEPS = 15
WORSE = 1.01
"""Factor on the gap from which a record is foreseen worse."""


def foreseen(search: Search, hypothesis: Hypothesis) -> np.ndarray:
    """Gap of each record, ``(n_record,)``, when all but its own zero and start comes from the other records.

    Parameters
    ----------
    search : Search
    hypothesis : Hypothesis
    """
    if hypothesis.names not in search.foreseen:
        gaps = []
        for r in range(len(search.ground.whole)):
            search.tell("predicting each record from the others", r / len(search.ground.whole))
            gaps.append(_foreseen(search, hypothesis, r))
        search.foreseen[hypothesis.names] = np.array(gaps)
    return search.foreseen[hypothesis.names]


def _foreseen(search: Search, hypothesis: Hypothesis, record: int) -> float:
    ground = search.ground
    others, alone = ground.whole.copy(), np.zeros_like(ground.whole)
    others[record], alone[record] = 0, ground.whole[record]
    fitted = refit(hypothesis.frame, ground.subset(hypothesis.effects), hypothesis.fit.local, others, STEPS)
    own = refit(hypothesis.frame, Subset((), ground.each), fitted.local, alone, STEPS)
    return float(np.sqrt(own.cost / search.base.frame.samples[record]))


def gap_foreseen(search: Search, hypothesis: Hypothesis) -> float:
    """Gap of all records together, each foreseen from the others; nan where that was not asked.

    Parameters
    ----------
    search : Search
    hypothesis : Hypothesis
    """
    if hypothesis.names not in search.foreseen:
        return float("nan")
    samples = search.base.frame.samples
    return float(np.sqrt(np.average(search.foreseen[hypothesis.names] ** 2, weights=samples)))


def best_foreseen(search: Search, chosen: Hypothesis, looked: Sequence[Hypothesis], over: Hypothesis) -> Hypothesis:
    """What is chosen to be added to `over`, or what explains the records as well and foresees most of them better.

    The best few candidates are asked too, so that they can be compared.

    Parameters
    ----------
    search : Search
    chosen : Hypothesis
    looked : sequence of Hypothesis
        Candidates, best first.
    over : Hypothesis
    """
    if len(search.ground.whole) == 1:
        return chosen
    for rival in search.alike(chosen, looked[:SHORT], over):
        if rival is not chosen and is_refuted(search, chosen, rival) and search.is_significant(rival, over):
            chosen = rival
    for other in looked[:SHORT]:
        foreseen(search, other)
    return chosen


def is_refuted(search: Search, hypothesis: Hypothesis, over: Hypothesis) -> bool:
    """Whether most records are foreseen worse with what a hypothesis adds to another than without.

    Parameters
    ----------
    search : Search
    hypothesis, over : Hypothesis
    """
    if len(search.ground.whole) == 1:
        return False
    worse = foreseen(search, hypothesis) > WORSE * foreseen(search, over)
    return bool(np.mean(worse) > 0.5)


def held_out(search: Search, best: Hypothesis) -> tuple[HeldOut, ...]:
    """Each record as foreseen without and with what was found; none where there is but one."""
    records: Sequence[str] = search.task.problem.layout.records
    if len(records) == 1:
        return ()
    gaps = zip(records, foreseen(search, search.base), foreseen(search, best), strict=True)
    return tuple(HeldOut(record, float(before), float(after)) for record, before, after in gaps)
