"""What to do next: which further record would help most, and where to turn when the model falls short."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.programs.kept import kept_program
from fibrefit.core.programs.products import column_products
from fibrefit.fitting.identifiability import Weakness, force_alone
from fibrefit.fitting.thresholds import WORTHWHILE
from fibrefit.problem.statement.layout import assembled, scale_of
from fibrefit.problem.statement.problem import Problem
from fibrefit.study.summaries.check import Check

SIGNS_OF_LACK = frozenset({"residual_size", "residual_spectrum", "residual_phase", "residual_state"})
"""Identifiers of the checks that fail where the model lacks something."""


class Advice(NamedTuple):
    """What to do next; `fibrefit.report.sentences` says it.

    Parameters
    ----------
    identifier : str
        ``"search"``, ``"rest"``, ``"way_back"``, ``"force_alone"``, ``"another_test"`` or ``"further_record"``.
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
    failed = {check.identifier for check in checks if not check.passed}
    found = []
    if failed & SIGNS_OF_LACK:
        found.append(Advice("search"))
    if "noise_level" in failed:
        found.append(Advice("rest"))
    if any({"friction", "force_offset"} <= set(weakness.names) for weakness in weak):
        found.append(Advice("way_back"))
    if alone := force_alone(problem, values, covariance):
        found.append(Advice("force_alone", {"determined": alone}))
    if weak and (further := _further_record(problem, values, normal)):
        found.append(further)
    return tuple(found)


def _further_record(problem: Problem, values: np.ndarray, normal: np.ndarray) -> Advice | None:
    menu = problem.model.rig.menu(problem.observations.experiment.conditions)
    shared = [i for i, (_, record) in enumerate(problem.layout.entries) if record is None]
    if not menu or not shared:
        return None
    before = _relative_errors(normal, shared, values)
    best, chosen = np.inf, menu[0]
    for conditions in menu:
        more = _information(problem, jnp.asarray(values), {name: jnp.asarray(x) for name, x in conditions.items()})
        after = _relative_errors(normal + np.asarray(more), shared, values)
        if (gain := float(after.max() / before.max())) < best:
            best, chosen = gain, conditions
    if not best < WORTHWHILE:
        return Advice("another_test")
    units = {condition.name: condition.unit for condition in problem.model.rig.conditions}
    stated = tuple((name, value, units[name]) for name, value in chosen.items())
    return Advice("further_record", {"conditions": stated, "share": best})


def _relative_errors(normal: np.ndarray, shared: list[int], values: np.ndarray) -> np.ndarray:
    scale = scale_of(normal)
    matrix = normal / np.outer(scale, scale) + 1e-10 * np.eye(len(scale))
    variances = np.diag(np.linalg.inv(matrix))
    errors = np.sqrt(np.where(variances > 0.0, variances, np.inf)) / scale
    return errors[shared] / np.maximum(np.abs(values[shared]), 1e-12)


@kept_program
def _information(problem: Problem, values: jax.Array, conditions: dict[str, jax.Array]) -> jax.Array:
    """Normal matrix of the shared values from one more record like the first, its own nuisances eliminated."""
    data = problem.observations
    changed = dict(data.experiment.conditions)
    for name, value in conditions.items():
        changed[name] = changed[name].at[0].set(value)
    planned = data._replace(experiment=data.experiment._replace(conditions=changed))
    slopes = eqx.tree_at(lambda p: p.observations, problem, planned).linearised(values).slopes[0]
    flat = slopes.reshape(-1, slopes.shape[-1])
    local = column_products(flat, flat)
    columns = problem.layout.local_columns[0]
    shared = sum(record is None for _, record in problem.layout.entries)
    own = columns >= shared
    if own.any():
        block = local[own][:, own] + 1e-12 * jnp.diag(jnp.diag(local[own][:, own]))
        local = local - local[:, own] @ jnp.linalg.solve(block, local[own])
    local = jnp.where(own[:, None] | own[None, :], 0.0, local)
    return assembled(local[None], columns[None], problem.layout.size)
