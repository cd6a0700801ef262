"""What a command line that names studies and records means."""

from __future__ import annotations

import re
import time
from pathlib import Path

import pytest
from click.shell_completion import ShellComplete

from fibrefit.cli import terminal
from fibrefit.cli.main import group
from fibrefit.cli.options import study_from
from fibrefit.cli.terminal import Terminal, progress_display
from fibrefit.core.errors import UsageError

GIVEN = ("rig.weight_mass=3 kg", "rig.inclination=90 deg")


@pytest.fixture
def files(tmp_path: Path) -> list[str]:
    paths = [tmp_path / name for name in ("a.csv", "b.csv", "study.toml")]
    for path in paths:
        path.write_text("")
    paths[-1].write_text(
        'schema = "fibrefit/study/1"\nname = "x"\n[rig]\nkind = "fibre_mass"\nweight_mass = "3 kg"\n'
        'inclination = "90 deg"\n[[records]]\nfile = "a.csv"\n'
    )
    return [str(path) for path in paths]


def test_a_study_or_its_folder(files: list[str], tmp_path: Path) -> None:
    assert study_from([files[2]], None, ()) == study_from([str(tmp_path)], None, ())
    assert study_from([files[2]], None, ("name=y",)).name == "y"


def test_bare_records(files: list[str]) -> None:
    study = study_from(files[:2], "fibre_mass", GIVEN)
    assert [record.file for record in study.records] == files[:2]


@pytest.mark.parametrize(
    ("choose", "rig", "says"),
    [
        (slice(0, 3), None, "a study among 3 files"),
        (slice(2, 3), "fibre_mass", "bare records"),
        (slice(0, 1), None, "Add --rig fibre_mass"),
    ],
)
def test_what_cannot_be_meant(files: list[str], choose: slice, rig: str | None, says: str) -> None:
    with pytest.raises(UsageError, match=says):
        study_from(files[choose], rig, GIVEN)


class Screen:
    """A stream that a person looks at."""

    def __init__(self) -> None:
        self.text = ""

    def write(self, text: str) -> int:
        self.text += text
        return len(text)

    def flush(self) -> None: ...

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(("quiet", "shown"), [(False, True), (True, False)])
def test_progress_is_for_those_who_look(monkeypatch: pytest.MonkeyPatch, quiet: bool, shown: bool) -> None:
    screen = Screen()
    monkeypatch.setattr("sys.stderr", screen)
    monkeypatch.setenv("TERM", "xterm")
    with progress_display(Terminal(quiet=quiet)) as follow:
        follow("fitting", None)
        follow("fitting", 0.5)
    assert ("fitting" in screen.text) is shown


def test_where_no_person_looks_a_line_now_and_then_says_where_the_work_stands(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A line each half a minute; here a hundredth of a second stands for that."""
    assert terminal.EVERY == 30.0
    monkeypatch.setattr(terminal, "EVERY", 0.01)
    with progress_display(Terminal()) as follow:
        follow("trying fibre.mass", 0.5)
        until = time.monotonic() + 10.0
        said = ""
        while "trying" not in said and time.monotonic() < until:
            said += capsys.readouterr().err
    assert re.search(r"^ +0 s: trying fibre\.mass, 50 %$", said, re.MULTILINE), said
    with progress_display(Terminal(quiet=True)) as follow:
        follow("trying fibre.mass", 0.5)
        time.sleep(0.05)
    assert capsys.readouterr().err == ""


def test_progress_does_not_go_to_files(capsys: pytest.CaptureFixture[str]) -> None:
    with progress_display(Terminal()) as follow:
        follow("fitting", 0.5)
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(
    "command", ["fit", "sample", "discover", "plan", "inspect", "batch", "sweep", "show", "report"]
)
def test_shells_complete_the_names_of_files(command: str) -> None:
    completes = ShellComplete(group, {}, "fibrefit", "_FIBREFIT_COMPLETE")
    assert [(one.type, one.value) for one in completes.get_completions([command], "co")] == [("file", "co")]
