"""Summary files of a search for what a model lacks, of what records can show, and of a plan of the next ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

from pydantic import Field

from fibrefit.study.summaries.check import Status
from fibrefit.study.summaries.part import Interval, Known, Part
from fibrefit.study.summaries.results import FitResultSummary, Gap, ParameterSummary, Provenance
from fibrefit.study.thresholds import LEAST_LISTED

Verdict = Literal["nothing_missing", "named", "unexplained", "not_trusted"]


class GapPlace(Part):
    """A stretch of a record in which model and measurement differ."""

    record: str
    channel: str
    from_s: float
    to_s: float
    phase: str
    share: float
    """Share of the gap that lies here, 0 to 1."""


class Candidate(Part):
    """An effect that was tried."""

    effect: str
    """Its name; several, joined by " + ", where they were tried together."""
    gap_after: float
    evidence: float
    """Natural logarithm of the Bayes factor against the model before the round."""
    false_alarm: Known = None
    """Probability that the best of all candidates reaches as much although nothing is missing."""
    parameters: dict[str, ParameterSummary]
    """Of the effect, by their names; of several, with the effect's name and a dot before."""


class ListedCandidates(NamedTuple):
    """Candidates of a round that are listed one by one.

    Parameters
    ----------
    others : int
        How many are not.
    gain : bool
        Whether any of those gains something.
    """

    shown: tuple[Candidate, ...]
    others: int
    gain: bool


def listed_candidates(ranking: Sequence[Candidate], most: int, added: str = "") -> ListedCandidates:
    """Candidates that gain something, and what was added; of a round in which none does, those that come nearest.

    Parameters
    ----------
    ranking : sequence of Candidate
        The most probable first.
    most : int
        Of them that are listed.
    added : str
        Which was added, as a person may choose one that gains nothing.
    """
    gaining = sum(one.evidence >= LEAST_LISTED for one in ranking)
    shown = [one for one in ranking if one.evidence >= LEAST_LISTED or one.effect == added] or list(ranking)
    return ListedCandidates(tuple(shown[:most]), len(ranking) - len(shown[:most]), gaining > most or not gaining)


class Round(Part):
    """One effect added, or found not to be needed."""

    added: str | None
    gap_before: float
    gap_after: float
    where: tuple[GapPlace, ...] = ()
    ranking: tuple[Candidate, ...] = ()
    sentence: str = ""
    """Where the gap lay before it, and what was added, in words."""


class FreeCurve(Part):
    """What is missing, as an unknown curve of one state of the rig on the model that is kept."""

    variable: str
    """What it depends on."""
    unit: str
    """SI unit of the variable."""
    says: str
    """What it is, in words."""
    knots: tuple[float, ...]
    """Values of the variable, in `unit`; the curve is straight between."""
    heights: tuple[float, ...]
    """At the knots, in `height_unit`, without their median."""
    height_unit: str = "N"
    """SI unit of the heights."""
    std_errors: tuple[Known, ...]
    """Of the heights, in `height_unit`, but for the level of the whole curve; null where not determined."""
    seconds: tuple[float, ...] = ()
    """Time the motion spends nearest to each knot, in s."""
    acts: Interval | None = None
    """From where to where it acts, in `unit`, where that is one end of its range."""
    gap_after: float
    """With the curve in the model."""
    cost: Known = None
    """Sum of squared residuals over the noise, with the curve in the model."""
    law: tuple[float, ...] | None = None
    """Heights of the law proposed in its place."""


class Unexplained(Part):
    """What is left that no effect accounts for."""

    gap: float
    where: tuple[GapPlace, ...] = ()
    looks_like: str | None = None
    curves: tuple[FreeCurve, ...] = ()
    """What it looks like, best first."""


class Before(Part):
    """The fit of the model the search began with."""

    status: Status
    effects: tuple[str, ...] = ()
    parameters: dict[str, ParameterSummary]
    gap: Gap
    records: dict[str, Gap]


class HeldOut(Part):
    """Leave-one-record-out: one record predicted from a fit to the others; only its own zero and start are fitted."""

    record: str
    gap_before: float
    """Of the model the search began with."""
    gap_after: float
    """Of the final model."""


class Weight(Part):
    """Effect size of an added effect."""

    effect: str
    share_of_signal: float
    """RMS contribution over signal RMS."""
    signal: str
    """What was measured: `force` where a force drives the rig, else `readings`."""
    share_of_gap: Known
    """Of the squared gap beyond noise, 0 to 1; null where there is none."""
    standard_errors: float
    """By which its strength differs from zero."""
    says: str = ""
    """The same in words."""


class Separation(Part):
    """The further record that best tells two effects apart."""

    pair: tuple[str, str]
    record: str
    """One of the study that it is like."""
    conditions: dict[str, float]
    """In which it differs from that one, in SI units."""
    pace: float
    """Factor on how fast its input runs."""
    size: float
    """Factor on how far its input runs."""
    nats_before: float
    """Expected logarithm of the likelihood ratio of the right one and the other one at its best, in the records at
    hand."""
    nats_after: float
    """The same with the further record too; 5 tell them apart."""
    says: str = ""
    """What to measure, and what it would tell, in words."""


class Detectable(Part):
    """The smallest strength of an effect that records would show."""

    effect: str
    parameter: str
    unit: str
    smallest_detectable: Known
    """Detection limit; null where these records show none."""
    unique: float
    """Share of its change that base parameters cannot imitate, 0 to 1."""


class LawParameter(Part):
    """One number of a proposed law."""

    symbol: str = ""
    """In the expression."""
    value: float
    std_error: Known = None
    unit: str


class OtherLaw(Part):
    """A law that was fitted too."""

    name: str
    says: str
    evidence: float
    """Logarithm of the Bayes factor over the proposed law."""


class ProposedLawSummary(Part):
    """A law composed for what no effect of the catalogue accounts for."""

    name: str
    """Of the effect that the law is."""
    file: str
    """Where it is written, beside this file."""
    effect: str
    """File and class, as a study names it."""
    says: str
    port: str
    """Where it acts: "guide.friction", "guide.force", "fibre.stiffness" and so on."""
    variables: tuple[str, ...]
    """What it depends on; with a second one it changes besides."""
    variable_units: tuple[str, ...] = ()
    """Of each variable, SI."""
    valid_range: tuple[float, float] | None = None
    """Of the first variable: where records saw it."""
    second_at_most: Known = None
    """How far the second variable goes in the records, if any."""
    form: str
    expression: str
    """x the first variable, y the second; the symbols are those of the parameters."""
    parameters: dict[str, LawParameter]
    evidence: float
    """Logarithm of the Bayes factor, the number of laws looked at paid for."""
    false_alarm: Known = None
    """Probability at the most that some law reaches as much although nothing is missing."""
    gap_before: float
    gap_after: float
    gap_left_out_before: Known = None
    gap_left_out: Known = None
    """Rms over the records, each predicted from the others."""
    elpd_left_out: Known = None
    """Log predictive density of records left out in turn, over that without the law; decides on it."""
    runners_up: tuple[OtherLaw, ...] = ()


class DiscoverySummary(FitResultSummary):
    """``summary.json`` of a discovery: that of the fit of the final model, and how it was found."""

    schema_name: Literal["fibrefit/discovery/1"] = Field(default="fibrefit/discovery/1", alias="schema")
    verdict: Verdict
    reason: str = ""
    """Why the verdict is what it is, in words."""
    added: tuple[str, ...] = ()
    statements: tuple[str, ...] = ()
    """What the study says and what the records say, and what happened in single records."""
    rounds: tuple[Round, ...] = ()
    cannot_tell_apart: tuple[tuple[str, ...], ...] = ()
    separated_by: tuple[Separation, ...] = ()
    """What would tell those apart."""
    detectable: tuple[Detectable, ...] = ()
    """What would have been found had it been there."""
    unexplained: Unexplained | None = None
    before: Before | None = None
    held_out: tuple[HeldOut, ...] = ()
    weights: tuple[Weight, ...] = ()
    """Of the effects that were added."""
    ranking: tuple[Candidate, ...] = ()
    """Of the last look for more, whether or not anything was added."""
    proposed_law: ProposedLawSummary | None = None
    """What accounts for an unexplained gap, where a law does as well as the best curve."""
    untried: tuple[str, ...] = ()
    """Effects that the time did not suffice for."""
    undone: tuple[str, ...] = ()
    """Other parts that it did not suffice for."""

    @property
    def places(self) -> tuple[GapPlace, ...]:
        """Where the first model goes wrong."""
        if self.rounds:
            return self.rounds[0].where
        return self.unexplained.where if self.unexplained else ()


class DistinguishSummary(Part):
    """``summary.json`` of ``distinguish``: which effects the records can show, and tell from each other."""

    schema_name: Literal["fibrefit/distinguish/1"] = Field(default="fibrefit/distinguish/1", alias="schema")
    status: Status = "ok"
    study: str
    rig: str
    records: tuple[str, ...]
    planned: bool
    """Whether the records are only planned."""
    remarks: tuple[str, ...] = ()
    effects: tuple[Detectable, ...]
    cosine: tuple[tuple[float, ...], ...]
    """|cosine| of what any two effects change beyond what base parameters can imitate, in the order of `effects`; 1 is
    not separable, 0 also where the records do not show one of them."""
    cannot_tell_apart: tuple[tuple[str, str], ...] = ()
    cannot_see: tuple[str, ...] = ()
    best_further_record: Separation | None = None
    provenance: Provenance | None = None


class FurtherRecord(Part):
    """A record that could be taken next, and what it would add to those at hand."""

    like: str
    """Record of the study that it is like."""
    conditions: dict[str, float]
    """In which it differs from that one, in SI units."""
    pace: float
    """Factor on how fast its input runs."""
    size: float
    """Factor on how far its input runs."""
    minutes: float
    """What it costs, the time that a slower motion takes included."""
    errors: dict[str, float]
    """Factor on the standard error of each parameter that the records at hand determine."""
    newly_determined: tuple[str, ...] = ()
    """Parameters that only the further record does."""
    limits: dict[str, float]
    """Factor on the detection limit of each effect that the records at hand show."""
    newly_shown: tuple[str, ...] = ()
    """Effects that only the further record shows."""
    probability_distinguished: Known = None
    """Probability that the rivals are distinguished with it; null without rivals."""
    nats: Known = None
    """Expected logarithm of the likelihood ratio of the rivals with it."""
    looked_into: bool | None = None
    """Whether the rivals were fitted to it too; where not, slopes alone say what it tells, which mostly promise too
    much. Null without rivals."""
    says: str


class PlanSummary(Part):
    """``summary.json`` of a plan: the next records, the most useful first."""

    schema_name: Literal["fibrefit/plan/1"] = Field(default="fibrefit/plan/1", alias="schema")
    status: Status = "ok"
    study: str
    rig: str
    records: tuple[str, ...]
    """Those at hand."""
    purpose: Literal["errors", "rivals", "power"]
    """What the records are ranked by."""
    rivals: tuple[str, str] | None = None
    probability_distinguished_now: Known = None
    """Probability that records like those at hand distinguish the rivals; see `ahead`."""
    ahead: Known = None
    """Nats by which the records at hand make the first rival more probable; null where they do not show both. Where it
    is known, the probabilities rest on it."""
    further: tuple[FurtherRecord, ...]
    reach: dict[str, tuple[float, float]] = Field(default_factory=dict)
    """Least and most of each condition that further records have, in SI units: as [limits] of the study state it, else
    what records at hand have, wider by a factor at either end."""
    limits_stated: tuple[str, ...] = ()
    """Those of them that the study states."""
    remarks: tuple[str, ...] = ()
    provenance: Provenance | None = None
