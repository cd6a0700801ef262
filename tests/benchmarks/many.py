"""Records by themselves, one after the other and in two processes, beside SciPy's fit of one of them."""

from __future__ import annotations

import resource
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.benchmarks import ours, record_stages, rivals
from tests.benchmarks.fits import SAME_COST, excess
from tests.benchmarks.problem import STUDY, drop_task, fit_of, in_our_order
from tests.benchmarks.table import Table
from tests.benchmarks.timing import Stopwatch, spoken

# isort: split
from fibrefit.workflow.batches.batch import Engine, batch_studies
from fibrefit.workflow.batches.item import Job, identified
from fibrefit.workflow.batches.jobs import jobs_of, origins_of

REPEATS = 12
"""Times the five records of the series are gone through."""


def table(watch: Stopwatch) -> Table:
    """Records a second: a bare descent, a whole identification, two processes; and what memory they take."""
    task = drop_task(1)
    fit, answer = fit_of(task), ours.fit(task)
    theirs = watch.once(lambda: rivals.fit_scipy(fit))
    away = excess(task, in_our_order(task, rivals.fit_scipy(fit)), answer)
    if abs(away) > SAME_COST:
        raise AssertionError(f"SciPy ends elsewhere: its cost is {away:.3g} above ours")
    bare = min(watch.once(lambda: ours.fit(task)) for _ in range(9))
    jobs = _jobs()
    for job in jobs[:5]:
        identified(job)
    before = _memory()
    whole = watch.once(lambda: [identified(job) for job in jobs]) / len(jobs)
    grown = _memory() - before
    # What processors spend does not tell how well two of them share the work.
    one, two = (_in_processes(Stopwatch(), jobs, number) for number in (1, 2))
    rows = [
        ("SciPy: solve_ivp, least_squares, one start, no error bars", spoken(theirs), "1", ""),
        ("ours: descent over growing horizons", spoken(bare), f"{theirs / bare:.0f}", "50"),
        ("ours: read, 4 starts, second solver, whitening, checks", spoken(whole), f"{theirs / whole:.1f}", ""),
        ("the same in one process of its own", spoken(one), f"{theirs / one:.1f}", ""),
        ("the same in two", spoken(two), f"{one / two:.2f} times one", "1.8"),
        (f"memory, grown over {len(jobs)} records", f"{grown:.1f} MB", "", ""),
    ]
    return Table("Many records, each by itself", _note(len(jobs)), ("", "a record", "records a second", "goal"), rows)


def stages() -> Table:
    """Where the time of a record goes."""
    return record_stages.table(_jobs()[:25])


def _note(number: int) -> str:
    return (
        f"{number} records of the drop series, each identified by itself; records a second relative to SciPy's, which "
        "gives the same answer. Times of processes are always by the clock, without their start."
    )


def _jobs() -> list[Job]:
    found = jobs_of(origins_of([str(STUDY)], None, ()), "record", 32, 0)
    return [
        Job(f"{job.name} {n}", job.origin, job.record, job.starts, job.seed) for n in range(REPEATS) for job in found
    ]


def _in_processes(watch: Stopwatch, jobs: Sequence[Job], number: int) -> float:
    """Time of a record, that of processes and programs being made taken off: of all records less that of a few."""
    few = jobs[: 5 * number]
    with tempfile.TemporaryDirectory() as folder:
        engine = Engine(max(number, 1))
        short = watch.once(lambda: batch_studies("few", few, Path(folder) / "few", engine))
        long = watch.once(lambda: batch_studies("all", jobs, Path(folder) / "all", engine))
    return float(np.maximum(long - short, 1e-9) / (len(jobs) - len(few)))


def _memory() -> float:
    """Largest memory of this process so far, in MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
