"""Whether force and position were measured at the same time: Newton's law in the contacts, by the two channels alone.

While a fibre bears load, its force, the weight's own and that of the guide are all there is, whatever the fibre is: a
position is twice the integral of the measured force. A force that was measured late is the integral once besides, and
nothing else in a contact looks like it: friction turns round with the motion, and is known from the whole of it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from fibrefit.core.capability import Capability
from fibrefit.problem.diagnose.free_flight import FORCE, LOADED, POSITION, SMOOTHED, TURNED, error_of_sum
from fibrefit.problem.diagnose.phases import Motion
from fibrefit.problem.task import Task
from fibrefit.rigs.signals.motion import integrated
from fibrefit.rigs.signals.rates import derivative
from fibrefit.rigs.signals.trace import Trace

SHORTEST_CONTACT = 24
"""Samples of the shortest contact that tells a shape from its noise."""
TOLD_APART = 1e-6
"""Smallest singular value over the largest below which the two integrals are not told apart."""


class Lag(NamedTuple):
    """What contacts say of the time between force and position.

    Parameters
    ----------
    late : float
        By how much the force is later than the position, beyond what the model has, in s.
    error : float
        Standard error of that, from the noise of the positions.
    """

    late: float
    error: float


class _Contact(NamedTuple):
    """One contact: its record, its samples, and those of them ``(n_sample,)`` whose position counts."""

    record: int
    samples: np.ndarray
    seen: np.ndarray


class _Told(NamedTuple):
    """Delay in s, its weights ``(n_seen,)`` on the positions, and what least squares leave of these."""

    late: float
    weights: np.ndarray
    left: np.ndarray


class _Signals(NamedTuple):
    """Position, force, and the sign of the speed of one record, ``(n_time,)`` each."""

    position: np.ndarray
    force: np.ndarray
    turned: np.ndarray

    @classmethod
    def of(cls, trace: Trace, position: np.ndarray, force: np.ndarray) -> _Signals:
        """With the direction of the motion that the positions tell."""
        return cls(position, force, np.sign(derivative(position, trace.times, TURNED, 1)))


Signals = Callable[[int], tuple[np.ndarray, np.ndarray]]


def lag_in_contacts(task: Task, values: np.ndarray, motion: Motion) -> Lag | None:
    """Delay of the measured force; None where nothing falls, or no contact was measured whole.

    Parameters
    ----------
    task : Task
    values : (n_free,) in SI units
    motion : Motion
        At these values.

    Law
    ---
    Positions of a contact are ``a + b t + c t² - s ∬ F / m - τ ∫ F / m - f ∬ sign(v) / m``, with the same s and τ in
    all of them, and friction f as it was found. The delay is τ / s; a wrong mass, scale or zero of the force is in s
    or c. What the simulated readings say by the same law is taken off: a delay that is in the model counts as stated.
    """
    rig = task.problem.model.rig
    if Capability.FALL not in rig.capabilities or not {POSITION, FORCE} <= set(rig.channels):
        return None
    local = np.asarray(task.problem.layout.local(jnp.asarray(values)))
    data = task.problem.observations
    contacts = _contacts(task)

    def measured(r: int) -> tuple[np.ndarray, np.ndarray]:
        n = len(task.traces[r].times)
        counted = np.asarray(data.weight[POSITION])[r, :n] > 0.0
        return np.where(counted, np.asarray(data.measured[POSITION])[r, :n], np.nan), task.traces[r].channels[FORCE]

    def simulated(r: int) -> tuple[np.ndarray, np.ndarray]:
        n = len(task.traces[r].times)
        return tuple(np.asarray(motion.readings[name])[r, :n] for name in (POSITION, FORCE))  # type: ignore[return-value]

    found, expected = (_told(task, local, contacts, signals) for signals in (measured, simulated))
    if found is None or expected is None:
        return None
    places = [(contact.record, contact.samples[contact.seen]) for contact in contacts]
    return Lag(found.late - expected.late, error_of_sum(task, places, found.weights, found.left))


def _contacts(task: Task) -> list[_Contact]:
    """Contacts by the measured force, from flight to flight; those with gaps in their force do not count."""
    data, found = task.problem.observations, list[_Contact]()
    for r, trace in enumerate(task.traces):
        n, force = len(trace.times), trace.channels[FORCE]
        counted = np.asarray(data.weight[POSITION])[r, :n] > 0.0
        if np.isfinite(force).sum() < SHORTEST_CONTACT:
            continue
        loads = derivative(force, trace.times, SMOOTHED, 0)
        margin = round(0.5 * SMOOTHED / trace.step)
        edges = np.diff((loads > LOADED * np.nanmax(loads)).astype(int), prepend=0, append=0)
        for start, end in zip(np.flatnonzero(edges > 0), np.flatnonzero(edges < 0), strict=True):
            samples = np.arange(start - margin, end + margin)
            if samples[0] < 0 or samples[-1] >= n:
                continue  # it has no flight on one side: the weight may hang there, held by the guide as well
            if np.isfinite(force[samples]).all() and counted[samples].sum() >= SHORTEST_CONTACT:
                found.append(_Contact(r, samples, counted[samples]))
    return found


def _told(task: Task, local: np.ndarray, contacts: list[_Contact], signals: Signals) -> _Told | None:
    """Least squares over all contacts; None where they tell nothing."""
    if not contacts:
        return None
    known = {r: _Signals.of(task.traces[r], *signals(r)) for r in {one.record for one in contacts}}
    table = np.concatenate([_without_start(task, local[one.record], one, known[one.record]) for one in contacts])
    positions, shapes = table[:, 0], table[:, 1:]
    scale = np.maximum(np.linalg.norm(shapes, axis=0), np.finfo(float).tiny)
    left, size, right = np.linalg.svd(shapes / scale, full_matrices=False)
    if not (np.isfinite(table).all() and size[-1] > TOLD_APART * size[0]):
        return None
    rows = (left @ (right / size[:, None])).T / scale[:, None]
    whole, once = rows @ positions
    if whole == 0.0:
        return None
    late = once / whole
    return _Told(float(late), (rows[1] - late * rows[0]) / whole, positions - left @ (left.T @ positions))


def _without_start(task: Task, local: np.ndarray, contact: _Contact, signals: _Signals) -> np.ndarray:
    """Positions of a contact and the two integrals, ``(n_seen, 3)``, without start, speed and a constant force."""
    trace = task.traces[contact.record]
    step, stated = trace.step, {**trace.conditions, **dict(zip(task.problem.layout.names, local, strict=True))}
    mass = stated["weight_mass"] + stated.get("added_mass", 0.0)
    position, force, turned = (signal[contact.samples] for signal in signals)
    once = integrated(force, step)
    rubbed = stated.get("friction", 0.0) / mass * integrated(integrated(turned, step), step)
    columns = [position + rubbed, integrated(once, step) / mass, once / mass]
    time = np.linspace(-1.0, 1.0, len(contact.samples))
    table = np.column_stack(columns)[contact.seen]
    free, _ = np.linalg.qr(np.column_stack([np.ones_like(time), time, time**2])[contact.seen])
    return table - free @ (free.T @ table)
