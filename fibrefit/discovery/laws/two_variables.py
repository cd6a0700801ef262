"""Laws of two variables: a law that holds and leaves more than noise may change with something else, too.

It is multiplied by one and a relative change in proportion to another variable that is known where it acts: the
direction, the speed, the tension, the time in a record, the order of the record. Each is fitted in full in the
likelihood of the search, from the law by itself, and how many were looked at is paid for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from fibrefit.discovery.curves.free_form import FittedCurve
from fibrefit.discovery.curves.probes import Curve
from fibrefit.discovery.curves.variables import in_motion
from fibrefit.discovery.engine.candidates import fit_all, transferred
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.supermodel import supermodel_of
from fibrefit.discovery.engine.thresholds import NAMED
from fibrefit.discovery.laws.places import SECOND, second_variables
from fibrefit.discovery.laws.source import Composed, composed, effect_of_law
from fibrefit.discovery.search.search import Search
from fibrefit.fitting.result import Identification

CHANGED = 2
"""Curves whose best law is looked at: one over another variable often does nearly as well, and every second variable
takes a fit."""


def price_of_second(law: Composed) -> float:
    """Nats: any variable that its place knows could have been the second one; none where it has none."""
    return 0.0 if law.second is None else math.log(len(second_variables(law.probe)))


Ranked = Sequence[tuple[LaplaceFit, Composed]]
"""Models with a law each, the most probable first."""


def with_second_variables(
    search: Search, before: Identification, parent: LaplaceFit, ranked: Ranked, curves: Sequence[FittedCurve]
) -> Ranked:
    """Laws of one variable, and those of two that gain more than chance over theirs.

    Parameters
    ----------
    search : Search
    before : Identification
        Of the model the search began with: its motion tells how far a variable goes.
    parent : LaplaceFit
        The model that lacks something.
    ranked : sequence of (LaplaceFit, Composed)
        It with laws of one variable. The best one of each curve is looked at, of some curves.
    curves : sequence of FittedCurve
        The curves that they stand for.
    """
    search.tell("looking for a second variable of the law", None)
    best = dict[type[Curve], tuple[LaplaceFit, Composed]]()
    for fit, law in ranked:
        best.setdefault(law.probe, (fit, law))
    first = list(best.values())[:CHANGED]
    knots, spans = {one.probe: one.knots for one in curves}, _spans(search, before)
    taken = {effect.name for effect in (*search.task.problem.model.effects, *parent.effects)}
    jobs, told = [], []
    for fit, law in first:
        for second in second_variables(law.probe):
            if (span := spans.get(second.variable, 0.0)) > 0.0:
                changing = composed(law.probe, law.fitted, knots[law.probe], taken, second, span)
                # One by one: laws that change with time take longer to simulate than the others.
                jobs.append(partial(_fitted, search, fit, law, changing))
                told.append((changing, fit.log + NAMED + price_of_second(changing)))
    ends = fit_all(jobs, lambda done: None)
    better = [
        (end, law)
        for end, (law, enough) in zip(ends, told, strict=True)
        if end is not None and np.isfinite(end.log) and end.log > enough
    ]
    return sorted((*better, *ranked), key=lambda pair: -pair[0].log)


def _spans(search: Search, before: Identification) -> dict[str, float]:
    """How far each variable goes in the records, in SI units."""
    spans = {
        variable: float(np.max(np.abs(values), initial=0.0)) for variable, (values, _) in in_motion(before).items()
    }
    return spans | {"direction": 1.0, "order of the record": float(len(search.task.problem.layout.records) - 1)}


def _fitted(search: Search, fit: LaplaceFit, law: Composed, changing: Composed) -> LaplaceFit:
    """A model with a law that changes, from where that with the law by itself is: it contains that."""
    effect, others, found = effect_of_law(changing), fit.effects[:-1], fit.evidence.mode
    supermodel = supermodel_of(search.task, (*others, effect), fit.supermodel.sensitivities)
    local = transferred(supermodel, fit.supermodel, fit.local)
    names, its = supermodel.names, fit.supermodel.names
    for term in law.terms:
        local[:, names.index(f"{changing.name}.{term.name}")] = fit.local[:, its.index(f"{law.name}.{term.name}")]
    local[:, names.index(f"{changing.name}.{SECOND.name}")] = 0.0
    return search.inference.fitted(supermodel, (*others, effect), local, found.sigma, found.place.eta, found.objective)
