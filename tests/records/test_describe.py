"""What is said about a file: sentences within 80 columns, and a summary for programs."""

from __future__ import annotations

import json
import time
from collections.abc import Callable

import numpy as np
import pytest
from layouts import LAYOUTS, de, f, german, rows, t, u

from fibrefit.records import ReadOptions, describe, read_record, read_table

#: Processor seconds a file of 100 000 rows may take; a tenth of that is typical of an idle machine, CI is not one.
SLOWEST = 4.0


def said(lines: list[str]) -> str:
    return " ".join(" ".join(lines).split())


@pytest.mark.parametrize("layout", LAYOUTS[::5], ids=lambda layout: layout.name)
def test_width(layout, write: Callable) -> None:
    options = {key: value for key, value in layout.options.items() if key not in ("scale", "epoch")}
    path = write(layout.content, f"a file with a rather long name for a file{layout.suffix}")
    for lines in (describe(read_table(path, ReadOptions(**options))), describe(read_record(path, **options))):
        assert lines
        assert max(map(len, lines)) <= 80


def test_of_a_damaged_file(write: Callable) -> None:
    lines = ("t [s];F [N];u [mm];Bemerkung\n" + rows(lambda i: german(i) + ";")).split("\n")
    lines[5] = lines[5].replace("0,0020;", "0,0020;OVLD;").replace(";OVLD;" + de(f(4)), ";OVLD")
    lines[9] += "1;2"
    del lines[14:16]
    text = said(describe(read_table(write("\n".join(lines) + "\nEnde\n", "drop.csv"))))
    assert (
        "drop.csv: 21 rows in lines 2 to 23, header in line 1; UTF-8, columns separated by semicolon, decimal comma"
        in text
    )
    assert 'Time column "t [s]": 2000 Hz' in text
    assert "1 masked (1 overflow)" in text
    assert "Gap after 3.5 ms: 1 sample missing." in text
    assert "Gap after 6 ms: 2 samples missing." in text
    assert "Line 10 cannot be split into 4 cells and is left out." in text
    assert 'below the table is left out ("Ende")' in text
    assert 'Column "Bemerkung" is empty and is left out.' in text


def test_doubts_are_told(write: Callable) -> None:
    text = "t [s];A [N];B [N];u [mm]\n" + rows(lambda i: de(f"{t(i)};{f(i)};1.{i};{u(i)}"))
    assert 'In doubt: columns "A [N]" and "B [N]" could each be the force.' in said(describe(read_table(write(text))))


def test_a_role_that_no_column_has_is_told(write: Callable) -> None:
    text = "t [s];F [N];stroke in parts;height [mm]\n" + rows(lambda i: de(f"{t(i)};{f(i)};{u(i)};50"))
    told = said(describe(read_table(write(text.replace("stroke", "q")))))
    assert 'No column is taken for the position. If one is, name it: position = "q in parts" under [channels].' in told
    assert "No column is taken" not in said(describe(read_table(write(text))))
    told = said(describe(read_table(write(text.replace("stroke in parts", "U2 [V]")))))
    assert (
        'If "U2 [V]" is its signal, state what it is worth: position = { column = "U2 [V]", scale = ".. m/V" }' in told
    )
    still = "t [s];F [N];height [mm]\n" + rows(lambda i: de(f"{t(i)};{f(i)};50"))
    told = said(describe(read_table(write(still))))
    assert 'No column is taken for the position. "height [mm]" has its unit and does not change.' in told


def test_many_gaps_are_summed_up(write: Callable) -> None:
    text = "t [s];F [N]\n" + "".join(de(f"{i / 2000:.4f};{f(i)}\n") for i in range(100) if i % 10 != 5)
    text = said(describe(read_record(write(text))))
    assert text.count("Gap after") == 3
    assert "7 further gaps with 7 samples missing." in text


def test_understood_is_json(write: Callable) -> None:
    understood = read_table(write("t [s];F [N];u [mm]\n" + rows(german))).understood
    again = json.loads(json.dumps(understood, allow_nan=False))
    assert again == understood
    assert again["layout"]["delimiter"] == "semicolon"
    assert again["roles"] == {"force": "F [N]", "position": "u [mm]"}
    assert again["columns"][0]["maximum"] == max(float(f(i)) for i in range(24))
    assert again["times"][0]["rate_hz"] == 2000.0


@pytest.mark.parametrize("pattern", ["{:.4f},{:.3f},{:.4f}\n", '"{:.4f}","{:.3f}","{:.4f}"\n', "{!r},{!r},{!r}\n"])
def test_a_hundred_thousand_rows(pattern: str, write: Callable) -> None:
    n = 100_000
    rng = np.random.default_rng(0)
    times = np.arange(n) / 2000
    force = 50 * np.abs(np.sin(20 * times)) + 0.4 * rng.standard_normal(n)
    position = 10 * np.sin(10 * times) + 0.02 * rng.standard_normal(n)
    body = "".join(pattern.format(*row) for row in zip(times.tolist(), force.tolist(), position.tolist(), strict=True))
    path = write("time [s],force [N],position [mm]\n" + body)
    start = time.process_time()
    record = read_record(path)
    assert time.process_time() - start < SLOWEST
    assert len(record) == n
    assert all(valid.all() for valid in record.valid.values())
