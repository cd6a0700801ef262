"""What to do next: which further record would help most, and where to turn when the model falls short."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.check import Check
from fibrefit.core.programs.kept import kept_program
from fibrefit.core.units import format_quantity
from fibrefit.fitting.identifiability import Weakness, force_alone
from fibrefit.problem.statement.layout import scale_of
from fibrefit.problem.statement.problem import Problem

WORTHWHILE = 0.8
"""A record is advised if it brings the largest relative error below this share of what it is."""

LACKING = frozenset({"residual_size", "residual_spectrum", "residual_phase", "residual_state"})
"""Identifiers of the checks that fail where the model lacks something."""

ONE_WAY = (
    "Motion in one direction tells the sum of friction and force_offset alone: record the way back too, or hold one of "
    'them, for example [parameters.force_offset] fixed = "0 N".'
)


def advice(
    problem: Problem,
    values: np.ndarray,
    normal: np.ndarray,
    covariance: np.ndarray,
    weak: tuple[Weakness, ...],
    checks: tuple[Check, ...],
) -> tuple[str, ...]:
    """Sentences, the most useful first.

    Parameters
    ----------
    problem : Problem
    values : (n_free,) in SI units
    normal, covariance : (n_free, n_free)
    weak : tuple of Weakness
    checks : tuple of Check
    """
    failed = {check.identifier for check in checks if not check.passed}
    said = []
    if failed & LACKING:
        said.append('Run "fibrefit discover" on this study: it looks for what the model lacks and names it.')
    if "noise_level" in failed:
        said.append("Let a record begin before the motion and run on after it: rests tell the noise.")
    if any({"friction", "force_offset"} <= set(weakness.names) for weakness in weak):
        said.append(ONE_WAY)
    if alone := force_alone(problem, values, covariance):
        said.append(alone)
    if weak and (further := _further_record(problem, values, normal)):
        said.append(further)
    return tuple(said)


def _further_record(problem: Problem, values: np.ndarray, normal: np.ndarray) -> str:
    menu = problem.model.rig.menu(problem.observations.experiment.conditions)
    shared = [i for i, (_, record) in enumerate(problem.layout.entries) if record is None]
    if not menu or not shared:
        return ""
    before = _relative_errors(normal, shared, values)
    best, chosen = np.inf, menu[0]
    for conditions in menu:
        more = _information(problem, jnp.asarray(values), {name: jnp.asarray(x) for name, x in conditions.items()})
        after = _relative_errors(normal + np.asarray(more), shared, values)
        if (gain := float(after.max() / before.max())) < best:
            best, chosen = gain, conditions
    if not best < WORTHWHILE:
        return "No further record of the usual kind would help much: the parameter needs another kind of test."
    units = {condition.name: condition.unit for condition in problem.model.rig.conditions}
    said = ", ".join(f"{name.replace('_', ' ')} {_shown(x, units[name])}" for name, x in chosen.items())
    return (
        f"A further record with {said} would bring the largest relative error down to {100 * best:.0f} % of what it is."
    )


def _shown(value: float, unit: str) -> str:
    return f"{np.degrees(value):.3g} deg" if unit == "rad" else format_quantity(value, unit, 3)


def _relative_errors(normal: np.ndarray, shared: list[int], values: np.ndarray) -> np.ndarray:
    scale = scale_of(normal)
    matrix = normal / np.outer(scale, scale) + 1e-10 * np.eye(len(scale))
    errors = np.sqrt(np.diag(np.linalg.inv(matrix))) / scale
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
    local = jnp.einsum("cti,ctj->ij", slopes, slopes)
    columns = problem.layout.local_columns[0]
    shared = sum(record is None for _, record in problem.layout.entries)
    own = columns >= shared
    if own.any():
        block = local[own][:, own] + 1e-12 * jnp.diag(jnp.diag(local[own][:, own]))
        local = local - local[:, own] @ jnp.linalg.solve(block, local[own])
    local = jnp.where(own[:, None] | own[None, :], 0.0, local)
    whole = jnp.zeros((problem.layout.size + 2,) * 2).at[columns[:, None], columns[None, :]].add(local)
    return whole[:-2, :-2]
