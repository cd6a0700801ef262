"""How long a search goes on, what it needs of the base fit, and which frame a refit belongs to."""

from __future__ import annotations

import importlib
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.core.check import Check
from fibrefit.discovery.discover import _broken, _untried
from fibrefit.discovery.engine.candidates import Hypothesis
from fibrefit.discovery.engine.refit import SCATTER
from fibrefit.discovery.forward_selection import Limits, climb
from fibrefit.discovery.search import cross_validation as foresight
from fibrefit.discovery.search import search as searching
from fibrefit.discovery.search.cross_validation import best_foreseen, gap_foreseen
from fibrefit.discovery.search.search import MORE, SCATTERED, Search
from fibrefit.effects.catalogue import CATALOGUE
from fibrefit.effects.law import Effect
from fibrefit.fitting.checks import CONVERGED
from fibrefit.problem.task import Task
from tests.discovery.made import identified

STRIBECK, INERTIA = CATALOGUE["guide.stribeck_friction"], CATALOGUE["pulley.inertia"]
NOTHING = cast(Any, None)


def hypothesis(*effects: type[Effect], frame: str = "first") -> Hypothesis:
    fit = SimpleNamespace(local=np.zeros((1, 1)), cost=100.0 - len(effects), shared={}, surprise=0.0, penalty=0.0)
    return Hypothesis(effects, cast(Any, fit), cast(Any, frame))


@dataclass
class Stub:
    """A search that finds one effect after the other and takes what is left for noise."""

    noisy_inputs: bool = True
    much: bool = True
    noise: bool = True
    telling: tuple[tuple[str, ...], ...] | None = None
    refuted: tuple[tuple[str, ...], ...] = ()
    linearised: int = 0
    base: Hypothesis = field(default_factory=hypothesis)
    parents: list[tuple[str, ...]] = field(default_factory=list)
    ground: Any = field(default_factory=lambda: SimpleNamespace(subset=lambda effects: effects, whole=None))

    def is_noise(self, what: Hypothesis) -> bool:
        return self.noise

    def leaves_much(self, what: Hypothesis) -> bool:
        return self.much and len(what.effects) == 1

    def anew(self, what: Hypothesis) -> tuple[Stub, Hypothesis] | None:
        if not self.noisy_inputs:
            return None
        return replace(self, linearised=self.linearised + 1), replace(what, frame=cast(Any, "anew"))

    def extended(self, parents: list[Hypothesis], what: str) -> list[Hypothesis]:
        self.parents += [parent.names for parent in parents]
        more = [effect for effect in (STRIBECK, INERTIA) if effect not in parents[0].effects]
        return [Hypothesis((*parents[0].effects, effect), parents[0].fit, parents[0].frame) for effect in more]

    def pruned(self, what: Hypothesis) -> Hypothesis:
        return what

    def simplest(self, looked: list[Hypothesis], over: Hypothesis) -> Hypothesis:
        return looked[0]

    def is_significant(self, what: Hypothesis, over: Hypothesis) -> bool:
        return self.telling is None or what.names in self.telling


@pytest.fixture
def climbed(monkeypatch: pytest.MonkeyPatch) -> Any:
    module = importlib.import_module("fibrefit.discovery.forward_selection")
    monkeypatch.setattr(module, "best_foreseen", lambda search, chosen, *_: chosen)
    monkeypatch.setattr(module, "is_refuted", lambda search, what, over: what.names in search.refuted)
    monkeypatch.setattr(module, "refit", lambda frame, subset, local, *_: hypothesis().fit)
    monkeypatch.setattr(module, "_round", lambda *_: "a round")
    monkeypatch.setattr(module, "_rivals", lambda *_: ())
    monkeypatch.setattr(module, "candidate", lambda *_: "a candidate")
    return lambda stub, limits=Limits(): climb(cast(Search, stub), NOTHING, limits)  # noqa: B008


def test_what_looks_like_noise_ends_a_search(climbed: Any) -> None:
    end = climbed(Stub(much=False))
    assert end.best.names == (STRIBECK.name,)
    assert end.search.linearised == 0


def test_more_than_a_perfect_model_leaves_is_looked_into_from_the_better_model(climbed: Any) -> None:
    end = climbed(Stub())
    assert end.best.names == (STRIBECK.name, INERTIA.name)
    assert len(end.rounds) == 2
    assert end.search.linearised == 1
    # Only the better model goes on: what errors of inputs do to the others is not known.
    assert end.search.parents == [(), (STRIBECK.name,)]
    assert end.best.frame == "anew"


@pytest.mark.parametrize(("gap", "more"), [(1.001, True), (0.999, False)])
def test_more_is_measured_against_a_perfect_model(
    task: Task, monkeypatch: pytest.MonkeyPatch, gap: float, more: bool
) -> None:
    found = SimpleNamespace(values=np.zeros(1), waves={}, gap=gap * MORE * 0.95)
    monkeypatch.setattr(searching, "joint", lambda *_: found)
    monkeypatch.setattr(searching, "expected_gap", lambda *_: (0.95, None))
    search = Search(task, (), NOTHING, hypothesis(), 1.0, 1.0, 1.0, lambda what, share: None)
    monkeypatch.setattr(searching, "alone", lambda task, what: (task, np.zeros(1)))
    search.corrected[(STRIBECK.name,)] = cast(Any, found)
    search.base = replace(search.base, frame=cast(Any, SimpleNamespace(reactions="some")))
    assert search.leaves_much(hypothesis(STRIBECK)) is more


@pytest.mark.parametrize(("colour", "significant"), [(2.0, True), (50.0, False)])
def test_an_effect_that_acts_slowly_has_to_gain_more(
    task: Task, monkeypatch: pytest.MonkeyPatch, colour: float, significant: bool
) -> None:
    # 300 is more than chance reaches at the pace of the motion, and less than it reaches in a drift.
    frame = SimpleNamespace(reactions=None)
    what = Hypothesis((STRIBECK,), cast(Any, SimpleNamespace(cost=9_700.0)), cast(Any, frame))
    over = Hypothesis((), cast(Any, SimpleNamespace(cost=10_000.0)), cast(Any, frame))
    search = Search(task, (), NOTHING, over, 6.0, 100.0, 1.0, lambda what, share: None)
    monkeypatch.setattr(Search, "gain", lambda *_: 300.0)
    monkeypatch.setattr(searching, "colour_of", lambda *_: colour)
    assert search.is_significant(what, over) is significant


def test_a_refit_with_scatter_keeps_its_frame(task: Task, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    ground = SimpleNamespace(subset=lambda *_, **__: None, whole=None, base=("stiffness",))
    search = Search(task, (), cast(Any, ground), NOTHING, 1.0, 1.0, 1e6, lambda what, share: None)
    monkeypatch.setattr(searching, "refit", lambda *_: hypothesis().fit)
    monkeypatch.setattr(Search, "is_louder_in_motion", lambda self, frame, local: asked.append(frame) or False)
    assert search.only_scatters(hypothesis(STRIBECK, frame="first"))
    assert search.only_scatters(hypothesis(STRIBECK, frame="second"))
    assert asked == ["first", "first"]


def test_a_base_that_scatters_is_as_good_as_any_candidate_leads_it_to(
    task: Task, monkeypatch: pytest.MonkeyPatch
) -> None:
    frame = SimpleNamespace(names=("stiffness",))

    def refitted(frame: Any, effects: tuple[type[Effect], ...], local: np.ndarray, whole: Any) -> Any:
        # Without an effect there are two minima: the candidate's scattered values lie in the basin of the lower one.
        surprise = 50.0 if effects else 55.0 if local[0, 0] > 1.0 else 300.0
        return SimpleNamespace(local=np.full((1, 1), 2.0) if effects else local, surprise=surprise)

    ground = SimpleNamespace(subset=lambda effects, scattering: effects, whole=None)
    search = Search(task, (), cast(Any, ground), NOTHING, 1.0, 1.0, 1.0, lambda what, share: None)
    monkeypatch.setattr(searching, "refit", refitted)
    monkeypatch.setattr(searching, "without", lambda what, kept: what.fit.local)
    over, what = (replace(hypothesis(*added), frame=cast(Any, frame)) for added in ((), (STRIBECK,)))
    assert search.scattered(over).fit.surprise == 300.0
    assert search.gain(what, over) == 5.0
    assert search.scattered(over).fit.surprise == 55.0


@pytest.mark.parametrize(("gain", "asked"), [(50.0, 0), (150.0, 1), (1000.0, 0)])
def test_scatter_is_looked_for_from_more_places_where_a_name_is_barely_earned(
    task: Task, monkeypatch: pytest.MonkeyPatch, gain: float, asked: int
) -> None:
    over, what = (
        Hypothesis(added, cast(Any, SimpleNamespace(cost=cost)), cast(Any, SimpleNamespace(reactions=None)))
        for added, cost in (((), 10_000.0), ((STRIBECK,), 8_000.0))
    )
    search = Search(task, (), NOTHING, over, 1.0, 1.0, 10_000.0, lambda what, share: None)
    places: list[tuple[str, ...]] = []

    def from_more_places(self: Search, hypothesis: Hypothesis) -> None:
        places.append(hypothesis.names)
        self.searched.add(hypothesis.names)

    monkeypatch.setattr(Search, "_scattered_anew", from_more_places)
    monkeypatch.setattr(Search, "gain", lambda *_: 30.0 if places else gain)
    monkeypatch.setattr(Search, "needed", lambda *_: 100.0)
    assert search.is_significant(what, over) is (gain == 1000.0)
    assert places == [()] * asked
    # Once is enough for all candidates.
    search.is_significant(what, over)
    assert places == [()] * asked


def test_scatter_that_is_unusual_is_looked_for_from_other_places(task: Task, monkeypatch: pytest.MonkeyPatch) -> None:
    ground = SimpleNamespace(subset=lambda *_, **__: None, whole=None, base=("stiffness", "damping"))
    frame = SimpleNamespace(names=("damping", "release", "stiffness"))
    starts = []

    def refitted(frame: Any, subset: Any, local: np.ndarray, whole: Any) -> Any:
        # A minimum with little scatter lies where the stiffness is a little larger.
        starts.append(local)
        penalty = 1.0 if local[0, 2] > 20.0 * (1.0 + 0.5 * SCATTER) else 100.0
        return SimpleNamespace(local=local, cost=90.0, penalty=penalty)

    search = Search(task, (), cast(Any, ground), NOTHING, 1.0, 1.0, 100.0, lambda what, share: None)
    monkeypatch.setattr(searching, "refit", refitted)
    monkeypatch.setattr(Search, "is_louder_in_motion", lambda *_: False)
    local = np.array([[10.0, 0.1, 20.0], [10.0, 0.2, 20.0]])
    what = replace(hypothesis(frame=cast(Any, frame)), fit=cast(Any, SimpleNamespace(local=local, cost=90.0)))
    assert search.only_scatters(what)
    assert len(starts) == 1 + SCATTERED
    assert all(np.array_equal(start[:, 1], local[:, 1]) for start in starts)
    assert search.scattered(what).fit.penalty == 1.0


def test_a_base_fit_at_a_kink_is_searched_and_one_that_broke_down_is_not(task: Task) -> None:
    def with_check(name: str, statistic: float) -> str:
        return _broken(
            replace(identified(task), checks=(Check(name, False, "It failed.", statistic, 0.1, fatal=True),))
        )

    little = 0.001 * task.problem.n_measured
    assert with_check(CONVERGED, little) == ""
    assert with_check(CONVERGED, 100.0 * little) == "It failed."
    assert with_check(CONVERGED, np.nan) == "It failed."
    assert with_check("the simulation is sound", 0.0) == "It failed."


def test_where_the_best_is_not_more_than_chance_the_next_is_asked(climbed: Any) -> None:
    end = climbed(Stub(much=False, telling=((INERTIA.name,),)))
    assert end.best.names == (INERTIA.name,)


def test_two_effects_that_hide_each_other_are_tried_together(climbed: Any) -> None:
    both = (STRIBECK.name, INERTIA.name)
    assert climbed(Stub(noise=False, telling=(both,)), Limits(max_effects=2)).best.names == both
    assert climbed(Stub(noise=True, much=False, telling=(both,))).best.names == ()


def test_what_foresees_most_records_worse_is_not_added(climbed: Any) -> None:
    assert climbed(Stub(much=False, refuted=((STRIBECK.name,),))).best.names == ()


def test_a_person_s_choice_stands(climbed: Any) -> None:
    stub = Stub(noise=False, noisy_inputs=False, telling=(), refuted=((INERTIA.name,),))
    assert climbed(stub, Limits(max_effects=1, choose=lambda looked: INERTIA.name)).best.names == (INERTIA.name,)
    assert climbed(stub, Limits(choose=lambda looked: None)).best.names == ()


@pytest.mark.parametrize(
    ("better", "significant", "taken"), [(2, True, INERTIA), (1, True, STRIBECK), (2, False, STRIBECK)]
)
def test_of_those_alike_that_is_taken_by_which_most_records_are_foreseen_better(
    task: Task, monkeypatch: pytest.MonkeyPatch, better: int, significant: bool, taken: type[Effect]
) -> None:
    whole = np.full(3, 100)
    ground, frame = SimpleNamespace(whole=whole), SimpleNamespace(samples=np.array([100.0, 100.0, 200.0]))
    base = replace(hypothesis(), frame=cast(Any, frame))
    search = Search(task, (), cast(Any, ground), base, 1.0, 1.0, 400.0, lambda what, share: None)
    monkeypatch.setattr(Search, "is_significant", lambda *_: significant)
    gaps = {STRIBECK.name: np.array([1.0, 1.2, 1.2]), INERTIA.name: np.where(np.arange(3) < 3 - better, 1.2, 1.0)}
    monkeypatch.setattr(foresight, "_foreseen", lambda search, what, record: gaps[what.names[0]][record])
    looked = [hypothesis(STRIBECK), hypothesis(INERTIA)]
    assert best_foreseen(search, looked[0], looked, base).names == (taken.name,)
    assert gap_foreseen(search, looked[0]) == pytest.approx(np.sqrt((1.0 + 1.44 + 2 * 1.44) / 4))
    assert np.isnan(gap_foreseen(search, hypothesis(STRIBECK, INERTIA)))


def test_what_records_do_not_tell_apart_is_said_though_it_was_not_tried(task: Task) -> None:
    search = Search(task, (INERTIA,), cast(Any, None), NOTHING, 1.0, 1.0, 1.0, lambda what, share: None)
    mass = CATALOGUE["fibre.mass"]
    assert _untried(search, hypothesis(INERTIA, STRIBECK)) == [(INERTIA.name, mass.name)]
    assert _untried(replace(search, effects=(INERTIA, mass)), hypothesis(INERTIA)) == []
