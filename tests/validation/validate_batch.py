"""Identifies some thousand records as ``fibrefit batch`` does, and counts what became of them.

``python -m tests.validation.validate_batch FOLDER --records 2000 --seconds 500`` makes the series if it is not there,
goes on with the batch for so long, and prints the tables once it is done; said again, it goes on. In the same run every
hundredth record is fitted with SciPy, which is to give the same answer. Memory is that of the largest worker, read
while they work.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import os
import resource
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from tests.validation.many_records import DAMAGES, Made, known, make
from tests.validation.tables import ROOT, Share, table

Z_95 = 1.959964
NAMES = ("stiffness", "damping", "friction")
LOOK_SECONDS = 5.0
SCIPY_EVERY = 100
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
                process.send_signal(signal.SIGINT)
                process.wait()
    return looks


def _look(folder: Path, parent: int, seconds: float) -> Look:
    done = sum(1 for place in folder.glob("out*/items/*/item.json")) + sum(
        1 for place in folder.glob("out*.partial/items/*/item.json")
    )
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


def with_scipy(folder: Path, made: Sequence[Made], rows: dict[str, dict[str, str]]) -> list[tuple[str, float, float]]:
    """Of every hundredth record its name, SciPy's time in s, and its largest distance from ours in standard errors."""
    from tests.benchmarks import rivals
    from tests.benchmarks.problem import fit_of

    # isort: split
    from fibrefit.study import load_study
    from fibrefit.workflow.prepare import task_of

    study = load_study(folder, some_missing=True)
    found = []
    for n in range(0, len(made), SCIPY_EVERY):
        one = study.model_copy(update={"records": (study.records[n],)})
        fit = fit_of(task_of(one))
        began = _processor_time()
        values = rivals.fit_scipy(fit)
        took, row = _processor_time() - began, rows[made[n].name]
        errors = [
            abs(values[i] - _number(row, f"{name}")) / _number(row, f"{name} std_error") for i, name in enumerate(NAMES)
        ]
        found.append((made[n].name, took, max(errors)))
    return found


def _processor_time() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def _number(row: dict[str, str], name: str) -> float:
    return next((float(cell) for head, cell in row.items() if head.partition(" [")[0] == name and cell), math.nan)


def results_of(folder: Path) -> dict[str, dict[str, str]]:
    """Rows of ``results.csv`` by the name of the record."""
    with (folder / "out" / "results.csv").open(encoding="utf-8", newline="") as stream:
        return {row["item"]: row for row in csv.DictReader(stream)}


def report(folder: Path, made: Sequence[Made], looks: Sequence[Look]) -> list[str]:
    """Lines of what became of the records, of time and of memory."""
    rows = results_of(folder)
    sound = [one for one in made if not one.damage]
    status = Counter(rows[one.name]["status"] for one in sound)
    lines = [f"{len(sound)} sound records: " + ", ".join(f"{n} {kind}" for kind, n in status.most_common())]
    heads = ("parameter", "interval of 95 % holds the truth", "largest error, standard errors")
    held = []
    for name in NAMES:
        scores = np.array(
            [
                (_number(rows[m.name], name) - getattr(m.truth, name)) / _number(rows[m.name], f"{name} std_error")
                for m in sound
            ]
        )
        scores = scores[np.isfinite(scores)]
        share = Share(int(np.sum(np.abs(scores) <= Z_95)), len(scores))
        held.append((name, share, f"{np.max(np.abs(scores)):.1f}"))
    lines += ["", *table(heads, held), ""]
    heads = ("damage", "records", "status", "refused or doubted for the right reason")
    lines += table(heads, [_of_damage(folder, kind, made, rows) for kind in DAMAGES])
    return [*lines, "", *_of_memory(looks)]


def _of_damage(
    folder: Path, kind: str, made: Sequence[Made], rows: dict[str, dict[str, str]]
) -> tuple[str, int, str, Share]:
    mine = [rows[one.name] for one in made if one.damage == kind]
    return (
        kind,
        len(mine),
        ", ".join(sorted({row["status"] for row in mine})),
        Share.of(mine, lambda row: _right(folder, kind, row)),
    )


def _right(folder: Path, kind: str, row: dict[str, str]) -> bool:
    said = row["error"]
    if row["result"]:
        summary = json.loads((folder / "out" / row["result"] / "summary.json").read_text(encoding="utf-8"))
        said = " ".join(f"{check['identifier']} {check['says']}" for check in summary["checks"] if not check["passed"])
    return row["status"] != "ok" and DAMAGES[kind][1] in said


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
    return table(heads, rows)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.validation.validate_batch", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--records", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=math.inf, help="after which the batch is interrupted")
    given = parser.parse_args()
    made = known(given.folder) or make(given.folder, given.records, given.seed)
    file = given.folder / "looks.json"
    looks = [Look(**row) for row in json.loads(file.read_text())] if file.is_file() else []
    if not (given.folder / "out" / "results.csv").is_file():
        looks += go_on(given.folder, given.jobs, given.seconds)
        file.write_text(json.dumps([asdict(look) for look in looks]), encoding="utf-8")
    if (given.folder / "out" / "results.csv").is_file():
        print("\n".join(report(given.folder, made, looks)), flush=True)
        compared = with_scipy(given.folder, made, results_of(given.folder))
        same = Share.of(compared, lambda row: row[2] < SAME)
        mean = float(np.mean([row[1] for row in compared]))
        print(f"\nSciPy, one start each: {1e3 * mean:.0f} ms a record; the same answer in {same}")
    else:
        print(f"{looks[-1].done} of {len(made)} done", flush=True)


if __name__ == "__main__":
    main()
