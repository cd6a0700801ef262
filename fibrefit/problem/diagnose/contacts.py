"""Whether force and position were measured at the same time: Newton's law in the contacts, by the two channels alone.

While a fibre bears load, its force, the weight's own and that of the guide are all there is, whatever the fibre is: a
position is twice the integral of the measured force. A force that was measured late is the integral once besides, and
nothing else in a contact looks like it: friction turns round with the motion, and is known from the whole of it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fibrefit.core.capability import Capability
from fibrefit.problem.diagnose.phases import Motion
from fibrefit.problem.diagnose.stretches import (
    FORCE,
    POSITION,
    SMOOTHED_LOAD,
    TURNED,
    error_of_sum,
    fitted_shapes,
    measured_positions,
    stated_and_found,
    without_polynomial,
)
from fibrefit.problem.task import Task
from fibrefit.problem.thresholds import CARRIES_LOAD, SHORTEST_CONTACT
from fibrefit.rigs.signals.motion import integrated
from fibrefit.rigs.signals.rates import derivative
from fibrefit.rigs.signals.rest import runs
from fibrefit.rigs.signals.trace import Trace

COLLINEAR = 1e-6
"""Smallest singular value over the largest below which the two integrals are not distinguished."""


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


class _Delay(NamedTuple):
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
    local = np.asarray(task.problem.layout.local(np.asarray(values)))
    contacts = _contacts(task)

    def measured(r: int) -> tuple[np.ndarray, np.ndarray]:
        return measured_positions(task, r), task.traces[r].channels[FORCE]

    def simulated(r: int) -> tuple[np.ndarray, np.ndarray]:
        n = len(task.traces[r].times)
        return tuple(np.asarray(motion.readings[name])[r, :n] for name in (POSITION, FORCE))  # type: ignore[return-value]

    found, expected = (_delay(task, local, contacts, signals) for signals in (measured, simulated))
    if found is None or expected is None:
        return None
    places = [(contact.record, contact.samples[contact.seen]) for contact in contacts]
    return Lag(found.late - expected.late, error_of_sum(task, places, found.weights, found.left))


def _contacts(task: Task) -> list[_Contact]:
    """Contacts by the measured force, from flight to flight; those with gaps in their force do not count."""
    found = list[_Contact]()
    for r, trace in enumerate(task.traces):
        n, force = len(trace.times), trace.channels[FORCE]
        counted = np.isfinite(measured_positions(task, r))
        if np.isfinite(force).sum() < SHORTEST_CONTACT:
            continue
        loads = derivative(force, trace.times, SMOOTHED_LOAD, 0)
        margin = round(0.5 * SMOOTHED_LOAD / trace.step)
        for start, end in runs(loads > CARRIES_LOAD * np.nanmax(loads)).tolist():
            samples = np.arange(start - margin, end + margin)
            if samples[0] < 0 or samples[-1] >= n:
                continue  # it has no flight on one side: the weight may hang there, held by the guide as well
            if np.isfinite(force[samples]).all() and counted[samples].sum() >= SHORTEST_CONTACT:
                found.append(_Contact(r, samples, counted[samples]))
    return found


def _delay(task: Task, local: np.ndarray, contacts: list[_Contact], signals: Signals) -> _Delay | None:
    """Least squares over all contacts; None where they tell nothing."""
    if not contacts:
        return None
    known = {r: _Signals.of(task.traces[r], *signals(r)) for r in {one.record for one in contacts}}
    table = np.concatenate([_without_start(task, local, one, known[one.record]) for one in contacts])
    found = fitted_shapes(table[:, 0], table[:, 1:], 2, COLLINEAR)
    if found is None or found.sizes[0] == 0.0:
        return None
    whole, once = found.sizes
    late = once / whole
    return _Delay(float(late), (found.weights[1] - late * found.weights[0]) / whole, found.left)


def _without_start(task: Task, local: np.ndarray, contact: _Contact, signals: _Signals) -> np.ndarray:
    """Positions of a contact and the two integrals, ``(n_seen, 3)``, without start, speed and a constant force."""
    step, stated = task.traces[contact.record].step, stated_and_found(task, local, contact.record)
    mass = stated["weight_mass"] + stated.get("added_mass", 0.0)
    position, force, turned = (signal[contact.samples] for signal in signals)
    once = integrated(force, step)
    rubbed = stated.get("friction", 0.0) / mass * integrated(integrated(turned, step), step)
    columns = [position + rubbed, integrated(once, step) / mass, once / mass]
    time = np.linspace(-1.0, 1.0, len(contact.samples))
    return without_polynomial(np.column_stack(columns), time, contact.seen, 2)
