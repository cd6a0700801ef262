"""What a rig is doing at each sample: the phase of its motion and the states a missing effect may depend on."""

from __future__ import annotations

from dataclasses import dataclass

import equinox as eqx
import jax
import numpy as np

from fibrefit.problem.observations import Observations
from fibrefit.problem.problem import Problem
from fibrefit.simulate.model import Response

PHASES = ("held", "slack", "taut, loading", "taut, unloading", "at rest")
HELD, SLACK, LOADING, UNLOADING, REST = range(len(PHASES))


@dataclass(frozen=True)
class Motion:
    """The simulated motion behind the readings; NumPy, SI units.

    Parameters
    ----------
    phase : (n_record, n_time) int
        Index into `PHASES`.
    states : dict of (n_record, n_time)
        ``position`` [m], ``speed`` [m/s], ``tension`` [N] and others the rig knows.
    trouble : (n_record,) bool
        Whether the integrator had to give up on locating switches somewhere.
    readings : dict of channel to (n_record, n_time)
        What the sensors make of it.
    """

    phase: np.ndarray
    states: dict[str, np.ndarray]
    trouble: np.ndarray
    readings: dict[str, np.ndarray]


@eqx.filter_jit
def _responses(problem: Problem, values: jax.Array) -> Response:
    def one(local: jax.Array, data: Observations) -> Response:
        return problem.model.respond(dict(zip(problem.layout.names, local, strict=True)), data.experiment)

    return jax.vmap(one)(problem.layout.local(values), problem.observations)


def motion(problem: Problem, values: jax.Array) -> Motion:
    """Simulated motion of all records at `values` ``(n_free,)`` in SI units."""
    response = jax.tree.map(np.asarray, _responses(problem, values))
    states, modes = response.solution.states, response.solution.modes
    speed, taut, direction = states.velocity, modes[0] > 0, modes[1]
    times = np.asarray(problem.observations.experiment.times)
    phase = np.where(taut, np.where(speed >= 0.0, LOADING, UNLOADING), SLACK)
    phase = np.where((direction == 0) & taut, REST, phase)
    if "release" in problem.layout.names:
        local = np.asarray(problem.layout.local(values))
        phase = np.where(times < local[:, [problem.layout.names.index("release")]], HELD, phase)
    known = {"position": states.position, "speed": speed, "tension": response.channels["force"]}
    return Motion(phase, known, np.asarray(response.solution.trouble), response.channels)
