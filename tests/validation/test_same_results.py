"""The comparison of two states of the code: it sees the last bit, and goes on where it was stopped."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from tests.validation import same_results
from tests.validation.same_results import Case, arrays, cases, compare, differences, main, state_of

VALUE = 11150.6


def test_the_last_bit_counts_and_sentences_do_not() -> None:
    before = {"value": VALUE, "says": "stiffness is 11.15 N/mm", "checks": [{"passed": True, "name": "it is so"}]}
    assert not differences(before, before | {"says": "the stiffness is 11.15 N/mm", "seconds": 3.0})
    assert differences(before, before | {"value": float(np.nextafter(VALUE, np.inf))})
    assert differences(before, before | {"checks": [{"passed": False, "name": "it is so"}]})
    assert differences(before, before | {"added": ["guide.viscous_friction"]})


def test_arrays_of_a_result_count(tmp_path: Path) -> None:
    found = []
    for name, value in (("a", VALUE), ("b", VALUE), ("c", np.nextafter(VALUE, np.inf))):
        with h5py.File(tmp_path / name, "w") as file:
            file["records/force"] = np.array([1.0, value])
            file["records/says"] = f"words of {name}"
        found.append(arrays(tmp_path / name))
    assert found[0] == found[1]
    assert found[0] != found[2]
    assert list(found[0]) == ["records/force"]


def test_every_config_and_every_practice_series_is_compared(tmp_path: Path) -> None:
    for name in ("p01", "p02"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "study.toml").touch()
    found = {case.name: case for case in cases(tmp_path, ["own/study.toml"], "fit")}
    assert {"fit-demo", "discover-practice_p01", "discover-practice_p02", "fit-own"} < set(found)
    assert found["sweep-configs_pendulum"].command == "sweep"
    studies = {Path(case.study).parent.name for case in found.values()}
    assert {file.parent.name for file in (same_results.ROOT / "configs").glob("*/study.toml")} <= studies


def test_it_goes_on_where_it_was_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []

    def computed(case: Case, tree: Path, seed: int) -> dict[str, Any]:
        asked.append(case.name)
        return {"summary": {"value": VALUE}, "arrays": {}}

    monkeypatch.setattr(same_results, "computed", computed)
    before, after = str(tmp_path / "before"), str(tmp_path / "after")
    number = len(cases(None, [], "fit"))
    assert main(["keep", before, "--seconds", "-1"]) == number
    assert main(["keep", before, "--only", "demo"]) == 0
    assert main(["keep", before]) == 0
    assert len(asked) == len(set(asked)) == number
    monkeypatch.setattr(same_results, "state_of", lambda tree: "another")
    assert main(["keep", after, "--only", "demo"]) == 0
    assert asked.count("fit-demo") == asked.count("sample-demo") == 2
    assert main(["compare", before, after, "--only", "demo"]) == 0
    assert main(["compare", before, after]) == number - 2


def test_an_earlier_revision_is_computed_by_its_own_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each state once, from a checkout that is gone afterwards."""

    def git(*words: str) -> str:
        call = ["git", "-c", "user.name=a", "-c", "user.email=a@b.c", *words]
        return subprocess.run(call, cwd=tmp_path, capture_output=True, text=True, check=True).stdout

    file = tmp_path / "fibrefit" / "a.py"
    file.parent.mkdir()
    (tmp_path / ".gitignore").write_text("results\n")
    git("init")
    for value in ("1.0", "2.0"):
        file.write_text(value)
        git("add", ".")
        git("commit", "-m", value)
    trees: list[Path] = []

    def computed(case: Case, tree: Path, seed: int) -> dict[str, Any]:
        trees.append(tree)
        return {"summary": {"value": float((tree / "fibrefit" / "a.py").read_text())}, "arrays": {}}

    monkeypatch.setattr(same_results, "ROOT", tmp_path)
    monkeypatch.setattr(same_results, "computed", computed)
    assert main(["since", "HEAD", "--only", "fit-demo"]) == 0
    assert main(["since", "HEAD~1", "--only", "fit-demo"]) == 1
    assert len(trees) == 2
    assert not any(tree.exists() for tree in trees if tree != tmp_path)
    assert len(git("worktree", "list").splitlines()) == 1


def test_a_difference_is_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, value in (("before", "1.0"), ("after", "1.0000000000000002")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "fit-demo.json").write_text(f'{{"state": "", "found": {{"value": {value}}}}}')
    assert compare(tmp_path / "before", tmp_path / "after", "") == 1
    assert "1 of 1 values differ" in capsys.readouterr().out


def test_the_state_is_that_of_the_code(tmp_path: Path) -> None:
    file = tmp_path / "fibrefit" / "a.py"
    file.parent.mkdir()
    file.write_text("A = 1")
    first = state_of(tmp_path)
    (tmp_path / "README.md").touch()
    assert state_of(tmp_path) == first
    file.write_text("A = 2")
    assert state_of(tmp_path) != first
