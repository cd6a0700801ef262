"""Multiple shooting: a motion that nothing brings back to its place, simulated in windows with states of their own.

A mass that a measured force drives drifts away from any small error of that force, and more the longer it is followed.
A record is therefore taken in windows. In each the mass begins where it was measured; what the measured start was wrong
by is unknown, free in each window, and eliminated in closed form.

Law
---
Reading ``r = p(θ, s) + S c``, S the derivative of the simulated positions p by the starting state s, c the best
coefficients for the measured positions. A further pass starts where those before it found that it should. On the way a
rough S will do; the last one is that of the motion itself, so that slopes by θ are those of the best readings.

Source
------
Bock, Recent advances in parameter identification techniques for ODE (1983); elimination of linear unknowns: Golub and
Pereyra, SIAM J. Numer. Anal. 10 (1973), in the simplification of Kaufman, BIT 15 (1975).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from fibrefit.laws.law import HISTORY_OF_MOTION, Effect, Moment, SensorLaw, laws_of
from fibrefit.rigs.rig import Start, Values
from fibrefit.simulation.inputs import Course, Signals, courses, inputs_at
from fibrefit.simulation.model import Experiment, Model, Response, corrected_conditions, pushed_by
from fibrefit.simulation.sensing import jumps_of
from fibrefit.simulation.sensitivity import solve
from fibrefit.simulation.switched import Grid, Solution, take

ROUGH, EXACT = 3, 2
"""Simulations of a window that look for its start, with a rough derivative and with that of the motion itself."""
Read = Callable[[jax.Array], jax.Array]
STARTS_FOUND = {"position": (1.0, 1.0), "velocity": (0.0, 1.0)}
"""Which of position and velocity at its start is found of a window, by what was measured: a velocity shows no place."""
LEAST = 1e-9
"""Share of the larger of its two directions below which a window does not determine a start."""


@dataclass(frozen=True)
class WindowedModel(Model):
    """A model of a rig with an `anchor`, simulated in windows.

    Parameters
    ----------
    window : int
        Samples of each.
    """

    window: int = 256

    @property
    def pieces(self) -> int:
        """Samples of each window."""
        return self.window

    def _simulate(self, values: Values, experiment: Experiment) -> Response:
        laws, size = self._in_record(values, experiment), experiment.times.shape[0]
        experiment = experiment._replace(inputs=pushed_by(laws, experiment.inputs, experiment.times))
        # Whole windows: samples of padding at the end.
        times, more = experiment.times, -size % self.window
        ahead = times[-1] + (times[-1] - times[-2]) * jnp.arange(1, more + 1)
        inputs = jax.tree.map(lambda rows: jnp.concatenate([rows, jnp.repeat(rows[-1], more)]), experiment.inputs)
        experiment = experiment._replace(times=jnp.concatenate([times, ahead]), inputs=inputs)
        cut = partial(jax.tree.map, lambda rows: rows.reshape(-1, self.window))
        times, inputs = cut(experiment.times), cut(experiment.inputs)
        counted = cut(jnp.arange(experiment.times.shape[0]) < experiment.count)
        begun = experiment.times[0]

        def window(times: jax.Array, inputs: dict[str, Signals], counted: jax.Array) -> tuple[jax.Array, Solution]:
            then = tuple(_meanwhile(law, times - begun) for law in laws)
            read = jax.tree_util.Partial(self._read, laws_of(SensorLaw, then), times)
            return self._window(self._system(values, then, experiment)[0], read, times, inputs, counted)

        readings, solution = jax.vmap(window)(times, inputs, counted)
        channels = {self._anchor: readings.reshape(-1)[:size]}
        first = take(solution, 0)
        driven = courses(take(inputs, 0), times[0])
        observe = partial(self.rig.observe, self._system(values, laws, experiment)[0])
        jumps = jumps_of(observe, lambda step, time: inputs_at(driven, times[0], step, time), first)
        # The motion of all windows as one; its list of arcs is that of the first.
        whole = partial(jax.tree.map, lambda rows: rows.reshape(-1)[:size])
        motion = first._replace(
            states=whole(solution.states),
            modes=whole(solution.modes),
            switches=solution.switches.sum(),
            trouble=solution.trouble.any(),
        )
        return Response(channels, motion, jumps)

    @property
    def _anchor(self) -> str:
        assert self.rig.anchor is not None, "a rig whose motion begins where it was measured"
        return self.rig.anchor

    def _read(self, sensors: tuple[SensorLaw, ...], times: jax.Array, moved: jax.Array) -> jax.Array:
        """What the sensors make of positions and velocities ``(2, n_time)``, each instant by itself."""
        channels = {self._anchor: moved[tuple(STARTS_FOUND).index(self._anchor)]}
        for sensor in sensors:
            channels = sensor.measure(channels, times)
        return channels[self._anchor]

    def _system(self, values: Values, laws: tuple[Effect, ...], experiment: Experiment) -> tuple[Any, Values]:
        """The system of one window, whose laws do not change while it lasts."""
        conditions = corrected_conditions(experiment.conditions, values, laws)
        return self.rig.build(values, conditions, laws, self.tension_law), conditions

    def _window(
        self, system: Any, read: Read, times: jax.Array, inputs: dict[str, Signals], counted: jax.Array
    ) -> tuple[jax.Array, Solution]:
        """Readings of one window, with the best start, and the motion behind them."""
        driven = courses(inputs, times)
        steps = jnp.minimum(jnp.arange(self.window), self.window - 2)
        here = jax.vmap(lambda step, time: inputs_at(driven, times, step, time))(steps, times)
        anchor = inputs["anchor"]

        # Position and velocity with which the window begins as it was measured.
        place = inputs["anchor" if self._anchor == "position" else "position"]
        measured = jnp.stack([place.values[0], place.slopes[0]])
        whole = _Window(system, read, driven, here, times, measured, jnp.array(STARTS_FOUND[self._anchor]))
        best, slopes = _without_tangents(_best_start, (whole, anchor, counted))
        solution = _followed(whole, best)
        readings = read(_moved(solution))
        return readings + slopes @ _coefficients(slopes, anchor.values - readings, counted), solution


class _Window(NamedTuple):
    """What the motion in a window follows from, but for what the measured start was wrong by."""

    system: Any
    read: Read
    driven: dict[str, Course]
    here: Any
    times: jax.Array
    begun: jax.Array
    found: jax.Array


def _moved(solution: Solution) -> jax.Array:
    """Positions and velocities, ``(2, n_time)``."""
    return jnp.stack([solution.states.position, solution.states.velocity])


def _followed(window: _Window, start: jax.Array) -> Solution:
    """Motion from a start ``(2,)``: position [m] and velocity [m/s]."""
    state, mode = window.system.begin(start[0], start[1], take(window.here, 0))
    times = window.times
    grid = Grid(times, jnp.int32(len(times)), window.driven)
    return solve(window.system, Start(state, mode, times[0]), grid)


def _best_start(given: tuple[_Window, Signals, jax.Array]) -> tuple[jax.Array, jax.Array]:
    """The start from which a window is best explained, and the derivative of its readings by it, ``(n_time, 2)``."""
    window, anchor, counted = given

    def nearer(start: jax.Array, readings: jax.Array, slopes: jax.Array) -> jax.Array:
        return start + _coefficients(slopes, anchor.values - readings, counted)

    def roughly(_: Any, start: jax.Array) -> jax.Array:
        solution = _followed(window, start)
        moved = _moved(solution)
        readings, steep = jax.jvp(window.read, (moved,), (jnp.ones_like(moved),))
        by_place, by_speed = _slopes(window.system, solution, window.here, window.times)
        slopes = jnp.where(window.found[0] > 0.0, by_place, by_speed)
        return nearer(start, readings, window.found * steep[:, None] * slopes)

    def exactly(_: Any, start: jax.Array) -> jax.Array:
        return nearer(start, *read(start))

    def read(start: jax.Array) -> tuple[jax.Array, jax.Array]:
        slopes, readings = jax.jacfwd(lambda start: (at(start),) * 2, has_aux=True)(start)
        return readings, window.found * slopes

    def at(start: jax.Array) -> jax.Array:
        return window.read(_moved(_followed(window, start)))

    best = jax.lax.fori_loop(0, ROUGH, roughly, window.begun)
    best = jax.lax.fori_loop(0, EXACT, exactly, best)
    return best, read(best)[1]


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _without_tangents(function: Callable[[Any], Any], given: Any) -> Any:
    """A function of values that are held, whether they are the rig's, its inputs' or a sensor's."""
    return function(given)


@_without_tangents.defjvp
def _no_tangents(function: Callable[[Any], Any], primals: tuple, tangents: tuple) -> tuple[Any, Any]:
    found = _without_tangents(function, *primals)
    return found, jax.tree.map(jnp.zeros_like, found)


def _meanwhile(law: Effect, times: jax.Array) -> Effect:
    """A law as it is on average while a window lasts."""
    if not law.timed:
        return law
    past = jnp.zeros(())
    if law.sudden:
        past = jnp.clip((times[-1] - law.instant) / (times[-1] - times[0]), 0.0, 1.0)  # type: ignore[attr-defined]
    history = dict.fromkeys(HISTORY_OF_MOTION, jnp.zeros(()))
    return law.as_of(Moment(0.5 * (times[0] + times[-1]), past, drive_speed=jnp.zeros(()), **history))


def _slopes(system: Any, solution: Solution, here: Any, times: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Derivatives of the positions and of the velocities by the starting position and velocity, ``(n_time, 2)`` each.

    Law
    ---
    ``(d u)' = d v, (d v)' = (∂a/∂u) d u + (∂a/∂v) d v``, in steps that kick, drift and kick again; a mass that turns
    round takes along the ratio of its accelerations, one that stops forgets.
    """

    def acceleration(state: Any, mode: Any, inputs: Any, position: jax.Array, velocity: jax.Array) -> jax.Array:
        return system.derivative(state._replace(position=position, velocity=velocity), mode, inputs).velocity

    def rates(state: Any, mode: Any, inputs: Any) -> tuple[jax.Array, jax.Array, jax.Array]:
        along, here = partial(acceleration, state, mode, inputs), (state.position, state.velocity)
        value, by_place = jax.jvp(along, here, (jnp.ones(()), jnp.zeros(())))
        return value, by_place, jax.jvp(along, here, (jnp.zeros(()), jnp.ones(())))[1]

    value, spring, slope = jax.vmap(rates)(solution.states, solution.modes, here)
    guide = solution.modes.guide
    ratio = jnp.where(value[:-1] == 0.0, 0.0, value[1:] / jnp.where(value[:-1] == 0.0, 1.0, value[:-1]))
    turned = jnp.where(guide[1:] == 0, 0.0, jnp.clip(ratio, 0.0, 1.0))
    step = times[1:] - times[:-1]
    kept = jnp.where(guide[1:] == guide[:-1], jnp.exp(0.5 * step * (slope[1:] + slope[:-1])), turned)
    kept = jnp.where(guide[:-1] == 0, 0.0, kept)
    sliding = (guide[1:] == guide[:-1]) & (guide[:-1] != 0)
    kick = jnp.where(sliding, 0.25 * step * (spring[1:] + spring[:-1]), 0.0)
    drift = 0.5 * step * (1.0 + kept)
    # Rows of the matrix that takes (d u, d v) over one step.
    steps = (1.0 + drift * kick, drift, kept * kick + kick * (1.0 + drift * kick), kept + kick * drift)
    a, b, c, d = jax.lax.associative_scan(_after, steps)
    first = jnp.eye(2)
    by_place, by_speed = (
        jnp.concatenate([first[i : i + 1], jnp.stack(row, axis=1)]) for i, row in enumerate(((a, b), (c, d)))
    )
    return by_place, by_speed


def _after(first: tuple[jax.Array, ...], second: tuple[jax.Array, ...]) -> tuple[jax.Array, ...]:
    """Product of 2 x 2 matrices ``second @ first``, by their elements, row after row."""
    a, b, c, d = first
    e, f, g, h = second
    return e * a + f * c, e * b + f * d, g * a + h * c, g * b + h * d


def _coefficients(slopes: jax.Array, residual: jax.Array, counted: jax.Array) -> jax.Array:
    """Least-squares coefficients ``(2,)`` of the columns `slopes` ``(n_time, 2)``; zero where not determined."""
    columns = jnp.where(counted[:, None], slopes, 0.0)
    size = jnp.sqrt(jnp.sum(columns**2, axis=0))
    sound = size > 0.0
    columns = columns / jnp.where(sound, size, 1.0)
    first, second = columns.T
    # A window at rest does not determine the velocity it began with.
    second = second - first * (first @ second)
    norm = second @ second
    determined = norm > LEAST
    aim = jnp.where(counted, residual, 0.0)
    b = jnp.where(determined, (second @ aim) / jnp.where(determined, norm, 1.0), 0.0)
    a = first @ (aim - b * columns[:, 1])
    return jnp.stack([a, b]) / jnp.where(sound, size, 1.0)
