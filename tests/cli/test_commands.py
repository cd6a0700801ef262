"""The small commands: init, show, doctor."""

from __future__ import annotations

import errno
import re
import shlex
from pathlib import Path

import pytest

from fibrefit.cli import doctor, init
from fibrefit.cli.terminal import Terminal, as_typed
from fibrefit.core.declarations import Parameter
from fibrefit.store import write_summary
from fibrefit.study import PriorSetting, load_study
from tests.cli.conftest import Run
from tests.study.test_summaries import EXAMPLES


def test_init_writes_a_study_that_loads(fibrefit: Run) -> None:
    done = fibrefit("init", "my study")
    assert done.code == 0
    told = [shlex.split(line.partition("    ")[0]) for line in done.out.splitlines() if line.startswith("  fibrefit")]
    assert told == [["fibrefit", "inspect", "my study"], ["fibrefit", "fit", "my study/study.toml"]]
    study = load_study("my study")
    assert [record.file for record in study.records] == ["drop_10mm_90deg.csv"]
    assert study.path_of("drop_10mm_90deg.csv").is_file()


def test_a_command_is_told_as_it_is_typed_on_either_system() -> None:
    words = ("fibrefit", "fit", r"my data\study.toml", "a")
    assert as_typed(*words, windows=True) == r'fibrefit fit "my data\study.toml" a'
    assert shlex.split(as_typed(*words, windows=False)) == list(words)


def test_what_stands_in_it_as_remarks_can_be_said(fibrefit: Run) -> None:
    """A prior and limits, a value that is held, the noise, units; and a record is left out by its lines."""
    fibrefit("init", "here")
    file = Path("here/study.toml")
    text = file.read_text("utf-8")
    file.write_text(re.sub(r"(?m)^# (?=\[|\w+ = )", "", text), "utf-8")
    study = load_study("here")
    declared = {name: Parameter(name, unit, "", 1.0) for name, unit in study.base_parameters.items()}
    settings = study.settings(declared)
    assert (settings["friction"].fixed, settings["friction"].initial) == (True, 2.5)
    assert settings["stiffness"].prior == PriorSetting("normal", 12e3, 3e3)
    assert (settings["stiffness"].lower, settings["stiffness"].upper) == (1e3, 300e3)
    assert (study.noise.force, study.noise.position) == (0.4, 0.02e-3)
    head, _, record = text.partition("[[records]]")
    twice = "\n".join(f"# {line}" for line in ("[[records]]", *record.strip().splitlines()))
    file.write_text(f"{text}\n{twice}\n", "utf-8")
    assert len(load_study("here").records) == 1
    assert "To leave a record out, put # before its lines." in head


def test_init_never_overwrites(fibrefit: Run) -> None:
    Path("here").mkdir()
    Path("here/study.toml").write_text("mine")
    done = fibrefit("init", "here")
    assert done.code == 2
    assert "exists already" in done.err
    assert Path("here/study.toml").read_text() == "mine"
    assert not Path("here/drop_10mm_90deg.csv").exists()


@pytest.mark.parametrize("there", [False, True])
def test_init_on_a_full_disk_leaves_nothing_of_its_own(
    fibrefit: Run, monkeypatch: pytest.MonkeyPatch, there: bool
) -> None:
    """The study has its room, the record beside it has none."""
    folder, written = Path("here"), init.write_whole
    if there:
        folder.mkdir()
        (folder / "thesis.tex").write_text("x")

    def write(path: Path, content: bytes) -> None:
        if path.suffix == ".csv":
            raise OSError(errno.ENOSPC, "No space left on device")
        written(path, content)

    monkeypatch.setattr(init, "write_whole", write)
    done = fibrefit("init", "here")
    assert done.code == 2
    assert "No space left on device" in done.err
    assert [path.name for path in folder.iterdir()] == ["thesis.tex"] if there else not folder.exists()


@pytest.mark.parametrize("place", ["notes.txt", "notes.txt/below"])
def test_init_where_a_file_stands_is_refused(fibrefit: Run, place: str) -> None:
    Path("notes.txt").write_text("mine")
    done = fibrefit("init", place)
    assert done.code == 2
    assert Path("notes.txt").read_text() == "mine"


@pytest.mark.parametrize("words", [("fit", ""), ("show", ""), ("report", "", "out"), ("batch", ""), ("inspect", "")])
def test_an_empty_word_is_not_the_working_folder(fibrefit: Run, words: tuple[str, ...]) -> None:
    """As a variable of a script that was never given a value leaves one."""
    assert fibrefit("init", ".").code == 0
    done = fibrefit(*words)
    assert done.code == 2
    assert "an empty word" in done.err
    assert not Path("results").exists()


def test_init_beside_other_files(fibrefit: Run) -> None:
    Path("notes.txt").write_text("mine")
    assert fibrefit("init", ".", "--json").document["study"] == "study.toml"


def test_show_prints_the_report(fibrefit: Run) -> None:
    Path("out").mkdir()
    write_summary(Path("out"), EXAMPLES["fibrefit/fit/1"])
    done = fibrefit("show", "out")
    assert done.code == 0
    assert "stiffness" in done.out
    assert "34.21" in done.out
    assert fibrefit("show", "out", "--json").document["schema"] == "fibrefit/fit/1"


@pytest.mark.parametrize(
    ("content", "code", "says"),
    [
        (None, 3, "no such file"),
        ("{", 3, "not JSON"),
        ('{"schema": "fibrefit/fit/1"}', 4, "status"),
    ],
)
def test_show_explains_what_it_cannot_show(fibrefit: Run, content: str | None, code: int, says: str) -> None:
    Path("out").mkdir()
    if content is not None:
        Path("out/summary.json").write_text(content)
    done = fibrefit("show", "out")
    assert done.code == code
    assert says in done.err


def test_doctor_finds_this_installation_well(fibrefit: Run) -> None:
    done = fibrefit("doctor", "--json")
    assert done.code == 0
    assert {check["name"] for check in done.document["checks"]} == set(doctor.CHECKS)
    assert all(check["passed"] for check in done.document["checks"])
    assert done.document["versions"]["jax"]


def test_doctor_names_what_is_wrong(fibrefit: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def ill() -> tuple[bool, str]:
        raise RuntimeError("no device")

    monkeypatch.setitem(doctor.CHECKS, "devices", ill)
    done = fibrefit("doctor")
    assert done.code == 5
    assert "BAD  devices        RuntimeError: no device" in done.out


def test_what_was_written_is_what_lies_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("study.toml", "summary.json", "result.h5", ".lock"):
        (tmp_path / name).touch()
    Terminal().wrote(tmp_path)
    assert capsys.readouterr().err == f"\nWritten to {tmp_path}: summary.json, result.h5, study.toml.\n"
    (tmp_path / "figures").mkdir()
    Terminal().wrote(tmp_path, " One more thing.")
    assert capsys.readouterr().err.endswith("summary.json, result.h5, study.toml, figures. One more thing.\n")


def test_every_word_of_the_glossary_is_told(fibrefit: Run) -> None:
    page = (Path(__file__).resolve().parents[2] / "docs" / "glossary.md").read_text(encoding="utf-8")
    told = fibrefit("glossary", "--json").document
    assert len(told) == len([line for line in page.splitlines() if line.startswith("| ")]) - page.count("| word |")
    assert all(term["section"] and term["word"] and term["meaning"] for term in told)
    text = fibrefit("glossary").out
    assert "](" not in text
    assert "`" not in text
    assert max(map(len, text.splitlines())) <= 80


def test_a_word_is_looked_up(fibrefit: Run) -> None:
    done = fibrefit("glossary", "hausman", "r-hat")
    assert done.code == 0
    assert done.out.startswith("Estimates\n---------\nHausman test: whether OLS and GLS estimates differ")
    assert "Posterior\n---------\nR-hat: root of the variance" in done.out
    assert "walker" not in done.out
    assert fibrefit("glossary", "interference").out.startswith("Residuals and noise\n-------------------\nmains line:")


def test_a_word_that_is_not_in_the_glossary(fibrefit: Run) -> None:
    done = fibrefit("glossary", "hausmann")
    assert done.code == 2
    assert (
        done.err == 'error: word "hausmann": not in the glossary; expected one of its words. Did you mean "Hausman"?\n'
    )
