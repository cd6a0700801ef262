"""What a search for the missing effect ends with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fibrefit.core.declarations import Statement
from fibrefit.discovery.model.law import ProposedLaw
from fibrefit.fitting.result import Identification
from fibrefit.laws.law import Effect
from fibrefit.study.summaries.check import Check
from fibrefit.study.summaries.discovery import (
    Candidate,
    Detectable,
    HeldOut,
    Round,
    Separation,
    Unexplained,
    Verdict,
    Weight,
)


@dataclass(frozen=True)
class TracedRound:
    """One round, and what the models in it leave.

    Parameters
    ----------
    summary : Round
    residuals : (n_record, n_channel, n_time) or None
        Residuals of the model before, simulated minus measured, in units of the noise.
    residuals_with : tuple of (n_record, n_channel, n_time)
        The same with each of the first of the ranking.
    statements : tuple of Statement
        Where the gap lay before it, and what was added.
    """

    summary: Round
    residuals: np.ndarray | None = None
    residuals_with: tuple[np.ndarray, ...] = ()
    statements: tuple[Statement, ...] = ()

    @property
    def added(self) -> tuple[str, ...]:
        """Names of the effects that were added in it."""
        return tuple((self.summary.added or "").split(" + "))


@dataclass(frozen=True)
class Choice:
    """A record that could be measured: like one of the study, under other conditions or driven otherwise.

    Parameters
    ----------
    record : int
        Of the study.
    conditions : mapping of str to float, in SI units
        That differ from its own.
    pace, size : float
        Factors on how fast and how far its input runs.
    """

    record: int
    conditions: Mapping[str, float]
    pace: float = 1.0
    size: float = 1.0


def separation(pair: tuple[str, str], choice: Choice, record: str, before: float, after: float) -> Separation:
    """A further record that tells two effects apart.

    Parameters
    ----------
    pair : tuple of str
    choice : Choice
        What to measure.
    record : str
        The one of the study it is like.
    before, after : float
        Expected logarithm of the likelihood ratio of both, without it and with it.
    """
    varied = {"conditions": dict(choice.conditions), "pace": choice.pace, "size": choice.size}
    return Separation(pair=pair, record=record, **varied, nats_before=before, nats_after=after)


@dataclass(frozen=True)
class Finding:
    """Result of a search.

    Parameters
    ----------
    verdict : Verdict
    reason : tuple of Statement
        Why.
    added : tuple of Effect classes
    steps : tuple of TracedRound
    cannot_tell_apart : tuple of tuple of str
        Classes of effects that explain the records alike.
    separated_by : tuple of Separation
        The further records that would tell those apart, where records of the rig can be varied.
    unexplained : Unexplained
        With what the gap looks like as free curves, best first.
    before, after : Identification
        Of the model before and after the search.
    held_out : tuple of HeldOut
    ranking : tuple of Candidate
        Of the last round for more, whether or not anything was added.
    seconds : float
    weights : tuple of Weight
        Of what was added.
    detectable : tuple of Detectable
        Smallest strength of each effect that would have been found, where nothing is missing; without those that were
        not tried, as there was nothing left for them.
    proposed_law : ProposedLaw or None
        What accounts for what is missing, where a law does as well as the best curve; `after` is with it.
    untried : tuple of str
        Effects that the time did not suffice for.
    looks_like : Statement or None
        What the gap looks like.
    undone : tuple of str
        Other parts of the search that it did not suffice for, by identifier.
    broken : tuple of Check
        Those of the first fit that leave nothing to search from; the reason, where there are any.
    """

    verdict: Verdict
    reason: tuple[Statement, ...]
    added: tuple[type[Effect], ...]
    steps: tuple[TracedRound, ...]
    cannot_tell_apart: tuple[tuple[str, ...], ...]
    unexplained: Unexplained
    before: Identification
    after: Identification
    held_out: tuple[HeldOut, ...]
    ranking: tuple[Candidate, ...]
    seconds: float
    weights: tuple[Weight, ...] = ()
    detectable: tuple[Detectable, ...] = ()
    separated_by: tuple[Separation, ...] = ()
    proposed_law: ProposedLaw | None = None
    untried: tuple[str, ...] = ()
    undone: tuple[str, ...] = ()
    broken: tuple[Check, ...] = ()
    looks_like: Statement | None = None
