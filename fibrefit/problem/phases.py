"""What a rig is doing at each sample: the phase of its motion and the states a missing effect may depend on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import numpy as np

from fibrefit.problem.observations import Observations
from fibrefit.problem.problem import Problem
from fibrefit.simulate.model import Response

PHASES = ("held", "slack", "taut, loading", "taut, unloading", "at rest", "moving forwards", "moving back")
HELD, SLACK, LOADING, UNLOADING, REST, FORWARDS, BACK = range(len(PHASES))


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
    modes, known = response.solution.modes, _known(response)
    speed = known["speed"]
    times = np.asarray(problem.observations.experiment.times)
    phase = _phase(modes, speed)
    if "release" in problem.layout.names:
        local = np.asarray(problem.layout.local(values))
        phase = np.where(times < local[:, [problem.layout.names.index("release")]], HELD, phase)
    return Motion(phase, known, np.asarray(response.solution.trouble), response.channels)


def _known(response: Response) -> dict[str, np.ndarray]:
    """States a missing effect may depend on, by what the rig has."""
    states, channels = response.solution.states, response.channels
    if hasattr(states, "angle"):
        tension = np.maximum(channels["force_1"], channels["force_2"])
        return {"position": states.angle, "speed": states.rate, "tension": tension}
    known = {"position": states.position, "speed": states.velocity}
    return known | {"tension": channels["force"]} if "force" in channels else known


def _phase(modes: Any, speed: np.ndarray) -> np.ndarray:
    """Phase by the modes of the fibres, where the rig has any, and of the guide."""
    fibres = [getattr(modes, name) for name in ("fibre", "fibre_1", "fibre_2") if hasattr(modes, name)]
    resting = getattr(modes, "guide", np.ones_like(speed)) == 0
    if not fibres:
        return np.where(resting, REST, np.where(speed >= 0.0, FORWARDS, BACK))
    taut = np.logical_or.reduce([mode > 0 for mode in fibres])
    phase = np.where(taut, np.where(speed >= 0.0, LOADING, UNLOADING), SLACK)
    return np.where(resting & taut, REST, phase)
