"""Multiple shooting: a motion that nothing brings back to its place, simulated in windows with states of their own.

A mass that a measured force drives drifts away from any small error of that force, and more the longer it is followed.
A record is therefore taken in windows. In each the mass begins where it was measured; what the measured start was wrong
by is unknown, free in each window, and eliminated in closed form.

Law
---
Reading ``r = p(θ, s) + S c``, S the derivative of the simulated positions p by the starting state s, c the best
coefficients for the measured positions. A further pass starts where those before it found that it should.

Source
------
Bock, Recent advances in parameter identification techniques for ODE (1983); elimination of linear unknowns: Golub and
Pereyra, SIAM J. Numer. Anal. 10 (1973), in the simplification of Kaufman, BIT 15 (1975).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp

from fibrefit.effects.law import Effect, Moment, SensorLaw, laws_of
from fibrefit.rigs.rig import Values
from fibrefit.simulation.inputs import Signals, courses, inputs_at
from fibrefit.simulation.jumps import jumps_of
from fibrefit.simulation.model import Experiment, Model, Response, known_conditions, pushed_by
from fibrefit.simulation.sensitivity import solve
from fibrefit.simulation.switched import Solution, take

PASSES = 6
"""Simulations of a window: the last one starts where those before it found that it should."""
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
        experiment = _lengthened(experiment, -size % self.window)
        cut = partial(jax.tree.map, lambda rows: rows.reshape(-1, self.window))
        times, inputs = cut(experiment.times), cut(experiment.inputs)
        counted = cut(jnp.arange(experiment.times.shape[0]) < experiment.count)
        begun = experiment.times[0]

        def window(times: jax.Array, inputs: dict[str, Signals], counted: jax.Array) -> tuple[jax.Array, Solution]:
            then = tuple(_meanwhile(law, times - begun) for law in laws)
            return self._window(self._system(values, then, experiment)[0], times, inputs, counted)

        position, solution = jax.vmap(window)(times, inputs, counted)
        assert self.rig.anchor is not None, "a rig whose motion begins where it was measured"
        channels = {self.rig.anchor: position.reshape(-1)[:size]}
        for sensor in laws_of(SensorLaw, laws):
            channels = sensor.measure(channels, experiment.times)
        first = take(solution, 0)
        driven = courses(take(inputs, 0), times[0])
        observe = partial(self.rig.observe, self._system(values, laws, experiment)[0])
        jumps = jumps_of(observe, lambda step, time: inputs_at(driven, times[0], step, time), first)
        return Response(channels, _joined(solution, first, size), jumps)

    def _system(self, values: Values, laws: tuple[Effect, ...], experiment: Experiment) -> tuple[Any, Values]:
        """The system of one window, whose laws do not change while it lasts."""
        conditions = known_conditions(values, laws, experiment)
        return self.rig.build(values, conditions, laws, self.tension_law), conditions

    def _window(
        self, system: Any, times: jax.Array, inputs: dict[str, Signals], counted: jax.Array
    ) -> tuple[jax.Array, Solution]:
        """Positions of one window, with the best start, and the motion behind them."""
        driven = courses(inputs, times)
        steps = jnp.minimum(jnp.arange(self.window), self.window - 2)
        here = jax.vmap(lambda step, time: inputs_at(driven, times, step, time))(steps, times)
        anchor = inputs["anchor"]

        def follow(system: Any, start: jax.Array) -> Solution:
            state, mode = system.begin(start[0], start[1], take(here, 0))
            return solve(system, state, times[0], mode, times, jnp.int32(self.window), driven)

        def lacking(solution: Solution, slopes: jax.Array) -> jax.Array:
            return _coefficients(slopes, anchor.values - solution.states.position, counted)

        known = jax.lax.stop_gradient(system)

        def better(_: Any, start: jax.Array) -> jax.Array:
            solution = follow(known, start)
            return start + lacking(solution, _slopes(known, solution, here, times))

        best = jax.lax.fori_loop(0, PASSES - 1, better, jnp.stack([anchor.values[0], anchor.slopes[0]]))
        solution = follow(system, best)
        slopes = jax.lax.stop_gradient(_slopes(known, solution, here, times))
        return solution.states.position + slopes @ lacking(solution, slopes), solution


def _meanwhile(law: Effect, times: jax.Array) -> Effect:
    """A law as it is on average while a window lasts."""
    if not law.timed:
        return law
    past = jnp.zeros(())
    if law.sudden:
        past = jnp.clip((times[-1] - law.instant) / (times[-1] - times[0]), 0.0, 1.0)  # type: ignore[attr-defined]
    return law.as_of(Moment(0.5 * (times[0] + times[-1]), past, jnp.zeros(())))


def _slopes(system: Any, solution: Solution, here: Any, times: jax.Array) -> jax.Array:
    """Derivative of the positions by the starting position and velocity, ``(n_time, 2)``.

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
    a, b, _, _ = jax.lax.associative_scan(_after, steps)
    first = jnp.array([[1.0, 0.0]])
    return jnp.concatenate([first, jnp.stack([a, b], axis=1)])


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


def _lengthened(experiment: Experiment, more: int) -> Experiment:
    """The experiment with `more` samples of padding at its end."""
    times = experiment.times
    ahead = times[-1] + (times[-1] - times[-2]) * jnp.arange(1, more + 1)
    inputs = jax.tree.map(lambda rows: jnp.concatenate([rows, jnp.repeat(rows[-1], more)]), experiment.inputs)
    return experiment._replace(times=jnp.concatenate([times, ahead]), inputs=inputs)


def _joined(solution: Solution, first: Solution, size: int) -> Solution:
    """The motion of all windows as one, ``(size, ...)``; its list of arcs is that of the first."""
    whole = partial(jax.tree.map, lambda rows: rows.reshape(-1)[:size])
    return first._replace(
        states=whole(solution.states),
        modes=whole(solution.modes),
        switches=solution.switches.sum(),
        trouble=solution.trouble.any(),
    )
