"""Notebooks say the same in both of their files, and run from top to bottom as plain scripts."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = sorted((ROOT / "notebooks").glob("*.py"))
#: Bytes of a notebook with its pictures.
LARGEST = 1_000_000
SAYS = {
    "01_first_fit": "status: ok",
    "02_posterior_plots": "status: ok",
    "03_discover_what_is_missing": "NAMED: fibre.maxwell_branch",
    "04_speed_dependent_parameters": "viscous guide          ok",
    "05_series_and_trends": "answer: constant",
    "06_own_logger_file": "status: ok",
    "07_own_effect_in_one_file": "keeps the contract of a law",
    "08_plan_the_next_experiment": "What each would add",
    "09_pendulum": "length    true 0.42",
    "11_thirty_lines": "holds",
    "12_many_records": "not possible",
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


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_what_it_printed_and_drew_is_kept(script: Path) -> None:
    text = script.with_suffix(".ipynb").read_text(encoding="utf-8")
    outputs = [out for cell in json.loads(text)["cells"] for out in cell.get("outputs", ())]
    assert outputs, "make notebooks runs it"
    assert not [out["evalue"] for out in outputs if out["output_type"] == "error"]
    assert len(text) < LARGEST
    assert not re.search(r"/(home|tmp|root|work|Users)/", text), "what it prints names a folder of whoever ran it"


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_each_has_its_equation_and_its_study(script: Path) -> None:
    text = script.read_text(encoding="utf-8")
    assert "## The equation" in text
    assert "## The study file" in text


def test_thirty_lines_are_thirty_and_keep_to_the_reference() -> None:
    script = (ROOT / "notebooks" / "11_thirty_lines.py").read_text(encoding="utf-8")
    code = [line for kind, text in cells_of(script) if kind == "code" for line in text.splitlines() if line.strip()]
    assert len(code) <= 30
    reference = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    for name in re.findall(r"fibrefit\.(\w+)\(", "\n".join(code)):
        assert f"autofunction:: {name}\n" in reference, name


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(SAYS))
def test_it_runs(name: str, tmp_path: Path) -> None:
    carry_out(name, tmp_path)


def carry_out(name: str, tmp_path: Path) -> None:
    shutil.copytree(ROOT / "notebooks", tmp_path / "notebooks")
    shutil.copytree(ROOT / "configs", tmp_path / "configs")
    words = [sys.executable, f"{name}.py"]
    done = subprocess.run(words, cwd=tmp_path / "notebooks", capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert SAYS[name] in done.stdout
