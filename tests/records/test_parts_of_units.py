"""A unit that is so much of another one, in a heading: asked about with the right scale, whatever unit is declared."""

from __future__ import annotations

import pytest
from layouts import f, rows, t, u

from fibrefit.core.errors import DataError
from fibrefit.records import read_record
from fibrefit.records.grammar.headings import so_much_of, split_heading

#: Heading, role and the scale that is advised.
ASKED = {
    "Load (0.1 N)": ("force", "0.1 N"),
    "Load (0,1 N)": ("force", "0.1 N"),
    "Kraft [kN/10]": ("force", "0.1 kN"),
    "F (10^-2 N)": ("force", "0.01 N"),
    "F (x10 N)": ("force", "10 N"),
    "Displ (1/100 mm)": ("position", "0.01 mm"),
    "x [mm/10]": ("position", "0.1 mm"),
    "Weg (1/1000 in)": ("position", "0.001 in"),
    "Weg (Hundertstel mm)": ("position", "0.01 mm"),
    "Travel (tenths of mm)": ("position", "0.1 mm"),
    "s (mm x 0.01)": ("position", "0.01 mm"),
}


@pytest.mark.parametrize("heading", ASKED)
@pytest.mark.parametrize("mark", [";", "\t"])
def test_a_factor_inside_the_unit_is_asked_about_with_its_scale(heading: str, mark: str, write) -> None:
    role, scale = ASKED[heading]
    other = "x [mm]" if role == "force" else "F [N]"
    path = write(f"t [s]{mark}{heading}{mark}{other}\n" + rows(lambda i: f"{t(i)}{mark}{f(i)}{mark}{u(i)}"))
    advice = f'{role} = {{ column = "{heading}", scale = "{scale}" }}'
    unit = scale.split()[1]
    for said in ({}, {role: unit}, {heading: unit}):
        with pytest.raises(DataError) as refused:
            read_record(path, units=said)
        assert advice in str(refused.value)
    record = read_record(path, channels={role: {"column": heading, "scale": scale}})
    plain = read_record(path, channels={role: {"column": heading, "scale": f"1 {unit}"}})
    factor = float(scale.split()[0])
    assert record.channels[role] == pytest.approx(factor * plain.channels[role])


@pytest.mark.parametrize(
    "unit",
    ["N", "mm", "N/mm", "1/m", "mm/s", "N m", "500 N", "100 N", "1 N", "1 ms", "0.5 mm/V", "0.1", "1/100", "2"],
)
def test_what_is_no_part_of_a_time_a_force_or_a_length(unit: str) -> None:
    assert so_much_of(unit) is None


@pytest.mark.parametrize(
    ("heading", "unit"), [("Weg (0.01 mm) [mm]", "mm"), ("F (N)", "N"), ("Position (laser 2) [mm]", "mm"), ("F/N", "N")]
)
def test_a_plain_unit_beside_it_stays(heading: str, unit: str) -> None:
    assert split_heading(heading)[1] == unit


def test_a_range_behind_a_name_stays_answered_by_a_unit(write) -> None:
    path = write("t [s];Load (500 N);x [mm]\n" + rows(lambda i: f"{t(i)};{f(i)};{u(i)}"))
    assert read_record(path, units={"force": "N"}).channels["force"].size > 3
