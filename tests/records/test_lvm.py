"""LabVIEW measurement files that are incomplete or hold several recordings."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from layouts import STEPS, N, f, lvm, rows, segment, t, u

from fibrefit.core.errors import DataError
from fibrefit.records import read_record

BODY = rows(lambda i: f"|{f(i)}|{u(i)}")


def one(body: str = BODY, *, samples: int = N, steps: str = STEPS, units: str = "N|mm") -> str:
    return lvm("No", "\t", segment(samples, "X_Value|F|u", units, steps, 0.0, body))


def test_the_file_itself_is_read(write: Callable) -> None:
    record = read_record(write(one(), "a.lvm"))
    np.testing.assert_allclose(record.channels["force"], [float(f(i)) for i in range(N)])
    assert record.history[0] == "Read from a.lvm; time: counted at the rate in the header."


def test_a_rate_that_is_given_is_held_against_that_of_the_file(write: Callable) -> None:
    path = write(one(), "a.lvm")
    assert read_record(path, rate=2000.0).rate == 2000.0
    with pytest.raises(DataError, match="the rate given is 1000 Hz, and the file says 2000 Hz; expected one rate"):
        read_record(path, rate=1000.0)


def test_what_is_stated_of_text_changes_nothing_and_is_told(write: Callable) -> None:
    """A study may hold files of both kinds: it is not refused."""
    path = write(one(), "a.lvm")
    note = "What is stated of delimiter changed nothing: the file has a layout of its own."
    assert note in read_record(path, delimiter=";", decimal=".").notes
    assert not any("changed nothing" in one for one in read_record(path, rate=2000.0).notes)


REFUSED = {
    "a sample missing": (one(rows(lambda i: f"|{f(i)}|{u(i)}", n=N - 1)), "announces 24 samples, and 23 are there"),
    "a sample doubled": (one(BODY + f"|{f(0)}|{u(0)}\n"), "announces 24 samples, and 25 are there"),
    "a separator missing": (one(BODY.replace("|", "", 1)), "line 17: a row with too many or too few cells"),
    "a separator doubled": (one(BODY.replace("|", "||", 1)), "line 17: a row with too many or too few cells"),
    "no step": (one(steps="|"), r"no step in time \(Delta_X\) and there is no column of times"),
    "header cut": ("LabVIEW Measurement\t\nSeparator\tTab\n", "the header does not end"),
    "no names": (one().replace("X_Value", "1.0").replace("Comment", "2.0"), "no names of channels"),
    "unit unknown": (one(units="kx|mm"), 'column "F .kx.": unit "kx"; expected N, kN'),
    "other channels later": (
        one() + segment(N, "X_Value|F|w", "N|mm", STEPS, 0.012, BODY).replace("|", "\t"),
        "begins a segment with other channels",
    ),
    "segments of one time": (
        lvm("No", "\t", 2 * segment(N, "X_Value|F|u", "N|mm", STEPS, 0.0, BODY)),
        "2 segments that do not follow on one another; expected one recording. Split the file",
    ),
    "a decimal separator that is none": (
        one().replace("Decimal_Separator\t.", "Decimal_Separator\t;"),
        'Decimal_Separator ";" in the header; expected "." or ","',
    ),
    "a spectrum": (
        one().replace("Y_Unit_Label", "X_Dimension\tFrequency\tFrequency\nY_Unit_Label"),
        'X_Dimension "Frequency" in the header; expected channels over time',
    ),
    "no number of samples": (one(samples=-5), "-5"),
    "a step that is no number": (one(steps="nan|nan"), r"no step in time \(Delta_X\)"),
    "a special block that does not end": (
        one().replace("X_Columns", "***Start_Special***\nX_Columns", 1),
        r"\*\*\*Start_Special\*\*\* without",
    ),
    "thousands": (one(BODY.replace("12.500", "1,012.500", 1)), "has a thousands separator"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused(name: str, write: Callable) -> None:
    content, message = REFUSED[name]
    with pytest.raises(DataError, match=message):
        read_record(write(content, "a.lvm"))


def test_segments_at_their_hours(write: Callable) -> None:
    """Segments that all begin at zero are set apart by the time of day in their headers."""
    early = segment(N, "X_Value|F|u", "N|mm", STEPS, 0.0, BODY)
    late = early.replace("Time|14:22:11.0|14:22:11.0", "Time|14:22:12.5|14:22:12.5")
    record = read_record(write(lvm("No", "\t", early + late), "a.lvm"))
    assert len(record) == 2 * N
    assert record.time[N] == pytest.approx(1.5)
    assert record.gaps[0].missing == 2976
    assert "2 segments are joined." in record.history


@pytest.mark.parametrize("units", ["kN||", "kN"])
def test_a_channel_without_a_unit_has_not_that_of_another(units: str, write: Callable) -> None:
    with pytest.raises(DataError, match="position|u"):
        read_record(write(one(units=units), "a.lvm"))


def test_units_in_names_of_channels_are_read(write: Callable) -> None:
    named = lvm("No", "\t", segment(N, "X_Value|Force [N]|Position [mm]", "|", STEPS, 0.0, BODY))
    record, usual = read_record(write(named, "a.lvm")), read_record(write(one(), "b.lvm"))
    for channel in ("force", "position"):
        np.testing.assert_allclose(record.channels[channel], usual.channels[channel])


def test_channels_of_unlike_rates_in_segments_are_refused(write: Callable) -> None:
    both = "".join(segment(N, "X_Value|F|u", "N|mm", "0.0005|0.0010", at, BODY) for at in (0.0, 0.012))
    said = r"channels that were sampled at different times \(Delta_X 0.0005 and 0.0010\); expected one rate"
    with pytest.raises(DataError, match=said):
        read_record(write(lvm("No", "\t", both), "a.lvm"))


def test_a_special_block_is_passed_over(write: Callable) -> None:
    block = "***Start_Special***\nnoise\n1\t2\t3\n***End_Special***\n"
    content = one().replace("Channels", block + "Channels")
    assert len(read_record(write(content, "a.lvm"))) == N


def test_a_bad_row_among_times_is_left_out(write: Callable) -> None:
    body = rows(lambda i: f"{t(i)}|{f(i)}|{u(i)}").replace("|", "", 1)
    content = lvm("One", "\t", segment(N, "X_Value|F|u", "N|mm", STEPS, 0.0, body))
    record = read_record(write(content, "a.lvm"))
    assert len(record) == N - 1
    assert "1 line with too many or too few cells left out." in record.history
