"""Saturated, stuck and absurd readings are masked; flat stretches that are right stay."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fibrefit.records import Table, read_record, read_table, side_by_side
from fibrefit.records.columns import damage
from fibrefit.records.columns.damage import flat_stretches

N = 4000
TIME = np.arange(N) / 2000.0


def bounce(noise: float, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Force and position of a weight that hits a fibre again and again; slack in between."""
    rng = np.random.default_rng(seed)
    position = -10 * np.abs(np.cos(2 * np.pi * 3 * TIME)) * np.exp(-TIME) + 3 * np.exp(-TIME)
    force = np.maximum(0.0, 30 * position)
    return force + noise * rng.standard_normal(N), position + 0.05 * noise * rng.standard_normal(N)


@pytest.fixture
def read(write: Callable) -> Callable[..., Table]:
    def _read(force: np.ndarray, position: np.ndarray, digits: tuple[int, int] = (2, 3)) -> Table:
        rows = zip(TIME, force, position, strict=True)
        text = "".join(f"{t:.4f},{f:.{digits[0]}f},{u:.{digits[1]}f}\n" for t, f, u in rows)
        return read_table(write("t [s],F [N],u [mm]\n" + text))

    return _read


def masked(table: Table) -> list[dict[str, int]]:
    return [dict(column.masked) for column in table.columns]


@pytest.mark.parametrize("seed", range(5))
def test_noise_alone_masks_nothing(seed: int, read: Callable) -> None:
    assert masked(read(*bounce(0.4, seed))) == [{}, {}]


@pytest.mark.parametrize("step", [0.02, 0.1, 0.5], ids=lambda step: f"{step} N")
def test_coarse_steps_mask_nothing(step: float, read: Callable) -> None:
    force, position = bounce(0.4)
    assert masked(read(np.round(force / step) * step, np.round(position / 0.005) * 0.005)) == [{}, {}]


def test_noise_free_motion_masks_nothing(read: Callable) -> None:
    """A slack fibre at zero, and a dial gauge that moves in steps of 0.05 mm."""
    force, position = bounce(0.0)
    assert masked(read(force, position, (6, 6))) == [{}, {}]
    assert masked(read(force, np.round(position / 0.05) * 0.05)) == [{}, {}]


def test_a_held_weight_is_rightly_flat(read: Callable) -> None:
    fallen = np.maximum(TIME - 0.3, 0.0)
    position = np.minimum(-10 + 0.5 * 9810 * fallen**2, 5.0)
    table = read(5.0 * (TIME > 0.5), position, (2, 4))
    assert masked(table) == [{}, {}]
    assert any('"u [mm]" stops dead at its extreme' in note for note in table.notes)


def test_a_drive_that_holds_is_rightly_flat(read: Callable) -> None:
    drive = np.clip(300 * (TIME - 0.1), 0, np.clip(70 - 300 * (TIME - 1.2), 0, 70))
    table = read(30 + 0.5 * drive, drive, (3, 4))
    assert masked(table) == [{}, {}]


@pytest.mark.parametrize("noise", [0.4, 0.0])
def test_a_force_cut_off_at_full_scale_is_masked(noise: float, read: Callable) -> None:
    force, position = bounce(noise)
    table = read(np.minimum(force, 60.0), position, (2, 3) if noise else (6, 6))
    cut = force >= 60.0
    column = table.column("F [N]")
    assert set(column.masked) == {"saturated"}
    # A single sample at full scale between two below it may have been measured.
    assert (~column.valid & cut).sum() >= 0.9 * cut.sum()
    assert not (~column.valid & (np.round(force, 2) < 60.0)).any()


def test_a_position_out_of_range_of_its_sensor_is_masked(read: Callable) -> None:
    force, position = bounce(0.4)
    column = read(force, np.maximum(position, -5.0)).column("u [mm]")
    assert set(column.masked) == {"saturated"}


@pytest.mark.parametrize(("unit", "expected"), [("rpm", set()), ("mm/s", set()), ("N", {"saturated"})])
def test_a_speed_is_nought_while_a_machine_stands(unit: str, expected: set[str], tmp_path: Path) -> None:
    """Readings of nothing but nought at an extreme: of a force, an input that takes one sign only."""
    moving = np.where(
        TIME < 0.3, 0.0, 400.0 * np.sin(2.0 * (TIME - 0.3)) + np.random.default_rng(2).normal(0.0, 3.0, N)
    )
    rows = "".join(f"{t:.4f},{np.round(max(v, 0.0)):.0f}\n" for t, v in zip(TIME, moving, strict=True))
    (tmp_path / "a.csv").write_text(f"time [s],motor [{unit}]\n{rows}", encoding="utf-8")
    column = read_table(tmp_path / "a.csv").column(f"motor [{unit}]")
    assert set(column.masked) == expected
    assert not np.signbit(column.values[column.values == 0.0]).any()


@pytest.mark.parametrize("length", [6, 40, 400])
def test_a_frozen_reading_is_masked(length: int, read: Callable) -> None:
    force, position = bounce(0.4)
    force[1000 : 1000 + length] = force[1000]
    column = read(force, position).column("F [N]")
    assert dict(column.masked) == {"stuck": length}
    assert not column.valid[1000 : 1000 + length].any()


def rests_then_strokes(seed: int) -> np.ndarray:
    """A drive in coarse steps, in mm, whose readings repeat more often at rest than on the way."""
    stroke = np.where(TIME < 0.4, 0.0, 90.0 * (TIME - 0.4))
    return 0.005 * np.round((stroke + 0.005 * np.random.default_rng(seed).standard_normal(N)) / 0.005)


def test_a_rest_in_coarse_steps_is_not_frozen(read: Callable) -> None:
    force, _ = bounce(0.4)
    found = [masked(read(force, rests_then_strokes(seed)))[1] for seed in range(60)]
    assert sum(map(bool, found)) <= 1


def test_a_reading_that_freezes_at_rest_is_masked(read: Callable) -> None:
    force, _ = bounce(0.4)
    drive = rests_then_strokes(1)
    drive[300:330] = 0.005
    assert 30 <= masked(read(force, drive))[1]["stuck"] <= 32


@pytest.mark.parametrize("value", ["9.9E37", "1E+10", "-9999", "999999", "3.4028235E+38", "-1e30"])
def test_absurd_values_are_masked(value: str, write: Callable) -> None:
    force, _ = bounce(0.4)
    texts = [f"{f:.2f}" for f in force]
    texts[100] = value
    text = "t [s],F [N]\n" + "".join(f"{t:.4f},{f}\n" for t, f in zip(TIME, texts, strict=True))
    assert dict(read_table(write(text)).column("F [N]").masked) == {"absurd": 1}


@pytest.mark.parametrize("value", ["1e308", "-1e160", "1e16"])
def test_numbers_that_no_quantity_has_are_masked_wherever_they_stand(
    value: str, write: Callable, recwarn: pytest.WarningsRecorder
) -> None:
    """All of them are alike here, and none is absurd beside the others; their squares have no end."""
    text = "t [s],F [N]\n" + "".join(f"{t:.4f},{value}\n" for t in TIME)
    column = read_table(write(text)).column("F [N]")
    assert not column.valid.any()
    assert not recwarn.list


def test_nines_among_large_numbers_are_no_sign(write: Callable) -> None:
    force = 9000 + 999 * np.sin(20 * TIME)
    force[77] = 9999
    text = "t [s],F [N]\n" + "".join(f"{t:.4f},{f:.0f}\n" for t, f in zip(TIME, force, strict=True))
    assert read_table(write(text)).column("F [N]").valid.all()


def test_a_lone_outlier_is_reported_and_kept(read: Callable) -> None:
    force, position = bounce(0.4)
    force[300] += 27.3
    table = read(force, position)
    assert masked(table) == [{}, {}]
    assert table.column("F [N]").outliers == (300,)
    assert any("has 1 lone outlier (at 0.15 s); kept" in note for note in table.notes)


def test_a_run_that_is_likely_in_the_middle_of_a_step_is_not_stuck() -> None:
    """Of readings that mostly lie at edges of steps: what runs are around says little of one in the middle."""
    for seed in range(40):
        rng = np.random.default_rng([seed, 4])
        drive = 0.005 * np.round(np.linspace(0.0, 40.0, N) + 1.17 * rng.standard_normal(N))
        drive[1000:1012] = drive[1000]
        assert not flat_stretches(drive, 0.001).stuck.any()


def test_a_drive_that_froze_among_such_noise_is_stuck() -> None:
    rng = np.random.default_rng(4)
    drive = 0.005 * np.round(np.cumsum(rng.standard_normal(N)) * 0.2 + 2.0 * rng.standard_normal(N))
    drive[1000:1060] = drive[1000]
    assert flat_stretches(drive, 0.001).stuck[1000:1060].all()


def test_a_scale_of_the_times_is_applied(tmp_path) -> None:
    path = tmp_path / "slow.csv"
    rows = "".join(f"{0.005 * i:.3f},{12.5 + 0.1 * (i % 7):.1f}\n" for i in range(60))
    path.write_text("time [s],force [N]\n" + rows, "utf-8")
    assert read_record(path).rate == pytest.approx(200.0)
    slow = read_record(path, channels={"time": {"column": "time [s]", "scale": "0.1"}})
    assert slow.rate == pytest.approx(2000.0)
    assert slow.time[-1] - slow.time[0] == pytest.approx(0.0295)


@pytest.mark.parametrize(("name", "bad"), [("force valid", "0"), ("overload", "1")])
def test_rows_that_a_column_of_flags_calls_bad_are_masked(name: str, bad: str, tmp_path) -> None:
    path, good = tmp_path / "flags.csv", "1" if bad == "0" else "0"
    rows = "".join(f"{0.005 * i:.3f},{12.5 + 0.1 * (i % 7):.1f},{bad if i in (20, 21) else good}\n" for i in range(60))
    path.write_text(f"time [s],force [N],{name}\n" + rows, "utf-8")
    valid = read_record(path).valid["force"]
    assert (~valid).nonzero()[0].tolist() == [20, 21]


def test_a_blow_no_wrap_and_a_phase_no_range() -> None:
    blow = np.r_[np.zeros(30), 230.0, 226.0, 221.0, np.linspace(215, 60, 30).round()]
    assert not damage.folded(blow)
    assert damage.folded(np.mod(np.arange(0, 900, 15), 256.0)) == "it jumps by nearly 256, as a counter that runs over"
    force = np.r_[np.full(30, 10.0), np.full(30, 20.0)]
    assert not damage.switched(force, np.r_[np.full(30, 1.0), np.full(30, 2.0)])
    assert damage.switched(force, np.r_[np.full(30, 100.0), np.full(30, 50.0)])
    hum = 5 + np.random.default_rng(4).normal(size=4000)
    assert not damage.folded(hum)


def test_a_record_since_1970_begins_at_zero_to_the_last_digit(write) -> None:
    rows = "".join(f"{1688132467250000 + 500 * i},{10 + np.sin(0.3 * i):.3f}\n" for i in range(60))
    record = read_record(write("ts,force [N]\n" + rows, "a.csv"))
    np.testing.assert_allclose(record.time, np.arange(60) * 500 / 1e6, rtol=4e-16, atol=0)
    assert record.origin == 86400.0 * 719163 + 1688132467.25


def test_two_loggers_of_which_one_counts_from_1970(write) -> None:
    first = "".join(f"{1688132467250 + 10 * i},{10 + np.sin(0.3 * i):.3f}\n" for i in range(60))
    other = "".join(f"2023-06-30,13:41:07.{250 + 10 * i:03d},{i}\n" for i in range(60))
    force = read_record(write("ts,force [N]\n" + first, "a.csv"))
    position = read_record(write("Date,Time,position [mm]\n" + other, "b.csv"))
    assert len(side_by_side(force, position)) == 60


NOISE = np.random.default_rng(7).standard_normal((2, N))
SWING = 20.0 + 12.0 * np.sin(2 * np.pi * 5 * TIME) + 0.1 * NOISE[0]
PLACE = 2.5 * np.cos(2 * np.pi * 5 * TIME) + 0.005 * NOISE[1]


def left(values: np.ndarray, level: float, length: int, times: int = 10) -> tuple[np.ndarray, np.ndarray]:
    """Readings that leave their range for a number, so many rows long and so many times over; and where."""
    where = np.zeros(N, bool)
    for start in 137 + 350 * np.arange(times):
        where[start : start + length] = True
    return np.where(where, level, values), where


@pytest.mark.parametrize("length", [1, 2, 3])
@pytest.mark.parametrize("level", [327.67, 0.0, 99.5])
def test_a_number_that_noisy_readings_leave_for_again_and_again_is_masked(
    level: float, length: int, read: Callable
) -> None:
    force, where = left(SWING, level, length)
    column = read(force, PLACE).column("F [N]")
    assert set(column.masked) <= {"out of range", *(["digit lost or doubled"] if length == 1 else [])}
    np.testing.assert_array_equal(~column.valid, where)


def test_two_such_numbers_are_masked(read: Callable) -> None:
    force, low = left(SWING, 0.0, 2)
    high = np.roll(low, 100)
    column = read(np.where(high, 163.83, force), PLACE).column("F [N]")
    np.testing.assert_array_equal(~column.valid, low | high)


def test_far_readings_that_differ_are_reported_and_kept(read: Callable) -> None:
    """Blows, each of another size; and two readings of one number, which counts as chance."""
    blows = SWING.copy()
    blows[137::350] += 80.0 + 20.0 * NOISE[0][137::350]
    assert not damage.returning(blows).any()
    assert damage.lone_outliers(blows).size == blows[137::350].size
    twice = read(left(SWING, 327.67, 2, times=2)[0], PLACE).column("F [N]")
    assert not twice.masked
    assert len(twice.outliers) == 2


@pytest.mark.parametrize("held", [4, 10, 20])
def test_of_a_slower_channel_that_is_written_on_the_first_of_each_reading_stays(held: int, read: Callable) -> None:
    """Between two readings of a bus the position is not measured: what is written there is off by what it moved."""
    table = read(SWING, np.repeat(PLACE[::held], held))
    column = table.column("u [mm]")
    fresh = np.arange(N) % held == 0
    np.testing.assert_array_equal(column.valid, fresh)
    np.testing.assert_allclose(column.values[fresh], np.round(PLACE[::held], 3) / 1e3)
    assert dict(column.masked) == {"held over": N - fresh.sum()}
    assert any(f"changes at every {held}th row only" in note for note in table.notes)


def test_a_missing_reading_does_not_hide_that_a_channel_is_held(write: Callable) -> None:
    position = [f"{value:.3f}" for value in np.repeat(PLACE[::10], 10)]
    position[200:203] = ["", "", ""]
    rows = "".join(f"{t:.4f},{f:.2f},{u}\n" for t, f, u in zip(TIME, SWING, position, strict=True))
    column = read_table(write("t [s],F [N],u [mm]\n" + rows)).column("u [mm]")
    assert column.valid.sum() == N // 10 - 1
    assert column.masked["empty"] == 3


@pytest.mark.parametrize(
    "position",
    [
        np.floor(np.arange(N) / 10.0) * 0.05,  # one step of a coarse gauge every ten rows, in even motion
        np.round(PLACE / 0.05) * 0.05,
        PLACE,
    ],
    ids=["even motion", "coarse", "fresh"],
)
def test_a_coarse_or_fresh_position_is_not_held(position: np.ndarray, read: Callable) -> None:
    assert masked(read(SWING, position)) == [{}, {}]


def test_where_all_channels_are_held_none_is_slower(read: Callable) -> None:
    table = read(np.repeat(SWING[::10], 10), np.repeat(PLACE[::10], 10))
    assert not any("th row only" in note for note in table.notes)
