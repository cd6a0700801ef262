"""Faults in what a study states: a force whose zero is off, and one thing more that explains the records.

A fit that leaves more than noise, or a flight that falls as it should not, lacks something; whether its values are of
use all the same nobody knows who does not know what. Some laws are known to be taken up by other values, and a fault in
what is stated is one number: clock, scale, slope, height, mass. Which of them a fit is held against their entries in
the catalogue say (`alternative`). Fitted beside the others, one either leaves nothing but noise, and then it explains
the records as the truth does, or it does not. Where it does, what it makes of the values is what they may be off by.

Law
---
Least squares in the values and the parameters of one law each, from where plain least squares ended, over the horizons
of a search. Of those that leave but noise the one with the least ``chi^2 + k ln n``, k being its parameters.

Source
------
Schwarz, Ann. Statist. 6 (1978): models of several sizes compared.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fibrefit.core.declarations import Capability
from fibrefit.fitting.result import Found
from fibrefit.fitting.search.solve import linearised
from fibrefit.fitting.thresholds import (
    ALIKE_EVIDENCE,
    CHANCE,
    LOUDEST,
    NO_FACTOR,
    REMAINING,
    ZERO_SHARE,
)
from fibrefit.fitting.uncertainty import MEMORY
from fibrefit.laws.catalogue import CATALOGUE, is_alternative, look_alikes
from fibrefit.laws.law import Effect, FibreLaw, SensorLaw, StudyLaw
from fibrefit.problem import (
    GAP_OF_NOISE,
    ROUGH_TOLERANCE,
    Effort,
    Layout,
    Problem,
    Range,
    Task,
    Unknowns,
    View,
    first_size,
    mode,
)
from fibrefit.rigs.signals.rest import rests
from fibrefit.rigs.thresholds import SHORTEST_REST

FOUND_BY = ("sensor.force_offset", "sensor.force_drift")
"""Effects by which a model finds the zero itself."""


class SlackZero(NamedTuple):
    """What the force of a record reads while its fibre is slack, and its error, in N."""

    record: str
    zero: float
    error: float


def slack_zeros(task: Task) -> Found | None:
    """The records whose force has a zero that is surely off; None where there is none, or nobody can tell.

    Nothing pulls at the gauge before the release, so that the mean of what it reads is its zero. Noise moves that mean
    by as much as the means of pieces of the rest differ, slow noise by no more than its size over the record.
    """
    model = task.problem.model
    found_too = any(effect.name in FOUND_BY for effect in model.effects)
    if found_too or Capability.FALL not in model.rig.capabilities or "force" not in model.rig.channels:
        return None
    zeros: list[SlackZero] = []
    worst: tuple[float, float] = (-math.inf, 0.0)
    for trace in task.traces:
        force, noise = trace.channels["force"], task.noise["force"]
        held = np.concatenate([np.zeros(0), *(force[rest] for rest in rests(trace) if rest.start == 0)])
        held = held[np.isfinite(held)]
        if len(held) < SHORTEST_REST:
            continue
        pieces = round(1.0 / MEMORY)
        means = [float(piece.mean()) for piece in np.array_split(held, pieces)]
        zero, error = float(np.mean(means)), float(np.std(means, ddof=1)) / np.sqrt(pieces)
        most = zero_allowed(noise.rms(trace.duration, trace.rate), float(np.nanmax(np.abs(force))))
        beyond = abs(zero) - CHANCE * error
        if beyond > most:
            zeros.append(SlackZero(trace.name, zero, error))
            worst = max(worst, (beyond, most), key=lambda one: one[0] - one[1])
    beyond, most = worst
    return Found(beyond, {"zeros": tuple(zeros)}, False, {"threshold": most}) if zeros else None


def zero_allowed(noise: float, largest: float) -> float:
    """How far a zero may be off beside noise and the largest reading of a force, all in N.

    Slow noise moves the mean of a rest by no more than its size, and a zero within it moves no value by what is seen.
    """
    return max(noise, ZERO_SHARE * largest)


PATIENCE_PER_HORIZON = 10
"""Evaluations of a horizon after which more is left than any noise leaves: from there a descent creeps among kinks.
Of 56 descents of the tests' series that end near noise (1.3) with forty of them, 54 do with ten; what is told is the
same."""


class Misstated(NamedTuple):
    """A fault in what a study states, by its law, with its size in SI units."""

    effect: str
    size: float
    unit: str


class Alternative(NamedTuple):
    """A law with which a model leaves but noise, and the value that it changes most.

    Parameters
    ----------
    size, unit : float, str
        Its first parameter, in SI units.
    name, value_unit : str
        Of the value.
    value, without : float in SI units
        As it was found, and as it would be with the law taken off.
    factor : float
        By which the two differ, 1 or more.
    alike : tuple of Misstated
        Other faults in what a study states that explain the records alike.
    """

    effect: str
    size: float
    unit: str
    name: str
    value_unit: str
    value: float
    without: float
    factor: float
    alike: tuple[Misstated, ...] = ()


def best_alternative(task: Task, values: np.ndarray) -> Alternative | None:
    """The law beside those of the model that explains records best; None where none leaves nothing but noise.

    Parameters
    ----------
    task : Task
        Inputs are taken as measured: their errors, let free, take up much of what a model lacks.
    values : (n_free,) in SI units
        The best ones.
    """
    before, _ = _left(task.problem, values)
    # Laws that share a program: whatever the readings go through, whatever acts; one with a memory by itself.
    groups: dict[str, list[type[Effect]]] = {}
    for law in CATALOGUE.values():
        if law not in task.problem.model.effects and is_alternative(law, task.problem.model.rig):
            of_readings, remembers = issubclass(law, StudyLaw | SensorLaw), issubclass(law, FibreLaw) and law.memory
            groups.setdefault("readings" if of_readings else law.name if remembers else "motion", []).append(law)
    tried = (one for group in groups.values() for one in _explanations(task, values, group))
    found = [one for one in tried if is_noise(one.left, before)]
    if not found:
        return None
    best = min(found, key=lambda one: one.evidence)
    # Other faults explain the records as the best one does by what they leave, or by the catalogue.
    others: dict[str, Misstated] = {}
    for one in sorted(found, key=lambda one: one.evidence) if issubclass(best.law, StudyLaw | SensorLaw) else ():
        close = explains_alike(one.evidence, best.evidence) or one.law.name in look_alikes(best.law)
        if one.law is not best.law and close and issubclass(one.law, StudyLaw | SensorLaw):
            others.setdefault(one.law.name, Misstated(one.law.name, one.size, one.law.parameters[0].unit))
    return best.most_changed(task.problem.layout, values)._replace(alike=tuple(others.values()))


def explains_alike(evidence: float, best: float) -> bool:
    """Whether a fault explains records as the best one does, by what each leaves."""
    return evidence - best <= ALIKE_EVIDENCE


def is_noise(left: float, before: float) -> bool:
    """Whether a model leaves but noise, of what was left before it: that of a motion may be louder than that of a rest.

    Parameters
    ----------
    left, before : float
        Normalised rms.
    """
    return left <= LOUDEST and left**2 - 1.0 <= max(GAP_OF_NOISE**2 - 1.0, REMAINING * (before**2 - 1.0))


class _Explained(NamedTuple):
    """A law with its size, the largest normalised rms it leaves in a channel, and the values without the law.

    `evidence` is what it leaves of all channels, with a price for its parameters.
    """

    law: type[Effect]
    size: float
    left: float
    evidence: float
    values: np.ndarray

    def most_changed(self, layout: Layout, values: np.ndarray) -> Alternative:
        """With the value that differs by the largest factor; those that may have either sign have none."""
        parameter, worst, factor = self.law.parameters[0], 0, 0.0
        for i, (slot, record) in enumerate(layout.entries):
            if record is None and slot.range.lower >= 0.0:
                one, other = sorted(max(abs(float(v[i])), NO_FACTOR * slot.range.scale) for v in (values, self.values))
                if other / one > factor:
                    worst, factor = i, other / one
        slot = layout.entries[worst][0]
        sizes = float(values[worst]), float(self.values[worst])
        return Alternative(self.law.name, self.size, parameter.unit, slot.name, slot.unit, *sizes, factor)


def _explanations(task: Task, values: np.ndarray, laws: Sequence[type[Effect]]) -> Iterator[_Explained]:
    """Each of some laws that share a program, one value each for all records, where a descent with it ends."""
    old, model = task.problem.layout, replace(task.problem.model, effects=(*task.problem.model.effects, *laws))
    # What was stated may be off by more than a search would look for.
    unlimited = lambda parameter: replace(Range.of(parameter), lower=-math.inf, upper=math.inf)  # noqa: E731
    problem = replace(task.problem, model=model, layout=old.of_parameters(model.parameters, unlimited))
    # With all laws at nothing: of no strength, their shapes usual ones, as a shape of 0 may divide by it.
    local = np.asarray(old.local(values))
    named: dict[str, float | np.ndarray] = {name: local[:, j] for j, name in enumerate(old.names)}
    for law in laws:
        named |= {f"{law.name}.{p.name}": p.null if p.name in law.strength else first_size(p) for p in law.parameters}
    nothing, free = problem.layout.pack(named), problem.layout.free_names
    kept = np.array([free.index(name) for name in old.free_names])
    places = {law: [free.index(f"{law.name}.{p.name}") for p in law.parameters] for law in laws}
    for law, own in places.items():
        others = np.array([place for other in laws if other is not law for place in places[other]], dtype=int)
        start = nothing.copy()
        start[own] = [first_size(p) for p in law.parameters]
        for way in task.horizons:
            there = _through(problem, way, start, others)
            if there is not None:
                left, evidence = _left(problem, there)
                price = len(own) * math.log(problem.n_measured)
                yield _Explained(law, float(there[own[0]]), left, evidence + price, there[kept])


def _through(problem: Problem, way: np.ndarray, start: np.ndarray, held: np.ndarray) -> np.ndarray | None:
    """Values ``(n_free,)`` where a descent ends that goes through horizons ``(n_stage, n_record)``.

    What a contact teaches times the next. None where a horizon leaves twice what noise may be: the whole leaves more.
    """
    layout, nothing = problem.layout, np.zeros(0)
    unknowns = Unknowns.of_fit(layout, start, np.full(layout.size, np.inf))
    place = unknowns.place_of(layout.local(start))
    unknowns = unknowns.fixed_at(unknowns.places_in(layout)[0][held], place.z)
    for counts in way:
        samples = float(counts.sum()) * len(problem.model.rig.channels)
        effort = Effort(patience=PATIENCE_PER_HORIZON, worthless=LOUDEST**2 * samples)
        end = mode(unknowns, place, View(problem.until(counts)).gram(unknowns), nothing, ROUGH_TOLERANCE, effort)
        if not end.normal.cost <= (2.0 * LOUDEST) ** 2 * samples:
            return None
        place = end.place
    return unknowns.free_values(layout, unknowns.value(place.z), place.own)


def _left(problem: Problem, values: np.ndarray) -> tuple[float, float]:
    """Largest normalised rms of a channel, and the sum of squares of all."""
    squares = np.square(linearised(problem, problem.layout.local(values)).residuals)
    counted = np.maximum(np.count_nonzero(squares, axis=(0, 2)), 1)
    return float(np.sqrt(np.max(np.sum(squares, axis=(0, 2)) / counted))), float(np.sum(squares))
