"""What was understood of files is said, and so is what was not."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from fibrefit.study import load_study
from fibrefit.workflow.prepare import read_records
from tests.cli.conftest import Run

PLAIN = "time [s],force [N],position [mm]\n" + "".join(
    f"{i * 0.0005:.4f},{12.5 + 0.001 * i},{-0.25 + 0.001 * i}\n" for i in range(20)
)
NO_UNITS = PLAIN.replace("force [N]", "Kraft")
HEADLESS = PLAIN.partition("\n")[2]


@pytest.fixture
def written(fibrefit: Run) -> Run:
    for name, text in {"plain.csv": PLAIN, "no_units.csv": NO_UNITS, "headless.csv": HEADLESS}.items():
        Path(name).write_text(text)
    return fibrefit


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
    assert done.code == 0
    assert "Not ready to be used" in done.out
    assert "--set units.force=kN" in done.err
    mended = written("inspect", "no_units.csv", "--set", "units.force=kN")
    assert "Not ready" not in mended.out
    assert "12.5 kN" in mended.out


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


def test_files_of_the_same_name_have_a_picture_each(written: Run) -> None:
    for folder in ("one", "two"):
        Path(folder).mkdir()
        Path(folder, "a.csv").write_text(PLAIN)
    assert written("inspect", "one/a.csv", "two/a.csv", "--out", "kept").code == 0
    assert len(list(Path("kept/figures").iterdir())) == 2


def test_nothing_is_drawn_that_nobody_asked_for(written: Run) -> None:
    assert written("inspect", "plain.csv").code == 0
    assert not Path("results").exists()


def test_the_study_that_was_understood_can_be_written(written: Run) -> None:
    Path("volts.csv").write_text(PLAIN.replace("force [N]", "U1"))
    scale = 'channels.force={ column = "U1", unit = "V", zero = 0.25, scale = "-200 N/V" }'
    done = written("inspect", "volts.csv", "--set", scale, "--set", "rig.weight_mass=3 kg", "--write", "new/study.toml")
    assert done.code == 0
    assert "The study is in new/study.toml" in done.err
    text = Path("new/study.toml").read_text()
    assert "# inclination = " in text
    assert "weight_mass" in text.partition("# Still")[0]
    refused = written("inspect", "new/study.toml")
    assert refused.code == 4
    assert "no inclination" in refused.err
    again = written("inspect", "new/study.toml", "--set", "rig.inclination=90 deg")
    assert again.code == 0
    assert " from 0.25, scaled by -200 N/V; " in " ".join(again.out.split())
    assert written("inspect", "plain.csv", "--write", "new/study.toml").code == 2


def test_a_study_of_forces_alone_says_that_no_position_was_measured(written: Run) -> None:
    Path("force.csv").write_text("time [s],force [N]\n" + "".join(f"{i / 2000},{12 + i % 7}\n" for i in range(30)))
    assert written("inspect", "force.csv", "plain.csv", "--write", "both.toml").code == 0
    assert written("inspect", "force.csv", "--write", "force.toml").code == 0
    assert 'measured = "force"' in Path("force.toml").read_text()
    assert written("inspect", "plain.csv", "--write", "plain.toml").code == 0
    assert "measured" not in Path("plain.toml").read_text()


def test_no_study_is_written_of_what_is_not_understood(written: Run) -> None:
    done = written("inspect", "no_units.csv", "--write", "study.toml")
    assert done.code == 2
    assert "cannot be used as a record yet" in done.err
    assert not Path("study.toml").exists()


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


def test_files_in_different_units_stay_in_their_own_in_the_study(written: Run) -> None:
    rows = [(i / 2000, 12 + i % 7, i / 10) for i in range(30)]
    Path("kilo.csv").write_text(
        "t [ms],force [kN],position [mm]\n" + "".join(f"{1e3 * t:g},{f / 1e3:g},{x:g}\n" for t, f, x in rows)
    )
    Path("one.csv").write_text(
        "t [s],force [N],position [um]\n" + "".join(f"{t:g},{f:g},{1e3 * x:g}\n" for t, f, x in rows)
    )
    assert (
        written(
            "inspect",
            "kilo.csv",
            "one.csv",
            "--set",
            "rig.inclination=90 deg",
            "--set",
            "rig.weight_mass=3 kg",
            "--write",
            "both.toml",
        ).code
        == 0
    )
    kilo, one = read_records(load_study(Path("both.toml")))
    np.testing.assert_allclose(kilo.time, one.time, atol=1e-9)
    for role in ("force", "position"):
        np.testing.assert_allclose(kilo.channels[role], one.channels[role], rtol=1e-6, atol=1e-9)
    # What all files are in is said once.
    assert Path("both.toml").read_text().count('unit = "N"') == 1


@pytest.mark.parametrize(("place", "said"), [("there", "it is a folder"), ("plain.csv/study.toml", "--write")])
def test_a_place_where_no_study_can_be_written_is_refused(written: Run, place: str, said: str) -> None:
    Path("there").mkdir()
    done = written("inspect", "plain.csv", "--write", place, "--force")
    assert done.code == 2
    assert said in done.err
    assert "fault" not in done.err


def test_a_kind_of_rig_without_a_study_to_write_is_refused(written: Run) -> None:
    done = written("inspect", "plain.csv", "--rig", "fibre_mas")
    assert done.code == 2
    assert "--write STUDY beside it" in done.err


FORCES = "time [s],force [N]\n" + "".join(f"{i / 2000},{12 + i % 7}\n" for i in range(30))


@pytest.mark.parametrize("override", ["rig.kind=guided_mass", 'rig={kind = "guided_mass"}'])
def test_the_kind_that_an_override_states_is_that_of_the_study(written: Run, override: str) -> None:
    """What is written beside the kind, such as what was measured, is that of this rig."""
    Path("force.csv").write_text(FORCES)
    done = written("inspect", "force.csv", "--write", "study.toml", "--rig", "fibre_mass", "--set", override)
    assert done.code == 0, done.err
    text = Path("study.toml").read_text()
    assert 'kind = "guided_mass"' in text
    assert "measured" not in text
    assert load_study("study.toml").kind == "guided_mass"


def test_the_kind_of_an_override_is_looked_at(written: Run) -> None:
    done = written("inspect", "plain.csv", "--write", "study.toml", "--set", "rig.kind=guided_mas")
    assert done.code == 2
    assert "--set rig.kind=guided_mas: " in done.err
    assert 'Did you mean "guided_mass"?' in done.err


@pytest.mark.parametrize("override", ["rig=3", "records=3", "records=[1]", "records=[]"])
def test_what_is_no_table_is_not_written_in_place_of_one(written: Run, override: str) -> None:
    done = written("inspect", "plain.csv", "--write", "study.toml", "--set", override)
    assert (done.code, Path("study.toml").exists()) == (2, False), done.err
    assert "something else in place of rig or records; expected tables there" in done.err


@pytest.mark.parametrize(
    ("said", "wrote", "hour"),
    [
        ("2026-03-14", "taken = 2026-03-14\n", 0),
        ("2026-03-14T09:30:00", "taken = 2026-03-14T09:30:00\n", 9),
        ('"2026-03-14 09:30"', 'taken = "2026-03-14 09:30"\n', 9),
    ],
)
def test_a_day_of_an_override_is_written_as_one(written: Run, said: str, wrote: str, hour: int) -> None:
    words = ("rig.inclination=90 deg", "rig.weight_mass=3 kg", f"records[0].taken={said}")
    overrides = [word for one in words for word in ("--set", one)]
    done = written("inspect", "plain.csv", "--write", "study.toml", *overrides)
    assert done.code == 0, done.err
    assert wrote in Path("study.toml").read_text()
    taken = load_study("study.toml").records[0].taken
    assert (taken.year, taken.month, taken.day, taken.hour) == (2026, 3, 14, hour)
