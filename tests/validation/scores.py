"""How a search did: named by class, exactly or falsely, called unexplained; by rig, strength, noise and scatter."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from scipy.stats import chi2, ncx2

from tests.independent.laws import ACTS_BY, KNOWN_AS
from tests.validation.cases import KINDS, RIGS, STRENGTHS, class_of
from tests.validation.designs import NOISES, SCATTERS
from tests.validation.tables import Share, Table, median

NOT_RECORDED = "not recorded"
AS_WELL = 1.1
"""Gap on left-out records over that of the true law up to which a law predicts as well."""
MOST_SECONDS = 300.0
"""Time that a search has unless told otherwise."""
ASKED_SECONDS = {"fibre_mass": 45.0, "pulley_drive": 120.0}
"""Time asked of a search by rig, programs compiled before; twice that where nothing is."""
ALARMS, TRIED = 0.01, 20
"""False alarms of the ideal test, and number of effects it tries: what a search has to choose from."""


@dataclass(frozen=True)
class Outcome:
    """What became of one case; a row of the file of a release.

    Parameters
    ----------
    case : name of the case
    release, kind, rig, index, seed, noise, scatter, strength : of it; `strength` is the noncentrality wanted
    hidden, noncentralities : what was hidden and what a perfect test gains by each, joined by " + "
    verdict : of the search, "error" or "too long"
    added : effects in the order they were found, joined by " + "
    alike : groups of effects that the search says it cannot tell apart, joined by " + ", groups by " | "
    best, evidence : first of the ranking of the first round, and its evidence
    evidence_of_truth : of the hidden effect that is ranked highest in the first round; nan where none is
    gap_before, gap_after : of the fits
    status : of the fit of the final model
    seconds, processor_seconds : of the search, compilation included
    making_seconds : of the series
    revision : of the program
    says : what it looks like, or the error
    law_port, law_variable, law_form : of the law that was proposed, empty without one; early releases did not record it
    memory : GB that the process held at most meanwhile; nan where it was not recorded
    gap_left_out, gap_of_truth : that a proposed law, and the true one, leave on records predicted from the others; nan
        without a law, or where it was not recorded
    """

    case: str
    release: str
    kind: str
    rig: str
    index: int
    seed: int
    noise: str
    scatter: float
    strength: float
    hidden: str
    noncentralities: str
    verdict: str
    added: str
    alike: str
    best: str
    evidence: float
    evidence_of_truth: float
    gap_before: float
    gap_after: float
    status: str
    seconds: float
    processor_seconds: float
    making_seconds: float
    revision: str
    says: str
    law_port: str = NOT_RECORDED
    law_variable: str = NOT_RECORDED
    law_form: str = NOT_RECORDED
    memory: float = math.nan
    gap_left_out: float = math.nan
    gap_of_truth: float = math.nan

    @property
    def truth(self) -> tuple[str, ...]:
        """What was hidden."""
        return names(self.hidden)

    @property
    def found(self) -> tuple[str, ...]:
        """What was named."""
        return names(self.added) if self.verdict == "named" else ()

    def meant(self, name: str) -> frozenset[str]:
        """Effects a name stands for: its class, and what the search itself cannot tell from it here."""
        groups = (frozenset(names(group)) for group in self.alike.split(" | "))
        return class_of(name).union(*(group for group in groups if name in group))

    @property
    def by_class(self) -> bool:
        """Whether everything hidden was named, by its own name or one of its class."""
        return bool(self.truth) and all(any(one in self.meant(name) for name in self.found) for one in self.truth)

    @property
    def exact(self) -> bool:
        """Whether everything hidden was named, and nothing else."""
        return bool(self.found) and set(self.found) == set(self.truth)

    @property
    def falsely(self) -> bool:
        """Whether something was named that stands for nothing hidden."""
        return any(not self.meant(name) & {*self.truth, self.known_as} for name in self.found)

    @property
    def unexplained(self) -> bool:
        """Whether the search says that something is missing which it has no name for."""
        return self.verdict == "unexplained"

    @property
    def law_right(self) -> bool:
        """Whether a law was proposed for what is outside the catalogue, at its port and of its variable."""
        port, variables = ACTS_BY.get(self.hidden, ("", ()))
        return self.unexplained and self.law_port == port and self.law_variable in variables

    @property
    def law_predicts(self) -> bool:
        """Whether a proposed law predicts records that it was not fitted to as well as the true one, within a tenth."""
        return self.gap_left_out <= AS_WELL * self.gap_of_truth

    @property
    def known_as(self) -> str:
        """Effect of the catalogue whose law is that of what was hidden; empty where it has none."""
        return KNOWN_AS.get(self.hidden, "")

    @property
    def by_law(self) -> bool:
        """Whether a cause for which the catalogue has a law by now was named by it, and nothing else."""
        return set(self.found) == {self.known_as}

    def in_time(self, times: float) -> bool:
        """Whether it took no longer than asked for, so many times."""
        return self.seconds <= times * ASKED_SECONDS[self.rig]

    @property
    def good(self) -> bool:
        """Whether it ended as it should."""
        if self.kind == "null":
            return self.verdict == "nothing_missing"
        if self.known_as:
            return self.by_law
        return self.unexplained if self.kind == "outside" else self.exact


def names(joined: str) -> tuple[str, ...]:
    """Names out of one cell."""
    return tuple(name for name in joined.split(" + ") if name)


def ideal(noncentrality: float) -> float:
    """Share of cases found by a perfect whitened test with a false alarm in 1 % of nulls and 20 effects to try."""
    return float(ncx2.sf(chi2.isf(ALARMS / TRIED, 1), 1, noncentrality))


def _faint(strength: int) -> Callable[[Outcome], bool]:
    return lambda o: o.kind == "faint" and o.strength == strength


GOALS: tuple[tuple[str, Callable[[Outcome], bool], str, Callable[[Outcome], bool]], ...] = (
    ("nothing hidden: an effect named", lambda o: o.kind == "null", "<= 1 %", lambda o: bool(o.found)),
    ("nothing hidden: called unexplained", lambda o: o.kind == "null", "<= 2 %", lambda o: o.unexplained),
    ("noncentrality 60: named by class", _faint(60), ">= 50 %", lambda o: o.by_class),
    ("noncentrality 120: named by class", _faint(120), ">= 90 %", lambda o: o.by_class),
    ("noncentrality 500: named by class", _faint(500), ">= 98 %", lambda o: o.by_class),
    ("noncentrality 500: exactly", _faint(500), ">= 85 %", lambda o: o.exact),
    ("one faint effect: something named falsely", lambda o: o.kind == "faint", "<= 1 %", lambda o: o.falsely),
    ("outside the catalogue: called unexplained", lambda o: o.kind == "outside" and not o.known_as, ">= 90 %",
     lambda o: o.unexplained),
    ("outside the catalogue: a law of its port and variable",
     lambda o: o.kind == "outside" and not o.known_as and o.law_port != NOT_RECORDED,
     ">= 80 %", lambda o: o.law_right),
    ("outside the catalogue, a law proposed: its gap on left-out records at most 10 % above the true law's",
     lambda o: o.kind == "outside" and math.isfinite(o.gap_left_out), "", lambda o: o.law_predicts),
    ("outside once, a law of it by now: named by that", lambda o: bool(o.known_as), ">= 85 %", lambda o: o.by_law),
    ("two effects: both named by class", lambda o: o.kind == "pair", ">= 85 %", lambda o: o.by_class),
    ("three effects: all named by class", lambda o: o.kind == "triple", ">= 50 %", lambda o: o.by_class),
    ("not trusted", lambda o: True, "", lambda o: o.verdict == "not_trusted"),
    ("an error, or too long", lambda o: True, "", lambda o: o.verdict in ("error", "too long")),
    ("over 5 minutes", lambda o: True, "none", lambda o: o.seconds > MOST_SECONDS),
    ("nothing hidden: within 45 s, driven 120 s", lambda o: o.kind == "null", "all", lambda o: o.in_time(1.0)),
    ("something hidden: within 45 s, driven 120 s", lambda o: o.kind != "null", "all", lambda o: o.in_time(1.0)),
    ("something hidden: within twice that", lambda o: o.kind != "null", "nothing compiled", lambda o: o.in_time(2.0)),
)  # fmt: skip


def goals(outcomes: Sequence[Outcome]) -> Table:
    """What the search is held to."""
    rows = []
    for what, among, goal, hit in GOALS:
        chosen = [o for o in outcomes if among(o)]
        rows.append([what, goal, Share.of(chosen, hit), *(Share.of(_of(chosen, rig=rig), hit) for rig in RIGS)])
    return Table.of(["", "held to", "both rigs", *RIGS], rows)


HEADS = ("by class", "exactly", "falsely", "unexplained")


def _four(outcomes: Sequence[Outcome]) -> list[Share]:
    return [
        Share.of(outcomes, hit)
        for hit in (lambda o: o.by_class, lambda o: o.exact, lambda o: o.falsely, lambda o: o.unexplained)
    ]


def _of(outcomes: Iterable[Outcome], **wanted: object) -> list[Outcome]:
    return [o for o in outcomes if all(getattr(o, key) == value for key, value in wanted.items())]


def by_strength(outcomes: Sequence[Outcome]) -> Table:
    """Faint effects, with what a perfect test would find beside."""
    rows = []
    for rig in RIGS:
        for strength in STRENGTHS:
            group = _of(outcomes, kind="faint", rig=rig, strength=float(strength))
            if group:
                rows.append([rig, strength, f"{100 * ideal(strength):.1f} %", *_four(group)])
    return Table.of(["rig", "noncentrality", "the ideal", *HEADS], rows)


def by_noise(outcomes: Sequence[Outcome], kind: str) -> Table:
    """Cases of one kind by noise and by scatter."""
    rows: list[Sequence[object]] = []
    for rig in RIGS:
        mine = _of(outcomes, kind=kind, rig=rig)
        rows += [[rig, noise, "", *_four(group)] for noise in NOISES if (group := _of(mine, noise=noise))]
        rows += [[rig, "", f"{100 * s:g} %", *_four(g)] for s in SCATTERS if (g := _of(mine, scatter=s))]
    return Table.of(["rig", "noise", "scatter", *HEADS], rows)


def by_hidden(outcomes: Sequence[Outcome]) -> Table:
    """A row for each effect or cause that was hidden alone, and what was said in its place."""
    rows = []
    groups = sorted({(o.kind, o.hidden, o.rig) for o in outcomes if o.kind in ("faint", "outside")})
    for kind, hidden, rig in groups:
        group = _of(outcomes, kind=kind, hidden=hidden, rig=rig)
        others = Counter(said(o) for o in group if not o.good)
        instead = ", ".join(f"{what} ({n})" if n > 1 else what for what, n in others.most_common())
        hits = (sum(getattr(o, key) for o in group) for key in ("by_class", "exact", "falsely", "unexplained"))
        by_law = sum(o.by_law for o in group) if group[0].known_as else ""
        rows.append([hidden, rig, len(group), *hits, by_law, instead])
    return Table.of(["hidden", "rig", "cases", *HEADS, "by its law of now", "else"], rows)


def misses(outcomes: Sequence[Outcome]) -> Table:
    """A row for each case that did not end as it should."""
    return Table.of(
        ["case", "hidden", "noncentrality", "said", "best, its evidence, that of the truth", "gap before, after"],
        (
            [
                o.case,
                o.hidden or "nothing",
                o.noncentralities,
                said(o),
                f"{o.best}, {o.evidence:.1f}, {o.evidence_of_truth:.1f}",
                f"{o.gap_before:.3f}, {o.gap_after:.3f}",
            ]
            for o in outcomes
            if not o.good
        ),
    )


def said(outcome: Outcome) -> str:
    """The verdict, or what was named."""
    return outcome.added if outcome.verdict == "named" else outcome.verdict.replace("_", " ")


def times(outcomes: Sequence[Outcome]) -> Table:
    """How long a search took, by rig and kind."""
    rows = []
    for rig in RIGS:
        for kind in KINDS:
            if group := _of(outcomes, rig=rig, kind=kind):
                clock = [o.seconds for o in group if math.isfinite(o.seconds)]
                middles = (f"{median(values):.0f}" for values in (clock, [o.processor_seconds for o in group]))
                held = [o.memory for o in group if math.isfinite(o.memory)]
                most = [f"{max(clock, default=math.nan):.0f}", f"{max(held):.1f}" if held else "not recorded"]
                rows.append([rig, kind, len(group), *middles, *most])
    heads = ["s by the clock, median", "s of processor, median", "largest by the clock", "most memory, GB"]
    return Table.of(["rig", "kind", "cases", *heads], rows)


DAY = len("2026-11-25")


def tables(outcomes: Sequence[Outcome], earlier: Sequence[Outcome] = ()) -> dict[str, Table]:
    """Tables of a release by name; those of single cases, and `goals_together`, count earlier ones too."""
    if not outcomes:
        return {}
    both = [*outcomes, *earlier]
    found = {
        "releases": releases(outcomes, earlier),
        "goals": goals(outcomes),
        "by_strength": by_strength(outcomes),
        "time": times(outcomes),
        "faint_by_noise": by_noise(both, "faint"),
        "null_by_noise": by_noise(both, "null"),
        "by_hidden": by_hidden(both),
        "misses": misses(both),
    }
    return found | ({"goals_together": goals(both)} if earlier else {})


def releases(outcomes: Sequence[Outcome], earlier: Sequence[Outcome]) -> Table:
    """What the tables rest on: first outcomes; from earlier ones the search may have been changed since."""
    groups = {"latest": outcomes, "earlier": earlier}
    rows = (
        (
            what,
            " to ".join(sorted({labels[0], labels[-1]}, key=labels.index)),
            len({o.revision for o in group}),
            len(group),
        )
        for what, group in groups.items()
        if (labels := _in_order({o.release for o in group}))
    )
    return Table.of(("", "releases", "revisions", "cases"), rows)


def _in_order(labels: Iterable[str]) -> list[str]:
    """Labels as they came: those of a day are a to z, then aa."""
    return sorted(labels, key=lambda label: (label[:DAY], len(label), label))
