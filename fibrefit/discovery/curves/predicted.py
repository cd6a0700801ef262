"""What slopes predict of free curves: which of them are worth drawing, before any is fitted."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import cache, partial
from itertools import chain, zip_longest
from typing import NamedTuple

import numpy as np

from fibrefit.discovery.curves.probes import PROBES, Curve
from fibrefit.discovery.curves.variables import in_motion, range_of
from fibrefit.discovery.engine.candidates import fit_all, transferred
from fibrefit.discovery.engine.journal import digest
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.priors import Heights
from fibrefit.discovery.engine.secant import SecantGram, Seed
from fibrefit.discovery.engine.supermodel import Supermodel, supermodel_of
from fibrefit.discovery.search.search import Search
from fibrefit.fitting.result import Identification
from fibrefit.laws.catalogue import HasCapabilities, suits
from fibrefit.laws.ports import port_of

WALKS = (0.03, 0.3)
"""Standard deviations of the difference of neighbouring heights, in units of what is usual: each as probable."""


class PromisedCurve(NamedTuple):
    """What slopes predict of a probe at its best roughness, in nats, what it begins with, and their products there."""

    gain: float
    probe: type[Curve]
    curve: Heights
    supermodel: Supermodel
    start: np.ndarray
    products: Callable[[], SecantGram]


class Looks(NamedTuple):
    """Probes that suit a rig and a motion, what slopes predict of each, and the ranges of their variables."""

    probes: Sequence[type[Curve]]
    predicted: Sequence[PromisedCurve]
    ranges: dict[str, tuple[float, float]]

    @property
    def promise(self) -> float:
        """What slopes predict of the best one, in nats, their number paid for."""
        return max((one.gain for one in self.predicted), default=-np.inf) - self.price

    def joined(self, other: Looks) -> Looks:
        """These and others."""
        return Looks((*self.probes, *other.probes), (*self.predicted, *other.predicted), self.ranges | other.ranges)

    @property
    def price(self) -> float:
        """Nats: which curve it is was not known beforehand, and neither was its roughness."""
        return float(np.log(max(len(self.probes), 1) * len(WALKS)))


def look_at(
    search: Search, parent: LaplaceFit, found: Identification, ports: Collection[str], *asked: Sequence[type[Curve]]
) -> Looks:
    """What slopes of a hypothesis predict of free curves on top of it.

    Parameters
    ----------
    search : Search
    parent : LaplaceFit
    found : Identification
        Of the model before the search: its motion tells the range of each variable.
    ports : collection of str
        Where the curves act.
    *asked : sequence of Curve class
        Those over a state unless said. The probes of each are simulated together; programs of several are compiled side
        by side.
    """
    ranges = {variable: range_of(variable, values) for variable, (values, _) in in_motion(found).items()}
    # Where a variable keeps its value nearly always, as the speed of a drive that rests, there is no curve over it.
    ranges = {variable: (low, high) for variable, (low, high) in ranges.items() if high > low}
    sets = probe_sets(found.problem.model.rig, ranges, ports, asked or (PROBES,))
    jobs = []
    for probes in sets:
        supermodel = supermodel_of(search.task, (*parent.effects, *probes), parent.supermodel.sensitivities)
        begun = supermodel, _prepared(supermodel, parent, probes, ranges), search.inference.slopes(parent)
        jobs.append([partial(_predicted, search, parent, probe, begun) for probe in probes])
    # In turns, as the first of each set compiles its program.
    in_turns = [job for turn in zip_longest(*jobs) for job in turn if job is not None]
    predicted = fit_all(in_turns, lambda done: None)
    return Looks(list(chain(*sets)), [one for one in predicted if one is not None], ranges)


def probe_sets(
    rig: HasCapabilities, variables: Collection[str], ports: Collection[str], asked: Sequence[Sequence[type[Curve]]]
) -> list[list[type[Curve]]]:
    """Those of each of some sets of probes that suit a rig, over some variables and at some ports."""
    fits = lambda one: one.variable in variables and suits(one, rig) and port_of(one) in ports  # noqa: E731
    return [probes for some in asked if (probes := list(filter(fits, some)))]


def _predicted(
    search: Search, parent: LaplaceFit, probe: type[Curve], begun: tuple[Supermodel, np.ndarray, Seed]
) -> PromisedCurve:
    """A probe at its best roughness.

    A curve of no height is its parent: of the slopes, only those along the heights are simulated.
    """
    (supermodel, start, slopes), inference = begun, search.inference
    names = tuple(f"{probe.name}.{height}" for height in probe.heights)
    curves = [Heights(names, probe.size, walk) for walk in WALKS]

    @cache  # Where a search that goes on knows what they predict, slopes are simulated only to follow the curve.
    def weighed() -> tuple[list[float], SecantGram]:
        gram = inference.secant(supermodel, slopes)
        return [inference.predicted_evidence(curve, parent, supermodel, start, gram) for curve in curves], gram

    about = probe.name, [effect.name for effect in supermodel.effects], digest(start)
    logs = search.recalled("predicted curve", parent, about, lambda: weighed()[0])()
    best = int(np.argmax(np.where(np.isfinite(logs), logs, -np.inf)))
    return PromisedCurve(float(logs[best]) - parent.log, probe, curves[best], supermodel, start, lambda: weighed()[1])


def _prepared(
    supermodel: Supermodel, parent: LaplaceFit, probes: Sequence[type[Curve]], ranges: dict[str, tuple[float, float]]
) -> np.ndarray:
    values = transferred(supermodel, parent.supermodel, parent.local)
    for probe in probes:
        for name in probe.heights:
            values[:, supermodel.names.index(f"{probe.name}.{name}")] = 0.0
        for name, limit in zip(("low", "high"), ranges[probe.variable], strict=True):
            values[:, supermodel.names.index(f"{probe.name}.{name}")] = limit
    return values
