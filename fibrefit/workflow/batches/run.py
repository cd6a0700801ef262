"""A batch from its words to its folder."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from fibrefit.core.errors import FibrefitError
from fibrefit.core.limits import Progress, quiet
from fibrefit.core.paths import name_of_several
from fibrefit.core.threads import THREADS
from fibrefit.store import default_directory
from fibrefit.workflow.batches.batch import ITEMS, Batch, Engine, batch_studies, forget_others, refuse_another_batch
from fibrefit.workflow.batches.item import Job, loaded
from fibrefit.workflow.batches.jobs import Each, copies_of, jobs_of, origins_of, run_of
from fibrefit.workflow.batches.shards import part_of, parts_of
from fibrefit.workflow.growing import growing_folder


def batch(
    series: str | Path | Iterable[str | Path], out: str | Path | None = None, *, rig: str | None = None,
    overrides: Sequence[str] = (), each: Each | None = None, processes: int | None = None,
    scheduler: str | None = None, starts: int = 32, seed: int = 0, robust: bool = False, force: bool = False,
    resume: bool = False, shard: tuple[int, int] | None = None, progress: Progress | None = None,
) -> Batch:  # fmt: skip
    """Identify every record, or every study, of a series by itself, and write the results as one table.

    Parameters
    ----------
    series : str, pathlib.Path or iterable of them
        Study files, folders with a ``study.toml``, folders of such folders; or bare records, with `rig`.
    out : str or pathlib.Path, optional
        Folder of the batch; ``results/<name>-<hash>`` by default, by what `series` says and the settings: `resume`
        finds it again whatever was put right in the studies and the records.
    rig : str, optional
        Kind of the rig of bare records.
    overrides : sequence of str
        Changes to every study, as on the command line.
    each : {"record", "study"}, optional
        What is identified by itself; the records of a single study, or else each study.
    processes : int, optional
        On this machine; one a core by default. More than one needs a script guarded by ``if __name__ == "__main__"``.
    scheduler : str, optional
        Address of a running Dask scheduler.
    starts, seed, robust : int, int, bool
        As for `fibrefit.fit`.
    force, resume : bool
        Replace what is in the folder; keep what an interrupted or finished run there has done.
    shard : (int, int), optional
        Number of a part, from 1, and of parts: only that part is done, in a folder of its own beside `out`. A run
        without it takes up what the parts have done.
    progress : callable, optional
        Called with what is being done and the share that is finished.

    Returns
    -------
    Batch
        `fibrefit.read_batch` reads its table.

    Raises
    ------
    StudyError
        If the model of the only study goes by the places of its records, which are identified one by one.
    UsageError
        If the folder may not be replaced or holds another batch, a folder holds no study, a scheduler does not answer,
        nothing is named, or an argument makes no sense.

    Examples
    --------
    >>> found = fibrefit.batch(fibrefit.example("drop_series"), "results/each", starts=2, processes=1)
    >>> found.status, len(found.items)
    ('ok', 5)
    """
    words = [series] if isinstance(series, str | Path) else list(series)
    # Workers elsewhere have a working folder of their own.
    origins = origins_of([os.path.abspath(word) if scheduler else str(word) for word in words], rig, overrides)
    jobs = jobs_of(origins, each, starts, seed, robust)
    name = _named(jobs, len(origins))
    settings = repr((rig, tuple(overrides), each, starts, seed, robust))
    named = (Path(word).as_posix() for word in words)
    usual = default_directory(_called(name, words, len(origins)), "batch", *named, settings)
    whole = usual if out is None else Path(out)
    folder, jobs = part_of(whole, jobs, shard)
    engine, tell = Engine(processes or THREADS, scheduler), progress or quiet
    with growing_folder(folder, (ITEMS,), force=force, resume=resume, run=run_of(jobs)) as directory:
        if shard is None:
            refuse_another_batch(directory.path, folder, jobs)
        tell(f"{len(jobs)} identifications", None)
        places = (directory.path, *parts_of(whole))
        found = replace(batch_studies(name, jobs, places, engine, tell, copies_of(jobs)), folder=folder)
        if shard is None:
            forget_others(directory.path, jobs)
        found.write(directory)
    return found


def _called(name: str, words: Sequence[str | Path], studies: int) -> str:
    """Begin of the name of its folder: of one study the name of the batch, else what the words name."""
    return name if studies == 1 else name_of_several([Path(word).absolute() for word in words])


def _named(jobs: Sequence[Job], studies: int) -> str:
    """Name of a batch: that of its study where there is a single one."""
    if studies > 1:
        return f"{studies} studies"
    with suppress(FibrefitError):  # of a study that cannot be read, which the only item says
        return loaded(jobs[0].origin).name
    return jobs[0].name
