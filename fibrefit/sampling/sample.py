"""From a task and a fit to a posterior: what is known before the first draw, the chains, and what they say."""

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
from fibrefit.problem import (
    DRAWS_OF_ERRORS,
    InputCoefficients,
    Levelled,
    Linearised,
    Problem,
    Task,
    View,
    corrected,
    input_errors,
    level_of,
    noise_of_residuals,
    unit_of,
    with_noise_before_rounding,
    with_steps,
)
from fibrefit.sampling import latent
from fibrefit.sampling.chains import SamplerProgress, Target
from fibrefit.sampling.density.filters import least_squares_step
from fibrefit.sampling.density.kinds import OF_A_FIT
from fibrefit.sampling.density.likelihood import (
    TAIL_START,
    Likelihood,
    NoiseModel,
    choose_noise_model,
    downweighted_likelihood,
)
from fibrefit.sampling.density.log_posterior import LogPosterior, noise_priors
from fibrefit.sampling.density.prior import Density, Prior, Priors
from fibrefit.sampling.evidence import distinct, sample_modes
from fibrefit.sampling.latent import Deviations
from fibrefit.sampling.mode import find_mode
from fibrefit.sampling.posterior import Posterior, PosteriorSetup, assess, marginals, residual_size
from fibrefit.sampling.settings import AS_A_FIT, Settings
from fibrefit.study.summaries.results import ChannelGap

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
        What the fit reports, with which the posterior is compared; the plain values where there is nothing else.
    """

    values: np.ndarray
    coefficients: InputCoefficients | None = None
    basins: Sequence[np.ndarray] = ()
    reported: np.ndarray | None = None


class PosteriorRequest(NamedTuple):
    """What posterior is wanted.

    Parameters
    ----------
    noise : str
        ``"fit"``, the noise that a fit takes; ``"auto"``, the kind that the residuals at the start choose; or one of
        `KINDS`, with the spectra of the rests if it is made of spectra and all channels have one. With measured inputs
        the first two and `OF_A_FIT` are one.
    heavy : bool
        Student's t (heavy-tailed) likelihood instead of a normal one.
    """

    noise: str = AS_A_FIT
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
    settings, begin = request.settings, begin._replace(values=np.asarray(begin.values, dtype=float))
    setup = prepare(task, begin, stated or {}, request)
    density, target, deviations = setup.density, setup.target, setup.deviations
    priors = setup.priors.each + noise_priors(setup.noise_model.likelihood)
    first, *others = (coordinates_of(density, values) for values in (setup.values, *begin.basins))
    found = [find_mode(density, first, priors)[0]]
    for start in others:
        # Modes that other minima lead to; one where some direction is flat has no weight.
        with contextlib.suppress(StudyError):
            mode, arrived = find_mode(density, start, priors)
            found += [mode] * arrived
    modes = sample_modes(target, distinct(found), settings, checkpoint_file, progress)

    course = modes[0].course
    assert course is not None  # the heaviest one is always sampled
    summary = marginals(target, course, settings.interval)
    reported = begin.values if begin.reported is None else begin.reported
    at = coordinates_of(density, reported)[: task.problem.layout.size]
    checks = [*assess(target, modes, summary, at, settings), setup.hausman.check(target.names)]
    if deviations is not None and deviations.evidence is not None:
        # Whether records differ by no more than the grid covers, as for a fit.
        checks += deviations.evidence.between_records_checks()
    checks.append(residual_size(task.problem.model.rig.channels, setup.ratio))
    between = {}
    if deviations is not None and density.random_effects is not None:
        points = course.kept.reshape(-1, density.size)
        # Of 400 draws a mean is known to a twentieth of what they scatter by.
        chosen = np.linspace(0, len(points) - 1, 400).round().astype(int)
        between = latent.between_of(density, deviations, points[chosen])
    return Posterior(
        **vars(setup),
        modes=tuple(modes),
        marginals=summary,
        checks=tuple(checks),
        start=begin.values,
        settings=settings,
        channel_units=task.units,
        seconds=time.perf_counter() - began,
        between=between,
        gap=_gap(task, setup),
    )


def _gap(task: Task, setup: PosteriorSetup) -> dict[str, ChannelGap]:
    """RMS residual of each channel at the mode: so many times the noise of its quietest readings as residuals are."""
    data, channels = setup.density.problem.observations, task.problem.model.rig.channels
    number = np.stack([np.sum(np.asarray(data.weight[c]) > 0.0, axis=1) for c in channels], axis=1)
    noise = np.sqrt(np.sum(unit_of(data, channels) ** 2 * number, axis=0) / np.maximum(number.sum(axis=0), 1))
    sizes = zip(channels, noise.tolist(), setup.ratio.tolist(), strict=True)
    return {c: ChannelGap.against_noise(rms, ratio * rms, task.units[c]) for c, rms, ratio in sizes if rms > 0.0}


def prepare(
    task: Task, begin: ChainStart, stated: Mapping[str, PriorSetting | Prior], request: PosteriorRequest
) -> PosteriorSetup:
    """The noise is that of the residuals where records may differ; the mode and its deviations are those of a fit."""
    start, layout = begin.values, task.problem.layout
    if task.steps:
        # The likelihood of readings in coarse steps, whose noise before rounding is found once for all.
        problem, known = with_steps(task.problem, dict(task.steps)), input_errors(task)
        errors = begin.coefficients
        there = corrected(problem, known, errors) if known and errors else problem
        there = with_noise_before_rounding(there, problem.layout.local(start))
        problem = with_steps(problem, there.observations.steps)
        task = replace(task, problem=problem, noise_given=(*task.noise_given, *task.steps))
    first = latent.seen_at(task, start, begin.coefficients)
    plain = latent.ols_deviations(task, start, first)
    where, local, seen, model, moving = _noise_and_mode(task, plain, start, first, request)
    likelihood = _counted(task, seen, model.likelihood)
    level = _level(seen, local, likelihood)

    # Noise coordinates of those levels that are not known.
    noise = [np.log(one) for one, given in zip(level, likelihood.known, strict=True) if not given]
    noise += [np.log(TAIL_START)] if likelihood.heavy else []
    spread = np.asarray(likelihood.curvature(jnp.asarray(np.array(noise)))) ** -0.5
    whitened = seen.through(Levelled(likelihood.whitening, jnp.asarray(spread)))
    inputs = latent.input_effects_of(whitened, local, spread)
    random_effects = None if where is None else latent.random_effects_of(whitened, where, spread, inputs)
    priors = Priors.of(layout, task.problem.model, start, stated)
    noise_prior = Density.of(noise_priors(likelihood))
    density = LogPosterior(seen.problem, priors.density, noise_prior, likelihood, random_effects, inputs)
    near = plain.local if where is not None and where.found else np.asarray(layout.local(start))

    # Samples of each channel that count, those in part in part; one where there are none.
    data, channels = seen.problem.observations, seen.problem.model.rig.channels
    valid = np.stack([np.asarray(data.weight[c]) > 0.0 for c in channels], axis=1)
    share = valid if seen.raw is None else valid * np.square(seen.raw.downweight)
    counts = np.maximum(share.sum(axis=(0, 2)), 1.0)
    return PosteriorSetup(
        ratio=np.sqrt(np.sum(seen.residuals(local)[0][0] ** 2, axis=(0, 2)) / counts),
        noise_model=model,
        priors=priors,
        density=density,
        target=_target(task, priors, density, request.settings),
        values=start if where is None else where.values(layout),
        hausman=latent.hausman_of_records(first, where, near, (likelihood.whitening, level)),
        deviations=where,
        inputs=latent.drawn_inputs_of(task, whitened, spread),
        alike=where is None and len(plain.names) > 0,
        moving=moving,
    )


def _counted(task: Task, seen: View, likelihood: Likelihood) -> Likelihood:
    """The likelihood, of which samples that are badly predicted linearly count in part."""
    if seen.raw is None:
        return likelihood
    return downweighted_likelihood(likelihood, task.problem.observations, seen.raw.downweight)


def _noise_and_mode(
    task: Task, first: Deviations, start: np.ndarray, seen: View, request: PosteriorRequest
) -> tuple[Deviations | None, np.ndarray, View, NoiseModel, float]:
    """Noise of the residuals at a place, and the mode in it; as in a fit, sought where records may differ broadly.

    Readings are linearised in errors of inputs anew where these are best, until they are found where they were.

    Returns
    -------
    where : Deviations or None
        The mode; None where none is reached.
    local : (n_record, n_local) in SI units
        Where records are most probable.
    seen : View
        Records linearised in errors of inputs.
    model : NoiseModel
    moving : float
        See `PosteriorSetup`.
    """
    where, reached, moved = first, False, 0.0
    # Change of coefficients, whose prior has a spread of one, below which readings stay linearised where they are.
    settled = 0.05
    rounds, most = 2, 6
    for number in range(1, most + 1):
        # The noise that what was fitted took along is put back, as a fit does.
        linear, residuals = seen.problem.evaluate(where.local)[0], None
        if seen.raw is not None or request.noise == AS_A_FIT:
            residuals = seen.residuals(where.local, DRAWS_OF_ERRORS)[0]
            linear = linear._replace(residuals=residuals[0])
            if (known := where.evidence) is not None:
                residuals = seen.residuals_with_noise_power(known.mode, known.posterior_roots(), DRAWS_OF_ERRORS)
        model = noise_model_of(task, seen.problem, linear, request, residuals)
        # A spectrum that is found as a fit finds it has its level.
        level = np.ones(len(model.likelihood.known))
        if model.requested != AS_A_FIT:
            likelihood = _counted(task, seen, model.likelihood)
            level = np.where(likelihood.known, 1.0, _level(seen, where.local, likelihood))
        seen = seen.through(Levelled(model.likelihood.whitening, jnp.asarray(level)))
        found = latent.gls_deviations(seen, where)
        reached = found is not None
        if found is None:
            break
        where, best = found, seen.residuals(found.local)[1]
        before = {} if seen.raw is None else seen.raw.coefficients
        moved = max((float(np.abs(errors - before[name]).max()) for name, errors in best.items()), default=0.0)
        if number >= rounds and moved < settled:
            break
        if moved >= settled and number < most:
            seen = latent.seen_at(task, where.local, best)
    moving = moved if moved >= settled else 0.0
    if reached or seen.raw is not None:
        return where if reached else None, where.local, seen, model, moving

    # What the noise is does not hang on where the walkers begin: it is that where plain Gauss-Newton steps lead, as
    # long as they lower the sum of squares. A start is near the best values.
    problem, values = task.problem, start
    linear = _linearised(problem, values)
    for _ in range(6):
        values = values + least_squares_step(problem.layout, linear)
        there = _linearised(problem, values)
        if not np.sum(there.residuals**2) < np.sum(linear.residuals**2):
            break
        linear = there
    model = noise_model_of(task, problem, linear, request)
    return None, np.asarray(problem.layout.local(start)), seen, model, moving


def _linearised(problem: Problem, values: np.ndarray) -> Linearised:
    return problem.evaluate(np.asarray(problem.layout.local(values)))[0]


def _level(seen: View, local: np.ndarray, likelihood: Likelihood) -> np.ndarray:
    """Noise over what a whitening assumes, ``(n_channel,)``; errors of inputs as they may be, not as they are best."""
    rows, counts = seen.residuals(local, DRAWS_OF_ERRORS)[0], np.maximum(np.asarray(likelihood.counts), 1.0)
    squares = [level_of(likelihood.whitening, row, counts) ** 2 for row in rows[min(1, len(rows) - 1) :]]
    return np.asarray(np.sqrt(np.mean(squares, axis=0)))


def noise_model_of(
    task: Task, problem: Problem, linear: Linearised, request: PosteriorRequest, residuals: np.ndarray | None = None
) -> NoiseModel:
    """Noise model of a task, given the residuals at its fit; levels the study states are not inferred.

    Parameters
    ----------
    problem : Problem
        As it is linearised.
    residuals : (n_draw, n_record, n_channel, n_time), optional
        Residuals that have the power of the noise, where errors of inputs took some of it off those at the fit; the
        spectrum is theirs.
    """
    channels, (noise, heavy, _) = task.problem.model.rig.channels, request
    known = tuple(channel in task.noise_given for channel in channels)
    if noise == AS_A_FIT or (residuals is not None and noise in ("auto", OF_A_FIT)):
        rows = np.asarray(linear.residuals)[None] if residuals is None else residuals
        spectrum = dict(zip(channels, noise_of_residuals(problem, rows), strict=True))
        found = choose_noise_model(problem, linear, OF_A_FIT, known, heavy, spectrum)
        return replace(found, requested=noise if noise == OF_A_FIT else AS_A_FIT)
    measured = {c: n for c, n in task.noise.items() if c not in task.noise_given and n.samples}
    return choose_noise_model(problem, linear, noise, known, heavy, measured)


def coordinates_of(density: LogPosterior, values: np.ndarray) -> np.ndarray:
    """Coordinates ``(n,)`` of free values in SI units, the noise being what it is assumed to be."""
    noise = np.zeros(density.likelihood.size)
    if density.likelihood.heavy:
        noise[-1] = np.log(TAIL_START)
    return np.concatenate([np.asarray(density.problem.layout.free(jnp.asarray(values))), noise])


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


def _target(task: Task, priors: Priors, density: LogPosterior, settings: Settings) -> Target:
    """Target of a log posterior: values in SI units, the noise in units of its channels."""
    channels, layout, likelihood = task.problem.model.rig.channels, density.problem.layout, density.likelihood
    # A level is one where noise is what the whitening assumes, which may be louder than at rest.
    unit = unit_of(task.problem.observations, channels)
    rms = np.sqrt(np.mean(unit**2 * likelihood.whitening.autocovariance(1)[..., 0], axis=0))
    noise = [(level, task.units[c]) for c, level, k in zip(channels, rms, likelihood.known, strict=True) if not k]
    noise += [(1.0, "-")] if likelihood.heavy else []
    scale = np.concatenate([np.ones(layout.size), np.array([level for level, _ in noise])])
    # The prior of a value that is so many times as large as that of which it was stated.
    scaled = [
        replace(
            prior,
            centre=prior.centre * level,
            spread=prior.spread if prior.log else prior.spread * level,
            lower=prior.lower * level,
            upper=prior.upper * level,
        )
        for prior, (level, _) in zip(noise_priors(likelihood), noise, strict=True)
    ]
    return Target(
        names=layout.free_names + likelihood.names,
        units=priors.units + tuple(unit for _, unit in noise),
        log_density=batched(density, settings.batch_for(density.size)),
        values=lambda points: np.asarray(_values(density, jnp.asarray(points))) * scale,
        priors=(*priors.each, *scaled),
    )


def batched(density: LogPosterior, batch: int) -> Callable[[np.ndarray], np.ndarray]:
    """Log density of many points ``(n_point, n) -> (n_point,)`` by one compiled program of fixed shape.

    Points are cut into batches of one size, so that nothing is compiled twice and a point's bits do not depend on its
    neighbours. On a CPU a batch is worked off point by point, as long as one simulation's arrays fit its cache.
    """

    def log_density(points: np.ndarray) -> np.ndarray:
        points = np.atleast_2d(points)
        rest = -len(points) % batch
        filled = np.concatenate([points, np.repeat(points[-1:], rest, axis=0)])
        parts = filled.reshape(-1, batch, points.shape[1])
        return np.concatenate([np.asarray(_log_densities(density, jnp.asarray(part))) for part in parts])[: len(points)]

    return log_density


@eqx.filter_jit
def _log_densities(density: LogPosterior, points: jax.Array) -> jax.Array:
    return jax.lax.map(density, points) if jax.default_backend() == "cpu" else jax.vmap(density)(points)


@eqx.filter_jit
def _values(density: LogPosterior, points: jax.Array) -> jax.Array:
    return jax.vmap(density.values)(points)
