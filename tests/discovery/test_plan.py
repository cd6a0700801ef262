"""Which record to take next."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import least_squares

from fibrefit.core.errors import StudyError, UsageError
from fibrefit.discovery.design import apart as contests
from fibrefit.discovery.design import grams as of_records
from fibrefit.discovery.design import plan as module
from fibrefit.discovery.design.apart import Contest, Explanation, nats_apart
from fibrefit.discovery.design.beside import Beside, relative_changes
from fibrefit.discovery.design.distinguish import detectable
from fibrefit.discovery.design.grams import (
    as_simulated,
    changed_values,
    menu_grams,
    projected,
    read_exactly,
    sizes_of,
    strengths_of,
)
from fibrefit.discovery.design.plan import (
    Standing,
    Worth,
    _errors,
    _worth,
    by_worth,
    just_found,
    options_of,
    worths,
)
from fibrefit.discovery.engine.thresholds import APART, PRICE
from fibrefit.discovery.model.finding import Choice
from fibrefit.discovery.search.search import Search
from fibrefit.discovery.search.setup import set_up
from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.plots.plan import plan_figures
from fibrefit.problem.inputs.sensitivities import Directions, InputSensitivities
from fibrefit.problem.noise.coloured import BLOCK, BlockFilter
from fibrefit.problem.task import Task
from fibrefit.report.any import report_of
from fibrefit.report.sentences.discovery import further_record
from fibrefit.study.summaries.discovery import PlanSummary
from fibrefit.study.summaries.files import summary_of
from fibrefit.workflow.design import plan as workflow
from fibrefit.workflow.design import rivals as at_hand
from fibrefit.workflow.design.plan import MINUTES, Aim, RecordPlan, _minutes, _sentence, plan_study
from tests.discovery.made import BASE, differing
from tests.discovery.test_menu import PARAMETERS
from tests.study.test_summaries import EXAMPLES

RIVALS = (CATALOGUE["guide.viscous_friction"], CATALOGUE["guide.quadratic_drag"])
PLANNED = f"""
schema = "fibrefit/study/1"
name = "two drops"
[rig]
kind = "fibre_mass"
weight_mass = "3.096 kg"
inclination = "60 deg"
{PARAMETERS}"""
RECORD = """
[[records]]
name = "{name}"
lift = "{lift} mm"
sampling_rate = "2 kHz"
duration = "0.5 s"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("planned")
    records = "".join(RECORD.format(name=f"drop {lift}", lift=lift) for lift in (2, 4))
    (folder / "study.toml").write_text(PLANNED + records, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def plan(folder: Path) -> RecordPlan:
    rivals = ("guide.viscous_friction", "guide.quadratic_drag")
    return plan_study(folder, Aim(rivals=rivals, only=rivals))


def test_a_faster_drop_tells_drag_from_viscous_friction_better_than_one_more_of_the_same(plan: RecordPlan) -> None:
    nats = {i: worth.nats for i, (worth, _) in enumerate(plan.further)}
    looked = sum(worth.refitted for worth, _ in plan.further)
    assert f"fitted to {looked} of {len(nats)} further records" in plan.summary().remarks[-1]
    fastest = max((worth for worth, _ in plan.further if worth.refitted), key=lambda worth: worth.nats)
    assert fastest.choice.conditions["lift"] == pytest.approx(6e-3)
    again = next(worth for worth, _ in plan.further if not worth.choice.conditions)
    assert fastest.nats > 2.0 * again.nats
    # No record can take away what those at hand say.
    assert min(nats.values()) >= np.min(plan.standing.nats) * (1.0 - 1e-6)


def test_of_records_that_tell_rivals_apart_as_surely_the_cheapest_comes_first(plan: RecordPlan) -> None:
    most = max(worth.distinguished for worth, _ in plan.further if worth.refitted)
    shown = [round(min(worth.distinguished, most), 2) for worth, _ in plan.further]
    assert shown == sorted(shown, reverse=True)
    for share in set(shown):
        as_sure = [minutes for (_, minutes), known in zip(plan.further, shown, strict=True) if known == share]
        assert as_sure == sorted(as_sure)
    # What comes first has been looked into.
    assert plan.further[0][0].refitted


def test_error_bars_fall_with_every_record_and_by_a_root_of_two_at_most_where_it_is_repeated(plan: RecordPlan) -> None:
    for worth, _ in plan.further:
        assert set(worth.errors) == {"stiffness", "damping", "friction"}
        assert all(0.0 < factor < 1.0 + 1e-6 for factor in (*worth.errors.values(), *worth.limits.values()))
        if not worth.choice.conditions:
            assert min(worth.errors.values()) > math.sqrt(0.5) - 1e-6


def test_a_plan_is_a_result_like_all_others(plan: RecordPlan, tmp_path: Path) -> None:
    place = plan.save(tmp_path / "plan")
    summary = summary_of((place / "summary.json").read_bytes(), "summary.json")
    assert isinstance(summary, PlanSummary)
    assert summary == plan.summary().model_copy(update={"provenance": summary.provenance})
    assert (place / "figures" / "plan.png").is_file()
    text = report_of(summary)
    assert max(map(len, text.splitlines())) <= 80
    assert "The next record" in text
    assert summary.further[0].says.split(":")[0] in " ".join(text.split())
    figures = plan_figures(summary)
    assert set(figures) == {"plan"}
    names = [text.get_text() for text in figures["plan"].axes[0].get_yticklabels()]
    assert len(set(names)) == len(names) == len(summary.further[:12])
    assert not any("\N{HORIZONTAL ELLIPSIS}" in name for name in names)


def test_what_is_asked_for_in_vain_is_refused_before_any_fit(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fibrefit.workflow.design.plan.is_planned", lambda study: pytest.fail("it went on to fit"))
    with pytest.raises(UsageError, match="none are known"):
        plan_study(folder, Aim(purpose="rivals"))
    with pytest.raises(UsageError, match="expected two effects"):
        plan_study(folder, Aim(rivals=("guide.viscous_friction",)))
    with pytest.raises(UsageError, match="expected two effects"):
        plan_study(folder, Aim(rivals=("guide.viscous_friction", "guide.stribeck_friction", "guide.viscous_friction")))
    with pytest.raises((UsageError, StudyError), match="not in the catalogue"):
        plan_study(folder, Aim(rivals=("guide.viscous_friction", "guide.vicous")))
    for name in ("nothing", "lfit"):
        says = f'cost of "{name}": no condition of a record; expected one of .*inclination, lift, .*record'
        with pytest.raises(UsageError, match=says) as refused:
            plan_study(folder, Aim(minutes={name: 3.0}))
        assert ('Did you mean "lift"?' in str(refused.value)) is (name == "lfit")
    for name, minutes in {"record": -1.0, "lift": math.inf, "preload": math.nan}.items():
        says = f'cost of "{name}": {minutes:g} minutes; expected a number of minutes, 0 or more'
        with pytest.raises(UsageError, match=says):
            plan_study(folder, Aim(minutes={name: minutes}))


def test_a_rig_whose_further_records_are_all_alike_is_refused(tmp_path: Path) -> None:
    """A pendulum swings as it was let go, and nothing drives it."""
    head = PLANNED.partition("[rig]")[0] + '[rig]\nkind = "pendulum"\nmoment_of_inertia = "0.2 kg m^2"\n'
    times = np.arange(2000) / 200.0
    table = np.column_stack([times, 0.2 * np.exp(-0.1 * times) * np.cos(5.7 * times)])
    np.savetxt(tmp_path / "swing.csv", table, "%.6f", ",", header="time [s],angle [rad]", comments="")
    (tmp_path / "study.toml").write_text(f'{head}[[records]]\nfile = "swing.csv"\n', encoding="utf-8")
    with pytest.raises(StudyError, match="a rig pendulum; expected one whose further records could differ"):
        plan_study(tmp_path, Aim())


def test_a_record_of_which_only_a_measurement_tells_how_it_begins_cannot_be_planned(tmp_path: Path) -> None:
    """Nothing in a study says from where a pendulum is let go: planned, it would hang still."""
    head = PLANNED.partition("[rig]")[0] + '[rig]\nkind = "pendulum"\nmoment_of_inertia = "0.2 kg m^2"\n'
    values = {"length": "0.3 m", "damping": "0.01 N m s", "friction": "0.001 N m"}
    parameters = "".join(f'[parameters.{name}]\ninitial = "{value}"\n' for name, value in values.items())
    record = RECORD.format(name="swing", lift=0).replace('lift = "0 mm"\n', "")
    (tmp_path / "study.toml").write_text(head + parameters + record, encoding="utf-8")
    says = "planned records of a pendulum; expected records that were measured: only they tell how the motion begins"
    with pytest.raises(StudyError, match=says):
        plan_study(tmp_path, Aim())


def test_the_probability_to_tell_rivals_apart() -> None:
    planned = Standing(0.0).distinguished
    assert planned(0.0) == planned(float("nan")) == 0.0
    assert planned(APART) == pytest.approx(0.5)
    assert planned(8.0 * APART) > 0.99
    # Twice the log of the ratio of two normals a distance d apart, drawn from one of them.
    d = 4.0
    draws = np.random.default_rng(3).standard_normal(200_000)
    share = np.mean(0.5 * d**2 + d * draws > APART)
    assert planned(0.5 * d**2) == pytest.approx(share, abs=5e-3)


def test_a_rival_with_more_parameters_pays_for_them_where_nothing_is_measured() -> None:
    assert Standing(0.0, price=4.0).distinguished(APART + 4.0) == pytest.approx(0.5)
    viscous, stribeck = CATALOGUE["guide.viscous_friction"], CATALOGUE["guide.stribeck_friction"]
    more = len(stribeck.parameters) - len(viscous.parameters)
    assert module._price_of_more([Explanation(viscous, {}), Explanation(stribeck, {})]) == PRICE * more
    assert module._price_of_more([]) == module._price_of_more([Explanation(viscous, {})] * 2) == 0.0


@pytest.mark.parametrize("ahead", [-6.0, 0.0, 3.0])
def test_what_is_measured_is_known_and_only_the_further_record_is_left_to_chance(ahead: float) -> None:
    """Draws of which rival is right, as probable as the records make it, and then of the further record's ratio."""
    rng, added = np.random.default_rng(5), 4.0
    first = rng.random(400_000) < 1.0 / (1.0 + np.exp(-ahead))
    ratio = ahead + np.where(first, added, -added) + np.sqrt(2.0 * added) * rng.standard_normal(len(first))
    right = np.where(first, ratio, -ratio) > APART
    standing = Standing(10.0, ahead)
    assert standing.distinguished(10.0 + added) == pytest.approx(right.mean(), abs=3e-3)
    assert standing.now is None
    # Each way round what is added is its own: where the second one is true this record adds nothing.
    right = np.where(first, ratio, -ahead) > APART
    assert Standing((10.0, 2.0), ahead).distinguished((10.0 + added, 2.0)) == pytest.approx(right.mean(), abs=3e-3)
    # A record that adds nothing leaves them as they are.
    share = 1.0 / (1.0 + np.exp(-abs(ahead)))
    assert standing.distinguished(10.0) == pytest.approx(share if abs(ahead) > APART else 0.0)


def test_standard_errors_are_those_of_least_squares_with_what_is_each_records_own() -> None:
    rng = np.random.default_rng(1)
    rows = [rng.standard_normal((40, 3)) for _ in range(2)]
    found = _errors(np.stack([a.T @ a for a in rows]), 2, 1)
    whole = np.zeros((80, 4))
    for r, a in enumerate(rows):
        whole[40 * r : 40 * (r + 1), :2], whole[40 * r : 40 * (r + 1), 2 + r] = a[:, :2], a[:, 2]
    np.testing.assert_allclose(found, np.sqrt(np.diag(np.linalg.inv(whole.T @ whole)))[:2], rtol=1e-10)


def test_costs_are_those_of_a_record_and_of_conditions_that_none_has() -> None:
    conditions = {"lift": np.array([0.01, 0.02]), "inclination": np.array([1.0, 1.0])}
    times = np.tile(np.arange(500.0), (2, 1))
    taken: Any = SimpleNamespace(conditions=conditions, times=times, count=np.array([121, 121]))
    same, steeper = Choice(0, {"lift": 0.02, "inclination": 1.0}), Choice(0, {"lift": 0.02, "inclination": 0.5})
    assert _minutes(same, taken, MINUTES) == MINUTES["record"]
    assert _minutes(steeper, taken, MINUTES) == MINUTES["record"] + MINUTES["inclination"]
    assert _minutes(steeper, taken, {**MINUTES, "inclination": 60.0}) == MINUTES["record"] + 60.0
    # A motion of two minutes at half its pace takes two minutes longer; a faster one is held where it ends.
    assert _minutes(Choice(0, {}, pace=0.5), taken, MINUTES) == pytest.approx(MINUTES["record"] + 2.0)
    assert _minutes(Choice(0, {}, pace=2.0), taken, MINUTES) == MINUTES["record"]


def test_a_choice_in_words() -> None:
    assert further_record("a.csv", Choice(0, {})) == "a.csv once more"
    said = "A record like a.csv with its input run 1.5 times as fast"
    assert further_record("a.csv", Choice(0, {}, pace=1.5)) == said
    assert Worth(Choice(0, {}), {"a": 0.5, "b": 2.0}, {}).error == pytest.approx(1.0)


def test_a_parameter_beside_another_that_does_the_same_is_not_determined() -> None:
    rng = np.random.default_rng(2)
    a, b = rng.standard_normal((2, 40))
    found = _errors(np.stack([np.stack([a, a, b]) @ np.stack([a, a, b]).T]), 3, 0)
    assert np.isinf(found[:2]).all()
    assert np.isfinite(found[2])


def of_grams(at_hand: np.ndarray, further: np.ndarray) -> Worth:
    """What a record adds, of Gram matrices of one base parameter and two effects."""
    context = SimpleNamespace(base=("stiffness",), each=())
    search: Any = SimpleNamespace(context=context, effects=(SimpleNamespace(name="a"), SimpleNamespace(name="b")))
    return _worth(search, (at_hand[None], further), 0, Choice(0, {}))


def test_what_a_record_first_shows_or_determines_is_told_apart_from_what_it_shows_better() -> None:
    seen = np.diag([4.0, 1.0, 0.0])
    found = of_grams(seen, np.diag([4.0, 3.0, 2.0]))
    assert found.limits == {"a": pytest.approx(0.5)}
    assert (found.shown, found.determined) == (("b",), ())
    assert found.errors == {"stiffness": pytest.approx(math.sqrt(0.5))}
    blind = of_grams(np.diag([0.0, 1.0, 0.0]), np.diag([4.0, 0.0, 0.0]))
    assert (blind.errors, blind.determined, blind.shown) == ({}, ("stiffness",), ())


def test_what_is_shown_at_hand_is_still_shown_where_a_further_record_can_imitate_it() -> None:
    like = np.array([[1e6, 1e6, 0.0], [1e6, 1e6, 0.0], [0.0, 0.0, 1.0]])
    found = of_grams(np.diag([4.0, 1.0, 1.0]), like)
    assert set(found.limits) == {"a", "b"}
    assert found.limits["a"] == 1.0


@pytest.mark.parametrize("scatter", [0.0, 1e-6, 0.01, 1.0])
def test_a_mean_is_known_no_better_than_records_that_differ_tell_it(scatter: float) -> None:
    """Each of n records tells a value with a variance of its own, 1/I and that between records: the mean has 1/sum."""
    names, step, informs = ("stiffness", "damping"), 0.01, np.array([400.0, 400.0, 4e4])
    beside = Beside(None, {"stiffness": scatter})
    grams = np.stack([np.diag([of, 9.0]) for of in informs])
    held = beside.held(grams, names, 0, np.full((3, 2), step))
    found = [_errors(held[:number], 2, len(beside.deviations(names))) for number in (2, 3)]
    each = 1.0 / (1.0 / informs + (scatter / step) ** 2)
    for errors, number in zip(found, (2, 3), strict=True):
        np.testing.assert_allclose(errors, [each[:number].sum() ** -0.5, (9.0 * number) ** -0.5], rtol=1e-6)


def test_a_record_that_first_shows_an_effect_comes_first() -> None:
    better, first = Worth(Choice(0, {}), {}, {"b": 0.85}), Worth(Choice(1, {}), {}, {"b": 0.9}, shown=("a",))
    assert by_worth("power", [better, first])[0] is first
    # Of two that a sentence tells the same of the cheaper one comes first.
    dear, cheap = (Worth(Choice(i, {}), {"k": k}, {}, minutes=of) for i, k, of in ((0, 0.501, 17.0), (1, 0.503, 2.0)))
    assert by_worth("errors", [dear, cheap])[0] is cheap
    lower, known = Worth(Choice(0, {}), {"k": 0.5}, {}), Worth(Choice(1, {}), {"k": 0.9}, {}, determined=("c",))
    assert by_worth("errors", [lower, known])[0] is known
    said = _sentence(first, 2.0, "a.csv", ())
    assert "it shows a, which the records at hand do not" in said
    assert "it determines c, which the records at hand do not" in _sentence(known, 2.0, "a.csv", ())


def test_a_record_of_which_slopes_promise_counts_for_no_more_than_the_best_that_was_looked_into() -> None:
    """One that was looked into and adds nothing comes behind others of which slopes promise something."""
    best, useless, promised, little = (
        Worth(Choice(i, {}), {}, {}, nats=nats, distinguished=share, refitted=looked)
        for i, (nats, share, looked) in enumerate(
            [(9.0, 0.7, True), (0.5, 0.0, True), (80.0, 1.0, False), (7.0, 0.6, False)]
        )
    )
    assert by_worth("rivals", [useless, little, promised, best]) == [best, promised, little, useless]


def test_of_records_as_sure_the_cheaper_one_comes_first_whether_or_not_it_was_looked_into() -> None:
    dear, cheap = (
        Worth(Choice(i, {}), {}, {}, nats=nats, distinguished=0.9, refitted=looked, minutes=minutes)
        for i, (nats, looked, minutes) in enumerate([(14.0, True, 8.0), (13.0, False, 3.0)])
    )
    assert by_worth("rivals", [dear, cheap]) == [cheap, dear]


def test_an_effect_of_the_added_mass_shows_in_a_record_with_one(folder: Path) -> None:
    planned = plan_study(folder, Aim(purpose="power", only=("study.added_mass", "guide.viscous_friction")))
    assert planned.further[0][0].shown == ("study.added_mass",)
    assert planned.best.conditions["added_mass"] > 0.0
    assert set(planned.further[-1][0].limits) == {"guide.viscous_friction"}


def test_a_record_that_cannot_be_simulated_is_left_out(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = {0}

    def some(*args: Any) -> list[np.ndarray]:
        return [np.full_like(gram, np.nan) if i in broken else gram for i, gram in enumerate(menu_grams(*args))]

    monkeypatch.setattr(of_records, "menu_grams", some)
    aim = Aim(only=("guide.viscous_friction",))
    planned = plan_study(folder, aim)
    offered = len(planned.further) + 1
    assert f"1 of {offered} records that could be taken cannot be simulated" in planned.summary().remarks[0]
    assert not any(worth.choice == Choice(0, {}) for worth, _ in planned.further)
    broken |= set(range(offered))
    with pytest.raises(StudyError, match="none of which can be simulated"):
        plan_study(folder, aim)


def test_what_is_believed_counts_as_a_record(folder: Path, tmp_path: Path) -> None:
    text = (folder / "study.toml").read_text(encoding="utf-8")
    told = text.replace('initial = "25 N s/m"', 'initial = "25 N s/m"\nprior = "25 +/- 0.001 N s/m"')
    (tmp_path / "study.toml").write_text(told, encoding="utf-8")
    aim = Aim(only=("guide.viscous_friction",))
    free, believed = (plan_study(place, aim).further[0][0] for place in (folder, tmp_path))
    assert believed.errors["damping"] == pytest.approx(1.0, abs=3e-3)
    assert free.errors["damping"] < 0.95


def told(*records: tuple[str, float, bool], **more: Any) -> PlanSummary:
    """Summary of a plan that tells rivals apart, of records with a name, a probability, and whether looked into."""
    (example,) = EXAMPLES["fibrefit/plan/1"].further
    further = tuple(
        example.model_copy(
            update={"like": like, "says": f"{like} once more (3 min): it tells a from b", "nats": 9.0}
            | {"probability_distinguished": share, "looked_into": looked}
        )
        for like, share, looked in records
    )
    rivals = {"purpose": "rivals", "rivals": ("a", "b"), "further": further}
    return EXAMPLES["fibrefit/plan/1"].model_copy(update=rivals | more)


def test_a_reader_sees_of_which_records_slopes_alone_speak_and_that_nothing_is_certain() -> None:
    summary = told(("a: (1).csv", 0.999, True), ("b.csv", 0.999, False), ("c.csv", 0.001, True), ("d.csv", 0.0, True))
    row = next(line for line in report_of(summary).splitlines() if line.startswith("resolved"))
    assert row.split("%")[1].replace("> ", ">").replace("< ", "<").split() == [">99", "(>99)", "<1", "0"]
    figure = plan_figures(summary)["plan"]
    axes = figure.axes[0]
    assert [bar.get_alpha() for bar in axes.patches] == [1.0, 0.4, 1.0, 1.0]
    texts = [text.get_text() for text in figure.texts]
    assert texts[0] == "a: (1).csv once more would add most"
    assert texts[1].endswith("; pale: by slopes alone")
    assert axes.get_yticklabels()[0].get_text() == "a: (1).csv once more (3 min)"
    worth = Worth(Choice(0, {}), {}, {}, nats=9.0, distinguished=0.7, minutes=2.0)
    assert "70 % (expected log likelihood ratio 9, by slopes alone)" in _sentence(worth, 2.0, "a.csv", ("a", "b"))
    assert "slopes" not in _sentence(replace(worth, refitted=True), 2.0, "a.csv", ("a", "b"))


def test_a_report_says_how_far_further_records_go_and_why() -> None:
    ends = {"lift": (0.005, 0.015), "inclination": (0.5, math.pi / 2), "drive_speed": (0.1, 0.3)}
    text = " ".join(report_of(told(("a", 0.5, True), reach=ends, limits_stated=("lift",))).split())
    assert (
        "None goes beyond lift 5 mm to 15 mm (as the study states under [limits]); inclination 28.6 deg to 90 deg, "
        "drive_speed 100 mm/s to 300 mm/s (those at hand, 1.5 times wider at either end). State under [limits] what "
        "your rig can do."
    ) in text
    assert "None goes beyond" not in report_of(told(("a", 0.5, True)))


def test_what_was_done_beyond_the_limits_of_a_study_is_remarked_on(monkeypatch: pytest.MonkeyPatch) -> None:
    motions = {"drive_speed": np.array([0.1, 0.45]), "drive_travel": np.array([0.02, 0.06])}
    monkeypatch.setattr(workflow, "motions_of", lambda task: motions)
    study: Any = SimpleNamespace(possible={"drive_speed": (0.05, 0.2), "drive_travel": (0.0, 0.1)})
    assert workflow._beyond(study, None) == (
        "Records at hand are beyond the [limits] of the study: drive_speed 450 mm/s.",
    )
    study.possible = {}
    assert workflow._beyond(study, None) == ()


def test_a_report_of_many_long_names_stays_within_its_columns(plan: RecordPlan) -> None:
    summary = plan.summary()
    names = [f"guide.function_of_speed_with_a_long_name.parameter_with_one_{i}" for i in range(9)]
    further = tuple(one.model_copy(update={"errors": dict.fromkeys(names, 0.372)}) for one in summary.further)
    text = report_of(summary.model_copy(update={"further": further}))
    table = text.partition("What each would add")[2].partition("What to doubt")[0]
    assert max(map(len, table.splitlines())) <= 80
    assert sum(line.count("x 0.37") for line in table.splitlines()) == 9 * 6


@pytest.fixture(scope="module")
def search(task: Task) -> Search:
    """Over the measured drops, with the rivals; nothing is fitted."""
    layout = task.problem.layout
    start = layout.pack({name: np.full(len(layout.records), BASE[name]) for name in layout.names})
    return set_up(replace(task, start=start), None, RIVALS, lambda what, share: None)


def alike(search: Search) -> Any:
    """The base model of a search, of records that do not differ."""
    values = {"supermodel": search.base.supermodel, "local": search.base.fit.local}
    return SimpleNamespace(**values, evidence=differing(0.0).evidence, shared={})


@pytest.mark.slow
def test_rivals_that_are_not_in_the_records_are_told_apart_by_what_would_just_be_found(search: Search) -> None:
    base = alike(search)
    found = [just_found(search, base, effect) for effect in RIVALS]
    for one, known in zip(found, detectable(search, base), strict=True):
        assert one is not None
        strength = one.values[f"{known.effect}.{known.parameter}"]
        assert strength == pytest.approx(np.full(2, known.smallest_detectable), rel=0.3)
    options = [(choice, 2.0) for choice in options_of(search.task)]
    ranked, standing = worths(search, [one for one in found if one is not None], options, Beside())
    now = np.min(standing.nats)
    assert now > 0.0
    assert max(worth.nats for worth in ranked) > 2.0 * now
    absent: Any = Explanation(RIVALS[0], dict(zip(base.supermodel.names, base.local.T, strict=True)))
    assert np.min(worths(search, [absent, found[1]], options[:1], Beside())[1].nats) < 1e-3 * now


@pytest.fixture(scope="module")
def contest(search: Search) -> Contest:
    """Quadratic drag is true, viscous friction its rival; records differ in their stiffness."""
    base = alike(search)
    viscous, drag = (just_found(search, base, effect) for effect in RIVALS)
    assert viscous is not None
    assert drag is not None
    return Contest.of(search, drag, viscous, Beside(scatter={"stiffness": 3e-3, "damping": 0.0}))


def test_a_rival_refitted_to_a_further_record_misses_what_another_solver_finds(contest: Contest) -> None:
    """SciPy's dogbox on differences of residual rows, prior rows of the deviations written out."""
    choice = Choice(0, {"lift": 12e-3})
    there, values, counts = contest._further([choice] * 2)
    shared, each = contest.subset.shared, contest.subset.each
    names = contest.supermodel.names
    places = [names.index(name) for name in (*shared, *each)]
    start = np.concatenate([contest.found, values[:1]])
    scale = np.abs(start[0, places]) + 1e-9
    stiffness = shared.index("stiffness")
    samples = np.append(contest.counts, counts[0])

    def local(x: np.ndarray) -> np.ndarray:
        split = len(shared), len(shared) + 3 * len(each)
        all_of = start.copy()
        all_of[:, places[: len(shared)]] += x[: split[0]] * scale[: len(shared)]
        all_of[:, places[len(shared) :]] += x[split[0] : split[1]].reshape(3, -1) * scale[len(shared) :]
        all_of[:, places[stiffness]] *= np.exp(3e-3 * x[split[1] :])
        return all_of

    def residuals(x: np.ndarray) -> np.ndarray:
        of_all = local(x)
        at_hand = contest.at_hand.residuals(of_all[:2], samples[:2])
        further = there.residuals(np.repeat(of_all[2:], 2, axis=0), samples[[2, 2]])[:1]
        return np.concatenate([np.ravel(at_hand), np.ravel(further), x[-3:]])

    ends = least_squares(residuals, np.zeros(len(shared) + 3 * len(each) + 3), method="dogbox", diff_step=1e-6)
    refitted = contest.refitted(choice)
    assert refitted == pytest.approx(ends.cost, rel=0.02)
    assert refitted > contest.now


@pytest.fixture
def looked(monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[list[float], list[int], list[int]]]:
    """Nats and refitted ones of choices of which slopes promise so much and refits keep so much, and those refitted."""

    def made(promised: dict[str, Any], kept: dict[str, Any], rank: Any) -> tuple[list[float], list[int], list[int]]:
        order: list[int] = []

        def contest_of(search: Search, true: str, other: str, beside: Beside) -> Any:
            def refitted(choice: int) -> float:
                order.extend([choice] if true == "a" else [])
                return float(kept[true][choice])

            return SimpleNamespace(by_slopes=lambda choices: promised[true], refitted=refitted, now=float(ord(true)))

        monkeypatch.setattr(Contest, "of", contest_of)
        given: Any = (None, "ab", range(len(promised["a"])), Beside())
        now, nats, refitted = nats_apart(*given, rank)
        assert now.tolist() == [ord("a"), ord("b")]
        return nats.min(axis=0).tolist(), refitted, order

    return made


def by_nats(now: np.ndarray, nats: np.ndarray) -> list[tuple[float, ...]]:
    return [(-of,) for of in nats.min(axis=0)]


def test_rivals_are_refitted_to_further_records_until_slopes_promise_no_more(
    looked: Callable[..., tuple[list[float], list[int], list[int]]], monkeypatch: pytest.MonkeyPatch
) -> None:
    # A record that one way cannot be simulated says nothing, whichever way that is.
    promised = {"a": (9.0, 8.0, np.nan, 30.0, 20.0, 5.0), "b": (np.nan, 12.0, 3.0, 25.0, 40.0, 5.0)}
    kept = {"a": {3: 4.0, 4: 11.0}, "b": {3: 5.0, 4: 10.0}}
    nats, refitted, order = looked(promised, kept, by_nats)
    assert refitted == order == [3, 4]
    assert np.isnan([nats[0], nats[2]]).all()
    assert [nats[1], *nats[3:]] == [8.0, 4.0, 10.0, 5.0]
    monkeypatch.setattr(contests, "LOOKS", 1)
    assert looked(promised, kept, by_nats)[1] == [3]


def test_what_costs_less_and_is_promised_to_be_as_sure_is_looked_into_as_well(
    looked: Callable[..., tuple[list[float], list[int], list[int]]],
) -> None:
    """All are told of as sure beyond 20 nats: the dear best one first, then the cheaper ones, never the dearer one."""
    minutes = (8.0, 3.0, 2.0, 17.0)

    def rank(now: np.ndarray, nats: np.ndarray) -> list[tuple[float, ...]]:
        return [(-min(of, 20.0), cost, -of) for of, cost in zip(nats.min(axis=0), minutes, strict=True)]

    promised, kept = (90.0, 40.0, 25.0, 30.0), {0: 50.0, 1: 22.0, 2: 6.0}
    nats, refitted, order = looked({"a": promised, "b": promised}, {"a": kept, "b": kept}, rank)
    assert order == refitted == [0, 1, 2]
    assert nats == [50.0, 22.0, 6.0, 30.0]


@dataclass(frozen=True)
class Compared:
    """A comparison of rivals whose gains are as told."""

    found: list[Any]
    search: str = "the search"
    parent: str = "the base"

    def gain(self, one: Any) -> float:
        return float(one.log)


@pytest.fixture
def gaining(task: Task, monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[Any, ...]]:
    """Rivals at hand that gain so many nats each, and noise as the model leaves it that it is taken of."""

    def made(*logs: float, shown: bool = True, steps: int = 3) -> tuple[Any, ...]:
        fitted = SimpleNamespace(mode=SimpleNamespace(steps=steps))
        tried = [
            SimpleNamespace(effects=(one,), log=log, evidence=fitted) for one, log in zip(RIVALS, logs, strict=False)
        ]
        asked = SimpleNamespace(tried=lambda base, effects, what: tried)
        monkeypatch.setattr(at_hand, "prepared_search", lambda *given: (asked, "a base"))
        monkeypatch.setattr(at_hand, "in_one_noise", lambda search, base, found: Compared(found))
        monkeypatch.setattr(at_hand, "just_found", lambda search, base, one: Explanation(one, {}) if shown else None)
        monkeypatch.setattr(at_hand, "_as_found", lambda one: f"as found with {one.log:g}")
        monkeypatch.setattr(Beside, "of", lambda search, model: model)
        fit: Any = SimpleNamespace(plain=SimpleNamespace(values=task.start))
        return at_hand.rivals_at_hand(task, RIVALS, fit, lambda what, share: None)

    return made


@pytest.mark.parametrize(("shown", "says"), [(True, "would just be found"), (False, "they cannot show it")])
def test_rivals_without_evidence_are_given_a_strength_and_remarked_on(
    gaining: Callable[..., tuple[Any, ...]], shown: bool, says: str
) -> None:
    found, remarks, beside, ahead = gaining(4.9, shown=shown)
    assert [one.effect for one in found] == list(RIVALS)
    assert len(remarks) == 2
    assert all(says in remark for remark in remarks)
    assert (beside, ahead) == ("the base", None)
    found, remarks, beside, ahead = gaining(5.1)
    assert found[0] == "as found with 5.1"
    assert len(remarks) == 1
    # Its noise is that of the model with it; how far it is ahead of one without evidence is not known.
    assert beside.log == 5.1
    assert ahead is None


def test_of_rivals_that_the_records_show_it_is_known_which_is_ahead(gaining: Callable[..., tuple[Any, ...]]) -> None:
    found, remarks, beside, ahead = gaining(7.0, 9.5)
    assert found == ["as found with 7", "as found with 9.5"]
    assert (remarks, beside.log, ahead) == ((), 9.5, -2.5)
    # What was not followed is but what slopes promise: no record shows it.
    found, remarks, beside, ahead = gaining(7.0, 9.5, steps=0)
    assert (len(remarks), beside, ahead) == (2, "the base", None)


def test_a_true_model_has_no_deviations_of_single_records() -> None:
    """What records differ by costs the rival something, and is no difference between the two models."""
    local = np.array([[31.0, 0.1], [35.0, 0.2]])
    found = Explanation.by(RIVALS[0], ("stiffness", "zero"), local, {"stiffness": 33.0})
    np.testing.assert_array_equal(found.values["stiffness"], [33.0, 33.0])
    np.testing.assert_array_equal(found.values["zero"], [0.1, 0.2])


@pytest.mark.parametrize("scatter", [0.0, 0.01, 0.1])
def test_what_deviations_of_a_record_can_imitate_tells_rivals_apart_by_the_less_the_more_they_are(
    scatter: float,
) -> None:
    """Two records of one shared value, what a rival misses changing sign from the one to the other.

    One column of n samples with slope 1/h, and residuals of size r along it: each record has n r^2 / (1 + n s^2 / h^2)
    left, s its deviation's standard deviation.
    """
    n, r, step = 400.0, 0.2, 0.01
    gram = np.array([[[n, sign * n * r], [sign * n * r, n * r**2]] for sign in (1.0, -1.0)])
    beside = Beside(None, {"stiffness": scatter})
    held = beside.held(gram, ("stiffness",), 0, np.full((2, 1), step))
    left = float(projected(held, 1, held.shape[1] - 2)[0].sum())
    assert left == pytest.approx(2.0 * n * r**2 / (1.0 + n * (scatter / step) ** 2), rel=1e-6)


def test_a_value_that_is_zero_differs_between_no_records() -> None:
    """As a friction that a rival has taken the place of: a share of nothing is nothing, whatever its unit.

    One shared column as above, zero in the first record alone: with weights w of n and of n / (1 + n s^2 / h^2) and
    residuals of either sign, 4 r^2 w1 w2 / (w1 + w2) is left.
    """
    n, r, step, scatter = 400.0, 0.2, 0.01, 0.1
    gram = np.array([[[n, sign * n * r], [sign * n * r, n * r**2]] for sign in (1.0, -1.0)])
    sizes = relative_changes(np.array([[0.0], [2.0]]), np.array([[1e-9], [2.0 * (1.0 + step)]]))
    held = Beside(None, {"friction": scatter}).held(gram, ("friction",), 0, sizes)
    left = float(projected(held, 1, held.shape[1] - 2)[0].sum())
    other = n / (1.0 + n * (scatter / step) ** 2)
    assert left == pytest.approx(4.0 * r**2 * n * other / (n + other), rel=1e-6)


def test_errors_of_the_input_of_a_further_record_are_as_open_as_in_the_one_it_is_like(search: Search) -> None:
    """One error a record, a wave ``a`` of the readings with variance one: products lose ``p p' / (1 + a'a)``."""
    supermodel, context, local = search.base.supermodel, search.context, search.base.fit.local
    channels, samples = len(supermodel.problem.observations.weight), 512
    size = channels * np.asarray(supermodel.problem.observations.experiment.times).shape[1]
    waves = np.zeros((2, channels, size // channels))
    waves[0, 0, :samples], waves[1, 0, :samples] = 3.0, 5.0 * np.cos(np.arange(samples) / 40.0)
    power = (waves**2).sum(axis=(1, 2))
    directions = tuple(
        Directions(np.eye(1), wave[None], np.array([[1.0 / (1.0 + of)]])) for wave, of in zip(waves, power, strict=True)
    )
    offset = np.ones((2, size))
    reacting = InputSensitivities({"drive": np.zeros((2, 1))}, np.ones((2, channels, 1)), offset, directions)
    opened = read_exactly(replace(supermodel, sensitivities=reacting), Beside())
    assert opened.sensitivities is not None
    assert not opened.sensitivities.offset.any(), "what is read are the readings of the model itself"
    columns, targets = changed_values(supermodel, context, local, strengths_of(RIVALS), sizes_of(strengths_of(RIVALS)))
    asked = context, local, columns, targets
    menu = [Choice(1, {}), Choice(1, {"lift": 0.03}), Choice(0, {})]
    known, free = (menu_grams(model, *asked, menu) for model in (read_exactly(supermodel, Beside()), opened))
    told = as_simulated(supermodel, local, context.whole)
    rows = np.asarray(told.rows(local, columns, targets, context.whole))[:, 1 : 1 + len(columns)]
    for gram, left, record in zip(known[::2], free[::2], (1, 0), strict=True):
        pulled = rows[record] @ waves[record].ravel()
        np.testing.assert_allclose(
            left, gram - np.outer(pulled, pulled) / (1.0 + power[record]), rtol=1e-6, atol=1e-6 * np.diag(gram).max()
        )
    # Nothing is known better with open errors, whatever the conditions, and the force is known less well.
    shared, own = len(context.base), len(context.each)
    for gram, left in zip(known, free, strict=True):
        assert np.linalg.eigvalsh(gram - left).min() > -1e-6 * np.diag(gram).max()
        assert (_errors(left[None], shared, own) >= _errors(gram[None], shared, own) * (1.0 - 1e-6)).all()


def test_a_record_is_seen_in_the_noise_of_the_one_it_is_like() -> None:
    """Two records of which the second is half as long, in white noise of different size."""
    levels = np.array([1.0, 0.5])
    taps = np.zeros((2, 2, 1, BLOCK, BLOCK))
    taps[:] = np.eye(BLOCK) * levels[:, None, None, None]
    taps[1, 1] = 0.0
    none = np.zeros((2, 2, 1, BLOCK, 1))
    filtering = BlockFilter(taps, none, np.moveaxis(none, -1, -2), np.zeros((2, 2, 1, 1, 1)))
    ones = jnp.ones((2, 1, 2 * BLOCK))
    turned = np.asarray(filtering.of_records([1, 0]).whiten(ones))
    assert np.array_equal(turned, np.asarray(filtering.whiten(ones))[::-1])
    assert not turned[0, 0, BLOCK:].any()
    assert np.all(turned[1] == 1.0)
