"""From a task and a fit to a posterior."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.errors import StudyError
from fibrefit.problem.estimate.gls import level_of
from fibrefit.problem.estimate.hausman import HausmanTest, hausman_check
from fibrefit.problem.inputs.errors_in_variables import InputCoefficients, input_errors
from fibrefit.problem.noise.choose import NoiseModel, choose_noise_model, least_squares_step
from fibrefit.problem.noise.likelihood import TAIL_START, Likelihood, unit_of
from fibrefit.problem.noise.rounding import with_noise_before_rounding, with_steps
from fibrefit.problem.posterior.log_posterior import LogPosterior, noise_priors
from fibrefit.problem.posterior.prior import Density, Prior, Priors, priors_of
from fibrefit.problem.statement.problem import Linearised, Problem
from fibrefit.problem.task import Task
from fibrefit.sampling import checks as judge
from fibrefit.sampling.approximation import Approximation
from fibrefit.sampling.chains.ensembles import ChainHistory, SamplerProgress
from fibrefit.sampling.deviations import (
    Deviations,
    between_of,
    gls_deviations,
    hausman_of_records,
    ols_deviations,
    random_effects_of,
)
from fibrefit.sampling.mode.inputs import gls_with_inputs, inputs_corrected
from fibrefit.sampling.mode.mode import find_mode
from fibrefit.sampling.mode.modes import Mode, distinct, sample_modes
from fibrefit.sampling.posterior import Posterior, marginals
from fibrefit.sampling.settings import Settings
from fibrefit.sampling.target import Target, target_of
from fibrefit.study.summaries.summaries import BetweenRecordsSummary

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
    """

    values: np.ndarray
    coefficients: InputCoefficients | None = None
    basins: Sequence[np.ndarray] = ()


class PosteriorRequest(NamedTuple):
    """What posterior is wanted.

    Parameters
    ----------
    noise : {"auto", "white", "autoregressive", "coloured"}
        Noise spectrum; ``"auto"`` lets the residuals of the start choose.
    heavy : bool
        Student's t (heavy-tailed) likelihood instead of a normal one.
    """

    noise: str = "auto"
    heavy: bool = False
    settings: Settings = Settings()


def sample_posterior(
    task: Task,
    begin: ChainStart,
    request: PosteriorRequest | None = None,
    *,
    stated: Mapping[str, PriorSetting | Prior] | None = None,
    checkpoint_file: Path | None = None,
    progress: Callable[[SamplerProgress], None] | None = None,
) -> Posterior:
    """The joint posterior of all free values and of the noise.

    Parameters
    ----------
    stated : mapping of name to prior
        Priors of the study; the others get defaults, which the result lists.
    checkpoint_file : pathlib.Path or None
        Holds the chains while they grow. Where there is one, they go on from there; the result is the same to the last
        bit.

    Raises
    ------
    StudyError
        If a prior contradicts the limits of its parameter, or neither data nor priors limit some direction.
    UsageError
        If the checkpoint belongs to another run, or the settings cannot work.
    """
    began, request = time.perf_counter(), request or PosteriorRequest()
    begin = begin._replace(values=np.asarray(begin.values, dtype=float))
    ready = _prepare(task, begin, stated or {}, request)
    every = ready.priors.each + noise_priors(ready.model.likelihood)
    starts = (coordinates_of(ready.density, values) for values in (ready.values, *begin.basins))
    first, *others = starts
    found = [find_mode(ready.density, first, every)[0], *_side_modes(ready.density, others, every)]
    modes = sample_modes(ready.target, distinct(found), request.settings, checkpoint_file, progress)
    return _concluded(task, begin.values, ready, modes, request.settings, began)


def _side_modes(density: LogPosterior, starts: Sequence[np.ndarray], priors: tuple[Prior, ...]) -> list[Approximation]:
    """Modes that other minima lead to; one where some direction is flat has no weight to be told."""
    found = []
    for start in starts:
        with contextlib.suppress(StudyError):
            mode, arrived = find_mode(density, start, priors)
            found += [mode] * arrived
    return found


class _Ready(NamedTuple):
    """All that is known before the first draw.

    Parameters
    ----------
    linear : Linearised
        At the plain estimate, the errors of inputs taken off.
    values : (n_free,) in SI units
        Where the walkers begin.
    widening : (n_free, n_free)
        See `Posterior`.
    """

    linear: Linearised
    model: NoiseModel
    priors: Priors
    density: LogPosterior
    target: Target
    values: np.ndarray
    widening: np.ndarray
    hausman: HausmanTest
    deviations: Deviations | None = None


def _prepare(
    task: Task, begin: ChainStart, stated: Mapping[str, PriorSetting | Prior], request: PosteriorRequest
) -> _Ready:
    known, layout, start = input_errors(task), task.problem.layout, begin.values
    if not known:
        return _of_exact_inputs(_in_steps(task, start), start, stated, request)
    plain, found = inputs_corrected(task, known, start, begin.coefficients or None)
    linear = jax.tree.map(np.asarray, _linearised(plain.problem, jnp.asarray(start)))
    model = noise_model_of(plain, linear, request.noise, request.heavy, True)
    whitening = model.likelihood.whitening
    level = level_of(whitening, linear.residuals, _counts(task))
    there = gls_with_inputs(task, known, start, found, whitening, level)
    priors = priors_of(layout, task.problem.model, there.values, stated)
    density = density_of(there.task.problem, priors, model.likelihood)
    target = _target(task, priors, density, request.settings)
    return _Ready(linear, model, priors, density, target, there.values, there.widening, there.hausman)


def _in_steps(task: Task, values: np.ndarray) -> Task:
    """The task with the likelihood of readings in coarse steps, whose noise before rounding is found once for all."""
    if not task.steps:
        return task
    problem = with_steps(task.problem, dict(task.steps))
    problem = with_noise_before_rounding(problem, problem.layout.local(values))
    return replace(task, problem=problem, noise_given=(*task.noise_given, *task.steps))


def _of_exact_inputs(
    task: Task,
    start: np.ndarray,
    stated: Mapping[str, PriorSetting | Prior],
    request: PosteriorRequest,
) -> _Ready:
    """The noise is what is left where records may differ; the mode and its deviations are those of a fit."""
    problem, layout, (noise, heavy, settings) = task.problem, task.problem.layout, request
    linear = jax.tree.map(np.asarray, _linearised(problem, jnp.asarray(start)))
    first = ols_deviations(task, start, linear)
    where, model = (None, None) if first is None else _noise_and_mode(task, first, noise, heavy)
    if where is None or model is None:
        # What the noise is does not hang on where the walkers begin.
        model = noise_model_of(task, _at_minimum(problem, start, linear), noise, heavy)
    whitening = model.likelihood.whitening
    here = linear if where is None else _linearised_at(problem, where.local)
    level = level_of(whitening, here.residuals, _counts(task))
    assumed = _level(task, model.likelihood, here)
    random_effects = None if where is None else random_effects_of(problem, where, whitening, assumed)
    values = start if where is None else where.values(layout)
    priors = priors_of(layout, problem.model, start, stated)
    density = replace(density_of(problem, priors, model.likelihood), random_effects=random_effects)
    target = _target(task, priors, density, settings)
    plain = first.local if first is not None and where is not None and where.found else layout.local(start)
    compared = hausman_of_records(layout, where, plain, _linearised_at(problem, plain), (whitening, level))
    still = np.zeros((layout.size, layout.size))
    return _Ready(here, model, priors, density, target, values, still, compared, where)


def _noise_and_mode(
    task: Task, first: Deviations, noise: str, heavy: bool
) -> tuple[Deviations | None, NoiseModel | None]:
    """Noise that is left at a place, and the mode in it; as in a fit, looked for where records may differ broadly."""
    where: Deviations | None = first
    model: NoiseModel | None = None
    for _ in range(ROUNDS):
        if where is None:
            break
        linear = _linearised_at(task.problem, where.local)
        model = noise_model_of(task, linear, noise, heavy)
        where = gls_deviations(task.problem, where, model.likelihood.whitening, _level(task, model.likelihood, linear))
    return where, model


def _level(task: Task, likelihood: Likelihood, linear: Linearised) -> np.ndarray:
    """Noise over what the whitening assumes, as the density takes it: one where the study states the level."""
    return np.where(likelihood.known, 1.0, level_of(likelihood.whitening, linear.residuals, _counts(task)))


ROUNDS = 2
"""Of noise and mode."""


def _concluded(
    task: Task, start: np.ndarray, ready: _Ready, modes: list[Mode], settings: Settings, began: float
) -> Posterior:
    target, course = ready.target, modes[0].course
    assert course is not None  # the heaviest one is always sampled
    summary = marginals(target, course, settings.interval, ready.widening)
    ratio = np.sqrt(np.sum(np.square(ready.linear.residuals), axis=(0, 2)) / _counts(task))
    found = coordinates_of(ready.density, ready.values)[: task.problem.layout.size]
    checks = judge.assess(target, modes, summary, found, settings)
    return Posterior(
        target=target,
        density=ready.density,
        noise_model=ready.model,
        modes=tuple(modes),
        marginals=summary,
        checks=(
            *checks,
            hausman_check(target.names, ready.hausman),
            judge.residual_size(task.problem.model.rig.channels, ratio),
        ),
        hausman=ready.hausman,
        start=start,
        widening=ready.widening,
        settings=settings,
        channel_units=task.units,
        seconds=time.perf_counter() - began,
        between=_between(ready, course),
    )


def _between(ready: _Ready, course: ChainHistory) -> dict[str, BetweenRecordsSummary]:
    """How much records differ, over some of the draws."""
    if ready.deviations is None:
        return {}
    points = course.kept.reshape(-1, ready.density.size)
    chosen = np.linspace(0, len(points) - 1, SOME).round().astype(int)
    return between_of(ready.density, ready.deviations, points[chosen])


SOME = 400
"""Draws that tell how much records differ."""


def noise_model_of(
    task: Task, linear: Linearised, noise: str = "auto", heavy: bool = False, from_rests: bool = False
) -> NoiseModel:
    """Noise model of a task, given the residuals at its fit; levels the study states are not inferred.

    Parameters
    ----------
    from_rests : bool
        Whether the residuals have lost what errors of the inputs imitate: their spectrum is then that of the rests.
    """
    channels = task.problem.model.rig.channels
    known = tuple(channel in task.noise_given for channel in channels)
    if from_rests and noise == "auto":
        model = choose_noise_model(task.problem, linear, "coloured", known, heavy, task.noise)
        return replace(model, requested="rests")
    measured = {c: n for c, n in task.noise.items() if c not in task.noise_given and n.samples}
    return choose_noise_model(task.problem, linear, noise, known, heavy, measured)


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
    rms = unit_of(task.problem.observations, channels).mean(axis=0)
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


def _counts(task: Task) -> np.ndarray:
    """Number of samples of each channel that count, ``(n_channel,)``; one where there are none."""
    data = task.problem.observations
    return np.array([max(np.count_nonzero(np.asarray(data.weight[c])), 1) for c in task.problem.model.rig.channels])


def _at_minimum(problem: Problem, values: np.ndarray, linear: Linearised) -> Linearised:
    """The problem linearised where plain Gauss-Newton steps lead, as long as they lower the sum of squares."""
    for _ in range(STEPS):
        values = values + least_squares_step(problem.layout, linear)
        there = jax.tree.map(np.asarray, _linearised(problem, jnp.asarray(values)))
        if not np.sum(there.residuals**2) < np.sum(linear.residuals**2):
            break
        linear = there
    return linear


STEPS = 6
"""Of Gauss and Newton: a start is near the best values."""


def _linearised_at(problem: Problem, local: np.ndarray) -> Linearised:
    return jax.tree.map(np.asarray, problem.linearised_at(local))


@eqx.filter_jit
def _linearised(problem: Problem, values: jax.Array) -> Linearised:
    return problem.linearised(values)
