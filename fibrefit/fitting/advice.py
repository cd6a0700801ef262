"""What to do next: which further record would help most, and where to turn when the model falls short."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import numpy as np

from fibrefit.core.arrays import RAN_AWAY, assembled
from fibrefit.core.matrices import equilibrated, scale_of
from fibrefit.fitting.checks import BOUNDS, CHECKS
from fibrefit.fitting.evaluated import EvaluatedEstimate
from fibrefit.fitting.residuals import LoneSamples, lone_samples
from fibrefit.fitting.result import Advice
from fibrefit.fitting.thresholds import WORTHWHILE
from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.laws.law import SensorLaw, StudyLaw
from fibrefit.problem import Problem
from fibrefit.rigs.rig import STANDARD_GRAVITY
from fibrefit.study.summaries.check import OTHERWISE, SIZE, Check

PER_MASS = {"stiffness": "1/s^2", "damping": "1/s"}
"""Parameters that force determines per mass, and the unit of that."""


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


def advice(estimate: EvaluatedEstimate, checks: tuple[Check, ...]) -> tuple[Advice, ...]:
    """What to do next, the most useful first: remedies of the checks that failed, and what would tell more."""
    problem, values = estimate.problem, estimate.values
    failed = {check.identifier: check for check in checks if not check.passed}
    # What could not be looked at is no sign of anything.
    remedies = {row.remedy for row in CHECKS if row.identifier in failed and not estimate.passed(row.identifier)}
    found = []
    # What has to be settled before anything else: a fault in what is stated, or a bound that was a guess.
    cause = failed[OTHERWISE].facts["alternative"] if "correct" in remedies else None
    if "slack_zero" in remedies:
        found.append(Advice("slack_zero", failed["slack_zero"].facts))
    elif cause is not None and issubclass(CATALOGUE[cause.effect], StudyLaw | SensorLaw):
        found.append(Advice("correct", {"alternative": cause}))
    elif "widen" in remedies:
        names = dict.fromkeys(name.partition("[")[0] for name in failed[BOUNDS].facts["parameters"])
        found.append(Advice("widen", {"parameters": tuple(names)}))
    elif "search" in remedies:
        found.append(Advice("search"))
    if "rest" in remedies:
        found.append(Advice("rest"))
    if any({"friction", "force_offset"} <= {name.partition("[")[0] for name in one.names} for one in estimate.weak):
        found.append(Advice("way_back"))
    if alone := force_alone(problem, values, estimate.bars.covariance):
        found.append(Advice("force_alone", {"determined": alone}))
    # A record that is planned with values of no use is none to take.
    usable = not any(check.fatal for check in failed.values())
    # Nor is one of help to what another record has for itself.
    own = set(problem.layout.free_names) - {problem.layout.free_names[i] for i in problem.layout.shared_places}
    helped = any(set(weakness.names) - own for weakness in estimate.weak)
    normal = estimate.search.plain.scores.normal_matrix()
    if "further_record" in remedies and helped and usable and (further := _further_record(problem, values, normal)):
        found.append(further)
    lone = None if estimate.passed(SIZE) else lone_samples(estimate.residual_set)
    return with_lone_samples(tuple(found), lone, problem.soft_beyond is not None)


def with_lone_samples(found: tuple[Advice, ...], alone: LoneSamples | None, robust: bool) -> tuple[Advice, ...]:
    """Advice where a few samples carry what is left: these come first, and nothing is sought for their sake.

    Parameters
    ----------
    robust : bool
        Whether large residuals counted less already.
    """
    if alone is None:
        return found
    first = Advice("lone_samples", {"alone": alone, "robust": robust})
    return (first, *(one for one in found if one.identifier != "search"))


@RAN_AWAY
def _further_record(problem: Problem, values: np.ndarray, normal: np.ndarray) -> Advice | None:
    menu = problem.model.rig.menu(problem.observations.experiment.conditions)
    shared = problem.layout.shared_places
    if not menu or not shared:
        return None
    before = _relative_errors(normal, shared, values)
    best, chosen = np.inf, menu[0]
    for conditions, more in zip(menu, _information(problem, values, menu), strict=True):
        after = _relative_errors(normal + more, shared, values)
        if (gain := float(after.max() / before.max())) < best:
            best, chosen = gain, conditions
    if not best < WORTHWHILE:
        return Advice("another_test")
    units = {condition.name: condition.unit for condition in problem.model.rig.conditions}
    stated = tuple((name, value, units[name]) for name, value in chosen.items())
    return Advice("further_record", {"conditions": stated, "share": best})


def _relative_errors(normal: np.ndarray, shared: list[int], values: np.ndarray) -> np.ndarray:
    scale = scale_of(normal)
    matrix = equilibrated(normal, scale) + 1e-10 * np.eye(len(scale))
    variances = np.diag(np.linalg.inv(matrix))
    errors = np.sqrt(np.where(variances > 0.0, variances, np.inf)) / scale
    return errors[shared] / np.maximum(np.abs(values[shared]), 1e-12)


def _information(problem: Problem, values: np.ndarray, menu: Sequence[Mapping[str, float]]) -> list[np.ndarray]:
    """Normal matrices of the shared values, each from one more record like the first, its own nuisances eliminated.

    The records of the problem give their places to as many further ones: no program is compiled for them.
    """
    number, found = len(problem.layout.records), []
    columns = np.asarray(problem.layout.local_columns[0])
    own = columns >= sum(record is None for _, record in problem.layout.entries)
    first = jax.tree.map(lambda rows: np.repeat(np.asarray(rows)[:1], number, axis=0), problem.observations)
    at_hand = np.asarray(problem.layout.local(values))[0]
    stated = {name: rows[0] for name, rows in first.experiment.conditions.items()}
    for planned in (menu[i : i + number] for i in range(0, len(menu), number)):
        taken = dict(first.experiment.conditions)
        for name in planned[0]:
            rows = np.array([conditions[name] for conditions in planned])
            taken[name] = np.concatenate([rows, taken[name][len(rows) :]])
        local = np.repeat(at_hand[None], number, axis=0)
        for r, conditions in enumerate(planned):
            local[r] = problem.values_elsewhere(at_hand, stated, {**stated, **conditions}, conditions)
        observations = first._replace(experiment=first.experiment._replace(conditions=taken))
        linear = eqx.tree_at(lambda p: p.observations, problem, observations).linearised_at(local)
        for rows in linear.slopes[: len(planned)]:
            flat = np.asarray(rows).reshape(-1, rows.shape[-1])
            # What the record's own nuisances can imitate says nothing.
            moved = np.linalg.lstsq(flat[:, own], flat, rcond=None)[0]
            rest = np.where(own, 0.0, flat - flat[:, own] @ moved)
            found.append(np.asarray(assembled((rest.T @ rest)[None], columns[None], problem.layout.size)))
    return found
