"""First guesses from the data alone, and every record they are refused for."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fibrefit.core.errors import DataError, StudyError
from fibrefit.problem.task import Task
from fibrefit.rigs.fibre_mass import LiftShown, lifts_that_differ
from fibrefit.study import load_study
from fibrefit.workflow.prepare import task_of
from tests.fitting import made
from tests.fitting.made import Made

SERIES = Path(__file__).resolve().parents[2] / "configs" / "drop_series"
#: Of the simulator that made the series; it shares nothing with this program.
TRUE = {"stiffness": 11150.63, "damping": 9.437, "friction": 2.686}


def start_of(task: Task) -> dict[str, float]:
    return dict(zip(task.problem.layout.free_names, task.start, strict=True))


def test_guesses_on_records_of_another_simulator() -> None:
    start = start_of(task_of(load_study(SERIES)))
    assert start["stiffness"] == pytest.approx(TRUE["stiffness"], rel=0.05)
    assert start["damping"] == pytest.approx(TRUE["damping"], rel=0.5)
    assert start["friction"] == pytest.approx(TRUE["friction"], rel=0.5)


@pytest.mark.parametrize("truth", [{}, {"stiffness": 9e3, "damping": 45.0}, {"friction": 1.5, "damping": 9.0}])
def test_guesses_are_near_enough_to_start_from(tmp_path: Path, truth: dict[str, float]) -> None:
    start = start_of(made.task(tmp_path, made.records(share=0.5, **truth)))
    expected = made.TRUTH | truth
    assert start["stiffness"] == pytest.approx(expected["stiffness"], rel=0.1)
    assert expected["damping"] / 3.0 < start["damping"] < 3.0 * expected["damping"]
    assert expected["friction"] / 3.0 < start["friction"] < 3.0 * expected["friction"]
    for i in range(2):
        name = f"drop_{1e3 * made.LIFTS[i]:g}mm.csv"
        assert start[f"release[{name}]"] == pytest.approx(made.NUISANCES["release"], abs=5e-4)
        assert start[f"position_zero[{name}]"] == pytest.approx(made.NUISANCES["position_zero"], abs=2e-5)


def test_the_spread_around_a_guess_contains_the_truth(tmp_path: Path) -> None:
    task = made.task(tmp_path, made.records(share=0.5, damping=9.0))
    assert {"stiffness", "damping", "friction"} <= set(task.spread)
    for name, factor in task.spread.items():
        true = (made.TRUTH | {"damping": 9.0})[name]
        assert true / factor < start_of(task)[name] < true * factor


def test_a_lift_that_is_not_told_is_found(tmp_path: Path) -> None:
    task = made.task(tmp_path, lifts=(None, 1e-2))
    start = start_of(task)
    assert start["lift[drop_5mm.csv]"] == pytest.approx(5e-3, abs=2e-4)
    assert "lift[drop_10mm.csv]" not in start
    np.testing.assert_allclose(np.asarray(task.problem.layout.local(task.start))[1, -1], 1e-2)


def test_a_weight_that_is_let_go_on_a_taut_fibre(tmp_path: Path) -> None:
    """No free fall at all: the fibre bears from the first sample on."""
    lifts = (0.0, 1e-2)
    start = start_of(made.task(tmp_path, made.records(lifts, share=0.5), lifts=lifts))
    assert start["stiffness"] == pytest.approx(made.TRUTH["stiffness"], rel=0.1)
    assert start["release[drop_0mm.csv]"] == pytest.approx(made.NUISANCES["release"], abs=2e-3)


def test_a_lone_outlier_moves_no_release(tmp_path: Path) -> None:
    one, other = made.records(share=0.5)
    position = one.channels["position"].copy()
    position[900] = 1.0
    start = start_of(made.task(tmp_path, [made.replace(one, position=position), other]))
    assert start["release[drop_5mm.csv]"] == pytest.approx(made.NUISANCES["release"], abs=5e-4)


def test_a_first_contact_that_never_ends_is_taken_for_one_swing(tmp_path: Path) -> None:
    """Heavy damping: the weight never leaves the fibre again, and the first horizon must not be the whole record."""
    task = made.task(tmp_path, made.records(stiffness=8e3, damping=120.0))
    assert task.horizons.shape[-1] == 2
    assert np.all(task.horizons[0, 0] < 0.7 * made.SAMPLES)
    assert np.all(task.horizons[:, -1] >= made.SAMPLES)


def test_the_first_horizon_does_not_hang_on_the_sampling_rate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """At 60 kHz the noise crosses the taut point again and again while the weight does once."""
    ends = []
    for rate in (made.RATE, 60e3):
        monkeypatch.setattr(made, "RATE", rate)
        records = [made.record(f"drop_{1e3 * lift:g}mm.csv", lift, samples=round(0.5 * rate)) for lift in made.LIFTS]
        task = made.task(tmp_path / f"{rate:g}", [dataclasses.replace(one, rate=rate) for one in records])
        ends.append(task.horizons[0, 0] / rate)
    assert ends[1] == pytest.approx(ends[0], abs=2e-3)


def test_release_and_zero_that_are_known_need_no_rest(tmp_path: Path) -> None:
    records = [begun(one, 255) for one in made.records()]
    known = [f'release = "{1e3 * made.NUISANCES["release"] - 127.5:.4f} ms"\nposition_zero = "0.13 mm"'] * 2
    start = start_of(made.task(tmp_path, records, own=known))
    assert set(start) == set(made.TRUTH)
    assert start["stiffness"] == pytest.approx(made.TRUTH["stiffness"], rel=0.05)


def begun(one: Made, sample: int) -> Made:
    """The record as if it had been started at a sample."""
    channels = {name: values[sample:] for name, values in one.channels.items()}
    return dataclasses.replace(one, time=one.time[sample:] - one.time[sample], channels=channels)


def ended(one: Made, sample: int) -> Made:
    """The record as if it had been stopped at a sample."""
    channels = {name: values[:sample] for name, values in one.channels.items()}
    return dataclasses.replace(one, time=one.time[:sample], channels=channels)


def turned(one: Made, channel: str) -> Made:
    return made.replace(one, **{channel: -one.channels[channel]})


def saturated(one: Made, channel: str) -> Made:
    """A sensor whose range ends short of the hold: the hold is masked."""
    values = one.channels[channel]
    return made.replace(one, **{channel: np.where(one.time < 0.11, np.nan, values)})


def silent(one: Made) -> Made:
    return made.replace(one, force=np.random.default_rng(0).normal(size=one.time.size) * 0.0)


CAUGHT = "expected a weight that is released, falls and is caught."
REFUSED: list[tuple[str, Callable[[Made], Made], dict[str, Any], str]] = [
    (
        "begins in the fall",
        lambda r: begun(r, 255),
        {},
        "moves from the first sample; expected a rest before the release",
    ),
    ("never falls", lambda r: ended(r, 240), {}, f"does not fall by its lift; {CAUGHT} Check lift"),
    ("ends in the fall", lambda r: ended(r, 280), {}, "does not fall by its lift"),
    (
        "position upside down",
        lambda r: turned(r, "position"),
        {},
        "against gravity (-1 times what follows from it)",
    ),
    (
        "position upside down, no lift",
        lambda r: turned(r, "position"),
        {"lifts": (None, None)},
        "and the measured force (-1 times what follows from it); expected a weight that moves as",
    ),
    ("force upside down", lambda r: turned(r, "force"), {}, "the weight moves against the measured force"),
    (
        "position saturated in the hold",
        lambda r: saturated(r, "position"),
        {"lifts": (None, None)},
        "samples of the position before 110 ms are masked as saturated or damaged, the hold among them; those",
    ),
    (
        "force saturated in the hold",
        lambda r: saturated(r, "force"),
        {"lifts": (None, None)},
        "samples of the force before 110 ms are masked as saturated or damaged, the hold among them; those",
    ),
    ("no force", silent, {"lifts": (None, None)}, "shows no force"),
    ("lift far too large", lambda r: r, {"lifts": (0.1, 0.2)}, "does not fall by its lift"),
    (
        "position in the wrong unit",
        lambda r: made.replace(r, position=1e3 * r.channels["position"]),
        {},
        "times what gravity and the measured force do; expected a weight that moves as",
    ),
    (
        "position in another unit, near",
        lambda r: made.replace(r, position=4.0 * r.channels["position"]),
        {},
        "times what gravity and the measured force do; expected a weight that moves as gravity and the measured",
    ),
    (
        "half the time",
        lambda r: dataclasses.replace(r, time=0.5 * r.time),
        {},
        "Check the scale and unit of the position, which would be off by 0.2",
    ),
    (
        "force all damaged",
        lambda r: made.replace(r, force=np.full(r.time.size, np.nan)),
        {},
        'channel "force": 0 valid samples; expected at least 16',
    ),
    (
        "no position",
        lambda r: dataclasses.replace(r, channels={"force": r.channels["force"]}),
        {},
        'no position channel; expected one, for a fibre_mass rig. Name its column: [channels] position = "..."; '
        "fibrefit inspect tells what was left out, and why. "
        'Where it was not measured: measured = "force" under [rig].',
    ),
]


@pytest.mark.parametrize(("change", "options", "says"), [row[1:] for row in REFUSED], ids=[row[0] for row in REFUSED])
def test_a_record_that_cannot_be_started_from_is_refused(
    tmp_path: Path, change: Callable[[Made], Made], options: dict[str, Any], says: str
) -> None:
    with pytest.raises(DataError) as refused:
        made.task(tmp_path, [change(one) for one in made.records()], **options)
    assert says in str(refused.value)
    assert str(refused.value).startswith(("drop_", "all 2 records"))


def test_lifts_stated_in_each_others_place_are_told(tmp_path: Path) -> None:
    swapped = [made.record("drop_5mm.csv", 1e-2, seed=1), made.record("drop_10mm.csv", 5e-3, seed=2)]
    with pytest.raises(DataError) as refused:
        made.task(tmp_path, swapped)
    said = str(refused.value)
    assert "Lifts as stated, and falls after which the force rises: drop_5mm.csv 5 mm and 10" in said
    assert "With the lifts of drop_5mm.csv and drop_10mm.csv exchanged they would agree. Check lift" in said


def test_a_lift_that_no_exchange_puts_right_is_told_alone(tmp_path: Path) -> None:
    wrong = [made.record("drop_5mm.csv", 5e-3, seed=1), made.record("drop_10mm.csv", 4e-3, seed=2)]
    with pytest.raises(DataError) as refused:
        made.task(tmp_path, wrong)
    assert "drop_10mm.csv 10 mm and 4" in str(refused.value)
    assert "exchanged" not in str(refused.value)
    assert lifts_that_differ([LiftShown("a", 1e-2, 1.02e-2), LiftShown("b", 2e-2, 2.02e-2)]) == ""


def test_a_condition_the_rig_needs_is_asked_for(tmp_path: Path) -> None:
    made.study(tmp_path)
    text = (tmp_path / "study.toml").read_text(encoding="utf-8").replace('inclination = "90 deg"', "")
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    with pytest.raises(StudyError, match="inclination"):
        from fibrefit.problem.formulation import formulate
        from fibrefit.rigs.catalogue import RIGS
        from fibrefit.simulation.model import Model

        formulate(load_study(tmp_path / "study.toml"), made.records(), Model(RIGS["fibre_mass"]))


def test_a_gap_in_time_is_left_open_and_not_bridged(tmp_path: Path) -> None:
    one = made.records()[0]
    keep = np.r_[0:500, 540 : one.time.size]
    torn = dataclasses.replace(
        one, time=one.time[keep], channels={name: values[keep] for name, values in one.channels.items()}
    )
    task = made.task(tmp_path, [torn, made.records()[1]])
    trace = task.traces[0]
    assert trace.times.size == one.time.size
    assert np.isnan(trace.channels["force"][500:540]).all()
    assert math.isclose(trace.times[540], one.time[540], abs_tol=1e-12)
    assert task.problem.n_measured == 4 * one.time.size - 2 * 40


def test_a_clock_that_jumps_by_a_day_is_told_before_its_samples_are_made(tmp_path: Path) -> None:
    """All that is missing would be laid out: gigabytes."""
    one, *others = made.records()
    late = dataclasses.replace(one, time=np.where(np.arange(len(one.time)) < 700, one.time, one.time + 86400.0))
    with pytest.raises(DataError, match=r"1.73e\+08 samples .* most of them missing: a gap of .* after 0.3495 s"):
        made.task(tmp_path, [late, *others])
