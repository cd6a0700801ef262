"""A task whose parameters are known: what belongs to each record alone is found from its data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np

from fibrefit.fitting.search.optimum import with_input_errors
from fibrefit.fitting.search.solve import descend, widths
from fibrefit.problem import Layout, Problem, Task, error_rms, input_errors


@dataclass(frozen=True)
class Held:
    """A task with its parameters held.

    Parameters
    ----------
    task : Task
        Its start is what was found for each record; errors found in measured inputs are taken off them.
    success : bool
        Whether the search for it came to an end.
    input_rms : mapping of input to float, in SI units
        Errors found in measured inputs.
    """

    task: Task
    success: bool
    input_rms: Mapping[str, float]

    @property
    def local(self) -> np.ndarray:
        """Values of each record, ``(n_record, n_local)`` in SI units."""
        return np.asarray(self.task.problem.layout.local(jnp.asarray(self.task.start)))


def with_nuisances_found(task: Task) -> Held:
    """The task with its parameters held at its start and each record's own values fitted."""
    layout = task.problem.layout
    local = np.asarray(layout.local(jnp.asarray(task.start)))
    declared = {parameter.name for parameter in task.problem.model.parameters}
    slots = tuple(
        replace(slot, shared=False, fixed=tuple(local[:, j].tolist())) if slot.name in declared else slot
        for j, slot in enumerate(layout.slots)
    )
    held = Problem(task.problem.model, Layout(slots, layout.records), task.problem.observations)
    named = {name: local[:, j] for j, name in enumerate(layout.names)}
    start, success = held.layout.pack(named), True
    if held.layout.size:
        free = held.layout.free(jnp.asarray(start))
        found = descend(held, free, widths(held, free), task.counts)
        start, success = np.asarray(held.layout.values(found.free)), bool(np.isfinite(found.cost))
    found_all = replace(task, problem=held, start=start)
    if not (known := input_errors(found_all)):
        return Held(found_all, success, {})
    best = with_input_errors(found_all, known, start)
    rms = error_rms(found_all.problem, known, best.coefficients)
    return Held(replace(found_all, problem=best.problem, start=best.values), success, rms)
