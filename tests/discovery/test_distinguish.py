"""Which effects records could show and tell apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

import fibrefit
from fibrefit.discovery.design import distinguish as module
from fibrefit.discovery.design import grams
from fibrefit.discovery.design.beside import Beside
from fibrefit.discovery.design.distinguish import best_split, confusion, detectable
from fibrefit.discovery.design.grams import exactly, sizes_of, strengths_of
from fibrefit.discovery.engine.refit import refit
from fibrefit.discovery.engine.screening import directions, slightly
from fibrefit.discovery.engine.supermodel import Supermodel
from fibrefit.discovery.engine.thresholds import NAMED, PRICE, Chance, false_alarm, gate
from fibrefit.discovery.model.finding import Choice
from fibrefit.discovery.search.screen import Screen
from fibrefit.discovery.search.search import Search
from fibrefit.discovery.search.setup import set_up
from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.problem.diagnose.motion import Motion
from fibrefit.problem.linear_model.normal_equations import ScoreTest
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.report.sentences.discovery import worded_separation
from fibrefit.study import Study, load_study
from fibrefit.study.summaries.discovery import Separation
from fibrefit.workflow.design import distinguish as workflow
from fibrefit.workflow.design.distinguish import distinguish_study
from tests.discovery.made import BASE, differing
from tests.workflow import axis

TRIED = ("guide.viscous_friction", "guide.quadratic_drag", "sensor.force_delay")


@pytest.mark.slow
def test_frictions_are_more_alike_than_a_friction_and_a_delay(study: Study) -> None:
    found = fibrefit.confuse(study, only=TRIED)
    assert [one.effect for one in found.confusion.directions] == list(TRIED)
    assert found.confusion.invisible == ()
    cosine = found.confusion.cosine
    np.testing.assert_allclose(cosine, cosine.T)
    assert cosine[0, 1] > 0.5 > cosine[0, 2]
    # The records hold a viscous friction that the model lacks.
    assert "drowns weak effects" in found.report().replace("\n", " ")


@pytest.mark.slow
@pytest.mark.parametrize(("ripple", "louder"), [(0.0, False), (1.5, True)])
def test_effects_of_the_model_are_not_listed_and_what_is_left_hides_weak_ones(
    tmp_path: Path, ripple: float, louder: bool
) -> None:
    slanted = "guide.asymmetric_viscous_friction"
    study = load_study(axis.write(tmp_path, ("guide.viscous_friction",), ripple=ripple))
    found = distinguish_study(study, only=(slanted, "guide.quadratic_drag"))
    assert [one.effect for one in found.confusion.directions] == [slanted, "guide.quadratic_drag"]
    assert bool(found.summary().remarks) == louder
    weakest = found.confusion.directions[0].smallest_detectable
    assert weakest > 0.02 if louder else weakest < 0.005


@pytest.fixture(scope="module")
def laid(task: Task) -> Search:
    """The base model of the drops with four effects, and readings that it explains."""
    layout = task.problem.layout
    start = layout.pack({name: np.full(len(layout.records), BASE[name]) for name in layout.names})
    effects = tuple(CATALOGUE[name] for name in (*TRIED, "guide.asymmetric_viscous_friction"))
    explained = replace(task, start=start, problem=read_from(task.problem, start))
    return set_up(explained, None, effects, lambda what, share: None)


def read_from(problem: Problem, values: np.ndarray) -> Problem:
    """The problem with the readings of a model in place of those measured."""
    readings = Motion.of(problem, jnp.asarray(values)).readings
    measured = {channel: readings[channel] for channel in problem.observations.measured}
    return eqx.tree_at(lambda p: p.observations, problem, problem.observations._replace(measured=measured))


def test_the_smallest_strength_is_the_one_whose_gain_passes_the_gate(laid: Search) -> None:
    found = detectable(laid, differing(0.0))
    assert [one.effect for one in found] == [effect.name for effect in laid.effects]
    supermodel, context, viscous = laid.base.supermodel, laid.context, laid.effects[0]
    name = f"{viscous.name}.{found[0].parameter}"
    column = supermodel.names.index(name)
    # Readings of a model with that friction, without noise: what the base model leaves of them is what it gains.
    made = laid.base.fit.local.copy()
    made[:, column] = found[0].smallest_detectable
    quiet = read_from(
        supermodel.problem, supermodel.problem.layout.pack(dict(zip(supermodel.names, made.T, strict=True)))
    )
    without = laid.inference.common_noise.whitened(replace(supermodel, task=replace(supermodel.task, problem=quiet)))
    left = refit(without, context.subset(()), laid.base.fit.local, context.whole, enough=1e-9).cost
    # The slope of readings that jump is good to some tens of percent over such a change.
    assert 1.0 / 2.0 < left / gate(len(viscous.parameters)) < 2.0


def test_what_records_differ_by_hides_what_acts_like_it(laid: Search) -> None:
    """A hardening fibre is stiffer in the higher of two drops: as much as records may differ by, or more, is seen."""
    search = set_up(laid.task, None, (CATALOGUE["fibre.hardening"],), lambda what, share: None)
    alike, little, much = (detectable(search, differing(sd))[0].smallest_detectable for sd in (0.0, 1e-4, 1e-2))
    assert alike is not None
    assert alike < little < much


def test_a_gate_is_what_a_name_takes() -> None:
    """Half of it, less what its parameters usually cost, is the Bayes factor of a name."""
    assert 0.5 * gate(1) - PRICE == pytest.approx(NAMED)
    assert 0.5 * gate(3) - 3.0 * PRICE == pytest.approx(NAMED)
    assert gate(1, louder=1e6) == 1e6 * gate(1)


def split_of(laid: Search, pair: Sequence[Any], louder: float = 1.0) -> Separation | None:
    """The record that tells a pair of effects apart best, in records that are alike."""
    seen, beside = laid.inference.common_noise.whitened(laid.base.supermodel), Beside()
    found = confusion(seen, laid.context, laid.base.fit.local, laid.effects, gate, beside)
    return best_split(laid, seen, pair, found, beside, louder)


def test_the_best_further_record_tells_a_pair_apart_better(laid: Search) -> None:
    viscous, drag = laid.effects[:2]
    found = split_of(laid, (viscous, drag))
    assert found is not None
    assert found.pair == (viscous.name, drag.name)
    # As strong as would just be found, of which the rival imitates most.
    assert 0.0 < found.nats_before < 0.5 * gate(1)
    assert found.nats_after > 2.0 * found.nats_before
    # Slow and fast motion together separate a friction that is linear in speed from one that is not: of slow drops, the
    # fastest that can be asked for is missing, upright and from half as high again.
    stated = laid.task.problem.observations.experiment.conditions
    own = float(np.asarray(stated["inclination"])[laid.task.problem.layout.records.index(found.record)])
    steepest = np.max(np.asarray(stated["inclination"]))
    assert found.conditions.get("inclination", own) == pytest.approx(steepest)
    assert found.conditions["lift"] == pytest.approx(1.5 * np.max(np.asarray(stated["lift"])))
    assert worded_separation(found).says.startswith(
        f"To tell {viscous.name} from {drag.name}, the best further record is one like"
    )
    # What a model leaves beside the noise hides both alike.
    loud = split_of(laid, (viscous, drag), louder=4.0)
    assert loud is not None
    assert loud.nats_after == pytest.approx(found.nats_after / 4.0)


def test_records_at_hand_are_read_as_the_model_says_as_a_further_one_is(laid: Search) -> None:
    """Of planned records nothing is measured, and beside a jump of the force a change hangs on the reading."""
    pair = laid.effects[:2]
    asked = Beside(), [Choice(0, {})], (pair, sizes_of(strengths_of(pair)))
    at_hand, (again,), _ = grams.grams_with(laid, exactly(unread(laid)), *asked)
    np.testing.assert_allclose(at_hand[0], again, rtol=1e-9, atol=1e-9 * np.diag(again).max())


def test_planned_records_are_compared_as_the_model_says_that_they_read(
    laid: Search, study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    blank = SimpleNamespace(
        base=SimpleNamespace(supermodel=unread(laid), fit=laid.base.fit),
        inference=laid.inference, context=laid.context, effects=laid.effects,
    )  # fmt: skip
    seen, where = [], (laid.base.fit.local, laid.context.whole)

    def confused(supermodel: Supermodel, *_: Any) -> Any:
        seen.append(supermodel.residuals(*where))
        return SimpleNamespace(pairs=lambda beyond: ())

    for name, given in {"is_planned": True, "task_of": None, "candidates_of": {}, "set_up": blank}.items():
        monkeypatch.setattr(workflow, name, lambda *_, given=given, **__: given)
    monkeypatch.setattr(workflow, "confusion", confused)
    distinguish_study(study)
    # Beside a jump a part of its height is left.
    assert np.abs(seen[0]).max() < 0.05 * np.abs(unread(laid).residuals(*where)).max()


def unread(laid: Search) -> Supermodel:
    """That of a search whose records are only planned."""
    data = laid.task.problem.observations
    nothing = {channel: jnp.zeros_like(values) for channel, values in data.measured.items()}
    return grams.with_records(laid.base.supermodel, data._replace(measured=nothing))


def test_of_two_effects_the_wrong_one_misses_what_it_cannot_imitate() -> None:
    """Closed form: of strengths a and b at an angle t, half of the smaller square times sin^2 t."""
    a, b, angle = 3.0, 5.0, 0.4
    left = np.array([[1.0, np.cos(angle)], [np.cos(angle), 1.0]])
    assert module._apart(left, np.array([a, b])) == pytest.approx(0.5 * a**2 * np.sin(angle) ** 2)
    # One that does nothing imitates nothing, and misses nothing.
    assert module._apart(np.diag([4.0, 0.0]), np.ones(2)) == 0.0


def test_a_record_that_cannot_be_simulated_is_not_proposed(laid: Search, monkeypatch: pytest.MonkeyPatch) -> None:
    usual = split_of(laid, laid.effects[:2])
    assert usual is not None
    kept = grams.menu_grams

    def broken(*given: Any) -> list[np.ndarray]:
        found = kept(*given)
        best = next(i for i, choice in enumerate(given[-1]) if choice.conditions == usual.conditions)
        found[best] = np.full_like(found[best], np.nan)
        return found

    monkeypatch.setattr(grams, "menu_grams", broken)
    found = split_of(laid, laid.effects[:2])
    assert found is not None
    assert found.conditions != usual.conditions
    assert found.nats_before == usual.nats_before < found.nats_after <= usual.nats_after
    monkeypatch.setattr(grams, "menu_grams", lambda *given: [np.full_like(gram, np.nan) for gram in kept(*given)])
    assert split_of(laid, laid.effects[:2]) is None


@pytest.mark.parametrize("log_factor", [-3.0, -2.0, 0.0])
def test_noise_drawn_through_the_matrices_of_a_study_is_no_more_often_as_loud_as_is_told(
    laid: Search, log_factor: float
) -> None:
    """Scores of all effects together, by their covariance in these records; the Bayes factor of the loudest."""
    search, supermodel = laid, laid.base.supermodel
    parent = search.inference.fitted(supermodel, (), search.base.fit.local)
    screen = Screen(search.inference, parent, search.inference.slopes(parent))
    ways = [(effect, *directions(effect)[0].strengths[0]) for effect in search.effects[: len(TRIED)]]
    columns = np.array([supermodel.names.index(f"{effect.name}.{name}") for effect, name, _ in ways])
    unknowns, sigma = screen.unknowns(supermodel), parent.evidence.mode.sigma
    place = unknowns.place_of(parent.local, parent.evidence.mode.place.eta)
    further = columns, np.array([slightly(supermodel, e, f"{e.name}.{name}", weak) for e, name, weak in ways])
    products = unknowns.local_grams(place, screen.gram(supermodel), further)
    covariance = ScoreTest.of(unknowns, place, products, len(ways), sigma).covariance
    size, draws = np.sqrt(np.diag(covariance)), 200_000
    drawn = np.random.default_rng(7).multivariate_normal(np.zeros(len(ways)), covariance, draws) / size
    often = np.mean(np.max(0.5 * drawn**2, axis=1) - PRICE >= log_factor)
    told = false_alarm(log_factor, [Chance(1, PRICE)] * len(ways))
    assert often <= told + 4.0 * np.sqrt(told / draws)
    # Frictions that do nearly the same are hardly two that could be loud.
    assert told < len(ways) * often
