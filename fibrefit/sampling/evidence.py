"""The weight of each mode: it is sampled on its own, and its density integrated over its own draws (bridge sampling).

Modes are never averaged over.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fibrefit.sampling.chains import ChainHistory, SamplerProgress, Target, run_ensembles
from fibrefit.sampling.mode import Approximation
from fibrefit.sampling.settings import Settings
from fibrefit.sampling.thresholds import LEFT_MODE, OVERLOOKED, SAME_MODE

LOOK_STEPS, LOOK_ESS = 300, 100.0
"""Budget of a mode that is only weighed; one that proves the heaviest is sampled like any other."""


@dataclass(frozen=True)
class Evidence:
    """Logarithm of a marginal likelihood, or of a mode's share of it.

    Parameters
    ----------
    error : float
        Standard error.
    """

    log_value: float
    error: float


def bridge(log_density: Callable[[np.ndarray], np.ndarray], course: ChainHistory, seed: int) -> Evidence | None:
    """Bridge sampling between the draws and a normal distribution fitted to other draws.

    The first half of the steps shapes the normal distribution, the second half is compared with it.

    Parameters
    ----------
    log_density : callable ``(n_point, n) -> (n_point,)``

    Returns
    -------
    Evidence or None
        None where a run that was cut short has too few draws for it.

    Source
    ------
    Meng and Wong, Statistica Sinica 6 (1996); error: Fruehwirth-Schnatter, Econometrics Journal 7 (2004).
    """
    points, densities = course.kept, course.kept_log_density
    half, size = points.shape[1] // 2, points.shape[-1]
    # Half of the draws are worth half of what all are.
    worth = 0.5 * float(np.minimum(course.mixing.ess_bulk, course.mixing.ess_tail).min())
    if not worth > 0.0:
        return None
    shape = points[:, :half].reshape(-1, size)
    normal = Approximation(shape.mean(axis=0), np.cov(shape.T).reshape(size, size), 0.0)
    random = np.random.default_rng(seed)
    drawn, its_density = points[:, half:].reshape(-1, size), densities[:, half:].ravel()
    # Two thousand are enough for an error of some hundredths; each of the proposed ones costs a simulation.
    chosen = random.choice(len(drawn), min(2000, len(drawn)), replace=False)
    drawn, its_density = drawn[chosen], its_density[chosen]
    proposed = normal.centre + random.standard_normal(drawn.shape) @ normal.root.T
    log_normal = lambda points: -0.5 * normal.distance(points) ** 2 - normal.log_evidence  # noqa: E731
    of_drawn = its_density - log_normal(drawn)
    of_proposed = log_density(proposed) - log_normal(proposed)
    # Those that are taken of them are worth no more than their number.
    worth = worth * len(drawn) / (worth + len(drawn))
    independent = worth / len(drawn)

    # The optimal bridge between the ratios of density and proposal, at draws of the one and of the other.
    shift = float(np.median(of_drawn))
    first, second = (np.exp(np.clip(ratio - shift, -600.0, 600.0)) for ratio in (of_drawn, of_proposed))
    share = independent * len(first) / (independent * len(first) + len(second))
    value = 1.0
    for _ in range(1000):
        upper = second / (share * second + (1.0 - share) * value)
        lower = 1.0 / (share * first + (1.0 - share) * value)
        value, before = float(upper.mean() / lower.mean()), value
        if abs(np.log(value / before)) < 1e-10:
            break
    of_second = upper.var() / upper.mean() ** 2 / len(second)
    of_first = lower.var() / lower.mean() ** 2 / (independent * len(first))
    return Evidence(shift + float(np.log(value)), float(np.sqrt(of_first + of_second)))


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

    def file(number: int, *words: str) -> Path | None:
        if checkpoint_file is None:
            return None
        name = "-".join([checkpoint_file.stem, *([f"{number + 1}"] if number else []), *words])
        return checkpoint_file.with_name(f"{name}{checkpoint_file.suffix}")

    def by_laplace(approximation: Approximation) -> Evidence:
        return Evidence(approximation.log_evidence, np.inf)

    def sampled(number: int, budget: Settings, *words: str) -> Mode:
        approximation = approximations[number]
        course = run_ensembles(target, approximation, budget, file(number, *words), progress)
        found = bridge(target.log_density, course, settings.seed)
        return Mode(approximation, 0.0, course, found or by_laplace(approximation))

    look = replace(settings, max_steps=min(settings.max_steps, LOOK_STEPS), ess=min(settings.ess, LOOK_ESS))
    modes = [Mode(approximation, 0.0, None, by_laplace(approximation)) for approximation in approximations]
    modes[0], whole = sampled(0, settings), {0}
    # Draws may weigh a mode otherwise than Laplace's method did: who is first is asked again after each.
    while True:
        logs = [mode.evidence.log_value for mode in modes]
        top = max(log for log, mode in zip(logs, modes, strict=True) if mode.course)
        # A mode is looked at where it has a hundredth of what must not be overlooked: Laplace's method errs.
        worthy = np.log(0.01 * OVERLOOKED)
        unseen = [n for n, m in enumerate(modes) if m.course is None and logs[n] - top >= worthy]
        first = int(np.argmax(logs))
        if unseen:
            modes[unseen[0]] = sampled(unseen[0], look, "look")
        elif first not in whole:
            modes[first] = sampled(first, settings)
            whole.add(first)
        else:
            break

    # The heavier of two that mix has the draws of both.
    settled: list[Mode] = []
    for mode in sorted(modes, key=lambda mode: -mode.evidence.log_value):
        others = [other for other in settled if not other.absorbed]
        settled.append(replace(mode, absorbed=mode.course is not None and _moved(mode, others)))
    log_masses = np.array([-np.inf if mode.absorbed else mode.evidence.log_value for mode in settled])
    weights = np.exp(log_masses - log_masses.max())
    weights /= weights.sum()
    return [replace(mode, weight=float(weight)) for mode, weight in zip(settled, weights, strict=True)]


def _moved(mode: Mode, heavier: list[Mode]) -> bool:
    """Whether the draws of a mode do not stay in it: more than a few lie nearer to a heavier one."""
    assert mode.course is not None
    points = mode.course.kept.reshape(-1, mode.course.points.shape[-1])
    own = mode.approximation.distance(points)
    return any(np.mean(other.approximation.distance(points) < own) > LEFT_MODE for other in heavier)
