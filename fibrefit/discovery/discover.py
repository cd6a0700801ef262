"""Find what a model lacks: where, which effect, added and shown; or that no known effect accounts for it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from fibrefit.core.declarations import Statement
from fibrefit.core.errors import UsageError
from fibrefit.core.limits import Budget, Progress, in_time, quiet, time_limit
from fibrefit.core.threads import in_background
from fibrefit.discovery.conclusion import concluded
from fibrefit.discovery.engine.effort import FIRST_STARTS, first_fit_ends
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.thresholds import AT_A_KINK
from fibrefit.discovery.first_programs import first_programs
from fibrefit.discovery.forward_selection import Limits, forward_select
from fibrefit.discovery.model.finding import Finding
from fibrefit.discovery.search.inputs import linearised_where_records_differ
from fibrefit.discovery.search.record_sets import of_record_sets
from fibrefit.discovery.search.search import Search
from fibrefit.discovery.search.setup import minima_compared, prepared_search
from fibrefit.discovery.search.time_budget import kept_for_conclusion, time_to_use
from fibrefit.fitting.checks import CONVERGED, DOUBTFUL, EXPLAINED
from fibrefit.fitting.identify import How, identify
from fibrefit.fitting.result import Identification, total
from fibrefit.fitting.search.starts import NowhereYet
from fibrefit.laws.law import Effect
from fibrefit.problem import Task
from fibrefit.study.summaries.check import OTHERWISE, Check
from fibrefit.study.summaries.discovery import Unexplained


def discover(
    task: Task, effects: Sequence[type[Effect]], limits: Limits | None = None, progress: Progress | None = None
) -> Finding:
    """Search for the effects a model lacks.

    Parameters
    ----------
    task : Task
        Of the model to begin with.
    effects : sequence of Effect classes
        That may be missing, each applicable to the rig.
    limits : Limits, optional
    progress : callable, optional
        Called with what is being done and the share that is finished.

    Raises
    ------
    DataError
        If the model cannot be simulated from any start.
    UsageError
        If the time is over before any start of the first fit has come anywhere.
    """
    limits = limits or Limits()
    budget = Budget(time_to_use(limits.seconds))
    # Where inputs have errors a fit is shared out by records, and leaves no core idle.
    with in_background(() if task.noisy_inputs else first_programs(task, effects)):
        return _found(task, effects, limits, budget, progress)


def _found(
    task: Task, effects: Sequence[type[Effect]], limits: Limits, budget: Budget, progress: Progress | None
) -> Finding:
    tell = progress or quiet
    before = _first_fit(task, limits, budget, progress)
    if broken := _broken(before):
        return replace(_not_trusted(before, (), budget), broken=broken)
    with _journal(limits.folder) as folder:
        with time_limit(budget.left - kept_for_conclusion(before.running, budget.seconds)):
            started, _ = in_time(partial(_started, task, before, effects, tell, folder), None)
            if started is None:
                finding = _not_trusted(before, (Statement("no_time"),), budget)
                return replace(finding, untried=tuple(effect.name for effect in effects), undone=("further",))
            search, base, before = started
            at = forward_select(search, base, before, limits)
        return concluded(before, base, at, limits, budget)


def _first_fit(task: Task, limits: Limits, budget: Budget, progress: Progress | None) -> Identification:
    stop = lambda: first_fit_ends(budget.used, budget.seconds)  # noqa: E731
    try:
        with time_limit(budget.left):
            how = How(whiten=False, rivals=False)
            return identify(task, FIRST_STARTS, limits.seed, how, progress=progress, stop=stop)
    except NowhereYet:
        expected = "enough for a start of the first fit to come anywhere"
        raise UsageError("time", f"{limits.seconds:g} s", expected, "Give more of it with --time.") from None


@contextmanager
def _journal(folder: Path | None) -> Iterator[Path | None]:
    """Folder of a journal; where nobody goes on with a search, one of its own, as it asks for some things twice."""
    with ExitStack() as stack:
        if folder is None:
            with suppress(OSError):  # Where none can be made, it does some things twice.
                folder = Path(stack.enter_context(TemporaryDirectory(prefix="fibrefit-", ignore_cleanup_errors=True)))
        yield folder


def _started(
    task: Task, before: Identification, effects: Sequence[type[Effect]], tell: Progress, folder: Path | None
) -> tuple[Search, LaplaceFit, Identification]:
    search, base = prepared_search(task, before, effects, tell, folder)
    base, before = minima_compared(search, base, before)
    search, base = linearised_where_records_differ(search, base)
    return replace(search, effects=(*search.effects, *of_record_sets(base, search.effects))), base, before


def _broken(before: Identification) -> tuple[Check, ...]:
    """Why nothing can be said of what the base model lacks; empty where something can.

    A model that lacks much comes to no rest where bounces begin or cease. What it has yet to gain is little beside what
    it lacks, and every candidate is held against a base that is fitted again from where the candidate ended.
    """
    limit = AT_A_KINK * before.problem.n_measured
    return tuple(
        check
        for check in before.checks
        if check.fatal
        and not check.passed
        and check.identifier not in (EXPLAINED, OTHERWISE, DOUBTFUL)
        and not (check.identifier == CONVERGED and (check.statistic or 0.0) <= limit)
    )


def _not_trusted(before: Identification, reason: tuple[Statement, ...], budget: Budget) -> Finding:
    left = Unexplained(gap=total(before.gap))
    return Finding("not_trusted", reason, (), (), (), left, before, before, (), (), budget.used)
