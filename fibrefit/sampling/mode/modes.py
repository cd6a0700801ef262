"""Several modes: each is sampled on its own and weighed; they are never averaged over."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fibrefit.sampling.approximation import Approximation
from fibrefit.sampling.chains.ensembles import ChainHistory, SamplerProgress, run_ensembles
from fibrefit.sampling.evidence import Evidence, bridge
from fibrefit.sampling.settings import Settings
from fibrefit.sampling.target import Target
from fibrefit.sampling.thresholds import LEFT_MODE, NEGLIGIBLE_MODE, SAME_MODE

LOOK_STEPS, LOOK_ESS = 300, 100.0
"""Budget of a mode that is only weighed; one that proves the heaviest is sampled like any other."""


@dataclass(frozen=True)
class Mode:
    """One mode of a posterior.

    Parameters
    ----------
    weight : float
        Share of the posterior's mass; 0 to 1.
    course : ChainHistory or None
        None where the mode was too light to be sampled.
    evidence : Evidence
        By bridge sampling, or by Laplace's method with an infinite error where there are not draws enough.
    absorbed : bool
        Whether its ensembles moved to another mode, whose draws then stand for both.
    """

    approximation: Approximation
    weight: float
    course: ChainHistory | None
    evidence: Evidence
    absorbed: bool = False


def distinct(found: Sequence[Approximation]) -> list[Approximation]:
    """Modes without repetition, the heaviest (by Laplace) first; of two searches that end in one, the first."""
    kept: list[Approximation] = []
    # Two that end in one differ by what their last steps left, not by a hundredth of a nat.
    for mode in sorted(found, key=lambda mode: -round(mode.log_evidence, 2)):
        if all(min(m.distance(mode.centre), mode.distance(m.centre)) > SAME_MODE for m in kept):
            kept.append(mode)
    return kept


def sample_modes(
    target: Target,
    approximations: Sequence[Approximation],
    settings: Settings,
    checkpoint_file: Path | None = None,
    progress: Callable[[SamplerProgress], None] | None = None,
) -> list[Mode]:
    """Sample every mode of some weight with ensembles of its own.

    Parameters
    ----------
    approximations : sequence of Approximation
        The heaviest first.
    checkpoint_file : pathlib.Path or None
        Of the first mode, as for `run_ensembles`; the others' have a number added to the name, and those of a look at
        a mode, which end earlier, "look": a run that goes on looks at the same chains again.

    Returns
    -------
    list of Mode
        The heaviest first; weights add up to one.
    """
    files = [checkpoint_file, *(_named(checkpoint_file, f"{n}") for n in range(2, len(approximations) + 1))]
    look = replace(settings, max_steps=min(settings.max_steps, LOOK_STEPS), ess=min(settings.ess, LOOK_ESS))

    def sampled(number: int, budget: Settings, file: Path | None) -> Mode:
        approximation = approximations[number]
        course = run_ensembles(target, approximation, budget, file, progress)
        found = bridge(target.log_density, course, settings.seed)
        return Mode(approximation, 0.0, course, found or _by_laplace(approximation))

    modes = [Mode(approximation, 0.0, None, _by_laplace(approximation)) for approximation in approximations]
    modes[0], whole = sampled(0, settings, files[0]), {0}
    # Draws may weigh a mode otherwise than Laplace's method did: who is first is asked again after each.
    while True:
        logs = [mode.evidence.log_value for mode in modes]
        top = max(log for log, mode in zip(logs, modes, strict=True) if mode.course)
        unseen = [n for n, m in enumerate(modes) if m.course is None and logs[n] - top >= np.log(NEGLIGIBLE_MODE)]
        first = int(np.argmax(logs))
        if unseen:
            modes[unseen[0]] = sampled(unseen[0], look, _named(files[unseen[0]], "look"))
        elif first not in whole:
            modes[first] = sampled(first, settings, files[first])
            whole.add(first)
        else:
            return _weighed(_settled(modes))


def _by_laplace(approximation: Approximation) -> Evidence:
    return Evidence(approximation.log_evidence, np.inf)


def _named(file: Path | None, what: str) -> Path | None:
    return None if file is None else file.with_name(f"{file.stem}-{what}{file.suffix}")


def _settled(modes: list[Mode]) -> list[Mode]:
    """Mark the modes whose ensembles did not stay: the heavier of two that mix has the draws of both."""
    settled: list[Mode] = []
    for mode in sorted(modes, key=lambda mode: -mode.evidence.log_value):
        others = [other for other in settled if not other.absorbed]
        settled.append(replace(mode, absorbed=mode.course is not None and _moved(mode, others)))
    return settled


def _moved(mode: Mode, heavier: list[Mode]) -> bool:
    assert mode.course is not None
    points = mode.course.kept.reshape(-1, mode.course.points.shape[-1])
    own = mode.approximation.distance(points)
    return any(np.mean(other.approximation.distance(points) < own) > LEFT_MODE for other in heavier)


def _weighed(modes: list[Mode]) -> list[Mode]:
    logs = np.array([-np.inf if mode.absorbed else mode.evidence.log_value for mode in modes])
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    return [replace(mode, weight=float(weight)) for mode, weight in zip(modes, weights, strict=True)]
