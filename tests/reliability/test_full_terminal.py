"""No room where a command says something: every command says what was lost, and its result is whole."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from fibrefit.cli.main import COMMANDS
from fibrefit.store.manifest import read_manifest
from fibrefit.study import load_study
from tests.reliability.studies import copied

QUICK = ("--figures", "none", "--out", "out")
NARROW = ("--set", "sweep.lowest=4.2 Hz", "--set", "sweep.highest=4.4 Hz", "--set", "sweep.step=0.1 Hz")
FEW = ("--only", "guide.viscous_friction")
WORDS: dict[str, tuple[str, ...]] = {
    "init": ("init", "study"),
    "inspect": ("inspect", "drop_series"),
    "simulate": ("simulate", "drop_series", *QUICK),
    "sweep": ("sweep", "pendulum", *NARROW, *QUICK),
    "fit": ("fit", "drop_series", "--starts", "1", *QUICK),
    "sample": ("sample", "drop_series", "--max-steps", "20", *QUICK),
    "predict": ("predict", "fitted", "drop_series", *QUICK),
    "discover": ("discover", "drop_series", *FEW, *QUICK),
    "series": ("series", "drive_series", *QUICK),
    "batch": ("batch", "drop_series", "--starts", "1", "--jobs", "1", *QUICK),
    "distinguish": ("distinguish", "drop_series", *FEW, *QUICK),
    "confuse": ("confuse", "drop_series", *FEW, *QUICK),
    "plan": ("plan", "drop_series", *QUICK),
    "report": ("report", "fitted"),
    "show": ("show", "fitted"),
    "effects": ("effects",),
    "glossary": ("glossary",),
    "doctor": ("doctor",),
}
SHORT = ("init", "effects")
"""Those that belong to the fast part."""


@pytest.fixture
def folder(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """Studies, and a result of one where a command asks for it."""
    words = WORDS[request.getfixturevalue("name")]
    for study in ("drop_series", "drive_series", "pendulum"):
        if study in words or ("fitted" in words and study == "drop_series"):
            copied(study, tmp_path, records=1 if study == "drop_series" else None)
    if "fitted" in words:
        line = ("fit", "drop_series", "--starts", "1", "--figures", "none", "--out", "fitted")
        subprocess.run([sys.executable, "-m", "fibrefit", *line], cwd=tmp_path, check=True, capture_output=True)
    return tmp_path


def run(folder: Path, words: tuple[str, ...], *, full: str) -> subprocess.CompletedProcess[str]:
    """A command one of whose streams ends on a full disk."""
    with Path("/dev/full").open("w") as nowhere:
        streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | {full: nowhere}
        return subprocess.run(
            [sys.executable, "-m", "fibrefit", *words], cwd=folder, text=True, check=False, timeout=600, **streams
        )  # type: ignore[call-overload]


def test_every_command_is_tried() -> None:
    assert WORDS.keys() == COMMANDS.keys()


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="the system has no /dev/full")
@pytest.mark.parametrize(
    "name", [name if name in SHORT else pytest.param(name, marks=pytest.mark.slow) for name in COMMANDS]
)
def test_an_answer_that_cannot_be_written(folder: Path, name: str) -> None:
    done = run(folder, WORDS[name], full="stdout")
    assert done.returncode == 2, done.stderr
    assert "the answer: cannot be written to stdout: No space left on device" in done.stderr
    assert "Traceback" not in done.stderr
    assert "Exception ignored" not in done.stderr


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="the system has no /dev/full")
@pytest.mark.parametrize(
    "name", [name if name in SHORT else pytest.param(name, marks=pytest.mark.slow) for name in COMMANDS]
)
def test_remarks_that_cannot_be_written_cost_nothing(folder: Path, name: str) -> None:
    done = run(folder, WORDS[name], full="stderr")
    assert done.returncode in (0, 5), done.stdout
    if "--out" in WORDS[name]:
        made = read_manifest(folder / "out")
        assert made is not None
        assert made.complete
        assert made.files
        assert all((folder / "out" / file).is_file() for file in made.files)
    if name == "init":
        assert load_study(folder / "study").records
