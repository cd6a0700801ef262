"""Refitting a subset of a supermodel's values in plain squares: a bounded Levenberg-Marquardt on local Gram matrices.

This is the search from afar, over horizons that grow; what is decided is decided by the marginal likelihood. It is not
`problem.estimate.gauss_newton`, though both damp steps on Gram matrices: it knows no priors, deviations or coordinates,
raises the damping where that one shrinks a radius, and candidates that bounce end in other minima by another path.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from fibrefit.core.arrays import assembled, gathered
from fibrefit.core.matrices import equilibrated, scale_of
from fibrefit.discovery.engine.supermodel import Supermodel
from fibrefit.problem import Problem

ARRIVED = 0.1
"""Promised fall at which a step is not taken, as a share of the fall that is small enough to stop after."""
STEP = 1e-6
"""Difference step, as a share of a value's size."""


def difference_steps(values: np.ndarray, typical: np.ndarray | float) -> np.ndarray:
    """Difference steps of values, by their size and no less than a hundredth of the `typical` one would have."""
    return STEP * np.maximum(np.abs(values), 0.01 * typical)


@dataclass(frozen=True)
class Subset:
    """Which values of a supermodel are active.

    Parameters
    ----------
    shared : tuple of str
        Values all records share.
    each : tuple of str
        Values of each record's own.
    scatter : mapping of str to float
        Relative standard deviations between records of those shared values that differ there (random effects); what a
        record's own deviations cost by them counts.
    """

    shared: tuple[str, ...]
    each: tuple[str, ...]
    scatter: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Refit:
    """Where a refit ended.

    Parameters
    ----------
    local : (n_record, n_local) in SI units
        Values of each record.
    cost : float
        Sum of squared residuals over the noise.
    """

    local: np.ndarray
    cost: float


class Refittable(Protocol):
    """What a refit asks of a supermodel, see there."""

    @property
    def problem(self) -> Problem:
        """Problem that holds its layout."""
        ...

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its values, in the order of ``local``."""
        ...

    def sizes(self, names: Iterable[str]) -> np.ndarray:
        """Typical sizes of values, in SI units."""
        ...

    def grams(self, local: np.ndarray, columns: np.ndarray, targets: np.ndarray, counts: np.ndarray) -> np.ndarray:
        """Products of changes and residuals, ``(n_record, n_column + 1, n_column + 1)``."""
        ...


class _Map:
    """Between the unknowns of a refit and the values of each record."""

    def __init__(self, supermodel: Refittable, subset: Subset, local: np.ndarray) -> None:
        self.supermodel, self.subset, self.records = supermodel, subset, len(local)
        index = {name: i for i, name in enumerate(supermodel.names)}
        self.shared = np.array([index[name] for name in subset.shared], dtype=int)
        self.each = np.array([index[name] for name in subset.each], dtype=int)
        self.columns = np.concatenate([self.shared, self.each])
        self.scattering = np.array([i for i, name in enumerate(subset.shared) if name in subset.scatter], dtype=int)
        self.sigma = np.array([subset.scatter[subset.shared[i]] for i in self.scattering])
        self.rest = local.copy()
        slots = {slot.name: slot for slot in supermodel.problem.layout.slots}
        self.lower = np.array([slots[name].range.lower for name in subset.shared])
        self.upper = np.array([slots[name].range.upper for name in subset.shared])
        # What a study states of some records is held in these.
        self.free = np.array([[slots[name].fixed_in(r) is None for name in subset.each] for r in range(self.records)])
        self.free = self.free.reshape(self.records, len(subset.each))
        self.size = supermodel.sizes((*subset.shared, *subset.each))

    def unknowns(self) -> np.ndarray:
        """Unknowns of the values it was made from."""
        mean = self.rest[:, self.shared].mean(axis=0)
        own = np.log(self.rest[:, self.shared[self.scattering]] / mean[self.scattering])
        return np.concatenate([mean, self.rest[:, self.each].ravel(), own.ravel()])

    def split(self, unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Shared values, those of each record ``(n_record, n_each)``, and its deviations ``(n_record, n_scattering)``.

        Deviations are natural logarithms of factors.
        """
        n, last = len(self.shared), len(self.shared) + self.records * len(self.each)
        return unknowns[:n], unknowns[n:last].reshape(self.records, -1), unknowns[last:].reshape(self.records, -1)

    def local(self, unknowns: np.ndarray) -> np.ndarray:
        """Values of each record."""
        local = self.rest.copy()
        local[:, self.shared], local[:, self.each], deviations = self.split(unknowns)
        local[:, self.shared[self.scattering]] *= np.exp(deviations)
        return local

    def normal(self, unknowns: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """Normal matrix, gradient and cost."""
        local, deviations = self.local(unknowns), self.split(unknowns)[2]
        steps = difference_steps(local[:, self.columns], self.size)
        changes = self.supermodel.grams(local, self.columns, local[:, self.columns] + steps, counts)
        n, active, total = len(self.shared), len(self.columns), len(unknowns)
        per = np.concatenate([1.0 / steps, np.ones((len(steps), 1))], axis=1)
        # A change of the shared value changes a record's by its factor, one of its deviation by what it is.
        per[:, self.scattering] *= np.exp(deviations)
        columns = np.r_[:active, self.scattering, active].astype(int)
        per = per[:, columns]
        per[:, n:active] *= self.free
        per[:, active:-1] *= unknowns[self.scattering]
        grams = changes[:, columns][:, :, columns] * per[:, :, None] * per[:, None, :]
        each = n + np.arange(self.records * len(self.each)).reshape(self.records, -1)
        own = total - deviations.size + np.arange(deviations.size).reshape(deviations.shape)
        places = np.concatenate([np.repeat(np.arange(n)[None], self.records, axis=0), each, own], axis=1)
        matrix = assembled(grams[:, :-1, :-1], places, total)
        gradient, cost = gathered(grams[:, :-1, -1], places, total), float(grams[:, -1, -1].sum())
        matrix[own, own] += self.sigma**-2.0
        gradient[own] += deviations / self.sigma**2
        cost += float(((deviations / self.sigma) ** 2).sum())
        return matrix, gradient, cost

    def clipped(self, unknowns: np.ndarray) -> np.ndarray:
        """Shared values put back inside their bounds."""
        n = len(self.shared)
        return np.concatenate([np.clip(unknowns[:n], self.lower, self.upper), unknowns[n:]])

    def refit(self, unknowns: np.ndarray, cost: float) -> Refit:
        """Result at the given unknowns; where a motion is lost, no other costs more."""
        return Refit(self.local(unknowns), cost if np.isfinite(cost) else np.inf)


def refit(
    supermodel: Refittable,
    subset: Subset,
    local: np.ndarray,
    counts: np.ndarray,
    max_steps: int = 30,
    enough: float = 1e-4,
) -> Refit:
    """Fit a subset of values, from values given, over a horizon.

    Parameters
    ----------
    supermodel : Refittable
    subset : Subset
    local : (n_record, n_local) in SI units
        Start; values outside the subset stay.
    counts : (n_record,) int
        Horizon in samples.
    max_steps : int
    enough : float
        Relative fall of the objective below which it stops.
    """
    unknown = _Map(supermodel, subset, local)
    x, damping = unknown.clipped(unknown.unknowns()), 1e-3
    matrix, gradient, cost = unknown.normal(x, counts)
    for _ in range(max_steps):
        trial = unknown.clipped(x - _damped(unknown, x, matrix, gradient, damping))
        way = trial - x
        if -way @ (2.0 * gradient + matrix @ way) < ARRIVED * enough * cost:
            break
        # A trial is mostly kept: its slopes are then at hand, and its cost alone takes more than half as long.
        there = unknown.normal(trial, counts)
        gain = cost - there[2]
        if np.isfinite(gain) and gain > 0.0:
            x, damping = trial, max(damping / 10.0, 1e-9)
            converged = gain < enough * cost
            matrix, gradient, cost = there
            if converged:
                break
        else:
            damping *= 10.0
            if damping > 1e6:
                break
    return unknown.refit(x, cost)


def _damped(unknown: _Map, x: np.ndarray, matrix: np.ndarray, gradient: np.ndarray, damping: float) -> np.ndarray:
    """Step of Levenberg and Marquardt; a value at a bound that would leave it stays where it is."""
    n = len(unknown.shared)
    stuck = np.zeros(len(x), dtype=bool)
    stuck[:n] = ((x[:n] <= unknown.lower) & (gradient[:n] > 0)) | ((x[:n] >= unknown.upper) & (gradient[:n] < 0))
    diagonal = np.diag(matrix)
    free = ~stuck & (diagonal > 0.0)
    step = np.zeros(len(x))
    scale = np.sqrt(diagonal[free])
    inside = equilibrated(matrix[np.ix_(free, free)], scale)
    step[free] = np.linalg.solve(inside + damping * np.eye(len(scale)), gradient[free] / scale) / scale
    return step


def predictor_step(
    supermodel: Supermodel, held: Subset, subset: Subset, local: np.ndarray, goal: np.ndarray, counts: np.ndarray
) -> np.ndarray:
    """Predictor step of a continuation: values that go to a goal, those of a subset moved so that the cost rises least.

    Parameters
    ----------
    supermodel : Supermodel
    held : Subset
        The values that are moved.
    subset : Subset
        Those and the ones that go to the goal.
    local, goal : (n_record, n_local) in SI units
    counts : (n_record,) int

    Returns
    -------
    (n_record, n_local)
        To first order, in SI units.
    """
    unknown = _Map(supermodel, subset, local)
    here = unknown.unknowns()
    matrix = unknown.normal(here, counts)[0]
    free = np.array([name in held.shared for name in subset.shared] + [True] * (len(here) - len(subset.shared)))
    way = np.zeros(len(here))
    way[~free] = (_Map(supermodel, subset, goal).unknowns() - here)[~free]
    if np.isfinite(matrix).all():
        size = scale_of(matrix)[free]
        inside = equilibrated(matrix[np.ix_(free, free)], size)
        way[free] = -np.linalg.lstsq(inside, (matrix @ way)[free] / size, rcond=1e-10)[0] / size
    return unknown.local(unknown.clipped(here + way))
