"""Which parameters the records determine."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from fibrefit.fitting.thresholds import LOOSE, SEEN, SMALL_ERROR, TIED, VAGUE
from fibrefit.problem.statement.layout import Layout, Range
from fibrefit.problem.statement.matrices import equilibrated, scale_of
from fibrefit.problem.statement.problem import Problem
from fibrefit.rigs.rig import STANDARD_GRAVITY

PER_MASS = {"stiffness": "1/s^2", "damping": "1/s"}
"""Parameters that force determines per mass, and the unit of that."""


@dataclass(frozen=True)
class Weakness:
    """Something the records do not determine.

    Parameters
    ----------
    names : tuple of str
        The parameters it concerns; ``name[record]`` where each record has its own.
    kind : str
        ``"invisible"``, ``"vague"``: hardly visible, with a large relative error; ``"combined"``: only together, or not
        apart from values of each record; ``"tied"``: only together, with a correlation near one.
    share : float
        Relative standard error of a vague one; infinite where the value is zero.
    correlation, slope : float
        Of a tied pair, and how much of the second makes up for a unit of the first.
    """

    names: tuple[str, ...]
    kind: Literal["invisible", "vague", "combined", "tied"]
    share: float = math.nan
    correlation: float = math.nan
    slope: float = math.nan


def weaknesses(
    layout: Layout, values: np.ndarray, covariance: np.ndarray, normal: np.ndarray, unjudged: Collection[str] = ()
) -> tuple[Weakness, ...]:
    """What the records leave open about the parameters, those that each record has for itself among them.

    Parameters
    ----------
    values : (n_free,) in SI units
    covariance : (n_free, n_free)
        With infinite variances where the data see nothing.
    normal : (n_free, n_free)
        What the data see, in units of the noise.
    unjudged : collection of str
        Values that nobody asks for, and parameters of which that says nothing, such as the instant at which something
        happens: between two samples no reading moves with it.
    """
    judged = [i for i, (slot, _) in enumerate(layout.entries) if slot.name not in unjudged]
    variance = np.diag(covariance)
    found, mixed = [], []
    for i in judged:
        slot, name = layout.entries[i][0], layout.free_names[i]
        error = np.sqrt(variance[i])
        if not np.isfinite(error) and np.sqrt(normal[i, i]) * slot.range.scale > SEEN:
            mixed.append(name)
        elif not np.isfinite(error):
            found.append(Weakness((name,), "invisible"))
        elif error > VAGUE * abs(values[i]) and error > _small(slot.range) * slot.range.scale:
            share = float(error / abs(values[i])) if values[i] else math.inf
            found.append(Weakness((name,), "vague", share=share))
    given = _given_beliefs(layout, covariance)
    together = (Weakness(tuple(mixed), "combined"),) if mixed else ()
    return tuple(found) + together + _tied(layout, judged, values, given)


def _small(limits: Range) -> float:
    """Standard error over a typical size that says enough of a value, whatever share of it it is.

    What is of either sign, such as a zero, may well be nil, and its error is no share of it.
    """
    return VAGUE if limits.lower < 0.0 < limits.upper else SMALL_ERROR


def _given_beliefs(layout: Layout, covariance: np.ndarray) -> np.ndarray:
    """Covariance if the values with a prior were held: what that prior leaves open is in the error bars.

    A value with a prior is not tied to another one by the records alone; its own rows become zero.
    """
    held = [i for i, _ in layout.believed if np.isfinite(covariance[i, i])]
    if not held:
        return covariance
    inside = covariance[np.ix_(held, held)]
    size = scale_of(inside)
    share = equilibrated(np.linalg.pinv(equilibrated(inside, size)), size)
    given = covariance - covariance[:, held] @ share @ covariance[held]
    given[held], given[:, held] = 0.0, 0.0
    return given


def _tied(layout: Layout, judged: list[int], values: np.ndarray, covariance: np.ndarray) -> tuple[Weakness, ...]:
    found, record = [], [record for _, record in layout.entries]
    for k, i in enumerate(judged):
        # Values of two records are tied, if at all, by one that both share.
        for j in (j for j in judged[k + 1 :] if record[i] is None or record[i] == record[j]):
            spread = np.sqrt(covariance[i, i] * covariance[j, j])
            correlation = covariance[i, j] / spread if np.isfinite(spread) and spread > 0.0 else 0.0
            loose = any(np.sqrt(covariance[p, p]) > LOOSE * abs(values[p]) for p in (i, j))
            if abs(correlation) > TIED and loose:
                a, b = layout.free_names[i], layout.free_names[j]
                slope = np.sqrt(covariance[j, j] / covariance[i, i]) * np.sign(correlation)
                found.append(Weakness((a, b), "tied", correlation=float(correlation), slope=float(slope)))
    return tuple(found)


class ForceAlone(NamedTuple):
    """What force alone determines.

    Parameters
    ----------
    per_mass : tuple of (str, float, str, float)
        Name, value over mass, its unit, and its relative standard error.
    load : float in N
        At rest.
    """

    per_mass: tuple[tuple[str, float, str, float], ...]
    load: float


def force_alone(problem: Problem, values: np.ndarray, covariance: np.ndarray) -> ForceAlone | None:
    """Values per mass with their errors, and the load at rest; None for other records, or masses that differ.

    Parameters
    ----------
    values : (n_free,) in SI units
    covariance : (n_free, n_free)
    """
    layout, conditions = problem.layout, problem.observations.experiment.conditions
    places = {slot.name: i for i, (slot, record) in enumerate(layout.entries) if record is None}
    if problem.model.rig.channels != ("force",) or not set(PER_MASS) <= set(places):
        return None
    masses = np.unique(np.asarray(conditions["weight_mass"]) + np.asarray(conditions["added_mass"]))
    slopes = np.unique(np.sin(np.asarray(conditions["inclination"])))
    if len(masses) > 1 or len(slopes) > 1:
        return None
    found = places.get("weight_mass")
    mass = float(masses[0] if found is None else values[found] + np.asarray(conditions["added_mass"])[0])
    determined = []
    for name, unit in PER_MASS.items():
        i = places[name]
        if not values[i]:  # at its bound: no share of nothing is known
            continue
        change = np.zeros(layout.size)
        change[i] = 1.0 / values[i]
        if found is not None:
            change[found] = -1.0 / mass
        error = float(np.sqrt(change @ covariance @ change))
        if np.isfinite(error):
            determined.append((name, float(values[i] / mass), unit, error))
    load = mass * STANDARD_GRAVITY * float(slopes[0])
    return ForceAlone(tuple(determined), load) if determined else None
