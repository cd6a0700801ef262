"""All that a posterior needs before the first draw: noise, mode, how records differ, errors of inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp
import numpy as np

from fibrefit.problem.estimate.gls import HausmanTest, level_of
from fibrefit.problem.inputs.errors_in_variables import InputCoefficients, corrected, input_errors
from fibrefit.problem.linear_model.view import DRAWS_OF_ERRORS, View
from fibrefit.problem.noise.choose import NoiseModel, choose_noise_model, least_squares_step
from fibrefit.problem.noise.likelihood import TAIL_START, Likelihood, counted_in_part, unit_of
from fibrefit.problem.noise.rounding import with_noise_before_rounding, with_steps
from fibrefit.problem.noise.whitening import Levelled
from fibrefit.problem.noise.whittle import noise_of_residuals
from fibrefit.problem.posterior.log_posterior import LogPosterior, noise_priors
from fibrefit.problem.posterior.prior import Density, Prior, Priors
from fibrefit.problem.statement.problem import Linearised, Problem
from fibrefit.problem.task import Task
from fibrefit.sampling.deviations import (
    Deviations,
    gls_deviations,
    hausman_of_records,
    ols_deviations,
    random_effects_of,
)
from fibrefit.sampling.mode.inputs import DrawnInputs, drawn_inputs_of, input_effects_of, seen_at
from fibrefit.sampling.settings import AS_A_FIT, Settings
from fibrefit.sampling.target import Target, target_of

if TYPE_CHECKING:
    from fibrefit.study.parameters import PriorSetting


class ChainStart(NamedTuple):
    """Where the chains begin.

    Parameters
    ----------
    values : (n_free,) in SI units
        The best fit by plain least squares.
    coefficients : mapping of input to (n_record, n_wave), optional
        Errors of measured inputs that suit it.
    basins : sequence of (n_free,) in SI units
        Other minima of the multi-start: modes are looked for from each.
    reported : (n_free,) in SI units, optional
        What the fit reports, which the posterior is held against; the plain values where there is nothing else.
    """

    values: np.ndarray
    coefficients: InputCoefficients | None = None
    basins: Sequence[np.ndarray] = ()
    reported: np.ndarray | None = None


class PosteriorRequest(NamedTuple):
    """What posterior is wanted.

    Parameters
    ----------
    noise : {"fit", "auto", "white", "autoregressive", "coloured"}
        Noise spectrum: that of a fit; the kind that the residuals at the start choose; one kind, where ``"coloured"``
        is the spectrum of the rests if all channels have one. With measured inputs, the first, second and last are one.
    heavy : bool
        Student's t (heavy-tailed) likelihood instead of a normal one.
    """

    noise: str = AS_A_FIT
    heavy: bool = False
    settings: Settings = Settings()


class Ready(NamedTuple):
    """All that is known before the first draw.

    Parameters
    ----------
    ratio : (n_channel,)
        RMS of what is left at the mode, errors of inputs taken off, over that of noise.
    values : (n_free,) in SI units
        Where the walkers begin.
    deviations : Deviations or None
        None where no mode is reached.
    inputs : DrawnInputs or None
        None where inputs are exact.
    alike : bool
        Whether records are taken for alike that might differ.
    moving : float
        Standard deviations by which errors of inputs still moved when readings were last linearised in them.
    """

    ratio: np.ndarray
    model: NoiseModel
    priors: Priors
    density: LogPosterior
    target: Target
    values: np.ndarray
    hausman: HausmanTest
    deviations: Deviations | None = None
    inputs: DrawnInputs | None = None
    alike: bool = False
    moving: float = 0.0


class _Found(NamedTuple):
    """Where records are most probable, and what the noise is there.

    Parameters
    ----------
    where : Deviations or None
        The mode; None where none is reached.
    local : (n_record, n_local) in SI units
    seen : View
        Records linearised in errors of inputs.
    moving : float
        See `Ready`.
    """

    where: Deviations | None
    local: np.ndarray
    seen: View
    model: NoiseModel
    moving: float = 0.0


def prepare(
    task: Task, begin: ChainStart, stated: Mapping[str, PriorSetting | Prior], request: PosteriorRequest
) -> Ready:
    """The noise is what is left where records may differ; the mode and its deviations are those of a fit."""
    start, layout = begin.values, task.problem.layout
    task = _in_steps(task, start, begin.coefficients)
    first = seen_at(task, start, begin.coefficients)
    plain = ols_deviations(task, start, first)
    where, local, seen, model, moving = _noise_and_mode(task, plain, start, first, request)
    likelihood = _counted(task, seen, model.likelihood)
    level = _level(seen, local, likelihood)
    spread = _noise_at(likelihood, np.where(likelihood.known, 1.0, level))
    spread = np.asarray(likelihood.curvature(jnp.asarray(spread))) ** -0.5
    there = seen.through(Levelled(likelihood.whitening, jnp.asarray(spread)))
    inputs = input_effects_of(there, local, spread)
    random_effects = None if where is None else random_effects_of(there, where, spread, inputs)
    priors = Priors.of(layout, task.problem.model, start, stated)
    density = density_of(seen.problem, priors, likelihood)
    density = replace(density, random_effects=random_effects, inputs=inputs)
    target = _target(task, priors, density, request.settings)
    near = plain.local if where is not None and where.found else np.asarray(layout.local(start))
    compared = hausman_of_records(first, where, near, (likelihood.whitening, level))
    return Ready(
        ratio=np.sqrt(np.sum(seen.residuals(local)[0][0] ** 2, axis=(0, 2)) / _counts(seen)),
        model=model,
        priors=priors,
        density=density,
        target=target,
        values=start if where is None else where.values(layout),
        hausman=compared,
        deviations=where,
        inputs=drawn_inputs_of(task, there, spread),
        alike=where is None and len(plain.names) > 0,
        moving=moving if moving >= SETTLED else 0.0,
    )


def _counted(task: Task, seen: View, likelihood: Likelihood) -> Likelihood:
    """The likelihood, of which samples that are badly predicted linearly count in part."""
    if seen.raw is None:
        return likelihood
    return counted_in_part(likelihood, task.problem.observations, seen.raw.downweight)


def _in_steps(task: Task, values: np.ndarray, coefficients: InputCoefficients | None) -> Task:
    """The task with the likelihood of readings in coarse steps, whose noise before rounding is found once for all."""
    if not task.steps:
        return task
    problem, known = with_steps(task.problem, dict(task.steps)), input_errors(task)
    there = corrected(problem, known, coefficients) if known and coefficients else problem
    there = with_noise_before_rounding(there, problem.layout.local(values))
    problem = with_steps(problem, there.observations.steps)
    return replace(task, problem=problem, noise_given=(*task.noise_given, *task.steps))


def _noise_and_mode(task: Task, first: Deviations, start: np.ndarray, seen: View, request: PosteriorRequest) -> _Found:
    """Noise that is left at a place, and the mode in it; as in a fit, looked for where records may differ broadly.

    Readings are linearised in errors of inputs anew where these are best, until they are found where they were.
    """
    where, reached, moved = first, False, 0.0
    for number in range(1, MOST_ROUNDS + 1):
        model = _noise_left(task, seen, where, request)
        # A spectrum that is found as a fit finds it has its level.
        level = np.ones(len(model.likelihood.known))
        if model.requested != AS_A_FIT:
            likelihood = _counted(task, seen, model.likelihood)
            level = np.where(likelihood.known, 1.0, _level(seen, where.local, likelihood))
        seen = seen.through(Levelled(model.likelihood.whitening, jnp.asarray(level)))
        found = gls_deviations(seen, where)
        reached = found is not None
        if found is None:
            break
        where, best = found, seen.residuals(found.local)[1]
        moved = _change(seen, best)
        if number >= ROUNDS and moved < SETTLED:
            break
        if moved >= SETTLED and number < MOST_ROUNDS:
            seen = seen_at(task, where.local, best)
    if reached or seen.raw is not None:
        return _Found(where if reached else None, where.local, seen, model, moved)
    # What the noise is does not hang on where the walkers begin.
    there = _at_minimum(task.problem, start, _linearised(task.problem, start))
    model = noise_model_of(task, task.problem, there, request)
    return _Found(None, np.asarray(task.problem.layout.local(start)), seen, model, moved)


def _noise_left(task: Task, seen: View, where: Deviations, request: PosteriorRequest) -> NoiseModel:
    """Noise of what is left at a place; as a fit finds it, the noise that what was fitted took along is put back."""
    linear = seen.problem.followed(where.local)[0]
    if seen.raw is None and request.noise != AS_A_FIT:
        return noise_model_of(task, seen.problem, linear, request)
    rows = seen.residuals(where.local, DRAWS_OF_ERRORS)[0]
    linear = linear._replace(residuals=rows[0])
    if (known := where.evidence) is None:
        return noise_model_of(task, seen.problem, linear, request, rows)
    left = seen.residuals_with_noise_power(known.mode, known.posterior_roots(), DRAWS_OF_ERRORS)
    return noise_model_of(task, seen.problem, linear, request, left)


def _level(seen: View, local: np.ndarray, likelihood: Likelihood) -> np.ndarray:
    """Noise over what a whitening assumes, ``(n_channel,)``; errors of inputs as they may be, not as they are best."""
    rows, counts = seen.residuals(local, DRAWS_OF_ERRORS)[0], np.maximum(np.asarray(likelihood.counts), 1.0)
    squares = [level_of(likelihood.whitening, row, counts) ** 2 for row in rows[min(1, len(rows) - 1) :]]
    return np.asarray(np.sqrt(np.mean(squares, axis=0)))


def _noise_at(likelihood: Likelihood, level: np.ndarray) -> np.ndarray:
    """Noise coordinates ``(n_noise,)`` of levels ``(n_channel,)``, those that are not known."""
    unknown = [np.log(one) for one, known in zip(level, likelihood.known, strict=True) if not known]
    return np.array([*unknown, *([np.log(TAIL_START)] if likelihood.heavy else [])])


ROUNDS, MOST_ROUNDS = 2, 6
"""Of noise and mode, and how many there are at the most where readings are linearised anew."""
SETTLED = 0.05
"""Change of coefficients, whose prior has a spread of one, below which readings stay linearised where they are."""


def noise_model_of(
    task: Task, problem: Problem, linear: Linearised, request: PosteriorRequest, left: np.ndarray | None = None
) -> NoiseModel:
    """Noise model of a task, given the residuals at its fit; levels the study states are not inferred.

    Parameters
    ----------
    problem : Problem
        As it is linearised.
    left : (n_draw, n_record, n_channel, n_time), optional
        Residuals that have the power of the noise, where errors of inputs took some of it off those at the fit; the
        spectrum is theirs.
    """
    channels, (noise, heavy, _) = task.problem.model.rig.channels, request
    known = tuple(channel in task.noise_given for channel in channels)
    if noise == AS_A_FIT or (left is not None and noise in ("auto", "coloured")):
        rows = np.asarray(linear.residuals)[None] if left is None else left
        spectrum = dict(zip(channels, noise_of_residuals(problem, rows), strict=True))
        found = choose_noise_model(problem, linear, "coloured", known, heavy, spectrum)
        return replace(found, requested="coloured" if noise == "coloured" else AS_A_FIT)
    measured = {c: n for c, n in task.noise.items() if c not in task.noise_given and n.samples}
    return choose_noise_model(problem, linear, noise, known, heavy, measured)


def density_of(problem: Problem, priors: Priors, likelihood: Likelihood) -> LogPosterior:
    """Log posterior density of a problem."""
    return LogPosterior(problem, priors.density, Density.of(noise_priors(likelihood)), likelihood)


def coordinates_of(density: LogPosterior, values: np.ndarray) -> np.ndarray:
    """Coordinates ``(n,)`` of free values in SI units, the noise being what it is assumed to be."""
    noise = np.zeros(density.likelihood.size)
    if density.likelihood.heavy:
        noise[-1] = np.log(TAIL_START)
    return np.concatenate([np.asarray(density.problem.layout.free(jnp.asarray(values))), noise])


def _target(task: Task, priors: Priors, density: LogPosterior, settings: Settings) -> Target:
    channels, likelihood = task.problem.model.rig.channels, density.likelihood
    # A level is one where noise is what the whitening assumes, which may be louder than at rest.
    unit = unit_of(task.problem.observations, channels)
    rms = np.sqrt(np.mean(unit**2 * likelihood.whitening.autocovariance(1)[..., 0], axis=0))
    units = tuple(task.units[c] for c, known in zip(channels, likelihood.known, strict=True) if not known)
    levels = np.array([level for level, known in zip(rms, likelihood.known, strict=True) if not known])
    tail = ((1.0,), ("-",)) if likelihood.heavy else ((), ())
    noise_units = np.concatenate([levels, tail[0]])
    every = priors.each + noise_priors(likelihood)
    batch = settings.batch_for(density.size)
    return target_of(density, every, priors.units + units + tail[1], noise_units, batch)


def number_of_coordinates(task: Task, heavy: bool) -> int:
    """Number of coordinates of a posterior before anything is known of it: free values and what is not known of noise.

    Parameters
    ----------
    heavy : bool
        Whether the likelihood is heavy-tailed, with degrees of freedom to find.
    """
    known = {*task.noise_given, *task.steps}
    levels = [channel for channel in task.problem.model.rig.channels if channel not in known]
    return task.problem.layout.size + len(levels) + heavy


def _counts(seen: View) -> np.ndarray:
    """Samples of each channel that count, ``(n_channel,)``, those in part in part; one where there are none."""
    data, channels = seen.problem.observations, seen.problem.model.rig.channels
    valid = np.stack([np.asarray(data.weight[c]) > 0.0 for c in channels], axis=1)
    share = valid if seen.raw is None else valid * np.square(seen.raw.downweight)
    return np.maximum(share.sum(axis=(0, 2)), 1.0)


def _at_minimum(problem: Problem, values: np.ndarray, linear: Linearised) -> Linearised:
    """The problem linearised where plain Gauss-Newton steps lead, as long as they lower the sum of squares."""
    for _ in range(STEPS):
        values = values + least_squares_step(problem.layout, linear)
        there = _linearised(problem, values)
        if not np.sum(there.residuals**2) < np.sum(linear.residuals**2):
            break
        linear = there
    return linear


STEPS = 6
"""Of Gauss and Newton: a start is near the best values."""


def _linearised(problem: Problem, values: np.ndarray) -> Linearised:
    return problem.followed(np.asarray(problem.layout.local(values)))[0]


def _change(seen: View, coefficients: InputCoefficients) -> float:
    """Largest change of the coefficients of errors of inputs since readings were linearised."""
    before = {} if seen.raw is None else seen.raw.coefficients
    return max((float(np.abs(best - before[name]).max()) for name, best in coefficients.items()), default=0.0)
