"""What happens once in each record: when, by the score test; with records in which nothing happens as a control."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.discovery import comparison
from fibrefit.discovery.engine.priors import unknowns_of
from fibrefit.discovery.engine.screening import BETWEEN, PredictedGain, between_instants, likeliest_instants
from fibrefit.discovery.engine.thresholds import NAMED
from fibrefit.discovery.search import followed as module
from fibrefit.discovery.search.followed import extended
from fibrefit.discovery.search.recurring import best_combination, may_recur, predicted_recurrence
from fibrefit.discovery.search.screen import Screen
from fibrefit.discovery.search.search import Tried
from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.laws.families import instants_of, of_each, of_records
from fibrefit.laws.law import Effect
from fibrefit.problem.estimate.gauss_newton import mode
from fibrefit.problem.task import Task
from fibrefit.workflow.discovery.statements import statements_of
from tests.discovery.made import identified, named, with_estimates
from tests.discovery.test_free_form import begun_at, measured_of
from tests.discovery.test_pairs import Model

SLIP = CATALOGUE["fibre.knot_slip"]
LENGTH, AT = 1.2e-5, (0.41, 0.73)
NEAR = 0.02
"""Share of a record by which an instant may be off: that of the grid on which it is looked for, and what noise adds."""


def with_slips(task: Task, length: float) -> Task:
    """The records that a fibre would make which slips once in each, with white noise."""
    twice = of_each(SLIP, 2)
    base = begun_at(task, (twice,)).base
    local = base.fit.local.copy()
    for name, value in zip(("slip", *instants_of(twice)), (length, *AT), strict=True):
        local[:, base.supermodel.names.index(f"{twice.name}.{name}")] = value
    return measured_of(task, base.supermodel, local, 11)


def followed(task: Task, astray: float | None = None) -> tuple[PredictedGain, Any, Any]:
    """What is predicted of a slip in each record, where that leads, and the model without it.

    The second instant may be put astray before it is followed.
    """
    twice = of_each(SLIP, 2)
    search = begun_at(task, (twice,))
    parent = search.inference.fitted(search.base.supermodel, (), search.base.fit.local)
    supermodel, slopes = search.supermodel_for(twice), search.inference.slopes(parent)
    prediction = predicted_recurrence(Screen(search.inference, parent, slopes), supermodel, twice)
    if astray is not None:
        wrong = {f"{twice.name}.{instants_of(twice)[1]}": astray}
        places = (prediction.values | wrong, prediction.weak | wrong, prediction.slight | wrong)
        prediction = prediction._replace(values=places[0], weak=places[1], slight=places[2])
    return prediction, extended(search.inference, parent, supermodel, twice, prediction, slopes), parent


@pytest.mark.slow
def test_slips_at_instants_of_their_own_are_found(task: Task) -> None:
    prediction, found, parent = followed(with_slips(task, LENGTH))
    name = of_each(SLIP, 2).name
    for instant, at in zip(instants_of(of_each(SLIP, 2)), AT, strict=True):
        assert prediction.values[f"{name}.{instant}"] == pytest.approx(at, abs=NEAR)
    assert found.log - parent.log > 10.0 * NAMED
    # What slopes at the null predict of it is what it comes to.
    assert found.log - parent.log == pytest.approx(prediction.gain, rel=0.2)
    assert found.shared[f"{name}.slip"] == pytest.approx(LENGTH, abs=4.0 * found.errors[f"{name}.slip"])


@pytest.mark.slow
def test_an_instant_that_was_chosen_wrongly_is_moved_once_the_effect_explains_something(task: Task) -> None:
    slipping = with_slips(task, 3.0 * LENGTH)
    _, found, _ = followed(slipping, astray=0.3)
    at = found.shared[f"{found.names[-1]}.{instants_of(of_each(SLIP, 2))[1]}"]
    assert at == pytest.approx(AT[1], abs=NEAR)
    assert found.log > followed(slipping)[1].log - NAMED


@pytest.mark.parametrize("records", [1, 2])
def test_the_likeliest_instants_are_those_at_which_records_cost_least(task: Task, records: int) -> None:
    """Each record's own where there is one for each; where there is one, that of all records together."""
    slip = of_each(SLIP, 2) if records == 2 else of_records(SLIP, 2)
    search = begun_at(task, (slip,))
    supermodel, names = search.base.supermodel, instants_of(slip)
    unknowns = unknowns_of(supermodel, search.context, (slip,), search.inference.reference)
    columns = [supermodel.names.index(f"{slip.name}.{name}") for name in names]
    start = unknowns.place_of(search.base.fit.local)
    wanted = np.array([0.41, 0.73])

    def gram(local: np.ndarray, columns_of: np.ndarray, targets: np.ndarray) -> np.ndarray:
        away = local[np.arange(2), columns] - wanted if records == 2 else local[:, columns[0]] - wanted
        products = np.tile(np.eye(1 + len(columns_of)), (2, 1, 1))
        # What it is off by is hidden in a pull at the first of the record's own values, but for a share.
        products[:, 0, -1] = products[:, -1, 0] = 1.0
        products[:, -1, -1] = 1.0 + np.abs(away)
        products[np.abs(away - 0.05) < 0.02] = np.nan
        return products

    moved = unknowns.local_of(likeliest_instants(unknowns, start, slip, gram))
    found = moved[np.arange(2), columns] if records == 2 else moved[:, columns[0]]
    assert found == pytest.approx(wanted, abs=0.01) if records == 2 else 0.4 < found[0] < 0.74
    others = np.setdiff1d(np.arange(moved.shape[1]), columns)
    np.testing.assert_allclose(moved[:, others], unknowns.local_of(start)[:, others], rtol=1e-9)
    # Where they are already nothing is moved, and nothing has to be fitted anew.
    there = start.rest.copy()
    there[:, columns] = wanted if records == 2 else found[0]
    best = unknowns.place_of(there)
    assert likeliest_instants(unknowns, best, slip, gram) is best


def test_it_may_have_fewer_instants_than_there_are_records(task: Task) -> None:
    once = of_each(SLIP, 1)
    search = begun_at(task, (once,))
    parent = search.inference.fitted(search.base.supermodel, (), search.base.fit.local)
    screen = Screen(search.inference, parent, search.inference.slopes(parent))
    assert len(task.traces) > len(instants_of(once))
    prediction = predicted_recurrence(screen, search.supermodel_for(once), once)
    assert np.isfinite(prediction.gain)
    assert 0.0 < prediction.values[f"{once.name}.{instants_of(once)[0]}"] < 1.0


def test_instants_stay_where_they_are_in_plain_squares(task: Task) -> None:
    twice = of_each(SLIP, 2)
    context = begun_at(task, (twice,)).context
    whole, moved = context.subset((twice,)), context.descended((twice,))
    assert set(whole.shared) - set(moved.shared) == {f"{twice.name}.{name}" for name in instants_of(twice)}
    other = (CATALOGUE["guide.viscous_friction"],)
    assert context.descended(other) == context.subset(other)


def test_instants_are_held_while_all_else_is_fitted_first(task: Task, monkeypatch: pytest.MonkeyPatch) -> None:
    begun = list[Any]()

    def watched(unknowns: Any, start: Any, *rest: Any, **how: Any) -> Any:
        begun.append((unknowns, start, mode(unknowns, start, *rest, **how)))
        return begun[-1][-1]

    monkeypatch.setattr(module, "mode", watched)
    followed(with_slips(task, LENGTH))
    (unknowns, start, end), twice = begun[0], of_each(SLIP, 2)
    held = np.isin(unknowns.names[: len(unknowns.shared)], [f"{twice.name}.{name}" for name in instants_of(twice)])
    assert held.sum() == 2
    np.testing.assert_array_equal(end.place.z[held], start.z[held])
    assert np.all(end.place.z[~held] != start.z[~held])


def test_where_nothing_slips_nothing_is_found(task: Task) -> None:
    """The negative control: the best instants of all are worth less than they cost."""
    _, found, parent = followed(with_slips(task, 0.0))
    assert found.log - parent.log < NAMED


def test_the_best_combination_is_that_of_the_best_of_each() -> None:
    random = np.random.default_rng(2)
    known = random.standard_normal((5, 3, 2, 2))
    gain = lambda grams: float(np.sum(grams[:, 0, 1]))  # noqa: E731  of each record by itself
    best = best_combination(known, gain)
    np.testing.assert_array_equal(best, np.argmax(known[:, :, 0, 1], axis=0))
    # Where records share a sign the way there is no sum, and no single change does better.
    together = lambda grams: float(np.sum(grams[:, 0, 1]) ** 2)  # noqa: E731
    found, rows = best_combination(known, together), np.arange(3)
    here = together(known[found, rows])
    assert here >= max(together(grams) for grams in known)
    for record, choice in product(range(3), range(5)):
        other = np.where(rows == record, choice, found)
        assert together(known[other, rows]) <= here


def test_further_instants_lie_between_the_best_one_and_those_beside_it() -> None:
    looked = np.array([[0.2, 0.2], [0.6, 0.6], [0.8, 0.8]])
    more = between_instants(looked, np.array([1, 0]))
    assert more.shape == (2 * len(BETWEEN), 2)
    assert np.all((more[:, 0] > 0.2) & (more[:, 0] < 0.8))
    assert np.all((more[:, 1] > 0.0) & (more[:, 1] < 0.6))


@pytest.mark.parametrize(("gains", "looked_at"), [((3.0, -1.0), False), ((3.0, 0.5), True), ((-1.0, -2.0), False)])
def test_what_shows_in_one_record_alone_does_not_recur(gains: tuple[float, float], looked_at: bool) -> None:
    other = of_records(CATALOGUE["guide.friction_step"], 2)
    known = {of_records(SLIP, place): PredictedGain(gain, {}, {}, {}) for place, gain in enumerate(gains, start=1)}
    known |= {other: PredictedGain(9.0, {}, {}, {})}
    assert may_recur(of_each(SLIP, 2), known) is looked_at


@pytest.mark.parametrize(
    ("costly_gain", "moved", "noise"), [(40.0, False, "own"), (8.0, False, "best"), (40.0, True, "best")]
)
def test_what_is_costly_is_looked_at_in_the_noise_all_others_were(
    monkeypatch: pytest.MonkeyPatch, costly_gain: float, moved: bool, noise: str
) -> None:
    """In noise that a wrong effect leaves the right one explains nothing; a parent led elsewhere is begun from."""
    swift, costly = CATALOGUE["fibre.creep"], of_each(SLIP, 2)
    led = Model((), 200.0 if moved else 0.0)
    asked = list[str]()

    def searched(name: str) -> Any:
        def tried(parent: Model, effects: Any, what: str, least: float = -np.inf, **how: Any) -> Tried:
            if swift in effects:
                return Tried(cast(Any, [Model((swift,), 20.0)]), ())
            asked.append(name)
            return Tried(cast(Any, [Model((costly,), parent.log + costly_gain)]), ())

        return SimpleNamespace(name=name, extensions=lambda parent: (swift, costly), tried=tried)

    compared = list[tuple[str, float]]()

    def in_one_noise(search: Any, parent: Any, tried: Tried) -> comparison.Comparison:
        compared.append((search.name, max(one.log for one in tried.found) - parent.log))
        return comparison.Comparison(searched("best"), cast(Any, led), tuple(tried.found), moved=moved)

    monkeypatch.setattr(comparison, "in_one_noise", in_one_noise)
    monkeypatch.setattr(comparison, "_worth_following", lambda found: -np.inf)
    comparison._looked_at(searched("own"), cast(Any, Model((), 0.0)), "trying", None)
    assert asked == ["best" if moved else "own"]
    assert compared[1][0] == noise


def test_a_sentence_says_what_happened_and_when(task: Task) -> None:
    twice = of_each(SLIP, 2)
    finding = replace(named(task), added=(twice,), after=identified(task, (twice,)))
    said = {"slip": (1.2e-5, 1e-6), "instant": (0.25, 0.001), "instant_2": (0.5, 3.0)}
    (sentence,) = statements_of(with_estimates(finding, said))
    records, ends = task.problem.layout.records, [trace.times[[0, -1]] for trace in task.traces]
    first, second = (start + share * (stop - start) for (start, stop), share in zip(ends, (0.25, 0.5), strict=True))
    assert sentence.startswith("Once in each record, length the knot gives; negative: it has caught 12 +/- 1 um: at ")
    assert f"in {records[0]}, " in sentence
    # An error that is longer than the record says nothing, and stands nowhere.
    assert sentence.count("+/-") == 2
    assert f"{1e3 * first:.1f} +/- " in sentence
    assert f"{1e3 * second:.2f} ms in {records[1]}." in sentence


def test_the_name_says_in_how_many_records(task: Task) -> None:
    twice: type[Effect] = of_each(SLIP, 2)
    assert twice.name == "fibre.knot_slip@1-2"
    assert instants_of(twice) == ("instant", "instant_2")
    assert instants_of(of_records(SLIP, 2)) == ("instant",)
