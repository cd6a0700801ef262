"""Laws asked in turn, and about themselves as long as that takes away what tests object by."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.core.limits import OutOfTimeError, time_limit
from fibrefit.discovery import complete_law
from fibrefit.discovery.curves import free_form
from fibrefit.discovery.curves.probes import PROBES, FrictionOfPosition, TensionOfRate
from fibrefit.discovery.engine import laplace_inference
from fibrefit.discovery.engine.effort import LINEARISED_ANEW, is_as_good
from fibrefit.discovery.engine.laplace_inference import LaplaceInference
from fibrefit.discovery.engine.thresholds import BEYOND_DOUBT
from fibrefit.discovery.laws import told
from fibrefit.discovery.laws.forms import FORMS, FittedForm
from fibrefit.discovery.laws.propose import Proposal
from fibrefit.discovery.laws.source import composed, effect_of_law
from fibrefit.discovery.laws.told import HeldLaw, held_laws
from fibrefit.discovery.search import alarms
from fibrefit.discovery.search.inputs import Confirmation
from fibrefit.problem.linear_model.unknowns import Differences
from tests.discovery.test_pairs import Model

NONE: Any = None


@pytest.mark.parametrize(
    ("objected", "end"),
    [
        ((0.0,), (0, 0.0)),
        ((946.0, 196.0, 46.0, 0.0), (3, 0.0)),  # readings linearised elsewhere looked like something
        ((60.0, 31.0, 0.0), (0, 60.0)),  # what is left is left
        ((60.0, 20.0, 15.0, 0.0), (1, 20.0)),
        (tuple(3.0**-i for i in range(20)), (LINEARISED_ANEW, 3.0**-LINEARISED_ANEW)),
    ],
)
def test_a_law_is_asked_about_itself_as_long_as_that_takes_away_what_tests_object_by(
    monkeypatch: pytest.MonkeyPatch, objected: tuple[float, ...], end: tuple[int, float]
) -> None:
    looked: list[Any] = []

    def confirmed(search: Any, parent: Any, found: Any) -> Confirmation:
        assert (search, found) == ((looked[-1], f"law {looked[-1]}") if looked else ("search", "law"))
        looked.append(len(looked))
        here, one = cast(Any, looked[-1]), cast(Any, f"law {looked[-1]}")
        return Confirmation(here, one, NONE, led=len(looked) == 1)

    monkeypatch.setattr(alarms, "confirmed", confirmed)
    raised = lambda search, found: [SimpleNamespace(nats=nats)] if (nats := objected[search]) else []  # noqa: E731
    monkeypatch.setattr(alarms, "alarms_of", raised)
    seen, left = alarms.confirmed_where_it_settles(cast(Any, "search"), NONE, cast(Any, "law"))
    assert seen is not None
    assert (seen.search, left) == end
    # What is held against it is led as it was.
    assert seen.led


def test_a_test_that_objects_in_no_nats_objects_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    jump: Any = SimpleNamespace(nats=0.0)
    monkeypatch.setattr(alarms, "confirmed", lambda *of: Confirmation(NONE, NONE, NONE))
    monkeypatch.setattr(alarms, "alarms_of", lambda *of: [jump])
    assert alarms.confirmed_where_it_settles(NONE, NONE, NONE)[1] == float("inf")


def test_where_a_motion_is_lost_about_a_law_nothing_settles(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(alarms, "confirmed", lambda *of: None)
    assert alarms.confirmed_where_it_settles(NONE, NONE, NONE) == (None, 0.0)


def law(name: str, probe: str, log: float) -> tuple[Any, Any]:
    """A law of a curve, with its evidence."""
    return SimpleNamespace(log=log, name=name), SimpleNamespace(name=name, probe=probe)


@pytest.mark.parametrize(
    ("holding", "asked"),
    [
        ({"first", "second", "third"}, ["first", "third"]),  # one of each curve
        ({"second", "third"}, ["third"]),  # the best of its curve does not hold: neither does that curve
        (set(), []),
    ],
)
def test_the_best_law_of_each_curve_is_asked_that_does_what_the_best_curve_does(
    monkeypatch: pytest.MonkeyPatch, holding: set[str], asked: list[str]
) -> None:
    ranked = [
        law("first", "position", 60.0), law("second", "position", 59.0), law("third", "speed", 58.0),
        law("short of it", "stretch", 50.0),
    ]  # fmt: skip
    proposal = Proposal(NONE, cast(Any, SimpleNamespace(log=0.0)), ranked, (), needed=55.0)

    def held(one: Proposal) -> Any:
        fit, best = one.ranked[0]
        return HeldLaw(cast(Any, fit), cast(Any, best), one) if best.name in holding else None

    monkeypatch.setattr(told, "proposed", lambda *of: proposal)
    monkeypatch.setattr(told, "holding", held)
    assert [one.law.name for one in held_laws(NONE, NONE, ())] == asked
    monkeypatch.setattr(told, "proposed", lambda *of: None)
    assert list(held_laws(NONE, NONE, ())) == []


def test_where_one_law_is_not_what_is_missing_the_next_one_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []

    def weighed(search: Any, parent: Any, chosen: Any, held: Any, left: float) -> Any:
        asked.append(held)
        return f"unnamed {held}" if held == "second" else None

    monkeypatch.setattr(complete_law, "held_laws", lambda *of: iter(["first", "second", "third"]))
    monkeypatch.setattr(complete_law, "_weighed", weighed)
    curves: Any = ["a curve"]
    assert complete_law.law_of_curves(NONE, NONE, None, curves, 0.0) == cast(Any, "unnamed second")
    assert asked == ["first", "second"]
    assert complete_law.law_of_curves(NONE, NONE, None, [], 0.0) is None


@pytest.mark.parametrize(
    ("gain", "most", "there"),
    [(70.1, 100.0, True), (70.0, 100.0, False), (1921.0, 2000.0, True), (1919.0, 2000.0, False)],
)
def test_a_curve_that_was_followed_to_a_share_of_its_gain_may_still_be_the_best(
    gain: float, most: float, there: bool
) -> None:
    assert is_as_good(gain, most) is there


def test_overdispersion_of_many_values_is_that_of_their_mean_and_not_of_the_largest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each of eighty heights has a ratio that is one but for chance; where something is amiss their mean tells it."""
    names = [f"c{i}" for i in range(80)]
    rng = np.random.default_rng(1)
    sound = rng.chisquare(60, size=80) / 60
    steps = Differences(NONE, NONE, NONE, np.ones((1, 1)))
    at: Any = SimpleNamespace(place=NONE)
    at.unknowns = SimpleNamespace(names=["stiffness", *names], differences=lambda *of: steps)
    evidence = SimpleNamespace(mode=at, covariance=[np.eye(2)], weight=np.array([1.0]))
    fitted: Any = SimpleNamespace(evidence=evidence, supermodel=NONE, effects=(), local=np.zeros((1, 1)))
    parent: Any = SimpleNamespace(supermodel=NONE, local=np.zeros((1, 1)), effects=())
    noise = SimpleNamespace(whitened=lambda supermodel: supermodel)
    inference = LaplaceInference(cast(Any, SimpleNamespace(whole=NONE)), {}, cast(Any, noise))
    kept = np.ones((1, 1, 1))
    monkeypatch.setattr(laplace_inference, "stretch_products", lambda *of: kept)
    monkeypatch.setattr(laplace_inference, "transferred", lambda *of: NONE)
    monkeypatch.setattr(laplace_inference, "_without", lambda *of: NONE)
    monkeypatch.setattr(laplace_inference, "change_products", lambda *of: NONE)
    monkeypatch.setattr(laplace_inference, "overdispersion_of_change", lambda change: 1.0)
    for times in (1.0, 4.0):
        ratios = np.r_[9.0, times * sound]
        at.overdispersion = lambda *of, ratios=ratios: ratios
        found = inference.overdispersion(parent, fitted, names)
        assert found == pytest.approx(max(1.0, times * sound.mean()))
    assert sound.max() > 1.3
    # Where no shared value is added, as where each record has its own, the change alone tells it.
    assert inference.overdispersion(parent, fitted, []) == 1.0


@pytest.mark.parametrize(
    ("gained", "promised", "late"),
    [(500.0, 100.0, False), (500.0, 400.0, True), (0.5 * BEYOND_DOUBT, 10.0, True), (None, 10.0, True)],
)
def test_curves_that_were_drawn_are_kept_where_those_that_were_not_promise_far_less(
    monkeypatch: pytest.MonkeyPatch, gained: float | None, promised: float, late: bool
) -> None:
    drawn = [] if gained is None else [SimpleNamespace(probe=PROBES[0], fitted=Model((), gained))]
    looks: Any = SimpleNamespace(
        predicted=[SimpleNamespace(probe=PROBES[0], gain=1e3), SimpleNamespace(probe=PROBES[1], gain=promised)],
        probes=PROBES[:2],
    )
    monkeypatch.setattr(free_form, "_worthy", lambda *of: drawn)
    monkeypatch.setattr(free_form, "_read", lambda search, end, before, looks: end.probe)
    with time_limit(-1.0):
        if late:
            with pytest.raises(OutOfTimeError):
                free_form.proposed_by(NONE, cast(Any, Model((), 0.0)), looks)
        else:
            assert free_form.proposed_by(NONE, cast(Any, Model((), 0.0)), looks) == [cast(Any, PROBES[0])]


def test_where_the_time_ended_before_curves_were_looked_at_it_is_not_said_that_there_is_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(free_form, "_worthy", lambda *of: [])
    looks: Any = SimpleNamespace(predicted=[], probes=PROBES[:2])
    assert free_form.proposed_by(NONE, cast(Any, Model((), 0.0)), looks) == []
    with time_limit(-1.0), pytest.raises(OutOfTimeError):
        free_form.proposed_by(NONE, cast(Any, Model((), 0.0)), looks)


@pytest.mark.parametrize("probe", [FrictionOfPosition, TensionOfRate])
def test_a_law_that_acts_in_a_part_of_its_range_is_as_usual_as_one_that_acts_in_all_of_it(probe: Any) -> None:
    """Beyond a knee it has the usual size after a tenth of the range, where one in proportion has it in the end."""
    knots = np.linspace(0.02, 0.12, probe.knots)
    of: dict[str, Any] = {form.name: form for form in FORMS}
    whole = composed(probe, FittedForm(of["linear"], (1.0,), 0.0), knots)
    part = composed(probe, FittedForm(of["knee_above"], (1.0, 0.1), 0.0), knots)
    usual, steep = (
        next(p for p in effect_of_law(one).parameters if p.name == "slope").typical for one in (whole, part)
    )
    assert usual == pytest.approx(probe.size / 0.1)
    assert steep == pytest.approx(10.0 * usual)
