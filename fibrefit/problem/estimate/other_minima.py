"""Records in another minimum: a descent ends in the nearest one, and a record may have two.

A weight that sticks comes to rest at one of its reversals, a motion that bounces lands once more or does not: what a
record deviates by has a minimum on either side, tens of nats apart. Which of them a hypothesis meets is chance, and a
comparison of two that met different ones compares minima.

Law
---
Along each deviation the cost of a record is taken a standard deviation away, on both sides. Where it is far below the
parabola that slopes predict, the record is begun there, with all that records share held: they are independent then.
Each keeps the better of its two minima.
"""

from __future__ import annotations

import numpy as np

from fibrefit.problem.estimate.evidence import FIRST_SIGMA
from fibrefit.problem.estimate.gauss_newton import NOTICED, Effort, mode
from fibrefit.problem.estimate.gram import Gram
from fibrefit.problem.estimate.normal_equations import (
    RIGID,
    Place,
    PosteriorMode,
    Unknowns,
    local_of,
    shared_coordinates,
)

NEARBY = Effort(steps=12)
"""How long that minimum is looked for: it is near, or it is none."""
FAR_BELOW = 0.8
"""Share of the rise that slopes predict, below which a record is begun on that side: of five drops one had another
minimum, and rose on that side by 0.4 to 0.7 of what it did on the other; both sides of the others were within 1 %."""


def better_minima(found: PosteriorMode, gram: Gram, descent: Gram) -> Place | None:
    """Each record in the better one of two minima; None where none of them has a better one.

    Parameters
    ----------
    found : PosteriorMode
    gram : callable
        Products of changes however large, see `Gram`.
    descent : callable
        The same for a descent.
    """
    away = beyond_the_parabola(found, gram)
    if not away.any():
        return None
    unknowns, place = found.unknowns, found.place
    held = unknowns.holding(np.arange(len(unknowns.shared)), place.z)
    there = mode(held, place._replace(eta=place.eta + away), descent, found.sigma, effort=NEARBY)
    better = costs_of(there) < costs_of(found) - NOTICED
    if not better.any():
        return None
    own, eta = (
        np.where(better[:, None], new, old) for new, old in ((there.place.own, place.own), (there.place.eta, place.eta))
    )
    return place._replace(own=own, eta=eta)


def beyond_the_parabola(found: PosteriorMode, gram: Gram) -> np.ndarray:
    """Where records are begun anew: changes of their deviations ``(n_record, n_scattering)``, none of most.

    Of several sides the one whose cost is the smallest share of what slopes predict.
    """
    unknowns, place, normal = found.unknowns, found.place, found.normal
    nothing = np.zeros_like(place.eta)
    differing = np.flatnonzero(found.sigma > 0.0)
    if not differing.size or not np.isfinite(normal.cost):
        return nothing
    which = np.repeat(differing, 2)
    steps = np.maximum(found.sigma[which], FIRST_SIGMA) * np.tile([1.0, -1.0], differing.size)
    columns = unknowns.scattering[which]
    z = shared_coordinates(unknowns, place)
    targets = np.stack([_moved(unknowns, z, *side) for side in zip(columns, steps, strict=True)], axis=1)
    grams = gram(local_of(unknowns, place), unknowns.shared[columns], targets)
    rise = np.einsum("rii->ri", grams)[:, :-1] + 2.0 * grams[:, :-1, -1]
    mine = len(unknowns.each) + which
    predicted = normal.blocks[:, mine, mine] * steps**2 + 2.0 * normal.pulls[:, mine] * steps
    told = predicted > NOTICED
    share = np.where(told, rise / np.where(told, predicted, 1.0), np.inf)
    best = np.argmin(np.where(np.isfinite(share), share, np.inf), axis=1)
    begun = share[np.arange(len(share)), best] < FAR_BELOW
    nothing[np.flatnonzero(begun), which[best[begun]]] = steps[best[begun]]
    return nothing


def costs_of(found: PosteriorMode, sigma: np.ndarray | None = None) -> np.ndarray:
    """Share of Q of each record, ``(n_record,)``, beside what is believed of what they share.

    Parameters
    ----------
    found : PosteriorMode
    sigma : (n_scattering,), optional
        Standard deviations by which deviations count; those of the mode by default.
    """
    deviations = found.place.eta / np.maximum(found.sigma if sigma is None else sigma, RIGID)
    return np.asarray(found.normal.costs + np.sum(deviations**2, axis=1))


def _moved(unknowns: Unknowns, z: np.ndarray, column: int, step: float) -> np.ndarray:
    """Values ``(n_record,)`` of a deviating column of the coordinates ``(n_record, n_shared)``, a step further."""
    there = z.copy()
    there[:, column] += step
    return unknowns.value(there)[:, column]
