"""What to do next: which further record would help most, and where to turn when the model falls short."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import equinox as eqx
import jax
import numpy as np

from fibrefit.fitting.identifiability import Weakness, force_alone
from fibrefit.fitting.misfit.lone_samples import LoneSamples
from fibrefit.fitting.thresholds import WORTHWHILE
from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.laws.law import SensorLaw, StudyLaw
from fibrefit.problem.statement.layout import RAN_AWAY, assembled
from fibrefit.problem.statement.matrices import equilibrated, scale_of
from fibrefit.problem.statement.problem import Problem
from fibrefit.study.summaries.check import OTHERWISE, Check

SIGNS_OF_LACK = frozenset({"residual_size", "residual_spectrum", "residual_phase", "residual_state", "loudest_record"})
"""Identifiers of the checks that fail where the model lacks something."""


class Advice(NamedTuple):
    """What to do next; `fibrefit.report.sentences` says it.

    Parameters
    ----------
    identifier : str
        ``"lone_samples"``, ``"slack_zero"``, ``"correct"``, ``"widen"``, ``"search"``, ``"rest"``, ``"way_back"``,
        ``"force_alone"``, ``"another_test"`` or ``"further_record"``.
    facts : mapping of str to object
        What a sentence needs besides.
    """

    identifier: str
    facts: Mapping[str, Any] = MappingProxyType({})


def advice(
    problem: Problem,
    values: np.ndarray,
    normal: np.ndarray,
    covariance: np.ndarray,
    weak: tuple[Weakness, ...],
    checks: tuple[Check, ...],
) -> tuple[Advice, ...]:
    """What to do next, the most useful first.

    Parameters
    ----------
    values : (n_free,) in SI units
    normal, covariance : (n_free, n_free)
    """
    failed = {check.identifier: check for check in checks if not check.passed}
    found = list(_first_of_all(failed))
    # What could not be looked at is no sign of anything.
    lacks = [name for name in failed.keys() & SIGNS_OF_LACK if failed[name].facts.get("tried", True)]
    if lacks and not found:
        found.append(Advice("search"))
    if "noise_level" in failed:
        found.append(Advice("rest"))
    if any({"friction", "force_offset"} <= set(map(_bare, weakness.names)) for weakness in weak):
        found.append(Advice("way_back"))
    if alone := force_alone(problem, values, covariance):
        found.append(Advice("force_alone", {"determined": alone}))
    # A record that is planned with values of no use is none to take.
    usable = not any(check.fatal for check in failed.values())
    # Nor is one of help to what another record has for itself.
    shared = {problem.layout.free_names[i] for i in problem.layout.shared_places}
    own = set(problem.layout.free_names) - shared
    helped = any(set(weakness.names) - own for weakness in weak)
    if helped and usable and (further := _further_record(problem, values, normal)):
        found.append(further)
    return tuple(found)


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


def _first_of_all(failed: Mapping[str, Check]) -> Iterator[Advice]:
    """What has to be settled before anything else: a fault in what is stated, or a bound that was a guess."""
    cause = failed.get(OTHERWISE)
    if "slack_zero" in failed:
        yield Advice("slack_zero", failed["slack_zero"].facts)
    elif cause is not None and issubclass(CATALOGUE[cause.facts["alternative"].effect], StudyLaw | SensorLaw):
        yield Advice("correct", {"alternative": cause.facts["alternative"]})
    elif "bounds" in failed:
        names = dict.fromkeys(map(_bare, failed["bounds"].facts["parameters"]))
        yield Advice("widen", {"parameters": tuple(names)})


def _bare(name: str) -> str:
    """Name of a parameter without the record whose value it is."""
    return name.partition("[")[0]


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
        found += [_of_shared(problem, np.asarray(rows)) for rows in linear.slopes[: len(planned)]]
    return found


def _of_shared(problem: Problem, slopes: np.ndarray) -> np.ndarray:
    """Normal matrix of the shared values from slopes ``(n_channel, n_time, n_local)`` of a record like the first."""
    columns = np.asarray(problem.layout.local_columns[0])
    own = columns >= sum(record is None for _, record in problem.layout.entries)
    flat = slopes.reshape(-1, slopes.shape[-1])
    # What the record's own nuisances can imitate says nothing.
    moved = np.linalg.lstsq(flat[:, own], flat, rcond=None)[0]
    beside = np.where(own, 0.0, flat - flat[:, own] @ moved)
    return np.asarray(assembled((beside.T @ beside)[None], columns[None], problem.layout.size))
