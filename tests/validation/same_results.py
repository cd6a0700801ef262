"""Keeps the results of a list of studies, and says whether another state of the code gives the same to the last bit.

``python -m tests.validation.same_results keep FOLDER STUDY...`` computes and keeps them, ``compare`` in place of
``keep`` computes them anew and compares. Sentences may differ, numbers, names and verdicts may not. ``--command
discover`` compares searches instead of fits.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

#: What is written for a person, or tells of the run and not of the result.
WORDS = frozenset(
    {"says", "sentence", "looks_like", "name", "remedy", "advice", "seconds", "versions", "made", "created", "next"}
)


def computed(command: str, study: str, seed: int) -> dict[str, Any]:
    """Summary of `command` on `study`, by a process of its own; the text of a refusal where there is none."""
    with tempfile.TemporaryDirectory() as folder:
        call = [sys.executable, "-m", "fibrefit", command, study, "--json", "-q"]
        call += ["--seed", str(seed), "--out", f"{folder}/result"]
        ended = subprocess.run(call, capture_output=True, text=True, check=False)
    if ended.returncode not in (0, 5):
        return {"exit": ended.returncode, "says": ended.stderr}
    return dict(json.loads(ended.stdout))


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


def main(arguments: list[str] | None = None) -> int:
    """Keep or compare; the exit code is the number of studies that differ, at most 100."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("do", choices=["keep", "compare"])
    parser.add_argument("folder", type=Path)
    parser.add_argument("studies", nargs="+")
    parser.add_argument("--command", default="fit", choices=["fit", "discover", "simulate", "sweep"])
    parser.add_argument("--seed", type=int, default=0)
    wanted = parser.parse_args(arguments)
    wanted.folder.mkdir(parents=True, exist_ok=True)
    changed = 0
    for study in wanted.studies:
        kept = wanted.folder / f"{wanted.command}-{study.strip('./').replace('/', '_')}.json"
        found = computed(wanted.command, study, wanted.seed)
        if wanted.do == "keep":
            kept.write_text(json.dumps(found), encoding="utf-8")
            print(f"{study}: kept", flush=True)
            continue
        lines = differences(json.loads(kept.read_text(encoding="utf-8")), found)
        changed += bool(lines)
        print(f"{study}: {'the same' if not lines else f'{len(lines)} differ'}", *lines[:20], sep="\n    ", flush=True)
    return min(changed, 100)


if __name__ == "__main__":
    sys.exit(main())
