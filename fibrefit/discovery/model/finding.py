"""What a search for the missing effect ends with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fibrefit.core.check import Check
from fibrefit.core.units import format_quantity
from fibrefit.discovery.model.law import ProposedLaw
from fibrefit.fitting.result import Identification
from fibrefit.laws.law import Effect
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
    """

    summary: Round
    residuals: np.ndarray | None = None
    residuals_with: tuple[np.ndarray, ...] = ()

    @property
    def added(self) -> tuple[str, ...]:
        """Names of the effects that were added in it."""
        return tuple((self.summary.added or "").split(" + "))


SMALL = 0.05
"""Share of the signal below which an effect is called small."""
SURE = 5.0
"""Standard errors from which an effect is called systematic."""


def weight_of(effect: str, of_signal: float, signal: str, of_gap: float, standard_errors: float) -> Weight:
    """How much an added effect matters, as a `Weight` has it, with a sentence."""
    sure, small = standard_errors >= SURE, of_signal < SMALL
    times = f"{standard_errors:.0f}" if sure else f"{standard_errors:.2g}"
    says = f"{effect} makes up {100.0 * of_signal:.2g} % of the {signal} and accounts for {100.0 * of_gap:.0f} % of "
    if sure:
        ending = ": small but systematic." if small else "."
        says += f"the gap; its strength is {times} times its standard error{ending}"
    else:
        says += f"the gap, but its strength is only {times} times its standard error."
    return Weight(
        effect=effect,
        share_of_signal=of_signal,
        signal=signal,
        share_of_gap=of_gap,
        standard_errors=standard_errors,
        says=says,
    )


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


LITTLE = 0.97
"""Factor on the likeness that is no great help."""
NO_HELP = "That is little: it takes another kind of test."


def _condition(name: str, value: float) -> str:
    if name == "inclination":
        return f"{np.degrees(value):.3g} deg"
    return format_quantity(value, "kg" if name.endswith("mass") else "m", 3)


def _changed(choice: Choice) -> str:
    parts = [f"{name} {_condition(name, value)}" for name, value in choice.conditions.items()]
    for factor, how in ((choice.pace, "fast"), (choice.size, "far")):
        if factor != 1.0:
            parts.append(f"its input run {'half' if factor < 1.0 else 'twice'} as {how}")
    return ", ".join(parts)


def said_of(choice: Choice, record: str) -> str:
    """A record of a menu in words."""
    changed = _changed(choice)
    return f"A record like {record} with {changed}" if changed else f"{record} once more"


def _separation(pair: tuple[str, str], choice: Choice, record: str, says: str, **measures: float) -> Separation:
    begin = f"To tell {pair[0]} from {pair[1]}, the best further record is one like {record} with {_changed(choice)}"
    return Separation(
        pair=pair,
        record=record,
        conditions=dict(choice.conditions),
        pace=choice.pace,
        size=choice.size,
        **measures,
        says=f"{begin}: {says}",
    )


def split(pair: tuple[str, str], choice: Choice, record: str, before: float, after: float) -> Separation:
    """The further record by which two effects of unknown size become least alike.

    Parameters
    ----------
    pair : tuple of str
    choice : Choice
        What to measure.
    record : str
        The one of the study it is like.
    before, after : float
        Cosines of the sensitivities without it and with it.
    """
    says = f"the |cosine| of their sensitivities falls from {before:.3f} to {after:.3f}."
    if after > LITTLE * before:
        says += f" {NO_HELP}"
    return _separation(pair, choice, record, says, cosine_before=before, cosine_after=after)


def separating(pair: tuple[str, str], choice: Choice, record: str, before: float, after: float) -> Separation:
    """The further record of which two explanations, with the values found, predict the most different things.

    Parameters
    ----------
    pair, choice, record
        As for `split`.
    before, after : float
        Rms differences in units of the noise: the largest of a record at hand, and there.
    """
    says = f"there they predict readings that differ by {after:.2g} times the noise (rms), {before:.2g} times in the "
    says += "records at hand."
    if after <= before / LITTLE:
        says += f" {NO_HELP}"
    return _separation(pair, choice, record, says, apart_before=before, apart_after=after)


@dataclass(frozen=True)
class Finding:
    """Result of a search.

    Parameters
    ----------
    verdict : Verdict
    reason : str
        Why, in words.
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
        Of the last look for more, whether or not anything was added.
    seconds : float
    weights : tuple of Weight
        Of what was added.
    detectable : tuple of Detectable
        Smallest strength of each effect that would have been found, where nothing is missing; without those that were
        not tried, as there was nothing left for them.
    proposed_law : ProposedLaw or None
        What accounts for what is missing, where a law does better than any curve; `after` is with it.
    untried : tuple of str
        Effects that the time did not suffice for.
    undone : tuple of str
        Other parts of the search that it did not suffice for, in words.
    broken : tuple of Check
        Those of the first fit that leave nothing to search from; the reason, where there are any.
    """

    verdict: Verdict
    reason: str
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
