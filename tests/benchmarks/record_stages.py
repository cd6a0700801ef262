"""Where the time of one record of a long series goes, stage by stage, with programs compiled before."""

from __future__ import annotations

import gc
import importlib
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from fibrefit.workflow.batches.item import Job, identified
from tests.benchmarks.table import Table

STAGES = (
    ("reading the file", "fibrefit.workflow.fit", "read_records"),
    ("noise at rest, starting values, statement", "fibrefit.workflow.fit", "task_of"),
    ("search from the first starts", "fibrefit.fitting.identify", "_search"),
    ("second solver", "fibrefit.fitting.identify", "with_second_solver"),
    ("error bars by four methods", "fibrefit.fitting.identify", "error_bars"),
    ("spectrum of the residuals, twice", "fibrefit.fitting.gls", "noise_of_residuals"),
    ("filters of that noise, twice", "fibrefit.fitting.gls", "whitening_of"),
    ("Gauss-Newton through them, twice", "fibrefit.fitting.gls", "_weighed"),
    ("Hausman test", "fibrefit.fitting.identify", "_compared"),
    ("checks that residuals are noise", "fibrefit.fitting.identify", "checks_of"),
    ("summary and its checks in words", "fibrefit.workflow.fit", "fit_summary"),
)
"""What it is called, and the function that does it; none of them calls another."""
WHOLE = "all of it"


def table(jobs: Sequence[Job], warm: int = 5) -> Table:
    """Processor time of the stages of some jobs, the first of which only warm up."""
    for job in jobs[:warm]:
        identified(job)
    gc.freeze()
    spent = dict.fromkeys([*(name for name, *_ in STAGES), WHOLE], 0.0)
    with _timed(spent):
        began = time.process_time()
        for job in jobs[warm:]:
            identified(job)
        spent[WHOLE] = time.process_time() - began
    gc.unfreeze()
    number = len(jobs) - warm
    spent["other"] = 2.0 * spent[WHOLE] - sum(spent.values())
    order = [*(name for name, *_ in STAGES), "other", WHOLE]
    rows = [(name, f"{1e3 * spent[name] / number:.1f} ms", f"{spent[name] / spent[WHOLE]:.0%}") for name in order]
    note = f"Processor time of {number} records, each identified by itself as `fibrefit batch` does."
    return Table("Where the time of a record goes", note, ("stage", "a record", "share"), rows)


@contextmanager
def _timed(spent: dict[str, float]) -> Iterator[None]:
    """Each stage's function adds the time it takes to `spent`."""
    before = [(importlib.import_module(module), function) for _, module, function in STAGES]
    kept = [getattr(module, function) for module, function in before]
    for (name, *_), (module, function), work in zip(STAGES, before, kept, strict=True):
        setattr(module, function, _watched(work, name, spent))
    try:
        yield
    finally:
        for (module, function), work in zip(before, kept, strict=True):
            setattr(module, function, work)


def _watched(work: Callable[..., Any], name: str, spent: dict[str, float]) -> Callable[..., Any]:
    def run(*given: Any, **named: Any) -> Any:
        began = time.process_time()
        try:
            return work(*given, **named)
        finally:
            spent[name] += time.process_time() - began

    return run
