"""Headings are accounted for as lines are: what they tell of a change is asked about, and what is no reading too."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from fibrefit.core.errors import DataError
from fibrefit.records import read_record

N = 100


def table(force: str, position: str = "Position [mm]", time: str = "Time [s]", *more: str) -> str:
    rows = (
        [f"{i / 1000:.3f}", f"{20 + (i * 7 % 11) / 8:.3f}", f"{-3 + 0.01 * i:.2f}", *[f"{i % 13}.5"] * len(more)]
        for i in range(N)
    )
    return "\n".join(";".join(row) for row in ([time, force, position, *more], *rows)) + "\n"


@pytest.mark.parametrize(
    "heading",
    [
        "Force untared [N]",
        "Force [N] (half)",
        "Force - tare [N]",
        "Force [N] +offset",
        "2xForce [N]",
        "Force 10x [N]",
        "Force [N]e3",
        "|Force| [N]",
        "Force^2 [N]",
        "Force [N] (compression +)",
    ],
)
def test_a_change_in_a_heading_is_asked_about(heading: str, write: Callable) -> None:
    path = write(table(heading))
    with pytest.raises(DataError) as refused:
        read_record(path)
    assert heading in str(refused.value)
    answered = {"column": heading, "scale": "1"} if "|" not in heading and "^" not in heading else heading
    if "e3" not in heading and "x" not in heading:
        assert read_record(path, channels={"force": answered}).channels["force"][0] == 20.0


def test_a_delay_in_the_heading_of_the_times_is_asked_about(write: Callable) -> None:
    path = write(table("Force [N]", time="Time [s] (delayed 5 ms)"))
    with pytest.raises(DataError, match=r"not known to leave the times as they are.*time = \{ column = "):
        read_record(path)
    named = {"time": {"column": "Time [s] (delayed 5 ms)", "scale": "1"}}
    assert read_record(path, channels=named).rate == pytest.approx(1000.0)


STATISTICS = ["Peak Force [N]", "Fmax [N]", "F_max [N]", "Max. Load [N]", "Force RMS [N]", "Kraft Max [N]"]


@pytest.mark.parametrize(
    ("heading", "kind"), [*((s, "a statistic") for s in STATISTICS), ("Force limit [N]", "a limit")]
)
def test_what_is_no_reading_is_asked_about_where_it_is_alone(heading: str, kind: str, write: Callable) -> None:
    path = write(table(heading))
    with pytest.raises(DataError, match=f"{kind} by its name, and no other column is the force"):
        read_record(path)
    assert read_record(path, channels={"force": heading}).channels["force"][0] == 20.0
    beside = read_record(write(table("Load [N]", "Position [mm]", "Time [s]", heading)))
    assert beside.headers["force"] == "Load [N]"
    assert f"Columns left out: {heading}." in beside.history


def test_an_increment_is_no_position(write: Callable) -> None:
    with pytest.raises(DataError, match="an increment by its name, and no other column is the position"):
        read_record(write(table("Force [N]", "Displacement increment [mm]")))


@pytest.mark.parametrize(
    "heading",
    [
        "Force (2) [N]",
        "Load Cell 2 [N]",
        "Force two [N]",
        "Kraft kalibriert [N]",
        "Force (tared) [N]",
        "F tension [N]",
        "Force corrected [N]",
        "Force (avg) [N]",
        "Zugkraft [N]",
        "Force offset-corrected [N]",
        "Kraft 50kN Aufnehmer [N]",
    ],
)
def test_what_tells_no_change_is_read(heading: str, write: Callable) -> None:
    assert read_record(write(table(heading))).channels["force"][0] == 20.0


@pytest.mark.parametrize("heading", ["Desplazamiento [mm]", "Weg abs. [mm]", "ΔL [mm]", "Traversenweg absolut [mm]"])
def test_names_of_a_position_tell_no_change(heading: str, write: Callable) -> None:
    assert read_record(write(table("Force [N]", heading))).channels["position"][0] == pytest.approx(-3e-3)
