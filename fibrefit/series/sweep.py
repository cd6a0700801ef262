"""Frequency sweep of a pendulum: from rest at each frequency, and continued from one to the next, up and down."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.threads import THREADS, thread_pool
from fibrefit.problem.statement.observations import LENGTH_STEP
from fibrefit.rigs.inverted_pendulum import InvertedPendulum
from fibrefit.series.marks import Extremes
from fibrefit.series.periods import Drive, SteadyState, steady_state
from fibrefit.simulation.model import Model, corrected_conditions

PARTS = 4
"""Batches of runs from rest for each core."""
BRANCHES = ("rest", "up", "down")
"""Ways to come to a frequency: from rest, and from the motion at the next lower or higher frequency."""


@dataclass(frozen=True)
class Conditions:
    """One curve of a sweep.

    Parameters
    ----------
    name : str
    amplitude : float in m
        Of the driven ends.
    rig : mapping of str to float in SI units
        The rig's conditions.
    """

    name: str
    amplitude: float
    rig: Mapping[str, float]


@dataclass(frozen=True)
class Plan:
    """What a sweep goes through.

    Parameters
    ----------
    frequencies : (n_frequency,) in Hz, increasing
    settle : float in s
        Longest time a motion is given to settle.
    rate : float in Hz
        Steps of the simulation.
    """

    frequencies: np.ndarray
    settle: float
    rate: float

    @property
    def size(self) -> int:
        """Points of the longest period, with some to spare: sweeps of like length share a compiled program."""
        return -(-(math.ceil(self.rate / float(self.frequencies[0])) + 2) // LENGTH_STEP) * LENGTH_STEP


@dataclass(frozen=True)
class Branch(Extremes):
    """The motions of one branch; all arrays run over the frequencies, NumPy, SI units.

    Parameters
    ----------
    lowest, highest, first_lowest, first_highest : (n_frequency, 3)
        Of angle and of both forces.
    periods : (n_frequency,) int
        Periods of the drive after which the motion repeats itself; 0 where it does not.
    multiplier : (n_frequency,)
        Largest modulus of a Floquet multiplier; the motion is stable below 1.
    overturned, trouble : (n_frequency,) bool
    time : (n_frequency,) in s
        That was simulated until it had settled.
    """

    periods: np.ndarray
    multiplier: np.ndarray
    overturned: np.ndarray
    trouble: np.ndarray
    time: np.ndarray


@dataclass(frozen=True)
class SweptCurve:
    """One curve of a sweep.

    Parameters
    ----------
    conditions : Conditions
        With the ``name`` of the curve.
    frequencies : (n_frequency,) in Hz
        Of the drive.
    natural_frequency : float
        Of small motions, in Hz.
    branches : mapping of str to Branch
        ``up``, ``down`` and ``rest``: what the sweep up, the sweep down and starts from rest found.

    Examples
    --------
    >>> curve = swept.curves[0]
    >>> sorted(curve.branches), curve.branches["up"].amplitude.shape == curve.frequencies.shape
    (['down', 'rest', 'up'], True)
    """

    conditions: Conditions
    frequencies: np.ndarray
    natural_frequency: float
    branches: Mapping[str, Branch]


def sweep(
    model: Model,
    values: Mapping[str, float],
    curves: Sequence[Conditions],
    plan: Plan,
    progress: Callable[[float], None] | None = None,
) -> tuple[SweptCurve, ...]:
    """Run a pendulum over all frequencies, for all curves.

    Parameters
    ----------
    model : Model
        Of an inverted pendulum.
    values : mapping of str to float in SI units
        Of the model's parameters.
    curves : sequence of Conditions
    plan : Plan
    progress : callable, optional
        Called with the share that is done.
    """
    systems = [_system(model, values, curve.rig) for curve in curves]
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *systems)
    amplitudes = jnp.array([curve.amplitude for curve in curves])
    up = jnp.asarray(plan.frequencies)
    follow = partial(_follow, rate=plan.rate, size=plan.size, patience=plan.settle)
    jobs: list[Callable[[], Any]] = []
    for i in range(len(curves)):
        one = jax.tree.map(lambda leaf, i=i: leaf[i], (stacked, amplitudes))
        jobs += [partial(follow, *one, up), partial(follow, *one, up[::-1])]
    parts = _parts(stacked, amplitudes, up)
    rest_of = partial(_from_rest, rate=plan.rate, size=plan.size, patience=plan.settle)
    jobs += [partial(rest_of, systems, amplitudes, frequencies) for systems, amplitudes, frequencies in parts]
    results = _all(jobs, progress or (lambda share: None))
    followed, rested = results[: 2 * len(curves)], results[2 * len(curves) :]
    rest = jax.tree.map(lambda *rows: np.concatenate(rows), *rested)
    found = []
    for i, conditions in enumerate(curves):
        rows = slice(i * len(up), (i + 1) * len(up))
        states = {
            "rest": jax.tree.map(lambda leaf, rows=rows: leaf[rows], rest),
            "up": followed[2 * i],
            "down": jax.tree.map(lambda leaf: leaf[::-1], followed[2 * i + 1]),
        }
        branches = {name: _branch(states[name]) for name in BRANCHES}
        found.append(SweptCurve(conditions, plan.frequencies, natural_frequency(systems[i]), branches))
    return tuple(found)


def natural_frequency(system: InvertedPendulum) -> float:
    """Linear natural frequency about the upright position, in Hz; zero where that does not hold.

    Law
    ---
    ``ω² = (n k r² - m g l/2)/I``, lever ``r = a d/sqrt(a² + d²)``: with a preload both fibres pull, n = 2, and what it
    does to their direction is left out; without one, one of them at a time, n = 1.
    """
    lever = system.distance * system.height / jnp.hypot(system.distance, system.height)
    fibres = jnp.where(system.preload > 0.0, 2.0, 1.0)
    spring = fibres * system.fibre.stiffness * lever**2 - system.tipping
    return float(jnp.sqrt(jnp.maximum(spring, 0.0) / system.moment_of_inertia) / (2.0 * jnp.pi))


def _system(model: Model, values: Mapping[str, float], rig: Mapping[str, float]) -> InvertedPendulum:
    named = {name: jnp.asarray(float(value)) for name, value in values.items()}
    stated = {name: jnp.asarray(float(value)) for name, value in rig.items()}
    laws = model.laws(named)
    return model.rig.build(named, corrected_conditions(stated, named, laws), laws, model.tension_law)


def _parts(systems: Any, amplitudes: jax.Array, frequencies: jax.Array) -> list[Any]:
    """Runs from rest, curve after curve, in parts of equal length, some for each core."""
    size, number = len(frequencies), len(amplitudes)
    rows = np.arange(size * number)
    # The last part is filled up with the last run: parts of one length are one program.
    length = -(-len(rows) // min(PARTS * THREADS, len(rows)))
    parts = -(-len(rows) // length)
    padded = np.minimum(np.arange(length * parts), len(rows) - 1).reshape(parts, length)
    return [
        (
            jax.tree.map(lambda leaf, part=part: leaf[part // size], systems),
            amplitudes[part // size],
            frequencies[part % size],
        )
        for part in padded
    ]


def _all(jobs: Sequence[Callable[[], Any]], progress: Callable[[float], None]) -> list[Any]:
    """Results of all jobs, on all cores, in their order."""
    done = []
    with thread_pool(THREADS) as pool:
        for result in pool.map(lambda job: jax.tree.map(np.asarray, job()), jobs):
            done.append(result)
            progress(len(done) / len(jobs))
    return done


@eqx.filter_jit
def _from_rest(
    systems: InvertedPendulum, amplitudes: jax.Array, frequencies: jax.Array, rate: float, size: int, patience: float
) -> SteadyState:
    """Runs from rest, all in one batch; leaves ``(n_run, ...)`` in and out."""

    def one(system: InvertedPendulum, amplitude: jax.Array, frequency: jax.Array) -> SteadyState:
        drive = Drive.of(frequency, amplitude, rate, size)
        return steady_state(system, drive, *_rest(system, drive), jnp.asarray(patience))

    return jax.vmap(one)(systems, amplitudes, frequencies)


@eqx.filter_jit
def _follow(
    system: InvertedPendulum, amplitude: jax.Array, frequencies: jax.Array, rate: float, size: int, patience: float
) -> SteadyState:
    """Runs that go on from one another, from rest at the first; leaves ``(n_run, ...)`` out.

    A pendulum that has overturned is put upright before the next.
    """

    def one(carry: Any, frequency: jax.Array) -> Any:
        (state, mode), fallen = carry
        drive = Drive.of(frequency, amplitude, rate, size)
        begin = jax.tree.map(lambda new, old: jnp.where(fallen, new, old), _rest(system, drive), (state, mode))
        found = steady_state(system, drive, *begin, jnp.asarray(patience))
        return ((found.state, found.mode), found.overturned), found

    first = _rest(system, Drive.of(frequencies[0], amplitude, rate, size))
    return jax.lax.scan(one, (first, jnp.array(False)), frequencies)[1]


def _rest(system: InvertedPendulum, drive: Drive) -> tuple[Any, Any]:
    zero = jnp.zeros(())
    return system.begin(zero, zero, drive.at(jnp.int32(0), drive.times[0]))


def _branch(found: Any) -> Branch:
    fallen = found.overturned[:, None]
    return Branch(
        lowest=np.where(fallen, np.nan, found.lowest),
        highest=np.where(fallen, np.nan, found.highest),
        first_lowest=found.first_lowest,
        first_highest=found.first_highest,
        periods=found.periods,
        multiplier=found.multiplier,
        overturned=found.overturned,
        trouble=found.trouble,
        time=found.time,
    )
