"""What an identification ends with: values, how sure they are, and what they were put to."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from fibrefit.fitting.gls import GlsEstimate
from fibrefit.problem import InputCoefficients, Motion, Noise, Problem, ResidualSet
from fibrefit.study.summaries.check import Check, Status, status_by
from fibrefit.study.summaries.results import BetweenRecordsSummary, ChannelGap, InputErrorSummary, ParameterSummary


class Advice(NamedTuple):
    """What to do next; `fibrefit.report.sentences` says it.

    Parameters
    ----------
    identifier : str
        ``"lone_samples"``, ``"slack_zero"``, ``"correct"``, ``"widen"``, ``"search"``, ``"rest"``, ``"way_back"``,
        ``"force_alone"``, ``"another_test"`` or ``"further_record"``.
    facts : mapping of str to object
        What a sentence needs besides.
    """

    identifier: str
    facts: Mapping[str, Any] = MappingProxyType({})


NOT_ARRIVED = "convergence of the solver"
"""Quantity of the check that fails where an estimate is not quite at its minimum."""


class Found(NamedTuple):
    """What a check found.

    Parameters
    ----------
    statistic : float, optional
    facts : mapping of str to object
        What its sentence needs besides.
    passed : bool, optional
        Whether it passed, where the threshold alone does not say.
    instead : mapping of str to object
        Fields of the check that are others here than the table has.
    of : str
        What it is a check of, where there are several.
    """

    statistic: float | None = None
    facts: Mapping[str, Any] = MappingProxyType({})
    passed: bool | None = None
    instead: Mapping[str, Any] = MappingProxyType({})
    of: str = ""


class Why(NamedTuple):
    """Why an estimate is reported.

    Parameters
    ----------
    identifier : str
        ``"gls"``, ``"loses_less"`` (bounces than values all records share), ``"louder"`` (noise than at rest, else like
        it), or why there is no GLS step: ``"robust"``,
        ``"no_end"``, ``"in_a_search"``, ``"no_time"``, ``"not_noise"``, ``"not_converged"``.
    ratio : float
        Of its standard errors to those of ordinary least squares.
    failed : tuple of str
        Quantities whose checks failed.
    """

    identifier: str = "not_converged"
    ratio: float = math.nan
    failed: tuple[str, ...] = ()

    @property
    def left(self) -> tuple[str, ...]:
        """Of what failed, what says that residuals are not noise: a search that has not quite arrived does not."""
        return tuple(quantity for quantity in self.failed if quantity != NOT_ARRIVED)


class Estimate(NamedTuple):
    """One value after the data have spoken, in SI units.

    Parameters
    ----------
    record : str or None
        The record whose value it is; None for all.
    found : ParameterSummary
        As the summary tells it.
    """

    name: str
    record: str | None
    found: ParameterSummary


Gap = Mapping[str, ChannelGap]


def total(gap: Gap) -> float:
    """Root of the mean of the squared ratios of all channels."""
    return float(np.sqrt(np.mean([math.nan if one.ratio is None else one.ratio**2 for one in gap.values()])))


def record_sizes(record_gaps: Mapping[str, Gap]) -> dict[str, float]:
    """The same of each record."""
    return {name: total(gap) for name, gap in record_gaps.items()}


FURTHER = 2
"""Minima beside the best that errors of measured inputs are taken off in, too."""


@dataclass(frozen=True)
class Starts:
    """Where the search began and ended.

    Parameters
    ----------
    names : tuple of str
        Shared free parameters.
    began, ended : (n_start, n_name) in SI units
    values : (n_start, n_free) in SI units
        All free values at the end.
    cost : (n_start,)
        Sum of squared residuals in units of the noise.
    steps : (n_start,) int
    basin : (n_start,) int
        0 for the best minimum, then by cost; -1 where the solver gave up.
    planned : int
        Number of starts requested, those that were not reached included.
    followed : bool
        Whether it is the one start from where a search of many models ended, which is evidence of its own.
    """

    names: tuple[str, ...]
    began: np.ndarray
    ended: np.ndarray
    values: np.ndarray
    cost: np.ndarray
    steps: np.ndarray
    basin: np.ndarray
    planned: int = 0
    followed: bool = False

    @property
    def tried(self) -> int:
        """Number of starts."""
        return len(self.cost)

    @property
    def agreeing(self) -> int:
        """Number that ended in the best minimum."""
        return int(np.sum(self.basin == 0))

    @property
    def best(self) -> tuple[np.ndarray, float]:
        """Values ``(n_free,)`` in SI units of the end that costs least, and that cost."""
        place = int(np.argmin(self.cost))
        return self.values[place], float(self.cost[place])

    @property
    def excess(self) -> float:
        """Residuals of the next minimum over those of the best; infinite where there is none."""
        others = self.basin > 0
        return float(np.sqrt(self.cost[others].min() / self.cost.min())) if others.any() else np.inf

    def ended_elsewhere(self) -> Starts:
        """The same starts, none of which ended in the best minimum."""
        return replace(self, basin=self.basin + (self.basin >= 0))

    def others(self) -> list[np.ndarray]:
        """Best ends ``(n_free,)`` of the next `FURTHER` minima, in SI units."""
        ends = [np.where(self.basin == label, self.cost, np.inf) for label in range(1, FURTHER + 1)]
        return [self.values[int(np.argmin(end))] for end in ends if np.isfinite(end).any()]


@dataclass(frozen=True)
class PlainEstimate:
    """Where plain least squares ended, whatever is reported, in SI units.

    Parameters
    ----------
    values, errors : (n_free,)
        The errors that are reported.
    local : (n_record, n_local)
        Values of each record.
    differ : bool
        Whether records have values of their own, of which those that they share are the means.
    """

    values: np.ndarray
    errors: np.ndarray
    local: np.ndarray
    differ: bool


@dataclass(frozen=True)
class Identification:
    """Result of a least-squares identification; all numbers in SI units.

    Parameters
    ----------
    values : (n_free,)
    covariance : (n_free, n_free)
        The one that is reported.
    method : str
        Where it comes from.
    error_inflation : float
        Median ratio of reported to white standard errors of the shared parameters.
    estimates : tuple of Estimate
        Shared parameters first, then those of each record.
    balance : ChannelGap or None
        Of the force that drives the rig, by inverse dynamics; None where none does.
    seconds, compiling : float
        Time it took in s, and what of that went to compiling programs.
    expected_gap : float
        Of a perfect model: less than 1 where errors of measured inputs are fitted and take some of the noise with them.
    record_gaps : dict of record to Gap
    noise : dict of channel to Noise
    readings : dict of channel to (n_record, n_time)
    residuals : (n_record, n_channel, n_time) in units of the noise
    advice : tuple of Advice
        What to measure or try next.
    estimator : str
        ``"ordinary least squares"`` or ``"generalised least squares"``.
    why : Why
        Which of them the values are of, and why.
    gls : GlsEstimate or None
        The whitened estimate, where it is the one reported.
    input_errors : dict of input to InputErrorSummary
    coefficients : dict of input to (n_record, n_wave)
        The errors themselves, see `fibrefit.problem.inputs.errors_in_variables`.
    cut_short : bool
        Whether a step ended for lack of time where it would have gone on: a motion may be lost for that alone.
    """

    problem: Problem
    values: np.ndarray
    covariance: np.ndarray
    method: str
    error_inflation: float
    estimates: tuple[Estimate, ...]
    gap: Gap
    expected_gap: float
    record_gaps: Mapping[str, Gap]
    noise: Mapping[str, Noise]
    readings: Mapping[str, np.ndarray]
    residuals: np.ndarray
    motion: Motion
    starts: Starts
    checks: tuple[Check, ...]
    advice: tuple[Advice, ...]
    seconds: float
    estimator: str
    why: Why
    plain: PlainEstimate
    gls: GlsEstimate | None = None
    input_errors: Mapping[str, InputErrorSummary] = field(default_factory=dict)
    coefficients: InputCoefficients = field(default_factory=dict)
    balance: ChannelGap | None = None
    compiling: float = 0.0
    cut_short: bool = False

    @property
    def running(self) -> float:
        """Time in s that a like fit takes once its programs are there."""
        # Other threads compile in the same time.
        return max(self.seconds - self.compiling, 0.0)

    @property
    def status(self) -> Status:
        """``ok``, ``suspect`` or ``failed``, as the checks have it."""
        return status_by(self.checks)

    @property
    def residual_set(self) -> ResidualSet:
        """What the fit leaves, with the motion and the noise behind it."""
        return ResidualSet(self.problem, self.residuals, self.motion, self.noise)

    @property
    def local(self) -> np.ndarray:
        """Values of each record ``(n_record, n_local)`` in SI units, with its deviations where GLS is reported."""
        return self.plain.local if self.gls is None else self.gls.local

    @property
    def between(self) -> Mapping[str, BetweenRecordsSummary]:
        """How much records differ in each parameter that may deviate, by name; empty unless GLS is reported."""
        return {} if self.gls is None else self.gls.between

    @property
    def parameters(self) -> dict[str, ParameterSummary]:
        """Parameters that all records share, by name."""
        return self.parameters_of(None)

    def parameters_of(self, record: str | None) -> dict[str, ParameterSummary]:
        """Parameters that belong to a record, by name; those that all share for None."""
        return {one.name: one.found for one in self.estimates if one.record == record}
