"""Asks series of an independent simulator whether a parameter depends on speed, and counts what is found and made up.

``python -m tests.validation.validate_speed_laws --release LABEL --rig pulley_drive --with 15 --without 30`` asks so
many further series of a rig, writes each down as soon as it is done, and prints the tables.
"""

from __future__ import annotations

import argparse
import itertools
import math
from collections.abc import Sequence
from pathlib import Path

from tests.validation.cases import RIGS
from tests.validation.speed_laws import STRENGTHS, Asked, SpeedCase, ask, speed_cases
from tests.validation.tables import ROOT, Share, Table, append, median, read, revision
from tests.validation.workers import carried_out

RESULTS = ROOT / "results" / "validate_speed_laws"
LIMIT = 900.0


def tables(rows: Sequence[Asked]) -> list[str]:
    """What was found where there is a law, and made up where there is none; and each that went wrong."""
    lines = []
    for rig in RIGS:
        for parameter in (*STRENGTHS, ""):
            group = [row for row in rows if (row.rig, row.parameter) == (rig, parameter)]
            if not group:
                continue
            hits = [Share.of(group, lambda row: row.found), Share.of(group, lambda row: row.among)]
            shown = [*hits, "-"] if parameter else ["-", "-", Share.of(group, lambda row: row.made_up)]
            seconds = f"{median(row.processor_seconds for row in group):.0f}"
            lines.append([rig, parameter or "none", len(group), *shown, seconds])
    heads = ["rig", "law of", "series", "found alone", "found, maybe with another", "made up", "s of processor, median"]
    wrong = [row for row in rows if not (row.found if row.parameter else not row.made_up)]
    return [
        *Table.of(heads, lines).lines(),
        "",
        *Table.of(
            ["went wrong", "exponent", "answer", "laws", "ln Bayes of law, own", "foresight"],
            (
                [
                    row.case,
                    f"{row.exponent:.3f}",
                    row.answer,
                    row.laws or row.says[:80],
                    f"{row.log_law:.1f}, {row.log_own:.1f}",
                    f"{row.foresight:.1f}",
                ]
                for row in wrong
            ),
        ).lines(),
    ]


def chosen(given: argparse.Namespace, rows: Sequence[Asked]) -> list[SpeedCase]:
    """Further series of each rig, those with a law and those without in turn."""
    known, found = {row.case for row in rows}, []
    for rig in given.rig or RIGS:
        for lawful, number in ((True, given.lawful), (False, given.lawless)):
            fresh = (case for case in speed_cases(given.release, rig, lawful=lawful) if case.name not in known)
            found.append(list(itertools.islice(fresh, number)))
    turns = itertools.zip_longest(*found)
    return [case for turn in turns for case in turn if case is not None]


def run(jobs: Sequence[SpeedCase], path: Path, processes: int) -> None:
    """Ask series side by side; each is written down as soon as it is done."""
    for number, done in enumerate(carried_out(ask, jobs, processes, LIMIT), 1):
        row = done.result or _late(done.job, done.seconds)
        append(path, row, "case")
        print(
            f"[{number}/{len(jobs)}] {row.case} ({row.exponent:.3f}): {row.answer} {row.laws} {row.log_law:.1f}, "
            f"left out {row.foresight:.1f} ({row.processor_seconds:.0f} s)",
            flush=True,
        )


def _late(case: SpeedCase, seconds: float) -> Asked:
    blank = [math.nan] * 7
    said = f"ended after {seconds:.0f} s"
    return Asked(case.name, case.rig, case.parameter, math.nan, "too long", "", *blank, revision(), said)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.validation.validate_speed_laws", description=__doc__)
    parser.add_argument("--release", required=True, help="label; another one draws other series")
    parser.add_argument("--rig", action="append", choices=RIGS, help="may be given twice; both if not given")
    parser.add_argument("--with", dest="lawful", type=int, default=0, help="further series of each rig with a law")
    parser.add_argument("--without", dest="lawless", type=int, default=0, help="further series of each rig without")
    parser.add_argument("--processes", type=int, default=1)
    given = parser.parse_args()
    path = RESULTS / f"{given.release}.csv"
    run(chosen(given, read(path, Asked)), path, given.processes)
    print("\n".join(tables(read(path, Asked))))


if __name__ == "__main__":
    main()
