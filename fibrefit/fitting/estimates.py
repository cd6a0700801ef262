"""What an estimate is: its error bars, and the one that weighs whitened residuals (generalised least squares)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fibrefit.problem.estimate.evidence import MarginalLikelihood
from fibrefit.problem.inputs.errors_in_variables import InputCoefficients
from fibrefit.problem.linear_model.view import View
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.study.summaries.results import BetweenRecordsSummary

NOT_ARRIVED = "convergence of the solver"
"""Quantity of the check that fails where an estimate is not quite at its minimum."""


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

    identifier: str
    ratio: float = math.nan
    failed: tuple[str, ...] = ()

    @property
    def left(self) -> tuple[str, ...]:
        """Of what failed, what says that residuals are not noise: a search that has not quite arrived does not."""
        return tuple(quantity for quantity in self.failed if quantity != NOT_ARRIVED)


def interval_of_shared(evidence: MarginalLikelihood, index: int) -> tuple[float, float]:
    """Ends of the 95 % interval of a shared value in SI units, over all standard deviations between records.

    Parameters
    ----------
    evidence : MarginalLikelihood
    index : int
        Of the value among the shared ones.
    """
    mean, here = evidence.mean, np.arange(len(evidence.mean)) == index
    ends = (evidence.mode.unknowns.value(np.where(here, z, mean))[index] for z in evidence.interval_95(index))
    # The typical value of a strength may lie below its null: its coordinate falls then as it rises.
    low, high = sorted(map(float, ends))
    return low, high


def kind_of_interval(name: str, between: Mapping[str, BetweenRecordsSummary]) -> str:
    """Of what the interval of a shared value is: of the mean of a population where records differ in it.

    Parameters
    ----------
    name : str
    between : mapping of str to BetweenRecordsSummary
        How much records differ, for each value that may.
    """
    return "population" if name in between and between[name].found else "normal"


@dataclass(frozen=True)
class ErrorBars:
    """Covariances ``(n_free, n_free)`` of one estimate.

    Parameters
    ----------
    covariances : mapping of method to (n_free, n_free)
    method : str
        The one that is believed.
    of_noise : str
        The one that was believed before what the model lacks was allowed for; empty where nothing was.
    inverse : (n_free, n_free), optional
        Of the normal matrix, by which values follow the centres of their priors; None where that is the covariance.
    """

    covariances: Mapping[str, np.ndarray]
    method: str
    of_noise: str = ""
    inverse: np.ndarray | None = None

    @property
    def covariance(self) -> np.ndarray:
        """The one that is believed."""
        return self.covariances[self.method]

    @property
    def errors(self) -> dict[str, np.ndarray]:
        """Standard errors ``(n_free,)`` by method."""
        return {name: np.sqrt(np.diag(matrix)) for name, matrix in self.covariances.items()}


@dataclass(frozen=True)
class GlsEstimate:
    """The estimate at the mode of the likelihood.

    Parameters
    ----------
    values : (n_free,) in SI units
        Shared ones: means over the standard deviations between records; the records' own at the mode.
    local : (n_record, n_local) in SI units
        Values of each record, its deviations in them.
    residuals : (n_record, n_channel, n_time) in units of the noise
        There, errors of the inputs at their best.
    intervals : (n_free, 2) in SI units
        Of 95 %.
    between : mapping of name to BetweenRecordsSummary
        How much records differ.
    noise : tuple of Noise
        Of each channel, in SI units.
    coefficients : mapping of input to (n_record, n_wave)
    expected_gap : float
        Of a perfect model.
    """

    values: np.ndarray
    local: np.ndarray
    residuals: np.ndarray
    bars: ErrorBars
    intervals: np.ndarray
    between: Mapping[str, BetweenRecordsSummary]
    noise: tuple[Noise, ...]
    evidence: MarginalLikelihood
    seen: View
    coefficients: InputCoefficients
    expected_gap: float

    @property
    def records_differ(self) -> bool:
        """Whether records differ."""
        return any(one.found for one in self.between.values())
