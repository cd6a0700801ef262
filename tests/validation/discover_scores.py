"""How the search did: what was named where what was hidden, false alarms, strangers recognised, time."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import beta

from tests.independent.laws import DRIVE, DROP
from tests.validation.discover_cases import class_of

RIGS = DROP, DRIVE
WEAKEST, STRONGEST = 0.4, 4.0
"""Clean gaps between which a hidden effect must be found, in units of the noise."""


@dataclass(frozen=True)
class Outcome:
    """What became of one case; what is written into the table of cases.

    Parameters
    ----------
    case, kind, rig : str
    hidden : names of what was hidden, joined by " + "
    base_gap : clean gap the best base model leaves
    pink, scatter : of the noise and of the base parameters
    verdict : of the search, or "error"
    added : names in the order they were found, joined by " + "
    alike : what could not be told apart from them, joined by " + "
    gap_before, gap_after : of the fits
    held_out : largest gap of a record foreseen from the others
    seconds : by the clock; the machine may have been busy with other things
    says : what it looks like, or the error
    processor_seconds : compilation included, and the making of the series; nan where that was not noted
    expected_gap : that a perfect model leaves, which has errors of its inputs to fit; nan where that was not noted
    """

    case: str
    kind: str
    rig: str
    hidden: str
    base_gap: float
    pink: float
    scatter: float
    verdict: str
    added: str
    alike: str
    gap_before: float
    gap_after: float
    held_out: float
    seconds: float
    says: str
    processor_seconds: float = math.nan
    expected_gap: float = math.nan

    @property
    def truth(self) -> tuple[str, ...]:
        """What was hidden."""
        return names(self.hidden)

    @property
    def found(self) -> tuple[str, ...]:
        """What was named."""
        return names(self.added)

    @property
    def first_is_right(self) -> bool:
        """Whether the first name is of the class of something hidden, or cannot be told from it in these records."""
        if self.verdict != "named":
            return False
        first = self.found[0]
        meant = class_of(first) | (set(names(self.alike)) if len(self.found) == 1 else set())
        return any(name in meant for name in self.truth)

    @property
    def exact(self) -> bool:
        """Whether everything hidden was named, and nothing else."""
        return self.verdict == "named" and set(self.found) == set(self.truth)

    @property
    def closed(self) -> float:
        """Share of the squared gap beyond noise that the final model closes."""
        known = math.isfinite(self.expected_gap)
        if not known and self.rig == DRIVE:
            return math.nan
        beyond = self.gap_before**2 - (self.expected_gap if known else 1.0) ** 2
        return (self.gap_before**2 - self.gap_after**2) / beyond if beyond > 0.0 else math.nan

    @property
    def in_range(self) -> bool:
        """Whether it is to be found at all."""
        return WEAKEST <= self.base_gap <= STRONGEST


def names(joined: str) -> tuple[str, ...]:
    """Names out of one cell of the table."""
    return tuple(name for name in joined.split(" + ") if name)


@dataclass(frozen=True)
class Rate:
    """A share with its 95 % interval (Clopper-Pearson), in all and by rig, and what it is held to.

    Parameters
    ----------
    what : of what
    hits, cases : number
    by_rig : hits and cases of each of `RIGS`
    goal : in words
    """

    what: str
    hits: int
    cases: int
    by_rig: tuple[tuple[int, int], ...]
    goal: str

    def __str__(self) -> str:
        rigs = " | ".join(f"{hits} of {cases}" for hits, cases in self.by_rig)
        if not self.cases:
            return f"| {self.what} | no case yet | | {rigs} | {self.goal} |"
        low = beta.ppf(0.025, self.hits, self.cases - self.hits + 1) if self.hits else 0.0
        high = beta.ppf(0.975, self.hits + 1, self.cases - self.hits) if self.hits < self.cases else 1.0
        share = f"{100.0 * self.hits / self.cases:.0f} % ({self.hits} of {self.cases})"
        return f"| {self.what} | {share} | {100 * low:.0f} to {100 * high:.0f} % | {rigs} | {self.goal} |"


def rates(outcomes: Sequence[Outcome]) -> list[Rate]:
    """The figures the search is held to."""
    singles = [o for o in outcomes if o.kind == "single" and o.in_range]
    pairs = [o for o in outcomes if o.kind == "pair"]
    nulls = [o for o in outcomes if o.kind == "null"]
    strangers = [o for o in outcomes if o.kind == "outside" and o.base_gap >= WEAKEST]

    def rate(what: str, of: Sequence[Outcome], goal: str, hit: Callable[[Outcome], bool]) -> Rate:
        by_rig = tuple((sum(hit(o) for o in of if o.rig == rig), sum(o.rig == rig for o in of)) for rig in RIGS)
        return Rate(what, sum(map(hit, of)), len(of), by_rig, goal)

    return [
        rate("one effect: right class first", singles, ">= 95 %", lambda o: o.first_is_right),
        rate("one effect: exactly its name", singles, ">= 85 %", lambda o: o.exact),
        rate("nothing hidden: an effect named", nulls, "<= 2 %", lambda o: bool(o.found)),
        rate("nothing hidden: called unexplained", nulls, "", lambda o: o.verdict == "unexplained"),
        rate("two effects: both named", pairs, ">= 80 %", lambda o: o.exact),
        rate("two effects: one of them first", pairs, "", lambda o: o.first_is_right),
        rate("outside the catalogue: called unexplained", strangers, ">= 80 %", lambda o: o.verdict == "unexplained"),
        rate("not trusted, or failed", outcomes, "", lambda o: o.verdict in ("not_trusted", "error")),
    ]


def by_effect(outcomes: Iterable[Outcome]) -> list[str]:
    """A row for each effect that was hidden alone: how often it was found, and what was named in its place."""
    groups: dict[tuple[str, str], list[Outcome]] = defaultdict(list)
    for outcome in outcomes:
        if outcome.kind in ("single", "outside"):
            groups[outcome.hidden, outcome.rig].append(outcome)
    rows = ["| hidden | rig | cases | right class first | exact | gap closed | else |", "|---|---|---|---|---|---|---|"]
    for (hidden, rig), group in sorted(groups.items()):
        closed = [o.closed for o in group if o.exact and math.isfinite(o.closed)]
        median = f"{100 * float(np.median(closed)):.0f} %" if closed else ""
        first, exact = sum(o.first_is_right for o in group), sum(o.exact for o in group)
        rows.append(f"| {hidden} | {rig} | {len(group)} | {first} | {exact} | {median} | {_instead(group)} |")
    return rows


def confusions(outcomes: Iterable[Outcome]) -> list[str]:
    """What was taken for what, the commonest first."""
    pairs = Counter((outcome.hidden or "nothing", _said(outcome)) for outcome in outcomes if not _is_good(outcome))
    return [f"- {hidden} taken for {said}: {number}" for (hidden, said), number in pairs.most_common()]


def misses(outcomes: Iterable[Outcome]) -> list[str]:
    """A row for each case that did not end as it should: what there was to find, and what was said."""
    rows = [
        "| hidden | rig | clean gap | gap before | after | said | not told apart |",
        "|---|---|---|---|---|---|---|",
    ]
    for o in outcomes:
        if not _is_good(o):
            gaps = " | ".join(
                "" if math.isnan(gap) else f"{gap:.2f}" for gap in (o.base_gap, o.gap_before, o.gap_after)
            )
            rows.append(f"| {o.hidden or 'nothing'} | {o.rig} | {gaps} | {_said(o)} | {o.alike.replace(' + ', ', ')} |")
    return rows if len(rows) > 2 else []


def times(outcomes: Sequence[Outcome]) -> str:
    """How long a search took, in words."""
    clock, processor = ([getattr(o, name) for o in outcomes] for name in ("seconds", "processor_seconds"))
    if not np.isfinite(clock).any():
        return "No search has ended yet."
    says = f"A search took {_mostly(clock)}, by the clock"
    return says + (f"; {_mostly(processor)} of processor time." if np.isfinite(processor).any() else ".")


def _mostly(seconds: Sequence[float]) -> str:
    middle, late = np.nanquantile(seconds, (0.5, 0.9))
    return f"{middle:.0f} s (median) and at most {late:.0f} s in nine cases of ten"


def _is_good(outcome: Outcome) -> bool:
    if outcome.kind == "null":
        return outcome.verdict == "nothing_missing"
    return outcome.verdict == "unexplained" if outcome.kind == "outside" else outcome.exact


def _instead(group: Sequence[Outcome]) -> str:
    others = Counter(_said(outcome) for outcome in group if not _is_good(outcome))
    return ", ".join(f"{said} ({number})" if number > 1 else said for said, number in others.most_common())


def _said(outcome: Outcome) -> str:
    return outcome.added if outcome.verdict == "named" else outcome.verdict.replace("_", " ")
