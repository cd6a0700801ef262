"""The further record of which two explanations predict the most different things."""

from __future__ import annotations

from dataclasses import replace

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
    assert found.conditions["lift"] == 0.04
    assert found.apart_after > 1.5 * found.apart_before > 0.0
    # The same two, each the other's rival, are as far apart.
    back = separating_experiment(search, Rivals((DRAG.name, VISCOUS.name), models[::-1]))
    assert back is not None
    assert back.conditions == found.conditions
    assert back.apart_after == pytest.approx(found.apart_after, rel=0.1)


def test_another_zero_parts_nothing(search: Search) -> None:
    own = next(name for name in search.context.each if name == "position_zero")
    models = model(search, VISCOUS, COEFFICIENT, 1.0), model(search, VISCOUS, COEFFICIENT, 1.0, **{own: 3e-5})
    found = separating_experiment(search, Rivals(("a", "b"), models))
    assert found is not None
    assert found.apart_before < 0.01
    assert found.apart_after < 0.01


def test_a_rig_without_a_menu_has_no_further_record(search: Search, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "menu_of", lambda task: [])
    assert separating_experiment(search, Rivals(("a", "b"), (search.base, search.base))) is None


@pytest.mark.parametrize(("broken", "proposed"), [(range(100), False), (range(2), False), (range(1), True)])
def test_what_cannot_be_simulated_is_not_proposed(
    search: Search, monkeypatch: pytest.MonkeyPatch, broken: range, proposed: bool
) -> None:
    assert len(search.task.problem.layout.records) == 2

    def apart(models: object, each: object, menu: list[Choice]) -> tuple[np.ndarray, np.ndarray]:
        found = np.where(np.isin(np.arange(2 + len(menu)), broken), np.nan, 0.1)
        return found[:2], found[2:]

    monkeypatch.setattr(module, "_apart", apart)
    found = separating_experiment(search, Rivals(("a", "b"), (search.base, search.base)))
    assert (found is not None) == proposed
    assert found is None or np.isfinite([found.apart_before, found.apart_after]).all()


@pytest.mark.parametrize(("after", "help"), [(3.2, ""), (0.1, " That is little: it takes another kind of test.")])
def test_a_parting_is_said_in_words(after: float, help: str) -> None:
    choice = Choice(1, {"added_mass": 5.0}, pace=2.0)
    found = separation(("a", "b"), choice, "one.csv", apart_before=0.1, apart_after=after)
    assert worded_separation(found).says == (
        "To tell a from b, the best further record is one like one.csv with added_mass 5 kg, its input run twice as "
        f"fast: there they predict readings that differ by {after:.2g} times the noise (rms), 0.1 times in the "
        f"records at hand.{help}"
    )
