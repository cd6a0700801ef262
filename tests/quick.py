"""``python -m tests.quick [PACKAGE ...]``: what a change of a package needs, in less than two minutes on two cores.

Style, types, the structure of the program, and the tests of the packages; without a name those of the packages that
differ from ``main``, or from the last commit where nothing does. Tests that need more than `LONGEST` seconds are left
out; `make test` has them.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LONGEST = 5.0
"""s a test may need, its fixtures included."""
ROOMS = {path.name for path in (ROOT / "tests").iterdir() if path.is_dir()}
"""Folders of tests: a package each, and a few more."""


def main() -> int:
    packages = sys.argv[1:] or changed()
    if unknown := sorted(set(packages) - ROOMS):
        print(f"no tests of {', '.join(unknown)}; expected names of folders in tests: {', '.join(sorted(ROOMS))}")
        return 2
    print("packages:", ", ".join(packages) or "none has changed", flush=True)
    sources = [f"fibrefit/{name}" for name in packages if (ROOT / "fibrefit" / name).is_dir()]
    tests = [f"tests/{name}" for name in packages]
    pytest = ["pytest", "-q", "-n", "2", "--dist", "loadfile", "--longest", f"{LONGEST:g}", "tests/test_house.py"]
    steps = [["ruff", "check", "-q", *sources, *tests], ["ruff", "format", "-q", "--check", *sources, *tests]]
    steps += [["mypy", *sources]] if sources else []
    for step in (*steps, [*pytest, *tests]):
        if code := subprocess.run([sys.executable, "-m", *step], cwd=ROOT, check=False).returncode:
            return code
    return 0


def changed() -> list[str]:
    """Packages with a file that differs from main, or else from the last commit but one."""
    for since in ("main", "HEAD", "HEAD~1"):
        call = ["git", "diff", "--name-only", since, "--", "fibrefit", "tests"]
        done = subprocess.run(call, cwd=ROOT, capture_output=True, text=True, check=False)
        parts = [Path(line).parts for line in done.stdout.splitlines()]
        if found := sorted({part[1] for part in parts if len(part) > 2} & ROOMS):
            return found
    return []


if __name__ == "__main__":
    sys.exit(main())
