"""The maker of series: what it writes, how noisy, and that a hidden effect is as strong as asked."""

from __future__ import annotations

import json
import subprocess
import sys
import time
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("numba", reason="the second simulator is compiled with numba: install the extra `bench`")

from tests.independent.laws import DRIVE, DROP
from tests.independent.make import hide, write
from tests.independent.sensors import USUAL, pink_noise
from tests.independent.series import DRIVES, DROPS, make_series, plan_series
from tests.independent.simulate import Base
from tests.independent.strength import Task, differences, refit, respond, rms, strength_for

ROOT = Path(__file__).resolve().parents[2]

# Of 40 000 samples half of whose amplitude is pink; 0.003 is the hum's and the resolution's share, and pink noise this
# long has few independent slow parts: measured over seeds, 1.5 % of spread.
NOISE_TOLERANCE = 0.06


@pytest.fixture(scope="module")
def drop() -> object:
    return make_series(DROP, seed=11)


def test_same_seed_same_series(drop) -> None:
    again = make_series(DROP, seed=11)
    for one, other in zip(drop.records, again.records, strict=True):
        np.testing.assert_array_equal(one.logged.force, other.logged.force)
    assert make_series(DROP, seed=12).base != drop.base


def test_conditions_of_a_drop_series(drop) -> None:
    assert [record.name for record in drop.records] == [f"drop_{lift}mm_{angle}deg.csv" for lift, angle in DROPS]
    for record in (*drop.records, drop.held_out):
        assert 0.1 <= record.conditions.release <= 0.3
        held = record.clean.times < record.conditions.release
        np.testing.assert_allclose(record.clean.position[held], record.zero - record.conditions.lift, atol=1e-12)
        assert abs(record.zero) <= 3e-4
        assert record.zero == drop.records[0].zero
    assert 8e3 <= drop.base.stiffness <= 4e4


def test_drive_series_is_zeroed_and_carries_the_weight() -> None:
    series = make_series(DRIVE, seed=4)
    assert len(series.records) == len(DRIVES)
    for record in series.records:
        assert abs(record.clean.position[0]) < 1e-9
        assert record.clean.drive[0] == 0.0
        mass = record.conditions.weight_mass + record.conditions.added_mass
        assert record.clean.force[0] == pytest.approx(mass * 9.81 * 0.5, abs=1e-6)
        assert record.clean.times.size == 6400


@pytest.mark.parametrize(("channel", "size"), [("force", 0.4), ("position", 2e-5), ("drive", 1e-5)])
def test_noise_has_its_size(channel: str, size: float) -> None:
    records = [r for seed in (1, 2) for r in make_series(DRIVE, seed=seed, step=2e-5).records]
    noise = np.concatenate([getattr(r.logged, channel) - getattr(r.clean, channel) for r in records])
    assert noise.std() == pytest.approx(size, rel=NOISE_TOLERANCE)
    grain = USUAL.resolution[channel]
    grains = np.concatenate([getattr(r.logged, channel) for r in records]) / grain
    np.testing.assert_allclose(grains, np.round(grains), atol=1e-5)


def test_noise_is_half_pink() -> None:
    """Power that falls as 1/f, and in the logged noise a quarter of all power beside the white rest."""
    rng = np.random.default_rng(0)
    power = np.mean([np.abs(np.fft.rfft(pink_noise(4096, rng))) ** 2 for _ in range(200)], axis=0)
    f = np.arange(20, 1500)
    slope = np.polyfit(np.log(f), np.log(power[f]), 1)[0]
    assert slope == pytest.approx(-1.0, abs=0.05)
    assert np.mean([pink_noise(4096, rng).var() for _ in range(200)]) == pytest.approx(1.0, abs=0.1)
    white = make_series(DROP, seed=3, noise=replace(USUAL, pink=0.0), step=2e-5)
    half = make_series(DROP, seed=3, step=2e-5)
    slow = [
        np.mean([np.abs(np.fft.rfft(r.logged.force - r.clean.force))[1:15].mean() for r in series.records])
        for series in (white, half)
    ]
    assert slow[1] > 2.0 * slow[0]


def test_scatter_moves_every_record() -> None:
    series = make_series(DROP, seed=8, scatter=0.005, step=2e-5)
    ratios = np.array([np.divide(r.base, series.base) for r in series.records]) - 1.0
    assert 0.001 < np.abs(ratios).mean() < 0.01
    assert np.unique(ratios[:, 0]).size == len(series.records)


def test_a_refit_finds_nothing_where_nothing_is_hidden() -> None:
    """Negative control: from wrong parameters the base model comes back to the truth and leaves no gap."""
    plans = plan_series(DROP, np.random.default_rng(2))[:-1]
    base = Base(2e4, 20.0, 3.0)
    truth = respond(plans, base, {})
    found = refit(Task(plans, Base(2.005e4, 22.0, 3.2)), truth)
    # The switches of both fall on steps of 20 µs.
    assert found.gap < 0.03
    np.testing.assert_allclose(found.base, base, rtol=2e-3)


@pytest.mark.parametrize(
    ("rig", "name", "gap"),
    [
        (DROP, "guide.viscous_friction", 1.5),
        pytest.param(DRIVE, "pulley.capstan_friction", 3.0, marks=pytest.mark.slow),
    ],
)
def test_strength_leaves_the_gap_asked_for(rig: str, name: str, gap: float) -> None:
    plans = plan_series(rig, np.random.default_rng(2))[:-1]
    task = Task(plans, Base(2e4, 20.0, 3.0))
    found = strength_for(task, name, gap, {})
    assert found.gap == pytest.approx(gap, rel=0.12)
    # The same from scratch: the gap does not hang on the path by which the strength was found.
    again = refit(task, respond(plans, task.base, found.effects))
    assert again.gap == pytest.approx(found.gap, rel=0.05)
    plain = rms(differences(respond(plans, task.base, {}), respond(plans, task.base, found.effects)))
    assert plain > found.gap


def test_strength_by_plain_difference() -> None:
    plans = plan_series(DROP, np.random.default_rng(2))[:-1]
    found = strength_for(Task(plans, Base()), "fibre.hardening", 5.0, {}, by="difference")
    assert found.gap == pytest.approx(5.0, rel=0.12)
    assert found.fit is None


def test_files(tmp_path: Path) -> None:
    series = hide(DROP, ["sensor.force_offset"], 5, 1.0, by="difference")
    write(series, tmp_path)
    study = tomllib.loads((tmp_path / "study.toml").read_text(encoding="utf-8"))
    truth = json.loads((tmp_path / "truth.json").read_text(encoding="utf-8"))
    assert study["schema"] == "fibrefit/study/1"
    assert truth["hidden"] == ["sensor.force_offset"]
    assert truth["parameters"]["sensor.force_offset.offset"] == series.effects["sensor.force_offset"]["offset"]
    assert [row["file"] for row in study["records"]] == [record.name for record in series.records]
    for record in (*series.records, series.held_out):
        folder = tmp_path / "holdout" if record is series.held_out else tmp_path
        table = np.loadtxt(folder / record.name, delimiter=",", skiprows=1)
        np.testing.assert_allclose(table[:, 1], record.logged.force, atol=1e-9)
        np.testing.assert_allclose(table[:, 2], 1e3 * record.logged.position, atol=1e-9)
    held_out = tomllib.loads((tmp_path / "holdout" / "study.toml").read_text(encoding="utf-8"))
    assert held_out["records"][0]["inclination"] == "60 deg"


def test_an_effect_of_another_rig_is_refused() -> None:
    with pytest.raises(ValueError, match="does not apply to fibre_mass"):
        hide(DROP, ["pulley.inertia"], 1)


def test_command_line(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tests.independent.make", "--seed", "3", "--rig", DROP, "--out", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["hidden"] == []
    assert len(list(tmp_path.glob("*.csv"))) == len(DROPS)


def test_a_series_is_quick() -> None:
    """After compilation; the bound is wide, machines differ. Processor time: busy neighbours leave it alone."""

    def timed(seed: int) -> float:
        begin = time.process_time()
        make_series(DROP, seed=seed)
        return time.process_time() - begin

    timed(1)
    assert min(timed(seed) for seed in (2, 3, 4)) < 3.0
