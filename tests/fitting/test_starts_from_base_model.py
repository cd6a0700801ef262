"""Starts that begin where the records lead a model without its effects."""

from __future__ import annotations

import importlib
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.fitting.identify import identify
from fibrefit.fitting.result import Identification
from fibrefit.fitting.search.starts import (
    AS_DRAWN,
    STARTS_AT_ONCE,
    latin_hypercube_starts,
    starts_from_base_model,
    without_effects,
)
from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.problem.statement.layout import Layout
from fibrefit.problem.task import Task
from tests.fitting import made

VISCOUS, ASYMMETRIC = CATALOGUE["guide.viscous_friction"], CATALOGUE["guide.asymmetric_viscous_friction"]
GOING_ON = lambda: False  # noqa: E731


@pytest.fixture(scope="module")
def viscous(tmp_path_factory: pytest.TempPathFactory) -> Task:
    """The drops of the base model, for a model with viscous friction."""
    return made.task(tmp_path_factory.mktemp("viscous"), made.records(share=0.5, seed=3), (VISCOUS,))


def test_most_starts_begin_where_the_base_model_ends(viscous: Task, task: Task, found: Identification) -> None:
    layout = viscous.problem.layout
    drawn = latin_hypercube_starts(layout, viscous.start, viscous.spread, made.STARTS, 0)
    led = starts_from_base_model(viscous, drawn, 0, GOING_ON)
    kept = np.arange(made.STARTS) % AS_DRAWN == 0
    np.testing.assert_array_equal(led[kept], drawn[kept])
    strength = layout.free_names.index("guide.viscous_friction.viscous_coefficient")
    np.testing.assert_array_equal(led[:, strength], drawn[:, strength])
    base = np.delete(led[~kept], strength, axis=1)
    errors = np.sqrt(np.diag(found.covariance))
    assert np.abs((base - found.plain.values) / errors).max() < 0.1


def test_a_few_starts_a_model_without_effects_and_one_to_be_stopped_are_left(viscous: Task, task: Task) -> None:
    for one, number, stop in ((viscous, STARTS_AT_ONCE, GOING_ON), (task, 8, GOING_ON), (viscous, 8, lambda: True)):
        drawn = latin_hypercube_starts(one.problem.layout, one.start, one.spread, number, 0)
        assert starts_from_base_model(one, drawn, 0, stop) is drawn


def test_an_effect_that_is_held_stays_and_what_needs_another_goes_with_it(viscous: Task) -> None:
    problem, layout = viscous.problem, viscous.problem.layout
    name = "guide.viscous_friction.viscous_coefficient"
    slots = tuple(replace(slot, fixed=(1.0,)) if slot.name == name else slot for slot in layout.slots)
    held = SimpleNamespace(model=problem.model, layout=Layout(slots, layout.records))
    assert without_effects(cast(Any, SimpleNamespace(problem=held))) is None
    both = replace(problem.model, effects=(ASYMMETRIC, VISCOUS))
    problem = cast(Any, SimpleNamespace(model=both, layout=layout, observations=problem.observations, soft_beyond=None))
    plain = without_effects(replace(viscous, problem=problem))
    assert plain is not None
    assert plain.problem.model.effects == ()
    assert name not in plain.spread
    assert len(plain.start) == plain.problem.layout.size == layout.size - 1


@pytest.mark.slow
def test_the_fit_is_that_of_starts_as_they_are_drawn(viscous: Task, monkeypatch: pytest.MonkeyPatch) -> None:
    led = identify(viscous, starts=made.STARTS)
    module = importlib.import_module("fibrefit.fitting.identify")
    monkeypatch.setattr(module, "starts_from_base_model", lambda task, starts, *_: starts)
    drawn = identify(viscous, starts=made.STARTS)
    errors = np.sqrt(np.diag(drawn.covariance))
    assert np.abs((led.values - drawn.values) / errors).max() < 0.05
    assert led.starts.agreeing >= drawn.starts.agreeing
