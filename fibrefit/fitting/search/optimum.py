"""The best values of a problem and what the records say around them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fibrefit.core.roles import ROLES
from fibrefit.fitting import uncertainty
from fibrefit.fitting.result import InputError
from fibrefit.fitting.search.solve import linearised
from fibrefit.fitting.search.varpro import expected_gap, joint
from fibrefit.problem.inputs.errors_in_variables import InputCoefficients, input_errors
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.statement.problem import Linearised, Problem
from fibrefit.problem.task import Task


@dataclass(frozen=True)
class Optimum:
    """The problem at its best values, and what the uncertainty is taken from.

    Where an input is measured with noise, the problem is the one with its error taken off, and slopes are what no error
    of the input can imitate.

    Parameters
    ----------
    problem : Problem
    values : (n_free,) in SI units
    linear : Linearised
    scores : Scores
    expected_gap : float
        Of a perfect model.
    input_errors : dict of input to InputError
    joint : float, optional
        Fall of the cost that one more step of values and input errors together promises.
    coefficients : mapping of input to (n_record, n_wave)
        Errors of the inputs, see `input_error`.
    """

    problem: Problem
    values: np.ndarray
    linear: Linearised
    scores: uncertainty.Scores
    expected_gap: float = 1.0
    input_errors: Mapping[str, InputError] = field(default_factory=dict)
    joint: float | None = None
    coefficients: InputCoefficients = field(default_factory=dict)

    def promised(self, moving: Sequence[bool]) -> float:
        """Fall of the cost that one more step of the values that are not stopped by a bound promises.

        In units of the residual variance.
        """
        return _promised(self.scores, np.array(moving[: self.scores.size])) if self.joint is None else self.joint


def optimum(task: Task, values: np.ndarray, coefficients: InputCoefficients | None = None) -> Optimum:
    """What is known at the best values of a task; noisy inputs are corrected first, which moves the values a little.

    Parameters
    ----------
    task : Task
    values : (n_free,) in SI units
        Best for the inputs as they were measured.
    coefficients : mapping of input to (n_record, n_wave), optional
        Errors of the inputs to begin with.
    """
    problem, known = task.problem, input_errors(task)
    counts, layout = np.asarray(problem.observations.experiment.count), problem.layout
    if not known:
        linear = linearised(problem, values)
        return Optimum(
            problem, values, linear, uncertainty.Scores.of(linear, counts, layout.local_columns, layout.size)
        )
    found = joint(task, known, values, coefficients)
    expected, parts = expected_gap(task, known, found)
    linear = Linearised(found.linear.residuals, found.linear.slopes)
    # Errors of inputs that are fitted take some of the readings' noise with them: it is put back.
    whole = found.linear.residuals / np.where(parts > 0.0, parts, 1.0)[:, :, None]
    scores = uncertainty.Scores(
        whole, found.linear.slopes, counts, layout.local_columns, layout.size, prior=found.prior
    )
    errors = {
        name: InputError(rms, _mean_rms(task.input_noise[name], task), ROLES[name])
        for name, rms in found.error_rms.items()
    }
    return Optimum(found.problem, found.values, linear, scores, expected, errors, found.promised, found.coefficients)


def _mean_rms(noise: Noise, task: Task) -> float:
    squares = [
        noise.rms(float(trace.times[-1] - trace.times[0]), float(1.0 / np.diff(trace.times).mean())) ** 2
        for trace in task.traces
    ]
    return float(np.sqrt(np.mean(squares)))


def _promised(scores: uncertainty.Scores, moving: np.ndarray) -> float:
    normal, gradient = scores.normal_matrix()[moving][:, moving], scores.gradient()[moving]
    if not moving.any():
        return 0.0
    scale = np.sqrt(np.where(np.diag(normal) > 0.0, np.diag(normal), 1.0))
    step = np.linalg.lstsq(normal / np.outer(scale, scale), gradient / scale, rcond=1e-10)[0]
    return float(step @ (gradient / scale) / max(scores.variance(), 1e-300))
