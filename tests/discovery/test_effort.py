"""Every number that says how far a search looks is what it is: with twice or half of it, it would look elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import Mock, patch

import numpy as np
import pytest

from fibrefit.core.limits import Budget, check_time, time_left
from fibrefit.discovery import discover, final_fit, forward_selection
from fibrefit.discovery.conclusion import _Parts
from fibrefit.discovery.engine import effort
from fibrefit.discovery.search import inputs, setup, starts
from fibrefit.discovery.search.time_budget import kept_for_conclusion, time_to_use
from fibrefit.laws.catalogue import find_effect
from tests.brackets import Bracket, thresholds

COSTS = (0.0, *[90.0] * 10)
"""Of candidates on a model whose cost is 100: one takes nearly all of it, the others a tenth."""
LOGS = (50.0, *[-200.0] * 10)
"""Nats of candidates, the others far behind the first."""


def curve_goes_on_after(steps: int, last: float = 1.0) -> bool:
    """Whether a free curve is followed beyond so many evaluations, the last ones of which took such a share of all."""
    found = SimpleNamespace(steps=steps, objective=-1e6)
    return effort.curve_descent(0.0)["effort"].goes_on(found, [-1e6 * (1.0 - last)] * steps)


def goes_on_after(steps: int) -> bool:
    """Whether a parent is followed further from where a candidate led, after so many evaluations."""
    return effort.warm_start()["effort"].goes_on(SimpleNamespace(steps=steps, objective=0.0), ())


def differing(log: float, samples: float = 1e4) -> Any:
    """A hypothesis of records that differ, so probable by so many samples."""
    supermodel = SimpleNamespace(samples=np.array([samples]))
    return SimpleNamespace(
        log=log, supermodel=supermodel, evidence=SimpleNamespace(mode=SimpleNamespace(sigma=np.ones(1)))
    )


def linearised_anew(ends: Sequence[Any], gap: float = 1.0, led: Any = None) -> tuple[int, int, Any]:
    """How often readings are linearised anew and led, and where that ends, if it comes to these one after another."""
    search: Any = SimpleNamespace(gap_left=lambda _: gap)
    with (
        patch.object(inputs, "relinearised", Mock(side_effect=[(search, end) for end in ends])) as relinearised,
        patch.object(inputs, "horizon_by_horizon", Mock(return_value=led and (search, led))) as leads,
    ):
        _, end, _ = inputs._until_it_gains_no_more(search, differing(0.0))
    return relinearised.call_count, leads.call_count, end


def linearised(times: int) -> bool:
    """Whether readings that go on to make a hypothesis more probable are linearised as often as that."""
    return linearised_anew([differing(100.0 * i) for i in range(1, 20)])[0] >= times


def follows_bounces(gap: float) -> bool:
    """Whether readings of a fit with noisy inputs that leaves so much are taken whole."""
    before = SimpleNamespace(input_errors={"drive": 1.0}, gap={"force": gap}, expected_gap=1.0)
    with patch.object(setup, "total", lambda gap: gap["force"]):
        return not setup.is_far(cast(Any, before))


def left_to_follow(predicted: float) -> bool:
    """Whether an effect of which so much is predicted is followed beside one that gains a hundred nats."""
    drag, nothing = find_effect("guide.quadratic_drag"), cast(Any, None)
    return starts.is_left_to_follow(starts.EffectStart(predicted, drag, nothing, nothing, nothing), 100.0)


def first_starts() -> int:
    """Starts that a search gives the fit of its first model."""
    stopped = Mock(side_effect=KeyboardInterrupt)
    with patch.object(discover, "identify", stopped), suppress(KeyboardInterrupt):
        discover.discover(cast(Any, SimpleNamespace(noisy_inputs=("drive",))), ())
    return int(stopped.call_args.args[1])


def final_starts() -> int:
    """Starts that a conclusion gives the fit of what was found, with time for all."""
    stopped, best = Mock(side_effect=KeyboardInterrupt), cast(Any, SimpleNamespace(effects=("one",)))
    none, limits = cast(Any, None), cast(Any, SimpleNamespace(seed=0))
    with patch.object(final_fit, "final_fit", stopped), suppress(KeyboardInterrupt):
        final_fit.fit_of_found(none, best, none, limits, Budget(100.0), 0.0)
    return int(stopped.call_args.args[2])


CASES = (
    Bracket("TOO_FAR", setup, follows_bounces, 1.3, 1.5),
    Bracket("MOTION_LOST", effort, lambda x: not effort.motion_lost(1.0, x), 1.05, 1.15),
    Bracket("LED", effort, lambda x: effort.leads_through(100.0 * x, 100.0), 0.45, 0.55),
    Bracket("MET", effort, lambda x: effort.meets_all_bounces(100.0 * x**2, 100), 2.9, 3.1),
    Bracket("HOPE", effort, lambda x: effort.may_be_worth(9.0 - x, 9.0), 2.0, 4.0),
    Bracket("FIRST_STARTS", discover, lambda x: x <= first_starts(), 8.0, 9.0),
    Bracket("FIRST_FIT", effort, lambda x: not effort.first_fit_ends(100.0 * x, 100.0), 0.25, 0.35),
    Bracket("SETTLES", effort, lambda x: effort.settles(100.0, 100.0 * x), 0.4, 0.6),
    Bracket("NEARLY", effort, effort.slopes_tell, 1.05, 1.15),
    Bracket("WRONG_MINIMUM", effort, lambda x: not effort.in_wrong_minimum(-x, 0.0), 7.0, 9.0),
    Bracket("LEAST_FALL", effort, lambda x: x < effort.descent()["tolerance"], 0.19, 0.21),
    Bracket("PATIENCE_OF_DESCENT", effort, lambda x: x < effort.descent()["effort"].patience, 9.0, 10.0),
    Bracket("CURVE_STEPS", effort, lambda x: curve_goes_on_after(int(x)), 29.0, 30.0),
    Bracket("CURVE_PATIENCE", effort, lambda x: curve_goes_on_after(int(x), 0.0), 5.0, 6.0),
    Bracket("CURVE_SHARE", effort, lambda x: curve_goes_on_after(9, x), 0.03, 0.01),
    Bracket("WARM_START_STEPS", effort, lambda x: goes_on_after(int(x)), 9.0, 10.0),
    Bracket("CONTINUATION_STEPS", effort, lambda x: len(effort.continuation_steps()) >= x, 3.0, 4.0),
    Bracket("LINEARISED_ANEW", inputs, lambda x: linearised(int(x)), 6.0, 7.0),
    Bracket("NOISES", effort, lambda x: effort.noise_is_taken_again(int(x), False, lambda: True), 1.0, 2.0),
    Bracket("NOISES_OF_STEPS", effort, lambda x: effort.noise_is_taken_again(int(x), True, lambda: False), 4.0, 5.0),
    Bracket("PROMISING", effort, lambda x: effort.promising(100.0, (*[0.0] * 4, 100.0 * (1.0 - x)))[4], 0.6, 0.4),
    Bracket("INSTANTS_MOVED", effort, lambda x: effort.instants_are_looked_for(int(x), 100.0), 2.0, 3.0),
    Bracket("VALLEYS", effort, lambda x: effort.is_followed_elsewhere(int(x)), 3.0, 4.0),
    Bracket("HARDLY", starts, lambda x: left_to_follow(100.0 * x), 0.07, 0.04),
    Bracket("REFITTED", effort, lambda x: effort.promising(100.0, COSTS)[int(x)], 3.0, 4.0),
    Bracket("FOLLOWED_AT_ONCE", effort, lambda x: x <= len(effort.followed_in_turn(range(99))[0]), 8.0, 9.0),
    Bracket("INSTEAD", effort, lambda x: effort.is_followed_instead(int(x)), 5.0, 6.0),
    Bracket("WIDELY", effort, lambda x: effort.is_searched_widely(int(x)), 3.0, 4.0),
    Bracket("COMPARED", effort, lambda x: effort.compared_again(LOGS, True)[int(x)], 2.0, 3.0),
    Bracket("FAR_BEHIND", effort, lambda x: effort.compared_again((50.0,) * 3 + (50.0 - x,), True)[3], 25.0, 35.0),
    Bracket("PARTNERS", effort, lambda x: effort.is_partner(int(x)), 7.0, 8.0),
    Bracket(
        "STEADY_LIMIT", effort, lambda x: effort.strengths_converged(np.ones(2), np.array([1.0, 1.0 + x])), 0.09, 0.11
    ),
    Bracket("IN_SEVERAL", effort, lambda x: not effort.happens_in_several(int(x)), 1.0, 2.0),
    Bracket("CURVES_WITH_LAWS", effort, lambda x: effort.proposes_laws(int(x)), 2.0, 3.0),
    Bracket("LAWS_FITTED", effort, lambda x: int(x) in effort.laws_in_turn((range(99),)), 5.0, 6.0),
    Bracket("FINAL_STARTS", final_fit, lambda x: x <= final_starts(), 3.0, 4.0),
    Bracket("FINAL_SPREAD", effort, lambda x: x < effort.final_spread(("mass",))["mass"], 1.005, 1.015),
    Bracket("STARTS_NEED", effort, lambda x: effort.time_for_starts(100.0 * x, 100.0), 10.5, 9.5),
    Bracket("LOOKING", effort, lambda x: 100.0 * x < effort.looking_time(100.0), 0.75, 0.85),
    Bracket("PROBING", effort, lambda x: 100.0 * x < effort.probing_time(100.0), 0.25, 0.35),
    Bracket("COURSE", effort, lambda x: 100.0 * x < effort.course_time(100.0), 0.25, 0.35),
    Bracket("SECOND_LOOK", effort, lambda x: 100.0 * x < effort.second_look_time(100.0), 0.45, 0.55),
    Bracket("SIDE_SEARCH", effort, lambda x: 100.0 * x < effort.side_search_time(100.0), 0.55, 0.65),
    Bracket("GLS_NEEDS", effort, lambda x: effort.time_for_gls(100.0 * x, 100.0), 0.35, 0.25),
)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_search_turns_there(case: Bracket, monkeypatch: pytest.MonkeyPatch) -> None:
    case.test(monkeypatch)


def test_records_of_what_is_far_behind_are_not_looked_for_in_other_minima() -> None:
    assert effort.may_be_better_elsewhere(1050.0, 1000.0)
    assert not effort.may_be_better_elsewhere(1070.0, 1000.0)
    assert effort.may_be_better_elsewhere(1e6, np.inf)


def test_no_number_is_without_a_case() -> None:
    assert thresholds(effort) == {case.name for case in CASES}


@pytest.mark.parametrize(
    ("gains", "gap", "often"),
    [
        ((4.0,), 1.0, (1, 0)),  # at rest
        ((-400.0,), 1.0, (1, 0)),
        ((100.0, 4.0), 1.0, (2, 0)),
        ((100.0, 100.0, 4.0), 1.0, (3, 1)),  # led the second time, and once
        ((100.0, 100.0, 100.0, 4.0), 1.0, (4, 1)),
        ((100.0,), 1.2, (1, 1)),  # at once where much is left, which is the end of it
        ((4.0,), 1.2, (1, 0)),
    ],
)
def test_readings_are_linearised_until_that_gains_no_more(
    gains: Sequence[float], gap: float, often: tuple[int, int]
) -> None:
    ends = [differing(float(log)) for log in np.cumsum(gains)]
    assert linearised_anew(ends, gap) == (*often, ends[-1])


def test_samples_that_count_no_more_are_no_gain() -> None:
    # A hundred samples less: noise costs half a nat for each.
    ends = [differing(50.0, 1e4 - 100.0)]
    assert linearised_anew(ends) == (1, 0, ends[0])


def test_where_a_lead_ends_is_gone_on_from() -> None:
    there = differing(1000.0)
    ends = [differing(100.0), differing(200.0), differing(1004.0)]
    assert linearised_anew(ends, led=there) == (3, 1, ends[-1])
    # Without it, the third would have gained.
    assert linearised_anew([*ends, differing(1005.0)])[0] == 4


@pytest.mark.parametrize(
    ("logs", "taken"), [((1.0, 2.0, 101.0), True), ((1.0, 200.0, 99.0), False), ((1.0, None), False)]
)
def test_a_lead_is_taken_where_it_is_more_probable_in_the_end(logs: Sequence[float | None], taken: bool) -> None:
    far, near = SimpleNamespace(far=True), SimpleNamespace(far=False)
    counts = np.arange(1, 1 + len(logs))[:, None]
    search: Any = SimpleNamespace(gap_left=lambda _: 1.0, context=SimpleNamespace(counts=counts))
    begun = differing(100.0)
    begun.supermodel.sensitivities = near
    ends = [None if log is None else (search, differing(log), False) for log in logs]
    with patch.object(inputs, "_relinearised", Mock(side_effect=ends)) as anew:
        found = inputs.horizon_by_horizon(search, begun)
        assert [int(call.kwargs["counts"][0]) for call in anew.call_args_list] == list(range(1, 1 + len(logs)))
        assert (found is not None) == taken
        begun.supermodel.sensitivities = far
        assert inputs.horizon_by_horizon(search, begun) is None


def test_a_candidate_behind_one_without_a_name_is_not_compared_again() -> None:
    assert effort.compared_again((1.0, 0.9, 0.8, 0.7), False) == [True, True, True, False]


def test_a_motion_is_lost_where_far_more_is_left_than_before() -> None:
    assert effort.motion_lost(1.0, 1.2)
    assert not effort.motion_lost(1.0, 1.05)
    assert not effort.motion_lost(3.0, 1.2)


@pytest.mark.parametrize(
    ("first", "named", "kept"),
    [(3.0, False, 60.0), (3.0, True, 30.0), (40.0, False, 60.0), (40.0, True, 60.0), (90.0, True, 105.0)],
)
def test_the_conclusion_is_given_what_the_first_fit_says_it_takes(first: float, named: bool, kept: float) -> None:
    assert kept_for_conclusion(first, 300.0, named) == pytest.approx(kept)


@pytest.mark.parametrize(("effects", "more"), [((), 30.0), (("one",), 10.5 + 5.0)])
def test_time_for_curves_and_a_law_is_kept_while_nothing_is_named(
    monkeypatch: pytest.MonkeyPatch, effects: tuple[str, ...], more: float
) -> None:
    """With an effect, that for a final fit of what is three times slower to simulate, and for making its program."""
    monkeypatch.setattr(forward_selection, "slowdown", lambda search, best: 3.0)
    monkeypatch.setattr(forward_selection, "longest_compilation", lambda: 5.0)
    at, before = (
        cast(Any, SimpleNamespace(search=None, best=SimpleNamespace(effects=effects))),
        SimpleNamespace(running=9.0),
    )
    assert forward_selection._more_to_conclude(at, cast(Any, before), 300.0) == pytest.approx(more)


def test_a_search_ends_within_the_time_given_with_the_steps_it_takes_after_its_last_look_at_the_clock() -> None:
    latest = 19.8  # s beyond its limit, the most that was measured on a machine without other work
    assert 270.0 < time_to_use(300.0) <= 300.0 - latest


def test_parts_of_a_conclusion_leave_what_the_final_fit_takes() -> None:
    """Half of what is left goes to a part, and none of what is kept."""
    budget = Budget(100.0)
    assert _Parts(budget).take("curves", time_left, 0.0) == pytest.approx(50.0, abs=1.0)
    assert _Parts(budget, kept=80.0).take("curves", time_left, 0.0) == pytest.approx(10.0, abs=1.0)
    short = _Parts(budget, kept=120.0)
    assert short.take("curves", lambda: check_time() or 1.0, 0.0) == 0.0
    assert short.undone == ["curves"]


@dataclass(frozen=True)
class Begun:
    """A first fit, as far as its minima are compared."""

    checks: Any
    starts: Any
    plain: Any
    input_errors: tuple[str, ...] = ("drive",)


@pytest.mark.parametrize(("log", "nats"), [(80.0, 20.0), (114.0, -14.0)])
def test_minima_of_a_first_fit_are_held_against_the_one_that_is_reported(
    monkeypatch: pytest.MonkeyPatch, log: float, nats: float
) -> None:
    """One that is more probable once errors of the inputs are eliminated says that a better one was missed."""
    base, other = (
        SimpleNamespace(log=nats, shared={"k": stiffness}, errors={"k": 0.1})
        for nats, stiffness in ((100.0, 1.0), (log, 2.0))
    )
    told = list[float]()
    starts = SimpleNamespace(others=lambda: [np.array([2.0])])
    plain = SimpleNamespace(values=np.array([1.0]), errors=np.array([0.1]))
    check = SimpleNamespace(identifier=setup.AGREED, passed=True)

    def agree(starts: Any, noise: bool, nats: float) -> Any:
        told.append(nats)
        return check

    monkeypatch.setattr(setup, "undecided", lambda *of: True)
    monkeypatch.setattr(setup, "_local", lambda *of: None)
    monkeypatch.setattr(setup, "starts_agree", agree)
    monkeypatch.setattr(setup, "check", lambda identifier, found: found)
    inference = SimpleNamespace(fitted=lambda *of: other)
    search: Any = SimpleNamespace(
        inference=inference, base=SimpleNamespace(supermodel=None), task=None, tell=lambda *of: None
    )
    best, _ = setup.minima_compared(search, cast(Any, base), cast(Any, Begun((check,), starts, plain)))
    assert told == [nats]
    assert best is (base if nats > 0.0 else other)
