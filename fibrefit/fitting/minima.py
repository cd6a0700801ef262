"""Whether the minimum that is reported is the best one: ends of other starts and of a second solver held against it.

Measured inputs leave residuals in every minimum of plain least squares, and so do records that differ: there starts end
in many places, none of which is where the likelihood has its mode. What they say of that shows once it is followed
from each of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from fibrefit.core.limits import in_time
from fibrefit.fitting import checks as judge
from fibrefit.fitting.error_bars import convergence_unit
from fibrefit.fitting.estimates import ErrorBars, GlsEstimate
from fibrefit.fitting.reported import Reported
from fibrefit.fitting.result import Starts
from fibrefit.fitting.search.optimum import Optimum, optimum
from fibrefit.fitting.search.solve import linearised
from fibrefit.fitting.thresholds import LESS_PROBABLE
from fibrefit.problem.estimate.gauss_newton import mode
from fibrefit.problem.inputs.errors_in_variables import InputCoefficients
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.study.summaries.check import Check


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
        Of the means over the records from those at the mode, in standard errors of the values they share.
    nats : float
        By how much it is less probable there, at least.
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
        """Standard errors over those for white noise: a change of the cost counts in units of the square of that."""
        return convergence_unit(self.plain.problem, self.bars)

    def starts_agree(self) -> Check:
        """Whether other starts end where the best one does, or are less probable."""
        noise = self.best.sound.gap.passed
        check, compared = judge.starts_agree(self.starts, noise), self.compared and bool(self.plain.input_errors)
        if compared and self.best.gls is not None:
            others = self.starts.others()
            if self.plain.differ:
                # Each record was followed by itself: no start of all of them ended at what is reported.
                elsewhere = replace(self.starts, basin=self.starts.basin + (self.starts.basin >= 0))
                return judge.starts_agree(elsewhere, self.best.may_be_noise, self._nats(self.best.gls, others))
            if check.passed or not (others and self.best.may_be_noise):
                return check
            return judge.starts_agree(self.starts, self.best.may_be_noise, self._nats(self.best.gls, others))
        fitted = compared and noise and not check.passed and bool(self.starts.others())
        if fitted or judge.undecided(self.starts, noise):
            return judge.starts_agree(self.starts, noise, self._nats_as_fitted())
        return check

    def second_solver_agrees(self) -> Check:
        """Whether another solver ends at the same values, or at less probable ones."""
        if self.second is None:
            return judge.no_second_solver()
        check = judge.second_solver(self.second.distance / self.unit, self.second.gain)
        gls = self.best.gls if self.compared and self.plain.input_errors else None
        if gls is None or (check.passed and not self.plain.differ):
            return check
        return judge.led_by_second_solver(*_led(gls, self.second.values))

    def _nats(self, gls: GlsEstimate, others: Sequence[np.ndarray]) -> float | None:
        """By how many nats the next place is less probable to which the likelihood leads from any of the best ends.

        None where more than noise is left, and something better is known to be missing.
        """
        if not self.best.may_be_noise:
            return None
        led = [_led(gls, end) for end in (self.starts.best[0], *others)]
        # Ends that differ by less than their error bars say the same, but for one that the estimate has missed.
        return min((one.nats for one in led if one.distance > 1.0 or one.nats < -LESS_PROBABLE), default=np.inf)

    def _nats_as_fitted(self) -> float | None:
        """The same where there is no likelihood: of the next minimum, errors of measured inputs taken off.

        None where minima are not compared.
        """
        starts, plain = self.starts, self.plain
        if not plain.input_errors:
            # The two bounces that a wrong minimum misses may be few samples of many, and still more than noise.
            return 0.5 * float(starts.cost[starts.basin > 0].min() - starts.cost.min()) / self.unit**2
        if not self.compared:
            return None
        ends = [optimum(self.task, values) for values in starts.others()]
        away = [one for one in ends if np.any(np.abs(one.values - plain.values) > self.bars.errors[self.bars.method])]
        best, *others = (_objective(one.problem, one.local, one.coefficients) for one in (plain, *away))
        return 0.5 * (min(others, default=np.inf) - best) / self.unit**2


def _led(gls: GlsEstimate, values: np.ndarray) -> Led:
    """Where the likelihood of an estimate leads from values ``(n_free,)``; not known where it leads nowhere.

    Readings are linearised in the errors of inputs that the estimate has.
    """
    found, layout = gls.evidence.mode, gls.seen.problem.layout
    unknowns, local = found.unknowns, np.asarray(layout.local(values))
    start, gram = unknowns.place_of(local), gls.seen.gram(unknowns)
    end, _ = in_time(partial(mode, unknowns, start, gram, found.sigma), None)
    if end is None or not np.isfinite(end.objective):
        return Led(np.inf, 0.0)
    # What a further step would gain is still to be gained: the end is no less probable than that.
    nats = 0.5 * (end.objective - np.nan_to_num(end.predicted_reduction, nan=np.inf) - found.objective)
    # A mean and deviations from it may still creep against each other where the records are at rest.
    return Led(_distance(gls, *(layout.means_of(one.local) for one in (found, end))), float(nats))


def _distance(gls: GlsEstimate, here: np.ndarray, there: np.ndarray) -> float:
    """Largest distance of shared values ``(n_free,)``, in standard errors of an estimate."""
    errors = gls.bars.errors[gls.bars.method]
    shared = np.array([record is None for _, record in gls.seen.problem.layout.entries])
    known = shared & np.isfinite(errors) & (errors > 0.0)
    return float(np.max(np.abs(there - here)[known] / errors[known], initial=0.0))


def _objective(problem: Problem, local: np.ndarray, coefficients: InputCoefficients) -> float:
    """Sum of squares of what is left and of the errors that were taken off the inputs, each in units of its own."""
    errors = sum(float(np.sum(np.square(waves))) for waves in coefficients.values())
    left = float(np.sum(np.square(linearised(problem, local).residuals)))
    return left + errors if np.isfinite(left) else np.inf  # where a motion is lost there are no numbers
