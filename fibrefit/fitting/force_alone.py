"""What a fall tells of which the force alone was measured: values per mass, and the load that rests in the fibre."""

from __future__ import annotations

import numpy as np

from fibrefit.problem.statement.problem import Problem
from fibrefit.rigs.rig import STANDARD_GRAVITY

PER_MASS = {"stiffness": "1/s^2", "damping": "1/s"}
"""Parameters that force determines per mass, and the unit of that."""


def force_alone(problem: Problem, values: np.ndarray, covariance: np.ndarray) -> str:
    """Values per mass with their errors, and the load at rest; empty for other records, or masses that differ.

    Parameters
    ----------
    problem : Problem
    values : (n_free,) in SI units
    covariance : (n_free, n_free)
    """
    layout, conditions = problem.layout, problem.observations.experiment.conditions
    places = {slot.name: i for i, (slot, record) in enumerate(layout.entries) if record is None}
    if problem.model.rig.channels != ("force",) or not set(PER_MASS) <= set(places):
        return ""
    masses = np.unique(np.asarray(conditions["weight_mass"]) + np.asarray(conditions["added_mass"]))
    slopes = np.unique(np.sin(np.asarray(conditions["inclination"])))
    if len(masses) > 1 or len(slopes) > 1:
        return ""
    found = places.get("weight_mass")
    mass = float(masses[0] if found is None else values[found] + np.asarray(conditions["added_mass"])[0])
    told = []
    for name, unit in PER_MASS.items():
        i = places[name]
        change = np.zeros(layout.size)
        change[i] = 1.0 / values[i]
        if found is not None:
            change[found] = -1.0 / mass
        error = float(np.sqrt(change @ covariance @ change))
        if np.isfinite(error):
            told.append(f"{name} over mass, {values[i] / mass:.4g} {unit} within {100.0 * error:.2g} %")
    load = mass * STANDARD_GRAVITY * float(slopes[0])
    if not told:
        return ""
    return (
        f"Force alone determines {' and '.join(told)}, and the load at rest, {load:.4g} N: stiffness, damping and "
        "friction themselves are as sure as the mass that is stated."
    )
