"""Running a command line inside the test."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from fibrefit.cli.main import run


@dataclass(frozen=True)
class Done:
    """What a command line has left."""

    code: int
    out: str
    err: str

    @property
    def document(self) -> Any:
        """The one JSON document on stdout."""
        return json.loads(self.out)


Run = Callable[..., Done]

PLAIN = "time [s],force [N],position [mm]\n" + "".join(
    f"{i * 0.0005:.4f},{12.5 + 0.001 * i},{-0.25 + 0.001 * i}\n" for i in range(20)
)
NO_UNITS = PLAIN.replace("force [N]", "Kraft")
HEADLESS = PLAIN.partition("\n")[2]
ROWS = [f"{i / 2000:.4f};{12 + i % 7};{i / 10}\n" for i in range(30)]


@pytest.fixture
def fibrefit(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Run ``fibrefit`` with some words, in an empty folder and with logs of its own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("FIBREFIT_CACHE", str(tmp_path / "cache"))

    def call(*words: str) -> Done:
        capsys.readouterr()
        code = run(words)
        captured = capsys.readouterr()
        return Done(code, captured.out, captured.err)

    return call


@pytest.fixture
def written(fibrefit: Run) -> Run:
    """The same beside three files: one that is ready, one without a unit, one without a heading."""
    for name, text in {"plain.csv": PLAIN, "no_units.csv": NO_UNITS, "headless.csv": HEADLESS}.items():
        Path(name).write_text(text)
    return fibrefit
