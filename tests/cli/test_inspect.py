"""What was understood of files is said, and so is what was not."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import pytest

from fibrefit.core.errors import DataError
from tests.cli.conftest import PLAIN, ROWS, Run


def test_a_record(written: Run) -> None:
    done = written("inspect", "plain.csv", "--out", "seen")
    assert done.code == 0
    for part in ("plain.csv: 20 rows", "2000 Hz", '"force [N]" is the force', '"position [mm]" is the position'):
        assert part in done.out
    assert "Pictures are in seen/figures" in done.err
    (figure,) = Path("seen/figures").glob("*.png")
    assert figure.read_bytes().startswith(b"\x89PNG")
    (file,) = written("inspect", "plain.csv", "--json").document["files"]
    assert file["times"][0]["rate_hz"] == 2000.0


def test_what_is_missing_is_said_and_can_be_given(written: Run) -> None:
    done = written("inspect", "no_units.csv")
    assert done.code == 3
    assert "Not ready to be used" in done.out
    assert done.err == "\nOn the command line, such as:\n  --set units.force=N\n"
    mended = written("inspect", "no_units.csv", "--set", "units.force=kN")
    assert "Not ready" not in mended.out
    assert "12.5 kN" in mended.out
    assert mended.code == 0


def test_what_is_not_understood_exits_with_3_but_not_before_the_others(written: Run) -> None:
    done = written("inspect", "headless.csv", "plain.csv")
    assert done.code == 3
    assert "Not understood: headless.csv" in done.out
    assert "plain.csv: 20 rows" in done.out
    columns = 'files.columns=["time [s]", "force [N]", "position [mm]"]'
    assert written("inspect", "headless.csv", "--set", columns).code == 0


def test_a_missing_file(written: Run) -> None:
    done = written("inspect", "none.csv", "--json")
    assert done.code == 3
    assert "none.csv" in done.document["files"][0]["refused"]


def test_a_missing_file_suggests_its_neighbour_and_nothing_else(written: Run) -> None:
    said = 'no_unit.csv: no such file; expected a measurement file. Did you mean "no_units.csv"?'
    done = written("inspect", "no_unit.csv")
    assert (done.code, " ".join(done.out.split()), done.err) == (3, f"Not understood: {said}", "")
    done = written("inspect", "plain.csv", "no_unit.csv", "--write", "study.toml")
    assert done.code == 2
    assert done.err == (
        'error: --write study.toml: no file "no_unit.csv"; expected files that are there. '
        'Did you mean "no_units.csv"?\n'
    )


@pytest.mark.parametrize(
    ("head", "advised"),
    [
        ("Zeit [s];Kanal 1;Kanal 2", ['channels.force="Kanal 1"']),
        ("Zeit [s];$1;Kanal 2", ["'channels.force=\"$1\"'"]),
        ("Zeit [s];F;Weg", ["units.force=N", "units.position=mm"]),
        (None, ['\'files.columns=["time [s]", "force [N]", "position [mm]"]\'']),
    ],
)
def test_what_a_message_advises_is_shown_as_it_is_typed(fibrefit: Run, head: str | None, advised: list[str]) -> None:
    """With the headings of the file itself, and nothing that its message does not speak of."""
    Path("a.csv").write_text("".join([f"{head}\n" if head else "", *ROWS]))
    done = fibrefit("inspect", "a.csv")
    assert done.code == 3
    assert done.err.splitlines()[1:] == ["On the command line, such as:", *(f"  --set {one}" for one in advised)]
    typed = [word for one in advised[:1] for word in shlex.split(f"--set {one}")]
    assert fibrefit("inspect", "a.csv", *typed).err != done.err


@pytest.mark.parametrize(
    ("head", "role", "template"),
    [
        ("Zeit [s];Kraft [V];Weg [mm]", "force", 'force={ column = "Kraft [V]", scale = ".. N/V" }'),
        ("Zeit [s];Kraft [mA];Weg [mm]", "force", 'force={ column = "Kraft [mA]", scale = ".. N/mA" }'),
        ("Zeit [s];Kraft [counts];Weg [mm]", "force", 'force={ column = "Kraft [counts]", scale = ".. N" }'),
        ("Zeit [s];Kraft [N];Weg [mV]", "position", 'position={ column = "Weg [mV]", scale = ".. m/mV" }'),
        ("Zeit [s];U1 [V];U2 [V]", "force", 'force={ column = "U1 [V]", scale = ".. N/V" }'),
    ],
)
def test_of_a_signal_the_sensitivity_is_asked_for_and_no_unit_offered_in_its_place(
    fibrefit: Run, head: str, role: str, template: str
) -> None:
    """Volts called newtons would be read without a word: what they are worth is left open, and taken once said."""
    Path("a.csv").write_text("".join([f"{head}\n", *ROWS]))
    done = fibrefit("inspect", "a.csv")
    lines = done.err.splitlines()[1:]
    assert (done.code, lines[1:]) == (3, [f"  --set 'channels.{template}'"])
    assert lines[0] == 'On the command line, with what belongs there in place of "..":'
    said = " ".join(done.out.split())
    assert template.replace("=", " = ", 1) in said
    assert f'{role} = "' not in said
    assert fibrefit("inspect", "a.csv", "--set", f"channels.{template}").code == 4
    stated = fibrefit("inspect", "a.csv", "--set", f"channels.{template.replace('..', '-20')}")
    assert (stated.code, f"is the {role}" in stated.out) == (0, True)


@pytest.mark.parametrize("named", [(), ("--set", "channels.force=Kraft", "--set", "channels.position=Weg")])
def test_of_two_signals_both_are_asked_about(fibrefit: Run, named: tuple[str, ...]) -> None:
    Path("a.csv").write_text("".join(["Zeit [s];Kraft [V];Weg [mA]\n", *ROWS]))
    done = fibrefit("inspect", "a.csv", *named)
    assert [line.split("=")[0].split(".")[-1] for line in done.err.splitlines()[2:]] == ["force", "position"]
    assert done.out.count("Not ready to be used: a.csv, column") == 2


@pytest.mark.parametrize("text", ["", "nothing\nof use\n"])
def test_where_nothing_that_can_be_said_would_help_nothing_is_listed(fibrefit: Run, text: str) -> None:
    Path("a.csv").write_text(text)
    done = fibrefit("inspect", "a.csv")
    assert (done.code, done.err) == (3, "")


def test_where_a_message_advises_nothing_all_that_can_be_said_is_listed(
    written: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fibrefit.records.record_of", refusing)
    assert written("inspect", "plain.csv").err.splitlines()[1:] == [
        "What a file does not say can be said for it:",
        "  --set units.force=kN",
        '  --set channels.force="force [N]"',
        '  --set \'channels.force={ column = "force [N]", unit = "V", scale = "-200 N/V" }\'',
        '  --set files.sampling_rate="2 kHz"',
        '  --set files.delimiter=";"',
        '  --set \'files.columns=["time [s]", "force [N]", "position [mm]"]\'',
    ]


def refusing(table: object, **how: object) -> None:
    raise DataError("plain.csv", "nobody knows what is wrong")


def test_of_times_without_a_unit_both_readings_are_told(fibrefit: Run) -> None:
    rows = "".join(f"{i * 0.5};{12 + i % 7};{i / 10}\n" for i in range(30))
    Path("a.csv").write_text(f"Zeit;F [N];Weg [mm]\n{rows}")
    done = fibrefit("inspect", "a.csv")
    assert 'Declare it under [units]: time = "ms" (2000 Hz) or "s" (2 Hz).' in " ".join(done.out.split())
    assert done.err.splitlines()[2:] == ["  --set units.time=ms"]
    Path("a.csv").write_text(f"Zeit;F;Weg\n{rows}")
    assert (
        'Declare them under [units], such as time = "ms", force = "N", position = "mm". '
        'Of the time: "ms" (2000 Hz) or "s" (2 Hz).'
    ) in " ".join(fibrefit("inspect", "a.csv").out.split())


def test_a_scale_is_told_once(written: Run) -> None:
    scale = 'channels.force={ column = "force [N]", scale = "-1", zero = 2.5 }'
    said = " ".join(written("inspect", "plain.csv", "--set", scale).out.split())
    assert '"force [N]" is the force: unit N, from 2.5, scaled by -1; ' in said
    assert (said.count("scaled by"), said.count("from 2.5"), said.count("counts from")) == (1, 1, 0)


def test_a_misspelt_setting(written: Run) -> None:
    done = written("inspect", "plain.csv", "--set", "unit.force=N")
    assert done.code == 4
    assert 'Did you mean "units"' in done.err


def test_a_study(fibrefit: Run) -> None:
    fibrefit("init", "here")
    done = fibrefit("inspect", "here", "--set", 'parameters.stiffness.bounds=["1 kN/m", "20 kN/m"]')
    assert done.code == 0
    for part in (
        "demonstration drop: fibre_mass, 1 record.",
        "stiffness: bounds 1 kN/m to 20 kN/m",
        "drop_10mm_90deg.csv: ",
        "Conditions: weight_mass 3.096 kg, inclination 90 deg",
    ):
        assert part in done.out
    assert max(map(len, done.out.splitlines())) <= 80
    assert fibrefit("inspect", "here/study.toml", "--json").document["study"]["name"] == "demonstration drop"


def test_a_study_whose_record_is_not_ready_exits_with_3(fibrefit: Run) -> None:
    fibrefit("init", "here")
    done = fibrefit("inspect", "here", "--set", 'channels.force={ column = "force [N]", scale = "-1" }')
    assert "Not ready to be used" in done.out
    assert (done.code, done.err) == (3, "")


def test_a_planned_record(fibrefit: Run) -> None:
    Path("study.toml").write_text(
        'schema = "fibrefit/study/1"\nname = "x"\n[rig]\nkind = "fibre_mass"\nweight_mass = "3 kg"\n'
        'inclination = "1 rad"\n[[records]]\nname = "plan"\nsampling_rate = "2 kHz"\nduration = "4 s"\nlift = "7 mm"\n'
    )
    done = fibrefit("inspect", "study.toml")
    assert "plan: planned, not measured yet." in done.out
    assert "lift 7 mm" in done.out


def test_it_can_be_kept(written: Run) -> None:
    assert written("inspect", "plain.csv", "--out", "kept").code == 0
    kept = json.loads(Path("kept/inspection.json").read_text())
    assert kept["schema"] == "fibrefit/inspection/1"
    again = written("inspect", "plain.csv", "--out", "kept")
    assert again.code == 2
    assert "exists already" in again.err
    assert written("inspect", "plain.csv", "--out", "kept", "--force").code == 0


def test_what_is_read_is_not_replaced_by_what_is_said_of_it(fibrefit: Run) -> None:
    fibrefit("init", "demo")
    assert fibrefit("simulate", "demo", "--out", "made").code == 0
    (record, *_) = sorted(Path("made/simulated").iterdir())
    refused = fibrefit("inspect", str(record), "--out", "made", "--force")
    assert refused.code == 2
    assert f"made: holds {record}, which is read" in refused.err
    assert record.is_file()


def test_files_of_the_same_name_have_a_picture_each(written: Run) -> None:
    for folder in ("one", "two"):
        Path(folder).mkdir()
        Path(folder, "a.csv").write_text(PLAIN)
    assert written("inspect", "one/a.csv", "two/a.csv", "--out", "kept").code == 0
    assert len(list(Path("kept/figures").iterdir())) == 2


def test_of_many_files_the_first_are_drawn_and_it_is_said(written: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fibrefit.plots.figures.MOST_RECORDS", 1)
    Path("more.csv").write_text(PLAIN)
    done = written("inspect", "plain.csv", "more.csv", "--out", "kept")
    assert "Pictures of the first 1 of 2 files are in kept/figures." in done.err
    assert [path.name for path in Path("kept/figures").iterdir()] == ["plain.png"]
    assert len(json.loads(Path("kept/inspection.json").read_text())["files"]) == 2


def test_what_was_not_understood_is_kept_too(written: Run) -> None:
    """A folder was named: that nothing can be drawn is no reason to write nothing, and to say nothing."""
    done = written("inspect", "headless.csv", "--out", "kept")
    assert done.code == 3
    assert "What was said is in kept." in done.err
    assert "Not understood: headless.csv" in Path("kept/inspection.txt").read_text()
    assert not Path("kept/figures").exists()


def test_pictures_that_nobody_asked_for_are_no_reason_to_fail(written: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """As where records lie on a disk that is only to be read."""
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    Path("results").touch()
    done = written("inspect", "plain.csv")
    assert done.code == 0
    assert "No pictures were drawn: results/inspect_plain-" in done.err
    assert "cannot be written" in done.err
    Path("results").unlink()
    assert "Pictures are in results/inspect_plain-" in written("inspect", "plain.csv").err


def test_nothing_is_drawn_that_nobody_asked_for(written: Run) -> None:
    assert written("inspect", "plain.csv").code == 0
    assert not Path("results").exists()


def test_what_its_own_messages_ask_for_can_be_said(written: Run) -> None:
    Path("timeless.csv").write_text("force [N];position [mm]\n" + "".join(f"{12 + i};{i / 10}\n" for i in range(30)))
    assert 'sampling_rate = "2 kHz" under [files]' in " ".join(written("inspect", "timeless.csv").out.split())
    for told in ("files.sampling_rate=2 kHz", 'files.sampling_rate="2 kHz"'):
        assert "2000 Hz" in written("inspect", "timeless.csv", "--set", told, "--set", "files.delimiter=;").out


@pytest.mark.parametrize("name", ["\udcff.csv", "a" * 230 + ".csv"])
def test_names_no_encoding_has_and_long_ones(written: Run, name: str) -> None:
    Path(name).write_text(PLAIN)
    assert written("inspect", name, "--out", "kept").code == 0


def test_a_heading_that_is_half_a_formula_can_be_drawn(written: Run) -> None:
    Path("formula.csv").write_text(PLAIN.replace("force", "$\\badmacro{F$"))
    assert written("inspect", "formula.csv", "--out", "kept").code == 0


def test_a_pipe_and_a_name_too_long_are_refused(written: Run) -> None:
    import os

    os.mkfifo("pipe.csv")
    os.mkfifo("pipe.toml")
    assert written("inspect", "pipe.csv").code == 3
    assert written("inspect", "/dev/zero").code == 3
    assert written("inspect", "pipe.toml").code == 4
    assert written("inspect", "a" * 300 + ".csv").code == 3


def test_of_a_unit_that_is_not_known_none_is_advised(fibrefit: Run) -> None:
    """What is called "kilo Newton" is in N by no means: the unit is left open."""
    rows = "".join(f"{i / 2000:.4f},{0.01 * (i % 5):.3f},{0.1 * i:.1f}\n" for i in range(20))
    Path("a.csv").write_text(f"Time,Force,Position\nsec,kilo Newton,millimeter\n{rows}", encoding="utf-8")
    done = fibrefit("inspect", "a.csv")
    assert done.code == 3
    assert 'unit "kilo Newton"' in done.out
    assert "--set units.force=..\n" in done.err
    assert "units.force=N" not in done.out + done.err
    assert fibrefit("inspect", "a.csv", "--set", "units.force=kN").code == 0
