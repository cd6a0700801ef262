"""Weak starts of effects, and strengths that are reached from the one before."""

from __future__ import annotations

import importlib
from dataclasses import replace

import numpy as np
import pytest

from fibrefit.discovery.engine.candidates import (
    BLOWN,
    GROWTH,
    PAST,
    SMALL,
    Hypothesis,
    _continuation,
    _starts,
    _weakened,
    strengthened,
    trial_of,
)
from fibrefit.discovery.engine.priors import unknowns_of
from fibrefit.discovery.engine.refit import Subset, predictor_step, refit
from fibrefit.discovery.search.search import Search
from fibrefit.discovery.search.setup import set_up
from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from tests.discovery.made import BASE

VISCOUS, STIFFENING = (CATALOGUE[name] for name in ("guide.viscous_friction", "fibre.hardening"))
STRENGTH = "guide.viscous_friction.viscous_coefficient"


@pytest.fixture(scope="module")
def search(task: Task) -> Search:
    """The base model beside its minimum, with one effect absent; a viscous friction is hidden in the records."""
    layout = task.problem.layout
    start = {name: np.full(len(layout.records), BASE[name]) for name in layout.names}
    quiet = replace(task, start=layout.pack(start))
    return set_up(quiet, None, (VISCOUS, STIFFENING), lambda what, share: None)


@pytest.fixture(scope="module")
def parent(search: Search) -> Hypothesis:
    """The base model at its minimum."""
    fit = refit(search.base.supermodel, search.context.subset(()), search.base.fit.local, search.context.whole)
    return Hypothesis((), fit, search.base.supermodel)


def test_what_a_study_states_of_a_record_is_held_in_it_and_free_in_the_others(search: Search) -> None:
    supermodel, context = search.base.supermodel, search.context
    layout, name = supermodel.problem.layout, context.each[0]
    held = (0.0, *[None] * (len(layout.records) - 1))
    slots = [replace(slot, fixed=held) if slot.name == name else slot for slot in layout.slots]
    problem = Problem(supermodel.problem.model, replace(layout, slots=tuple(slots)), supermodel.problem.observations)
    stated = replace(supermodel, task=replace(supermodel.task, problem=problem))
    place = supermodel.names.index(name)
    found = refit(stated, context.subset(()), search.base.fit.local, context.whole).local[:, place]
    begun = search.base.fit.local[:, place]
    assert found[0] == begun[0]
    assert np.all(found[1:] != begun[1:])


def test_limits_of_a_study_are_those_of_every_comparison(search: Search) -> None:
    supermodel, context = search.base.supermodel, search.context
    narrow = {"stiffness": (1.9e4, 2.1e4), STRENGTH: (0.0, 3.0)}
    reference = {name: BASE[name] for name in context.base}
    layout = supermodel.problem.layout
    slots = [replace(s, range=s.range.within(*narrow[s.name])) if s.name in narrow else s for s in layout.slots]
    problem = Problem(supermodel.problem.model, replace(layout, slots=tuple(slots)), supermodel.problem.observations)
    stated = replace(supermodel, task=replace(supermodel.task, problem=problem))
    of = unknowns_of(stated, context, (VISCOUS,), reference)
    for name, ends in narrow.items():
        place = of.names.index(name)
        z = np.stack([of.lower, of.upper])
        np.testing.assert_allclose(of.value(z)[:, place], ends, rtol=1e-12)


def test_a_start_that_blows_up_is_made_weaker_and_no_other(search: Search, parent: Hypothesis) -> None:
    supermodel, context = parent.supermodel, search.context
    column = supermodel.names.index(STRENGTH)
    strong = parent.fit.local.copy()
    strong[:, column] = 60.0
    most = BLOWN * parent.fit.cost
    assert supermodel.costs(strong, context.whole).sum() > most
    weak = _weakened(supermodel, context, strong, (VISCOUS,), most)
    assert supermodel.costs(weak, context.whole).sum() <= most
    assert weak[0, column] in (60.0 * SMALL, 60.0 * SMALL**2, 60.0 * SMALL**3)
    # Once is enough for it, and what is gentle stays as it is.
    assert _weakened(supermodel, context, weak, (VISCOUS,), most) is weak


def test_strengths_grow_from_nothing_and_towards_it(search: Search) -> None:
    supermodel = search.base.supermodel
    for start in _starts(supermodel, search.base.fit.local, (VISCOUS, STIFFENING)):
        for effect in (VISCOUS, STIFFENING):
            (name,) = effect.strength
            column = supermodel.names.index(f"{effect.name}.{name}")
            null = supermodel.declared[supermodel.names[column]].null
            grown = strengthened(supermodel, start, (effect,), GROWTH)
            np.testing.assert_allclose(grown[:, column] - null, GROWTH * (start[:, column] - null))
            others = np.arange(len(supermodel.names)) != column
            np.testing.assert_array_equal(grown[:, others], start[:, others])


def test_other_values_make_up_for_a_change_as_a_refit_does(search: Search, parent: Hypothesis) -> None:
    supermodel, context = parent.supermodel, search.context
    subset, held = context.subset((VISCOUS,)), context.subset(())
    goal = parent.fit.local.copy()
    goal[:, supermodel.names.index(STRENGTH)] = 0.05
    led = predictor_step(supermodel, held, subset, parent.fit.local, goal, context.whole)
    np.testing.assert_allclose(led[:, supermodel.names.index(STRENGTH)], 0.05)
    best = refit(supermodel, held, goal, context.whole, enough=1e-9)
    costs = [supermodel.costs(values, context.whole).sum() for values in (goal, led, best.local)]
    # To first order: what is left to gain is little beside what leading has gained.
    assert costs[1] - costs[2] < 0.1 * (costs[0] - costs[2])


def test_an_effect_is_followed_from_weak_to_past_its_best(search: Search, parent: Hypothesis) -> None:
    context, subset = search.context, search.context.subset((VISCOUS,))
    weak = parent.fit.local.copy()
    weak[:, parent.supermodel.names.index(STRENGTH)] = 0.5
    begun = refit(parent.supermodel, Subset(context.base, context.each), weak, context.whole)
    led = _continuation(parent.supermodel, context, subset, begun, (VISCOUS,))
    strengths = np.array([fit.local[0, parent.supermodel.names.index(STRENGTH)] for fit in led])
    np.testing.assert_allclose(strengths, 0.5 * GROWTH ** np.arange(1, len(led) + 1))
    costs = np.array([fit.cost for fit in led])
    best = int(costs.argmin())
    # The hidden friction is 2.5 N s/m; one growth to each side is as near as strengths come.
    assert 2.5 / GROWTH < strengths[best] < 2.5 * GROWTH
    assert len(led) == best + 1 + PAST


def test_a_scout_goes_on_where_its_start_would_have_blown_up(
    search: Search, parent: Hypothesis, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = trial_of(parent.supermodel, search.context, parent, (VISCOUS,))
    monkeypatch.setattr(importlib.import_module("fibrefit.discovery.engine.candidates"), "BLOWN", 0.5)
    followed = trial_of(parent.supermodel, search.context, parent, (VISCOUS,))
    assert followed.refitted(search.context).fit.cost == pytest.approx(
        found.refitted(search.context).fit.cost, rel=1e-3
    )
