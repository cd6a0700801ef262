"""What is unknown when effects are on, and what is believed of it before the records speak."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fibrefit.core.declarations import Parameter
from fibrefit.discovery.engine.candidates import SearchContext
from fibrefit.discovery.engine.supermodel import Supermodel
from fibrefit.discovery.engine.thresholds import VANISHES
from fibrefit.laws.law import Effect
from fibrefit.problem import Place, Slot, Unknowns

BASE_SD, SHAPE_SD, STRENGTH_SD = 1.0, 1.5, 1.0
"""Priors: of the logarithm of a base parameter about the first fit, of the logarithm of a shape about its typical size,
and of a strength in units of its typical size."""
FURTHEST = 12.0
"""Logarithm of the largest factor by which a base parameter may move."""


class Heights(NamedTuple):
    """Heights of a curve among the unknowns, and how much neighbours may differ.

    Parameters
    ----------
    names : tuple of str
    size : float
        Unit of the heights, in SI units.
    walk : float
        Standard deviation of the difference of neighbours, in that unit.
    """

    names: tuple[str, ...]
    size: float
    walk: float

    def precision(self) -> np.ndarray:
        """Prior of the heights ``(n, n)``, which regularises them: a random walk whose level is all but free."""
        steps = np.diff(np.eye(len(self.names)), axis=0) / self.walk
        return steps.T @ steps + np.eye(len(self.names)) / (LEVEL_SD**2 * len(self.names))


LEVEL_SD = 10.0
"""Of the mean height of a curve, in units of what is usual: all but free, as base parameters take it up."""


def unknowns_of(
    supermodel: Supermodel,
    context: SearchContext,
    effects: Iterable[type[Effect]],
    reference: dict[str, float],
    curve: Heights | None = None,
) -> Unknowns:
    """What is unknown when effects are on, and the priors.

    Parameters
    ----------
    supermodel : Supermodel
    context : SearchContext
    effects : iterable of Effect classes
    reference : mapping of name to float
        Base parameters of the first fit, in SI units.
    curve : Heights, optional
        Of a probe on top of them.
    """
    subset = context.subset(effects)
    slots = {slot.name: slot for slot in supermodel.problem.layout.slots}
    rows = [_line(supermodel.declared[name], slots[name], reference.get(name), effects) for name in subset.shared]
    if curve is not None:
        subset = replace(subset, shared=subset.shared + curve.names)
        rows += [(False, 0.0, curve.size, 0.0, np.inf, -np.inf, np.inf)] * len(curve.names)
    log, middle, scale, mean, sd, lower, upper = (
        np.array([row[i] for row in rows], dtype=kind)
        for i, kind in enumerate((bool, float, float, float, float, float, float))
    )
    precision = np.diag(sd**-2.0)
    if curve is not None:
        precision[-len(curve.names) :, -len(curve.names) :] = curve.precision()
    relative = np.array([supermodel.declared[name].relative for name in subset.shared], dtype=bool)
    base = np.array([name in context.scattering for name in subset.shared], dtype=bool)
    index = {name: i for i, name in enumerate(supermodel.names)}
    layout = supermodel.problem.layout
    free = np.array(
        [[slots[name].fixed_in(r) is None for name in subset.each] for r in range(len(layout.records))], dtype=bool
    ).reshape(len(layout.records), len(subset.each))
    return Unknowns(
        names=(*subset.shared, *subset.each),
        shared=np.array([index[name] for name in subset.shared], dtype=int),
        each=np.array([index[name] for name in subset.each], dtype=int),
        free=free,
        scattering=np.flatnonzero(base & log),
        log=log,
        reference=middle,
        scale=scale,
        mean=mean,
        precision=precision,
        lower=lower,
        upper=upper,
        size=supermodel.sizes(subset.each),
        offset=np.where(log & relative, 1.0, 0.0),
    )


def with_held(unknowns: Unknowns, place: Place, names: Iterable[str]) -> Unknowns:
    """The same with some shared values held where they are at a place."""
    return unknowns.fixed_at(np.flatnonzero(np.isin(unknowns.names[: len(unknowns.shared)], list(names))), place.z)


def _line(declared: Parameter, slot: Slot, reference: float | None, effects: Iterable[type[Effect]]) -> tuple:
    """Row of `Unknowns`: log, reference, scale, mean, sd, lower, upper."""
    # Limits that a study sets are kept; whether a value is logarithmic is what it is.
    name, low, high = slot.name, slot.range.lower, slot.range.upper
    strengths = {f"{effect.name}.{each}" for effect in effects for each in effect.strength}
    typical = declared.typical
    if reference is not None:
        if declared.lower >= 0.0 and reference > VANISHES * abs(typical) and (slot.belief is None or slot.belief.log):
            limits = [max(-FURTHEST, _log(low / reference)), min(FURTHEST, _log(high / reference))]
            prior = slot.belief.of_coordinate(True, reference, 1.0) if slot.belief else (0.0, BASE_SD)
            return True, reference, 1.0, *prior, *limits
        size = max(abs(typical), abs(reference))
        limits = [(low - reference) / size, (high - reference) / size]
        prior = slot.belief.of_coordinate(False, reference, size) if slot.belief else (0.0, BASE_SD)
        return False, reference, size, *prior, *limits
    spans = declared.log or declared.reciprocal or (declared.unit == "Hz" and declared.lower >= 0.0)
    if spans:
        return True, typical, 1.0, 0.0, SHAPE_SD, _log(low / typical), _log(high / typical)
    if declared.relative:
        return True, 1.0, 1.0, 0.0, np.log1p(typical), np.log1p(low), np.log1p(high)
    null = declared.null if name in strengths else typical
    scale = typical - null if name in strengths else (declared.spread or abs(typical) or 1.0)
    ends = sorted([(low - null) / scale, (high - null) / scale])
    return False, null, scale, 0.0, STRENGTH_SD, *ends


def _log(ratio: float) -> float:
    with np.errstate(divide="ignore"):
        return float(np.log(max(ratio, 0.0)))
