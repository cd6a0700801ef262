"""What a search for the missing effect ends with."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fibrefit.core.units import format_quantity
from fibrefit.discovery.model.law import ProposedLaw
from fibrefit.effects.law import Effect
from fibrefit.fitting.result import Identification

VERDICTS = ("nothing_missing", "named", "unexplained", "not_trusted")


@dataclass(frozen=True)
class Place:
    """A stretch of a record in which model and measurement part.

    Parameters
    ----------
    record, channel, phase : str
    from_s, to_s : float, in s
    share : float
        Of the whole gap beyond noise, 0 to 1.
    """

    record: str
    channel: str
    phase: str
    from_s: float
    to_s: float
    share: float


@dataclass(frozen=True)
class Candidate:
    """An effect that was tried.

    Parameters
    ----------
    effect : str
        Name; several joined by " + " where they were tried together.
    gap_after : float
    evidence : float
        Natural logarithm of the Bayes factor against the model before the round.
    parameters : dict of str to (value, standard error, unit)
        Of the effect, in SI units.
    gap_foreseen : float
        Normalised residual RMS of all records, each predicted from the others; nan where that was not asked.
    false_alarm : float
        Probability that the best of all candidates reaches as much although nothing is missing.
    """

    effect: str
    gap_after: float
    evidence: float
    parameters: Mapping[str, tuple[float, float, str]]
    gap_foreseen: float = math.nan
    false_alarm: float = math.nan


@dataclass(frozen=True)
class Round:
    """One effect added.

    Parameters
    ----------
    added : str
    gap_before, gap_after : float
    where : tuple of Place
        Where the model before separating_experiment from the measurement.
    ranking : tuple of Candidate
        Best first.
    sentence : str
    left : (n_record, n_channel, n_time) or None
        Residuals of the model before, simulated minus measured, in units of the noise.
    left_with : tuple of (n_record, n_channel, n_time)
        The same with each of the first of the ranking.
    """

    added: str
    gap_before: float
    gap_after: float
    where: tuple[Place, ...]
    ranking: tuple[Candidate, ...]
    sentence: str
    left: np.ndarray | None = None
    left_with: tuple[np.ndarray, ...] = ()


@dataclass(frozen=True)
class Unexplained:
    """What no effect accounts for.

    Parameters
    ----------
    gap : float
    where : tuple of Place
    looks_like : str
        Empty where nothing is left.
    """

    gap: float
    where: tuple[Place, ...] = ()
    looks_like: str = ""


@dataclass(frozen=True)
class FreeCurve:
    """What is missing, as an unknown curve of one state of the rig on the model that is kept.

    Parameters
    ----------
    variable : str
        What it depends on.
    says : str
        What it is, in words.
    unit, height_unit : str
        SI units of the variable and of the heights.
    knots, heights : (n_knot,) in SI units
        Heights without their median: what is the same everywhere, the model can do without the curve.
    errors : (n_knot,) in SI units
        Standard error of each height; of the shape, not of the level.
    seconds : (n_knot,) in s
        Time the simulated motion spends nearest to each knot.
    acts : (float, float) or None
        From where to where it acts, in SI units, where that is one end of its range.
    gap_after : float
        With the curve in the model.
    cost : float
        Sum of squared residuals over the noise, and what chance gives to so many knots.
    law : (n_knot,) in SI units, or None
        Heights of the law that was proposed in its place.
    """

    variable: str
    says: str
    unit: str
    height_unit: str
    knots: np.ndarray
    heights: np.ndarray
    errors: np.ndarray
    seconds: np.ndarray
    acts: tuple[float, float] | None
    gap_after: float
    cost: float
    law: np.ndarray | None = None


SMALL = 0.05
"""Share of the signal below which an effect is called small."""
SURE = 5.0
"""Standard errors from which an effect is called systematic."""


@dataclass(frozen=True)
class Weight:
    """How much an added effect matters.

    Parameters
    ----------
    effect : str
    share_of_signal : float
        What it explains over what was measured, both rms.
    signal : str
        What was measured: ``force`` where a force drives the rig, else ``readings``, each in units of its noise.
    share_of_gap : float
        Of the squared gap beyond noise, 0 to 1.
    standard_errors : float
        By which its strength differs from nothing.
    """

    effect: str
    share_of_signal: float
    signal: str
    share_of_gap: float
    standard_errors: float

    @property
    def says(self) -> str:
        """All of it in a sentence."""
        sure, small = self.standard_errors >= SURE, self.share_of_signal < SMALL
        times = f"{self.standard_errors:.0f}" if sure else f"{self.standard_errors:.2g}"
        found = f"{self.effect} makes up {100.0 * self.share_of_signal:.2g} % of the {self.signal} and accounts for "
        found += f"{100.0 * self.share_of_gap:.0f} % of the gap"
        if not sure:
            return f"{found}, but its strength is only {times} times its standard error."
        found += f"; its strength is {times} times its standard error"
        return f"{found}: small but systematic." if small else f"{found}."


@dataclass(frozen=True)
class HeldOut:
    """How a record is predicted by a model fitted to the others, only its own zero and start left to it.

    Parameters
    ----------
    record : str
    gap_before, gap_after : float
        Of the model before the search and of the one after.
    """

    record: str
    gap_before: float
    gap_after: float


@dataclass(frozen=True)
class Direction:
    """What one effect would do to the records.

    Parameters
    ----------
    effect, parameter, unit : str
    detectable : float
        Smallest strength that would be found in these records, in `unit`; infinite if none would. For a parameter that
        vanishes at infinity, the largest value.
    unique : float
        Share of the change that base parameters and nuisances cannot imitate, 0 to 1.
    """

    effect: str
    parameter: str
    unit: str
    detectable: float
    unique: float


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


@dataclass(frozen=True)
class Further:
    """The further record that best tells two effects apart.

    Parameters
    ----------
    pair : tuple of str
    choice : Choice
        What to measure.
    record : str
        The one of the study it is like.
    before, after : float
        How far it tells them apart: without it, and with it.
    """

    pair: tuple[str, str]
    choice: Choice
    record: str
    before: float
    after: float

    @property
    def _record(self) -> str:
        says = f"To tell {self.pair[0]} from {self.pair[1]}, the best further record is one like {self.record} with "
        return says + _changed(self.choice)


class Split(Further):
    """That by which two effects of unknown size become least alike: `before` and `after` are cosines."""

    @property
    def says(self) -> str:
        """The record in a sentence."""
        says = f"{self._record}: their likeness falls from {self.before:.3f} to {self.after:.3f}."
        return f"{says} {NO_HELP}" if self.after > LITTLE * self.before else says


class SeparatingExperiment(Further):
    """That of which two explanations, with the values found, predict the most different things.

    `before` and `after` are rms differences in units of the noise: the largest of a record at hand, and there.
    """

    @property
    def says(self) -> str:
        """The record in a sentence."""
        says = f"{self._record}: there they predict readings that differ by {self.after:.2g} times the noise (rms), "
        says += f"{self.before:.2g} times in the records at hand."
        return says if self.after > self.before / LITTLE else f"{says} {NO_HELP}"


@dataclass(frozen=True)
class Finding:
    """Result of a search.

    Parameters
    ----------
    verdict : str
        One of `VERDICTS`.
    reason : str
        Why, in words.
    added : tuple of Effect classes
    rounds : tuple of Round
    cannot_tell_apart : tuple of tuple of str
        Classes of effects that explain the records alike.
    partings : tuple of SeparatingExperiment
        The further records that would tell those apart, where records of the rig can be varied.
    unexplained : Unexplained
    before, after : Identification
        Of the model before and after the search.
    held_out : tuple of HeldOut
    ranking : tuple of Candidate
        Of the last look for more, whether or not anything was added.
    seconds : float
    weights : tuple of Weight
        Of what was added.
    detectable : tuple of Direction
        Smallest strength of each effect that would have been found, where nothing is missing; without those that were
        not tried, as there was nothing left for them.
    curves : tuple of FreeCurve
        What an unexplained gap looks like, best first.
    proposed_law : ProposedLaw or None
        What accounts for what is missing, where a law does better than any curve; `after` is with it.
    untried : tuple of str
        Effects that the time did not suffice for.
    undone : tuple of str
        Other parts of the search that it did not suffice for, in words.
    """

    verdict: str
    reason: str
    added: tuple[type[Effect], ...]
    rounds: tuple[Round, ...]
    cannot_tell_apart: tuple[tuple[str, ...], ...]
    unexplained: Unexplained
    before: Identification
    after: Identification
    held_out: tuple[HeldOut, ...]
    ranking: tuple[Candidate, ...]
    seconds: float
    weights: tuple[Weight, ...] = ()
    detectable: tuple[Direction, ...] = ()
    partings: tuple[SeparatingExperiment, ...] = ()
    curves: tuple[FreeCurve, ...] = ()
    proposed_law: ProposedLaw | None = None
    untried: tuple[str, ...] = ()
    undone: tuple[str, ...] = ()
