"""A study that lists no record is refused by every command that asks for some."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Run

PENDULUM = Path(__file__).parents[2] / "configs" / "pendulum" / "study.toml"


@pytest.mark.parametrize(
    "command", ["fit", "discover", "sample", "batch", "series", "simulate", "distinguish", "plan", "confuse"]
)
def test_it_says_that_none_is_listed(command: str, fibrefit: Run, tmp_path: Path) -> None:
    done = fibrefit(command, str(PENDULUM), "--out", str(tmp_path / "out"))
    assert done.code == 4, done.err
    assert str(PENDULUM) in done.err
    assert "none is listed; expected at least one record" in done.err or "expected a series of 3 or more" in done.err
    assert not (tmp_path / "out").exists()
