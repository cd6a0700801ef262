"""From a task and a fit to a posterior."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.likelihood import TAIL_START, Likelihood, noise_priors, unit_of
from fibrefit.problem.log_posterior import LogPosterior
from fibrefit.problem.noise_model import NoiseModel, choose_noise_model
from fibrefit.problem.prior import Density, Prior, Priors, priors_of
from fibrefit.problem.problem import Linearised, Problem
from fibrefit.problem.propagated import propagated
from fibrefit.problem.task import Task
from fibrefit.problem.whitening import innovations
from fibrefit.sample import judge
from fibrefit.sample.alarm import loudness_check, parting, parting_check
from fibrefit.sample.ensembles import Progress
from fibrefit.sample.inputs import covariance_of, input_steps
from fibrefit.sample.mode import climb
from fibrefit.sample.modes import Mode, distinct, sample_modes
from fibrefit.sample.posterior import Posterior, marginals
from fibrefit.sample.settings import Settings
from fibrefit.sample.target import Target, target_of

if TYPE_CHECKING:
    from fibrefit.study.parameters import PriorSetting


QUIETEST = 1e-6
"""Level of a channel that says nothing."""


def sample_posterior(
    task: Task,
    start: np.ndarray,
    *,
    stated: Mapping[str, PriorSetting | Prior] | None = None,
    basins: Sequence[np.ndarray] = (),
    noise: str = "auto",
    heavy: bool = False,
    settings: Settings | None = None,
    checkpoint_file: Path | None = None,
    resume: bool = False,
    progress: Callable[[Progress], None] | None = None,
) -> Posterior:
    """The joint posterior of all free values and of the noise.

    Parameters
    ----------
    task : Task
    start : (n_free,) in SI units
        The best fit.
    stated : mapping of name to prior
        Priors of the study; the others get defaults, which the result lists.
    basins : sequence of (n_free,) in SI units
        Other minima of the multi-start: modes are looked for from each.
    noise : {"auto", "white", "autoregressive", "coloured"}
        Colour of the noise; ``"auto"`` lets the residuals of the start choose.
    heavy : bool
        Student's t for single samples instead of a normal law.
    settings : Settings
    checkpoint_file : pathlib.Path or None
        Holds the chains while they grow.
    resume : bool
        Go on from that file, where there is one; the result is the same to the last bit.
    progress : callable, optional

    Returns
    -------
    Posterior

    Raises
    ------
    StudyError
        If a prior contradicts the limits of its parameter, or neither data nor priors limit some direction.
    UsageError
        If the checkpoint belongs to another run, or the settings cannot work.
    """
    began, settings = time.perf_counter(), settings or Settings()
    ready = _prepare(task, start, stated or {}, noise, heavy, settings)
    every = ready.priors.each + noise_priors(ready.model.likelihood)
    found = [climb(ready.density, place(ready.density, values), every)[0] for values in (start, *basins)]
    modes = sample_modes(ready.target, distinct(found), settings, checkpoint_file, resume, progress)
    return _concluded(task, np.asarray(start, dtype=float), ready, modes, settings, began)


class _Ready(NamedTuple):
    """All that is known before the first draw."""

    linear: Linearised
    model: NoiseModel
    priors: Priors
    density: LogPosterior
    target: Target


def _prepare(
    task: Task,
    start: np.ndarray,
    stated: Mapping[str, PriorSetting | Prior],
    noise: str,
    heavy: bool,
    settings: Settings,
) -> _Ready:
    problem = task.problem
    linear = jax.tree.map(np.asarray, _linearised(problem, jnp.asarray(start)))
    model = noise_model_of(task, linear, noise, heavy)
    priors = priors_of(problem.layout, problem.model, start, stated)
    density = density_of(problem, priors, model.likelihood)
    return _Ready(linear, model, priors, density, _target(task, priors, density, settings))


def _concluded(
    task: Task, start: np.ndarray, ready: _Ready, modes: list[Mode], settings: Settings, began: float
) -> Posterior:
    problem, model, target = task.problem, ready.model, ready.target
    whitening, level = model.likelihood.whitening, _level(model, ready.linear, _counts(task))
    steps = input_steps(task, start, ready.linear, whitening, level, settings.seed)
    widening = covariance_of(steps, problem, start)
    course = modes[0].course
    assert course is not None  # the heaviest one is always sampled
    summary = marginals(target, course, settings.interval, widening)
    parted = parting(problem.layout, ready.linear, whitening, level, steps)
    loudness = loudness_check(problem.model.rig.channels, _loudness(task, start, ready.linear))
    checks = judge.assess(target, modes, summary, place(ready.density, start), settings)
    return Posterior(
        target=target,
        density=ready.density,
        noise_model=model,
        priors=ready.priors.says() + _noise_priors_say(target, ready.priors),
        modes=tuple(modes),
        marginals=summary,
        checks=(*checks, parting_check(target.names, parted), loudness),
        parting=parted,
        start=start,
        widening=widening,
        settings=settings,
        channel_units=task.units,
        seconds=time.perf_counter() - began,
    )


def noise_model_of(task: Task, linear: Linearised, noise: str = "auto", heavy: bool = False) -> NoiseModel:
    """Noise model of a task, given the residuals at its fit; levels the study states are not learnt."""
    known = tuple(channel in task.noise_given for channel in task.problem.model.rig.channels)
    measured = {c: n for c, n in task.noise.items() if c not in task.noise_given and n.samples}
    return choose_noise_model(task.problem, linear, noise, known, heavy, measured)


def density_of(problem: Problem, priors: Priors, likelihood: Likelihood) -> LogPosterior:
    """Log posterior density of a problem."""
    return LogPosterior(problem, priors.density, Density.of(noise_priors(likelihood)), likelihood)


def place(density: LogPosterior, values: np.ndarray) -> np.ndarray:
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


def _noise_priors_say(target: Target, priors: Priors) -> tuple[str, ...]:
    rest = slice(len(priors.each), None)
    named = zip(target.names[rest], target.units[rest], target.priors[rest], strict=True)
    return tuple(f"{name}: {prior.says(unit)} (default)" for name, unit, prior in named)


def _loudness(task: Task, values: np.ndarray, linear: Linearised) -> np.ndarray:
    """Rms of the residuals ``(n_channel,)`` over what noise of channels and inputs accounts for."""
    squares = np.sum(np.square(linear.residuals), axis=(0, 2)) / _counts(task)
    from_inputs = propagated(task, values, linear.slopes)
    if len(from_inputs):
        return np.sqrt(squares / (1.0 + np.sum(from_inputs**2, axis=(1, 3)).mean(axis=0) / _counts(task)))
    return np.sqrt(squares)


def _counts(task: Task) -> np.ndarray:
    """Number of samples of each channel that count, ``(n_channel,)``; one where there are none."""
    data = task.problem.observations
    return np.array([max(np.count_nonzero(np.asarray(data.weight[c])), 1) for c in task.problem.model.rig.channels])


def _level(model: NoiseModel, linear: Linearised, counts: np.ndarray) -> np.ndarray:
    """Noise of the residuals over what the noise model assumes, ``(n_channel,)``."""
    fresh = np.asarray(innovations(model.likelihood.whitening, jnp.asarray(linear.residuals)))
    return np.maximum(np.sqrt(np.sum(fresh**2, axis=(0, 2)) / counts), QUIETEST)


@eqx.filter_jit
def _linearised(problem: Problem, values: jax.Array) -> Linearised:
    return problem.linearised(values)
