"""Refitting a subset of a frame's values: a bounded Levenberg-Marquardt on local Gram matrices.

Base parameters may scatter from record to record: each record then has its own relative deviation of each, held near
zero. Deviations cost no simulation, since their columns are those of the parameter itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fibrefit.discovery.engine.supermodel import Frame

SCATTER = 0.005
"""Standard deviation of a base parameter between records, as a share of it."""
NO_SCATTER = 0.0005
"""The same where records agree."""
ROUGH = 1.0
"""Difference between neighbouring heights of a curve that counts as much as a standard error, in their usual one."""
ARRIVED = 0.1
"""Promised fall at which a step is not taken, as a share of the fall that is small enough to stop after."""
STEP = 1e-6
"""Difference step, as a share of a value's size."""


@dataclass(frozen=True)
class Subset:
    """Which values of a frame are active.

    Parameters
    ----------
    shared : tuple of str
        Values all records share.
    each : tuple of str
        Values of each record's own.
    scattering : tuple of str
        Shared values that may deviate from record to record.
    curve : tuple of str
        Shared values that are heights of a curve: neighbours are alike where the records do not see them.
    """

    shared: tuple[str, ...]
    each: tuple[str, ...]
    scattering: tuple[str, ...] = ()
    curve: tuple[str, ...] = ()


@dataclass(frozen=True)
class Refit:
    """Where a refit ended.

    Parameters
    ----------
    local : (n_record, n_local) in SI units
        Values of each record, deviations included.
    cost : float
        Sum of squared residuals over the noise.
    penalty : float
        Sum of squared deviations over their standard deviation, and of squared differences between heights of a curve.
    shared : dict of str to float
        Active shared values, in SI units.
    steps : int
    deviations : (n_record, n_scattering)
        Of each record's own values from the shared ones, as a share of them.
    """

    local: np.ndarray
    cost: float
    penalty: float
    shared: Mapping[str, float]
    steps: int
    deviations: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def surprise(self) -> float:
        """Cost, and what it says against a model that its records need values of their own.

        Twice the negative log likelihood where how much records scatter is not known beforehand: a model that makes
        records agree is worth more than one that lets each have its way.
        """
        spread = np.mean(self.deviations**2, axis=0) if len(self.deviations) else np.zeros(0)
        return self.cost + len(self.deviations) * float(np.sum(np.log1p(spread / NO_SCATTER**2)))


class _Map:
    """Between the unknowns of a refit and the values of each record."""

    def __init__(self, frame: Frame, subset: Subset, local: np.ndarray) -> None:
        self.frame, self.subset, self.records = frame, subset, len(local)
        index = {name: i for i, name in enumerate(frame.names)}
        self.shared = np.array([index[name] for name in subset.shared], dtype=int)
        self.each = np.array([index[name] for name in subset.each], dtype=int)
        self.scattering = np.array([subset.shared.index(name) for name in subset.scattering], dtype=int)
        self.columns = np.concatenate([self.shared, self.each])
        self.curve = np.array([subset.shared.index(name) for name in subset.curve], dtype=int)
        self.rest = local.copy()
        ranges = {slot.name: slot.range for slot in frame.problem.layout.slots}
        self.lower = np.array([ranges[name].lower for name in subset.shared])
        self.upper = np.array([ranges[name].upper for name in subset.shared])
        self.size = np.array([abs(frame.declared[name].typical) for name in (*subset.shared, *subset.each)])
        self.steepness = np.diff(np.eye(len(self.curve)), axis=0) / (ROUGH * self.size[self.curve])

    @property
    def n_own(self) -> int:
        """Unknowns of one record."""
        return len(self.each) + len(self.scattering)

    def unknowns(self) -> np.ndarray:
        """Unknowns of the values it was made from, without deviations."""
        own = np.concatenate([self.rest[:, self.each], np.zeros((self.records, len(self.scattering)))], axis=1)
        return np.concatenate([self.rest[:, self.shared].mean(axis=0), own.ravel()])

    def split(self, unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Shared values and those of each record, ``(n_record, n_own)``."""
        n = len(self.shared)
        return unknowns[:n], unknowns[n:].reshape(self.records, self.n_own)

    def local(self, unknowns: np.ndarray) -> np.ndarray:
        """Values of each record."""
        shared, own = self.split(unknowns)
        local = self.rest.copy()
        local[:, self.shared] = shared
        local[:, self.each] = own[:, : len(self.each)]
        local[:, self.shared[self.scattering]] *= 1.0 + own[:, len(self.each) :]
        return local

    def normal(self, unknowns: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """Normal matrix, gradient and cost, penalties included in the first two."""
        local = self.local(unknowns)
        steps = STEP * np.maximum(np.abs(local[:, self.columns]), 0.01 * self.size)
        changes = self.frame.grams(local, self.columns, local[:, self.columns] + steps, counts)
        per = np.concatenate([1.0 / steps, np.ones((len(steps), 1))], axis=1)
        grams = changes * per[:, :, None] * per[:, None, :]
        shared, own = self.split(unknowns)
        n, total = len(self.shared), len(unknowns)
        matrix, gradient = np.zeros((total, total)), np.zeros(total)
        for r, gram in enumerate(grams):
            spread = np.zeros((len(self.columns), total))
            start = n + r * self.n_own
            deviation = own[r, len(self.each) :]
            spread[:n, :n] = np.eye(n)
            spread[self.scattering, self.scattering] = 1.0 + deviation
            spread[n:, start : start + len(self.each)] = np.eye(len(self.each))
            places = start + len(self.each) + np.arange(len(self.scattering))
            spread[self.scattering, places] = shared[self.scattering]
            matrix += spread.T @ gram[:-1, :-1] @ spread
            gradient += spread.T @ gram[:-1, -1]
            matrix[places, places] += SCATTER**-2
            gradient[places] += deviation / SCATTER**2
        matrix[np.ix_(self.curve, self.curve)] += self.steepness.T @ self.steepness
        gradient[self.curve] += self.steepness.T @ (self.steepness @ shared[self.curve])
        return matrix, gradient, float(grams[:, -1, -1].sum())

    def penalty(self, unknowns: np.ndarray) -> float:
        """Of the deviations, and of a curve that is not level."""
        shared, own = self.split(unknowns)
        rough = self.steepness @ shared[self.curve]
        return float(np.sum((own[:, len(self.each) :] / SCATTER) ** 2) + np.sum(rough**2))

    def clipped(self, unknowns: np.ndarray) -> np.ndarray:
        """Shared values put back inside their bounds."""
        n = len(self.shared)
        return np.concatenate([np.clip(unknowns[:n], self.lower, self.upper), unknowns[n:]])

    def refit(self, unknowns: np.ndarray, cost: float, steps: int) -> Refit:
        """Result at the given unknowns."""
        shared = dict(zip(self.subset.shared, self.split(unknowns)[0].tolist(), strict=True))
        deviations = self.split(unknowns)[1][:, len(self.each) :]
        return Refit(self.local(unknowns), cost, self.penalty(unknowns), shared, steps, deviations)


def refit(
    frame: Frame, subset: Subset, local: np.ndarray, counts: np.ndarray, max_steps: int = 30, enough: float = 1e-4
) -> Refit:
    """Fit a subset of values, from values given, over a horizon.

    Parameters
    ----------
    frame : Frame
    subset : Subset
    local : (n_record, n_local) in SI units
        Start; values outside the subset stay.
    counts : (n_record,) int
        Horizon in samples.
    max_steps : int
    enough : float
        Relative fall of the objective below which it stops.

    Returns
    -------
    Refit
    """
    unknown = _Map(frame, subset, local)
    x, damping = unknown.clipped(unknown.unknowns()), 1e-3
    matrix, gradient, cost = unknown.normal(x, counts)
    objective = cost + unknown.penalty(x)
    for step in range(1, max_steps + 1):
        trial = unknown.clipped(x - _damped(unknown, x, matrix, gradient, damping))
        way = trial - x
        if -way @ (2.0 * gradient + matrix @ way) < ARRIVED * enough * objective:
            break
        # A trial is mostly kept: its slopes are then at hand, and its cost alone takes more than half as long.
        there = unknown.normal(trial, counts)
        gain = objective - there[2] - unknown.penalty(trial)
        if np.isfinite(gain) and gain > 0.0:
            x, damping = trial, max(damping / 10.0, 1e-9)
            matrix, gradient, cost = there
            if gain < enough * objective:
                return unknown.refit(x, cost, step)
            objective = cost + unknown.penalty(x)
        else:
            damping *= 10.0
            if damping > 1e6:
                break
    return unknown.refit(x, cost, step)


def _damped(unknown: _Map, x: np.ndarray, matrix: np.ndarray, gradient: np.ndarray, damping: float) -> np.ndarray:
    """Step of Levenberg and Marquardt; a value at a bound that would leave it stays where it is."""
    n = len(unknown.shared)
    stuck = np.zeros(len(x), dtype=bool)
    stuck[:n] = ((x[:n] <= unknown.lower) & (gradient[:n] > 0)) | ((x[:n] >= unknown.upper) & (gradient[:n] < 0))
    diagonal = np.diag(matrix)
    free = ~stuck & (diagonal > 0.0)
    step = np.zeros(len(x))
    scale = np.sqrt(diagonal[free])
    scaled = matrix[np.ix_(free, free)] / np.outer(scale, scale)
    step[free] = np.linalg.solve(scaled + damping * np.eye(len(scale)), gradient[free] / scale) / scale
    return step


def led_along(
    frame: Frame, held: Subset, subset: Subset, local: np.ndarray, goal: np.ndarray, counts: np.ndarray
) -> np.ndarray:
    """Values that go to a goal, with those of a subset led along so that the cost rises least.

    Parameters
    ----------
    frame : Frame
    held : Subset
        The values that are led along.
    subset : Subset
        Those and the ones that go to the goal.
    local, goal : (n_record, n_local) in SI units
    counts : (n_record,) int

    Returns
    -------
    (n_record, n_local)
        To first order, in SI units.
    """
    unknown = _Map(frame, subset, local)
    here = unknown.unknowns()
    matrix = unknown.normal(here, counts)[0]
    led = np.array([name in held.shared for name in subset.shared] + [True] * (len(here) - len(subset.shared)))
    way = np.zeros(len(here))
    way[~led] = (_Map(frame, subset, goal).unknowns() - here)[~led]
    if np.isfinite(matrix).all():
        size = np.sqrt(np.diag(matrix)[led])
        size = np.where(size > 0.0, size, 1.0)
        scaled = matrix[np.ix_(led, led)] / np.outer(size, size)
        way[led] = -np.linalg.lstsq(scaled, (matrix @ way)[led] / size, rcond=1e-10)[0] / size
    return unknown.local(unknown.clipped(here + way))


def covariance(frame: Frame, subset: Subset, local: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Covariance ``(n_shared, n_shared)`` of the shared values for white noise, in SI units.

    Parameters
    ----------
    frame, subset, local, counts : as `refit`

    Returns
    -------
    (n_shared, n_shared) in SI units
        With an infinite variance where the data see nothing.
    """
    unknown = _Map(frame, subset, local)
    matrix, _, _ = unknown.normal(unknown.unknowns(), counts)
    scale = np.sqrt(np.diag(matrix))
    seen = np.flatnonzero(scale > 0.0)
    scale = np.outer(scale[seen], scale[seen])
    found = np.zeros(matrix.shape)
    np.fill_diagonal(found, np.inf)
    found[np.ix_(seen, seen)] = np.linalg.pinv(matrix[np.ix_(seen, seen)] / scale, rcond=1e-10) / scale
    return found[: len(subset.shared), : len(subset.shared)]


def standard_errors(frame: Frame, subset: Subset, local: np.ndarray, counts: np.ndarray) -> dict[str, float]:
    """Standard errors of the shared values for white noise, in SI units; infinite where the data see nothing."""
    errors = np.sqrt(np.abs(np.diag(covariance(frame, subset, local, counts))))
    return dict(zip(subset.shared, errors.tolist(), strict=True))
