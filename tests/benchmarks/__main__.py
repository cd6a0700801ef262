"""``python -m tests.benchmarks``: prints all comparisons; ``--write`` keeps them in docs/benchmarks.md."""

from __future__ import annotations

import argparse
import os
import sys
from datetime import date
from importlib.metadata import version
from pathlib import Path

from tests.benchmarks import fits, growth, many, parts, simulations
from tests.benchmarks.timing import Stopwatch

PAGE = Path(__file__).resolve().parents[2] / "docs" / "benchmarks.md"
PACKAGES = ("numpy", "scipy", "jax", "optimistix", "numba", "lmfit", "diffrax")

HEAD = """# Benchmarks

Made by `python -m tests.benchmarks --write` on {date} with {cores} cores; Python {python}, {packages}.
Numbers are medians of {clock}, of runs taken in turn with those they are compared with; those from a prompt, of
`fibrefit.fit` and of diffrax are single runs, or the shortest of three;
all contenders were first seen to give the same answer, unless the table says otherwise. A ratio above one means that
ours is slower; "goal" is what this project asks of itself ("8, then 3": a first goal and the one that took its place).
"""


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description=__doc__)
    parser.add_argument("--write", action="store_true", help=f"keep the tables in {PAGE.name}")
    parser.add_argument("--quick", action="store_true", help="leave out the slowest rivals and the growth of times")
    parser.add_argument("--busy", action="store_true", help="time by what processors spent: other work goes on")
    given = parser.parse_args()
    clock = "processor time (the machine had other work too)" if given.busy else "wall-clock time"
    packages = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    python = ".".join(map(str, sys.version_info[:3]))
    pages = [HEAD.format(date=date.today(), cores=os.cpu_count(), python=python, packages=packages, clock=clock)]
    print(pages[0], flush=True)
    for table in _tables(Stopwatch(given.busy), given.quick):
        pages.append(table.text())
        print(pages[-1], flush=True)
    if given.write:
        PAGE.parent.mkdir(exist_ok=True)
        PAGE.write_text("\n".join(pages), encoding="utf-8")


def _tables(watch: Stopwatch, quick: bool):
    yield from simulations.tables(watch)
    yield fits.table(watch, slow=not quick)
    yield parts.table()
    yield many.table(watch)
    yield many.stages()
    if not quick:
        yield from growth.tables(watch)


if __name__ == "__main__":
    main()
