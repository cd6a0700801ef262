"""The search for laws of speed: each is followed from the data themselves, over horizons that grow.

A law that matters moves every bounce, so that the best fit without it is no place to begin: where that leaves much,
each strength of a law begins with the values that the records suggest, and with the first contact of each.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np

from fibrefit.core.parameter import Parameter
from fibrefit.discovery.engine.candidates import absent_values, carried, fit_all
from fibrefit.discovery.engine.effort import astray, slopes_tell
from fibrefit.discovery.engine.refit import Refit, refit
from fibrefit.discovery.engine.supermodel import Supermodel, supermodel_of
from fibrefit.discovery.engine.weighed import Weighed
from fibrefit.discovery.search.search import Search, Tried
from fibrefit.laws.law import Effect
from fibrefit.series.together.laws import parameter_of

STRENGTHS = (-3.0, -1.0, 1.0, 3.0)
"""Where the strength of a law begins in a model that lacks much, in units of its typical size."""
WEAK = (-0.1, 0.1)
"""The same in a model that is nearly right."""
SCOUTING = 8
"""Steps each start is given before the best ones go on."""
FINALISTS = 2


@dataclass(frozen=True)
class SpeedSearch(Search):
    """A search whose candidates are laws of speed, at most one for each parameter."""

    @classmethod
    def of(cls, search: Search) -> SpeedSearch:
        """The same search with this way to try candidates."""
        return cls(**{name: getattr(search, name) for name in Search.__dataclass_fields__})

    def extensions(self, parent: Weighed) -> tuple[type[Effect], ...]:
        """Laws of parameters that have none yet."""
        taken = {parameter_of(effect) for effect in (*self.task.problem.model.effects, *parent.effects)}
        return tuple(effect for effect in self.effects if parameter_of(effect) not in taken)

    def supermodel_for(self, effect: type[Effect], kin: Sequence[type[Effect]] = ()) -> Supermodel:
        """The one frame that holds all laws: they are few and quick, and one program serves every round."""
        with self.lock:
            for frame in self.frames:
                if frame.holds(self.effects) and frame.sensitivities is self.base.frame.sensitivities:
                    return frame
            self.frames.append(supermodel_of(self.task, self.effects, self.base.frame.sensitivities))
            return self.frames[-1]

    def tried(self, parent: Weighed, effects: Sequence[type[Effect]], what: str, least: float = -np.inf) -> Tried:
        """A parent with each of some laws, as far as the time goes."""
        far = not slopes_tell(self.gap(self.plain(parent)))
        jobs = [partial(self._with_law, parent, effect, far) for effect in effects]
        found = fit_all(jobs, lambda done: self.tell(what, done / max(len(jobs), 1)))
        missed = tuple(effect for effect, one in zip(effects, found, strict=True) if one is None)
        ends = [one for one in found if one is not None and np.isfinite(one.log)]
        return Tried(sorted(ends, key=lambda one: -one.log), missed)

    def _with_law(self, parent: Weighed, effect: type[Effect], far: bool) -> Weighed:
        """A parent with one law, from the best of its starts."""
        frame, effects = self.supermodel_for(effect), (*parent.effects, effect)
        near = carried(frame, absent_values(frame, len(parent.local)), parent.frame, parent.local)
        ends = [self._scouted(frame, effects, start) for start in _starts(frame, near, effect, WEAK)]
        if far:
            ends += [self._from_data(frame, effects, start) for start in _starts(frame, near, effect, STRENGTHS)]
        best = sorted(ends, key=lambda end: end.cost)[:FINALISTS]
        subset, whole = self.context.subset(effects), self.context.whole
        fits = [refit(frame, subset, end.local, whole) for end in best]
        found = self.scales.weigh(frame, effects, min(fits, key=lambda fit: fit.cost).local)
        if not astray(found.log, parent.log):
            return found
        # What contains its parent is no less probable than that by much: it begins from there.
        again = self.scales.weigh(frame, effects, near, parent.evidence.mode.sigma, parent.evidence.mode.place.eta)
        return max(found, again, key=lambda one: one.log)

    def _scouted(self, frame: Supermodel, effects: tuple[type[Effect], ...], start: np.ndarray) -> Refit:
        return refit(frame, self.context.subset(effects), start, self.context.whole, SCOUTING, 1e-3)

    def _from_data(self, frame: Supermodel, effects: tuple[type[Effect], ...], start: np.ndarray) -> Refit:
        """A refit over growing horizons from what the data suggest of the base parameters."""
        local = start.copy()
        for name, column in self.context.data_start.items():
            local[:, frame.names.index(name)] = column
        for counts in self.context.counts[:-1]:
            local = refit(frame, self.context.subset(effects), local, counts, SCOUTING, 1e-2).local
        return self._scouted(frame, effects, local)


def _starts(
    frame: Supermodel, before: np.ndarray, effect: type[Effect], strengths: Sequence[float]
) -> list[np.ndarray]:
    """Values with a law at each of some strengths, its shape as usual."""
    choices = [_sizes(effect, parameter, strengths) for parameter in effect.parameters]
    starts = []
    for sizes in product(*choices):
        values = before.copy()
        for parameter, size in zip(effect.parameters, sizes, strict=True):
            values[:, frame.names.index(f"{effect.name}.{parameter.name}")] = size
        starts.append(values)
    return starts


def _sizes(effect: type[Effect], parameter: Parameter, strengths: Sequence[float]) -> list[float]:
    if parameter.name not in effect.strength:
        return [parameter.typical]
    sizes = [parameter.null + s * (parameter.typical - parameter.null) for s in strengths]
    return list(dict.fromkeys(float(np.clip(size, parameter.lower, parameter.upper)) for size in sizes))
