"""Stamps of days, of 100 ns and of seconds and their parts; clocks that tell no times; times before a trigger."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from layouts import RATE, N, f, rows, t, u

from fibrefit.core.errors import DataError
from fibrefit.records import Record, read_record
from fibrefit.records.files.decode import decode
from fibrefit.records.files.text import read_text
from fibrefit.records.options import ReadOptions

TRUE = np.arange(N) / RATE
BEGAN = datetime(2023, 11, 2, 10, tzinfo=UTC)


def path_of(head: str, cells: Callable[[int], str], write: Callable, n: int = N):
    return write(f"{head},F [N],u [mm]\n" + rows(lambda i: f"{cells(i)},{f(i)},{u(i)}", n=n))


def is_right(record: Record, atol: float = 1e-9) -> bool:
    return record.time.size == N and np.allclose(record.time - record.time[0], TRUE, rtol=0, atol=atol)


@pytest.mark.parametrize(
    ("cells", "atol", "since"),
    [
        (lambda i: f"{45232.0 + 10 / 24 + i / RATE / 86400:.12f}", 1e-6, "as spreadsheets do"),
        (lambda i: f"{133433640000000000 + 5000 * i}", 1e-9, "as Windows does"),
        (lambda i: f"{638345088000000000 + 5000 * i}", 1e-9, "as .NET does"),
        (lambda i: f"{1698919200000000000 + 500000 * i}", 1e-9, "1970"),
    ],
)
@pytest.mark.parametrize("heading", ["Time", "Value"])
def test_stamps_tell_their_unit_by_their_size(
    heading: str, cells: Callable[[int], str], atol: float, since: str, write: Callable
) -> None:
    record = read_record(path_of(heading, cells, write))
    assert is_right(record, atol)
    assert any(since in note for note in record.history)


@pytest.mark.parametrize("step", [10_000, 500_000])
def test_a_counter_as_large_as_stamps_is_none_at_a_rate_that_no_record_has(step: int, write: Callable) -> None:
    # Of a clock of 10 MHz that has run for a day; as ms since 1970 the rows would be 10 s apart.
    path = path_of("qpc", lambda i: f"{1234567890123 + step * i}", write)
    with pytest.raises(DataError, match="no column holds the time"):
        read_record(path)
    assert is_right(read_record(path, rate=RATE))


@pytest.mark.parametrize(
    ("head", "cells"),
    [
        ("secs,nsecs", lambda i: f"{1698919200 + i // 2000},{i % 2000 * 500000}"),
        ("header.stamp.sec,header.stamp.nanosec", lambda i: f"1698919200,{i * 500000}"),
        ("tv_sec,tv_usec", lambda i: f"1698919200,{i * 500}"),
        ("Time [s],Time [us]", lambda i: f"17,{i * 500}"),
    ],
)
def test_parts_of_a_second_stand_beside_whole_ones(head: str, cells: Callable[[int], str], write: Callable) -> None:
    assert is_right(read_record(path_of(head, cells, write)))


def test_parts_of_a_second_go_on_over_a_gap(write: Callable) -> None:
    samples = [i for i in range(9000) if not 2100 < i < 5000]
    text = "".join(f"{7 + i // 2000},{i % 2000 * 500},{f(i % 97)}\n" for i in samples)
    record = read_record(write("sec,usec,F [N]\n" + text))
    np.testing.assert_allclose(record.time - record.time[0], np.array(samples) / 2000.0, rtol=0, atol=1e-9)


def test_thousandths_are_called_so_in_words(write: Callable) -> None:
    def cells(i: int) -> str:
        return f"{BEGAN + timedelta(seconds=i // 200):%d.%m.%Y,%H:%M:%S},{i % 200 * 5}"

    record = read_record(path_of("Datum,Zeit,Millisekunden", cells, write, n=420))
    np.testing.assert_allclose(record.time, np.arange(420) / 200.0, rtol=0, atol=1e-9)


def test_two_clocks_are_not_put_together(write: Callable) -> None:
    # Both run on by themselves: neither is a part of the other.
    record = read_record(path_of("Time [s],Time [us]", lambda i: f"{i},{1000000 * i}", write))
    np.testing.assert_allclose(record.time, np.arange(N), rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("cells", "cause"),
    [
        (lambda i: "10:00:00", "never increases"),
        (lambda i: "10:00:00" if i == 0 else "", "fewer than 3 readable times"),
    ],
)
def test_a_clock_that_tells_no_times_is_counted_at_a_rate(
    cells: Callable[[int], str], cause: str, write: Callable
) -> None:
    path = path_of("Time", cells, write)
    with pytest.raises(DataError, match=f"{cause}.*sampling_rate"):
        read_record(path)
    assert is_right(read_record(path, rate=RATE))
    stated = write("fs = 2000 Hz\n" + path.read_text(), "stated.csv")
    record = read_record(stated)
    assert is_right(record)
    assert 'Column "Time" tells no times: the rows are counted.' in record.history


def test_a_rate_does_not_hide_times_that_run_backward(write: Callable) -> None:
    path = path_of("t [s]", lambda i: t(N - i), write)
    with pytest.raises(DataError, match="runs backward"):
        read_record(path, rate=RATE)


@pytest.mark.parametrize(
    "cells", [lambda i: f"0 days 00:00:{i / RATE:09.6f}", lambda i: f'"1 day, 0:00:{i / RATE:09.6f}"']
)
def test_days_before_a_time_of_day(cells: Callable[[int], str], write: Callable) -> None:
    assert is_right(read_record(path_of("elapsed", cells, write)))


def test_days_go_on(write: Callable) -> None:
    def cells(i: int) -> str:
        since = timedelta(hours=23, minutes=59, seconds=59.995) + timedelta(seconds=i / RATE)
        return f"{since.days} days {datetime.min + since - timedelta(days=since.days):%H:%M:%S.%f}"

    assert is_right(read_record(path_of("elapsed", cells, write)))


@pytest.mark.parametrize("form", ["00:00:{:07.4f}", "0:{:07.4f}"])
def test_times_before_the_trigger_are_negative(form: str, write: Callable) -> None:
    def cells(i: int) -> str:
        seconds = i / RATE - 0.005
        return ("-" if seconds < 0 else "") + form.format(abs(seconds))

    assert is_right(read_record(path_of("Time", cells, write)))


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_the_time_of_a_cycle_is_not_that_of_the_record(order: tuple[int, int], write: Callable) -> None:
    heads = ("Total Time (s)", "Cycle Elapsed Time (s)")

    def cells(i: int) -> str:
        both = (t(i), t(i % 8))
        return ",".join(both[k] for k in order) + f",{i // 8}"

    head = ",".join(heads[k] for k in order) + ",Elapsed Cycles"
    assert is_right(read_record(path_of(head, cells, write)))


def test_millionths_of_days_are_no_ms(write: Callable) -> None:
    path = path_of("Time_ms", lambda i: f"{45232416666.6667 + 1e6 * i / RATE / 86400:.4f}", write)
    with pytest.raises(DataError, match='scale = "86.4"'):
        read_record(path)
    said = {"time": {"column": "Time_ms", "scale": "86.4"}}
    assert is_right(read_record(path, channels=said), atol=1e-5)
    assert is_right(read_record(path_of("Time_ms", lambda i: f"{4523241666 + i / 2:.1f}", write)))  # 52 days in ms


def test_whole_seconds_without_a_point_behind_some_are_stamps(write: Callable) -> None:
    record = read_record(path_of("timestamp", lambda i: f"{1698919200 + i / RATE:.4f}".rstrip("0"), write))
    assert is_right(record, 1e-6)


def test_stamps_of_a_slow_record_are_known_by_their_heading(write: Callable) -> None:
    record = read_record(path_of("datetime", lambda i: f"{1698919200 + i}", write))
    np.testing.assert_array_equal(record.time, np.arange(N))


def test_a_clock_that_goes_on_once_has_no_parts_beside_it(write: Callable) -> None:
    # The ms go on by themselves where the seconds do: put together they would leap by a second.
    path = path_of("Epoch [s],Elapsed [ms]", lambda i: f"{1698919200 + i // 12},{i}", write)
    with pytest.raises(DataError, match="printed to 1 s only"):
        read_record(path)


def test_parts_of_a_second_are_no_remarks(write: Callable) -> None:
    path = path_of("secs,nsecs", lambda i: f"{1698919200 + i // 2000},{i % 2000 * 500000}", write)
    raw = read_text(decode(path.read_bytes(), ""), "", ReadOptions())
    assert not [one for one in raw.annotations if "nsecs = " in one.text]  # each would be judged, row by row


@pytest.mark.parametrize("heads", ["Date,Time,Zone", "Time,UTC offset"])
def test_a_zone_in_a_column_of_its_own_is_no_time_before_a_trigger(heads: str, write: Callable) -> None:
    def cells(i: int) -> str:
        stamp = f"{BEGAN + timedelta(seconds=i / RATE):%Y-%m-%d %H:%M:%S.%f}"
        return (stamp.replace(" ", ",") if heads.startswith("Date") else stamp) + ",-05:00"

    assert is_right(read_record(path_of(heads, cells, write)))
