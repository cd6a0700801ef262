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
    weighted_sensitivities,
    whitened_sensitivities,
    without_input_errors,
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
from fibrefit.problem.noise.kinds import KINDS, OF_A_FIT
from fibrefit.problem.noise.level_shifts import LevelShift, joint_probability, level_shifts, without_shifts
from fibrefit.problem.noise.likelihood import (
    TAIL_START,
    Likelihood,
    NoiseModel,
    choose_noise_model,
    downweighted_likelihood,
)
from fibrefit.problem.noise.readings import unbroken
from fibrefit.problem.noise.rounding import same_noise, with_noise_before_rounding, with_steps
from fibrefit.problem.noise.spectrum import (
    MAINS,
    Noise,
    half_weights,
    periodogram,
    products_of_spectra,
    whittle,
    without_lines,
)
from fibrefit.problem.noise.whitening import (
    Levelled,
    Whitening,
    innovations,
    least_squares_step,
    linearised_after_step,
    unit_of,
)
from fibrefit.problem.noise.whittle import noise_of_residuals, noise_of_steps, whitening_of
from fibrefit.problem.posterior.log_posterior import (
    Conditional,
    InputEffects,
    LogPosterior,
    Mixture,
    RandomEffects,
    noise_priors,
)
from fibrefit.problem.posterior.prior import Density, Prior, Priors
from fibrefit.problem.statement.layout import Belief, Layout, Range, Slot
from fibrefit.problem.statement.observations import LENGTH_STEP, Observations, Steps
from fibrefit.problem.statement.problem import Linearised, Problem
from fibrefit.problem.task import Task
from fibrefit.problem.thresholds import BALANCE, BESIDE_MAINS, CLEAR, GAP_OF_NOISE, LAST_LEVEL_RATIO, STANDING, UNLIKELY

# fmt: off
__all__ = [
    "BALANCE", "BESIDE_MAINS", "CLEAR", "DIFFERENCE_STEP", "DRAWS_OF_ERRORS", "GAP_OF_NOISE", "INSIDE_95", "KINDS",
    "LAST_LEVEL_RATIO", "LENGTH_STEP", "MAINS", "NOTICEABLE_FALL", "OF_A_FIT", "ROUGH_TOLERANCE", "SIGMA_LEVELS",
    "STANDING", "TAIL_START", "UNLIKELY", "Arrowhead", "Belief", "BlockFilter", "Conditional", "Density", "Effort",
    "ForceBalance", "Gram", "Gravity", "HausmanTest", "InputCoefficients", "InputEffects", "InputErrors",
    "InputSensitivities", "Lag", "Layout", "LevelShift", "Levelled", "Likelihood", "Linearised", "LogPosterior",
    "MarginalLikelihood", "Mixture", "Motion", "Noise", "NoiseModel", "Observations", "Place", "PosteriorMode",
    "Prior", "Priors", "Problem", "RandomEffects", "Range", "ResidualSet", "ScoreTest", "Slot", "StepLikelihood",
    "Steps", "Task", "Unknowns", "View", "Whitening", "antithetic_draws", "better_minima", "choose_noise_model",
    "cleaned_inputs", "corrected", "downweighted", "downweighted_likelihood", "downweights", "error_rms",
    "expanded", "first_size", "force_and_position_exchanged", "formulate", "formulate_planned", "gaussian_draws",
    "half_weights", "in_blocks", "innovations", "input_errors", "instant_weights", "joint_probability",
    "laplace_evidence", "least_squares_step", "level_of", "level_shifts", "linearised_after_step",
    "mixture_quantile", "mode", "no_errors", "noise_of_residuals", "noise_of_steps", "noise_priors",
    "parameter_slots", "periodogram", "products_of_spectra", "record_wise_start", "refuse_contradictory",
    "same_noise", "samples_about", "sensitivities_of", "stated_numbers", "step_likelihood", "trace_of", "unbroken",
    "unit_of", "weighted_sensitivities", "whitened_sensitivities", "whitening_of", "whittle",
    "with_best_input_errors", "with_noise_before_rounding", "with_steps", "without_input_errors", "without_lines",
    "without_shifts",
]
# fmt: on
