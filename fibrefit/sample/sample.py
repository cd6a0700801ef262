"""From a task and a fit to a posterior."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.likelihood import TAIL_START, Likelihood, noise_priors, unit_of
from fibrefit.problem.log_posterior import LogPosterior
from fibrefit.problem.noise_model import NoiseModel, choose_noise_model
from fibrefit.problem.prior import Density, Prior, Priors, priors_of
from fibrefit.problem.problem import Linearised, Problem
from fibrefit.problem.task import Task
from fibrefit.sample import judge
from fibrefit.sample.alarm import Parting, loudness_check, parting, parting_check
from fibrefit.sample.ensembles import Progress
from fibrefit.sample.mode import climb
from fibrefit.sample.modes import distinct, sample_modes
from fibrefit.sample.posterior import Posterior, marginals
from fibrefit.sample.settings import Settings
from fibrefit.sample.target import Target, target_of

if TYPE_CHECKING:
    from fibrefit.study.parameters import PriorSetting


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
    began = time.perf_counter()
    settings = settings or Settings()
    problem = task.problem
    linear = jax.tree.map(np.asarray, _linearised(problem, jnp.asarray(start)))
    model = noise_model_of(task, linear, noise, heavy)
    priors = priors_of(problem.layout, problem.model, start, stated or {})
    density = density_of(problem, priors, model.likelihood)
    target = _target(task, priors, density)
    every = priors.each + noise_priors(model.likelihood)
    found = [climb(density, place(density, values), every)[0] for values in (start, *basins)]
    modes = sample_modes(target, distinct(found), settings, checkpoint_file, resume, progress)
    summary = marginals(target, modes[0].course, settings.interval)
    parted, alarms = _alarms(task, model, linear)
    checks = judge.assess(target, modes, summary, place(density, start), settings) + alarms
    return Posterior(
        target=target,
        density=density,
        noise_model=model,
        priors=priors.says() + _noise_priors_say(target, priors),
        modes=tuple(modes),
        marginals=summary,
        checks=checks,
        parting=parted,
        start=np.asarray(start, dtype=float),
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


def _target(task: Task, priors: Priors, density: LogPosterior) -> Target:
    channels, likelihood = task.problem.model.rig.channels, density.likelihood
    rms = unit_of(task.problem.observations, channels).mean(axis=0)
    units = tuple(task.units[c] for c, known in zip(channels, likelihood.known, strict=True) if not known)
    levels = np.array([level for level, known in zip(rms, likelihood.known, strict=True) if not known])
    tail = ((1.0,), ("-",)) if likelihood.heavy else ((), ())
    noise_units = np.concatenate([levels, tail[0]])
    return target_of(density, priors.each + noise_priors(likelihood), priors.units + units + tail[1], noise_units)


def _noise_priors_say(target: Target, priors: Priors) -> tuple[str, ...]:
    rest = slice(len(priors.each), None)
    named = zip(target.names[rest], target.units[rest], target.priors[rest], strict=True)
    return tuple(f"{name}: {prior.says(unit)} (default)" for name, unit, prior in named)


def _alarms(task: Task, model: NoiseModel, linear: Linearised) -> tuple[Parting, tuple]:
    channels, data = task.problem.model.rig.channels, task.problem.observations
    counts = np.array([float(np.sum(np.asarray(data.weight[c]) > 0.0)) for c in channels])
    ratio = np.sqrt(np.sum(linear.residuals**2, axis=(0, 2)) / counts)
    found = parting(task.problem.layout, linear, model.likelihood.whitening, _level(model, linear, counts))
    return found, (parting_check(task.problem.layout.free_names, found), loudness_check(channels, ratio))


def _level(model: NoiseModel, linear: Linearised, counts: np.ndarray) -> np.ndarray:
    innovations = np.asarray(model.likelihood.whitening.whiten(jnp.asarray(linear.residuals)))
    return np.sqrt(np.sum(innovations**2, axis=(0, 2)) / counts)


@eqx.filter_jit
def _linearised(problem: Problem, values: jax.Array) -> Linearised:
    return problem.linearised(values)
