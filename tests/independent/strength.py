"""How strong a hidden effect must be to leave a given gap.

The gap is what the best base model leaves on clean data: the rms of the difference over the noise, per channel, and of
these the root of the mean of squares. Refitting the base model here, with this simulator, costs some simulations; the
plain difference of the simulations with and without the effect is offered too: cheap, but many times larger than the
gap, because most of what an effect does a base model can do as well.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from tests.independent.laws import DROP, EFFECTS, values_at
from tests.independent.sensors import USUAL, Noise
from tests.independent.series import Plan
from tests.independent.simulate import FINE_STEP, Base, Channels, Effects, simulate

COARSE_STEP = 2e-5
STIFF = {"pulley.inertia", "pulley.bearing_friction", "drive.compliance", "fibre.mass", "guide.presliding"}
CLOSE_ENOUGH = 0.1
ROUNDS = 12
WEAK = 0.02
DONE = 0.01
WORTH_GOING_ON = 0.1
NOTHING = 1e-3
FIT_ROUNDS = 30
TRIES = 6

Residuals = Callable[[np.ndarray], np.ndarray]


class Task(NamedTuple):
    """What a gap is measured on: records, and effects the fitted model has too.

    Parameters
    ----------
    plans : of the records
    base : true base parameters
    known : effects that are in the model as well, at their true values
    noise : by which differences are weighed
    """

    plans: Sequence[Plan]
    base: Base
    known: Effects = MappingProxyType({})
    noise: Noise = USUAL


class Refit(NamedTuple):
    """A base model fitted to clean readings.

    Parameters
    ----------
    point : base parameters, then one nuisance a record: a later release, or more load before the drive starts
    slopes : Jacobian that is good enough nearby
    gap : what is left
    """

    point: np.ndarray
    slopes: np.ndarray
    gap: float

    @property
    def base(self) -> Base:
        return Base(*self.point[:3])


class Strength(NamedTuple):
    """A strength that was found, the gap it leaves, the parameters of all that is hidden, and the base model fitted."""

    strength: float
    gap: float
    effects: dict[str, dict[str, float]]
    fit: Refit | None


def respond(plans: Sequence[Plan], base: Base, effects: Effects) -> list[Channels]:
    """Clean readings of all records, with coarser steps than a series is made with."""
    step = FINE_STEP if STIFF & set(effects) else COARSE_STEP
    return [simulate(plan.conditions, base, effects, plan.times, step) for plan in plans]


def differences(model: Sequence[Channels], truth: Sequence[Channels], noise: Noise = USUAL) -> np.ndarray:
    """Differences over noise of all records and channels; the zero of position of each record is left free."""
    parts = []
    for mine, other in zip(model, truth, strict=True):
        position = mine.position - other.position
        parts.append((mine.force - other.force) / noise.rms["force"])
        parts.append((position - position.mean()) / noise.rms["position"])
    return np.concatenate(parts)


def rms(values: np.ndarray) -> float:
    return math.sqrt(np.mean(values**2))


def _moved(plans: Sequence[Plan], nuisances: np.ndarray) -> list[Plan]:
    """The same records released later, or with the fibre carrying more before the drive starts."""
    moved = []
    for plan, shift in zip(plans, nuisances, strict=True):
        held = plan.conditions
        if held.kind == DROP:
            held = replace(held, release=held.release + shift)
        else:
            held = replace(held, start_excess=held.start_excess + shift)
        moved.append(plan._replace(conditions=held))
    return moved


def _residuals(task: Task, truth: Sequence[Channels]) -> Residuals:
    def at(point: np.ndarray) -> np.ndarray:
        base = Base(point[0], max(point[1], 0.0), max(point[2], 0.0))
        return differences(respond(_moved(task.plans, point[3:]), base, task.known), truth, task.noise)

    return at


def _slopes(task: Task, residuals: Residuals, point: np.ndarray, here: np.ndarray) -> np.ndarray:
    """Forward differences; all records' own nuisances are moved at once, since each moves only its own residuals."""
    drop = task.plans[0].conditions.kind == DROP
    # So small that few of the jumps of the force pass a sample.
    nudges = (1e-5 * point[0], 2e-3, 1e-3, 2e-7 if drop else 1e-3)
    slopes = np.zeros((here.size, point.size))
    for i in range(3):
        moved = point.copy()
        moved[i] += nudges[i]
        slopes[:, i] = (residuals(moved) - here) / nudges[i]
    moved = point.copy()
    moved[3:] += nudges[3]
    own, end = (residuals(moved) - here) / nudges[3], 0
    for i, plan in enumerate(task.plans):
        rows = slice(end, end + 2 * plan.times.size)
        slopes[rows, 3 + i], end = own[rows], rows.stop
    return slopes


def refit(task: Task, truth: Sequence[Channels], start: Refit | None = None) -> Refit:
    """Best base model by Levenberg-Marquardt; slopes are taken anew only when the old ones lead nowhere."""
    residuals, drop = _residuals(task, truth), task.plans[0].conditions.kind == DROP
    point = np.concatenate([task.base, np.zeros(len(task.plans))]) if start is None else start.point
    here = residuals(point)
    fresh = start is None
    slopes = _slopes(task, residuals, point, here) if start is None else start.slopes
    for _ in range(FIT_ROUNDS):
        better = _better(residuals, point, here, slopes, drop)
        gain = 0.0 if better is None else 1.0 - (better[1] @ better[1]) / (here @ here)
        if better is not None:
            point, here = better
        if (gain < DONE and fresh) or rms(here) < NOTHING:
            break
        fresh = gain < WORTH_GOING_ON
        if fresh:
            slopes = _slopes(task, residuals, point, here)
    return Refit(point, slopes, rms(here))


def _better(residuals: Residuals, point: np.ndarray, here: np.ndarray, slopes: np.ndarray, drop: bool) -> tuple | None:
    """A point with a lower cost, or None; a weight that rests stays inside its friction band."""
    normal, gradient = slopes.T @ slopes, slopes.T @ here
    damping = 1e-6
    for _ in range(TRIES):
        trial = point - np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-12), gradient)
        trial[:3] = np.maximum(trial[:3], [0.5 * point[0], 0.0, 0.0])
        if not drop:
            trial[3:] = np.clip(trial[3:], -trial[2], trial[2])
        there = residuals(trial)
        if there @ there < here @ here:
            return trial, there
        damping = 30.0 * max(damping, 1e-4)
    return None


def strength_for(
    task: Task, name: str, gap: float, shape: Mapping[str, float], *, sign: float = 1.0, by: str = "refit"
) -> Strength:
    """Strength of an effect at which the clean gap is `gap`, to a tenth.

    Parameters
    ----------
    task : records and base parameters
    name : of the effect; one that needs another is found beside that one, which leaves twice the gap by itself
    gap : wanted
    shape : the effect's shape parameters
    sign : -1 for the opposite effect
    by : "refit", the gap the best base model leaves; "difference", that of the true base parameters

    Returns
    -------
    Strength
        The strongest that is physical where even that leaves less than `gap`; the weakest likewise.
    """
    if (needed := EFFECTS[name].needs) is not None:
        task = task._replace(known={**task.known, **strength_for(task, needed, 2.0 * gap, {}, by=by).effects})
    bare = respond(task.plans, task.base, task.known)
    fit = refit(task, bare) if by == "refit" else None
    low, high, least, most = 0.0, math.inf, EFFECTS[name].least, EFFECTS[name].most
    strength = max(WEAK, least)
    # A fit of too strong an effect may have gone astray: the next one starts from the strongest that was not.
    good, good_at = fit, strength
    for _ in range(ROUNDS):
        effects = {**task.known, name: values_at(name, sign * strength, shape, task.base.stiffness)}
        truth = respond(task.plans, task.base, effects)
        if fit is not None:
            fit = refit(task, truth, good._replace(point=_extrapolated(good.point, task, strength / good_at)))
        reached = rms(differences(bare, truth, task.noise)) if fit is None else fit.gap
        if abs(math.log(max(reached, 1e-9) / gap)) < CLOSE_ENOUGH or strength == (most if reached < gap else least):
            break
        if reached < gap:
            low, good, good_at = strength, fit, strength
        else:
            high = strength
        strength = min(max(_next(strength, reached, gap, low, high), least), most)
    return Strength(sign * strength, reached, effects, fit)


def gap_of_all(task: Task, found: Sequence[Strength]) -> float:
    """Gap the best base model leaves where all that was `found` is hidden together."""
    effects: dict[str, dict[str, float]] = {}
    for one in found:
        effects |= one.effects
    truth = respond(task.plans, task.base, effects)
    if any(one.fit is None for one in found):
        return refit(task, truth).gap
    if len(found) == 1 and EFFECTS[list(found[0].effects)[-1]].needs is None:
        return found[0].gap
    # From the sum of what each does: from the true parameters the fit may end beside a mistimed bounce.
    true = np.concatenate([task.base, np.zeros(len(task.plans))])
    point = true + sum(one.fit.point - true for one in found)
    return refit(task, truth, found[0].fit._replace(point=_off_bounds(point, task.base))).gap


def _extrapolated(point: np.ndarray, task: Task, ratio: float) -> np.ndarray:
    """A start for the next refit: what the last strength did to the parameters, in proportion."""
    true = np.concatenate([task.base, np.zeros(len(task.plans))])
    return _off_bounds(true + ratio * (point - true), task.base)


def _off_bounds(point: np.ndarray, base: Base) -> np.ndarray:
    """Parameters at their bound would stay there."""
    return np.concatenate([np.maximum(point[:3], [0.5 * base.stiffness, 1.0, 0.2]), point[3:]])


def _next(strength: float, reached: float, gap: float, low: float, high: float) -> float:
    """Proportional step, kept inside what is known to be too little and too much."""
    guess = strength * min(max(gap / max(reached, 1e-6), 0.1), 4.0)
    if not low < guess < high:
        guess = math.sqrt(low * high) if low > 0.0 else 0.2 * high
    return guess
