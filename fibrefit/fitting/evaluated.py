"""An estimate beside all that is known of its search: the one object that checks are functions of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from fibrefit.fitting.error_bars import convergence_unit, estimates
from fibrefit.fitting.gls import GlsEstimate
from fibrefit.fitting.residuals import Evaluation, loudness, readings_at_rest
from fibrefit.fitting.result import Estimate, Gap, PlainEstimate, Starts, Why, record_sizes
from fibrefit.fitting.search.optimum import Ended, Optimum
from fibrefit.fitting.search.rescue import SecondSolver
from fibrefit.fitting.thresholds import LOUDER_THAN_AT_REST
from fibrefit.fitting.uncertainty import ErrorBars
from fibrefit.fitting.values import Weakness, weaknesses
from fibrefit.laws.families import instants
from fibrefit.problem import ForceBalance, InputCoefficients, Noise, Problem, ResidualSet, Task, error_rms, input_errors
from fibrefit.study.summaries.check import SIZE, Check
from fibrefit.study.summaries.results import ChannelGap, InputErrorSummary


class How(NamedTuple):
    """How a task is identified.

    Parameters
    ----------
    robust, profile : bool
        Let residuals beyond `SOFT_BEYOND` times the noise count less; give shared parameters profile intervals.
    whiten : bool
        Whether to whiten where inputs are noisy too, which takes long.
    rivals : bool
        Whether to see, where inputs are noisy, what other minima, each record by itself and models with one law more
        are worth, which takes as long as all the rest.
    often : bool
        Whether many tasks of like shapes follow, so that it is worth while to compile more programs for them.
    ended : Ended, optional
        Where a search ended, at the values of the start: the likelihood begins from there as well, and where errors of
        measured inputs are known, nothing is searched anew.
    """

    robust: bool = False
    profile: bool = False
    whiten: bool = True
    rivals: bool = True
    often: bool = False
    ended: Ended | None = None

    @property
    def known(self) -> Ended | None:
        """Where a search ended that found errors of measured inputs too; None where it is searched for."""
        return None if self.ended is None or self.ended.coefficients is None else self.ended


class SearchEnd(NamedTuple):
    """Where a search ended, whatever is reported.

    Parameters
    ----------
    second : SecondSolver or None
        Where another solver ended; None where none was run.
    plain : Optimum
        Of plain least squares.
    bars : ErrorBars
        Of the plain estimate, in the noise that it leaves.
    """

    task: Task
    how: How
    starts: Starts
    second: SecondSolver | None
    plain: Optimum
    bars: ErrorBars

    @property
    def success(self) -> bool:
        """Whether any start came to an end."""
        return bool(np.isfinite(self.starts.cost.min()))

    @property
    def unit(self) -> float:
        """Standard errors over those for white noise: a change of the cost counts in units of the square of that."""
        return convergence_unit(self.plain.problem, self.bars)


@dataclass(frozen=True)
class EvaluatedEstimate:
    """An estimate that may be reported, and why it is this one.

    Parameters
    ----------
    search : SearchEnd
    optimum : Optimum
        The plain estimate it is, or that it began from.
    problem : Problem
        Errors found taken off its inputs.
    values : (n_free,) in SI units
    residuals : (n_record, n_channel, n_time) in units of the noise
    noise : sequence of Noise
        That is left in each channel.
    bars : ErrorBars
    gls : GlsEstimate or None
        None where it is a plain one.
    seen : Evaluation
    coefficients : mapping of input to (n_record, n_wave)
    predicted_decrease : float
        Of the cost, by one step more, in units of the residual variance.
    hausman : tuple of Check
        Whether plain and whitened estimate agree, where they could be compared.
    outcomes : dict of identifier to Checks
        Of the checks it was put to so far; see `fibrefit.fitting.checks.run`.
    """

    search: SearchEnd
    optimum: Optimum
    problem: Problem
    values: np.ndarray
    residuals: np.ndarray
    noise: Sequence[Noise]
    bars: ErrorBars
    gls: GlsEstimate | None
    seen: Evaluation
    coefficients: InputCoefficients
    predicted_decrease: float
    why: Why = field(default_factory=Why)
    hausman: tuple[Check, ...] = ()
    outcomes: dict[str, tuple[Check, ...]] = field(default_factory=dict)

    @property
    def expected_gap(self) -> float:
        """Gap of a perfect model."""
        return self.optimum.expected_gap if self.gls is None else self.gls.expected_gap

    @property
    def rough(self) -> bool:
        """Whether errors of measured inputs, or noise and differences between records, were fitted with the values."""
        return self.gls is not None or bool(self.optimum.input_errors)

    @property
    def estimator(self) -> str:
        """Name of the method."""
        return "ordinary least squares" if self.gls is None else "generalised least squares"

    @cached_property
    def residual_set(self) -> ResidualSet:
        """What it leaves, with the noise of the rests and that which is left."""
        task = self.search.task
        fitted = dict(zip(task.problem.model.rig.channels, self.noise, strict=True))
        rests, stated = readings_at_rest(task), task.noise_given
        return ResidualSet(task.problem, self.residuals, self.seen.motion, task.noise, fitted, rests, stated)

    @cached_property
    def expected_in_motion(self) -> float:
        """Gap of a perfect model in noise that is louder in motion than at rest."""
        of = self.residual_set
        return self.expected_gap * float(np.sqrt(np.mean([loudness(of, c) ** 2 for c in range(len(of.channels))])))

    @property
    def bars_of_noise(self) -> ErrorBars:
        """Error bars for noise alone, whatever was allowed for besides."""
        return replace(self.bars, method=self.bars.of_noise or self.bars.method, of_noise="")

    @cached_property
    def input_errors(self) -> Mapping[str, InputErrorSummary]:
        """Errors of measured inputs, of the size that they have here."""
        found, task = self.optimum.input_errors, self.search.task
        if self.gls is None or not self.coefficients:
            return found
        rms = error_rms(task.problem, input_errors(task), self.coefficients)
        return {name: error.model_copy(update={"rms": rms[name]}) for name, error in found.items()}

    @cached_property
    def plain_estimate(self) -> PlainEstimate:
        """The plain estimate, whatever is reported."""
        plain, bars = self.search.plain, self.search.bars
        return PlainEstimate(plain.values, bars.errors[bars.method], plain.local, plain.differ)

    @cached_property
    def estimates(self) -> tuple[Estimate, ...]:
        """Of all values, as they are reported."""
        plain = None if self.gls is None else self.plain_estimate
        return estimates(self.problem, self.values, self.bars, plain, self.gls)

    @cached_property
    def weak(self) -> tuple[Weakness, ...]:
        """What the records do not determine.

        Instants are not asked for, as slopes say nothing of them, nor are nuisances of each record.
        """
        declared = {parameter.name for parameter in self.problem.model.parameters}
        unjudged = {*instants(self.problem.model.effects), *(set(self.problem.layout.names) - declared)}
        normal = self.search.plain.scores.normal_matrix()
        return weaknesses(self.problem.layout, self.values, self.bars.covariance, normal, unjudged)

    @cached_property
    def balance(self) -> ForceBalance | None:
        """Of the force that drives the rig, by inverse dynamics; None where none does."""
        return ForceBalance.of(self.search.task, self.values)

    @property
    def gaps(self) -> Gap:
        """Gaps of all signals, that of a driving force among them, which has no noise."""
        return self.seen.gap if self.balance_gap is None else {"force": self.balance_gap, **self.seen.gap}

    @property
    def balance_gap(self) -> ChannelGap | None:
        """Gap of the force that drives the rig."""
        force = self.balance
        return None if force is None else ChannelGap.against_noise(float("nan"), force.rms, "N", force.explained)

    def passed(self, *identifiers: str) -> bool:
        """Whether it passed these checks, as far as they could be asked: too few readings say nothing of a structure.

        Of a check that does not apply there is nothing to fail.
        """
        asked = (check for identifier in identifiers for check in self.outcomes[identifier])
        return all(check.passed or not check.facts.get("tried", True) for check in asked)

    @property
    def like_noise(self) -> bool:
        """Whether residuals have the structure of noise, however loud they are."""
        return self.passed("residual_spectrum", "residual_phase", "residual_state")

    def is_noise_unlike(self, other: EvaluatedEstimate) -> bool:
        """Whether it leaves noise by its size or by its structure where another one does not.

        A spectrum that is not quite right is no reason to take records for alike that are not, nor is noise that is a
        little louder than at rest, as slow noise is. What a model lacks shows in both, whichever values it has.
        """
        return (self.passed(SIZE) and not other.passed(SIZE)) or (self.like_noise and not other.like_noise)

    @property
    def may_be_noise(self) -> bool:
        """Whether residuals are noise by their size, or have its structure and are a little louder in any record.

        Slow noise is louder than a rest shows. A record that is not followed to its end leaves more.
        """
        loudest = max(record_sizes(self.seen.record_gaps).values())
        louder = self.like_noise and loudest <= LOUDER_THAN_AT_REST * self.expected_gap
        return self.passed(SIZE) or louder
