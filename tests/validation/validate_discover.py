"""Hides effects in data of an independent simulator and counts how often the search finds them.

``python -m tests.validation.validate_discover --cases 20`` goes on where an earlier run ended: every case is written to
a table as soon as it is done. The tables are printed and written to ``docs/discovery.md``.
"""

from __future__ import annotations

import argparse
import csv
import math
import multiprocessing
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, fields
from datetime import UTC, datetime
from pathlib import Path

from tests.validation.discover_cases import KINDS, Case, all_cases
from tests.validation.discover_scores import RIGS, Outcome, by_effect, confusions, misses, rates, times

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "results" / "validate_discover" / "cases.csv"
DOCUMENT = ROOT / "docs" / "discovery.md"
PROCESSES = 2
LIFETIME = 12
"""Cases after which a process is replaced: compiled programs pile up in it."""

METHOD = """\
Each case is a series of five records made by a simulator that shares no code and no numerical choice with the program:
fixed steps of some microseconds, friction as a projection of the velocity, a logger with noise, hum and resolution. In
half of the cases as much of the noise is pink as white, in the other half all of it is white. The strength of an effect
is set by the gap it leaves to the best base model. Where nothing is hidden, the base parameters differ by 0.5 % from
record to record. Cases that showed a fault of the search were run again once it was mended, and the others keep the
outcome of the state of the search they were run with: until every case has been run anew, the shares flatter a little.
Four of the fifty nulls of the drive rig had an effect named (a drift, a rate-dependent stiffness, a hysteresis, a
hardening) until what misled the search was mended; the table holds what it says of them now.

The clean gap of a drive series is that under the true motion of the drive. The search knows it by a reading with noise,
and an error of the drive within that noise may take up most of the gap: what the base fit leaves (`gap before`), beside
the 0.95 to 1 of a perfect model, tells what there was to be found."""
A_CLASS = """\
A class holds effects that records of the usual kind cannot separate, such as a delay and a lag of the force gauge, and
what the search itself said it could not tell apart."""


def carry_out(case: Case) -> Outcome:
    """Make the series of a case and search it; an error is an outcome too."""
    began, worked = time.perf_counter(), time.process_time()
    facts = {"case": case.name, "kind": case.kind, "rig": case.rig, "pink": case.pink, "scatter": case.scatter}
    nothing = {"verdict": "error", "added": "", "alike": "", "says": ""}
    numbers = dict.fromkeys(("base_gap", "gap_before", "gap_after", "held_out"), math.nan)
    facts |= {**nothing, **numbers, "hidden": " + ".join(case.hidden)}
    try:
        facts |= _searched(case)
    except Exception as error:
        facts["says"] = f"{type(error).__name__}: {error}"
    took, processor = time.perf_counter() - began, time.process_time() - worked
    return Outcome(**facts, seconds=took, processor_seconds=processor)


def _searched(case: Case) -> dict[str, object]:
    import fibrefit

    with tempfile.TemporaryDirectory() as folder:
        base_gap, hidden = case.make(Path(folder))
        found = fibrefit.discover(fibrefit.load_study(folder))
        finding, summary = found.finding, found.summary()
    assert summary.before is not None
    return {
        "hidden": " + ".join(hidden),
        "base_gap": base_gap,
        "verdict": found.verdict,
        "added": " + ".join(found.added),
        "alike": " + ".join(dict.fromkeys(name for names in finding.cannot_tell_apart for name in names)),
        "gap_before": summary.before.gap.total,
        "gap_after": summary.gap.total,
        "expected_gap": finding.after.expected_gap,
        "held_out": max((held.gap_after for held in finding.held_out), default=math.nan),
        "says": finding.unexplained.looks_like or finding.reason,
    }


def done_before(table: Path) -> list[Outcome]:
    """Outcomes of earlier runs."""
    if not table.is_file():
        return []
    kinds = {field.name: field.type for field in fields(Outcome)}
    with table.open(newline="", encoding="utf-8") as file:
        return [
            Outcome(**{key: float(text) if kinds[key] == "float" else text for key, text in row.items()})
            for row in csv.DictReader(file)
        ]


def _write(table: Path, outcomes: Sequence[Outcome]) -> None:
    """All outcomes anew, with every column there is now."""
    whole = table.with_suffix(".new")
    with whole.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Outcome)])
        writer.writeheader()
        writer.writerows(map(asdict, outcomes))
    whole.replace(table)


def run(cases: Sequence[Case], table: Path, processes: int) -> None:
    """Carry out cases side by side; each is written down as soon as it is done."""
    table.parent.mkdir(parents=True, exist_ok=True)
    _write(table, done_before(table))
    context = multiprocessing.get_context("spawn")
    some = LIFETIME * processes
    with table.open("a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Outcome)])
        for first in range(0, len(cases), some):
            # Processes are made anew: a pool that is to replace its own one by one may wait for them for ever.
            with ProcessPoolExecutor(processes, mp_context=context) as pool:
                waiting = [pool.submit(carry_out, case) for case in cases[first : first + some]]
                for number, future in enumerate(as_completed(waiting), first + 1):
                    outcome = future.result()
                    writer.writerow(asdict(outcome))
                    file.flush()
                    said = outcome.added or outcome.says
                    print(
                        f"[{number}/{len(cases)}] {outcome.case}: {outcome.verdict} {said} ({outcome.seconds:.0f} s)",
                        flush=True,
                    )


def document(outcomes: Sequence[Outcome], planned: int) -> str:
    """The tables, with their date."""
    number = {kind: sum(outcome.kind == kind for outcome in outcomes) for kind in KINDS}
    return "\n".join(
        [
            "# How well the search for missing effects does",
            "",
            f"{datetime.now(UTC):%Y-%m-%d}: {len(outcomes)} of {planned} cases. {times(outcomes)}",
            "",
            METHOD,
            "",
            f"Cases so far: {number['single']} with one effect, {number['pair']} with two, {number['outside']} with "
            f"one that is not in the catalogue, {number['null']} with none.",
            "`make validate-discover` goes on with the rest.",
            "",
            f"| | share | 95 % interval | {' | '.join(RIGS)} | held to |",
            "|---|---|---|---|---|---|",
            *map(str, rates(outcomes)),
            "",
            A_CLASS,
            "",
            "## By effect",
            "",
            "`gap closed`: of the squared gap beyond noise, median of the cases named exactly.",
            "",
            *by_effect(outcomes),
            "",
            "## What was taken for what",
            "",
            *(confusions(outcomes) or ["Nothing yet."]),
            "",
            *misses(outcomes),
            "",
        ]
    )


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.validation.validate_discover", description=__doc__)
    parser.add_argument("--cases", type=int, help="number of further cases; all that are left if not given")
    parser.add_argument("--kind", choices=KINDS, help="only cases of this kind")
    parser.add_argument("--rig", help="only cases of this rig")
    parser.add_argument("--table", type=Path, default=TABLE, help="where the cases are written down")
    parser.add_argument("--document", type=Path, default=DOCUMENT, help="where the tables are written")
    parser.add_argument("--processes", type=int, default=PROCESSES)
    given = parser.parse_args()
    planned = all_cases()
    known = {outcome.case for outcome in done_before(given.table)}
    left = [
        case
        for case in planned
        if case.name not in known and given.kind in (None, case.kind) and given.rig in (None, case.rig)
    ]
    run(left[: given.cases], given.table, given.processes)
    text = document(done_before(given.table), len(planned))
    given.document.parent.mkdir(parents=True, exist_ok=True)
    given.document.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
