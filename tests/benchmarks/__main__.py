"""``python -m tests.benchmarks``: prints all comparisons; ``--write`` keeps them as CSV in the journal."""

from __future__ import annotations

import argparse
import os
import re
import sys
from datetime import date
from importlib.metadata import version

from tests.benchmarks import fits, growth, many, parts, simulations
from tests.benchmarks.timing import Stopwatch
from tests.validation import tables
from tests.validation.tables import JOURNAL

KEPT = JOURNAL / "benchmarks"
PACKAGES = ("numpy", "scipy", "jax", "optimistix", "numba", "lmfit", "diffrax")

HEAD = """Made by `python -m tests.benchmarks --write` on {date} with {cores} cores; Python {python}, {packages}.
Numbers are medians of {clock}, of runs taken in turn with those they are compared with; those from a prompt, of
`fibrefit.fit` and of diffrax are single runs, or the shortest of three;
all contenders were first seen to give the same answer, unless the table says otherwise. A ratio above one means that
ours is slower; "goal" is what this project asks of itself ("8, then 3": a first goal and the one that took its place).
"""


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description=__doc__)
    parser.add_argument("--write", action="store_true", help="keep the tables in the journal of the validation")
    parser.add_argument("--quick", action="store_true", help="leave out the slowest rivals and the growth of times")
    parser.add_argument("--busy", action="store_true", help="time by what processors spent: other work goes on")
    given = parser.parse_args()
    clock = "processor time (the machine had other work too)" if given.busy else "wall-clock time"
    packages = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    python = ".".join(map(str, sys.version_info[:3]))
    head = HEAD.format(date=date.today(), cores=os.cpu_count(), python=python, packages=packages, clock=clock)
    print(head, flush=True)
    notes = [("", "how", " ".join(head.split()))]
    for table in _tables(Stopwatch(given.busy), given.quick):
        print(table.text(), flush=True)
        name = re.sub(r"\W+", "_", table.title.lower())
        notes.append((name, table.title, table.note))
        if given.write:
            tables.Table.of(table.headings, table.rows).keep(KEPT / f"{name}.csv")
    if given.write:
        tables.Table.of(("table", "title", "note"), notes).keep(KEPT / "notes.csv")


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
