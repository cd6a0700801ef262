"""Laws fitted to records into which a curve was planted: much of it, and little."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.core.limits import OutOfTimeError, quiet
from fibrefit.discovery import conclusion
from fibrefit.discovery.curves import free_form, predicted
from fibrefit.discovery.curves.free_form import proposing
from fibrefit.discovery.curves.probes import (
    COURSES,
    Curve,
    DampingOfTime,
    FrictionOfPath,
    FrictionOfSpeed,
    FrictionOfTime,
    StiffnessOfCycles,
    StiffnessOfDriveSpeed,
    StiffnessOfTime,
    TensionOfRate,
)
from fibrefit.discovery.engine import effort
from fibrefit.discovery.engine.effort import FAR_BEHIND, PROMISING
from fibrefit.discovery.engine.refit import refit
from fibrefit.discovery.laws import propose, told
from fibrefit.discovery.laws.forms import FORMS, FittedForm
from fibrefit.discovery.laws.places import SECOND, SECOND_VARIABLES
from fibrefit.discovery.laws.propose import Proposal, proposed
from fibrefit.discovery.laws.source import composed, effect_of_law, start_of_law
from fibrefit.discovery.laws.told import ToldLaw, described, holding, law_for, law_over_course
from fibrefit.discovery.search import cross_validation
from fibrefit.discovery.search.cross_validation import LeftOut
from fibrefit.discovery.search.inputs import Confirmation
from fibrefit.discovery.search.setup import prepared_search
from fibrefit.fitting.identify import How, identify
from fibrefit.fitting.result import Identification
from fibrefit.laws.ports import PORTS
from fibrefit.problem.task import Task
from fibrefit.study import load_study
from fibrefit.workflow.prepare import task_of
from tests.discovery.test_free_form import begun_at, identified, measured_of, planted
from tests.discovery.test_pairs import Model
from tests.validation.cases import Case


@pytest.fixture(scope="module")
def found(task: Task) -> Identification:
    """Where the records have been."""
    return identified(task)


@pytest.mark.parametrize(("rise", "route"), [pytest.param(2.0, "_far", marks=pytest.mark.slow), (0.15, "_near")])
def test_a_planted_law_is_found_however_much_of_it_is_missing(
    task: Task, found: Identification, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, rise: float, route: str
) -> None:
    """A friction that is proportional to speed: where it is strong, bounces come at other times."""
    monkeypatch.setattr(predicted, "PROBES", (FrictionOfSpeed, TensionOfRate))
    monkeypatch.setattr(free_form, "COURSES", ())
    for module in (propose, effort):  # each law that is fitted is a program of its own
        monkeypatch.setattr(module, "LAWS_FITTED", 3)
    taken: list[str] = []
    for name in ("_far", "_near"):
        way = getattr(propose, name)
        monkeypatch.setattr(propose, name, lambda *of, name=name, way=way: (taken.append(name), way(*of))[1])
    search = begun_at(planted(task, found, FrictionOfSpeed, rise * np.linspace(0.0, 1.0, FrictionOfSpeed.knots)))
    search = search.with_inference(search.inference.kept_in(tmp_path))
    base, context = search.base.supermodel, search.context
    fit = refit(base, context.subset(()), search.base.fit.local, context.whole)
    parent = search.inference.fitted(base, (), fit.local)
    curves = proposing(search, parent, found, tuple(PORTS))
    proposal = proposed(search, parent, curves)
    assert proposal is not None
    assert set(taken) == {route}
    assert search.gap_left(proposal.best) == pytest.approx(1.0, abs=0.02)
    held = holding(proposal)
    assert held is not None
    without, with_it = held.left_out
    assert with_it < without
    law = described(search, parent, held)
    assert (law.summary.port, law.summary.variables) == ("guide.friction", ("speed",))
    assert law.summary.gap_left_out == with_it
    # The rise over the range that the records saw is that which was planted, whatever the form.
    assert np.ptp(law.heights) == pytest.approx(rise, rel=0.25)

    def done_again(*of: Any) -> None:
        raise AssertionError("a search that is resumed takes it from its journal")

    monkeypatch.setattr(propose, route, done_again)
    monkeypatch.setattr(type(search.inference), "with_curve", done_again)
    monkeypatch.setattr(cross_validation, "_foreseen", done_again)
    resumed = proposed(search, parent, proposing(search, parent, found, tuple(PORTS)))
    assert resumed is not None
    assert [end.log for end, _ in resumed.ranked] == [end.log for end, _ in proposal.ranked]
    kept = holding(resumed)
    assert kept is not None
    assert described(search, parent, kept).summary == law.summary


def test_of_laws_that_are_not_distinguished_the_one_that_foresees_most_of_left_out_records_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    foreseen = {"parent": [-40.0, -60.0], "first": [-39.0, -50.0], "second": [-30.0, -50.0], "far": [-1.0, -1.0]}
    assert _held(monkeypatch, foreseen, {"first": 30.0, "second": 27.0, "far": 20.0}) == "second"


@pytest.mark.parametrize(("foreseen", "there"), [(-51.0, None), (-49.0, "first"), (np.nan, None), (np.inf, None)])
def test_a_law_that_does_not_hold_on_left_out_records_is_not_told(
    monkeypatch: pytest.MonkeyPatch, foreseen: float, there: str | None
) -> None:
    """As of one record with a fault, which a law of one place imitates."""
    assert _held(monkeypatch, {"parent": [-40.0, -60.0], "first": [-50.0, foreseen]}, {"first": 30.0}) == there


def test_a_law_that_no_time_was_left_to_foresee_records_with_is_told_without(monkeypatch: pytest.MonkeyPatch) -> None:
    def late(*of: Any) -> None:
        raise OutOfTimeError

    assert _held(monkeypatch, {"parent": [], "first": []}, {"first": 30.0}, late) == "first"


@pytest.mark.parametrize(("needed", "told_one"), [(0.0, "second"), (28.0, "first")])
def test_a_law_that_gains_less_than_is_needed_is_not_told_for_what_left_out_records_say(
    monkeypatch: pytest.MonkeyPatch, needed: float, told_one: str
) -> None:
    foreseen = {"parent": [0.0, 0.0], "first": [1.0, 1.0], "second": [4.0, 4.0]}
    assert _held(monkeypatch, foreseen, {"first": 30.0, "second": 27.0}, needed=needed) == told_one


def _held(
    monkeypatch: pytest.MonkeyPatch, foreseen: dict[str, list[float]], logs: dict[str, float], left_out: Any = None,
    needed: float = -np.inf,
) -> str | None:  # fmt: skip
    """The law that is told, each with how it foresees two records, in nats."""
    seen = {name: LeftOut(np.ones(2), np.array(nats)) for name, nats in foreseen.items()}
    monkeypatch.setattr(told, "left_out", left_out or (lambda search, one, tell: seen[one.name]))
    fits = [(SimpleNamespace(log=log, name=name), name) for name, log in logs.items()]
    layout = SimpleNamespace(records=("one", "other"))
    search = SimpleNamespace(task=SimpleNamespace(problem=SimpleNamespace(layout=layout)))
    parent = SimpleNamespace(log=0.0, name="parent")
    found = holding(Proposal(cast(Any, search), cast(Any, parent), cast(Any, fits), (), needed=needed))
    return None if found is None else str(found.law)


NEEDED = 200.0
"""Nats that a law needs to do what its curve does."""


@pytest.mark.parametrize(
    ("gain", "about_itself", "objects", "there"),
    [
        (NEEDED + 0.1, 500.0, False, False),  # does as well as it is
        (PROMISING * NEEDED, 500.0, False, False),  # so little that another cause is likelier
        (PROMISING * NEEDED + 0.1, 500.0, False, True),
        (PROMISING * NEEDED + 0.1, 500.0, True, False),
        (NEEDED, NEEDED, False, False),
        (NEEDED, NEEDED + 0.1, False, True),
        (NEEDED, None, False, False),  # inputs are exact, or a motion is lost there
    ],
)
@pytest.mark.parametrize("led", [True, False])
def test_a_law_that_falls_short_of_its_curve_is_seen_with_readings_linearised_about_itself(
    monkeypatch: pytest.MonkeyPatch, gain: float, about_itself: float | None, objects: bool, there: bool, led: bool
) -> None:
    parent, elsewhere, search = Model((), 10.0), Model((), -3.0), SimpleNamespace(inference=None)
    best, near, far = (Model((), 10.0 + gain - behind) for behind in (0.0, FAR_BEHIND - 1.0, FAR_BEHIND + 1.0))

    def seen(here: Any, parent: Any, one: Any) -> Any:
        assert one is best
        own = None if about_itself is None else Model((), elsewhere.log + about_itself)
        if own is None:
            return None, 0.0
        there = Confirmation(cast(Any, search), cast(Any, own), cast(Any, elsewhere), led=led)
        return there, 60.0 if objects else 0.0

    def about(there: Any, one: Any, with_lead: bool) -> Any:
        assert (there, with_lead) == (search, led)
        return Model((), one.log + 1000.0)

    monkeypatch.setattr(propose, "confirmed_where_it_settles", seen)
    monkeypatch.setattr(propose, "fitted_about", about)
    ranked: Any = [(best, "best"), (near, "near"), (far, "far")]
    begun = Proposal(cast(Any, "here"), cast(Any, parent), ranked, ())
    found = propose._about_the_best(begun, NEEDED)
    assert (found is not begun) is there
    if there:
        assert (found.search, found.parent, found.led) == (search, elsewhere, led)
        assert [(law, one.log) for one, law in found.ranked] == [
            ("near", near.log + 1000.0), ("best", elsewhere.log + cast(float, about_itself))
        ]  # fmt: skip


def test_of_laws_seen_about_the_best_none_is_divided_by_an_overdispersion(monkeypatch: pytest.MonkeyPatch) -> None:
    parent, best, raw = Model((), 0.0), Model((), 50.0), Model((), 90.0)
    search = SimpleNamespace(inference=SimpleNamespace(again=lambda one: raw))
    seen = Confirmation(cast(Any, search), cast(Any, Model((), 70.0)), cast(Any, parent), overdispersion=1.3)
    monkeypatch.setattr(propose, "confirmed_where_it_settles", lambda *of: (seen, 0.0))
    begun = Proposal(cast(Any, "here"), cast(Any, parent), cast(Any, [(best, "best")]), ())
    assert propose._about_the_best(begun, 60.0).best is cast(Any, raw)


@pytest.mark.parametrize(
    ("probe", "height"),
    [
        pytest.param(FrictionOfTime, 0.5, marks=pytest.mark.slow),
        pytest.param(FrictionOfPath, 0.15, marks=pytest.mark.slow),
        pytest.param(StiffnessOfTime, 0.01, marks=pytest.mark.slow),
        pytest.param(StiffnessOfCycles, 0.03, marks=pytest.mark.slow),
        pytest.param(DampingOfTime, 0.3, marks=pytest.mark.slow),
    ],
)
def test_a_law_over_the_course_of_a_record_is_found(
    task: Task, found: Identification, probe: type[Curve], height: float
) -> None:
    """What grows in proportion to the time, to the path, or to the load cycles."""
    search = begun_at(planted(task, found, probe, height * np.linspace(0.0, 1.0, probe.knots)))
    base, context = search.base.supermodel, search.context
    fit = refit(base, context.subset(()), search.base.fit.local, context.whole)
    parent = search.inference.fitted(base, (), fit.local)
    law = law_over_course(search, parent, found, ())
    assert law is not None
    told_of, curves = law[0].told, law[1]
    assert (told_of.curve, curves[0].probe) == (probe.says, probe)
    assert told_of.summary.gap_after == pytest.approx(1.0, abs=0.03)
    # A curve over a state that gains more comes first.
    assert law_over_course(search, parent, found, [cast(Any, SimpleNamespace(gain=np.inf))]) is None


def test_records_without_it_have_no_law_over_their_course(task: Task, found: Identification) -> None:
    search = begun_at(planted(task, found, FrictionOfTime, np.zeros(FrictionOfTime.knots)))
    parent = search.inference.fitted(search.base.supermodel, (), search.base.fit.local)
    assert law_over_course(search, parent, found, ()) is None


@pytest.mark.slow
def test_a_stiffness_over_the_speed_of_the_drive_is_told_from_others_over_the_course(tmp_path: Path) -> None:
    """By records of the independent simulator."""
    effect = "open.drive_speed_stiffness"
    Case("drive speed", "outside", "pulley_drive", 0, "pink", 0.0, 2000.0, effect, tuning=True).write(tmp_path)
    task = task_of(load_study(tmp_path))
    before = identify(task, 2, 0, How(whiten=False, rivals=False))
    search, base = prepared_search(task, before, (), quiet)
    curves = proposing(search, base, before, ("fibre",), COURSES)
    assert curves[0].probe is StiffnessOfDriveSpeed
    proposal = proposed(search, base, curves)
    assert proposal is not None
    law = proposal.ranked[0][1]
    assert law.probe is StiffnessOfDriveSpeed
    assert "moment.drive_speed" in law.source


@pytest.mark.slow
@pytest.mark.parametrize(("change", "second"), [(0.8, "direction"), (0.0, "")])
def test_a_law_that_changes_with_a_second_variable_is_told_with_it(
    task: Task, found: Identification, change: float, second: str
) -> None:
    """A friction that grows with the speed, upwards faster than downwards; alike both ways as the negative control."""
    knots, rise = np.linspace(0.0, 0.5, FrictionOfSpeed.knots), 4.0
    linear = FittedForm(next(form for form in FORMS if form.name == "linear"), (rise,), 0.0)
    direction = next(one for one in SECOND_VARIABLES if one.variable == "direction")
    law = composed(FrictionOfSpeed, linear, knots, (), direction, 1.0)
    base = begun_at(task, (effect_of_law(law),)).base  # type: ignore[arg-type]
    local = base.fit.local.copy()
    for name, value in (start_of_law(law) | {f"{law.name}.{SECOND.name}": change}).items():
        local[:, base.supermodel.names.index(name)] = value
    search = begun_at(measured_of(task, base.supermodel, local, 4))
    base, context = search.base.supermodel, search.context
    fit = refit(base, context.subset(()), search.base.fit.local, context.whole)
    parent = search.inference.fitted(base, (), fit.local)
    curves = proposing(search, parent, found, tuple(PORTS), (FrictionOfSpeed,))
    told_of = law_for(search, parent, found, curves)
    assert told_of is not None
    summary = told_of.told.summary
    assert (summary.port, summary.variables) == ("guide.friction", ("speed", second) if second else ("speed",))
    assert summary.gap_after == pytest.approx(1.0, abs=0.02)
    if second:
        value = summary.parameters[SECOND.name]
        assert value.std_error is not None
        assert abs(value.value - change) < 4.0 * value.std_error
        assert "(1 + d y)" in summary.expression
        assert "changes with the direction" in summary.says


@pytest.mark.parametrize(
    ("of_state", "objects", "course", "told"),
    [
        (None, False, 20.0, "course"),
        (30.0, False, 40.0, "state"),
        (30.0, True, 40.0, "course"),
        (30.0, True, 20.0, "state"),
    ],
)
def test_a_more_probable_law_over_the_course_is_looked_for_where_a_test_objects_to_one_over_a_state(
    monkeypatch: pytest.MonkeyPatch, of_state: float | None, objects: bool, course: float, told: str
) -> None:
    def law(name: str, evidence: float) -> ToldLaw:
        there: Any = f"search of {name}"
        return ToldLaw(there, cast(Any, name), cast(Any, SimpleNamespace(summary=SimpleNamespace(evidence=evidence))))

    def alarms(search: Any, one: Any) -> list[str]:
        # A law is tested in the search that it was found in: readings are linearised there.
        assert one is best or search == f"search of {one}"
        return ["objects"] if one is best or (one == "state" and objects) else []

    best: Any = SimpleNamespace(effects=())
    monkeypatch.setattr(conclusion, "alarms_of", alarms)
    monkeypatch.setattr(conclusion, "law_for", lambda *of: None if of_state is None else law("state", of_state))
    monkeypatch.setattr(conclusion, "law_over_course", lambda *of: (law("course", course), ["course curve"]))
    parts = conclusion._Parts(cast(Any, SimpleNamespace(left=100.0)))
    at = SimpleNamespace(search=SimpleNamespace(tell=quiet), best=best, law=None, curves=["curve"])
    _, _, found, curves = conclusion._left_beside(parts, cast(Any, at), best, cast(Any, None))
    assert found is not None
    assert found.fit == told
    assert curves == (["course curve"] if told == "course" else ["curve"])


@pytest.mark.parametrize(("gain", "needed"), [(20.0, 25.0), (60.0, 66.0), (4e5, 4.4e5)])
def test_a_curve_takes_a_name_only_by_a_share_of_what_that_explains(
    monkeypatch: pytest.MonkeyPatch, gain: float, needed: float
) -> None:
    """Any curve over the force holds an offset of the gauge: what it bends to beside does not undo the name."""
    asked: list[float] = []
    shared: Any = SimpleNamespace(sensitivities=None)
    base, best = (cast(Any, SimpleNamespace(supermodel=shared, log=log)) for log in (0.0, gain))
    search: Any = SimpleNamespace(inference=SimpleNamespace(again=lambda one: one))
    monkeypatch.setattr(conclusion, "probe_all", lambda search, base, before, worth, least: asked.append(worth) or [])
    assert conclusion._outdone(search, base, best, cast(Any, None)) is None
    assert asked == [pytest.approx(needed)]
