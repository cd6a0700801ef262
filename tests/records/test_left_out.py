"""A column that may be the position and is not read is told as a doubt; forces of several shots are no pair."""

from __future__ import annotations

import pytest
from layouts import f, rows, t, u

from fibrefit.core.errors import DataError
from fibrefit.records import read_record

UNITS = {
    "Load (kp)": ("force", 9.80665),
    "Kraft [Kilopond]": ("force", 9.80665),
    "F (pounds-force)": ("force", 4.4482216152605),
    "Displ (In.)": ("position", 0.0254),
    "Position (In)": ("position", 0.0254),
    "Weg [Zoll]": ("position", 0.0254),
    "Hub (palce)": ("position", 0.0254),
    "course (pouces)": ("position", 0.0254),
    "carrera [pulgadas]": ("position", 0.0254),
}


def _path(write, *heads: str):
    columns = [t, f, u, f, u, f]
    body = rows(lambda i: ";".join(str(column(i)) for column in columns[: len(heads)]))
    return write(";".join(heads) + "\n" + body)


@pytest.mark.parametrize("heading", UNITS)
def test_units_in_words_are_read(heading: str, write) -> None:
    role, worth = UNITS[heading]
    other = "x [mm]" if role == "force" else "F [N]"
    heads = (heading, other) if role == "force" else (other, heading)
    path = _path(write, "t [s]", *heads)
    plain = _path(lambda text: write(text, "plain.csv"), "t [s]", "F [N]", "x [m]")
    record = read_record(path)
    assert record.channels[role] == pytest.approx(worth * read_record(plain).channels[role])


@pytest.mark.parametrize("heading", ["x", "x (zz)", "Laser", "Abstand (Striche)", "s [Teilstriche]", "dx"])
def test_what_may_be_the_position_is_in_doubt_where_it_is_left_out(heading: str, write) -> None:
    path = _path(write, "t [s]", "F [N]", heading)
    with pytest.raises(DataError) as refused:
        read_record(path)
    assert f'position = {{ column = "{heading}", unit = ".." }}' in str(refused.value)
    assert 'force = "F [N]"' in str(refused.value)
    read = read_record(path, channels={"position": {"column": heading, "unit": "mm", "scale": "1"}})
    assert "position" in read.channels
    assert set(read_record(path, channels={"force": "F [N]"}).channels) == {"force"}


@pytest.mark.parametrize("heading", ["shot", "T [°C]", "U2 [V]", "gain_kp", "run", "weight", "x target (zz)"])
def test_what_is_called_otherwise_keeps_a_force_alone(heading: str, write) -> None:
    assert set(read_record(_path(write, "t [s]", "F [N]", heading)).channels) == {"force"}


def test_of_three_numbered_forces_none_is_one_of_a_pair(write) -> None:
    path = _path(write, "t [s]", "F1 [N]", "x [mm]", "F2 [N]", "T [mm/s]", "F3 [N]")
    with pytest.raises(DataError, match=r'"F1 \[N\]" and "F2 \[N\]" and "F3 \[N\]" could each be the force'):
        read_record(path)
    assert set(read_record(_path(write, "t [s]", "F1 [N]", "x [mm]", "F2 [N]")).channels) >= {"force_1", "force_2"}


def test_an_unknown_unit_is_refused_with_all_that_would_do(write) -> None:
    with pytest.raises(DataError, match="expected N, kN, mN, daN, cN, lbf, kgf, gf or kip"):
        read_record(_path(write, "t [s]", "Kraft [kx]", "x [mm]"))
    with pytest.raises(DataError, match="expected m, mm, um, cm, nm, in, ft or mil"):
        read_record(_path(write, "t [s]", "Kraft [N]", "Weg [ell]"))
