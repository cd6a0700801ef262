"""Takes the record that a plan proposes to tell two effects apart, and a random one that costs no more, and counts.

``python -m tests.validation.validate_plan --release LABEL --trials 20`` carries out twenty further trials, the pairs in
turn, and prints the table. Each is a series of slow drops by an independent simulator with one of two effects hidden
that such drops hardly tell apart. A trial is carried out once, and its outcome stays. ``--document`` keeps the table
in ``journal/tables``.
"""

from __future__ import annotations

import argparse
import itertools
import math
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.independent.laws import DROP
from tests.independent.make import write_study
from tests.independent.noncentrality import Hidden, Ideal, strength_for
from tests.independent.sensors import USUAL
from tests.independent.series import RATE, Plan, Recording, Series, draw_shape, drop_plan, scattered, take
from tests.validation.cases import seed_of
from tests.validation.designs import USUAL_DESIGN
from tests.validation.tables import JOURNAL, Share, Table, append, median, read, revision
from tests.validation.validate_discover import FAR, LIMIT
from tests.validation.workers import carried_out

RESULTS = Path(__file__).parent / "outcomes" / "plans"
"""Kept with the project: an outcome is written down once and stays."""
PAIRS = (
    ("guide.viscous_friction", "guide.quadratic_drag"),
    ("fibre.free_length_offset", "sensor.position_gain"),
)
"""Effects of which slow drops hold three tenths at the most that the other cannot imitate, in squares of the noise, and
faster ones more. Of an asymmetric friction and a dial gauge's force no drop holds more than two thousandths."""
SLOW_DROPS = ((4, 90), (6, 90), (6, 45))
"""Lift in mm and slope in degrees of the records at hand."""
AFTER = 1.2
"""Time in s for which a drop is logged from the release on."""
CAN_DO = """
[limits]
lift = ["2 mm", "12 mm"]
inclination = ["22.5 deg", "90 deg"]
"""
"""What the rig is said to do: half and twice of what the records at hand have."""
SCATTER = 0.005
STRENGTH, ALIKE = 60.0, 6.0
"""Most noncentrality of what is hidden in the records at hand: by itself, enough to be found, and beside its rival, too
little for three nats of the records at hand to tell them apart."""
TOLD = 5.0
"""Logarithm of the Bayes factor of the true effect over the false one from which they are told apart."""
HELD_TO = ">= 80 %"


@dataclass(frozen=True)
class Trial:
    """One series with a pair of rivals.

    Parameters
    ----------
    release : label
    index : number among those of its release
    pair : the effects
    """

    release: str
    index: int
    pair: tuple[str, str]

    @property
    def name(self) -> str:
        """Tells a trial from every other one."""
        return f"{self.release}/{self.index}/{self.pair[0]}/{self.pair[1]}"

    @property
    def seed(self) -> int:
        """Of all that is drawn."""
        return seed_of("plan of the next record", self.release, str(self.index), *self.pair)


@dataclass(frozen=True)
class Outcome:
    """What became of one trial; a row of the file of a release.

    Parameters
    ----------
    case : name
    release, index, pair : of it
    hidden : the effect that is in the records
    proposed, random : further records in words
    minutes : cost of the proposed one; the random one costs no more
    foretold, foretold_random : probability that each tells the rivals apart, as planned
    before, after, after_random : logarithm of the Bayes factor of the true effect over the false one, of the records at
        hand, with the proposed record, and with the random one
    seconds : of the trial, compilation included
    revision : of the program
    says : the message where it ended with one
    """

    case: str
    release: str
    index: int
    pair: str
    hidden: str
    proposed: str
    random: str
    minutes: float
    foretold: float
    foretold_random: float
    before: float
    after: float
    after_random: float
    seconds: float
    revision: str
    says: str


class Bench:
    """The rig of a trial: takes records of it, those at hand and further ones."""

    def __init__(self, trial: Trial) -> None:
        self.rng, self.seed = np.random.default_rng(trial.seed), trial.seed
        self.base = USUAL_DESIGN.base(self.rng)
        self.hidden = str(self.rng.choice(trial.pair))
        self.zero = float(self.rng.uniform(-3e-4, 3e-4))
        plans = [drop_plan(*row, self.rng, AFTER) for row in SLOW_DROPS]
        drawn = {name: Hidden(name, 0.1, draw_shape(name, self.rng)) for name in trial.pair}
        self.ideal, guess = Ideal(plans, self.base, USUAL, SCATTER), drawn.pop(self.hidden)
        self.rivals = tuple(drawn.values())
        limits = ((STRENGTH, ()), (ALIKE, self.rivals))
        found = [strength_for(self.ideal, guess, most, known=known).hidden for most, known in limits]
        self.truth = min(found, key=lambda one: abs(one.strength))
        self.effects = {self.hidden: self.truth.values(self.base.stiffness)}
        self.at_hand = tuple(self.taken(plan) for plan in plans)

    def taken(self, plan: Plan) -> Recording:
        """A record of a fibre that is a little different on each day."""
        base = scattered(self.base, self.rng, SCATTER)
        return take(plan, base, self.effects, self.zero, USUAL, self.rng, USUAL_DESIGN.step)

    def further(self, choice: Any) -> Recording:
        """The record that a plan means."""
        like, release = self.at_hand[choice.record].conditions, float(self.rng.uniform(0.1, 0.3))
        times = np.arange(round((release + AFTER) * RATE)) / RATE
        return self.taken(Plan("further.csv", replace(like, release=release, **choice.conditions), times))

    def write(self, folder: Path, *more: Recording) -> Path:
        """Study of the records at hand and more, without the truth."""
        records = (*self.at_hand, *more)
        write_study(Series(DROP, self.base, self.effects, records, records[0], None, self.seed), folder)
        study = folder / "study.toml"
        study.write_text(study.read_text(encoding="utf-8") + CAN_DO, encoding="utf-8")
        return folder


def carry_out(trial: Trial) -> Outcome:
    """Plan the next record of a series, take it, and compare the rivals; an error is an outcome too."""
    began, found = time.perf_counter(), _nothing()
    try:
        bench = Bench(trial)
        found["hidden"] = bench.hidden
        with tempfile.TemporaryDirectory() as name:
            found |= _told(trial, bench, Path(name))
    except Exception as error:
        found["says"] = f"{type(error).__name__}: {error}"
    return _row(trial, found, time.perf_counter() - began)


def _told(trial: Trial, bench: Bench, folder: Path) -> dict[str, Any]:
    from fibrefit.study import load_study
    from fibrefit.workflow.design.plan import Aim, plan_study

    at_hand = bench.write(folder / "at hand")
    plan = plan_study(load_study(at_hand), Aim("rivals", trial.pair, only=trial.pair))
    (best, minutes), others = plan.further[0], plan.further[1:]
    affordable = [worth for worth, cost in others if cost <= minutes]
    chance = affordable[int(bench.rng.integers(len(affordable)))]
    said = {
        id(worth): one.says.partition(" min): ")[0].rpartition(" (")[0]
        for (worth, _), one in zip(plan.further, plan.summary().further, strict=True)
    }
    after = [
        told_by(bench.write(folder / place, bench.further(worth.choice)), trial.pair, bench.hidden)
        for place, worth in (("proposed", best), ("random", chance))
    ]
    return {
        "proposed": said[id(best)],
        "random": said[id(chance)],
        "minutes": minutes,
        "foretold": best.distinguished,
        "foretold_random": chance.distinguished,
        "before": told_by(at_hand, trial.pair, bench.hidden),
        "after": after[0],
        "after_random": after[1],
    }


def told_by(folder: Path, pair: Sequence[str], true: str) -> float:
    """Logarithm of the Bayes factor of the true effect over the other one, both compared in one noise."""
    from fibrefit.core.limits import quiet
    from fibrefit.discovery.comparison import comparison_of
    from fibrefit.discovery.search.setup import prepared_search
    from fibrefit.fitting.identify import identify
    from fibrefit.study import load_study
    from fibrefit.workflow.discovery.candidates import candidates_of
    from fibrefit.workflow.prepare import task_of

    study = load_study(folder)
    task = task_of(study)
    effects = tuple(candidates_of(study, only=tuple(pair)).values())
    search, base = prepared_search(task, identify(task, 1), effects, quiet)
    compared = comparison_of(search, base, "comparing the rivals")
    # An effect from which no motion follows explains no more than its absence.
    gains = {one.effects[-1].name: compared.gain(one) for one in compared.found}
    (false,) = set(pair) - {true}
    return gains.get(true, 0.0) - gains.get(false, 0.0)


def _nothing() -> dict[str, Any]:
    words, numbers = ("hidden", "proposed", "random", "says"), ("minutes", "foretold", "foretold_random")
    return dict.fromkeys(words, "") | dict.fromkeys((*numbers, "before", "after", "after_random"), math.nan)


def _row(trial: Trial, found: dict[str, Any], seconds: float) -> Outcome:
    facts = {"case": trial.name, "release": trial.release, "index": trial.index, "pair": " / ".join(trial.pair)}
    return Outcome(**facts, **found, seconds=seconds, revision=revision())


def trials(release: str) -> Iterator[Trial]:
    """Trials of a release, without end, the pairs in turn from one that the release draws."""
    first = seed_of("first pair", release) % len(PAIRS)
    for index in itertools.count():
        yield Trial(release, index, PAIRS[(first + index) % len(PAIRS)])


def table_of(found: Sequence[Outcome]) -> Table:
    """The table, a line a pair and one for all; a trial that ended with an error tells nothing apart."""
    rows = []
    for pair in (*(" / ".join(pair) for pair in PAIRS), ""):
        of_it = [row for row in found if pair in ("", row.pair)]
        shares = [Share.of(of_it, lambda row, what=what: getattr(row, what) >= TOLD) for what in AFTER_WHAT]
        foretold = f"{100.0 * median(row.foretold for row in of_it):.0f} %"
        rows.append([pair or "all", HELD_TO if not pair else "", *shares, foretold, f"{_seconds(of_it):.0f}"])
    heads = ("rivals", "held to", "told apart with the proposed record", "with a random one", "before", "foretold", "s")
    return Table.of(heads, rows)


AFTER_WHAT = ("after", "after_random", "before")


def _seconds(rows: Sequence[Outcome]) -> float:
    return median(row.seconds for row in rows)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.validation.validate_plan", description=__doc__)
    parser.add_argument("--release", required=True, help="label; another one draws other series")
    parser.add_argument("--trials", type=int, default=0, help="further trials; 0 prints the table only")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--limit", type=float, default=LIMIT, help="s a trial may take")
    parser.add_argument("--document", action="store_true", help="keep the table in journal/tables")
    given = parser.parse_args()
    path = RESULTS / f"{given.release}.csv"
    done = {row.case for row in read(path, Outcome)}
    fresh = (trial for trial in itertools.islice(trials(given.release), FAR) if trial.name not in done)
    jobs = list(itertools.islice(fresh, given.trials))
    for number, one in enumerate(carried_out(carry_out, jobs, given.processes, given.limit), 1):
        late = _nothing() | {"says": f"its process ended after {one.seconds:.0f} s"}
        row = one.result or _row(one.job, late, one.seconds)
        append(path, row, "case")
        print(f"[{number}/{len(jobs)}] {row.case}: {row.before:.1f} at hand, {row.after:.1f} with {row.proposed}, "
              f"{row.after_random:.1f} with {row.random} {row.says} ({row.seconds:.0f} s)", flush=True)  # fmt: skip
    found = table_of(read(path, Outcome))
    print("\n".join(found.lines()))
    if given.document:
        found.keep(JOURNAL / "plans.csv")


if __name__ == "__main__":
    main()
