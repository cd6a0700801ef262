"""What a search ends with, as it is found and as ``summary.json`` has it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

from pydantic import Field

from fibrefit.study.summaries.check import Status
from fibrefit.study.summaries.part import Interval, Known, Part
from fibrefit.study.summaries.summaries import FitResultSummary, Gap, ParameterSummary
from fibrefit.study.thresholds import LEAST_LISTED

Verdict = Literal["nothing_missing", "named", "unexplained", "not_trusted"]


class GapPlace(Part):
    """A stretch of a record in which model and measurement differ."""

    record: str
    channel: str
    from_s: float
    to_s: float
    phase: str
    share: float = Field(description="Share of the gap that lies here, 0 to 1.")


class Candidate(Part):
    """An effect that was tried."""

    effect: str = Field(description='Its name; several, joined by " + ", where they were tried together.')
    gap_after: float
    evidence: float = Field(description="Natural logarithm of the Bayes factor against the model before the round.")
    false_alarm: Known = Field(
        default=None,
        description="Probability that the best of all candidates reaches as much although nothing is missing.",
    )
    parameters: dict[str, ParameterSummary] = Field(
        description="Of the effect, by their names; of several, with the effect's name and a dot before."
    )


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


def listed(ranking: Sequence[Candidate], most: int, added: str = "") -> ListedCandidates:
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
    sentence: str = Field(default="", description="Where the gap lay before it, and what was added, in words.")


class FreeCurve(Part):
    """What is missing, as an unknown curve of one state of the rig on the model that is kept."""

    variable: str = Field(description="What it depends on.")
    unit: str = Field(description="SI unit of the variable.")
    says: str = Field(description="What it is, in words.")
    knots: tuple[float, ...] = Field(description="Values of the variable, in `unit`; the curve is straight between.")
    heights: tuple[float, ...] = Field(description="At the knots, in `height_unit`, without their median.")
    height_unit: str = Field(default="N", description="SI unit of the heights.")
    std_errors: tuple[Known, ...] = Field(
        description="Of the heights, in `height_unit`, but for the level of the whole curve; null where not determined."
    )
    seconds: tuple[float, ...] = Field(default=(), description="Time the motion spends nearest to each knot, in s.")
    acts: Interval | None = Field(
        default=None, description="From where to where it acts, in `unit`, where that is one end of its range."
    )
    gap_after: float = Field(description="With the curve in the model.")
    cost: Known = Field(
        default=None,
        description="Sum of squared residuals over the noise, with the curve in the model.",
    )
    law: tuple[float, ...] | None = Field(default=None, description="Heights of the law proposed in its place.")


class Unexplained(Part):
    """What is left that no effect accounts for."""

    gap: float
    where: tuple[GapPlace, ...] = ()
    looks_like: str | None = None
    curves: tuple[FreeCurve, ...] = Field(default=(), description="What it looks like, best first.")


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
    gap_before: float = Field(description="Of the model the search began with.")
    gap_after: float = Field(description="Of the final model.")


class Weight(Part):
    """Effect size of an added effect."""

    effect: str
    share_of_signal: float = Field(description="RMS contribution over signal RMS.")
    signal: str = Field(description="What was measured: `force` where a force drives the rig, else `readings`.")
    share_of_gap: Known = Field(description="Of the squared gap beyond noise, 0 to 1; null where there is none.")
    standard_errors: float = Field(description="By which its strength differs from zero.")
    says: str = Field(default="", description="The same in words.")


class Separation(Part):
    """The further record that best tells two effects apart."""

    pair: tuple[str, str]
    record: str = Field(description="One of the study that it is like.")
    conditions: dict[str, float] = Field(description="In which it differs from that one, in SI units.")
    pace: float = Field(description="Factor on how fast its input runs.")
    size: float = Field(description="Factor on how far its input runs.")
    nats_before: float = Field(
        description="Expected logarithm of the likelihood ratio of the right one and the other one at its best, in the "
        "records at hand."
    )
    nats_after: float = Field(description="The same with the further record too; 5 tell them apart.")
    says: str = Field(default="", description="What to measure, and what it would tell, in words.")


class Detectable(Part):
    """The smallest strength of an effect that records would show."""

    effect: str
    parameter: str
    unit: str
    smallest_detectable: Known = Field(description="Detection limit; null where these records show none.")
    unique: float = Field(description="Share of its change that base parameters cannot imitate, 0 to 1.")


class LawParameter(Part):
    """One number of a proposed law."""

    symbol: str = Field(default="", description="In the expression.")
    value: float
    std_error: Known = None
    unit: str


class OtherLaw(Part):
    """A law that was fitted too."""

    name: str
    says: str
    evidence: float = Field(description="Logarithm of the Bayes factor over the proposed law.")


class ProposedLawSummary(Part):
    """A law composed for what no effect of the catalogue accounts for."""

    name: str = Field(description="Of the effect that the law is.")
    file: str = Field(description="Where it is written, beside this file.")
    effect: str = Field(description="File and class, as a study names it.")
    says: str
    port: str = Field(description='Where it acts: "guide.friction", "guide.force", "fibre.stiffness" and so on.')
    variables: tuple[str, ...] = Field(description="What it depends on; with a second one it changes besides.")
    variable_units: tuple[str, ...] = Field(default=(), description="Of each variable, SI.")
    valid_range: tuple[float, float] | None = Field(
        default=None, description="Of the first variable: where records saw it."
    )
    second_at_most: Known = Field(default=None, description="How far the second variable goes in the records, if any.")
    form: str
    expression: str = Field(description="x the first variable, y the second; the symbols are those of the parameters.")
    parameters: dict[str, LawParameter]
    evidence: float = Field(description="Logarithm of the Bayes factor, the number of laws looked at paid for.")
    false_alarm: Known = Field(
        default=None, description="Probability at the most that some law reaches as much although nothing is missing."
    )
    gap_before: float
    gap_after: float
    gap_left_out_before: Known = None
    gap_left_out: Known = Field(default=None, description="Rms over the records, each predicted from the others.")
    elpd_left_out: Known = Field(
        default=None,
        description="Log predictive density of records left out in turn, over that without the law; decides on it.",
    )
    runners_up: tuple[OtherLaw, ...] = ()


class DiscoverySummary(FitResultSummary):
    """``summary.json`` of a discovery: that of the fit of the final model, and how it was found."""

    schema_name: Literal["fibrefit/discovery/1"] = Field(default="fibrefit/discovery/1", alias="schema")
    verdict: Verdict
    reason: str = Field(default="", description="Why the verdict is what it is, in words.")
    added: tuple[str, ...] = ()
    statements: tuple[str, ...] = Field(
        default=(), description="What the study says and what the records say, and what happened in single records."
    )
    rounds: tuple[Round, ...] = ()
    cannot_tell_apart: tuple[tuple[str, ...], ...] = ()
    separated_by: tuple[Separation, ...] = Field(default=(), description="What would tell those apart.")
    detectable: tuple[Detectable, ...] = Field(default=(), description="What would have been found had it been there.")
    unexplained: Unexplained | None = None
    before: Before | None = None
    held_out: tuple[HeldOut, ...] = ()
    weights: tuple[Weight, ...] = Field(default=(), description="Of the effects that were added.")
    ranking: tuple[Candidate, ...] = Field(
        default=(), description="Of the last look for more, whether or not anything was added."
    )
    proposed_law: ProposedLawSummary | None = Field(
        default=None, description="What accounts for an unexplained gap, where a law does as well as the best curve."
    )
    untried: tuple[str, ...] = Field(default=(), description="Effects that the time did not suffice for.")
    undone: tuple[str, ...] = Field(default=(), description="Other parts that it did not suffice for.")

    @property
    def places(self) -> tuple[GapPlace, ...]:
        """Where the first model goes wrong."""
        if self.rounds:
            return self.rounds[0].where
        return self.unexplained.where if self.unexplained else ()
