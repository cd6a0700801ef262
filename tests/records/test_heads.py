"""Heads of programs: labels and remarks before headings, two lines of them, names by number, steps and cycles."""

from __future__ import annotations

from collections.abc import Callable
from time import process_time

import numpy as np
import pytest
from layouts import RATE, N, de, f, rows, t, u

from fibrefit.core.errors import DataError
from fibrefit.records import read_record

HEADS = {
    "a label before the headings": (";Title, drop\n;Headers, time [s],force [N],position [mm]\n", ",", "tfu"),
    "a sensor in brackets": (
        '"#","Time [s]","Force, N (S/N: 123, LBL: Rope)","Position, mm (S/N: 124, LBL: Laser)"\n',
        ",",
        "ntfu",
    ),
    "signals above their names": ("Time;[2:0];[2:1]\n;Force;Position\nsec;N;mm\n", ";", "tfu"),
    "names by number": (
        "# SAMPLE_TIME = 0.0005\n# NAME0 = Force sensor [N]\n# NAME1 = Actual Position of axis [mm]\n",
        " ",
        "fu",
    ),
    "a cycle in its unit": ("Sampling Cycle(us),500\nforce [N],position [mm]\n", ",", "fu"),
    "three decimals of us": ("Time interval :,500.000uS,500.000uS\nIndex,force [N],position [mm]\n", ",", "nfu"),
}


def body(columns: str, sign: str) -> str:
    cells = {"t": t, "f": f, "u": u, "n": str}
    return rows(lambda i: sign.join(cells[column](i) for column in columns))


@pytest.mark.parametrize("name", HEADS)
def test_a_head_of_a_program_is_read(name: str, write: Callable) -> None:
    head, sign, columns = HEADS[name]
    plain = read_record(write("t [s],F [N],u [mm]\n" + body("tfu", ","), "plain.csv"))
    record = read_record(write(head + body(columns, sign)))
    np.testing.assert_allclose(record.time, np.arange(N) / RATE, rtol=0, atol=1e-9)
    for role in ("force", "position"):
        assert (record.channels[role] == plain.channels[role]).all()


def test_a_factor_in_a_line_of_signals_is_still_asked_about(write: Callable) -> None:
    head = "Time;gain 2;gain 5\n;Force;Position\nsec;N;mm\n"
    with pytest.raises(DataError, match="gain"):
        read_record(write(head + body("tfu", ";")))


def test_a_line_of_groups_names_no_column(write: Callable) -> None:
    path = write("Force;Force;Position\n;F [N];u [mm]\n" + rows(lambda i: f"{7 * i % 5};{f(i)};{u(i)}"))
    record = read_record(path, rate=RATE)
    assert record.headers["force"] == "F [N]"


def test_rows_that_begin_with_a_separator_have_as_many_names_as_numbers(write: Callable) -> None:
    path = write(rows(lambda i: f"\t{f(i)}\t{u(i)}"), "wave.itx")
    record = read_record(path, columns=("force [N]", "position [mm]"), rate=RATE)
    assert set(record.channels) == {"force", "position"}


@pytest.mark.parametrize("unit", ["100ns", "100 ns", "0.1 us", "0.1us"])
def test_a_time_in_parts_of_a_unit_is_asked_about_with_its_scale(unit: str, write: Callable) -> None:
    path = write(f"Time [{unit}],F [N]\n" + rows(lambda i: f"{5000 * i},{f(i)}"))
    amount, name = unit.removesuffix("s")[:-1].strip(), unit[-2:]
    with pytest.raises(DataError, match=f'scale = "{amount} {name}"'):
        read_record(path)
    said = {"time": {"column": f"Time [{unit}]", "scale": f"{amount} {name}"}}
    np.testing.assert_allclose(read_record(path, channels=said).time, np.arange(N) / RATE, rtol=0, atol=1e-9)


def test_what_is_weighed_in_kg_is_asked_about(write: Callable) -> None:
    path = write("t [s],Weight [kg],x [mm]\n" + body("tfu", ","))
    with pytest.raises(DataError, match="a mass.*kgf"):
        read_record(path)
    record = read_record(path, channels={"force": "Weight [kg]"}, units={"force": "kgf"})
    assert record.channels["force"][0] == pytest.approx(9.80665 * float(f(0)))
    constant = write("t [s],mass [kg],x [mm]\n" + rows(lambda i: f"{t(i)},3.1,{u(i)}"))
    assert set(read_record(constant).channels) == {"position"}


@pytest.mark.parametrize(("unit", "newtons"), [("tf", 9806.65), ("ozf", 0.27801385095378125)])
def test_forces_of_a_tonne_and_of_an_ounce(unit: str, newtons: float, write: Callable) -> None:
    record = read_record(write(f"t [s],Load ({unit})\n" + body("tf", ",")))
    assert record.channels["force"][0] == pytest.approx(newtons * float(f(0)))


def test_counts_of_an_encoder_ask_for_what_one_is_worth(write: Callable) -> None:
    with pytest.raises(DataError, match='scale = "..'):
        read_record(write("t [ms],ActPos(inc),F [N]\n" + rows(lambda i: f"{t(i, 1e3)},{1000 + 7 * i},{f(i)}")))


def test_a_spreadsheet_in_xml_is_refused_by_its_cause(write: Callable) -> None:
    text = '<?xml version="1.0"?>\n<?mso-application progid="Excel.Sheet"?>\n<Workbook>\n<Table>\n'
    text += rows(lambda i: f"<Row><Cell><Data>{t(i)}</Data></Cell></Row>")
    with pytest.raises(DataError, match="XML.*save it as .xlsx"):
        read_record(write(text, "drop.xls"))


def test_a_step_that_may_be_shorter_than_any_is_still_asked_about(write: Callable) -> None:
    # 1 us with three decimals, or 1000 us: either may be that of a scope.
    with pytest.raises(DataError, match="1000000 Hz or 1000 Hz"):
        read_record(write("Sample interval: 1,000 us\nforce [N];position [mm]\n" + de(body("fu", ";"))))


def test_the_time_of_a_test_above_headings_names_no_column(write: Callable) -> None:
    path = write("Start time;today;\n;Force [N];Position [mm]\n" + body("nfu", ";"))
    np.testing.assert_allclose(read_record(path, rate=RATE).time, np.arange(N) / RATE, rtol=0, atol=1e-9)


@pytest.mark.parametrize("sign", ["(", "a", "-"])
def test_a_head_of_signs_takes_no_square_of_their_number(sign: str, write: Callable) -> None:
    path = write(f"t [s],F [N]\n{sign * 30000},x\n" + body("tf", ","))
    began = process_time()
    assert read_record(path).channels["force"].size == N
    assert process_time() - began < 5.0  # a minute and more by squares
