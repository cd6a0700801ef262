"""``batch``: one identification a record or a study, over hundreds or thousands."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Generator, Iterable, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from fibrefit.core.errors import FibrefitError, UsageError
from fibrefit.core.limits import Progress, quiet
from fibrefit.core.paths import write_whole
from fibrefit.records.copies import Fingerprint
from fibrefit.series.engines import Done, in_processes, in_this_process, on_cluster
from fibrefit.store import ResultDirectory
from fibrefit.store.csv_text import csv_text
from fibrefit.store.summary import NAME, provenance, write_summary
from fibrefit.study.summaries.series import BatchItem, BatchSummary, speed_name
from fibrefit.workflow.batches.files import batch_checks, batch_status, batch_table
from fibrefit.workflow.batches.item import Job, Outcome, identified, loaded
from fibrefit.workflow.batches.jobs import RecordConditions, copies_seen, record_conditions
from fibrefit.workflow.outcome.result import AnyResult
from fibrefit.workflow.sampling.progress import spoken
from fibrefit.workflow.together.pooled import USABLE, PooledBatch, pooled_batch, quantities_of
from fibrefit.workflow.together.tidy import tidy_frame, tidy_rows, write_table

if TYPE_CHECKING:
    import pandas as pd


ITEMS, ITEM, TABLE = "items", "item.json", "results.csv"
NOT_POSSIBLE = "not possible"
KEPT = {"lacks", "speeds"}
"""What an item on disk has to say beside its values for it to be taken up."""


@dataclass(frozen=True)
class Engine:
    """Where the work is done.

    Parameters
    ----------
    processes : int
        On this machine; one means in this process.
    scheduler : str or None
        Address of a Dask cluster instead.
    """

    processes: int = 1
    scheduler: str | None = None

    def run(self, jobs: Sequence[Job]) -> Generator[Done, None, None]:
        """Carry out every job, in the order in which they end."""
        if self.scheduler is not None:
            return on_cluster(identified, jobs, self.scheduler)
        if self.processes > 1 and len(jobs) > 1:
            return in_processes(identified, jobs, min(self.processes, len(jobs)))
        return in_this_process(identified, jobs)


@dataclass(frozen=True, repr=False)
class Batch(AnyResult):
    """Identifications side by side.

    Parameters
    ----------
    name : str
    jobs : tuple of Job
    items : mapping of str to BatchItem
        In the order of the jobs.
    conditions : mapping of str to RecordConditions
        Of the records, where each was identified by itself.
    seconds : float
        Of this run; what an earlier one had done is not counted.
    taken_up : int
        Items an earlier run had done.
    read : mapping of str to str
        SHA-256 of each file that an item rests on, as it was when it was read.
    folder : pathlib.Path or None
        Where the whole of it is, once it is written.
    """

    name: str
    jobs: tuple[Job, ...]
    items: Mapping[str, BatchItem]
    conditions: Mapping[str, RecordConditions] = field(default_factory=dict)
    seconds: float = 0.0
    taken_up: int = 0
    read: Mapping[str, str] = field(default_factory=dict)
    folder: Path | None = None

    @property
    def status(self) -> str:
        """``ok`` where every item is, ``failed`` where none can be used, else ``suspect``."""
        return batch_status(self.items)

    def summary(self) -> BatchSummary:
        """Content of ``summary.json``."""
        return self._summary

    @cached_property
    def _summary(self) -> BatchSummary:
        first = self.jobs[0]
        settings = {"starts": str(first.starts), "robust": str(first.robust)}
        studies = "\n".join(dict.fromkeys(Path(file).as_posix() for job in self.jobs for file in job.origin.files))
        origin = provenance(
            studies, self._inputs, seed=first.seed, seconds=self.seconds, settings=settings, read=self.read
        )
        return BatchSummary(
            status=batch_status(self.items),
            name=self.name,
            items={
                name: item.model_copy(update={"shrunk": self._pooled.shrunk.get(name, {})})
                for name, item in self._with_conditions.items()
            },
            population=self._pooled.summaries,
            trends=self._pooled.trends,
            checks=batch_checks(self.items),
            provenance=origin,
        )

    @property
    def _inputs(self) -> list[Path]:
        """What items were read from, files of all studies that can still be read, what else the command line named."""
        found: list[Path] = []
        for origin in dict.fromkeys(job.origin for job in self.jobs):
            with suppress(FibrefitError, OSError):
                found += loaded(origin).input_files()
            found += map(Path, origin.files)
        return list(dict.fromkeys([*(file for file in found if file.is_file()), *map(Path, self.read)]))

    @cached_property
    def _with_conditions(self) -> dict[str, BatchItem]:
        known = {name: one.headed() for name, one in self.conditions.items()}
        speeds = {
            name: {f"{speed_name(key)} [m/s]": value for key, value in item.speeds.items()}
            for name, item in self.items.items()
        }
        return {
            name: item.model_copy(update={"conditions": {**values, **speeds[name]}, "condition_errors": errors})
            for name, item in self.items.items()
            for values, errors in [known.get(name, ({}, {}))]
        }

    @cached_property
    def _pooled(self) -> PooledBatch:
        """Population and trends, where each record was identified by itself."""
        return pooled_batch(self._with_conditions) if self.conditions else PooledBatch({}, (), {})

    def tidy(self) -> pd.DataFrame:
        """One row a record and parameter: ``value``, ``std_error``, ``unit`` and every condition, SI units."""
        names = [name for name, item in self.items.items() if item.status in USABLE]
        return tidy_frame(tidy_rows(names, *quantities_of(self._with_conditions), self._pooled.shrunk))

    def table(self) -> list[list[str]]:
        """Head and one row an item: conditions, status, gap, values and errors, in SI units."""
        return batch_table(self.items, self.conditions)

    def write(self, directory: ResultDirectory) -> None:
        """Write all but the items, which are there already, into a folder that is being made."""
        from fibrefit.plots.save import save_figures

        write_summary(directory.path, self.summary())
        write_whole(directory.path / TABLE, csv_text(self.table()))
        write_table(directory.path / "table", self.tidy())
        save_figures(self.plot(), directory.path / "figures")


def batch_studies(
    name: str,
    jobs: Sequence[Job],
    folders: Path | Sequence[Path],
    engine: Engine | None = None,
    progress: Progress | None = None,
    refused: Mapping[str, str] | None = None,
) -> Batch:
    """Carry out every job that `folder` does not hold the outcome of.

    Parameters
    ----------
    name : str
        Of the batch.
    jobs : sequence of Job
    folders : pathlib.Path or sequence of them
        Each item is written below the first as soon as it is done; what is in any of them and depends on nothing that
        has changed since is taken up.
    engine : Engine, optional
    progress : callable, optional
        Called with what is being done and the share that is finished.
    refused : mapping of str to str, optional
        Why jobs are not carried out, by their names.

    Raises
    ------
    UsageError
        If a scheduler does not answer.
    """
    from fibrefit.plots.save import file_names

    began, follow = time.perf_counter(), progress or quiet
    conditions = record_conditions(jobs)  # of the study as it is now: it may be changed meanwhile
    folder, *others = (folders,) if isinstance(folders, Path) else folders
    names = file_names([job.name for job in jobs])
    places = {job: folder / ITEMS / name for job, name in zip(jobs, names, strict=True)}
    # Of what is done a process that goes through ten thousand records keeps how many there are; all else is on disk.
    errors, todo, counts, elsewhere = dict(refused or {}), list[Job](), Counter[str](), _kept_in(others)
    counts[NOT_POSSIBLE] += len(errors)
    for job in [job for job in jobs if job.name not in errors]:
        known = _resumed(places[job], job) or _from_other_part(places[job], job, elsewhere)
        if known is None:
            todo.append(job)
        else:
            counts[_kind(known.item)] += 1
    before = counts.total()
    # Whoever interrupts it may keep where it was, and with that all who are at work.
    with closing((engine or Engine()).run(todo)) as outcomes:
        for done in outcomes:
            job = todo[done.number]
            if done.error is None:
                _keep(places[job], done.outcome)
            else:
                errors[job.name] = _error_line(done.error)
            counts[NOT_POSSIBLE if done.error else done.outcome.status] += 1
            follow(*_progress_line(counts, len(jobs), counts.total() - before, time.perf_counter() - began))
    items, read = _all_of(places, errors)
    done_before = before - len(refused or {})
    return Batch(name, tuple(jobs), items, conditions, time.perf_counter() - began, done_before, read)


def forget_others(folder: Path, jobs: Sequence[Job]) -> None:
    """Remove what an earlier run kept of items that are in a batch no longer.

    Parameters
    ----------
    folder : pathlib.Path
        Of the whole of it: what a part has no longer another one may take up.
    jobs : sequence of Job
        All that are in it.
    """
    _forget(_others(folder, jobs)[0])


def refuse_another_batch(folder: Path, out: Path, jobs: Sequence[Job]) -> None:
    """Refuse to go on in a folder that holds none of the items of a batch: it would lose all it holds.

    Parameters
    ----------
    folder : pathlib.Path
        Of what is kept.
    out : pathlib.Path
        As a person knows it.
    jobs : sequence of Job
        All that are in the batch.

    Raises
    ------
    UsageError
        If there are items of others alone.
    """
    others, own = _others(folder, jobs)
    if others and not own:
        do = "Name another folder with --out, or replace this one with --force."
        raise UsageError(str(out), f"items of another batch, such as {others[0].name}", "items of this one", do)


def _others(folder: Path, jobs: Sequence[Job]) -> tuple[list[Path], list[Path]]:
    """Items that are kept in a folder: those that are in a batch no longer, and those that are."""
    from fibrefit.plots.save import file_names

    names = set(file_names([job.name for job in jobs]))
    # A study that cannot be read now is one job: what its records took is still theirs once it can.
    whole = tuple(f"{name}_" for name in file_names([job.name for job in jobs if job.record is None]))
    there = sorted((folder / ITEMS).glob("*"))
    own = [place for place in there if place.name in names or place.name.startswith(whole)]
    return [place for place in there if place not in own], own


def _forget(places: Iterable[Path]) -> None:
    """Remove items; links, and what others have put there, stay."""
    for place in places:
        if not place.is_symlink():
            with suppress(OSError):
                for name in (ITEM, NAME):
                    (place / name).unlink(missing_ok=True)
                place.rmdir()


def _all_of(places: Mapping[Job, Path], errors: Mapping[str, str]) -> tuple[dict[str, BatchItem], dict[str, str]]:
    """Items of all jobs, in their order, from where each is kept, and digests of the files they were read from.

    A copy of a record before it is no item.
    """
    items, fingerprints, read = dict[str, BatchItem](), dict[str, Fingerprint](), dict[str, str]()
    for job, place in places.items():
        if job.name in errors:
            items[job.name] = BatchItem(error=errors[job.name])
            continue
        known = _parsed(json.loads((place / ITEM).read_text(encoding="utf-8")), place)
        items[job.name] = known.item
        read |= known.inputs
        if known.fingerprint is not None:
            fingerprints[job.name] = known.fingerprint
    copies = {copy: BatchItem(error=why) for copy, why in copies_seen(list(items), fingerprints).items()}
    return items | copies, read


class KeptItem(NamedTuple):
    """What is kept of a job that has ended.

    Parameters
    ----------
    fingerprint : Fingerprint or None
        By which copies of its record are known.
    inputs : mapping of str to str
        SHA-256 of each file it rests on, by path; of earlier versions none.
    """

    item: BatchItem
    fingerprint: Fingerprint | None
    inputs: Mapping[str, str]


def _resumed(place: Path, job: Job) -> KeptItem | None:
    """What an earlier run found, if it was the same job; what failed is tried again."""
    try:
        kept = json.loads((place / ITEM).read_text(encoding="utf-8"))
        # An item that does not say all of this, or how its record looks, was kept by an earlier version.
        same = kept["digest"] == job.digest() and set(kept["item"]) >= KEPT and (place / NAME).exists()
        return _parsed(kept, place) if same else None
    except (OSError, ValueError, KeyError, TypeError, RecursionError, FibrefitError):
        return None


def _parsed(kept: Mapping[str, Any], place: Path) -> KeptItem:
    item = BatchItem.model_validate({**kept["item"], "result": f"{ITEMS}/{place.name}"}, strict=False)
    looks = None if kept["fingerprint"] is None else Fingerprint(**kept["fingerprint"])
    return KeptItem(item, looks, {str(name): str(digest) for name, digest in kept.get("inputs", {}).items()})


def _kept_in(folders: Sequence[Path]) -> dict[str, Path]:
    """Places of what parts of the batch found, by digest: names of places are numbered in each part by itself."""
    found: dict[str, Path] = {}
    for file in (file for folder in folders for file in sorted((folder / ITEMS).glob(f"*/{ITEM}"))):
        with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
            found.setdefault(str(json.loads(file.read_text(encoding="utf-8"))["digest"]), file.parent)
    return found


def _from_other_part(place: Path, job: Job, elsewhere: Mapping[str, Path]) -> KeptItem | None:
    """What another part of the batch found, copied to its place."""
    if not elsewhere:
        return None
    with suppress(OSError, KeyError, FibrefitError):
        source = elsewhere[job.digest()]
        if (known := _resumed(source, job)) is not None:
            place.mkdir(parents=True, exist_ok=True)
            for name in (NAME, ITEM):
                write_whole(place / name, (source / name).read_bytes())
            return known
    return None


def _keep(place: Path, outcome: Outcome) -> None:
    """Write what is kept of an item; that it is done is shown by the last file."""
    place.mkdir(parents=True, exist_ok=True)
    write_whole(place / NAME, outcome.summary)
    write_whole(place / ITEM, outcome.item)


def _error_line(error: Exception) -> str:
    """An error in one line: a user's mistake as it is, a fault of the program by its kind."""
    if isinstance(error, FibrefitError):
        return " ".join(str(error).split("\n"))
    first = str(error).strip().partition("\n")[0] or "no message"
    return f"fault in the program: {type(error).__name__}: {first}"


def _kind(item: BatchItem) -> str:
    return item.status or NOT_POSSIBLE


def _progress_line(found: Counter[str], total: int, here: int, seconds: float) -> tuple[str, float | None]:
    """How far a batch is: kinds of outcomes so far, of which `here` are of this run."""
    done = found.total()
    remaining = seconds / max(here, 1) * (total - done)
    also = "".join(f", {found[kind]} {kind}" for kind in ("suspect", "failed", NOT_POSSIBLE) if found[kind])
    rate = here / max(seconds, 1e-9)
    pace = f"{rate:.2g} a second" if rate >= 1.0 else f"{60.0 * rate:.2g} a minute"
    return f"{done} of {total} identified{also}; {pace}, about {spoken(remaining)} left", done / total
