"""Hides effects in series of an independent simulator and counts what the search for missing effects says.

``python -m tests.validation.validate_discover --release LABEL --kind null --rig fibre_mass --cases 20`` carries out
twenty further cases of a release, writes each down as soon as it is done, and prints the tables. A case is carried out
once: only another release draws others. ``--document`` writes the tables of all releases that are given into
``journal/tables``; those given by ``--earlier``, which were of other revisions, have a table of shares of their own and
count among the cases one by one.
"""

from __future__ import annotations

import argparse
import itertools
import math
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tests.validation.cases import KINDS, RIGS, STRENGTHS, Case, cases
from tests.validation.designs import NOISES
from tests.validation.scores import Outcome, tables
from tests.validation.tables import JOURNAL, append, printed, read, revision
from tests.validation.workers import carried_out, most_memory

RESULTS = Path(__file__).parent / "outcomes"
"""Kept with the project: an outcome is written down once and stays."""
PROCESSES = 2
LIMIT = 1200.0
"""s a case may take."""
FAR = 10_000
"""Numbers among which cases of one strength or noise are looked for."""


def carry_out(case: Case) -> Outcome:
    """Make the series of a case and search it; an error is an outcome too."""
    facts = _facts(case)
    try:
        with tempfile.TemporaryDirectory() as name:
            folder, began = Path(name), time.perf_counter()
            made = case.write(folder)
            facts["making_seconds"] = time.perf_counter() - began
            facts["hidden"] = " + ".join(made.noncentralities)
            facts["noncentralities"] = " + ".join(f"{value:.1f}" for value in made.noncentralities.values())
            most_memory(since=True)
            began, worked = time.perf_counter(), time.process_time()
            try:
                summary = _searched(folder)
            finally:
                facts["seconds"] = time.perf_counter() - began
                facts["processor_seconds"] = time.process_time() - worked
                facts["memory"] = most_memory()
            facts |= told(summary, tuple(made.noncentralities))
            if math.isfinite(facts["gap_left_out"]):
                facts["gap_of_truth"] = made.gap_of_truth(case.design.step)
    except Exception as error:
        facts["says"] = f"{type(error).__name__}: {error}"
    return Outcome(**facts)


def _facts(case: Case) -> dict[str, Any]:
    """What is known of a case before it is carried out."""
    laws = ("law_port", "law_variable", "law_form")
    words = dict.fromkeys(("hidden", "noncentralities", "added", "alike", "best", "status", "says", *laws), "")
    numbers = ("evidence", "evidence_of_truth", "gap_before", "gap_after", "gap_left_out", "gap_of_truth")
    return {
        "case": case.name,
        **{
            key: getattr(case, key)
            for key in ("release", "kind", "rig", "index", "seed", "noise", "scatter", "strength")
        },
        **words,
        **dict.fromkeys((*numbers, "seconds", "processor_seconds", "making_seconds", "memory"), math.nan),
        "verdict": "error",
        "revision": revision(),
    }


def ended(case: Case, seconds: float) -> Outcome:
    """Outcome of a case that took too long, or whose process died."""
    says = f"its process ended after {seconds:.0f} s"
    return Outcome(**_facts(case) | {"verdict": "too long", "hidden": case.first, "seconds": seconds, "says": says})


def _searched(folder: Path) -> dict[str, Any]:
    """``summary.json`` of the search."""
    import fibrefit

    return fibrefit.discover(fibrefit.load_study(folder)).summary().model_dump(mode="json", by_alias=True)


def told(summary: dict[str, Any], hidden: Sequence[str]) -> dict[str, Any]:
    """What a summary says, for a table.

    Parameters
    ----------
    summary : content of ``summary.json``
    hidden : effects in the series
    """
    rounds = summary.get("rounds") or []
    ranking = rounds[0]["ranking"] if rounds else summary.get("ranking") or []
    order = sorted(ranking, key=lambda row: -row["evidence"])
    true = [row["evidence"] for row in ranking if row["effect"] in hidden]
    unexplained, law = summary.get("unexplained") or {}, summary.get("proposed_law") or {}
    return {
        "verdict": summary["verdict"],
        "added": " + ".join(summary.get("added", ())),
        "alike": " | ".join(" + ".join(group) for group in summary.get("cannot_tell_apart", ())),
        "best": order[0]["effect"] if order else "",
        "evidence": order[0]["evidence"] if order else math.nan,
        "evidence_of_truth": max(true, default=math.nan),
        "gap_before": _number(((summary.get("before") or {}).get("gap") or {}).get("total")),
        "gap_left_out": _number(law.get("gap_left_out")),
        "gap_after": _number((summary.get("gap") or {}).get("total")),
        "status": summary.get("status", ""),
        "says": unexplained.get("looks_like") or summary.get("reason", ""),
        "law_port": law.get("port", "").partition(".")[0],
        "law_variable": next(iter(law.get("variables", ())), ""),
        "law_form": law.get("form", ""),
    }


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def file_of(release: str, tuning: bool) -> Path:
    """Outcomes of a release; those of the tuning set are kept apart."""
    return RESULTS / ("tuning" if tuning else "") / f"{release}.csv"


def chosen(given: argparse.Namespace, done: Sequence[Outcome]) -> list[Case]:
    """Further cases of those that were asked for, kinds and rigs in turn."""
    known = {outcome.case for outcome in done}
    lists = []
    for kind, rig in itertools.product(given.kind or KINDS, given.rig or RIGS):
        fitting = (
            case
            for case in itertools.islice(cases(given.release, kind, rig, tuning=given.tuning), FAR)
            if case.name not in known
            and (given.noise is None or case.noise == given.noise)
            and (given.strength is None or case.strength == given.strength)
        )
        lists.append(fitting)
    turns = (case for turn in itertools.zip_longest(*lists) for case in turn if case is not None)
    return list(itertools.islice(turns, given.cases))


def run(jobs: Sequence[Case], path: Path, processes: int, limit: float) -> None:
    """Carry out cases side by side; each is written down as soon as it is done."""
    for number, done in enumerate(carried_out(carry_out, jobs, processes, limit), 1):
        outcome = done.result or ended(done.job, done.seconds)
        append(path, outcome, "case")
        said = outcome.added or outcome.says
        print(f"[{number}/{len(jobs)}] {outcome.case}: {outcome.verdict} {said} ({outcome.seconds:.0f} s)", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.validation.validate_discover", description=__doc__)
    parser.add_argument(
        "--release", required=True, action="append", help="label; another one draws other cases; several for tables"
    )
    parser.add_argument("--cases", type=int, default=0, help="number of further cases; 0 prints the tables only")
    parser.add_argument("--kind", action="append", choices=KINDS, help="may be given twice; all if not given")
    parser.add_argument("--rig", action="append", choices=RIGS, help="may be given twice; both if not given")
    parser.add_argument("--noise", choices=NOISES, help="only cases with this noise")
    parser.add_argument(
        "--strength", type=float, choices=[*map(float, STRENGTHS)], help="only faint effects as strong as this"
    )
    parser.add_argument("--tuning", action="store_true", help="cases of the tuning set, which never count")
    parser.add_argument("--processes", type=int, default=PROCESSES)
    parser.add_argument("--limit", type=float, default=LIMIT, help="s a case may take")
    parser.add_argument("--document", action="store_true", help="keep the tables in journal/tables")
    parser.add_argument(
        "--earlier", nargs="+", default=[], metavar="LABEL", help="releases of earlier revisions, for further tables"
    )
    given = parser.parse_args()
    labels, given.release = given.release, given.release[0]
    path = file_of(given.release, given.tuning)
    if given.cases:
        if len(labels) > 1:
            parser.error("cases are carried out of one release at a time")
        run(chosen(given, read(path, Outcome)), path, given.processes, given.limit)
    outcomes, earlier = (
        [outcome for label in asked for outcome in read(file_of(label, given.tuning), Outcome)]
        for asked in (labels, given.earlier)
    )
    found = tables(outcomes, earlier)
    print(printed(found))
    if given.document:
        if given.tuning:
            raise SystemExit("the tuning set does not count: its tables are not kept")
        for name, one in found.items():
            one.keep(JOURNAL / f"discovery_{name}.csv")


if __name__ == "__main__":
    main()
