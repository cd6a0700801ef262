"""Each record as the others predict it where each has values of its own, see `cross_validation` for other models."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.search.cross_validation import LeftOut, gap_of_record
from fibrefit.discovery.search.search import Search
from fibrefit.problem.linear_model.normal_equations import Arrowhead
from fibrefit.series.together.models import own_evidence


def own_left_out(search: Search, own: LaplaceFit) -> LeftOut:
    """Predictions where each record has values of its own: of another the others tell no more than their mean."""
    at, whole = own.evidence.mode, search.context.whole
    places, number = at.unknowns.shared[at.unknowns.scattering], len(own.local)
    seen = search.inference.common_noise.whitened(own.supermodel)
    grams = at.unknowns.local_grams(at.place, lambda one, of, to: seen.grams(one, of, to, whole))

    def said(kept: np.ndarray) -> float:
        place = at.place._replace(eta=np.where(kept[:, None], at.place.eta, 0.0))
        normal = Arrowhead.of(at.unknowns, grams * kept[:, None, None])
        return own_evidence(replace(at, place=place, normal=normal)).log

    gaps, elpd = [], []
    for r in range(number):
        others = np.delete(own.local[:, places], r, axis=0)
        local = own.local.copy()
        local[:, places] = np.exp(np.log(np.maximum(others, 1e-300)).mean(axis=0))
        gaps.append(gap_of_record(search, own.supermodel, local, r))
        elpd.append(said(np.ones(number, dtype=bool)) - said(np.arange(number) != r))
    return LeftOut(np.array(gaps), np.array(elpd))
