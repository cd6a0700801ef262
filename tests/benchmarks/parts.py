"""``python -m tests.benchmarks.parts``: what one `fibrefit fit` spends on each part, in a process of its own."""

from __future__ import annotations

import compileall
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.benchmarks.table import Table
from tests.benchmarks.timing import spoken

ROOT = Path(__file__).resolve().parents[2]
STUDY = ROOT / "configs" / "drop_series"
REPEATS = 3
"""Warm runs, of which the shortest counts: other work on a machine only ever adds."""
TO_THE_REPORT = ("interpreter and command line", "packages", "study and records", "fit, error bars, checks", "report")
AFTER_IT = ("its files", "its overview, with loading matplotlib", "all its figures, where they are asked for")
GOALS = {"until the report is printed": ("12 s", "3 s")}


def parts() -> dict[str, float]:
    """Processor time of each part of a fit of the drop series, in s; they are carried out one after the other."""
    from fibrefit.cli.main import look_for_garbage_late

    look_for_garbage_late()
    taken = {TO_THE_REPORT[0]: time.process_time()}

    @contextmanager
    def part(name: str) -> Iterator[None]:
        begin = time.process_time()
        yield
        taken[name] = time.process_time() - begin

    with part("packages"):
        from fibrefit.core.paths import FIGURES
        from fibrefit.fitting.identify import identify
        from fibrefit.study import load_study
        from fibrefit.workflow.fit import Fit
        from fibrefit.workflow.prepare import read_records, task_of
    with part("study and records"):
        study = load_study(STUDY)
        records = read_records(study)
        task = task_of(study, records)
    with part("fit, error bars, checks"):
        fit = Fit(study, records, identify(task), 0)
    with part("report"):
        fit.report()
    with tempfile.TemporaryDirectory() as folder:
        with part(AFTER_IT[0]):
            FIGURES.set(())
            fit.save(Path(folder) / "fit")
        with part(AFTER_IT[1]):
            from fibrefit.plots.save import save_figures

            save_figures(fit.first_figures(), Path(folder), formats=("png",))
        with part(AFTER_IT[2]):
            save_figures(fit.plot(), Path(folder), formats=("png",))
    return taken


def table() -> Table:
    """Parts of a fit, first and again; and what a person waits for who only wants to look at a file."""
    # As an installer does; else each run would compile the package's own files anew where Python keeps no byte code.
    compileall.compile_dir(ROOT / "fibrefit", quiet=1)
    with tempfile.TemporaryDirectory() as folder:
        first, *again = (_spent(folder) for _ in range(1 + REPEATS))
        record = str(STUDY / "drop_5mm_90deg.csv")
        others = [
            (f"`fibrefit {command[0]}{' FILE' if len(command) > 1 else ''}`", goal, _command(command, folder))
            for command, goal in ((("--help",), ""), (("inspect", record), "0.7 s"))
        ]
    best = {name: min(one[name] for one in again) for name in first}
    for one in (first, best):
        one["until the report is printed"] = sum(one[name] for name in TO_THE_REPORT)
    rows = [
        (name, spoken(first[name]), GOALS.get(name, ("", ""))[0], spoken(best[name]), GOALS.get(name, ("", ""))[1])
        for name in (*TO_THE_REPORT, "until the report is printed", *AFTER_IT)
    ]
    rows += [(label, "", "", spoken(seconds), goal) for label, goal, seconds in others]
    note = (
        "Processor time, of all cores together, of `fibrefit fit` on the drop series: with nothing compiled yet, and "
        f"again (the shortest of {REPEATS}); byte code of Python is there, as after an installation. The report is "
        "printed before its files are written and its overview is drawn; where no others are asked for, it ends there."
    )
    return Table("What a command spends", note, ("", "first", "goal", "again", "goal"), rows)


def _spent(cache: str) -> dict[str, float]:
    said = _run(["-m", "tests.benchmarks.parts"], cache).stdout
    spent: dict[str, float] = json.loads(said.splitlines()[-1])
    return spent


def _command(words: tuple[str, ...], cache: str) -> float:
    """Processor time of a command, in s: the shortest of some."""
    return min(_processor_time(["-m", "fibrefit", *words], cache) for _ in range(REPEATS))


def _processor_time(words: list[str], cache: str) -> float:
    before = os.times()
    _run(words, cache)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def _run(words: list[str], cache: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "FIBREFIT_CACHE": cache}
    environment.pop("JAX_COMPILATION_CACHE_DIR", None)
    return subprocess.run(
        [sys.executable, *words], env=environment, cwd=ROOT, capture_output=True, text=True, check=True
    )


if __name__ == "__main__":
    print(json.dumps(parts()))
