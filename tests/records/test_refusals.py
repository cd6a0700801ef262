"""What cannot be read in one way is refused: where, what was found, what to do."""

from __future__ import annotations

import io
from typing import Any

import openpyxl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from layouts import N, de, f, german, plain, rows, t, u

from fibrefit.core.errors import DataError, UsageError
from fibrefit.records import read_record
from tests.records.exports.containers import zipped


def book(**sheets: list[list[Any]]) -> bytes:
    """An .xlsx file by the cells of its sheets."""
    made, file = openpyxl.Workbook(), io.BytesIO()
    made.remove(made.active)
    for title, cells in sheets.items():
        sheet = made.create_sheet(title)
        for row in cells:
            sheet.append(row)
    made.save(file)
    return file.getvalue()


def parquet(**columns: list[Any]) -> bytes:
    file = io.BytesIO()
    pq.write_table(pa.table(columns), file)
    return file.getvalue()


CELLS = [["t [s]", "F [N]"], *([1e-3 * i, 1.5 * i] for i in range(30))]
HEAD = "t [s];F [N];u [mm]\n"
GERMAN = HEAD + rows(german)

REFUSED = {
    "empty": ("", "the file is empty"),
    "binary": (bytes(range(256)) * 10, "binary data, not text.*Export the values as CSV"),
    "old spreadsheet": (b"\xd0\xcf\x11\xe0....", "an old spreadsheet.*Save the sheet as CSV"),
    "archive cut short": (b"PK\x03\x04....", "the archive is damaged .*Copy it again"),
    "compressed file cut short": (b"\x1f\x8b\x08....", "the archive is damaged .*Copy it again"),
    "prose": ("Only words here\nand no number\nat all\n", "no table of numbers found"),
    "two rows": (HEAD + rows(german, n=2), "only 2 rows of numbers; expected at least 3 samples"),
    "narrow space in thousands": (
        HEAD + rows(lambda i: de(f"{t(i)};1\u202f0{f(i)};{u(i)}")),
        r'column "F \[N\]", line 2: "1.012,500" has a thousands separator',
    ),
    "quoted thousands": (
        "t [s],F [N],u [mm]\n" + rows(lambda i: f'{t(i)},"1,0{f(i)}",{u(i)}'),
        '"1,012.500" has a thousands separator',
    ),
    "thousands from the line where they begin": (
        HEAD + rows(lambda i: de(f"{t(i)};") + ("999" if i < 20 else f"1.01{i - 20}") + de(f";{u(i)}")),
        'line 22: "1.010" has a thousands separator',
    ),
    "both decimal marks": (
        HEAD + rows(lambda i: german(i) if i % 2 else german(i).replace(",", ".")),
        "beside numbers with a decimal.*one decimal mark throughout",
    ),
    "one column with commas": (
        "F [N]\nfs = 2000 Hz\n" + rows(lambda i: de(f(i))),
        r"as 2 whole numbers \(12  500\) or as 1 with a decimal comma \(12,500\)",
    ),
    "commas of two kinds and no header": (
        rows(lambda i: f"{i},{i * 2}"),
        "without headings|can be read as",
    ),
    "two recordings": (
        GERMAN + rows(lambda i: de(f"{t(i)};{float(f(i)) + 1:.3f};{u(i)}")),
        r"line 26: the time starts again at 0 s; expected one recording\. Split the file there",
    ),
    "two tables": (
        GERMAN + "t [s];T [V];x [mm]\n" + rows(german),
        r'line 26: a second heading inside the table \("t \[s\];T \[V\];x \[mm\]"\)',
    ),
    "two tables of other widths": (
        "a;b\n" + rows(lambda i: de(f"{t(i)};{f(i)}")) + "\n".join(["", *("text",) * 60, ""]) + GERMAN,
        r"more than one table of numbers \(lines 2 to 25",
    ),
    "one table with an overload star": (
        "t [s];F [N];u [mm]\n" + rows(lambda i: german(i) if i > 9 else de(f"{t(i)};{f(i)}*;{u(i)}"), n=30),
        r'line 2: "12,500\*" is no number; expected rows of 3 numbers',
    ),
    "one table with negative numbers in brackets": (
        HEAD + rows(lambda i: f"{t(i)},{f(i)},{u(i)}" if i > 9 else f"{t(i)},{f(i)},(0.25)", n=30),
        r'line 2: "\(0\.25\)" is no number; expected rows of 3 numbers',
    ),
    "one table with columns that touch": (
        "t[s] F[N] u[mm]\n" + rows(lambda i: f"{t(i)} {f(i)} {u(i)}" if i > 9 else f"{t(i)} {f(i)}{u(i)}", n=30),
        r'line 2: "0\.0000 12\.500-0\.2500" has 2 cells where the table has 3',
    ),
    "one table with thousands beside separators": (
        HEAD + rows(lambda i: f"{t(i)},{f(i)},{u(i)}" if i > 9 else f"{t(i)},1,0{f(i)},{u(i)}", n=30),
        r'line 2: "0\.0000,1,012\.500,-0\.2500" has 4 cells where the table has 3',
    ),
    "headings that stand twice": (
        "t [s];Load [N];u [mm];Load [N]\n" + rows(lambda i: de(f"{t(i)};{f(i)};{u(i)};{f(i)}")),
        r'columns "column 2" and "column 4" \("Load \[N\]"\) could each be the force; .* force = "column 2" under',
    ),
    "a page of HTML": (
        "<html><table>" + rows(lambda i: f"<tr><td>{t(i)}</td><td>{f(i)}</td></tr>") + "</table></html>\n",
        r"a page of HTML, no table of text; .* save it as .xlsx or CSV",
    ),
    "no unit": (
        "t [s];F;u [mm]\n" + rows(german),
        r'column "F": no unit; expected N, kN, mN, daN, cN, lbf, kgf, gf or kip. Declare it',
    ),
    "no units": ("t;F;u\n" + rows(german), 'columns "t", "F", "u": no units; expected one for each. Declare them'),
    "time without unit": (
        "t;F [N];u [mm]\n" + rows(lambda i: de(f"{t(i, 10)};{f(i)};{u(i)}")),
        r'column "t": no unit; expected s, ms',
    ),
    "unit unknown": (
        "t [s];force [kx];u [mm]\n" + rows(german),
        'column "force .kx.": unit "kx"; expected N, kN, mN, daN, cN, lbf, kgf, gf or kip',
    ),
    "unit of another kind": (
        "t [s];Kraft [mm/s];u [mm]\n" + rows(german),
        'column "Kraft .mm/s.": unit "mm/s"; expected',
    ),
    "signal of a sensor": (
        "t [s];Kraft [V];u [mm]\n" + rows(german),
        'column "Kraft .V.": unit "V", a signal; expected N',
    ),
    "two forces": (
        "t [s];A [N];B [N];u [mm]\n" + rows(lambda i: de(f"{t(i)};{f(i)};1.{i};{u(i)}")),
        r'"A \[N\]" and "B \[N\]" could each be the force; expected one. Name it: force = "A \[N\]" under',
    ),
    "two positions": (
        "t [s];F [N];A [mm];B [mm]\n" + rows(lambda i: german(i) + f";1,{i}"),
        "could each be the position",
    ),
    "nothing known": ("t [s];A;B\n" + rows(german), 'no channel is known among "A", "B".*Name the channels'),
    "no time, no rate": (
        "F [N];u [mm]\n" + rows(lambda i: de(f"{f(i)};{u(i)}")),
        r'no column holds the time \(none of "F \[N\]", "u \[mm\]" in line 1 has a unit of time or is called so\), and '
        'the header names no rate; expected .* or a rate such as "fs = 2000 Hz".*sampling_rate = "2 kHz" under',
    ),
    "two rates in the header": (
        "fs = 2000 Hz\nfs = 1000 Hz\nF [N];u [mm]\n" + rows(lambda i: de(f"{f(i)};{u(i)}")),
        "the header names several rates: 2000 Hz, 1000 Hz",
    ),
    "a heading missing": (
        "t [s];F [N]\n" + rows(german),
        "3 columns of numbers, and no line above has 3 headings",
    ),
    "a comma missing in the header": ("t [s],F [N] u [mm]\n" + rows(plain), "no line above has 3 headings"),
    "a heading of an empty column missing": (
        "t [s];F [N];Comment\n" + rows(lambda i: german(i) + ";"),
        "no line above has 3 headings",
    ),
    "time backward throughout": (
        HEAD + rows(lambda i: german(N - 1 - i)),
        "the time runs backward from the first row to the last.*Sort the rows",
    ),
    "time not readable": (
        HEAD + rows(lambda i: "x" + german(i)),
        '"x0,0000" is no number; expected numbers in s',
    ),
    "unit of time against the rate": (
        "fs = 2000 Hz\ntime [ms],F [N],u [mm]\n" + rows(plain),
        "the column runs at 2000000 Hz, the header says 2000 Hz; expected one rate. Check the unit of the time",
    ),
    "no time, line unreadable": (
        "# fs = 2000 Hz\nF [N];u [mm]\n" + rows(lambda i: de(f"{f(i)};{u(i)}") + ("\n1;2;3" if i == 5 else "")),
        "no column holds the time, and line 9 is not readable, so later times are uncertain",
    ),
    "no time, empty line": (
        "# fs = 2000 Hz\nF [N];u [mm]\n" + rows(lambda i: de(f"{f(i)};{u(i)}") + ("\n" if i == 5 else "")),
        "blank lines stand between the rows, so later times are uncertain",
    ),
    "no time, samples announced": (
        "# fs = 2000 Hz\n# samples: 30\nF [N];u [mm]\n" + rows(lambda i: de(f"{f(i)};{u(i)}")),
        "the header announces 30 samples, and 24 are there",
    ),
    "clock of whole seconds": (
        "Zeit;F [N];u [mm]\n" + rows(lambda i: f"14:22:{11 + i // 8:02d};{f(i)};{u(i)}"),
        r"is printed to 1 s only, which leaves the rate open \(about .* Hz\).*Give the sampling rate",
    ),
    "hours and minutes or minutes and seconds": (
        "Zeit;F [N];u [mm]\n" + rows(lambda i: f"14:{i:02d};{f(i)};{u(i)}"),
        '"14:00" is no time of day with seconds',
    ),
}


COARSE = [f"{i // 4 / 1000:.3f}" for i in range(N)]
REFUSED |= {
    "hardly a time": (HEAD + rows(lambda i: german(i) if i < 2 else de(f"x;{f(i)};{u(i)}")), "fewer than 3 readable"),
    "a time that stands still": (HEAD + rows(lambda i: de(f"0.5;{f(i)};{u(i)}")), "the time never increases"),
    "coarse times that end where they begin": (
        HEAD + rows(lambda i: de(f"{COARSE[i] if i < N - 1 else COARSE[0]};{f(i)};{u(i)}")),
        "the last time is not later than the first; expected times that increase",
    ),
    "objects that name nothing alike": (
        '{"a": 1}\n{"b": 2}\n{"c": 3}\n',
        "JSON without a table; expected objects that name the same values, one a row",
    ),
    "objects cut short": (
        '{"t": 0.1, "F": 1}\n{"t": 0.2, "F": 2}\n{"t": 0.3, "F"',
        'line 3: JSON that ends or breaks off: Expecting .* delimiter .*"F""\\); expected a whole object.*cut short',
    ),
    "objects in objects without end": (
        '{"a":' * 100_000 + "1" + "}" * 100_000,
        "JSON that ends or breaks off: nested too deeply",
    ),
    "lists of two lengths": (
        '{"time [s]": [0, 1, 2, 3], "force [N]": [1, 2, 3]}',
        r"lists of different lengths \(time \[s\]: 4, force \[N\]: 3\); expected one length",
    ),
    "an object without rows": (
        '{"a": {"b": 1}}',
        r'JSON without a table \("a"\); expected a list of objects, or lists of one',
    ),
    "tables on two sheets": (book(one=CELLS, two=CELLS), r'tables on 2 sheets \("one", "two"\); expected one'),
    "sheets without a table": (
        book(one=[["words"]], two=[]),
        r'no rows of numbers on any sheet \("one", "two"\); expected a table',
    ),
    "parquet of words": (parquet(a=["x", "y", "z", "u"]), "no column of at least 3 numbers; expected a column for"),
    "parquet of two rows": (parquet(t=[0.1, 0.2], F=[1.0, 2.0]), "no column of at least 3 numbers"),
    "archive of nothing": (zipped({}), r"an archive that holds 0 measurement files \(nothing\)"),
    "archive without a measurement": (
        zipped({"plot.png": b"\x89PNG", "note.txt": b"Only words.\n"}),
        r"an archive that holds 0 measurement files \(plot.png, note.txt\); expected one measurement file",
    ),
    "archive of two": (
        zipped({"a.csv": GERMAN.encode(), "b.csv": GERMAN.encode(), "note.txt": b"Only words.\n"}),
        r"an archive that holds 2 measurement files \(a.csv, b.csv\); expected one measurement file\. Unpack",
    ),
    "archive in an archive": (
        zipped({"run.zip": zipped({"run.csv": GERMAN.encode()})}),
        r"an archive in an archive \(run.zip\); expected one measurement file in it",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused(name: str, write) -> None:
    content, message = REFUSED[name]
    with pytest.raises(DataError, match=message) as refused:
        read_record(write(content))
    assert "file.csv" in refused.value.where
    assert len(str(refused.value)) < 400


WISHES = {
    "channel not there": (
        {"channels": {"force": "Kraft"}},
        DataError,
        'channel "force": no column "Kraft"; expected one of',
    ),
    "channel misspelt": ({"channels": {"force": "F [M]"}}, DataError, 'Did you mean "F .N."'),
    "role unknown": ({"channels": {"forc": "F [N]"}}, DataError, 'unknown role.*Did you mean "force"'),
    "column number too high": ({"channels": {"force": "column 9"}}, DataError, 'no column "column 9"'),
    "unit of no column": ({"units": {"Kraft": "N"}}, DataError, 'unit of "Kraft": no such column'),
    "unit unknown": (
        {"units": {"force": "kx"}},
        DataError,
        'unit of "force": unit "kx"; expected N, kN, mN, daN, cN, lbf, kgf, gf or kip',
    ),
    "channel of another kind": ({"channels": {"force": "u [mm]"}}, DataError, 'unit "mm"; expected N, kN'),
    "rate against the times": ({"rate": 1000.0}, DataError, "the column runs at 2000 Hz, the rate given says 1000 Hz"),
    "rate negative": ({"rate": -1.0}, UsageError, "rate: -1.0; expected a positive number in Hz"),
    "delimiter too long": ({"delimiter": "::"}, UsageError, "expected one character"),
    "decimal mark unknown": ({"decimal": ";"}, UsageError, 'expected "." or ","'),
    "too few names": ({"columns": ["a", "b"]}, DataError, "3 columns, and 2 are named"),
}


@pytest.mark.parametrize("name", WISHES)
def test_wish_refused(name: str, write) -> None:
    options, kind, message = WISHES[name]
    with pytest.raises(kind, match=message):
        read_record(write(GERMAN), **options)


def test_channels_at_different_times(write) -> None:
    text = "Zeit 1 [s];Kraft [N];Zeit 2 [s];Weg [mm]\n" + rows(lambda i: de(f"{t(i)};{f(i)};{t(i, 2)};{u(i)}"))
    with pytest.raises(DataError, match=r'"Kraft \[N\]", "Weg \[mm\]" were sampled at different times'):
        read_record(write(text), channels={"force": "Kraft", "position": "Weg"})
    with pytest.raises(DataError, match='sampled at different times: force .*, position .*force = "Kraft .N." under'):
        read_record(write(text))
    record = read_record(write(text), channels={"force": "Kraft [N]"})
    assert "Left out, sampled at 1000 Hz: Weg [mm]." in record.history


def test_missing_file(tmp_path) -> None:
    with pytest.raises(DataError, match="no such file; expected a measurement file"):
        read_record(tmp_path / "none.csv")
    with pytest.raises(DataError, match="expected a measurement file"):
        read_record(tmp_path)


def test_a_declared_unit_overrides_the_header_and_says_so(write) -> None:
    record = read_record(write(GERMAN), units={"position": "um"})
    assert record.channels["position"][0] == pytest.approx(-0.25e-6)
    assert 'Column "u [mm]" is read in um, as declared, not in mm.' in record.history


def test_a_unit_of_a_role_the_file_lacks_is_refused(write) -> None:
    with pytest.raises(DataError, match='unit of "drive": no column is known to be the drive.*Name its column'):
        read_record(write(GERMAN), units={"drive": "mm"})
