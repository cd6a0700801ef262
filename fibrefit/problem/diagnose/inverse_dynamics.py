"""How well a measured force is the one that the measured motion asks for: the residual of inverse dynamics.

A model that is simulated in windows is judged by positions. Its user thinks in forces, and publications tell them.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.laws.law import Effect
from fibrefit.problem.task import Task
from fibrefit.problem.thresholds import BALANCE, STANDING
from fibrefit.rigs.parts.guide import Sliding
from fibrefit.rigs.signals.motion import integrated
from fibrefit.rigs.signals.trace import Trace
from fibrefit.simulation.inputs import Signals
from fibrefit.simulation.model import corrected_conditions, pushed_by
from fibrefit.study.summaries.check import Check

MOTION, FORCES = 100.0, 20.0
"""Frequencies in Hz up to which position is differentiated, and up to which forces are compared."""


class ForceBalance(NamedTuple):
    """What inverse dynamics leaves of a driving force, over all records.

    Parameters
    ----------
    rms : float
        Of the force that is not explained, in N.
    share : float
        That over the rms of the force.
    explained : float
        Share of the variance of the force within each record.
    """

    rms: float
    share: float
    explained: float


def balance_check(found: ForceBalance) -> Check:
    """Whether the measured force is the one that the measured motion asks for."""
    return Check(
        name="the force is the one the motion asks for",
        passed=found.share <= BALANCE,
        statistic=found.share,
        threshold=BALANCE,
        identifier="force_balance",
        quantity="force balance (inverse dynamics)",
        facts={"below": FORCES},
    )


def force_balance(task: Task, values: np.ndarray) -> ForceBalance | None:
    """What is not explained of a driving force; None for a rig that no force drives.

    Parameters
    ----------
    values : (n_free,) in SI units
    """
    if task.problem.model.rig.anchor is None:
        return None
    local = np.asarray(task.problem.layout.local(np.asarray(values)))
    parts = [_residual(task, trace, local[r], r) for r, trace in enumerate(task.traces)]
    count = sum(len(missing) for missing, _ in parts)
    missing = sum(float(np.sum(missing**2)) for missing, _ in parts)
    whole = sum(float(np.sum(force**2)) for _, force in parts)
    varied = sum(float(np.sum((force - force.mean()) ** 2)) for _, force in parts)
    return ForceBalance(np.sqrt(missing / count), np.sqrt(missing / whole), 1.0 - missing / varied)


def unexplained_share(task: Task, values: np.ndarray) -> float | None:
    """What is not explained of a driving force over that force, both rms; None for a rig that no force drives."""
    found = force_balance(task, values)
    return None if found is None else found.share


def _residual(task: Task, trace: Trace, local: np.ndarray, record: int) -> tuple[np.ndarray, np.ndarray]:
    """Residual and force ``(n_time,)`` in N, slow parts."""
    from scipy.signal import butter, sosfiltfilt

    rate = trace.rate

    def low(signal: np.ndarray, limit: float) -> np.ndarray:
        return sosfiltfilt(butter(4, min(limit, 0.2 * rate), fs=rate, output="sos"), signal)

    raw = trace.inputs["anchor"][:, 2]
    known = np.isfinite(raw)
    measured = low(np.interp(trace.times, trace.times[known], raw[known]), MOTION)
    by_velocity = task.problem.model.rig.anchor == "velocity"
    position = integrated(measured, trace.step) if by_velocity else measured
    speed = measured if by_velocity else np.gradient(position, trace.times)
    acceleration = np.gradient(speed, trace.times)
    system, laws = _system(task, local, record)
    pushed = Signals(*(jnp.asarray(trace.inputs["force"][:, i]) for i in (0, 1)))
    force = np.asarray(pushed_by(laws, {"force": pushed}, jnp.asarray(trace.times))["force"].values)
    required = _required_force(system, position, speed, acceleration, force)
    return low(force - required, FORCES), low(force, FORCES)


def _system(task: Task, local: np.ndarray, record: int) -> tuple[Any, tuple[Effect, ...]]:
    """System of a record, and the laws in it."""
    problem, trace = task.problem, task.traces[record]
    named = dict(zip(problem.layout.names, jnp.asarray(local), strict=True))
    stated, laws = {name: jnp.asarray(value) for name, value in trace.conditions.items()}, problem.model.laws(named)
    conditions = corrected_conditions(stated, named, laws)
    return problem.model.rig.build(named, conditions, laws, problem.model.tension_law), laws


def _required_force(
    system: Any, position: np.ndarray, speed: np.ndarray, acceleration: np.ndarray, force: np.ndarray
) -> np.ndarray:
    """Force that a motion asks for, ``(n_time,)`` in N; where the mass stands, the one that was measured."""
    return np.asarray(_required(system, STANDING, *map(jnp.asarray, (position, speed, acceleration, force))))


@eqx.filter_jit
def _required(
    system: Any, standing: float, position: jax.Array, speed: jax.Array, acceleration: jax.Array, force: jax.Array
) -> jax.Array:
    def one(u: jax.Array, v: jax.Array, a: jax.Array, measured: jax.Array) -> jax.Array:
        drive = system.gain * measured - system.offset
        direction = jnp.where(jnp.abs(v) < standing, 0, jnp.sign(v)).astype(jnp.int32)
        resisted = drive - system.guide.net_force(drive, direction, Sliding(u, v, jnp.zeros(())))
        return jnp.where(direction == 0, measured, (system.mass * a + system.offset + resisted) / system.gain)

    return jax.vmap(one)(position, speed, acceleration, force)
