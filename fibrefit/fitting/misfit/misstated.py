"""What the values would be if something that a study states were otherwise: clock, scales, slope, height, mass.

A fit that leaves more than noise, or a flight that falls as it should not, shows a fault; whether the values are of use
all the same nobody knows who does not know the fault. A fault in what is stated is one number. Fitted beside the
others, it either leaves nothing but noise, and then it explains the records as the truth does, or it does not. Where it
does, what it makes of the values is what they are off by.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fibrefit.core.capability import Capability
from fibrefit.core.parameter import Parameter
from fibrefit.fitting.search.solve import linearised
from fibrefit.fitting.thresholds import FACTOR, LOUDEST, REMAINING, SMALL
from fibrefit.laws.catalogue import CATALOGUE, suits
from fibrefit.laws.law import Effect
from fibrefit.problem.estimate.gauss_newton import mode
from fibrefit.problem.estimate.normal_equations import place_of
from fibrefit.problem.estimate.unknowns import fit_unknowns, free_values, places_of
from fibrefit.problem.estimate.view import ROUGH, View
from fibrefit.problem.formulate.formulate import first_size
from fibrefit.problem.statement.layout import Layout, Slot
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.statement.transform import Range
from fibrefit.problem.task import Task
from fibrefit.problem.thresholds import GAP

STATED = ("study.clock", "study.inclination", "study.lift", "study.weight_mass", "sensor.position_gain",
          "sensor.force_gain", "sensor.force_delay")  # fmt: skip
"""Laws of one number that a study states, or that it does by silence: that channels are true and of the same time."""
LACKED = (
    ("fibre.maxwell_branch",),
    ("guide.viscous_friction", "guide.load_dependent_friction", "fibre.rate_dependent_damping", "fibre.hardening"),
)
"""Laws whose force another value takes over where the model lacks them, in groups that share a program: a fibre with a
memory has one of its own."""


class Misstated(NamedTuple):
    """A fault in what is stated that explains the records, and the value that it changes most.

    Parameters
    ----------
    effect : str
        Law of the fault.
    size, unit : float, str
        What it comes to, in SI units.
    name, value_unit : str
        Of the value.
    value, without : float in SI units
        As it was found, and as it would be without the fault.
    factor : float
        By which the two differ, 1 or more.
    """

    effect: str
    size: float
    unit: str
    name: str
    value_unit: str
    value: float
    without: float
    factor: float


def misstated(task: Task, values: np.ndarray) -> Misstated | None:
    """The fault that explains drops best; None where none leaves nothing but noise, and on other rigs.

    Parameters
    ----------
    task : Task
        Of exact inputs.
    values : (n_free,) in SI units
        The best ones of plain least squares.

    Law
    ---
    Least squares in the values and one more number each, from where plain least squares ended.
    """
    if Capability.FALL not in task.problem.model.rig.capabilities:
        return None
    return _best_of(task, values, (STATED,))


def lacked(task: Task, values: np.ndarray) -> Misstated | None:
    """The law beside those of the model that explains drops best, if a value is another by a factor with it.

    Parameters
    ----------
    task : Task
        Of exact inputs.
    values : (n_free,) in SI units
        The best ones of plain least squares.

    Law
    ---
    As `misstated`, from a tenth of the law's typical size.
    """
    if Capability.FALL not in task.problem.model.rig.capabilities:
        return None
    found = _best_of(task, values, LACKED)
    return found if found is not None and found.factor > FACTOR else None


def _best_of(task: Task, values: np.ndarray, groups: Sequence[Sequence[str]]) -> Misstated | None:
    """The one law that leaves least, of those that leave but noise."""
    before = _left(task.problem, values)
    tried = (one for group in groups for one in _explanations(task, values, group))
    found = [one for one in tried if is_noise(one.left, before)]
    return min(found, key=lambda one: one.left).most_changed(task.problem.layout, values) if found else None


def is_noise(left: float, before: float) -> bool:
    """Whether a model leaves but noise, of what was left before it: that of a motion may be louder than that of a rest.

    Parameters
    ----------
    left, before : float
        Normalised rms.
    """
    return left <= LOUDEST and left**2 - 1.0 <= max(GAP**2 - 1.0, REMAINING * (before**2 - 1.0))


class _Explained(NamedTuple):
    """A fault with its size, the largest normalised rms it leaves in a channel, and the values without the fault."""

    law: type[Effect]
    size: float
    left: float
    values: np.ndarray

    def most_changed(self, layout: Layout, values: np.ndarray) -> Misstated:
        """With the value that differs by the largest factor; those that may have either sign have none."""
        parameter, worst, factor = self.law.parameters[0], 0, 0.0
        for i, (slot, record) in enumerate(layout.entries):
            if record is None and slot.range.lower >= 0.0:
                one, other = sorted(max(abs(float(v[i])), SMALL * slot.range.scale) for v in (values, self.values))
                if other / one > factor:
                    worst, factor = i, other / one
        slot = layout.entries[worst][0]
        sizes = float(values[worst]), float(self.values[worst])
        return Misstated(self.law.name, self.size, parameter.unit, slot.name, slot.unit, *sizes, factor)


def _explanations(task: Task, values: np.ndarray, names: Sequence[str]) -> Iterator[_Explained]:
    known = task.problem.model.effects
    laws = [CATALOGUE[name] for name in names if suits(CATALOGUE[name], task.problem.model.rig)]
    laws = [law for law in laws if law not in known]
    if not laws:
        return
    problem = _with(task.problem, laws)
    nothing, free = _beside(task.problem.layout, values, problem.layout, laws), problem.layout.free_names
    kept = np.array([free.index(name) for name in task.problem.layout.free_names])
    places = {law: [free.index(f"{law.name}.{p.name}") for p in law.parameters] for law in laws}
    for law, own in places.items():
        others = np.array([place for other in laws if other is not law for place in places[other]], dtype=int)
        start = nothing.copy()
        if law.name not in STATED:
            start[own] = [first_size(p) for p in law.parameters]
        for way in task.horizons:
            there = _through(problem, way, start, others)
            if there is not None:
                yield _Explained(law, float(there[own[0]]), _left(problem, there), there[kept])


def _with(problem: Problem, laws: Sequence[type[Effect]]) -> Problem:
    """A problem whose model has further effects, one value each for all records."""
    model = replace(problem.model, effects=(*problem.model.effects, *laws))
    known = {slot.name: slot for slot in problem.layout.slots}
    slots = [known.get(p.name) or Slot(p.name, p.unit, _unlimited(p)) for p in model.parameters]
    slots += [slot for slot in problem.layout.slots if slot.name not in {p.name for p in model.parameters}]
    return replace(problem, model=model, layout=Layout(tuple(slots), problem.layout.records))


def _unlimited(parameter: Parameter) -> Range:
    """What was stated may be off by more than a search would look for."""
    return replace(Range.of(parameter), lower=-math.inf, upper=math.inf)


def _beside(old: Layout, values: np.ndarray, new: Layout, laws: Sequence[type[Effect]]) -> np.ndarray:
    local = np.asarray(old.local(values))
    named: dict[str, float | np.ndarray] = {name: local[:, j] for j, name in enumerate(old.names)}
    return new.pack(named | {f"{law.name}.{p.name}": p.null for law in laws for p in law.parameters})


def _through(problem: Problem, way: np.ndarray, start: np.ndarray, held: np.ndarray) -> np.ndarray | None:
    """Values ``(n_free,)`` where a descent ends that goes through horizons ``(n_stage, n_record)``.

    What a contact teaches times the next. None where a horizon leaves twice what noise may be: the whole leaves more.
    """
    layout, nothing = problem.layout, np.zeros(0)
    unknowns = fit_unknowns(layout, start, np.full(layout.size, np.inf))
    place = place_of(unknowns, layout.local(start))
    unknowns = unknowns.holding(places_of(layout, unknowns)[0][held], place.z)
    for counts in way:
        end = mode(unknowns, place, View(problem.until(counts)).gram(unknowns), nothing, ROUGH)
        if not end.normal.cost <= (2.0 * LOUDEST) ** 2 * counts.sum() * len(problem.model.rig.channels):
            return None
        place = end.place
    return free_values(layout, unknowns, unknowns.value(place.z), place.own)


def _left(problem: Problem, values: np.ndarray) -> float:
    """Largest normalised rms of a channel."""
    residuals = linearised(problem, values).residuals
    counted = np.maximum(np.count_nonzero(residuals, axis=(0, 2)), 1)
    return float(np.sqrt(np.max(np.sum(residuals**2, axis=(0, 2)) / counted)))
