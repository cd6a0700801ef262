"""The further record that tells two explanations of a search apart."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fibrefit.discovery.design import rivals as module
from fibrefit.discovery.design.apart import Contest
from fibrefit.discovery.design.rivals import Rivals, separating_experiment
from fibrefit.discovery.model.finding import Choice, separation
from fibrefit.discovery.search.search import Search
from fibrefit.discovery.search.setup import set_up
from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.problem.inputs.sensitivities import Directions, InputSensitivities
from fibrefit.problem.task import Task
from fibrefit.report.sentences.discovery import worded_separation
from tests.discovery.made import BASE, differing

VISCOUS, DRAG = CATALOGUE["guide.viscous_friction"], CATALOGUE["guide.quadratic_drag"]
COEFFICIENT, QUADRATIC = ("guide.viscous_friction.viscous_coefficient", "guide.quadratic_drag.drag_coefficient")
NO_MODELS: Any = (None, None)


@pytest.fixture(scope="module")
def search(task: Task) -> Search:
    """Over the drops, with two effects; nothing is fitted."""
    layout = task.problem.layout
    start = layout.pack({name: np.full(len(layout.records), BASE[name]) for name in layout.names})
    return set_up(replace(task, start=start), None, (VISCOUS, DRAG), lambda what, share: None)


def model(search: Search, effect: type, name: str, value: float, differ: float = 0.0, **shift: float) -> Any:
    """The base model with one effect, its values as they are given; records `differ` by so much in their stiffness."""
    supermodel, local = search.base.supermodel, search.base.fit.local.copy()
    local[:, supermodel.names.index(name)] = value
    for own, change in shift.items():
        local[:, supermodel.names.index(own)] += change
    named = (*search.context.base, name)
    shared = {one: float(local[0, supermodel.names.index(one)]) for one in named}
    return SimpleNamespace(
        effects=(effect,), supermodel=supermodel, local=local, shared=shared, evidence=differing(differ).evidence
    )


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


def test_what_records_differ_by_imitates_part_of_what_parts_rivals(search: Search) -> None:
    """And what single records differ by is no difference between two models."""

    def parted(differ: float, away: float = 0.0) -> float:
        models = model(search, VISCOUS, COEFFICIENT, 1.0, differ), model(search, DRAG, QUADRATIC, 4.0)
        models[0].local[1, models[0].supermodel.names.index("stiffness")] *= 1.0 + away
        found = separating_experiment(search, Rivals((VISCOUS.name, DRAG.name), models))
        assert found is not None
        return found.nats_after

    alike, little, much = (parted(differ) for differ in (0.0, 1e-3, 1e-1))
    assert 0.0 < much < little < alike
    assert parted(0.0, away=0.05) == pytest.approx(alike)


def test_a_rival_is_seen_with_the_errors_of_inputs_that_it_was_found_with(search: Search) -> None:
    """A search that goes on takes off others, and weighs readings otherwise."""
    models = model(search, VISCOUS, COEFFICIENT, 1.0), model(search, DRAG, QUADRATIC, 4.0)
    channels = len(search.task.problem.observations.weight)
    samples = np.asarray(search.task.problem.observations.experiment.times).shape[1]
    wave = Directions(np.eye(1), np.ones((1, channels, samples)), np.eye(1))
    offset = np.ones((2, channels * samples))
    own = InputSensitivities({"drive": np.zeros((2, 1))}, np.ones((2, channels, 1)), offset, (wave, wave))
    models[1].supermodel = replace(models[1].supermodel, sensitivities=own)
    assert search.inference.common_noise.sensitivities is None
    seen = Contest.between(search, *models).supermodel
    assert seen.whitening is search.inference.common_noise.whitening
    assert seen.sensitivities is not None
    expected = own.through(seen.whitening).records[0].rows
    np.testing.assert_array_equal(seen.sensitivities.records[0].rows, expected)
    assert not seen.sensitivities.offset.any()


def test_a_rig_without_a_menu_has_no_further_record(search: Search, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "menu_of", lambda task: [])
    assert separating_experiment(search, Rivals(("a", "b"), NO_MODELS)) is None


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
    found = separating_experiment(search, Rivals(("a", "b"), NO_MODELS))
    assert (found and found.nats_after) == proposed
    assert found is None or found.record == search.task.problem.layout.records[further.index(found.nats_after)]


@pytest.mark.parametrize(("after", "help"), [(9.0, ""), (4.0, " That is little: it takes another kind of test.")])
def test_a_parting_is_said_in_words(after: float, help: str) -> None:
    choice = Choice(1, {"added_mass": 5.0}, pace=1.5)
    assert worded_separation(separation(("a", "b"), choice, "one.csv", 0.12, after)).says == (
        "To tell a from b, the best further record is one like one.csv with added_mass 5 kg, its input run 1.5 times "
        f"as fast: the expected logarithm of their likelihood ratio rises from 0.12 to {after:.2g}.{help}"
    )
