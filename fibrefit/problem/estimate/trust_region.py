"""Steps of a trust region: damped so much that they stay within reach, and inside the bounds.

Source
------
Levenberg, Q. Appl. Math. 2 (1944); Marquardt, J. SIAM 11 (1963); More, Numerical Analysis, Lecture Notes in Mathematics
630 (1978), whose numbers these are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fibrefit.problem.estimate.normal_equations import Arrowhead, Place, PosteriorMode, with_priors
from fibrefit.problem.estimate.schur import eliminated, solved
from fibrefit.problem.statement.equilibration import equilibrated

LEAST_DAMPING, CAUTIOUS, STIFFEST = 1e-10, 1e-4, 1e16
"""Damping of a step whose size nothing limits, of the first one, and beyond which there is no step."""
SHORTEST_STEP = 0.1
"""Share of a step that led nowhere, below which the next one is not shortened at once."""
ON_RADIUS = 1.1
"""Factor to which a step has the size of the radius."""


class DampedStep(NamedTuple):
    """A step inside the bounds and within reach.

    Parameters
    ----------
    place : Place
        Where it leads.
    predicted_reduction : float
        Fall of Q.
    slope : float
        What Q would fall by if it fell on as it does at the start of the step.
    size : float
        Norm, each coordinate in units of what one of residuals it changes by one.
    """

    place: Place
    predicted_reduction: float
    slope: float
    size: float


def radius_after(step: DampedStep, fall: float, radius: float) -> float:
    """Radius of the trust region after a step, by how much Q fell of the predicted reduction."""
    if not np.isfinite(fall):
        return SHORTEST_STEP * step.size
    if fall > 0.75 * step.predicted_reduction:
        return max(radius if np.isfinite(radius) else 0.0, 2.0 * step.size)
    if fall > 0.25 * step.predicted_reduction:
        return step.size if np.isinf(radius) else radius
    # Where the parabola through both ends, with the slope at the first, is lowest.
    return float(np.clip(0.5 * step.slope / (step.slope - fall), SHORTEST_STEP, 0.5)) * step.size


def step_within(found: PosteriorMode, radius: float) -> DampedStep:
    """The damped step of a size that is no more than a radius.

    Its damping is the one for which it has the size of the radius, to a tenth.
    """
    low, high = np.log10(LEAST_DAMPING), np.log10(STIFFEST)
    first = _trial(found, CAUTIOUS if np.isinf(radius) else LEAST_DAMPING)
    if first.size <= ON_RADIUS * radius:
        return first
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        step = _trial(found, 10.0**middle)
        if step.size > ON_RADIUS * radius:
            low = middle
        elif step.size < radius / ON_RADIUS:
            high = middle
        else:
            return step
    return step


def _trial(found: PosteriorMode, damping: float) -> DampedStep:
    """A damped step inside the bounds."""
    unknowns, place = found.unknowns, found.place
    whole = with_priors(unknowns, place, found.normal, found.sigma)
    stuck = ((place.z <= unknowns.lower) & (whole.pull > 0.0)) | ((place.z >= unknowns.upper) & (whole.pull < 0.0))
    free = ~stuck & (np.diag(whole.shared) > 0.0)
    held = np.zeros(len(place.z))
    for _ in range(len(free) + 1):
        dz, own = _solved(whole, damping, free, held)
        outside = free & ((place.z + dz < unknowns.lower) | (place.z + dz > unknowns.upper))
        if not outside.any():
            break
        # What would leave its bounds is brought to them, and the others move with it held there.
        held = np.where(outside, np.clip(place.z + dz, unknowns.lower, unknowns.upper) - place.z, held)
        free &= ~outside
    n = len(unknowns.each)
    way = Place(place.z + dz, place.own + own[:, :n], place.eta + own[:, n:], place.rest)
    slope = -2.0 * float(whole.pull @ dz + np.sum(whole.pulls * own))
    bend = dz @ whole.shared @ dz + 2.0 * np.einsum("i,rij,rj->", dz, whole.cross, own)
    bend += np.einsum("ri,rij,rj->", own, whole.blocks, own)
    size = np.diag(whole.shared) @ dz**2 + np.sum(np.einsum("rii->ri", whole.blocks) * own**2)
    return DampedStep(way, slope - float(bend), slope, float(np.sqrt(size)))


def _solved(whole: Arrowhead, damping: float, free: np.ndarray, held: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Steps of shared and own unknowns; those that are not free go where they are held."""
    dz, shared, blocks = np.where(free, 0.0, held), _damped(whole.shared, damping), _damped(whole.blocks, damping)
    schur, right = eliminated(shared, whole.cross, blocks, whole.pull, whole.pulls)
    right = right + schur @ dz
    if free.any():
        scale = np.sqrt(np.maximum(np.diag(whole.shared)[free], 1e-300))
        inside, wanted = equilibrated(schur[np.ix_(free, free)], scale), right[free] / scale
        # Where slopes are lost though the motion is not, no step leads anywhere.
        known = np.isfinite(inside).all() and np.isfinite(wanted).all()
        dz[free] = -np.linalg.lstsq(inside, wanted, rcond=1e-13)[0] / scale if known else np.nan
    return dz, _own_step(whole, dz, damping)


def _own_step(whole: Arrowhead, dz: np.ndarray, damping: float) -> np.ndarray:
    right = -(whole.pulls + np.einsum("i,rij->rj", dz, whole.cross))
    return solved(_damped(whole.blocks, damping), right[..., None])[..., 0]


def _damped(matrix: np.ndarray, damping: float) -> np.ndarray:
    return matrix + damping * np.eye(matrix.shape[-1]) * matrix
