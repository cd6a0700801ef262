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
