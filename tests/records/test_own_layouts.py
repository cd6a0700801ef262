"""Layouts of their own: universal files, numbers with their units behind them, channels below each other."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from layouts import f, rows, t, u

from fibrefit.core.errors import DataError
from fibrefit.records import read_record
from tests.records.exports.base import FORCE, POSITION, TIME

N = TIME.size


def dataset(name: str, unit: str, values: np.ndarray, kind: int = 2, even: int = 1, step: float = 5e-4) -> str:
    """A data set 58 of a function of time, in the columns of the format."""
    width, digits = (13, 5) if kind == 2 else (20, 12)
    printed = [f"{value:{width}.{digits}e}" for value in values]
    if not even:
        printed = [f"{x:13.5e}{y}" for x, y in zip(step * np.arange(values.size), printed, strict=True)]
    a_line = (6 if kind == 2 else 4) // (1 if even else 2)
    body = "".join("".join(printed[i : i + a_line]) + "\n" for i in range(0, values.size, a_line))
    head = f"    -1\n    58\n{name}\n\nNONE\n02-NOV-23 10:00:00\nNONE\n"
    head += "    1         0    1         0 ROPE               1   3 NONE               0   0\n"
    head += f"{kind:10d}{values.size:10d}{even:10d}{0.0:13.5e}{step:13.5e}{0.0:13.5e}\n"
    head += f"{17:10d}    0    0    0 {'Time':<20} {'s':<20}\n{13:10d}    0    0    0 {name:<20} {unit:<20}\n"
    head += f"{0:10d}    0    0    0 {'NONE':<20} {'NONE':<20}\n" * 2
    return f"{head}{body}    -1\n"


@pytest.mark.parametrize("kind", [2, 4])
@pytest.mark.parametrize("even", [0, 1])
def test_a_universal_file_is_read_by_its_columns(kind: int, even: int, write: Callable) -> None:
    channels = (("Force", "N", FORCE), ("Position", "mm", POSITION))
    record = read_record(write("".join(dataset(*one, kind, even) for one in channels), "drop.uff"))
    np.testing.assert_allclose(record.time, TIME, rtol=0, atol=1e-12)
    np.testing.assert_allclose(record.channels["force"], FORCE, rtol=1e-5)
    np.testing.assert_allclose(record.channels["position"], 1e-3 * POSITION, rtol=1e-5)
    assert record.rate == 2000.0


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        (dataset("Force", "N", FORCE).replace("        17    0", "        18    0"), None),  # its unit is one of time
        (
            dataset("Force", "N", FORCE).replace("        17    0", "        18    0").replace(" s ", " Hz"),
            "a function of",
        ),
        (dataset("Force", "N", FORCE).replace("\n         2  ", "\n         5  "), "values of kind 5"),
        (dataset("Force", "N", FORCE)[: -5 - 5 * 79], "values of 60 that its head announces"),
        (dataset("Force", "N", FORCE).replace("    58\n", "    58b     1     2\n"), "binary"),
        (dataset("Force", "N", FORCE).replace("    58\n", "   151\n"), "without a data set 58"),
        (dataset("Force", "N", FORCE) + dataset("Pos", "mm", POSITION, step=1e-3), "sampled at different times"),
    ],
)
def test_a_universal_file_of_anything_else_is_refused(text: str, cause: str | None, write: Callable) -> None:
    path = write(text, "drop.uff")
    if cause is None:
        assert read_record(path).rate == 2000.0
        return
    with pytest.raises(DataError, match=cause):
        read_record(path)


@pytest.mark.parametrize(
    ("head", "row"),
    [
        ("Time,Force,Position", lambda i: f"{t(i)} sec,{f(i)} N,{u(i)} mm"),
        ('"Time [s]";"Force";"Position"', lambda i: f'"{t(i)}";"{f(i)} N";"{u(i)} mm"'),
        ("Time (s)\tForce (N)\tPosition", lambda i: f"{t(i)}\t{f(i)}N\t{u(i)}mm"),
    ],
)
def test_a_unit_behind_each_number_is_that_of_its_column(head: str, row: Callable[[int], str], write: Callable) -> None:
    plain = read_record(write("t [s],F [N],u [mm]\n" + rows(lambda i: f"{t(i)},{f(i)},{u(i)}"), "plain.csv"))
    record = read_record(write(f"{head}\n{rows(row)}"))
    for role in ("force", "position"):
        assert (record.channels[role] == plain.channels[role]).all()
    assert (record.time == plain.time).all()


def test_units_behind_numbers_that_change_are_refused(write: Callable) -> None:
    def told(row: Callable[[int], str], head: str = "Time (s),Force,Position (mm)") -> Path:
        return write(f"{head}\n{rows(row)}")

    ranged = told(lambda i: f"{t(i)},{f(i)} N,{u(i)}" if i % 9 else f"{t(i)},{f(i)} mN,{u(i)}")
    with pytest.raises(DataError, match='the unit of "Force" changes from "mN"'):
        read_record(ranged)
    lost = told(lambda i: f"{t(i)},{f(i)} N,{u(i)}" if i % 20 else f"{t(i)},{f(i)},{u(i)}")
    with pytest.raises(DataError, match='the unit of "Force" changes from "" '):
        read_record(lost)
    twice = told(lambda i: f"{t(i)},{f(i)} N,{u(i)}", "Time (s),Force (kN),Position (mm)")
    with pytest.raises(DataError, match='the unit is "N" in one place and "kN" in another'):
        read_record(twice)
    with pytest.raises(DataError, match='"0.0000m" is no number'):  # thousandths, and no metres
        read_record(told(lambda i: f"{t(i)}m,{f(i)},{u(i)}"))


@pytest.mark.parametrize("unit", ["", ",{}"])
def test_channels_below_each_other_are_refused_with_what_parts_them(unit: str, write: Callable, tmp_path: Path) -> None:
    def both(i: int) -> str:
        units = (unit.format(one) for one in ("N", "mm"))
        names = zip(("force [N]", "position [mm]"), (f(i), u(i)), units, strict=True)
        return "\n".join(f"{t(i)},{name},{value}{end}" for name, value, end in names)

    head = "time [s],sensor,value" + (",unit" if unit else "")
    path = write(f"{head}\n{rows(both)}", "long.csv")
    with pytest.raises(DataError, match=r'"force \[N\]".*stand below each other') as refused:
        read_record(path)
    code = re.search(r'python -c "(.*)"$', refused.value.do)
    assert code is not None
    subprocess.run([sys.executable, "-c", code[1]], cwd=tmp_path, check=True)
    plain = read_record(write("t [s],F [N],u [mm]\n" + rows(lambda i: f"{t(i)},{f(i)},{u(i)}"), "plain.csv"))
    wide = read_record(tmp_path / "long_wide.csv")
    for role in ("force", "position"):
        np.testing.assert_allclose(wide.channels[role], plain.channels[role], rtol=1e-12)


def test_segments_in_a_column_of_words_are_no_channels(write: Callable) -> None:
    for words in (("ramp", "hold"), ("up", "down", "up", "hold")):
        path = write("phase,t [s],F [N]\n" + rows(lambda i, w=words: f"{w[i % len(w)]},{t(i)},{f(i)}"))
        assert read_record(path).channels["force"].size == read_record(path).time.size > 5


@pytest.mark.parametrize("time", [lambda i: t(i), lambda i: f"10:00:{i / 2000:07.4f}"])
def test_halves_of_cycles_with_times_of_their_own_are_no_channels(time: Callable[[int], str], write: Callable) -> None:
    path = write("Time,cycle,F [N],phase\n" + rows(lambda i: f"{time(i)},{i // 2},{f(i)},{('up', 'down')[i % 2]}"))
    assert read_record(path, units={} if ":" in time(0) else {"time": "s"}).rate == 2000.0
    path = write("no,t [s],name,value\n" + rows(lambda i: f"{i},{t(i // 2)},{('force', 'position')[i % 2]},{f(i)}"))
    with pytest.raises(DataError, match="stand below each other"):
        read_record(path)


def test_a_universal_file_has_times_in_the_unit_of_its_abscissa(write: Callable) -> None:
    text = dataset("Force", "N", FORCE, step=0.5).replace("        17    0", "         0    0").replace(" s ", " ms")
    assert read_record(write(text, "drop.uff")).rate == 2000.0


@pytest.mark.parametrize(
    ("before", "after", "cause"),
    [
        (f"{FORCE.size:10d}{1:10d}", f"{9 * 10**9:10d}{1:10d}", "60 values of 9000000000 that its head announces"),
        (f"{5e-4:13.5e}", f"{'1e+9999999':>13}", "whose head is not as the format has it"),
        (f"{5e-4:13.5e}", f"{'NaN':>13}", "whose head is not as the format has it"),
    ],
)
def test_a_universal_file_makes_no_more_times_than_it_has_values(
    before: str, after: str, cause: str, write: Callable
) -> None:
    with pytest.raises(DataError, match=cause):
        read_record(write(dataset("Force", "N", FORCE).replace(before, after, 1), "drop.uff"))


def test_ranges_beside_readings_are_left_out(write: Callable) -> None:
    path = write("Time (s),Force (N),Range\n" + rows(lambda i: f"{t(i)},{f(i)},{'100 mV' if i < 9 else '1 V'}"))
    assert 'Column "Range" holds text and is left out.' in read_record(path).history


def test_quotes_in_cells_beside_numbers_with_units_stay(write: Callable) -> None:
    path = write('"Time","Force","Remark"\n' + rows(lambda i: f'"{t(i)} s","{f(i)} N","a ""b"", c"'))
    assert read_record(path).rate == 2000.0


def test_a_name_that_a_shell_would_run_is_in_no_command(write: Callable) -> None:
    for head in ("time [s],sensor,value $(touch a)", "time [s],sensor`id`,value"):
        lines = rows(lambda i: f"{t(i)},force,{f(i)}\n{t(i)},position,{u(i)}")
        with pytest.raises(DataError, match="stand below each other") as refused:
            read_record(write(f"{head}\n{lines}", "long.csv"))
        assert "python" not in refused.value.do
