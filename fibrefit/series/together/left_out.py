"""Each record as the others predict it where each has values of its own, see `cross_validation` for other models."""

from __future__ import annotations

import numpy as np

from fibrefit.discovery.search.cross_validation import LeftOut, gap_of_record
from fibrefit.discovery.search.search import Search
from fibrefit.series.together.models import Own, log_evidence


def own_left_out(search: Search, own: Own) -> LeftOut:
    """Predictions where each record has values of its own: of another the others tell no more than their mean."""
    places, gaps, said = own.mode.unknowns.shared[own.mode.unknowns.scattering], [], []
    number = len(own.local)
    for r in range(number):
        others = np.delete(own.local[:, places], r, axis=0)
        local = own.local.copy()
        local[:, places] = np.exp(np.log(np.maximum(others, 1e-300)).mean(axis=0))
        gaps.append(gap_of_record(search, own.supermodel, local, r))
        said.append(log_evidence(own.mode) - log_evidence(own.mode, np.arange(number) != r))
    return LeftOut(np.array(gaps), np.array(said))
