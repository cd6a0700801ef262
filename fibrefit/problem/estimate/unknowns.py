"""A problem's free values as unknowns of the likelihood with deviations between records, and back."""

from __future__ import annotations

import math

import numpy as np

from fibrefit.problem.estimate.normal_equations import Unknowns
from fibrefit.problem.statement.belief import Belief
from fibrefit.problem.statement.layout import Layout, Slot
from fibrefit.problem.thresholds import NOT_LOGARITHMIC

FLAT = 1e3
"""Standard deviation of the prior of a coordinate of which nothing is believed beforehand."""
MOST = 5
"""Parameters that may deviate at the most: those that are best known."""


def fit_unknowns(layout: Layout, values: np.ndarray, errors: np.ndarray) -> Unknowns:
    """What is unknown in a fit.

    Parameters
    ----------
    values, errors : (n_free,) in SI units
        From plain least squares.

    Law
    ---
    The rig's own parameters are given by their logarithms, and deviate from record to record; effects, and values with
    a prior, are the same in all records. Where there is but one record, nothing deviates.
    """
    entries = [(i, slot) for i, (slot, record) in enumerate(layout.entries) if record is None]
    rows = [_row(slot, float(values[i]), float(errors[i])) for i, slot in entries]
    log, reference, scale, lower, upper = (
        np.array([row[i] for row in rows], dtype=kind) for i, kind in enumerate((bool, float, float, float, float))
    )
    places = {name: i for i, name in enumerate(layout.names)}
    own = [slot for slot in layout.slots if slot.free and not slot.shared]
    records = len(layout.records)
    free = np.array([[slot.held(r) is None for slot in own] for r in range(records)], dtype=bool)
    beliefs = [prior_of(slot.belief, *row[:3]) for (_, slot), row in zip(entries, rows, strict=True)]
    return Unknowns(
        names=(*(slot.name for _, slot in entries), *(slot.name for slot in own)),
        shared=np.array([places[slot.name] for _, slot in entries], dtype=int),
        each=np.array([places[slot.name] for slot in own], dtype=int),
        free=free.reshape(records, len(own)),
        scattering=_scattering(entries, log, values, errors) if records > 1 else np.zeros(0, dtype=int),
        log=log,
        reference=reference,
        scale=scale,
        mean=np.array([mean for mean, _ in beliefs]),
        precision=np.diag([sd**-2.0 for _, sd in beliefs]),
        lower=lower,
        upper=upper,
        size=np.array([slot.range.scale for slot in own], dtype=float),
    )


def _row(slot: Slot, value: float, error: float) -> tuple[bool, float, float, float, float]:
    """Whether it is given by its logarithm, its reference and scale, and the bounds of its coordinate."""
    limits = slot.range
    spans = limits.log if "." in slot.name else limits.lower >= 0.0
    if slot.belief is not None:
        spans = slot.belief.log
    if spans and value > 0.0 and error < NOT_LOGARITHMIC * value:
        with np.errstate(divide="ignore"):
            return True, value, 1.0, float(np.log(max(limits.lower, 0.0) / value)), float(np.log(limits.upper / value))
    return False, value, limits.scale, (limits.lower - value) / limits.scale, (limits.upper - value) / limits.scale


def prior_of(
    belief: Belief | None, log: bool, reference: float, scale: float, otherwise: tuple[float, float] = (0.0, FLAT)
) -> tuple[float, float]:
    """Mean and standard deviation of the prior of a coordinate.

    Parameters
    ----------
    log, reference, scale
        Of the coordinate, see `Unknowns`; logarithmic only where a belief is.
    otherwise : (float, float)
        Where nothing is believed.
    """
    if belief is None:
        return otherwise
    if log:
        return math.log(belief.centre / reference), belief.relative
    return (belief.centre - reference) / scale, belief.spread * (belief.centre if belief.log else 1.0) / scale


def _scattering(entries: list[tuple[int, Slot]], log: np.ndarray, values: np.ndarray, errors: np.ndarray) -> np.ndarray:
    may = [k for k, (_, slot) in enumerate(entries) if log[k] and "." not in slot.name and slot.belief is None]
    places = [i for i, _ in entries]
    best = sorted(may, key=lambda k: float(errors[places[k]] / values[places[k]]))[:MOST]
    return np.array(sorted(best), dtype=int)


def free_values(layout: Layout, unknowns: Unknowns, shared: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Free values ``(n_free,)`` in SI units.

    Parameters
    ----------
    shared : (n_shared,) in SI units
    own : (n_record, n_each) in units of their sizes
    """
    places = {name: i for i, name in enumerate(unknowns.names)}
    found, number = np.empty(layout.size), len(unknowns.shared)
    for i, (slot, record) in enumerate(layout.entries):
        place = places[slot.name]
        found[i] = shared[place] if record is None else own[record, place - number] * unknowns.size[place - number]
    return found


def places_of(layout: Layout, unknowns: Unknowns) -> tuple[np.ndarray, np.ndarray]:
    """Places ``(n_free,)`` of the free values among shared coordinates and, record after record, own ones; and sizes.

    The second is what one unit of an own coordinate is in SI units, one for shared ones.
    """
    index = {name: i for i, name in enumerate(unknowns.names)}
    number, each = len(unknowns.shared), len(unknowns.each)
    places, sizes = np.zeros(layout.size, dtype=int), np.ones(layout.size)
    for i, (slot, record) in enumerate(layout.entries):
        place = index[slot.name]
        places[i] = place if record is None else place + record * each
        if record is not None:
            sizes[i] = unknowns.size[place - number]
    return places, sizes
