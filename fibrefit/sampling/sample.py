"""From a task and a fit to a posterior."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fibrefit.core.errors import StudyError
from fibrefit.problem.noise.likelihood import unit_of
from fibrefit.problem.posterior.log_posterior import LogPosterior, noise_priors
from fibrefit.problem.posterior.prior import Prior
from fibrefit.problem.task import Task
from fibrefit.sampling import checks as judge
from fibrefit.sampling.approximation import Approximation
from fibrefit.sampling.chains.ensembles import ChainHistory, SamplerProgress
from fibrefit.sampling.deviations import between_of
from fibrefit.sampling.mode.mode import find_mode
from fibrefit.sampling.mode.modes import Mode, distinct, sample_modes
from fibrefit.sampling.posterior import Posterior, marginals
from fibrefit.sampling.ready import ChainStart, PosteriorRequest, Ready, coordinates_of, prepare
from fibrefit.sampling.settings import Settings
from fibrefit.study.summaries.check import Check
from fibrefit.study.summaries.results import BetweenRecordsSummary, ChannelGap

if TYPE_CHECKING:
    from fibrefit.study.parameters import PriorSetting


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
    ready = prepare(task, begin, stated or {}, request)
    every = ready.priors.each + noise_priors(ready.model.likelihood)
    starts = (coordinates_of(ready.density, values) for values in (ready.values, *begin.basins))
    first, *others = starts
    found = [find_mode(ready.density, first, every)[0], *_side_modes(ready.density, others, every)]
    modes = sample_modes(ready.target, distinct(found), request.settings, checkpoint_file, progress)
    return _concluded(task, begin, ready, modes, request.settings, began)


def _side_modes(density: LogPosterior, starts: Sequence[np.ndarray], priors: tuple[Prior, ...]) -> list[Approximation]:
    """Modes that other minima lead to; one where some direction is flat has no weight to be told."""
    found = []
    for start in starts:
        with contextlib.suppress(StudyError):
            mode, arrived = find_mode(density, start, priors)
            found += [mode] * arrived
    return found


def _concluded(
    task: Task, begin: ChainStart, ready: Ready, modes: list[Mode], settings: Settings, began: float
) -> Posterior:
    target, course = ready.target, modes[0].course
    assert course is not None  # the heaviest one is always sampled
    summary = marginals(target, course, settings.interval)
    reported = begin.values if begin.reported is None else begin.reported
    found = coordinates_of(ready.density, reported)[: task.problem.layout.size]
    checks = judge.assess(target, modes, summary, found, settings)
    return Posterior(
        target=target,
        density=ready.density,
        noise_model=ready.model,
        modes=tuple(modes),
        marginals=summary,
        checks=(
            *checks,
            ready.hausman.check(target.names),
            *_differ_within(ready),
            judge.residual_size(task.problem.model.rig.channels, ready.ratio),
        ),
        hausman=ready.hausman,
        start=begin.values,
        settings=settings,
        channel_units=task.units,
        seconds=time.perf_counter() - began,
        between=_between(ready, course),
        inputs=ready.inputs,
        alike=ready.alike,
        moving=ready.moving,
        gap=_gap(task, ready),
    )


def _gap(task: Task, ready: Ready) -> dict[str, ChannelGap]:
    """What is left of each channel at the mode: so many times the noise of its quietest readings as residuals are."""
    data, channels = ready.density.problem.observations, task.problem.model.rig.channels
    number = np.stack([np.sum(np.asarray(data.weight[c]) > 0.0, axis=1) for c in channels], axis=1)
    noise = np.sqrt(np.sum(unit_of(data, channels) ** 2 * number, axis=0) / np.maximum(number.sum(axis=0), 1))
    sizes = zip(channels, noise.tolist(), ready.ratio.tolist(), strict=True)
    return {c: ChannelGap.against_noise(rms, ratio * rms, task.units[c]) for c, rms, ratio in sizes if rms > 0.0}


def _differ_within(ready: Ready) -> list[Check]:
    """Whether records differ by no more than is looked for, as a fit asks; nothing where nobody has to."""
    evidence = None if ready.deviations is None else ready.deviations.evidence
    return [] if evidence is None else evidence.between_records_checks()


def _between(ready: Ready, course: ChainHistory) -> dict[str, BetweenRecordsSummary]:
    """How much records differ, over some of the draws."""
    if ready.deviations is None or ready.density.random_effects is None:
        return {}
    points = course.kept.reshape(-1, ready.density.size)
    chosen = np.linspace(0, len(points) - 1, SOME).round().astype(int)
    return between_of(ready.density, ready.deviations, points[chosen])


SOME = 400
"""Draws that tell how much records differ."""
