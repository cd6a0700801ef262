"""Which record to take next."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from fibrefit.core.errors import StudyError, UsageError
from fibrefit.discovery.design.plan import Worth, _errors, probability_distinguished
from fibrefit.discovery.engine.thresholds import APART
from fibrefit.discovery.model.finding import Choice
from fibrefit.plots.plan import plan_figures
from fibrefit.report.any import report_of
from fibrefit.report.sentences.discovery import further_record
from fibrefit.study.summaries.design import PlanSummary
from fibrefit.study.summaries.files import summary_of
from fibrefit.workflow.design.plan import MINUTES, Aim, RecordPlan, _minutes, plan_study

PLANNED = """
schema = "fibrefit/study/1"
name = "two drops"
[rig]
kind = "fibre_mass"
weight_mass = "3.096 kg"
inclination = "60 deg"
[parameters.stiffness]
initial = "20 kN/m"
[parameters.damping]
initial = "25 N s/m"
[parameters.friction]
initial = "4 N"
"""
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
    assert list(nats.values()) == sorted(nats.values(), reverse=True)
    assert plan.best.conditions["lift"] == pytest.approx(8e-3)
    again = next(worth for worth, _ in plan.further if not worth.choice.conditions)
    assert plan.further[0][0].nats > 2.0 * again.nats
    # No record can take away what those at hand say.
    assert min(nats.values()) >= plan.now * (1.0 - 1e-6)


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
    with pytest.raises((UsageError, StudyError), match="not in the catalogue"):
        plan_study(folder, Aim(rivals=("guide.viscous_friction", "guide.vicous")))
    for minutes in ({"nothing": 3.0}, {"lfit": 3.0}, {"record": -1.0}, {"record": math.nan}, {"lift": math.inf}):
        with pytest.raises(UsageError, match=f'cost of "{next(iter(minutes))}"'):
            plan_study(folder, Aim(minutes=minutes))


def test_the_probability_to_tell_rivals_apart() -> None:
    assert probability_distinguished(0.0) == probability_distinguished(float("nan")) == 0.0
    assert probability_distinguished(APART) == pytest.approx(0.5)
    assert probability_distinguished(8.0 * APART) > 0.99
    # Twice the log of the ratio of two normals a distance d apart, drawn from one of them.
    d = 4.0
    draws = np.random.default_rng(3).standard_normal(200_000)
    share = np.mean(0.5 * d**2 + d * draws > APART)
    assert probability_distinguished(0.5 * d**2) == pytest.approx(share, abs=5e-3)


def test_standard_errors_are_those_of_least_squares_with_what_is_each_records_own() -> None:
    rng = np.random.default_rng(1)
    rows = [rng.standard_normal((40, 3)) for _ in range(2)]
    found = _errors(np.stack([a.T @ a for a in rows]), 2, 1)
    whole = np.zeros((80, 4))
    for r, a in enumerate(rows):
        whole[40 * r : 40 * (r + 1), :2], whole[40 * r : 40 * (r + 1), 2 + r] = a[:, :2], a[:, 2]
    np.testing.assert_allclose(found, np.sqrt(np.diag(np.linalg.inv(whole.T @ whole)))[:2], rtol=1e-10)


def test_costs_are_those_of_a_record_and_of_conditions_that_none_has() -> None:
    stated = {"lift": np.array([0.01, 0.02]), "inclination": np.array([1.0, 1.0])}
    same, steeper = Choice(0, {"lift": 0.02, "inclination": 1.0}), Choice(0, {"lift": 0.02, "inclination": 0.5})
    assert _minutes(same, stated, MINUTES) == MINUTES["record"]
    assert _minutes(steeper, stated, MINUTES) == MINUTES["record"] + MINUTES["inclination"]
    assert _minutes(steeper, stated, {**MINUTES, "inclination": 60.0}) == MINUTES["record"] + 60.0


def test_a_choice_in_words() -> None:
    assert further_record("a.csv", Choice(0, {})) == "a.csv once more"
    assert further_record("a.csv", Choice(0, {}, pace=2.0)) == "A record like a.csv with its input run twice as fast"
    assert Worth(Choice(0, {}), {"a": 0.5, "b": 2.0}, {}).error == pytest.approx(1.0)
