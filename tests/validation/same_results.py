"""Says whether two states of the code give the same results, to the last bit.

::

    make same BEFORE=revision PRACTICE=folder
    python -m tests.validation.same_results keep FOLDER --tree ../another-checkout --practice FOLDER
    python -m tests.validation.same_results compare FOLDER ANOTHER

``since``, which ``make same`` calls, keeps the results of an earlier revision and those of this checkout below
``results/same``, each state of the code in a folder named by its digest, and compares them. ``keep`` computes one
case after another and keeps each as soon as it is done, so that it may be stopped at any time and called again: what
that very state of the code has computed is not computed again. ``--only WORD`` takes the cases whose name holds the
word, ``--seconds`` begins no further case after that time, ``--list`` names them. Cases are what ``make demo``
computes, its posterior, the studies under ``configs/``, a batch of forty made drops, and of each series below
``--practice`` the search for what its model lacks; further studies can be named. ``compare`` computes nothing.
Numbers, names and verdicts of ``summary.json`` and the arrays of ``result.h5`` are compared; sentences may differ.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from tests.validation.many_records import make

ROOT = Path(__file__).resolve().parents[2]

#: What is written for a person, or tells of the run and not of the result.
WORDS = frozenset(
    {"says", "sentence", "looks_like", "remedy", "advice", "seconds", "versions", "made", "created", "next", "inputs"}
)
#: Exit codes of a command that has a result: 5 where its checks failed.
ENDED = (0, 5)
FORTY = "forty made drops"
"""Study of a batch whose records are made where it is computed, always the same."""


class Case(NamedTuple):
    """A command on a study.

    Parameters
    ----------
    command : str
    study : str
        Relative to a checkout, or absolute.
    name : str
        Of the case.
    """

    command: str
    study: str
    name: str

    @classmethod
    def of(cls, command: str, study: Path | str, name: str) -> Case:
        """Named by its command and its place."""
        return cls(command, str(study), f"{command}-{name.strip('/').replace('/', '_')}")


def cases(practice: Path | None, others: list[str], command: str) -> list[Case]:
    """``make demo``, the studies of the configs, the practice series and what else is named."""
    demo = "configs/drop_series/study.toml"
    found = [Case.of("fit", demo, "demo"), Case.of("sample", demo, "demo"), Case.of("batch", FORTY, "forty")]
    for file in sorted((ROOT / "configs").glob("*/study.toml")):
        study = file.relative_to(ROOT).as_posix()
        measured = any(path.suffix == ".csv" for path in file.parent.iterdir())
        if study != demo:
            found.append(Case.of("fit" if measured else "sweep", study, study.removesuffix("/study.toml")))
        if measured:
            found.append(Case.of("discover", study, study.removesuffix("/study.toml")))
    for file in sorted(practice.glob("*/study.toml")) if practice else ():
        found.append(Case.of("discover", file.resolve(), f"practice/{file.parent.name}"))
    return [*found, *(Case.of(command, study, study.removesuffix("/study.toml")) for study in others)]


def computed(case: Case, tree: Path, seed: int) -> dict[str, Any]:
    """Results of a case by the code of a checkout, in a process of its own; the refusal where there are none."""
    with tempfile.TemporaryDirectory() as folder:
        study = case.study
        if study == FORTY:
            study = f"{folder}/forty"
            make(Path(study), 40, seed=0)
        call = [sys.executable, "-m", "fibrefit", case.command, study, "--json", "-q", "--figures", "none"]
        call += ["--seed", str(seed), "--out", f"{folder}/result"]
        if case.command == "discover":
            call += ["--time", "86400"]  # what a search comes to must not depend on how quick the machine is
        found = {**os.environ, "PYTHONPATH": str(tree)}
        ended = subprocess.run(call, capture_output=True, text=True, check=False, cwd=tree, env=found)
        if ended.returncode not in ENDED:
            return {"exit": ended.returncode, "says": ended.stderr}
        said = ended.stdout.replace(folder, "")  # where it was computed is no result
        return {"summary": json.loads(said), "arrays": arrays(Path(folder) / "result" / "result.h5")}


def arrays(file: Path) -> dict[str, str]:
    """Digest of each array of numbers of a result, by its place in the file."""
    found: dict[str, str] = {}

    def visit(name: str, item: h5py.Dataset | h5py.Group) -> None:
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "fiub":
            values = np.ascontiguousarray(item[()])
            digest = hashlib.sha256(f"{values.dtype}{values.shape}".encode() + values.tobytes())
            found[name] = digest.hexdigest()[:16]

    if file.exists():
        with h5py.File(file) as content:
            content.visititems(visit)
    return found


def state_of(tree: Path) -> str:
    """Digest of the code of a checkout."""
    whole = hashlib.sha256()
    for file in sorted((tree / "fibrefit").rglob("*.py")):
        whole.update(file.relative_to(tree).as_posix().encode() + b"\0" + file.read_bytes())
    return whole.hexdigest()[:16]


def leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Numbers, flags and names of a summary by their path, without sentences."""
    if isinstance(value, dict):
        for key, below in value.items():
            if key not in WORDS:
                yield from leaves(below, f"{path}/{key}")
    elif isinstance(value, list):
        for place, below in enumerate(value):
            yield from leaves(below, f"{path}/{place}")
    elif not (isinstance(value, str) and " " in value):
        yield path, value


def differences(before: dict[str, Any], after: dict[str, Any]) -> list[str]:
    """A line for each leaf that is not the same in both, to the last bit."""
    old, new = dict(leaves(before)), dict(leaves(after))
    paths = sorted(old.keys() | new.keys())
    return [
        f"{path}: {old.get(path)!r} -> {new.get(path)!r}"
        for path in paths
        if repr(old.get(path)) != repr(new.get(path))
    ]


def keep(folder: Path, wanted: list[Case], tree: Path, seed: int, seconds: float) -> int:
    """Compute what a state of the code has not computed yet; how many cases are left undone."""
    folder.mkdir(parents=True, exist_ok=True)
    state, began = state_of(tree), time.monotonic()
    for number, case in enumerate(wanted):
        file = folder / f"{case.name}.json"
        kept = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
        if kept.get("state") == state and kept.get("seed") == seed:
            print(f"{case.name}: kept already", flush=True)
            continue
        since = time.monotonic()
        if since - began > seconds:
            print(f"{len(wanted) - number} cases not looked at in {seconds:g} s; call it again", flush=True)
            return len(wanted) - number
        found = computed(case, tree, seed)
        part = file.with_suffix(".tmp")
        part.write_text(json.dumps({"state": state, "seed": seed, "found": found}), encoding="utf-8")
        part.replace(file)
        print(f"{case.name}: {time.monotonic() - since:.0f} s", flush=True)
    return 0


def compare(before: Path, after: Path, word: str) -> int:
    """Say of each case whether both folders hold the same of it; how many do not."""
    changed = 0
    for name in sorted(
        {path.name for folder in (before, after) for path in folder.glob("*.json") if word in path.name}
    ):
        missing = [str(folder) for folder in (before, after) if not (folder / name).exists()]
        if missing:
            changed += 1
            print(f"{Path(name).stem}: not in {' and '.join(missing)}")
            continue
        old, new = (json.loads((folder / name).read_text(encoding="utf-8"))["found"] for folder in (before, after))
        lines, number = differences(old, new), len(dict(leaves(new)))
        changed += bool(lines)
        said = f"{len(lines)} of {number} values differ" if lines else f"the same, {number} values"
        print(f"{Path(name).stem}: {said}", *lines[:20], sep="\n    ")
    return changed


def since(revision: str, wanted: list[Case], seed: int) -> int:
    """Keep what a revision and this checkout give, and compare; how many cases differ or were not computed."""
    with tempfile.TemporaryDirectory() as place:
        tree = Path(place) / "before"
        subprocess.run(["git", "worktree", "add", "--detach", str(tree), revision], cwd=ROOT, check=True)
        try:
            folders = [ROOT / "results" / "same" / state_of(one) for one in (tree, ROOT)]
            for folder, one in zip(folders, (tree, ROOT), strict=True):
                print(f"{one}: results in {folder}", flush=True)
                keep(folder, wanted, one, seed, float("inf"))
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", str(tree)], cwd=ROOT, check=True)
    return sum(compare(*folders, f"{case.name}.json") for case in wanted)


def main(arguments: list[str] | None = None) -> int:
    """Keep or compare; the exit code is the number of cases that differ or were not computed, at most 100."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    kinds = parser.add_subparsers(dest="do", required=True)
    keeps = kinds.add_parser("keep", help="compute and keep")
    keeps.add_argument("folder", type=Path)
    keeps.add_argument("studies", nargs="*", help="studies besides those that are always compared")
    keeps.add_argument("--command", default="fit", choices=["fit", "discover", "sweep"], help="for these studies")
    keeps.add_argument("--practice", type=Path, metavar="FOLDER", help="with one series a folder")
    keeps.add_argument("--tree", type=Path, default=ROOT, help="checkout whose code is used; this one unless said")
    keeps.add_argument("--seed", type=int, default=0)
    keeps.add_argument("--seconds", type=float, default=float("inf"), help="after which no further case is begun")
    keeps.add_argument("--list", action="store_true", help="name the cases and compute nothing")
    compares = kinds.add_parser("compare", help="compare what is kept")
    compares.add_argument("before", type=Path)
    compares.add_argument("after", type=Path)
    both = kinds.add_parser("since", help="keep an earlier revision's and this checkout's, and compare")
    both.add_argument("revision")
    both.add_argument("--practice", type=Path, metavar="FOLDER", help="with one series a folder")
    both.add_argument("--seed", type=int, default=0)
    both.set_defaults(studies=[], command="fit", list=False)
    for kind in (keeps, compares, both):
        kind.add_argument("--only", default="", metavar="WORD", help="cases whose name holds it")
    wanted = parser.parse_args(arguments)
    if wanted.do == "compare":
        return min(compare(wanted.before, wanted.after, wanted.only), 100)
    chosen = [case for case in cases(wanted.practice, wanted.studies, wanted.command) if wanted.only in case.name]
    if wanted.list:
        print(*(case.name for case in chosen), sep="\n")
        return 0
    if wanted.do == "since":
        return min(since(wanted.revision, chosen, wanted.seed), 100)
    return min(keep(wanted.folder, chosen, wanted.tree.resolve(), wanted.seed, wanted.seconds), 100)


if __name__ == "__main__":
    sys.exit(main())
