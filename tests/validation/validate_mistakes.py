"""Makes series whose study states something wrong and counts how often the search says what.

``python -m tests.validation.validate_mistakes --release LABEL --mistake clock --cases 20`` carries out twenty further
series, both rigs in turn, and prints the table. A series is carried out once. ``--document`` keeps the table in
``journal/tables``.
"""

from __future__ import annotations

import argparse
import itertools
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.validation.cases import RIGS
from tests.validation.mistakes import MISTAKES, Mistaken, mistakes
from tests.validation.tables import JOURNAL, Share, Table, append, median, read, revision
from tests.validation.validate_discover import FAR, LIMIT, told
from tests.validation.workers import carried_out

RESULTS = Path(__file__).parent / "outcomes" / "mistakes"
HELD_TO = ">= 90 %"


@dataclass(frozen=True)
class Told:
    """What became of one series; a row of the file of a release.

    Parameters
    ----------
    case : name
    release, mistake, rig, index, noise, scatter : of it
    expected : name, or start of it, that the search has to give
    verdict : of the search; "refused" where it ended with a message, "too long"
    added : effects, joined by " + "
    alike : groups that are not told apart
    seconds : of the search, compilation included
    revision : of the program
    says : what is told, or the message
    right : whether the mistake was named and nothing else
    """

    case: str
    release: str
    mistake: str
    rig: str
    index: int
    noise: str
    scatter: float
    expected: str
    verdict: str
    added: str
    alike: str
    seconds: float
    revision: str
    says: str
    right: bool


def carry_out(case: Mistaken) -> Told:
    """Make a series and search it."""
    with tempfile.TemporaryDirectory() as name:
        odd = case.write(Path(name))
        began = time.perf_counter()
        expected = _expected(case, odd)
        verdict, added, alike, says = _searched(Path(name))
    right = case.told in says if case.told else added == expected
    found = {"verdict": verdict, "added": added, "alike": alike, "says": says, "right": right}
    return _row(case, seconds=time.perf_counter() - began, expected=expected or case.told, **found)


def _row(case: Mistaken, **found: Any) -> Told:
    """The row of a series, with what was found."""
    facts = {key: getattr(case, key) for key in ("release", "mistake", "rig", "index", "noise", "scatter")}
    return Told(case=case.name, **facts, revision=revision(), **found)


def _expected(case: Mistaken, odd: str) -> str:
    """Name that the search has to give; "" where a message has to tell it."""
    named = MISTAKES[case.mistake].named
    if not odd:
        return named
    # The effect of one record carries that record's place in the study.
    place = 1 + [plan.name for plan in case.make()[0].records].index(odd)
    return f"{named}@{place}"


def _searched(folder: Path) -> tuple[str, str, str, str]:
    """Verdict, effects added, what is not told apart, and words."""
    import fibrefit
    from fibrefit.core.errors import FibrefitError

    try:
        summary = fibrefit.discover(fibrefit.load_study(folder)).summary().model_dump(mode="json", by_alias=True)
    except FibrefitError as error:
        return "refused", "", "", str(error)
    known = told(summary, ())
    checks = " ".join(str(check.get("message", "")) for check in summary.get("checks", ()) if not check.get("passed"))
    return known["verdict"], known["added"], known["alike"], f"{known['says']} {checks}".strip()


def table_of(found: Sequence[Told]) -> Table:
    """The table, a line a mistake."""
    rows = []
    for mistake in MISTAKES:
        of_it = [row for row in found if row.mistake == mistake]
        shares = [Share.of([row for row in of_it if row.rig == rig], lambda row: row.right) for rig in RIGS]
        seconds = f"{median(row.seconds for row in of_it):.0f}"
        rows.append([mistake, HELD_TO, Share.of(of_it, lambda row: row.right), *shares, seconds])
    return Table.of(("what the study is wrong in", "held to", "named as such, both rigs", *RIGS, "s, median"), rows)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.validation.validate_mistakes", description=__doc__)
    parser.add_argument(
        "--release", required=True, action="append", help="label; another one draws other series; several for the table"
    )
    parser.add_argument("--cases", type=int, default=0, help="further series of each mistake; 0 prints the table only")
    parser.add_argument("--mistake", action="append", choices=MISTAKES, help="may be given again; all if not given")
    parser.add_argument("--rig", action="append", choices=RIGS, help="both if not given")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--limit", type=float, default=LIMIT, help="s a series may take")
    parser.add_argument("--document", action="store_true", help="keep the table in journal/tables")
    given = parser.parse_args()
    release, *others = given.release
    if others and given.cases:
        parser.error("series are searched of one release at a time")
    path = RESULTS / f"{release}.csv"
    done = {row.case for row in read(path, Told)}
    jobs = []
    for mistake in given.mistake or MISTAKES:
        further = itertools.islice(mistakes(release, mistake, given.rig or RIGS), FAR)
        jobs.append(itertools.islice((one for one in further if one.name not in done), given.cases))
    turns = [one for turn in zip(*jobs, strict=True) for one in turn]
    for number, one in enumerate(carried_out(carry_out, turns, given.processes, given.limit), 1):
        row = one.result or _ended(one.job, one.seconds)
        append(path, row, "case")
        said = row.added or row.says[:80]
        print(f"[{number}/{len(turns)}] {row.case}: {'right' if row.right else 'WRONG'}, {row.verdict} {said}"
              f" ({row.seconds:.0f} s)", flush=True)  # fmt: skip
    found = table_of([row for label in given.release for row in read(RESULTS / f"{label}.csv", Told)])
    print("\n".join(found.lines()))
    if given.document:
        found.keep(JOURNAL / "mistakes.csv")


def _ended(case: Mistaken, seconds: float) -> Told:
    """A series that took too long, or whose process died."""
    found = {"verdict": "too long", "added": "", "alike": "", "says": "its process ended", "right": False}
    return _row(case, seconds=seconds, expected=MISTAKES[case.mistake].named, **found)


if __name__ == "__main__":
    main()
