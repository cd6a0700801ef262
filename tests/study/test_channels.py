"""What a study says of columns: scale, sign, unit, and an uncertain scale as a parameter."""

from __future__ import annotations

from pathlib import Path

import pytest

from fibrefit.core.errors import DataError, StudyError
from fibrefit.core.units import Scale
from fibrefit.records import read_record
from fibrefit.study import load_study
from fibrefit.study.reading import reading_of

BASE = """schema = "fibrefit/study/1"
name = "volts"
[rig]
kind = "fibre_mass"
weight_mass = "3 kg"
inclination = "90 deg"
[channels]
{channels}
[[records]]
file = "a.csv"
lift = "5 mm"
{record}
"""
VOLTS = "time [s],U1 [V],enc\n" + "".join(
    f"{i / 2000:.4f},{-0.05 - 0.001 * (i % 7):.4f},{1000 + i}\n" for i in range(40)
)


def study(folder: Path, channels: str, record: str = ""):
    (folder / "a.csv").write_text(VOLTS)
    (folder / "study.toml").write_text(BASE.format(channels=channels, record=record))
    return load_study(folder)


FORCE = 'force = { column = "U1", unit = "V", scale = "-200 N/V" }\n'
POSITION = 'position = { column = "enc", scale = "17.857 um" }\n'


def test_volts_and_counts_become_newtons_and_metres(tmp_path: Path) -> None:
    said = study(tmp_path, FORCE + POSITION)
    record = read_record(tmp_path / "a.csv", **said.reading(said.records[0]))
    assert record.channels["force"][0] == pytest.approx(10.0)
    assert record.channels["position"][0] == pytest.approx(1000 * 17.857e-6)
    assert said.model.effects == ()


def test_a_zero_is_taken_off_before_the_scale(tmp_path: Path) -> None:
    said = study(tmp_path, 'force = { column = "U1", unit = "V", zero = -0.05, scale = "-200 N/V" }\n' + POSITION)
    record = read_record(tmp_path / "a.csv", **said.reading(said.records[0]))
    assert record.channels["force"][:3] == pytest.approx([0.0, 0.2, 0.4])
    assert 'force: column "U1 [V]" in V, from -0.05, scaled by -200 N/V.' in record.history
    own = 'channels = { force = { column = "U1", unit = "N", zero = 1 } }'
    said = study(tmp_path, FORCE + POSITION, own)
    record = read_record(tmp_path / "a.csv", **said.reading(said.records[0]))
    assert record.channels["force"][0] == pytest.approx(-1.05)
    (tmp_path / "again.toml").write_text(said.resolved_toml())
    assert load_study(tmp_path / "again.toml").records[0].channels == said.records[0].channels


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        ({"force": {"column": "U1", "unit": "N", "zero": float("inf")}}, "zero inf; expected a number of the column"),
        ({"time": {"column": "time [s]", "zero": 2.0}}, "a zero of the times"),
        ({"force": {"zero": 2.0}}, "a zero, and no column it belongs to"),
    ],
)
def test_a_zero_that_is_none_is_refused(said: dict, expected: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(VOLTS)
    with pytest.raises(DataError, match=expected):
        read_record(tmp_path / "a.csv", channels=said)


def test_one_record_may_differ(tmp_path: Path) -> None:
    own = 'channels = { force = { column = "U1", scale = "-100 N/V" } }'
    said = study(tmp_path, FORCE + POSITION, own)
    record = read_record(tmp_path / "a.csv", **said.reading(said.records[0]))
    assert record.channels["force"][0] == pytest.approx(5.0)
    (tmp_path / "again.toml").write_text(said.resolved_toml())
    assert load_study(tmp_path / "again.toml").records[0].channels == said.records[0].channels


def test_an_uncertain_scale_is_a_gain_with_that_prior(tmp_path: Path) -> None:
    said = study(tmp_path, 'force = { column = "U1", scale = "-200 +/- 4 N/V" }\n' + POSITION)
    assert said.model.effects == ("sensor.force_gain",)
    table = said.parameters["sensor.force_gain.gain"]
    assert (table.initial, table.prior.mean, table.prior.sd) == (1.0, 1.0, pytest.approx(0.02))
    (tmp_path / "again.toml").write_text(said.resolved_toml())
    again = load_study(tmp_path / "again.toml")
    assert again.parameters == said.parameters
    assert again.model == said.model


def test_what_the_study_says_of_the_gain_stands(tmp_path: Path) -> None:
    text = 'force = { column = "U1", scale = "-200 +/- 4 N/V" }\n[parameters."sensor.force_gain.gain"]\nfixed = 1.0\n'
    assert study(tmp_path, text).parameters["sensor.force_gain.gain"].fixed == 1.0


def test_the_command_line_takes_the_same() -> None:
    said = reading_of(['channels.force={ column = "U1", scale = "-200 N/V" }', "files.sampling_rate=2 kHz"])
    assert said["channels"] == {"force": {"column": "U1", "scale": "-200 N/V"}}
    assert said["rate"] == 2000.0
    assert reading_of(["channels.force.column=U1", "channels.force.scale=-200 N/V"])["channels"] == said["channels"]


REFUSED = {
    'force = { column = "U1", unit = "V" }': 'unit "V"; expected N, kN.*need a scale',
    'force = { column = "U1", unit = "W" }': 'unit "W"; expected a known unit',
    'force = { column = "U1", scale = "200" , unit = "V" }': 'scale "200" for numbers in V; expected a scale in N/V',
    'force = { column = "U1", scale = "0 N/V" }': "neither zero nor infinite",
    'force = { column = "U1", scale = "2,07 N/V" }': "Write a decimal point",
    'force = { column = "U1", scale = "200 quux/V" }': 'unit "quux/V" of the scale',
    'force = { colum = "U1" }': 'unknown key; expected one of column, unit, scale, zero. Did you mean "column"',
    'force = { column = "U1", zero = "5 N" }': "channels.force.zero",
    "force = 3": "expected the heading of a column, or a table with column, unit and scale",
    'time = { column = "time", scale = "1 +/- 0.1 s" }': "an uncertainty; expected it for force or position only",
}


@pytest.mark.parametrize("channels", REFUSED)
def test_refused(channels: str, tmp_path: Path) -> None:
    with pytest.raises(StudyError, match=REFUSED[channels]):
        study(tmp_path, channels)


def test_an_uncertainty_of_one_record_alone_is_refused(tmp_path: Path) -> None:
    own = 'channels = { force = { column = "U1", scale = "-200 +/- 4 N/V" } }'
    with pytest.raises(StudyError, match="an uncertainty of one record alone.*State the scale"):
        study(tmp_path, FORCE, own)


@pytest.mark.parametrize(
    ("text", "value", "error", "unit"),
    [
        ("2.07 +/- 0.29 N/A", 2.07, 0.29, "N/A"),
        ("2.07±0.29 N/A", 2.07, 0.29, "N/A"),
        ("-1", -1.0, 0.0, "-"),
        (-2.5, -2.5, 0.0, "-"),
        ("17.857 um", 17.857, 0.0, "um"),
        ("1e-3 N/(mV/V)", 1e-3, 0.0, "N/(mV/V)"),
    ],
)
def test_scale(text: str | float, value: float, error: float, unit: str) -> None:
    scale = Scale.parse(text, "here")
    assert (scale.value, scale.error, scale.unit) == (value, error, unit)
