"""Whether the minimum that is reported is the best one: ends of other starts and of a second solver held against it.

Measured inputs leave residuals in every minimum of plain least squares, and so do records that differ: there starts end
in many places, none of which is where the likelihood has its mode. What they say of that shows once it is followed
from each of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fibrefit.fitting import checks as judge
from fibrefit.fitting.error_bars import convergence_unit
from fibrefit.fitting.estimates import ErrorBars, GlsEstimate
from fibrefit.fitting.reported import Reported
from fibrefit.fitting.result import Starts
from fibrefit.fitting.search.each_by_itself import means
from fibrefit.fitting.search.optimum import Optimum, optimum
from fibrefit.fitting.search.solve import linearised
from fibrefit.fitting.thresholds import FEW_STARTS
from fibrefit.problem.estimate.gauss_newton import Effort, mode
from fibrefit.problem.estimate.normal_equations import place_of
from fibrefit.problem.task import Task
from fibrefit.study.summaries.check import Check

FOLLOWED = Effort(patience=6)
"""How far the likelihood is followed from another minimum: what creeps ends in another one."""


class SecondSolver(NamedTuple):
    """Where another solver ended.

    Parameters
    ----------
    values : (n_free,) in SI units
    distance : float
        From the best values, in standard errors for white noise.
    gain : float
        By how much its cost is lower, in units of the residual variance.
    """

    values: np.ndarray
    distance: float
    gain: float


class Led(NamedTuple):
    """Where the likelihood leads from another minimum.

    Parameters
    ----------
    distance : float
        From the values that are reported and all records share, in their standard errors.
    nats : float
        By how much it is less probable there.
    """

    distance: float
    nats: float


@dataclass(frozen=True)
class Minima:
    """The minimum that is reported beside the others that were found.

    Parameters
    ----------
    task : Task
    starts : Starts
    second : SecondSolver or None
    plain : Optimum
    bars : ErrorBars
        Of the plain estimate.
    best : Reported
    compared : bool
        Whether, where inputs are noisy, others are followed to their ends.
    """

    task: Task
    starts: Starts
    second: SecondSolver | None
    plain: Optimum
    bars: ErrorBars
    best: Reported
    compared: bool

    @property
    def unit(self) -> float:
        """Of a change of the cost: what noise that has a memory makes of a residual's square."""
        return convergence_unit(self.plain.problem, self.bars)

    def starts_agree(self) -> Check:
        """Whether other starts end where the best one does, or are less probable."""
        if self._likelihood is None:
            return judge.starts_agree(self.starts, self._size_of_noise, self._nats_as_fitted())
        check = judge.starts_agree(self.starts, self._size_of_noise)
        noise = self.best.sound.may_be_noise
        return check if check.passed or not noise else judge.starts_agree(self.starts, noise, self._nats())

    def second_solver_agrees(self) -> Check:
        """Whether another solver ends at the same values, or at less probable ones."""
        if self.second is None:
            return judge.no_second_solver()
        check = judge.second_solver(self.second.distance / self.unit, self.second.gain)
        if check.passed or self._likelihood is None:
            return check
        led = _led(self._likelihood, self.second.values)
        return judge.led_by_second_solver(led.distance, led.nats)

    @property
    def _likelihood(self) -> GlsEstimate | None:
        """In which others are followed to their ends."""
        return self.best.gls if self.compared and self.best.input_errors else None

    @property
    def _size_of_noise(self) -> bool:
        return self.best.sound.gap.passed

    def _nats(self) -> float:
        """By how many nats the next place is less probable to which the likelihood leads from any of the best ends."""
        assert self._likelihood is not None
        ends = [self.starts.values[int(np.argmin(self.starts.cost))], *self.starts.others()]
        led = [_led(self._likelihood, values) for values in ends]
        # Ends that differ by less than their error bars say the same.
        return min((one.nats for one in led if one.distance > 1.0), default=np.inf)

    def _nats_as_fitted(self) -> float:
        """The same where there is no likelihood: of the next minimum, errors of measured inputs taken off."""
        starts, inputs = self.starts, bool(self.plain.input_errors)
        if not judge.undecided(starts, self._size_of_noise, fewest=1 if inputs and self.compared else FEW_STARTS):
            return 0.0
        if not inputs:
            # The two bounces that a wrong minimum misses may be few samples of many, and still more than noise.
            return 0.5 * float(starts.cost[starts.basin > 0].min() - starts.cost.min()) / self.unit**2
        for other in self._others():
            if np.any(np.abs(other.values - self.plain.values) > self.bars.errors[self.bars.method]):
                return 0.5 * (_objective(other) - _objective(self.plain)) / self.unit**2
        return np.inf if self.compared else 0.0

    def _others(self) -> Iterator[Optimum]:
        return (optimum(self.task, values) for values in (self.starts.others() if self.compared else ()))


def _led(gls: GlsEstimate, values: np.ndarray) -> Led:
    """Where the likelihood of an estimate leads from values ``(n_free,)``; nowhere is infinitely improbable."""
    found, layout = gls.evidence.mode, gls.seen.problem.layout
    unknowns, local = found.unknowns, np.asarray(layout.local(values))
    end = mode(unknowns, place_of(unknowns, local), gls.seen.gram(unknowns), found.sigma, effort=FOLLOWED)
    nats = 0.5 * (end.objective - found.objective)
    if not np.isfinite(nats):
        return Led(np.inf, np.inf)
    # A mean and deviations from it may still creep against each other where the records are at rest.
    here, there = (means(layout, one.local) for one in (found, end))
    errors = gls.bars.errors[gls.bars.method]
    shared = np.array([record is None for _, record in layout.entries])
    known = shared & np.isfinite(errors) & (errors > 0.0)
    return Led(float(np.max(np.abs(there - here)[known] / errors[known], initial=0.0)), float(nats))


def _objective(end: Optimum) -> float:
    """Sum of squares of what is left and of the errors that were taken off the inputs, each in units of its own."""
    errors = sum(float(np.sum(np.square(waves))) for waves in end.coefficients.values())
    left = float(np.sum(np.square(linearised(end.problem, end.local).residuals)))
    return left + errors if np.isfinite(left) else np.inf  # where a motion is lost there are no numbers
