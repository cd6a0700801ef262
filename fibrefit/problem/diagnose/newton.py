"""Whether force and motion as measured obey Newton's law: clock, scales, slope and force of a study, put to a test.

Free flight: a weight whose fibre is slack has two forces on it, its own and that of the guide, which turns round with
the motion. On its way up it is slowed by both, on its way down by their difference, so that flights in both directions
tell gravity itself, whatever the fibre and the friction are. Nothing in a study is known better: what differs from it
is the clock, the scale of the positions or the slope.

Contacts: while a fibre bears load, its force, the weight's own and that of the guide are all there is, whatever the
fibre is: a position is twice the integral of the measured force. A force that was measured late is the integral once
besides, and nothing else in a contact looks like it: friction turns round with the motion, and is known from the whole
of it.

Either is given by the two measured channels alone: positions of each stretch are a sum of a few shapes whose sizes all
stretches share, and of a polynomial of the stretch's own.

Inverse dynamics: a model that is simulated in windows is judged by positions. Its user thinks in forces, and
publications tell them: how well the measured force is the one that the measured motion asks for.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.declarations import SLACK, Capability
from fibrefit.laws.law import Effect
from fibrefit.problem.diagnose.motion import Motion
from fibrefit.problem.task import Task
from fibrefit.problem.thresholds import BALANCE, CARRIES_LOAD, SHORTEST_CONTACT, SHORTEST_FLIGHT, STANDING
from fibrefit.rigs.parts.guide import Sliding
from fibrefit.rigs.rig import STANDARD_GRAVITY
from fibrefit.rigs.signals.rates import derivative, integrated
from fibrefit.rigs.signals.rest import runs
from fibrefit.rigs.signals.trace import Trace
from fibrefit.simulation.inputs import Signals
from fibrefit.simulation.model import corrected_conditions, pushed_by
from fibrefit.study.summaries.check import Check

POSITION, FORCE = "position", "force"
SMOOTHED_LOAD, TURNED = 8e-3, 20e-3
"""Length in s of the windows in which load and direction are found: noise moves the instant at which a weight turns."""


class SharedShapes(NamedTuple):
    """Least squares of positions in shapes.

    Parameters
    ----------
    sizes : (n_wanted,)
    weights : (n_wanted, n_sample)
        Of the positions in each of the sizes.
    left : (n_sample,) in m
        What these leave.
    """

    sizes: np.ndarray
    weights: np.ndarray
    left: np.ndarray


def fitted_shapes(positions: np.ndarray, shapes: np.ndarray, wanted: int, resolved: float) -> SharedShapes | None:
    """Sizes of shapes in the positions of all stretches; None where the shapes are not distinguished.

    Parameters
    ----------
    positions : (n_sample,) in m
    shapes : (n_sample, n_shape)
        Both without what each stretch has of its own.
    wanted : int
        How many of the shapes, the first ones, have a size that is needed.
    resolved : float
        Smallest singular value over the largest from which shapes are distinguished.
    """
    if not (np.isfinite(positions).all() and np.isfinite(shapes).all()):
        return None
    scale = np.maximum(np.linalg.norm(shapes, axis=0), np.finfo(float).tiny)
    left, size, right = np.linalg.svd(shapes / scale, full_matrices=False)
    if not size[-1] > resolved * size[0]:
        return None
    weights = (left @ (right[:, :wanted] / size[:, None])).T / scale[:wanted, None]
    return SharedShapes(weights @ positions, weights, positions - left @ (left.T @ positions))


def without_polynomial(table: np.ndarray, time: np.ndarray, seen: np.ndarray, degree: int) -> np.ndarray:
    """Columns ``(n_seen, n_column)`` of a stretch, less the polynomials in time that are nearest to them.

    Parameters
    ----------
    table : (n_sample, n_column)
    time : (n_sample,)
    seen : (n_sample,) bool
        Samples that count.
    degree : int
        1 where another start and speed could be, 2 where another constant force could be as well.
    """
    own, _ = np.linalg.qr(np.column_stack([time**power for power in range(degree + 1)])[seen])
    return table[seen] - own @ (own.T @ table[seen])


def measured_positions(task: Task, record: int) -> np.ndarray:
    """Measured positions of a record ``(n_time,)`` in m, NaN where they do not count."""
    data, n = task.problem.observations, len(task.traces[record].times)
    counted = np.asarray(data.weight[POSITION])[record, :n] > 0.0
    return np.where(counted, np.asarray(data.measured[POSITION])[record, :n], np.nan)


def stated_and_found(task: Task, local: np.ndarray, record: int) -> dict[str, float]:
    """Conditions and values of a record by name, in SI units, from the values ``(n_record, n_local)`` of all."""
    values = dict(zip(task.problem.layout.names, local[record], strict=True))
    return {**task.traces[record].conditions, **values}


def error_of_sum(task: Task, places: Sequence[tuple[int, np.ndarray]], weights: np.ndarray, left: np.ndarray) -> float:
    """Standard error of a weighted sum of measured positions.

    Parameters
    ----------
    places : sequence of (int, (n_sample,) int)
        Record and samples of stretches of the positions.
    weights : (n_sample,)
        Of the positions of all stretches, one after the other.
    left : (n_sample,)
        What least squares leave of them, in m: where it is louder than the noise of the rests, noise is as loud.
    """
    noise, variance = task.noise[POSITION], 0.0
    parts = np.split(weights, np.cumsum([len(samples) for _, samples in places])[:-1])
    for r, trace in enumerate(task.traces):
        of_record = np.zeros(len(trace.times))
        for (record, samples), part in zip(places, parts, strict=True):
            if record == r:
                of_record[samples] += part
        variance += noise.variance_of_sum(of_record, trace.rate)
    rate, longest = task.traces[0].rate, max(len(samples) for _, samples in places)
    louder = float(np.sqrt(np.mean(left**2))) / noise.rms(longest / rate, rate)
    return float(np.sqrt(variance)) * max(1.0, louder)


EDGE = 0.1
"""Share of a flight at either end that is left out: a force may be late, and a contact begins gently."""
RESOLVED = 1e-4
"""Smallest singular value over the largest below which gravity and friction are not distinguished: flights one way."""


class Gravity(NamedTuple):
    """What free flight says of gravity along the guide.

    Parameters
    ----------
    excess : float
        By how much it is more than what the study says, relative.
    error : float
        Standard error of that, from the noise of the positions.
    """

    excess: float
    error: float

    @classmethod
    def in_flight(cls, task: Task, values: np.ndarray, motion: Motion) -> Gravity | None:
        """Gravity by the positions measured while the fibre is slack; None where no weight flies in both directions.

        Parameters
        ----------
        values : (n_free,) in SI units
        motion : Motion
            At these values.

        Law
        ---
        Positions of a flight are ``a + b t + γ g t² / 2 - (f ∬ sign(v) + c ∬ v) / m``, with friction that is constant
        or grows with the speed and the same f and c in all of them. Least squares of what was measured, over least
        squares of what was simulated: a clock or a scale that is in the model counts as stated. The error is that of
        noise with the spectrum of the rests, or as loud as what is left where that is louder.
        """
        rig = task.problem.model.rig
        if Capability.FALL not in rig.capabilities or not {POSITION, FORCE} <= set(rig.channels):
            return None
        local = np.asarray(task.problem.layout.local(np.asarray(values)))
        flights = _flights(task, motion, measured=True)
        measured, simulated = (_fitted(task, local, some) for some in (flights, _flights(task, motion, measured=False)))
        if measured is None or simulated is None:
            return None
        places = [(flight.record, flight.samples[flight.seen]) for flight in flights]
        error, ratio = error_of_sum(task, places, measured.weights[0], measured.left), float(simulated.sizes[0])
        return cls(float(measured.sizes[0]) / ratio - 1.0, error / ratio)


class _Flight(NamedTuple):
    """One flight: its record, its samples, their positions, NaN where they do not count, and speeds."""

    record: int
    samples: np.ndarray
    position: np.ndarray
    speed: np.ndarray

    @property
    def seen(self) -> np.ndarray:
        """Samples that count."""
        return np.isfinite(self.position)


def _flights(task: Task, motion: Motion, measured: bool) -> list[_Flight]:
    """Flights of all records, by simulated or by measured positions.

    Measured ones are those by the force as well: simulated contacts are late or early where the model is wrong.
    """
    found = list[_Flight]()
    for r, trace in enumerate(task.traces):
        n = len(trace.times)
        free = motion.phase[r, :n] == SLACK
        if measured:
            force = derivative(trace.channels[FORCE], trace.times, SMOOTHED_LOAD, 0)
            free &= force < CARRIES_LOAD * np.nanmax(force)
        position = measured_positions(task, r) if measured else np.asarray(motion.readings[POSITION])[r, :n]
        if np.isfinite(position).sum() < SHORTEST_FLIGHT:
            continue
        speed = derivative(position, trace.times, TURNED, 1)
        for start, end in _stretches(free):
            if np.isfinite(position[start:end]).sum() >= SHORTEST_FLIGHT:
                found.append(_Flight(r, np.arange(start, end), position[start:end], speed[start:end]))
    return found


def _stretches(free: np.ndarray) -> list[tuple[int, int]]:
    """First sample of each flight and the one after its last, without its ends."""
    cut = [(start, end, round(EDGE * (end - start))) for start, end in runs(free).tolist()]
    return [(start + off, end - off) for start, end, off in cut if end - start - 2 * off >= SHORTEST_FLIGHT]


def _fitted(task: Task, local: np.ndarray, flights: list[_Flight]) -> SharedShapes | None:
    """Gravity over the stated one by all flights; None where they tell nothing."""
    tables = []
    for flight in flights:
        step, stated = task.traces[flight.record].step, stated_and_found(task, local, flight.record)
        mass = stated["weight_mass"] + stated.get("added_mass", 0.0)
        gravity = STANDARD_GRAVITY * np.sin(stated["inclination"])
        time = step * (flight.samples - flight.samples.mean())
        # Of the sample in which a weight turns round, the share that it goes one way.
        direction = np.clip(flight.speed / (0.5 * gravity * step), -1.0, 1.0)
        turned, path = integrated(integrated(direction, step), step), integrated(flight.position, step)
        table = np.column_stack([flight.position, 0.5 * gravity * time**2, turned / mass, path / mass])
        # What another start and speed could be is taken off.
        tables.append(without_polynomial(table, time, flight.seen, 1))
    if not tables:
        return None
    table = np.concatenate(tables)
    return fitted_shapes(table[:, 0], table[:, 1:], 1, RESOLVED)


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

    @classmethod
    def in_contacts(cls, task: Task, values: np.ndarray, motion: Motion) -> Lag | None:
        """Delay of the measured force; None where nothing falls, or no contact was measured whole.

        Parameters
        ----------
        values : (n_free,) in SI units
        motion : Motion
            At these values.

        Law
        ---
        Positions of a contact are ``a + b t + c t² - s ∬ F / m - τ ∫ F / m - f ∬ sign(v) / m``, with the same s and τ
        in all of them, and friction f as it was found. The delay is τ / s; a wrong mass, scale or zero of the force is
        in s or c. What the simulated readings say by the same law is taken off: a delay that is in the model counts as
        stated.
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
        return cls(found.late - expected.late, error_of_sum(task, places, found.weights, found.left))


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


def _delay(
    task: Task,
    local: np.ndarray,
    contacts: list[_Contact],
    signals: Callable[[int], tuple[np.ndarray, np.ndarray]],
) -> _Delay | None:
    """Least squares over all contacts; None where they tell nothing.

    Parameters
    ----------
    signals : callable
        Position and force ``(n_time,)`` of a record.
    """
    known = {r: signals(r) for r in {contact.record for contact in contacts}}
    # The direction of the motion is that which the positions tell.
    turns = {r: np.sign(derivative(known[r][0], task.traces[r].times, TURNED, 1)) for r in known}
    tables = []
    for record, samples, seen in contacts:
        step, stated = task.traces[record].step, stated_and_found(task, local, record)
        mass = stated["weight_mass"] + stated.get("added_mass", 0.0)
        position, force, turned = (signal[samples] for signal in (*known[record], turns[record]))
        once = integrated(force, step)
        rubbed = stated.get("friction", 0.0) / mass * integrated(integrated(turned, step), step)
        table = np.column_stack([position + rubbed, integrated(once, step) / mass, once / mass])
        # What another start, speed and constant force could be is taken off.
        tables.append(without_polynomial(table, np.linspace(-1.0, 1.0, len(samples)), seen, 2))
    if not tables:
        return None
    table = np.concatenate(tables)
    found = fitted_shapes(table[:, 0], table[:, 1:], 2, COLLINEAR)
    if found is None or found.sizes[0] == 0.0:
        return None
    whole, once = found.sizes
    late = once / whole
    return _Delay(float(late), (found.weights[1] - late * found.weights[0]) / whole, found.left)


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

    @classmethod
    def of(cls, task: Task, values: np.ndarray) -> ForceBalance | None:
        """What is not explained of a driving force; None for a rig that no force drives.

        Parameters
        ----------
        values : (n_free,) in SI units
        """
        if task.problem.model.rig.anchor is None:
            return None
        local = np.asarray(task.problem.layout.local(np.asarray(values)))
        parts = [_residual(task, trace, local[r]) for r, trace in enumerate(task.traces)]
        count = sum(len(missing) for missing, _ in parts)
        missing = sum(float(np.sum(missing**2)) for missing, _ in parts)
        whole = sum(float(np.sum(force**2)) for _, force in parts)
        varied = sum(float(np.sum((force - force.mean()) ** 2)) for _, force in parts)
        return cls(np.sqrt(missing / count), np.sqrt(missing / whole), 1.0 - missing / varied)

    def check(self) -> Check:
        """Whether the measured force is the one that the measured motion asks for."""
        return Check(
            name="the force is the one the motion asks for",
            passed=self.share <= BALANCE,
            statistic=self.share,
            threshold=BALANCE,
            identifier="force_balance",
            quantity="force balance (inverse dynamics)",
            facts={"below": FORCES},
        )


def _residual(task: Task, trace: Trace, local: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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
    system, laws = _system(task, trace, local)
    pushed = Signals(*(jnp.asarray(trace.inputs["force"][:, i]) for i in (0, 1)))
    force = np.asarray(pushed_by(laws, {"force": pushed}, jnp.asarray(trace.times))["force"].values)
    required = _required_force(system, position, speed, acceleration, force)
    return low(force - required, FORCES), low(force, FORCES)


def _system(task: Task, trace: Trace, local: np.ndarray) -> tuple[Any, tuple[Effect, ...]]:
    """System of a record, and the laws in it."""
    problem = task.problem
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
