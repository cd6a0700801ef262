"""Records of a series identified as ``fibrefit batch`` does and fitted with SciPy, one after the other in a process."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from fibrefit.study.summaries.series import BatchItem
from fibrefit.workflow.batches.item import Job, identified
from fibrefit.workflow.batches.jobs import jobs_of, origins_of
from tests.validation.tables import Share, Table

NAMES = ("stiffness", "damping", "friction")
STARTS = 32
DRAWS = 10_000
"""Times that these are drawn anew for the interval of the ratio: one record that is hard for SciPy moves it."""
GOAL = 50.0
"""Asked for: SciPy's time over ours for a record."""
SAME = 0.5
"""Difference from SciPy's values in standard errors up to which it is the same answer: its integrator leaves a tenth or
two, and other minima were seen from four on."""


@dataclass(frozen=True)
class Rival:
    """What SciPy made of a record.

    Parameters
    ----------
    name : str
    ours : float
        Processor time in s of all that `fibrefit batch` does with it, programs compiled before.
    first, whole : float
        That of SciPy from the start that our search begins with, and of all until one ended where ours did.
    same_at_once, same : bool
        Whether the first, and any of them, did.
    starts : int
    """

    name: str
    ours: float
    first: float
    whole: float
    same_at_once: bool
    same: bool
    starts: int


def with_scipy(folder: Path, names: Sequence[str], items: Mapping[str, BatchItem]) -> list[Rival]:
    """What SciPy makes of some records; what it made of them in an earlier run is kept."""
    file = folder / "rivals.json"
    kept = {row["name"]: Rival(**row) for row in json.loads(file.read_text("utf-8"))} if file.is_file() else {}
    jobs, began = {job.name: job for job in jobs_in(folder)}, time.perf_counter()
    for number, name in enumerate(names, 1):
        if name not in kept:
            kept[name] = _rival(jobs[name], items[name])
            file.write_text(json.dumps([asdict(one) for one in kept.values()], indent=1), encoding="utf-8")
        found = kept[name]
        said = f"SciPy: {number} of {len(names)}, {name}: {found.whole:.1f} s, {found.starts} starts"
        print(f"{said}; {time.perf_counter() - began:.0f} s so far", file=sys.stderr, flush=True)
    return [kept[name] for name in names]


def jobs_in(folder: Path) -> list[Job]:
    """One for each record of a series."""
    return jobs_of(origins_of([str(folder)], None, ()), "record", STARTS, 0)


def _rival(job: Job, item: BatchItem) -> Rival:
    """One record by us, and by SciPy from as many of our starts as it needs for the same answer."""
    from tests.benchmarks import rivals
    from tests.benchmarks.problem import fit_of, in_their_order

    # isort: split
    from fibrefit.fitting.search.starts import latin_hypercube_starts
    from fibrefit.workflow.prepare import task_of

    identified(job)
    began = time.process_time()
    identified(job)
    ours, task = time.process_time() - began, task_of(job.study)
    # Plain least squares is what SciPy does too.
    told = [item.parameters[name] for name in NAMES]
    plain = [(one.plain_value or one.value, one.plain_error or one.std_error) for one in told]
    times, same = [], []
    for start in latin_hypercube_starts(task.problem.layout, task.start, task.spread, STARTS, 0):
        began = time.process_time()
        values = rivals.fit_scipy(fit_of(task)._replace(start=in_their_order(task, start)))
        times.append(time.process_time() - began)
        apart = [abs(there - here) / error for there, (here, error) in zip(values, plain, strict=False)]
        same.append(bool(max(apart) < SAME))
        if same[-1]:
            break
    return Rival(job.name, ours, times[0], sum(times), same[0], same[-1], len(times))


def of_rival(compared: Sequence[Rival]) -> list[str]:
    """Time of SciPy over ours on the same records, all together, with an interval over records drawn anew."""
    ours, first, whole = (np.array([getattr(one, name) for one in compared]) for name in ("ours", "first", "whole"))
    at_once, same = (Share.of(compared, lambda one, name=name: getattr(one, name)) for name in ("same_at_once", "same"))
    starts, lost = [one.starts for one in compared], sum(not one.same for one in compared)
    rows = [
        ("`fibrefit batch`, all it does", f"{1e3 * ours.mean():.0f} ms", "", ""),
        ("SciPy, one start, no error bars", f"{1e3 * first.mean():.0f} ms", at_once, _over(first, ours)),
        ("SciPy, starts until it is the same minimum", f"{1e3 * whole.mean():.0f} ms", same, _over(whole, ours)),
    ]
    heads = ("what", "processor time a record", "in our minimum", "over ours (95 % by drawing records anew)")
    return [
        *Table.of(heads, rows).lines(),
        "",
        f"{len(compared)} records; asked for: {GOAL:.0f} times. SciPy took {np.mean(starts):.1f} starts on average, "
        f"{max(starts)} at the most; {lost} had not come to the same minimum after {STARTS}, and count with the time "
        "of these.",
    ]


def _over(theirs: np.ndarray, ours: np.ndarray) -> str:
    """Ratio of two totals ``(n,)`` and its interval by the bootstrap."""
    drawn = np.random.default_rng(0).integers(len(ours), size=(DRAWS, len(ours)))
    low, high = np.quantile(theirs[drawn].sum(axis=1) / ours[drawn].sum(axis=1), (0.025, 0.975))
    return f"{theirs.sum() / ours.sum():.1f} ({low:.1f} to {high:.1f})"
