"""What is to be identified: layout, noise, likelihood, linear model, priors; and what may be wrong with records.

Other packages use the names below and no module behind them.
"""

from __future__ import annotations

from fibrefit.problem.diagnose.channels import force_and_position_exchanged, refuse_contradictory
from fibrefit.problem.diagnose.motion import Motion, ResidualSet
from fibrefit.problem.diagnose.newton import ForceBalance, Gravity, Lag
from fibrefit.problem.estimate.evidence import (
    INSIDE_95,
    SIGMA_LEVELS,
    MarginalLikelihood,
    laplace_evidence,
    mixture_quantile,
)
from fibrefit.problem.estimate.gauss_newton import (
    NOTICEABLE_FALL,
    ROUGH_TOLERANCE,
    Effort,
    better_minima,
    mode,
    record_wise_start,
)
from fibrefit.problem.estimate.gls import HausmanTest, level_of
from fibrefit.problem.formulation import (
    first_size,
    formulate,
    formulate_planned,
    parameter_slots,
    stated_numbers,
    trace_of,
)
from fibrefit.problem.inputs.errors_in_variables import (
    InputCoefficients,
    InputErrors,
    cleaned_inputs,
    corrected,
    downweighted,
    downweights,
    error_rms,
    expanded,
    input_errors,
    instant_weights,
    no_errors,
    samples_about,
)
from fibrefit.problem.inputs.sensitivities import (
    InputSensitivities,
    StepLikelihood,
    sensitivities_of,
    step_likelihood,
)
from fibrefit.problem.linear_model.normal_equations import Arrowhead, PosteriorMode, ScoreTest
from fibrefit.problem.linear_model.unknowns import DIFFERENCE_STEP, Gram, Place, Unknowns
from fibrefit.problem.linear_model.view import (
    DRAWS_OF_ERRORS,
    View,
    antithetic_draws,
    gaussian_draws,
    with_best_input_errors,
)
from fibrefit.problem.noise.coloured import BlockFilter, in_blocks
from fibrefit.problem.noise.readings import unbroken
from fibrefit.problem.noise.rounding import same_noise, with_noise_before_rounding, with_steps
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.noise.whitening import (
    Levelled,
    Whitening,
    innovations,
    unit_of,
)
from fibrefit.problem.noise.whittle import noise_of_residuals, noise_of_steps, whitening_of
from fibrefit.problem.statement.layout import Belief, Layout, Range, Slot, normal_equations
from fibrefit.problem.statement.observations import LENGTH_STEP, Observations, Steps, log_probability
from fibrefit.problem.statement.problem import Linearised, Problem
from fibrefit.problem.task import Task
from fibrefit.problem.thresholds import BALANCE, BESIDE_MAINS, CLEAR, GAP_OF_NOISE, LAST_LEVEL_RATIO, STANDING, UNLIKELY

# fmt: off
__all__ = [
    "BALANCE", "BESIDE_MAINS", "CLEAR", "DIFFERENCE_STEP", "DRAWS_OF_ERRORS", "GAP_OF_NOISE", "INSIDE_95",
    "LAST_LEVEL_RATIO", "LENGTH_STEP", "NOTICEABLE_FALL", "ROUGH_TOLERANCE", "SIGMA_LEVELS", "STANDING", "UNLIKELY",
    "Arrowhead", "Belief", "BlockFilter", "Effort", "ForceBalance", "Gram", "Gravity", "HausmanTest",
    "InputCoefficients", "InputErrors", "InputSensitivities", "Lag", "Layout", "Levelled", "Linearised",
    "MarginalLikelihood", "Motion", "Noise", "Observations", "Place", "PosteriorMode", "Problem", "Range",
    "ResidualSet", "ScoreTest", "Slot", "StepLikelihood", "Steps", "Task", "Unknowns", "View", "Whitening",
    "antithetic_draws", "better_minima", "cleaned_inputs", "corrected", "downweighted", "downweights", "error_rms",
    "expanded", "first_size", "force_and_position_exchanged", "formulate", "formulate_planned", "gaussian_draws",
    "in_blocks", "innovations", "input_errors", "instant_weights", "laplace_evidence", "level_of", "log_probability",
    "mixture_quantile", "mode", "no_errors", "noise_of_residuals", "noise_of_steps", "normal_equations",
    "parameter_slots", "record_wise_start", "refuse_contradictory", "same_noise", "samples_about", "sensitivities_of",
    "stated_numbers", "step_likelihood", "trace_of", "unbroken", "unit_of", "whitening_of", "with_best_input_errors",
    "with_noise_before_rounding", "with_steps",
]
# fmt: on
