"""Times: coarse prints, gaps, rows out of order. Nothing is moved; what does not fit is left without a time."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import pytest
from layouts import f, u

from fibrefit.core.errors import DataError
from fibrefit.records import TimeGap, read_record, read_table

HEAD = "t [s],F [N],u [mm]\n"


def table(times: Iterable[str], values: Iterable[int] | None = None) -> str:
    """File with these times, and the values of these samples."""
    times = list(times)
    return HEAD + "".join(f"{t},{f(i)},{u(i)}\n" for t, i in zip(times, values or range(len(times)), strict=True))


def regular(n: int, rate: float = 2000.0, digits: int = 4) -> list[str]:
    return [f"{i / rate:.{digits}f}" for i in range(n)]


@pytest.mark.parametrize("rate", [2000.0, 1200.0, 990.0, 800.0, 4800.0, 1024.0])
@pytest.mark.parametrize("cut", [True, False], ids=["cut off", "rounded"])
def test_coarse_times_are_counted_at_a_round_rate(rate: float, cut: bool, write: Callable) -> None:
    n = 4000
    times = [f"{int(i / rate * 1000 + 1e-9) / 1000:.3f}" if cut else f"{i / rate:.3f}" for i in range(n)]
    record = read_record(write(table(times)))
    assert record.rate == pytest.approx(rate, rel=1e-9)
    np.testing.assert_allclose(record.time, np.arange(n) / rate, rtol=0, atol=1e-9)
    assert "printed to 1 ms only" in record.history[0]


@pytest.mark.parametrize("rate", [2000.0, 1200.0, 4800.0])
@pytest.mark.parametrize("cut", [True, False], ids=["cut off", "rounded"])
@pytest.mark.parametrize("damage", ["lost", "doubled"])
def test_a_row_lost_or_doubled_among_coarse_times_is_noticed(
    rate: float, cut: bool, damage: str, write: Callable
) -> None:
    numbers = list(range(4000))
    if damage == "lost":
        del numbers[2001]
    else:
        numbers.insert(2001, 2001)
    times = [f"{int(i / rate * 1000 + 1e-9) / 1000:.3f}" if cut else f"{i / rate:.3f}" for i in numbers]
    with pytest.raises(DataError, match="rows are missing or doubled|leaves the rate open"):
        read_record(write(table(times, numbers)))


def test_coarse_times_of_an_odd_rate_are_refused(write: Callable) -> None:
    times = [f"{i / 1873.417:.3f}" for i in range(4000)]
    with pytest.raises(DataError, match="leaves the rate open|does not count on evenly"):
        read_record(write(table(times)))


def test_times_with_no_step_as_large_as_their_last_digit_are_refused_without_a_warning(
    write: Callable, recwarn: pytest.WarningsRecorder
) -> None:
    with pytest.raises(DataError, match="leaves the rate open"):
        read_record(write(table([f"{i}e-300" for i in range(4000)])))
    assert not list(recwarn)


@pytest.mark.parametrize(("rate", "digits"), [(1651.6, 6), (3000.0, 6), (12800.0, 6), (333.0, 5), (2000.3, 7)])
def test_rounded_times_of_any_rate(rate: float, digits: int, write: Callable) -> None:
    record = read_record(write(table(regular(4000, rate, digits))))
    assert record.rate == pytest.approx(rate, rel=1e-5)
    assert record.uniform
    assert not record.gaps


def test_gaps_are_named(write: Callable) -> None:
    kept = [i for i in range(100) if i not in (10, 40, 41, 42)]
    record = read_record(write(table([regular(100)[i] for i in kept], kept)))
    assert record.gaps == (TimeGap(pytest.approx(9 / 2000), 1), TimeGap(pytest.approx(39 / 2000), 3))
    assert len(record) == 96
    assert "4 samples missing in 2 gaps." in record.history


def test_gaps_of_whole_digits(write: Callable) -> None:
    """Times in whole milliseconds at 1 kHz are coarse by their digits and exact all the same."""
    kept = [i for i in range(100) if i not in (10, 40, 41)]
    record = read_record(write("t [ms],F [N]\n" + "".join(f"{i},{f(i)}\n" for i in kept)))
    assert record.rate == 1000.0
    assert [gap.missing for gap in record.gaps] == [1, 2]


def test_a_row_out_of_place_is_left_out(write: Callable) -> None:
    order = [*range(20), 5, *range(20, 40)]
    changed = table([regular(40)[i] for i in order], [*range(20), 39, *range(20, 40)])
    record = read_record(write(changed))
    # Two rows claim sample 5: neither can be relied on.
    assert len(record) == 39
    assert 5 / 2000 not in record.time
    assert any("time runs backward or stands still" in said for said in record.history)


def test_a_row_written_twice_is_read_once(write: Callable) -> None:
    order = [*range(20), 19, 18, 19, *range(20, 40)]
    record = read_record(write(table([regular(40)[i] for i in order], order)))
    np.testing.assert_allclose(record.time, np.arange(40) / 2000)
    np.testing.assert_allclose(record.channels["force"], [float(f(i)) for i in range(40)])


def test_a_time_off_the_grid_is_left_out(write: Callable) -> None:
    times = regular(100)
    times[30] = "0.0153"
    record = read_record(write(table(times)))
    assert len(record) == 99
    assert record.gaps[0].missing == 1
    assert "1 row left out: time is off the grid." in record.history


def test_a_last_row_far_away_is_left_out(write: Callable) -> None:
    times = regular(100)
    times[-1] = "5.0495"
    record = read_record(write(table(times)))
    assert len(record) == 99
    assert not record.gaps


def test_uneven_sampling_is_kept_as_printed(write: Callable) -> None:
    rng = np.random.default_rng(3)
    times = np.cumsum(0.0005 * (1 + 0.3 * rng.random(200)))
    record = read_record(write(table(f"{t:.6f}" for t in times)))
    assert not record.uniform
    np.testing.assert_allclose(record.time, times, atol=5e-7)
    assert any("The sampling is uneven" in said for said in record.history)


def test_a_rate_of_the_header_that_differs_is_mentioned(write: Callable) -> None:
    record = read_record(write("fs = 2100 Hz\n" + table(regular(50))))
    assert record.rate == 2000.0
    assert "The column runs at 2000 Hz, the header says 2100 Hz: the column is used." in record.history


def test_a_rate_of_the_header_that_is_twice_that_of_the_times_is_asked_about(write: Callable) -> None:
    path = write("fs = 4000 Hz\n" + table(regular(50)))
    with pytest.raises(DataError, match='"fs = 4000 Hz", and "t .s." has 2000 Hz'):
        read_record(path)
    assert read_record(path, channels={"time": {"column": "t [s]", "scale": "1"}}).rate == 2000.0


def test_negative_control_regular_times_lose_nothing(write: Callable) -> None:
    base = read_table(write(table(regular(3000)))).times[0]
    assert base.lost == {}
    assert base.gaps == ()
    assert base.notes == ()


def test_clock_starts_at_the_first_readable_time(write: Callable) -> None:
    lines = [f"14:22:{11 + i / 2000:07.4f},{f(i)}" for i in range(40)]
    lines[0] = lines[0].replace("14:22", "1x:22")
    record = read_record(write("time,F [N]\n" + "\n".join(lines) + "\n"))
    assert record.time[0] == 0.0
    assert record.channels["force"][0] == float(f(1))


def test_the_slow_group_may_come_first(write: Callable) -> None:
    rows = [f"{i / 10:.4f},21.5" if i < 4 else "," for i in range(40)]
    body = "".join(f"{slow},{i / 2000:.4f},{f(i)}\n" for i, slow in enumerate(rows))
    record = read_record(write("Time 1 [s],Temp [°C],Time 2 [s],Force [N]\n" + body))
    assert record.rate == 2000.0
    assert record.headers["time"] == "Time 2 [s]"
    assert "Left out, sampled at 10 Hz: Temp [°C]." in record.history


def test_minutes_that_begin_anew_without_their_hours_are_no_summer_time(write: Callable) -> None:
    cells = [f"{(3599.5 + 0.0005 * i) % 3600 // 60:02.0f}:{(3599.5 + 0.0005 * i) % 60:07.4f}" for i in range(2000)]
    rows = "".join(f"{cell};{i % 7};{i % 5}\n" for i, cell in enumerate(cells))
    with pytest.raises(DataError, match="minutes and seconds without their hours.*h:mm:ss.000"):
        read_record(write("Time;Force [N];Position [mm]\n" + rows))


def test_a_clock_that_stood_still(write: Callable) -> None:
    times = regular(1000)
    times[500:530] = [times[500]] * 30
    record = read_record(write(table(times)))
    assert len(record) == 970
    assert "30 rows left out: time runs backward or stands still." in record.history


def test_a_first_row_with_a_time_of_its_own_is_no_row_of_factors(write: Callable) -> None:
    rows = "".join(f"{i / 150:.5f},4.00000,{0.19855 - 1e-4 * (i % 5):.5f},{0.123 + 1e-3 * i:.5f}\n" for i in range(60))
    told = {"time": "column 1", "force": "column 2", "position": "column 3"}
    units = {"time": "s", "force": "N", "position": "m"}
    record = read_record(write("0.00000,4.00000,0.19855,0.00000\n" + rows, "a.csv"), channels=told, units=units)
    assert len(record) == 59
    with pytest.raises(DataError, match="no reading and may be a factor"):
        read_record(write("1.00000,4.00000,2.00000,1.00000\n" + rows, "b.csv"), channels=told, units=units)


def unpadded(begin: str, sign: str, n: int = 300) -> list[str]:
    """Times of 1 kHz whose thousandths are printed without their leading zeros."""
    return [f"{begin}{11 + i // 1000}{sign}{i % 1000}" for i in range(850, 850 + n)]


@pytest.mark.parametrize(
    ("heading", "begin", "sign"),
    [
        ("Time", "14:22:", "."),
        ("Time", "14:22:", ":"),
        ("Time", "22:", "."),
        ("Time [s]", "", "."),
        ("Zeit", "14:22:", ","),
    ],
)
def test_thousandths_without_their_leading_zeros_are_refused(heading: str, begin: str, sign: str, write) -> None:
    body = "".join(f"{time};{i % 7}\n" for i, time in enumerate(unpadded(begin, sign)))
    with pytest.raises(DataError, match="thousandths without their leading zeros; expected three digits"):
        read_record(write(f"{heading};F [N]\n{body}"))


@pytest.mark.parametrize("begin", ["14:22:", ""])
def test_tenths_whose_last_zeros_are_dropped_are_no_thousandths(begin: str, write) -> None:
    times = [f"{begin}{11 + i / 20:g}" if i % 20 else f"{begin}{11 + i // 20}.0" for i in range(100)]
    body = "".join(f"{time};{i % 7}\n" for i, time in enumerate(times))
    heading = "Time" if begin else "Time [s]"
    assert read_record(write(f"{heading};F [N]\n{body}")).rate == pytest.approx(20.0)


def test_columns_that_are_parts_of_the_clock_are_not_called_left_out(write) -> None:
    body = "".join(f"12.04.2023;14:22:{11 + i // 1000};{i % 1000};{i % 7}\n" for i in range(0, 2000, 5))
    record = read_record(write(f"Datum;Uhrzeit;ms;F [N]\n{body}"))
    assert record.rate == pytest.approx(200.0)
    for column in ("Datum", "ms"):
        assert f'Column "{column}" is read with the clock beside it.' in record.history
