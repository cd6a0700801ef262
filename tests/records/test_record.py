"""Records: immutable, in SI, with the history of what was done to them."""

from __future__ import annotations

import dataclasses
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from layouts import N, f, plain, rows, u

from fibrefit.core.errors import UsageError
from fibrefit.records import Record, read_record, read_table, record_of

TEXT = "time [s],force [N],position [mm]\n" + rows(plain)


@pytest.fixture
def record(write: Callable) -> Record:
    return read_record(write(TEXT, "drop.csv"))


def with_gap(write: Callable) -> Record:
    lines = TEXT.splitlines(keepends=True)
    del lines[6:8]
    lines[10] = lines[10].replace(lines[10].split(",")[1], "OVLD")
    return read_record(write("".join(lines), "gap.csv"))


def test_what_a_record_knows(record: Record) -> None:
    assert record.name == "drop.csv"
    assert record.path.name == "drop.csv"
    assert len(record.sha256) == 64
    assert record.units == {"force": "N", "position": "m"}
    assert record.headers == {"time": "time [s]", "force": "force [N]", "position": "position [mm]"}
    assert len(record) == N
    assert record.duration == pytest.approx((N - 1) / 2000)
    assert record.history[0] == 'Read from drop.csv; time: time column "time [s]".'
    assert repr(record) == "Record 'drop.csv'\n  force, position; 24 samples, 11.5 ms, 2000 Hz"
    assert '<th scope="col">masked</th>' in record._repr_html_()


def test_nothing_can_be_written_to(record: Record) -> None:
    for array in (record.time, *record.channels.values(), *record.valid.values()):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
    with pytest.raises(TypeError):
        record.channels["force"] = record.time  # type: ignore[index]
    with pytest.raises(dataclasses.FrozenInstanceError):
        record.rate = 1.0  # type: ignore[misc]


def test_arrays_handed_in_are_not_shared() -> None:
    time, force = np.arange(5.0), np.ones(5)
    record = Record("a", Path("a"), "0", time, {"force": force}, {"force": np.ones(5, bool)}, 1.0)
    force[0] = 7.0
    assert record.channels["force"][0] == 1.0


def test_sizes_must_agree() -> None:
    with pytest.raises(ValueError, match="do not fit 5 times"):
        Record("a", Path("a"), "0", np.arange(5.0), {"force": np.ones(4)}, {"force": np.ones(4, bool)}, 1.0)


def test_a_record_travels_between_processes(record: Record) -> None:
    again = pickle.loads(pickle.dumps(record))
    np.testing.assert_array_equal(again.channels["force"], record.channels["force"])
    assert again.history == record.history
    assert not again.time.flags.writeable


def test_window(record: Record) -> None:
    part = record.window(0.002, 0.005)
    np.testing.assert_allclose(part.time, np.arange(4, 11) / 2000)
    np.testing.assert_array_equal(part.channels["force"], record.channels["force"][4:11])
    assert part.history[-1] == "Kept 0.002 to 0.005 s: 7 of 24 samples."
    assert len(record) == N
    assert len(record.window(start=0.01)) == 4


def test_window_without_samples(record: Record) -> None:
    with pytest.raises(
        UsageError, match="a window from 5 to 6 s holds 0 samples; expected at least 3 of the record's 0 to 0.0115 s"
    ):
        record.window(5.0, 6.0)


def test_only_what_may_give_a_reason_to_doubt_a_number_is_a_note(write: Callable) -> None:
    with_words = "time [s],force [N],position [mm],remark\n" + rows(lambda i: f"{plain(i)},fine")
    whole = read_record(write(with_words, "whole.csv"))
    assert whole.notes == ()
    assert any('"remark" holds text' in said for said in whole.history)
    remarked = read_record(write(f"# Load cell hangs from the beam, laser below\n{TEXT}", "remarked.csv"))
    damaged = with_gap(write)
    for record, says in (
        (remarked, "Not understood"),
        (damaged, "1 sample masked"),
        (damaged, "2 samples missing"),
    ):
        (note,) = (note for note in record.notes if says in note)
        assert note in record.history


def test_masked(record: Record) -> None:
    where = record.time > 0.01
    less = record.masked("force", where, "the cable was loose")
    assert np.isnan(less.channels["force"][where]).all()
    assert not less.valid["force"][where].any()
    assert less.valid["position"].all()
    assert less.history[-1] == less.notes[-1] == "Masked 3 samples of force: the cable was loose."
    assert record.valid["force"].all()


def test_only(record: Record) -> None:
    assert set(record.only("position").channels) == {"position"}
    with pytest.raises(
        UsageError, match='no channel "positon"; expected one of force, position.*Did you mean "position"'
    ):
        record.only("positon")


def test_record_of_a_table(write: Callable) -> None:
    table = read_table(write(TEXT))
    assert {role: table.columns[place].header for role, place in table.roles.items()} == {
        "force": "force [N]",
        "position": "position [mm]",
    }
    assert record_of(table, name="first").name == "first"
    with pytest.raises(KeyError):
        table.column("weight")


def test_two_forces_of_a_pendulum(write: Callable) -> None:
    text = "t [s],angle [deg],force_1 [N],force_2 [N]\n" + rows(lambda i: f"{i / 2000:.4f},{i}.5,{f(i)},{u(i)}")
    record = read_record(write(text))
    assert set(record.channels) == {"angle", "force_1", "force_2"}
    assert record.channels["angle"][1] == pytest.approx(np.deg2rad(1.5))
