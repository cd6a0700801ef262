"""Identifies some thousand records as ``fibrefit batch`` does, and counts what became of them.

``python -m tests.validation.validate_batch FOLDER --records 2000 --seconds 500`` makes the series if it is not there,
goes on with the batch for so long, and prints tables of all that is done; said again, it goes on. In the same run some
records are fitted with SciPy, which ends in the same minimum or in another, and some are identified by one process and
by two in turn. Memory is that of the largest worker, read while they work. Damaged records are asked once more by
themselves: what is refused leaves nothing on disk. ``make bench-series`` is this for 2 000 records.
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
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from fibrefit.core.errors import FibrefitError
from fibrefit.study import load_study
from fibrefit.study.summaries.summaries import BatchItem
from fibrefit.workflow.batches.batch import Engine
from fibrefit.workflow.batches.item import Job, identified
from fibrefit.workflow.batches.jobs import jobs_of, origins_of
from tests.validation.many_records import DAMAGES, Made, known, make
from tests.validation.tables import ROOT, Share, table

Z_95 = 1.959964
NAMES = ("stiffness", "damping", "friction")
LOOK_SECONDS = 5.0
STARTS = 32
COMPARED = 10
"""Records that SciPy fits too, spread over those that are done."""
GOAL, GOAL_OF_TWO, GOAL_OF_MEMORY = 50.0, 1.8, 1.05
"""Asked for: SciPy's time over ours for a record, time of one process over that of two, memory over what it was once
programs were compiled."""
WARM = 0.25
"""Share of the records after which programs are compiled and memory has grown to what it needs."""
SAME = 0.1
"""Difference from SciPy's values in standard errors up to which it is the same answer."""


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
    """

    done: int
    seconds: float
    processor_seconds: float
    megabytes: float
    load: float


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
    ticks = sum(_ticks(pid) for pid in [parent, *workers]) / os.sysconf("SC_CLK_TCK")
    return Look(done, seconds, ticks, max(sizes, default=0.0), os.getloadavg()[0])


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
    from fibrefit.plots import file_names

    names = [one.name for one in known(folder)]
    of_folder, found = dict(zip(file_names(names), names, strict=True)), {}
    for place in folder.glob("out*/items/*/item.json"):
        content = json.loads(place.read_text(encoding="utf-8"))
        found[of_folder[place.parent.name]] = BatchItem.model_validate(content["item"], strict=False)
    return found


@dataclass(frozen=True)
class Rival:
    """What SciPy made of a record.

    Parameters
    ----------
    first, whole : float
        Processor time in s of the start that our search begins with, and of all until one ended where ours did.
    same_at_once, same : bool
        Whether the first, and any of them, did.
    starts : int
    """

    first: float
    whole: float
    same_at_once: bool
    same: bool
    starts: int


def with_scipy(folder: Path, names: Sequence[str], items: Mapping[str, BatchItem]) -> list[Rival]:
    """What SciPy makes of some records: from one start, and from as many of ours as it needs for the same answer."""
    from tests.benchmarks import rivals
    from tests.benchmarks.problem import fit_of, in_their_order

    # isort: split
    from fibrefit.fitting.search.multistart import sobol_starts
    from fibrefit.workflow.prepare import task_of

    study = load_study(folder, some_missing=True)
    places = {record.label: record for record in study.records}
    found = []
    for name in names:
        task = task_of(study.model_copy(update={"records": (places[name],)}))
        fit, ours = fit_of(task), [items[name].parameters[n] for n in NAMES]
        # Plain least squares is what SciPy does too.
        plain = [(one.plain_value or one.value, one.plain_error or one.std_error) for one in ours]
        times, same = [], []
        for start in sobol_starts(task.problem.layout, task.start, task.spread, STARTS, 0):
            began = time.process_time()
            values = rivals.fit_scipy(fit._replace(start=in_their_order(task, start)))
            times.append(time.process_time() - began)
            apart = [abs(there - here) / error for there, (here, error) in zip(values, plain, strict=False)]
            same.append(max(apart) < SAME)
            if same[-1]:
                break
        found.append(Rival(times[0], sum(times), same[0], same[-1], len(times)))
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
    lines += table(("parameter", "interval of 95 % holds the truth", "largest error, standard errors"), held)
    lines += ["", *_of_damages(folder, made)]
    if not sound:
        return lines
    compared = with_scipy(folder, [one.name for one in sound][:: max(len(sound) // COMPARED, 1)][:COMPARED], items)
    return [*lines, "", *_of_rival(compared), "", *_of_speed(looks, compared), "", *_of_memory(looks)]


def _of_rival(compared: Sequence[Rival]) -> list[str]:
    first, whole = (1e3 * float(np.mean([getattr(one, name) for one in compared])) for name in ("first", "whole"))
    at_once, same = (Share.of(compared, lambda one, name=name: getattr(one, name)) for name in ("same_at_once", "same"))
    return [
        f"SciPy, no error bars: one start {first:.0f} ms a record, in our minimum in {at_once}; until it is there "
        f"{whole:.0f} ms, {max(one.starts for one in compared)} starts at the most, in {same}."
    ]


def _of_speed(looks: Sequence[Look], compared: Sequence[Rival]) -> list[str]:
    """Processor time of a record once programs are compiled, beside that of SciPy."""
    # Another piece of the batch begins its count of seconds anew.
    pairs = [pair for pair in pairwise(_at_work(looks)) if pair[1].seconds > pair[0].seconds]
    done = sum(after.done - before.done for before, after in pairs)
    if not done:
        return ["Too few records were done in this run to tell a rate."]
    each = 1e3 * sum(after.processor_seconds - before.processor_seconds for before, after in pairs) / done
    pace = done / sum(after.seconds - before.seconds for before, after in pairs)
    once, same = (1e3 * float(np.mean([getattr(one, name) for one in compared])) / each for name in ("first", "whole"))
    return [
        f"`fibrefit batch`: {each:.0f} ms of processor time a record, {1e3 / each:.1f} records a second and core, "
        f"{pace:.1f} a second by the clock; {same:.1f} times SciPy's per core until it has the same answer (asked for: "
        f"{GOAL:.0f}), {once:.1f} times that of one start, which has another one where it is in another minimum."
    ]


def _at_work(looks: Sequence[Look]) -> list[Look]:
    """Those after programs were compiled and before the last record was done, when workers end."""
    total = max((look.done for look in looks), default=0)
    return [look for look in looks if WARM * total <= look.done < total]


def of_two_workers(folder: Path, made: Sequence[Made], number: int) -> str:
    """Time by the clock of one process over that of two, on as many sound records, without their start."""
    few, times = 12, dict[int, float]()
    names = {one.name for one in [one for one in made if not one.damage][: number + few]}
    jobs = [job for job in jobs_of(origins_of([str(folder)], None, ()), "record", STARTS, 0) if job.name in names]
    for processes in (1, 2):
        done = Engine(processes).run(jobs)
        for _ in range(few):
            next(done)
        began = time.perf_counter()
        rest = sum(1 for _ in done)
        times[processes] = (time.perf_counter() - began) / rest
    gain, load = times[1] / times[2], os.getloadavg()[0]
    return (
        f"{number} records: {1e3 * times[1]:.0f} ms each by one worker, {1e3 * times[2]:.0f} ms by two, {gain:.2f} "
        f"times as many (asked for: {GOAL_OF_TWO}); load {load:.1f} on {os.cpu_count()} cores."
    )


def _of_damages(folder: Path, made: Sequence[Made]) -> list[str]:
    """Each damaged record, asked by itself."""
    jobs = {job.name: job for job in jobs_of(origins_of([str(folder)], None, ()), "record", STARTS, 0)}
    rows = []
    for kind, (_, word) in DAMAGES.items():
        said = [_asked(jobs[one.name]) for one in made if one.damage == kind]
        right = Share.of(said, lambda words, word=word: word in words[1] and words[0] != "ok")
        rows.append((kind, len(said), ", ".join(sorted({words[0] for words in said})), right))
    return table(("damage", "records", "status", "for the right reason"), rows)


def _asked(job: Job) -> tuple[str, str]:
    """Status of a record, and all that stands against it."""
    try:
        summary = json.loads(identified(job).summary)
    except FibrefitError as error:
        return "refused", str(error)
    failed = [f"{check['identifier']} {check['says']}" for check in summary["checks"] if not check["passed"]]
    return summary["status"], " ".join(failed)


def _of_memory(looks: Sequence[Look]) -> list[str]:
    heads = ("records done", "largest worker, MB", "processor time a record since the row above", "load")
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
        rows.append((after.done, f"{after.megabytes:.0f}", f"{1e3 * each:.0f} ms", f"{after.load:.1f}"))
    warm = [look.megabytes for look in _at_work(looks) if look.megabytes]
    if not warm:
        return table(heads, rows)
    grown = f"Memory at the end over that at a quarter: {warm[-1] / warm[0]:.3f} (asked for: at most {GOAL_OF_MEMORY})."
    return [*table(heads, rows), "", grown]


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.validation.validate_batch", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--records", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=math.inf, help="after which the batch is interrupted")
    parser.add_argument("--workers", type=int, default=0, help="records that one process and two do in turn")
    given = parser.parse_args()
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
