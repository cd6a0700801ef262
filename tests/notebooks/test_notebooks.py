"""Notebooks say the same in both of their files, and run from top to bottom as plain scripts."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = sorted((ROOT / "notebooks").glob("*.py"))
SAYS = {
    "01_first_fit": "status: ok",
    "02_posterior_plots": "status: ok",
    "03_discover_what_is_missing": "NAMED: fibre.maxwell_branch",
    "04_speed_dependent_parameters": "viscous guide          ok",
}


def cells_of(script: str) -> list[tuple[str, str]]:
    """Kind and text of each cell of a py:percent script."""
    cells = []
    for part in f"\n{script}".split("\n# %%")[1:]:
        first, _, text = part.partition("\n")
        kind = "markdown" if "[markdown]" in first else "code"
        lines = text.strip("\n").split("\n")
        if kind == "markdown":
            lines = [line.removeprefix("#").removeprefix(" ") for line in lines]
        cells.append((kind, "\n".join(lines)))
    return cells


def test_there_are_notebooks() -> None:
    assert [path.stem for path in SCRIPTS] == [path.stem for path in sorted((ROOT / "notebooks").glob("*.ipynb"))]
    assert set(SAYS) <= {path.stem for path in SCRIPTS}


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_both_files_say_the_same(script: Path) -> None:
    notebook = json.loads(script.with_suffix(".ipynb").read_text(encoding="utf-8"))
    paired = [(cell["cell_type"], "".join(cell["source"])) for cell in notebook["cells"]]
    assert paired == cells_of(script.read_text(encoding="utf-8")), (
        "jupytext --to ipynb notebooks/*.py brings them together"
    )
    assert not any(cell.get("outputs") for cell in notebook["cells"])


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(SAYS))
def test_it_runs(name: str, tmp_path: Path) -> None:
    shutil.copytree(ROOT / "notebooks", tmp_path / "notebooks")
    shutil.copytree(ROOT / "configs", tmp_path / "configs")
    words = [sys.executable, f"{name}.py"]
    done = subprocess.run(words, cwd=tmp_path / "notebooks", capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert SAYS[name] in done.stdout
