"""Fits series of an independent simulator and counts how often the 95 % intervals hold the truth.

``python -m tests.validation.validate_intervals --release LABEL --rig fibre_mass --noise slow --scatter 0.005
--series 20`` fits twenty further series of a release, writes each down as soon as it is done, and prints the tables.
The truth is the mean of the population: the base parameters about which those of the records scatter. The same
values with error bars that take the noise for white are the negative control. ``--document`` keeps the table
in ``journal/tables``.
"""

from __future__ import annotations

import argparse
import itertools
import math
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.independent.simulate import Base
from tests.validation.cases import RIGS, Case, interval_cases
from tests.validation.designs import NOISES_OF_INTERVALS, SCATTERS_OF_INTERVALS
from tests.validation.tables import JOURNAL, Share, Table, append, median, read, revision
from tests.validation.workers import carried_out

RESULTS = Path(__file__).parent / "outcomes" / "intervals"
PROCESSES = 2
LIMIT = 600.0
Z_95 = 1.959964
UNITS = {"stiffness": "N/m", "damping": "N s/m", "friction": "N"}


@dataclass(frozen=True)
class Fitted:
    """What became of one series and one parameter; a row of the file of a release.

    Parameters
    ----------
    key : name of the series and of the parameter
    case, release, rig, index, seed, noise, scatter : of the series
    parameter : of the fit
    truth, value, low, high, std_error : of the parameter, SI; the truth is the mean of the population
    white : standard error if noise had no memory; nan where it is not told
    status : of the fit, "error" or "too long"
    failed : names of the checks that did not pass, joined by " + "
    seconds, processor_seconds : of the fit
    revision : of the program
    says : the error
    """

    key: str
    case: str
    release: str
    rig: str
    index: int
    seed: int
    noise: str
    scatter: float
    parameter: str
    truth: float
    value: float
    low: float
    high: float
    std_error: float
    white: float
    status: str
    failed: str
    seconds: float
    processor_seconds: float
    revision: str
    says: str

    @property
    def holds(self) -> bool:
        """Whether the interval holds the truth; one that is not there does not."""
        return self.low <= self.truth <= self.high

    @property
    def white_holds(self) -> bool:
        """Whether that for noise without memory would."""
        return abs(self.value - self.truth) <= Z_95 * self.white

    @property
    def score(self) -> float:
        """Error over standard error."""
        return (self.value - self.truth) / self.std_error


def carry_out(case: Case) -> list[Fitted]:
    """Make a series and fit it; an error is an outcome too."""
    facts: dict[str, Any] = {
        "status": "error",
        "failed": "",
        "seconds": math.nan,
        "processor_seconds": math.nan,
        "says": "",
    }
    parameters: dict[str, Any] = {}
    truth = Base(*[math.nan] * 3)
    try:
        with tempfile.TemporaryDirectory() as name:
            truth = case.write(Path(name)).series.base
            began, worked = time.perf_counter(), time.process_time()
            try:
                summary = _fitted(Path(name))
            finally:
                facts["seconds"] = time.perf_counter() - began
                facts["processor_seconds"] = time.process_time() - worked
        parameters, facts["status"] = summary["parameters"], summary["status"]
        facts["failed"] = " + ".join(check["name"] for check in summary["checks"] if not check["passed"])
    except Exception as error:
        facts["says"] = f"{type(error).__name__}: {error}"
    return rows_of(case, truth, parameters, facts)


def rows_of(case: Case, truth: Base, parameters: dict[str, Any], facts: dict[str, Any]) -> list[Fitted]:
    """A row for each parameter."""
    rows = []
    for name, unit in UNITS.items():
        found = parameters.get(name) or {"value": math.nan, "unit": unit}
        if found["unit"] != unit:
            raise ValueError(f"{name}: expected {unit}, got {found['unit']}")
        low, high = found.get("interval_95") or (math.nan, math.nan)
        numbers = {"value": found["value"], "std_error": found.get("std_error")}
        numbers["white"] = (found.get("std_errors") or {}).get("white")
        rows.append(
            Fitted(
                key=f"{case.name}/{name}",
                case=case.name,
                **{key: getattr(case, key) for key in ("release", "rig", "index", "seed", "noise", "scatter")},
                parameter=name,
                truth=getattr(truth, name),
                low=low,
                high=high,
                **{key: math.nan if value is None else value for key, value in numbers.items()},
                **facts,
                revision=revision(),
            )
        )
    return rows


def _fitted(folder: Path) -> dict[str, Any]:
    import fibrefit

    return fibrefit.fit(fibrefit.load_study(folder)).summary().model_dump(mode="json", by_alias=True)


def coverage(rows: Sequence[Fitted]) -> Table:
    """By release, rig, noise and scatter: shares of intervals with the truth, rms of the scores, statuses, times."""
    lines = []
    for rig, noise, scatter in itertools.product(RIGS, NOISES_OF_INTERVALS, SCATTERS_OF_INTERVALS):
        group = [row for row in rows if (row.rig, row.noise, row.scatter) == (rig, noise, scatter)]
        if not group:
            continue
        by_name = {name: [row for row in group if row.parameter == name] for name in UNITS}
        series = by_name["stiffness"]
        lines.append(
            [
                rig,
                noise,
                f"{100 * scatter:g} %",
                *(f"{Share.of(mine, lambda row: row.holds)}, {_rms(mine):.2f}" for mine in by_name.values()),
                f"{100 * sum(row.white_holds for row in group) / len(group):.0f} %",
                Share.of(series, lambda row: row.status != "ok"),
                f"{median(row.seconds for row in series):.0f}",
            ]
        )
    heads = ["rig", "noise", "scatter", *(f"{name}, rms of error / standard error" for name in UNITS)]
    return Table.of([*heads, "all, error bars for white noise", "not ok", "s by the clock, median"], lines)


def _rms(rows: Sequence[Fitted]) -> float:
    scores = [row.score**2 for row in rows if math.isfinite(row.score)]
    return math.sqrt(sum(scores) / len(scores)) if scores else math.nan


def file_of(release: str, tuning: bool) -> Path:
    """Outcomes of a release; those of the tuning set are kept apart."""
    return RESULTS / ("tuning" if tuning else "") / f"{release}.csv"


def chosen(release: str, given: argparse.Namespace, rows: Sequence[Fitted]) -> list[Case]:
    """Further series of each combination asked for, in turn."""
    known = {row.case for row in rows}
    lists = []
    for combination in itertools.product(
        given.rig or RIGS, given.noise or NOISES_OF_INTERVALS, given.scatter or SCATTERS_OF_INTERVALS
    ):
        fresh = (case for case in interval_cases(release, *combination, tuning=given.tuning) if case.name not in known)
        lists.append(list(itertools.islice(fresh, given.series)))
    return [case for turn in zip(*lists, strict=True) for case in turn]


def run(jobs: Sequence[Case], path: Path, processes: int, limit: float) -> None:
    """Fit series side by side; each is written down as soon as it is done."""
    for number, done in enumerate(carried_out(carry_out, jobs, processes, limit), 1):
        late = {"status": "too long", "failed": "", "seconds": done.seconds, "processor_seconds": math.nan}
        rows = done.result or rows_of(done.job, Base(*[math.nan] * 3), {}, {**late, "says": "its process was ended"})
        for row in rows:
            append(path, row, "key")
        scores = ", ".join(f"{row.parameter} {row.score:+.1f}" for row in rows)
        print(
            f"[{number}/{len(jobs)}] {done.job.name}: {rows[0].status}, {scores} ({rows[0].seconds:.0f} s)", flush=True
        )


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.validation.validate_intervals", description=__doc__)
    parser.add_argument(
        "--release",
        required=True,
        action="append",
        help="label; another one draws other series; several for the tables",
    )
    parser.add_argument(
        "--series", type=int, default=0, help="further series of each combination; 0 prints the tables only"
    )
    parser.add_argument("--rig", action="append", choices=RIGS, help="may be given twice; both if not given")
    parser.add_argument(
        "--noise", action="append", choices=NOISES_OF_INTERVALS, help="may be given several times; all if not given"
    )
    parser.add_argument(
        "--scatter",
        action="append",
        type=float,
        choices=SCATTERS_OF_INTERVALS,
        help="between records; may be given several times; all if not given",
    )
    parser.add_argument("--tuning", action="store_true", help="series of the tuning set, which never count")
    parser.add_argument("--processes", type=int, default=PROCESSES)
    parser.add_argument("--limit", type=float, default=LIMIT, help="s a fit may take")
    parser.add_argument("--document", action="store_true", help="keep the table in journal/tables")
    given = parser.parse_args()
    release, *others = given.release
    if others and given.series:
        parser.error("series are fitted of one release at a time")
    path = file_of(release, given.tuning)
    if given.series:
        run(chosen(release, given, read(path, Fitted)), path, given.processes, given.limit)
    found = coverage([row for label in given.release for row in read(file_of(label, given.tuning), Fitted)])
    print("\n".join(found.lines()))
    if given.document:
        if given.tuning:
            raise SystemExit("the tuning set does not count: its table is not kept")
        found.keep(JOURNAL / "intervals.csv")


if __name__ == "__main__":
    main()
