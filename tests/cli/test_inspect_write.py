"""A study is written of what was understood of files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fibrefit.study import load_study
from fibrefit.workflow.prepare import read_records
from tests.cli.conftest import PLAIN, ROWS, Run


def test_the_study_that_was_understood_can_be_written(written: Run) -> None:
    Path("volts.csv").write_text(PLAIN.replace("force [N]", "U1"))
    scale = 'channels.force={ column = "U1", unit = "V", zero = 0.25, scale = "-200 N/V" }'
    done = written("inspect", "volts.csv", "--set", scale, "--set", "rig.weight_mass=3 kg", "--write", "new/study.toml")
    assert done.code == 0
    assert done.err == (
        "\nThe study is in new/study.toml. Still to be stated in it, under [rig]: inclination. "
        "Then: fibrefit fit new/study.toml\n"
    )
    text = Path("new/study.toml").read_text()
    assert (
        '[rig]\nkind = "fibre_mass"\n# still to be stated; in a record where it differs:\n# inclination = "90 deg"'
    ) in text
    assert "# weight_mass" not in text
    refused = written("inspect", "new/study.toml")
    assert refused.code == 4
    assert "no inclination" in refused.err
    again = written("inspect", "new/study.toml", "--set", "rig.inclination=90 deg")
    assert again.code == 0
    assert " from 0.25, scaled by -200 N/V; " in " ".join(again.out.split())
    assert written("inspect", "plain.csv", "--write", "new/study.toml").code == 2


def test_a_study_of_several_records_is_called_by_them(written: Run) -> None:
    """What headings state is not said again; a constant that is stated where the remark stands holds for all."""
    for lift in (10, 20, 30):
        Path(f"Fall {lift}mm.csv").write_text(PLAIN)
    files = [f"Fall {lift}mm.csv" for lift in (10, 20, 30)]
    done = written("inspect", *files, "--write", "mein versuch/study.toml")
    assert done.err.endswith("under [rig]: weight_mass, inclination. Then: fibrefit fit 'mein versuch/study.toml'\n")
    text = Path("mein versuch/study.toml").read_text()
    assert 'name = "Fall 10mm and 2 more"' in text
    assert "[units]" not in text
    remarks = [line for line in text.splitlines() if line.startswith(("# weight_mass", "# inclination"))]
    for line in remarks:
        text = text.replace(line, line.removeprefix("# "))
    Path("mein versuch/study.toml").write_text(text)
    study = load_study("mein versuch")
    assert [record.weight_mass for record in study.records] == [3.096] * 3


@pytest.mark.parametrize(
    ("head", "given", "units"),
    [
        ("Zeit;Kraft;Weg [mm]", ["units.time=s", "units.force=kN"], 'force = "kN"\ntime = "s"'),
        ("Zeit [s];Kraft [N];Weg [mm]", ["units.force=kN"], 'force = "kN"'),
        ("Zeit [s];Kraft;Weg [mm]", ['channels.force={ column = "Kraft", unit = "kN" }'], 'force = "kN"'),
        ("Zeit;Kraft [N];Weg [mm]", [], 'time = "s"'),
        ("Zeit [s];Kraft [N];Weg [mm]", [], ""),
        ("Zeit;Kraft;Weg\ns;N;mm", [], ""),
    ],
)
def test_units_are_written_where_the_file_does_not_state_them(
    fibrefit: Run, head: str, given: list[str], units: str
) -> None:
    """And what is written is read as it was when it was inspected."""
    Path("a.csv").write_text("".join([f"{head}\n", *ROWS]))
    words = [word for one in [*given, "rig.weight_mass=3 kg", "rig.inclination=90 deg"] for word in ("--set", one)]
    seen = fibrefit("inspect", "a.csv", *words, "--write", "study.toml", "--json")
    assert seen.code == 0, seen.err
    assert seen.err.endswith("The study is in study.toml. Then: fibrefit fit study.toml\n")
    text = Path("study.toml").read_text()
    assert text.partition("[units]\n")[2].partition("\n\n")[0] == units
    again = fibrefit("inspect", "study.toml", "--json").document["files"][0]
    (first,) = seen.document["files"]
    assert [again[key] for key in ("roles", "columns", "times")] == [
        first[key] for key in ("roles", "columns", "times")
    ]


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
    assert "no_units.csv cannot be used as a record yet (" in done.err
    assert "; expected files that are understood. " in done.err
    told = written("inspect", "no_units.csv", "--write", "study.toml", "--json").document["error"]
    assert told["got"].startswith("no_units.csv cannot be used as a record yet (")
    assert "units.force" in told["do"] or "under [units]" in told["do"]
    assert not Path("study.toml").exists()


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
    # What the headings state is not said again.
    assert "unit" not in Path("both.toml").read_text()


@pytest.mark.parametrize(("place", "said"), [("there", "it is a folder"), ("plain.csv/study.toml", "--write")])
def test_a_place_where_no_study_can_be_written_is_refused(written: Run, place: str, said: str) -> None:
    Path("there").mkdir()
    done = written("inspect", "plain.csv", "--write", place, "--force")
    assert done.code == 2
    assert said in done.err
    assert "fault" not in done.err


def test_measured_data_is_never_replaced_by_a_study(written: Run) -> None:
    """As where a shell writes out ``--write *.csv``."""
    before = Path("plain.csv").read_bytes()
    done = written("inspect", "no_units.csv", "--write", "plain.csv", "--force")
    assert (done.code, Path("plain.csv").read_bytes()) == (2, before)
    assert "--write plain.csv: a file that is no study; expected the name of the study to write." in done.err


def test_the_answer_in_json_is_one_document_though_no_study_can_be_written(written: Run) -> None:
    done = written("inspect", "plain.csv", "--write", "plain.csv", "--json")
    assert done.code == 2
    assert done.document["schema"] == "fibrefit/error/1"
    done = written("inspect", "plain.csv", "--write", "study.toml", "--json")
    assert (done.code, done.document["schema"]) == (0, "fibrefit/inspection/1")


def test_a_file_with_the_header_is_named_from_the_study(written: Run) -> None:
    Path("head.csv").write_text(PLAIN.partition("\n")[0] + "\n")
    words = ("inspect", "headless.csv", "--set", "files.header=head.csv", "--write", "deep/study.toml")
    assert written(*words).code == 0
    study = load_study(Path("deep/study.toml"), ["rig.weight_mass=3 kg", "rig.inclination=90 deg"])
    assert study.files.header == "../head.csv"
    assert [record.name for record in read_records(study)] == ["../headless.csv"]


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


def test_two_forces_are_not_written_for_a_rig_that_has_one(written: Run) -> None:
    head = "t [s],F1 [N],x [mm],F2 [N]\n"
    Path("two.csv").write_text(head + "".join(f"{i / 2000},{12 + i % 7},{i / 10},{11 + i % 5}\n" for i in range(30)))
    refused = written("inspect", "two.csv", "--rig", "fibre_mass", "--write", "two.toml")
    assert refused.code == 2
    assert """--set 'channels.force="F1 [N]"'""" in refused.err
    assert not Path("two.toml").exists()
    done = written(
        "inspect", "two.csv", "--set", 'channels.force="F1 [N]"', "--rig", "fibre_mass", "--write", "two.toml"
    )
    assert done.code == 0
    assert "force_1" not in Path("two.toml").read_text()
    given = ["--set", "rig.weight_mass=3 kg", "--set", "rig.inclination=90 deg"]
    assert load_study("two.toml", given[1::2]).channels.force is not None


def test_no_study_is_written_where_the_position_was_lost(written: Run) -> None:
    for head in ("t [s],F [N],x (zz)\n", "t [s],F [N],x [mm/10]\n"):
        Path("lost.csv").write_text(head + "".join(f"{i / 2000},{12 + i % 7},{i / 10}\n" for i in range(30)))
        assert written("inspect", "lost.csv").code == 3
        assert written("inspect", "lost.csv", "--rig", "fibre_mass", "--write", "lost.toml").code == 2
        assert not Path("lost.toml").exists()
