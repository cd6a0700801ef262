"""The best values of a problem and what the records say around them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from fibrefit.core.declarations import ROLES
from fibrefit.fitting import uncertainty
from fibrefit.fitting.search.solve import linearised
from fibrefit.fitting.search.with_input_errors import WithInputErrors, as_it_ended, noise_left, with_input_errors
from fibrefit.problem.inputs.errors_in_variables import InputCoefficients, error_rms, input_errors
from fibrefit.problem.inputs.sensitivities import InputSensitivities, without_input_errors
from fibrefit.problem.linear_model.view import View
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.statement.matrices import least_squares
from fibrefit.problem.statement.problem import Linearised, Problem
from fibrefit.problem.task import Task
from fibrefit.study.summaries.results import InputErrorSummary


class Ended(NamedTuple):
    """Where a search ended: a fit goes on from there, and does not search anew.

    Parameters
    ----------
    local : (n_record, n_local) in SI units
        Values of each record.
    differ : bool
        Whether records differ in more than their own values.
    coefficients : mapping of input to (n_record, n_wave), optional
        Errors of measured inputs.
    near : InputSensitivities, optional
        Readings linearised in these errors, near there.
    """

    local: np.ndarray
    differ: bool = False
    coefficients: InputCoefficients | None = None
    near: InputSensitivities | None = None


@dataclass(frozen=True)
class Optimum:
    """The problem at its best values, and what the uncertainty is taken from.

    Where an input is measured with noise, the problem is the one with its error taken off, and slopes are what no error
    of the input can imitate.

    Parameters
    ----------
    problem : Problem
    values : (n_free,) in SI units
    local : (n_record, n_local) in SI units
        The same for each record; where a search ended with records that differ, those of each.
    linear : Linearised
    scores : Scores
    expected_gap : float
        Of a perfect model.
    input_errors : dict of input to InputErrorSummary
    coefficients : mapping of input to (n_record, n_wave)
        Errors of the inputs, see `errors_in_variables`.
    view : View, optional
        Readings linearised in those errors.
    predicted_with_inputs : float, optional
        Reduction of the cost predicted of one more step of values and input errors together.
    """

    problem: Problem
    values: np.ndarray
    local: np.ndarray
    linear: Linearised
    scores: uncertainty.Scores
    expected_gap: float = 1.0
    input_errors: Mapping[str, InputErrorSummary] = field(default_factory=dict)
    coefficients: InputCoefficients = field(default_factory=dict)
    view: View | None = None
    predicted_with_inputs: float | None = None

    @property
    def differ(self) -> bool:
        """Whether records have values of their own in place of those they share."""
        return not np.array_equal(self.local, np.asarray(self.problem.layout.local(self.values)))

    def predicted_reduction(self, moving: Sequence[bool]) -> float:
        """Reduction of the cost predicted of one more Gauss-Newton step of the values that are not stopped by a bound.

        In units of the residual variance.
        """
        if self.predicted_with_inputs is not None:
            return self.predicted_with_inputs
        return _predicted_reduction(self.scores, np.array(moving[: self.scores.size]))


def optimum(task: Task, values: np.ndarray, ended: Ended | None = None) -> Optimum:
    """What is known at the best values of a task; noisy inputs are corrected first, which moves the values a little.

    Parameters
    ----------
    task : Task
    values : (n_free,) in SI units
        Best for the inputs as they were measured.
    ended : Ended, optional
        Where a search ended at these values.
    """
    problem, known = task.problem, input_errors(task)
    if not known:
        local = np.asarray(problem.layout.local(values))
        linear = linearised(problem, local)
        return Optimum(problem, values, local, linear, uncertainty.Scores.of(problem, linear, values))
    if ended is not None and ended.differ and ended.coefficients is not None:
        # Values that all records share would lose bounces of those that differ.
        local = ended.local
        found = as_it_ended(problem, known, values, local, ended.coefficients, ended.near)
    else:
        coefficients, near = (None, None) if ended is None else (ended.coefficients, ended.near)
        found = with_input_errors(task, known, values, coefficients, near)
        local = np.asarray(problem.layout.local(found.values))
    shares = noise_left(task, found)
    linear, scores = _scores(found, local, shares)
    rms = error_rms(problem, known, found.coefficients)
    usual = {name: _mean_rms(task.input_noise[name], task) for name in rms}
    errors = {
        name: InputErrorSummary(rms=size, noise=usual[name], unit=ROLES[name], looked_for=known[name].rms)
        for name, size in rms.items()
    }
    expected = float(np.sqrt(np.mean(shares**2)))
    return Optimum(
        found.problem,
        found.values,
        local,
        linear,
        scores,
        expected,
        errors,
        found.coefficients,
        found.view,
        found.predicted_reduction,
    )


def optimum_of_each(shared: Optimum, local: np.ndarray) -> Optimum:
    """An optimum of exact inputs with values of each record, ``(n_record, n_local)`` in SI units, about shared ones."""
    linear = linearised(shared.problem, local)
    return replace(
        shared, local=local, linear=linear, scores=uncertainty.Scores.of(shared.problem, linear, shared.values)
    )


def _scores(found: WithInputErrors, local: np.ndarray, shares: np.ndarray) -> tuple[Linearised, uncertainty.Scores]:
    """Residuals and slopes without what errors of the inputs can imitate."""
    layout, weights = found.problem.layout, found.sensitivities.downweight
    linear, counts = found.problem.linearised_at(local), np.asarray(found.problem.observations.experiment.count)
    residuals = np.asarray(linear.residuals) * weights
    slopes = np.moveaxis(np.asarray(linear.slopes) * weights[..., None], -1, 1)
    left, waves = without_input_errors(found.sensitivities, slopes.reshape(*slopes.shape[:2], -1))
    slopes = np.moveaxis(left.reshape(slopes.shape), 1, -1)
    # Errors of inputs that are fitted take some of the readings' noise with them: it is put back.
    whole = residuals / np.where(shares > 0.0, shares, 1.0)[:, :, None]
    prior, belief = np.einsum("riw,rjw->rij", waves, waves), layout.prior_gram(found.values)
    scores = uncertainty.Scores(whole, slopes, counts, layout.local_columns, layout.size, prior, belief)
    return Linearised(residuals, slopes), scores


def _mean_rms(noise: Noise, task: Task) -> float:
    squares = [noise.rms(trace.duration, trace.rate) ** 2 for trace in task.traces]
    return float(np.sqrt(np.mean(squares)))


def _predicted_reduction(scores: uncertainty.Scores, moving: np.ndarray) -> float:
    normal, gradient = scores.normal_matrix()[moving][:, moving], scores.gradient()[moving]
    if not moving.any():
        return 0.0
    found = float(least_squares(normal, gradient) @ gradient / max(scores.variance(), 1e-300))
    # Where a motion has no slopes, nothing says that the search has arrived.
    return np.inf if np.isnan(found) else found
