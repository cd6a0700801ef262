"""Identifies some thousand records as ``fibrefit batch`` does, and counts what became of them.

``python -m tests.validation.validate_batch FOLDER --records 2000 --seconds 500`` makes the series if it is not there,
goes on with the batch for so long, and prints tables of all that is done; said again, it goes on. In the same run some
records are identified and fitted with SciPy in turn, from one start after the other until it ends in the same minimum,
and some are identified by one worker and by two. Memory is that of the parent and of the largest worker, read while
they work. Damaged records are asked once more by themselves: what is refused leaves nothing on disk. ``make
bench-series`` is this for 2 000 records.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Generator, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from fibrefit.core.errors import FibrefitError
from fibrefit.series.engines import Done, in_processes
from fibrefit.study.summaries.series import BatchItem
from fibrefit.workflow.batches.batch import Engine, batch_studies
from fibrefit.workflow.batches.item import Job, Outcome, identified
from tests.validation.beside_scipy import NAMES, jobs_in, of_rival, with_scipy
from tests.validation.many_records import DAMAGES, Made, known, make
from tests.validation.tables import ROOT, Share, Table

Z_95 = 1.959964
LOOK_SECONDS = 5.0
COMPARED = 40
"""Records that SciPy fits too, spread over those that are done."""
GOAL_OF_TWO, GOAL_OF_MEMORY = 1.8, 1.05
"""Asked for: time of one worker over that of two, memory over what it was once programs were compiled."""
WARM = 0.25
"""Share of the records after which programs are compiled and memory has grown to what it needs."""


@dataclass(frozen=True)
class Look:
    """What a batch had done at an instant.

    Parameters
    ----------
    done : int
        Items on disk.
    seconds, processor_seconds : float
        Of this piece, by the clock and of all workers together.
    megabytes : float
        Memory of the largest worker.
    load : float
        Of the machine, mean of a minute.
    parent : float
        Memory in MB of the process that the workers report to; it is the only one where there is one process.
    """

    done: int
    seconds: float
    processor_seconds: float
    megabytes: float
    load: float
    parent: float = 0.0


def go_on(folder: Path, processes: int, seconds: float, shard: str = "") -> list[Look]:
    """Carry the batch of a folder on for so long, or to its end; what was seen on the way."""
    command = [sys.executable, "-m", "fibrefit", "batch", str(folder), "--out", str(folder / "out"), "--quiet"]
    command += ["--jobs", str(processes), "--resume", *(["--shard", shard] if shard else [])]
    began, looks = time.perf_counter(), []
    with (folder / "said.txt").open("ab") as said:
        process = subprocess.Popen(command, stdout=said, stderr=said, cwd=ROOT)
        while process.poll() is None:
            time.sleep(LOOK_SECONDS)
            looks.append(_look(folder, process.pid, time.perf_counter() - began))
            if looks[-1].seconds > seconds:
                process.send_signal(signal.SIGTERM)
                process.wait()
    return looks


def _look(folder: Path, parent: int, seconds: float) -> Look:
    done = sum(1 for _ in folder.glob("out*/items/*/item.json"))
    workers = [pid for pid in _children(parent) if pid != parent]
    sizes = [_status(pid, "VmRSS:") / 1024.0 for pid in workers]
    ticks = _processor_seconds(parent)
    own = _status(parent, "VmRSS:") / 1024.0
    return Look(done, seconds, ticks, max(sizes, default=0.0), os.getloadavg()[0], own)


def _children(parent: int) -> list[int]:
    """A process and all that it has begun."""
    found = [parent]
    for pid in found:
        try:
            for thread in Path(f"/proc/{pid}/task").iterdir():
                found += [int(child) for child in (thread / "children").read_text().split()]
        except OSError:
            continue
    return found


def _status(pid: int, key: str) -> float:
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    except OSError:
        return 0.0
    return next((float(line.split()[1]) for line in lines if line.startswith(key)), 0.0)


def _ticks(pid: int) -> int:
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0
    return int(fields[11]) + int(fields[12])


def items_of(folder: Path) -> dict[str, BatchItem]:
    """What is done, by the names of the records."""
    from fibrefit.plots.save import file_names

    names = [one.name for one in known(folder)]
    of_folder, found = dict(zip(file_names(names), names, strict=True)), {}
    for place in folder.glob("out*/items/*/item.json"):
        content = json.loads(place.read_text(encoding="utf-8"))
        found[of_folder[place.parent.name]] = BatchItem.model_validate(content["item"], strict=False)
    return found


def report(folder: Path, made: Sequence[Made], looks: Sequence[Look]) -> list[str]:
    """Lines of what became of the records, of time and of memory."""
    items = items_of(folder)
    sound = [one for one in made if not one.damage and one.name in items]
    status = Counter(str(items[one.name].status) for one in sound)
    lines = [f"{len(sound)} sound records: " + ", ".join(f"{n} {kind}" for kind, n in status.most_common()), ""]
    held: list[tuple[object, ...]] = []
    for name in NAMES if sound else ():
        found = [(items[one.name].parameters[name], getattr(one.truth, name)) for one in sound]
        scores = np.array([(one.value - truth) / one.std_error for one, truth in found])
        inside = Share(int(np.sum(np.abs(scores) <= Z_95)), len(scores))
        held.append((name, inside, f"{np.max(np.abs(scores)):.1f}"))
    lines += Table.of(("parameter", "interval of 95 % holds the truth", "largest error, standard errors"), held).lines()
    lines += ["", *_of_damages(folder, made)]
    if not sound:
        return lines
    compared = with_scipy(folder, [one.name for one in sound][:: max(len(sound) // COMPARED, 1)][:COMPARED], items)
    return [*lines, "", *of_rival(compared), "", *_of_speed(looks), "", *_of_memory(looks)]


def _of_speed(looks: Sequence[Look]) -> list[str]:
    """Processor time of a record once programs are compiled, and records a second by the clock."""
    # Another piece of the batch begins its count of seconds anew.
    pairs = [pair for pair in pairwise(_at_work(looks)) if pair[1].seconds > pair[0].seconds]
    done = sum(after.done - before.done for before, after in pairs)
    if not done:
        return ["Too few records were done in this run to tell a rate."]
    each = 1e3 * sum(after.processor_seconds - before.processor_seconds for before, after in pairs) / done
    pace = done / sum(after.seconds - before.seconds for before, after in pairs)
    return [f"The whole series: {each:.0f} ms of processor time a record, {pace:.1f} a second by the clock."]


def _at_work(looks: Sequence[Look]) -> list[Look]:
    """Those after programs were compiled and before the last record was done, when workers end."""
    total = max((look.done for look in looks), default=0)
    return [look for look in looks if WARM * total <= look.done < total]


@dataclass(frozen=True)
class Workers(Engine):
    """Workers beside their parent, also where it is one, that begin together when each has done all the jobs once.

    Parameters
    ----------
    place : str
        Folder in which each says that it has.
    """

    place: str = ""

    def run(self, jobs: Sequence[Job]) -> Generator[Done, None, None]:
        """As of any engine."""
        return in_processes(_together, [(job, jobs, self) for job in jobs], self.processes)


def _together(given: tuple[Job, Sequence[Job], Workers]) -> Outcome:
    job, jobs, workers = given
    mine = Path(workers.place) / str(os.getpid())
    if not mine.exists():
        for one in jobs:
            identified(one)
        mine.touch()
        while len(list(mine.parent.iterdir())) < workers.processes:
            time.sleep(0.01)
    return identified(job)


def of_two_workers(folder: Path, made: Sequence[Made], number: int) -> str:
    """Time by the clock of one worker over that of two, on as many sound records, programs compiled in each of them.

    What the parent does with an item is part of it.
    """
    names = {one.name for one in [one for one in made if not one.damage][:number]}
    jobs = [job for job in jobs_in(folder) if job.name in names]
    clock, spent = dict[int, float](), dict[int, float]()
    for processes in (1, 2):
        seen: list[tuple[float, float]] = []
        look = lambda *_, seen=seen: seen.append((time.perf_counter(), _processor_seconds(os.getpid())))  # noqa: E731
        with TemporaryDirectory() as place, TemporaryDirectory() as warm:
            batch_studies("two workers", jobs, Path(place), Workers(processes, place=warm), look)
        first, last = seen[processes - 1], seen[-1]
        clock[processes], spent[processes] = (
            (b - a) / (len(jobs) - processes) for a, b in zip(first, last, strict=True)
        )
    gain, load = clock[1] / clock[2], os.getloadavg()[0]
    return (
        f"{number} records: {1e3 * clock[1]:.0f} ms each by one worker, {1e3 * clock[2]:.0f} ms by two, {gain:.2f} "
        f"times as many (asked for: {GOAL_OF_TWO}); processor time of each {1e3 * spent[1]:.0f} and "
        f"{1e3 * spent[2]:.0f} ms; load {load:.1f} on {os.cpu_count()} cores."
    )


def _processor_seconds(parent: int) -> float:
    """Of a process and all that it has begun and that goes on."""
    return sum(_ticks(pid) for pid in _children(parent)) / os.sysconf("SC_CLK_TCK")


def _of_damages(folder: Path, made: Sequence[Made]) -> list[str]:
    """Each damaged record, asked by itself."""
    jobs = {job.name: job for job in jobs_in(folder)}
    rows = []
    for kind, (_, word) in DAMAGES.items():
        said = [_asked(jobs[one.name]) for one in made if one.damage == kind]
        right = Share.of(said, lambda words, word=word: word in words[1] and words[0] != "ok")
        rows.append((kind, len(said), ", ".join(sorted({words[0] for words in said})), right))
    return Table.of(("damage", "records", "status", "for the right reason"), rows).lines()


def _asked(job: Job) -> tuple[str, str]:
    """Status of a record, and all that stands against it."""
    try:
        summary = json.loads(identified(job).summary)
    except FibrefitError as error:
        return "refused", str(error)
    failed = [f"{check['identifier']} {check['says']}" for check in summary["checks"] if not check["passed"]]
    return summary["status"], " ".join(failed)


def _of_memory(looks: Sequence[Look]) -> list[str]:
    heads = ("records done", "largest worker, MB", "parent, MB", "processor time a record since the row above", "load")
    if not looks:
        return []
    kept = [looks[i] for i in np.unique(np.linspace(0, len(looks) - 1, 12).astype(int))]
    rows = []
    for before, after in zip([None, *kept], kept, strict=False):
        fresh = before is not None and after.processor_seconds > before.processor_seconds and after.done > before.done
        each = (
            (after.processor_seconds - before.processor_seconds) / (after.done - before.done)
            if fresh and before
            else math.nan
        )
        sizes = (f"{size:.0f}" if size else "" for size in (after.megabytes, after.parent))
        rows.append((after.done, *sizes, f"{1e3 * each:.0f} ms", f"{after.load:.1f}"))
    return [*Table.of(heads, rows).lines(), "", *_grown(looks)]


def _grown(looks: Sequence[Look]) -> list[str]:
    """By how much memory grew once programs were compiled, and what the parent takes for the tables at the end."""
    said = []
    for name, size in (("a worker", "megabytes"), ("the parent", "parent")):
        warm = [(look.done, getattr(look, size)) for look in _at_work(looks) if getattr(look, size)]
        if len(warm) > 1 and warm[-1][0] > warm[0][0]:
            each = 1e3 * (warm[-1][1] - warm[0][1]) / (warm[-1][0] - warm[0][0])
            said.append(
                f"Memory of {name} at the end over that at a quarter: {warm[-1][1] / warm[0][1]:.3f} (asked for: at "
                f"most {GOAL_OF_MEMORY}), {each:.1f} kB a record."
            )
    largest = max(look.parent for look in looks)
    return [*said, f"The most the parent took, tables at the end included: {largest:.0f} MB."] if largest else said


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.validation.validate_batch", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--records", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=math.inf, help="after which the batch is interrupted")
    parser.add_argument("--workers", type=int, default=0, help="records that one process and two do in turn")
    given = parser.parse_args()
    # As in a worker: JAX reads it where it first runs a program.
    os.environ.setdefault("NPROC", "1")
    made = known(given.folder) or make(given.folder, given.records, given.seed)
    file = given.folder / "looks.json"
    looks = [Look(**row) for row in json.loads(file.read_text(encoding="utf-8"))] if file.is_file() else []
    if given.seconds > 0.0 and not (given.folder / "out" / "results.csv").is_file():
        looks += go_on(given.folder, given.jobs, given.seconds)
        file.write_text(json.dumps([asdict(look) for look in looks]), encoding="utf-8")
    print("\n".join(report(given.folder, made, looks)), flush=True)
    if given.workers:
        print("\n" + of_two_workers(given.folder, made, given.workers), flush=True)


if __name__ == "__main__":
    main()
