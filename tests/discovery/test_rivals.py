"""The further record that tells two explanations of a search apart."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fibrefit.discovery.design import rivals as module
from fibrefit.discovery.design.rivals import Rivals, separating_experiment
from fibrefit.discovery.engine.candidates import Hypothesis
from fibrefit.discovery.model.finding import Choice, separation
from fibrefit.discovery.search.search import Search
from fibrefit.discovery.search.setup import set_up
from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.problem.task import Task
from fibrefit.report.sentences.discovery import worded_separation
from tests.discovery.made import BASE

VISCOUS, DRAG = CATALOGUE["guide.viscous_friction"], CATALOGUE["guide.quadratic_drag"]
COEFFICIENT, QUADRATIC = ("guide.viscous_friction.viscous_coefficient", "guide.quadratic_drag.drag_coefficient")


@pytest.fixture(scope="module")
def search(task: Task) -> Search:
    """Over the drops, with two effects; nothing is fitted."""
    layout = task.problem.layout
    start = layout.pack({name: np.full(len(layout.records), BASE[name]) for name in layout.names})
    return set_up(replace(task, start=start), None, (VISCOUS, DRAG), lambda what, share: None)


def model(search: Search, effect: type, name: str, value: float, **shift: float) -> Hypothesis:
    """The base model with one effect, its values as they are given."""
    supermodel, local = search.base.supermodel, search.base.fit.local.copy()
    local[:, supermodel.names.index(name)] = value
    for own, change in shift.items():
        local[:, supermodel.names.index(own)] += change
    return Hypothesis((effect,), replace(search.base.fit, local=local), supermodel)


def test_rivals_part_where_the_weight_is_fast(search: Search) -> None:
    models = model(search, VISCOUS, COEFFICIENT, 1.0), model(search, DRAG, QUADRATIC, 4.0)
    found = separating_experiment(search, Rivals((VISCOUS.name, DRAG.name), models))
    assert found is not None
    assert found.pair == (VISCOUS.name, DRAG.name)
    assert found.conditions["lift"] == pytest.approx(0.03)
    assert found.nats_after > 1.5 * found.nats_before > 0.0
    # The same two, each the other's rival, part in the same record.
    back = separating_experiment(search, Rivals((DRAG.name, VISCOUS.name), models[::-1]))
    assert back is not None
    assert back.conditions == found.conditions
    assert back.nats_after == pytest.approx(found.nats_after, rel=0.5)


def test_another_zero_or_stiffness_parts_nothing(search: Search) -> None:
    """A rival is at its best: what its own values imitate tells no models apart."""
    own = next(name for name in search.context.each if name == "position_zero")
    here = model(search, VISCOUS, COEFFICIENT, 1.0)
    for shift in ({own: 3e-5}, {"stiffness": 1e-6 * BASE["stiffness"]}):
        there = model(search, VISCOUS, COEFFICIENT, 1.0, **shift)
        found = separating_experiment(search, Rivals(("a", "b"), (here, there)))
        assert found is not None
        assert found.nats_before <= found.nats_after < 1e-3


def test_a_rig_without_a_menu_has_no_further_record(search: Search, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "menu_of", lambda task: [])
    assert separating_experiment(search, Rivals(("a", "b"), (search.base, search.base))) is None


@pytest.mark.parametrize(
    ("now", "further", "proposed"),
    [(np.nan, (1.0, 2.0), None), (0.1, (np.nan, np.nan), None), (0.1, (np.nan, 3.0), 3.0), (0.1, (4.0, 3.0), 4.0)],
)
def test_what_cannot_be_simulated_is_not_proposed(
    search: Search, monkeypatch: pytest.MonkeyPatch, now: float, further: tuple[float, ...], proposed: float | None
) -> None:
    menu = [Choice(0, {"lift": 0.03}), Choice(1, {"lift": 0.03})]
    monkeypatch.setattr(module, "menu_of", lambda task: menu)
    contest = SimpleNamespace(now=now, by_slopes=lambda choices: list(further))
    monkeypatch.setattr(module.Contest, "between", lambda search, true, other: contest)
    found = separating_experiment(search, Rivals(("a", "b"), (search.base, search.base)))
    assert (found and found.nats_after) == proposed
    assert found is None or found.record == search.task.problem.layout.records[further.index(found.nats_after)]


@pytest.mark.parametrize(("after", "help"), [(9.0, ""), (4.0, " That is little: it takes another kind of test.")])
def test_a_parting_is_said_in_words(after: float, help: str) -> None:
    choice = Choice(1, {"added_mass": 5.0}, pace=1.5)
    assert worded_separation(separation(("a", "b"), choice, "one.csv", 0.12, after)).says == (
        "To tell a from b, the best further record is one like one.csv with added_mass 5 kg, its input run 1.5 times "
        f"as fast: the expected logarithm of their likelihood ratio rises from 0.12 to {after:.2g}.{help}"
    )
