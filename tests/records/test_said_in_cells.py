"""What stands in cells where numbers belong, or units, is accounted for as any other line is."""

from __future__ import annotations

import pytest

from fibrefit.core.errors import DataError
from fibrefit.records import read_record

HEAD = "Time [s],Force [N],Position [mm]\n"
N = 300


def body(**cells: str) -> str:
    """Rows of which the one in line 151 has other cells: of the time, the force, or the position."""
    rows = [
        {"time": f"{i / 1000:.3f}", "force": f"{20 + (i * 7 % 11) / 8:.3f}", "position": f"{-3 + 0.01 * i:.2f}"}
        for i in range(N)
    ]
    rows[149] |= cells
    return "".join(",".join(row.values()) + "\n" for row in rows)


@pytest.mark.parametrize(
    ("cells", "place"),
    [
        ({"force": "gain changed to 10"}, "Force [N]"),
        ({"force": "in mN from here"}, "Force [N]"),
        ({"force": "gain x10", "position": ""}, "Force [N]"),
        ({"time": "gain changed to 10", "force": "", "position": ""}, "Time [s]"),
        ({"position": "x1000"}, "Position [mm]"),
    ],
    ids=lambda one: str(one),
)
def test_a_remark_in_a_cell_is_asked_about(cells: dict[str, str], place: str, write) -> None:
    with pytest.raises(DataError) as refused:
        read_record(write(HEAD + body(**cells)))
    said = next(cell for cell in cells.values() if cell)
    assert f'line 151, column "{place}": "{said}"' in str(refused.value)


@pytest.mark.parametrize("cell", [">100", "~20.3", "20.3 N", "n. def.", "#DIV/0!"])
def test_a_cell_that_changes_nothing_is_masked_and_quoted(cell: str, write) -> None:
    record = read_record(write(HEAD + body(force=cell)))
    assert record.valid["force"].sum() == N - 1
    assert not record.valid["force"][149]
    quoted = f'Cells of column "Force [N]" that hold no number are left out, such as "{cell}" in line 151.'
    assert quoted in record.history


@pytest.mark.parametrize(
    "head",
    [
        HEAD + ",(x1000),\n",
        "Time,Force,Position\ns,N,mm\n,x1000,\n",
        HEAD + "s,N (x1000),mm\n",
        HEAD + "s,0.1 N,mm\n",
    ],
)
def test_a_factor_below_the_headings_is_asked_about(head: str, write) -> None:
    with pytest.raises(DataError, match=r'line [23]: "(unit = )?(N )?\(?(x1000|0\.1 N)\)?" .*"Force( \[N\])?"'):
        read_record(write(head + body()))


@pytest.mark.parametrize("unit_row", ["s,N,mm", "[s],[N],[mm]", "s,Newton,mm", "sec,N,millimetre", "s,N (abs.),mm"])
def test_a_row_of_the_units_that_the_headings_have_says_nothing_new(unit_row: str, write) -> None:
    record = read_record(write(f"{HEAD}{unit_row}\n{body()}"))
    assert all(valid.all() for valid in record.valid.values())
    assert not [line for line in record.history if "Not understood" in line]


def test_a_damaged_first_row_is_a_row(write) -> None:
    text = HEAD + body()
    record = read_record(write(text.replace("0.000,20.000,-3.00", "0.000,2~.000,-3.00", 1)))
    assert len(record) == N
    assert not record.valid["force"][0]
