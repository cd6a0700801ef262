"""Rounds of a search on drops that its own simulator made: what is named, what is not, and what is taken out again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.core.limits import quiet, time_limit
from fibrefit.discovery import comparison, conclusion, forward_selection
from fibrefit.discovery.choice import candidates, chosen_of
from fibrefit.discovery.comparison import Comparison, comparison_of, in_same_noise
from fibrefit.discovery.conclusion import _never_tried
from fibrefit.discovery.design.rivals import Rivals
from fibrefit.discovery.discover import _broken
from fibrefit.discovery.engine import remaining
from fibrefit.discovery.engine.candidates import transferred
from fibrefit.discovery.engine.common_noise import common_noise_of
from fibrefit.discovery.engine.effort import slopes_tell
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.laplace_inference import LaplaceInference
from fibrefit.discovery.engine.thresholds import APART, BEYOND_DOUBT, NAMED, SIMPLER
from fibrefit.discovery.forward_selection import Limits, Selection, forward_select, remaining_residuals, rivals_of
from fibrefit.discovery.pairs import pruned
from fibrefit.discovery.search.cross_validation import cv_residuals, held_out
from fibrefit.discovery.search.effect_sizes import of_interest
from fibrefit.discovery.search.followed import extended
from fibrefit.discovery.search.inputs import residuals_left
from fibrefit.discovery.search.screen import Elsewhere, Screen, per_unit
from fibrefit.discovery.search.search import Search
from fibrefit.discovery.search.setup import prepared_search, set_up
from fibrefit.fitting.checks import CONVERGED
from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.laws.families import of_each, of_records
from fibrefit.laws.law import Effect
from fibrefit.problem.task import Task
from fibrefit.report.sentences.discovery import discovery_sentence
from fibrefit.study.summaries.check import Check
from tests.discovery.made import BASE, identified

VISCOUS, DRAG, DELAY = (
    CATALOGUE[name] for name in ("guide.viscous_friction", "guide.quadratic_drag", "sensor.force_delay")
)
STRIBECK = CATALOGUE["guide.stribeck_friction"]
COEFFICIENT = "guide.viscous_friction.viscous_coefficient"
FAINT, NEAR, PLAIN = 0.1, 0.2, 1.0
"""Coefficients in N s/m: one that leaves a gap of hardly more than noise, one of which slopes tell, one that is far."""
SURE = 4.0
"""Standard errors by which a value may be off."""


class Case:
    """A search over records made with a viscous friction of some coefficient, and white noise."""

    def __init__(self, task: Task, coefficient: float, scatter: float = 0.0, seed: int = 0) -> None:
        self.before = identified(task)
        values = task.problem.layout.pack({name: np.full(len(task.traces), BASE[name]) for name in BASE})
        plain = replace(self.before.plain, values=values)
        search = set_up(task, None, (VISCOUS, DRAG, DELAY), quiet)
        supermodel = search.base.supermodel
        local = np.zeros((len(task.traces), len(supermodel.names)))
        random = np.random.default_rng(seed)
        for name, value in (BASE | {COEFFICIENT: coefficient}).items():
            local[:, supermodel.names.index(name)] = value
        for name in search.context.scattering:
            local[:, supermodel.names.index(name)] *= np.exp(scatter * random.standard_normal(len(local)))
        readings = supermodel.problem.predict(jnp.asarray(local), supermodel.problem.observations.experiment)
        data = task.problem.observations
        measured = {
            channel: readings[channel] + random.standard_normal(readings[channel].shape) / data.weight[channel].max()
            for channel in data.measured
        }
        problem = eqx.tree_at(lambda p: p.observations, task.problem, data._replace(measured=measured))
        made = replace(task, problem=problem)
        self.before = replace(self.before, plain=plain, problem=problem)
        self.search, self.base = prepared_search(made, self.before, (VISCOUS, DRAG, DELAY), quiet)


@pytest.fixture(scope="module")
def case(task: Task) -> Callable[..., Case]:
    known: dict[tuple[float, float], Case] = {}

    def make(coefficient: float, scatter: float = 0.0) -> Case:
        if (coefficient, scatter) not in known:
            known[coefficient, scatter] = Case(task, coefficient, scatter)
        return known[coefficient, scatter]

    return make


def selected(case: Case, **limits: Any) -> Selection:
    return forward_select(case.search, case.base, case.before, Limits(**limits))


@pytest.mark.slow
@pytest.mark.parametrize(("coefficient", "far"), [(FAINT, False), (PLAIN, True)])
def test_what_is_hidden_is_named(case: Callable[..., Case], coefficient: float, far: bool) -> None:
    made = case(coefficient)
    assert slopes_tell(made.search.gap(made.search.base)) != far
    found = selected(made)
    assert found.best.names == (VISCOUS.name,)
    (first,) = (step.summary for step in found.steps)
    assert first.added == VISCOUS.name
    assert first.ranking[0].evidence > NAMED
    assert first.ranking[0].false_alarm < 1e-3
    (grown,) = (one for one in found.steps[0].statements if one.identifier == "added")
    assert grown.facts["chance"] == first.ranking[0].false_alarm
    assert first.gap_before > first.gap_after == pytest.approx(1.0, abs=0.05)
    # The last round found nothing more.
    assert found.comparison is not None
    assert all(one.evidence <= NAMED for one in candidates(found.comparison))
    value, error = found.best.shared[COEFFICIENT], found.best.errors[COEFFICIENT]
    assert abs(value - coefficient) < SURE * error
    for name in ("stiffness", "damping", "friction"):
        assert abs(found.best.shared[name] - BASE[name]) < SURE * found.best.errors[name], name


@pytest.mark.parametrize("scatter", [pytest.param(0.0, marks=pytest.mark.slow), 0.01])
def test_nothing_is_named_where_nothing_is_hidden(case: Callable[..., Case], scatter: float) -> None:
    """The negative control, with records that agree and with records that differ by a percent."""
    found = selected(case(0.0, scatter))
    assert (found.best.names, found.steps, found.rivals) == ((), (), ())
    assert found.comparison is not None
    assert all(one.evidence <= NAMED for one in candidates(found.comparison))
    assert max(one.false_alarm for one in candidates(found.comparison)) > 0.01
    for name in ("stiffness", "damping", "friction"):
        assert abs(found.best.shared[name] - BASE[name]) < SURE * found.best.errors[name], name


def test_costly_effects_that_slopes_predict_nothing_of_are_not_compared_again(
    case: Callable[..., Case], monkeypatch: pytest.MonkeyPatch
) -> None:
    made, fitted = case(FAINT), list[int]()

    def counted(*args: Any) -> Comparison:
        fitted.append(1)
        return in_same_noise(*args)

    monkeypatch.setattr(comparison, "in_same_noise", counted)
    monkeypatch.setattr(comparison, "is_costly", lambda effect: effect is DELAY)
    ranked = comparison_of(made.search, made.base, "trying")
    assert len(fitted) == 1
    assert {one.effects[-1] for one in ranked.found} == {VISCOUS, DRAG, DELAY}
    assert (DELAY.name,) not in ranked.compared
    # Where it is what is missing it is followed, and weighed like the others.
    monkeypatch.setattr(comparison, "is_costly", lambda effect: effect is VISCOUS)
    ranked = comparison_of(made.search, made.base, "trying")
    assert len(fitted) == 3
    assert ranked.found[0].names == (VISCOUS.name,)


def test_all_candidates_contain_their_parent(case: Callable[..., Case]) -> None:
    """None can be worse than it by more than its own parameters cost, and the ranking is by probability."""
    made = case(0.0)
    ranked = comparison_of(made.search, made.base, "trying")
    assert {one.effects[-1] for one in ranked.found} == {VISCOUS, DRAG, DELAY}
    logs = [one.log for one in ranked.found]
    assert logs == sorted(logs, reverse=True)
    assert all(-12.0 < ranked.gain(one) < NAMED for one in ranked.found)
    assert all(one.evidence.mode.normal.cost <= ranked.parent.evidence.mode.normal.cost + 1.0 for one in ranked.found)


def both(made: Case) -> LaplaceFit:
    """Both frictions on the base, whatever they are good for."""
    return with_effect(made, with_effect(made, made.base, VISCOUS), DRAG)


def with_effect(made: Case, parent: LaplaceFit, effect: type[Effect]) -> LaplaceFit:
    """An effect on a parent, from where slopes predict most of it."""
    inference, supermodel = made.search.inference, made.search.supermodel_for(effect, (*parent.effects, VISCOUS, DRAG))
    return extended(
        inference,
        parent,
        supermodel,
        effect,
        Screen(inference, parent, inference.slopes(parent)).predicted(supermodel, [effect])[effect],
    )


def beside(made: Case, supermodel: Any) -> Elsewhere:
    """The model a case begins with, as slopes are taken in it by a supermodel."""
    local = transferred(supermodel, made.base.supermodel, made.base.local)
    return Elsewhere(supermodel, local, (), per_unit(made.base, made.search.inference.slopes(made.base)))


@pytest.mark.parametrize(("parent", "effect"), [(VISCOUS, DRAG), (VISCOUS, DELAY), (DELAY, VISCOUS)])
@pytest.mark.parametrize("coefficient", [FAINT, NEAR])
def test_slopes_in_a_model_without_the_parent_s_effects_predict_what_those_beside_them_do(
    case: Callable[..., Case], coefficient: float, parent: type[Effect], effect: type[Effect]
) -> None:
    made = case(coefficient)
    search, first = made.search, with_effect(made, made.base, parent)
    assert slopes_tell(search.gap_left(made.base))
    slopes, lean = search.inference.slopes(first), search.supermodel_with((effect,))
    near = beside(made, lean)
    own, without = (
        Screen(search.inference, first, slopes, there).predicted(search.supermodel_with((parent, effect)), [effect])
        for there in (None, near)
    )
    assert without[effect].gain == pytest.approx(own[effect].gain, abs=0.3, rel=0.05)
    for name, value in own[effect].values.items():
        typical = lean.declared[name].typical
        assert without[effect].values[name] == pytest.approx(value, rel=0.2, abs=0.05 * typical)
    # On the model the search began with they predict something else.
    alone = Screen(search.inference, made.base, search.inference.slopes(made.base)).predicted(lean, [effect])
    assert abs(alone[effect].gain - own[effect].gain) > 3.0


def test_what_the_parent_adds_to_a_near_model_is_absent_where_slopes_are_taken(case: Callable[..., Case]) -> None:
    """Also of a group that holds it: base values of the one model suit no strength of the other."""
    made = case(NEAR)
    search, first = made.search, with_effect(made, made.base, VISCOUS)
    slopes, whole = search.inference.slopes(first), search.supermodel_with((VISCOUS, DELAY))
    alone, together = (
        Screen(search.inference, first, slopes, beside(made, lean)).predicted(whole, [DELAY])[DELAY]
        for lean in (search.supermodel_with((DELAY,)), search.supermodel_with((VISCOUS, DELAY)))
    )
    assert together.gain == pytest.approx(alone.gain, rel=1e-6)
    assert together.values == pytest.approx(alone.values, rel=1e-6)


@pytest.mark.parametrize("stiff", [False, True])
def test_beside_a_stiff_effect_slopes_of_a_whole_group_are_taken_without_it(task: Task, stiff: bool) -> None:
    """Laws with a memory are a group, and each is alone where equations are stiff."""
    memory = tuple(CATALOGUE[name] for name in ("fibre.maxwell_branch", "fibre.hysteresis"))
    first = CATALOGUE["guide.presliding"] if stiff else DELAY
    assert bool(first.stiff) is stiff
    search = set_up(task, None, (*memory, first), quiet)
    supermodel, local = search.base.supermodel, search.base.fit.local
    parent, near = (SimpleNamespace(effects=some, supermodel=supermodel, local=local) for some in ((first,), ()))
    for effect in memory:
        screen, whole = search._screen(effect, cast(Any, parent), cast(Any, None), cast(Any, (near, None)))
        group = whole if screen.near is None else screen.near.supermodel
        assert group.holds(memory)
        assert whole.holds((*group.effects, first))


def test_what_is_left_of_what_was_found_is_told_when_the_time_is_over(case: Callable[..., Case]) -> None:
    """An effect that was found is not lost for one simulation."""
    made = case(PLAIN)
    with time_limit(0.0):
        assert made.search.gap_left(made.base) > 0.0


def test_an_effect_that_has_become_needless_is_taken_out(case: Callable[..., Case]) -> None:
    made = case(PLAIN)
    kept = pruned(made.search.inference, both(made))
    assert kept.names == (VISCOUS.name,)
    # Of none is left what one alone explains.
    assert pruned(made.search.inference, kept) is kept


def test_an_effect_that_explains_nothing_costs_its_parameters(case: Callable[..., Case]) -> None:
    made = case(0.0)
    pair = both(made)
    assert pair.log < made.search.inference.again(made.base).log
    assert len(pruned(made.search.inference, pair).effects) == 1


def test_what_is_there_and_smaller_than_is_of_interest_is_told_and_not_kept(case: Callable[..., Case]) -> None:
    made = case(FAINT)
    found = selected(made)
    (step,) = (step.summary for step in found.steps)
    strength = float(np.sqrt(step.gap_before**2 - step.gap_after**2))
    kept, said = of_interest(found.search, found.best, 0.9 * strength)
    assert (kept, said) == (found.best, [])
    assert of_interest(found.search, found.best, 0.0) == (found.best, [])
    taken, (told,) = of_interest(found.search, found.best, 1.1 * strength)
    assert taken.names == ()
    assert told.facts["strength"] == pytest.approx(strength, rel=0.05)
    assert discovery_sentence(told) == (
        f"{VISCOUS.name} is there, but explains {told.facts['strength']:.2g} of the noise rms, less than the least of "
        f"interest ({1.1 * strength:g}): it was not added."
    )


def test_a_person_s_choice_stands(case: Callable[..., Case]) -> None:
    made = case(0.0)
    found = selected(made, max_effects=1, choose=lambda ranking: DRAG.name)
    assert found.best.names == (DRAG.name,)
    assert selected(made, choose=lambda ranking: None).best.names == ()


def test_limits_are_kept(case: Callable[..., Case]) -> None:
    assert selected(case(PLAIN), max_effects=0).best.names == ()


def test_rivals_are_those_within_a_few_nats() -> None:
    def fitted(effect: type[Effect], log: float, steps: int = 1) -> LaplaceFit:
        evidence = SimpleNamespace(mode=SimpleNamespace(steps=steps))
        return cast(LaplaceFit, SimpleNamespace(names=(effect.name,), effects=(effect,), log=log, evidence=evidence))

    best, near, far = fitted(VISCOUS, 20.0), fitted(DRAG, 20.5 - APART), fitted(DELAY, 19.5 - APART)
    only_predicted = fitted(STRIBECK, 19.9, 0)
    ranked = cast(Any, SimpleNamespace(found=(best, only_predicted, near, far)))
    (rival,) = rivals_of(ranked, best)
    assert rival.names == (VISCOUS.name, DRAG.name)
    assert rival.models == (best, near)


@pytest.mark.parametrize(("added", "told"), [((VISCOUS,), True), ((VISCOUS, DRAG), False)])
def test_what_was_added_later_is_no_rival_of_what_it_stands_beside(
    monkeypatch: pytest.MonkeyPatch, added: tuple[type[Effect], ...], told: bool
) -> None:
    rival = Rivals((VISCOUS.name, DRAG.name), cast(Any, ()))
    best: Any = SimpleNamespace(names=tuple(effect.name for effect in added))
    assert (conclusion._rivals_told((rival,), best) == {rival.names: rival}) is told


FOLLOWED = SimpleNamespace(mode=SimpleNamespace(steps=1))


@pytest.mark.parametrize(("behind", "taken"), [(0.7 * SIMPLER, VISCOUS), (1.4 * SIMPLER, STRIBECK)])
def test_of_explanations_nearly_as_good_the_one_with_fewer_parameters_is_taken(
    behind: float, taken: type[Effect]
) -> None:
    parent = SimpleNamespace(log=0.0, effects=())
    found = tuple(
        SimpleNamespace(log=log, effects=(effect,), names=(effect.name,), evidence=FOLLOWED)
        for effect, log in ((STRIBECK, 20.0), (VISCOUS, 20.0 - behind))
    )
    ranked = SimpleNamespace(
        found=found, parent=parent, gain=lambda one: one.log, compared=(found[0].names,), gained=0.0
    )
    chosen = chosen_of(cast(Any, ranked), None)
    assert chosen is not None
    assert chosen.effects == (taken,)


def test_what_is_simpler_and_no_more_than_chance_is_not_taken_first() -> None:
    found = tuple(
        SimpleNamespace(log=log, effects=(effect,), names=(effect.name,), evidence=FOLLOWED)
        for effect, log in ((STRIBECK, NAMED + 0.5), (VISCOUS, NAMED - 0.5))
    )
    parent = SimpleNamespace(log=0.0, effects=())
    ranked: Any = SimpleNamespace(
        found=found, parent=parent, gain=lambda one: one.log, compared=(found[0].names,), gained=0.0
    )
    chosen = chosen_of(ranked, None)
    assert chosen is not None
    assert chosen.effects == (STRIBECK,)


def test_a_round_that_leaves_the_effects_as_they_were_is_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    """What it added may be needless beside what had been found: the next would add it again, until the time ends."""
    names, rounds = iter([("a",), ("a", "b"), ("a", "b"), ("a", "b", "c")]), list[tuple[str, ...]]()

    def further(at: forward_selection.Selection, *of: Any) -> Any:
        rounds.append(next(names))
        return replace(at, best=cast(Any, SimpleNamespace(names=rounds[-1], effects=rounds[-1]))), True

    monkeypatch.setattr(forward_selection, "_further", further)
    monkeypatch.setattr(forward_selection, "_more_to_conclude", lambda *of: 0.0)
    base: Any = SimpleNamespace(names=(), effects=())
    found = forward_select(cast(Any, None), base, cast(Any, None), Limits(max_effects=5))
    assert (found.best.names, len(rounds)) == (("a", "b"), 3)


@pytest.mark.parametrize(("gain", "named"), [(0.9 * BEYOND_DOUBT, False), (1.1 * BEYOND_DOUBT, True)])
def test_candidates_that_the_time_did_not_suffice_to_compare_are_named_beyond_doubt_only(
    gain: float, named: bool
) -> None:
    found = (SimpleNamespace(log=gain, effects=(VISCOUS,), names=(VISCOUS.name,), evidence=FOLLOWED),)
    ranked = SimpleNamespace(
        found=found, parent=SimpleNamespace(log=0.0, effects=()), gain=lambda one: one.log, compared=(), gained=0.0
    )
    assert (chosen_of(cast(Any, ranked), None) is not None) == named


STEP = CATALOGUE["guide.friction_step"]


@pytest.mark.parametrize(
    ("effect", "gain", "named"),
    [
        (of_records(STEP, 2), 9.9, False),
        (of_records(STEP, 2), 10.1, True),
        (of_each(STEP, 5), 9.9, True),
        (DRAG, 9.9, True),
    ],
    ids=("instant_little", "instant_much", "in_all", "no_instant"),
)
def test_an_instant_of_one_record_says_more_than_a_likeness_leaves(
    effect: type[Effect], gain: float, named: bool
) -> None:
    """Beside an effect that gained 100 nats."""
    one = SimpleNamespace(log=gain, effects=(VISCOUS, effect), names=(VISCOUS.name, effect.name), evidence=FOLLOWED)
    parent = SimpleNamespace(log=0.0, effects=(VISCOUS,))
    ranked = SimpleNamespace(
        found=(one,), parent=parent, gain=lambda other: other.log, compared=(one.names,), gained=100.0
    )
    assert (chosen_of(cast(Any, ranked), None) is not None) is named


@pytest.mark.parametrize(("behind", "named"), [(0.9 * SIMPLER, True), (1.1 * SIMPLER, False)])
def test_what_is_less_probable_than_an_instant_that_is_not_named_does_not_take_its_place(
    behind: float, named: bool
) -> None:
    instant, drag = (VISCOUS, of_records(STEP, 2)), (VISCOUS, DRAG)
    found = tuple(
        SimpleNamespace(log=log, effects=effects, names=tuple(one.name for one in effects), evidence=FOLLOWED)
        for log, effects in ((9.9, instant), (9.9 - behind, drag))
    )
    parent = SimpleNamespace(log=0.0, effects=(VISCOUS,))
    ranked: Any = SimpleNamespace(
        found=found, parent=parent, gain=lambda other: other.log, compared=(found[0].names,), gained=100.0
    )
    chosen = chosen_of(ranked, None)
    assert (None if chosen is None else chosen.effects) == (drag if named else None)


def test_an_instant_beyond_doubt_is_named_whatever_else_gained() -> None:
    effects = (VISCOUS, of_records(STEP, 2))
    one = SimpleNamespace(log=BEYOND_DOUBT + 1.0, effects=effects, names=("a", "b"), evidence=FOLLOWED)
    parent = SimpleNamespace(log=0.0, effects=(VISCOUS,))
    ranked: Any = SimpleNamespace(
        found=(one,), parent=parent, gain=lambda other: other.log, compared=(one.names,), gained=5000.0
    )
    assert chosen_of(ranked, None) is one


def test_records_are_predicted_from_the_others_better_with_what_was_hidden(case: Callable[..., Case]) -> None:
    made = case(PLAIN)
    best = made.search.plain(selected(made).best)
    found = held_out(made.search, made.search.base, best)
    assert [held.record for held in found] == list(made.search.task.problem.layout.records)
    assert all(held.gap_after < held.gap_before for held in found)
    # One of two records known from the other: as good as the noise, within what one record tells.
    np.testing.assert_allclose(cv_residuals(made.search, best), 1.0, atol=0.1)


def test_a_base_fit_at_a_kink_is_searched_and_one_that_broke_down_is_not(task: Task) -> None:
    def broken(identifier: str, statistic: float) -> list[str]:
        check = Check(
            name="it holds", passed=False, statistic=statistic, threshold=0.1, fatal=True, identifier=identifier
        )
        return [found.name for found in _broken(replace(identified(task), checks=(check,)))]

    little = 0.001 * task.problem.n_measured
    assert broken(CONVERGED, little) == []
    assert broken(CONVERGED, 100.0 * little) == ["it holds"]
    assert broken(CONVERGED, np.nan) == ["it holds"]
    assert broken("simulation", 0.0) == ["it holds"]


def test_what_records_do_not_tell_apart_is_said_though_it_was_not_tried() -> None:
    inertia, stribeck, mass = (CATALOGUE[n] for n in ("pulley.inertia", "guide.stribeck_friction", "fibre.mass"))
    search = lambda *effects: cast(Search, SimpleNamespace(effects=effects))  # noqa: E731
    best = lambda *effects: cast(LaplaceFit, SimpleNamespace(effects=effects))  # noqa: E731
    assert _never_tried(search(inertia), best(inertia, stribeck)) == [(inertia.name, mass.name)]
    assert _never_tried(search(inertia, mass), best(inertia)) == []


def innovations(inference: LaplaceInference, fitted: LaplaceFit) -> np.ndarray:
    """Whitened residuals at the mode, ``(n_record, n_channel, n_time)``."""
    noise = inference.common_noise
    left = remaining.residuals_of(noise, fitted, inference.context.whole)
    return np.asarray(remaining.innovations_of(noise.whitening, jnp.asarray(left))[0])


def test_a_hypothesis_is_compared_again_in_the_noise_it_leaves(case: Callable[..., Case]) -> None:
    made = case(0.0)
    assert (made.base.with_log(-1.0).log, made.base.with_log(-1.0).names) == (-1.0, ())
    twice = [noise.scaled(2.0) for noise in made.search.inference.common_noise.noise]
    wrong = LaplaceInference(
        made.search.context, made.search.inference.reference, common_noise_of(made.base.supermodel, twice)
    )
    right = wrong.in_noise_of(wrong.again(made.base))
    fresh, stale = (innovations(of, of.again(made.base)) for of in (right, wrong))
    valid = fresh != 0.0
    assert np.mean(fresh[valid] ** 2) == pytest.approx(1.0, abs=0.03)
    # The negative control: in noise that is told twice as large, innovations are half as large.
    assert np.mean(stale[valid] ** 2) == pytest.approx(0.25, abs=0.01)


def test_noise_holds_no_jumps(case: Callable[..., Case], monkeypatch: pytest.MonkeyPatch) -> None:
    made, own = case(0.0), remaining.residuals_of
    inference = made.search.inference
    at = np.linspace(0.3, 0.7, len(inference.context.whole)) * inference.context.whole

    def jumping(*of: Any) -> np.ndarray:
        residuals = own(*of).copy()
        after = np.arange(residuals.shape[-1]) >= at[:, None]
        residuals[:, :, 0] += np.where(after & (residuals[:, :, 0] != 0.0), 0.6, 0.0)
        return residuals

    slow = lambda: inference.noise(made.base)[0].density(np.array([1.0]))[0]  # noqa: E731
    quiet_one = slow()
    monkeypatch.setattr(remaining, "residuals_of", jumping)
    assert slow() < 1.5 * quiet_one
    # The negative control: a spectrum takes jumps that are not looked for as slow noise.
    monkeypatch.setattr(remaining, "level_shifts", lambda *of: [])
    assert slow() > 5.0 * quiet_one


def test_false_alarms_do_not_hang_on_the_noise_a_round_begins_with(case: Callable[..., Case]) -> None:
    made, found = case(PLAIN), []
    others = ("sensor.force_gain", "sensor.force_drift", "guide.stribeck_friction")
    effects = (*made.search.effects, *(CATALOGUE[name] for name in others))
    for factor in (1.0, 0.8):
        noise = [one.scaled(factor) for one in made.search.inference.common_noise.noise]
        inference = LaplaceInference(
            made.search.context, made.search.inference.reference, common_noise_of(made.base.supermodel, noise)
        )
        search = replace(made.search, effects=effects).with_inference(inference)
        ranked = comparison_of(search, inference.again(made.base), "trying")
        found.append({one.effect: one for one in candidates(ranked)}["sensor.force_delay"])
    assert min(one.evidence for one in found) > NAMED
    assert max(one.false_alarm for one in found) < 0.01


@pytest.mark.parametrize(
    ("objections", "again"),
    [((185.0, 0.0), 1), ((185.0, 60.0, 0.0), 2), ((900.0,), 0), ((0.0,), 0), ((400.0, 390.0), 1)],
)
def test_readings_are_linearised_again_as_long_as_that_takes_away_what_tests_object_by(
    monkeypatch: pytest.MonkeyPatch, objections: tuple[float, ...], again: int
) -> None:
    """What a test says of a model about which readings were linearised once may be an error of that."""
    places = iter(range(1, 9))
    monkeypatch.setattr(
        forward_selection, "alarms_of", lambda search, parent: [SimpleNamespace(nats=objections[parent])]
    )
    monkeypatch.setattr(forward_selection, "relinearised", lambda search, parent: (search, next(places)))
    _, found = forward_selection._settled(cast(Any, None), cast(Any, 0), 946.0)
    assert found == again


def test_what_is_left_is_left_of_each_record_at_its_own_values(case: Callable[..., Case]) -> None:
    """Values that all share lose what records differ by; so would the places where it is told to be left."""
    made = case(0.0, 0.01)
    assert made.base.evidence.mode.sigma.any()
    left = remaining_residuals(made.search, made.base)
    assert np.sqrt(np.mean(left.residuals[left.counted] ** 2)) == pytest.approx(1.0, abs=0.05)
    # Beside a jump a search's own residuals are softened.
    apart = np.abs(left.residuals - residuals_left(made.search, made.base))[left.counted]
    assert np.mean(apart < 1e-5) > 0.99
