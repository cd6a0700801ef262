"""The last step of a fit: whitened least squares, where the noise is known well enough and the model is not in doubt.

Plain least squares is honest under noise that wanders, but wasteful. From where it ended a few whitened steps lead to
the surest estimate. A model of the noise can also hide what a model of the rig lacks: where the two estimates part by
more than their errors, or what is left is louder than noise, the plain one stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fibrefit.core.check import Check
from fibrefit.fitting import uncertainty
from fibrefit.fitting.error_bars import ErrorBars, beside, error_bars, estimates, ratio, size
from fibrefit.fitting.gls_estimate import SETTLED, STEPS, Sharp, length
from fibrefit.fitting.search.optimum import Optimum
from fibrefit.fitting.search.solve import linearised
from fibrefit.problem.estimate.gls import Whitened, level_of, whitened
from fibrefit.problem.estimate.hausman import parting, parting_check
from fibrefit.problem.noise.whitening import Whitening
from fibrefit.problem.noise.whittle import noise_of_residuals, whitening_of
from fibrefit.problem.statement.problem import Problem

SHARP = "the noise wanders, and each sample counts by what it adds to those before it."


@dataclass(frozen=True)
class Reported:
    """The estimate that is reported, and why it is this one.

    Parameters
    ----------
    values : (n_free,) in SI units
    residuals : (n_record, n_channel, n_time) in units of the noise
    bars : ErrorBars
    sharp : Sharp or None
        None where the plain estimate stands.
    says : str
    checks : tuple of Check
        Whether both estimates agree, where they could be compared.
    """

    values: np.ndarray
    residuals: np.ndarray
    bars: ErrorBars
    sharp: Sharp | None
    says: str
    checks: tuple[Check, ...] = ()

    @property
    def estimator(self) -> str:
        """Name of the method."""
        return "plain least squares" if self.sharp is None else "whitened least squares"


def reported(plain: Optimum, bars: ErrorBars, sound: Sequence[Check], rate: float) -> Reported:
    """Go from a plain estimate to the whitened one, if there is one to be believed.

    Parameters
    ----------
    plain : Optimum
    bars : ErrorBars
        Of the plain estimate.
    sound : sequence of Check
        What must hold for its residuals to be taken for noise.
    rate : float
        Samples a second, in Hz.
    """
    sharp, reason, checks = _sharpened(plain, sound)
    if sharp is not None:
        own = beside(bars, error_bars(plain.problem, sharp.scores, rate))
        if any(estimate.at_bound for estimate in estimates(plain.problem, sharp.values, own)):
            reason = "the whitened search ends at a bound."
        elif size(plain.problem, own.covariance) >= size(plain.problem, bars.covariance):
            reason = "whitening makes no error bar smaller."
        else:
            smaller = ratio(plain.problem, own.errors[own.method], bars.errors[bars.method])
            says = f"Whitened least squares: {SHARP} Error bars are {smaller:.2g} times those of plain least squares."
            return Reported(sharp.values, sharp.linear.residuals, own, sharp, says, checks)
    return Reported(plain.values, plain.linear.residuals, bars, None, f"Plain least squares: {reason}", checks)


def _sharpened(plain: Optimum, sound: Sequence[Check]) -> tuple[Sharp | None, str, tuple[Check, ...]]:
    """The whitened estimate, or why there is none, and whether it agrees with the plain one."""
    if reason := _doubt(plain, sound):
        return None, reason, ()
    whitening = whitening_of(plain.problem, noise_of_residuals(plain.problem, plain.linear.residuals))
    layout, level = plain.problem.layout, level_of(whitening, plain.linear.residuals, _counts(plain.problem))
    apart = parting_check(layout.free_names, parting(layout, plain.linear, whitening, level))
    if not apart.passed:
        return None, "whitened residuals want other values, so the model lacks something.", (apart,)
    found = _descended(plain, whitening, level)
    return found, "" if found else "the whitened search came to no end within the bounds.", (apart,)


def _doubt(plain: Optimum, sound: Sequence[Check]) -> str:
    """Why the residuals are not to be taken for noise with a memory."""
    if plain.input_errors:
        return f"errors of the measured {' and '.join(plain.input_errors)} are fitted beside the parameters."
    if plain.problem.soft_beyond is not None:
        return "samples that stray count less, as asked for."
    failed = [check.name for check in sound if not check.passed]
    if failed:
        return f"whitening is for what is noise alone, and that is in doubt ({'; '.join(failed)})."
    return ""


def _counts(problem: Problem) -> np.ndarray:
    """Samples of each channel that count, ``(n_channel,)``; one where there are none."""
    weights = (problem.observations.weight[channel] for channel in problem.model.rig.channels)
    return np.array([max(np.count_nonzero(np.asarray(weight)), 1) for weight in weights])


def _descended(plain: Optimum, whitening: Whitening, level: np.ndarray) -> Sharp | None:
    """Gauss-Newton steps on the innovations; None where they do not settle, or leave the bounds."""
    layout, values, linear = plain.problem.layout, plain.values, plain.linear
    limits = [slot.range for slot, _ in layout.entries]
    lower, upper = np.array([r.lower for r in limits]), np.array([r.upper for r in limits])
    for _ in range(STEPS):
        here = whitened(layout, linear, whitening, level)
        if length(here.step, here.covariance) < SETTLED:
            return Sharp(values, linear, _scores(here, plain.scores), whitening, level)
        values = values + here.step
        if not np.all((values > lower) & (values < upper)):
            return None
        linear = linearised(plain.problem, values)
        if not (np.isfinite(linear.residuals).all() and np.isfinite(linear.slopes).all()):
            return None
    return None


def _scores(here: Whitened, plain: uncertainty.Scores) -> uncertainty.Scores:
    return uncertainty.Scores(here.residuals, here.slopes, plain.counts, plain.columns, plain.size)
