"""A model: a rig, its tension law and the effects added to it; and the readings it predicts for a record.

Laws may change while the rig moves: with time, at an instant, with the path travelled; and it may carry something
along. The rig itself knows nothing of this. At every instant its system is built with the laws as they are then; the
instants are switches like any other, so that no step runs across one, and their derivatives are exact.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from fibrefit.core.declarations import FORCES, ByInverse, Parameter
from fibrefit.laws.law import (
    HISTORY_OF_MOTION,
    DriveLaw,
    Effect,
    GuideLaw,
    Moment,
    RigLaw,
    SensorLaw,
    StudyLaw,
    extends,
    laws_of,
    loading,
    resting,
)
from fibrefit.laws.pushes import PushLaw
from fibrefit.rigs.rig import Rig, Start, Values
from fibrefit.simulation.inputs import Course, Signals, courses, inputs_at
from fibrefit.simulation.sensing import Jumps, Sides, behind, chain_of, jumps_of, pieces_of
from fibrefit.simulation.sensitivity import solve
from fibrefit.simulation.switched import Grid, Solution

CLOCK = "clock"
"""Name of the input that tells the time."""


class Passenger(NamedTuple):
    """A part that hangs on the weight: place [m] beside where it hangs at rest, and speed [m/s]."""

    position: jax.Array
    velocity: jax.Array


class ExtendedState(NamedTuple):
    """State of the rig; of what hangs on its weight; what has come together that laws ask for, as in a `Moment`."""

    inner: Any
    passengers: tuple[Passenger, ...]
    history: dict[str, jax.Array]


class ExtendedMode(NamedTuple):
    """Mode of the rig, and for each sudden law whether its instant is over."""

    inner: Any
    past: tuple[jax.Array, ...]


class _Pull(GuideLaw):
    """What hangs on the weight pulls at it, in N."""

    pull: jax.Array

    def force(self, position: jax.Array, velocity: jax.Array) -> jax.Array:
        return -self.pull


def is_extended(laws: tuple[Effect, ...]) -> bool:
    """Whether some laws are more than a rig by itself can follow."""
    return any(extends(type(law)) for law in laws)


class Extended(eqx.Module):
    """A rig's system with laws that change while it moves.

    Parameters
    ----------
    values, conditions : mapping of str to () in SI units
    laws : tuple of Effect
        As they are in the record.
    """

    rig: Rig = eqx.field(static=True)
    tension_law: str = eqx.field(static=True)
    values: dict[str, Any]
    conditions: dict[str, Any]
    laws: tuple[Effect, ...]

    def stiff(self) -> jax.Array | None:
        """Whether rates occur that are fast against a step."""
        plain = self.rig.build(self.values, self.conditions, self.laws, self.tension_law)
        known: jax.Array | None = plain.stiff()
        return known

    def derivative(self, state: ExtendedState, mode: ExtendedMode, inputs: Any) -> ExtendedState:
        """Rate of the state, by the clock of the record."""
        system, felt = self._system(state, mode.past, inputs), self._felt(inputs)
        moved = system.derivative(state.inner, mode.inner, felt)
        parts = []
        for law, part in zip(self._carrying, state.passengers, strict=True):
            _, omega, ratio = law.loose()
            swing = omega * (part.position - state.inner.position)
            pull = omega * (swing + 2.0 * ratio * (part.velocity - moved.position))
            parts.append(Passenger(part.velocity, -pull))
        # A pendulum turns: no law of its ports asks for a way that it has gone.
        speed, further = jnp.abs(getattr(moved, "position", jnp.zeros(()))), {}
        if "path" in state.history:
            further["path"] = speed
        if "rest" in state.history:
            further["rest"] = resting(state.history["rest"], speed)
        if "cycles" in state.history:
            assert self.rig.fibres is not None, "a rig with a fibre"
            further["cycles"] = loading(*self.rig.fibres(system, state.inner, mode.inner, felt)[0])
        pace = self.pace()
        return jax.tree.map(lambda rate: pace * rate, ExtendedState(moved, tuple(parts), further))

    def margins(self, state: ExtendedState, mode: ExtendedMode, inputs: Any) -> ExtendedMode:
        """Margins of each mode; of an instant the time to it, in s."""
        inner = self._system(state, mode.past, inputs).margins(state.inner, mode.inner, self._felt(inputs))
        now = inputs[CLOCK][0]
        ahead = [
            jnp.where(law.absent() | (past > 0), 1.0, law.instant - now)
            for law, past in zip(self._sudden, mode.past, strict=True)
        ]
        return ExtendedMode(inner, tuple(ahead))

    def switch(
        self, state: ExtendedState, mode: ExtendedMode, crossed: ExtendedMode, inputs: Any
    ) -> tuple[ExtendedState, ExtendedMode]:
        """State and mode after the switches `crossed`."""
        past = tuple(
            jnp.where(over, 1, old).astype(old.dtype) for over, old in zip(crossed.past, mode.past, strict=True)
        )
        system, felt = self._system(state, past, inputs), self._felt(inputs)
        changed = jnp.any(jnp.stack(crossed.past)) if crossed.past else jnp.array(False)
        margins = system.margins(state.inner, mode.inner, felt)
        # A law that changes at once may leave a mode that does not hold any more.
        both = jax.tree.map(lambda old, margin: old | (changed & (margin < 0.0)), crossed.inner, margins)
        inner, after = system.switch(state.inner, mode.inner, both, felt)
        return state._replace(inner=inner), ExtendedMode(after, past)

    def start(self, values: Values, inputs: Any) -> Start:
        """Where the record begins to move, see `Rig`."""
        now = inputs[CLOCK][0]
        past = tuple((law.instant <= now).astype(jnp.int32) for law in self._sudden)
        # Nothing hangs askew before the motion begins.
        begun = self.rig.start(self._with(self._laws(past, inputs, {})), values, self.conditions, self._felt(inputs))
        at = now if begun.time is None else begun.time
        past = tuple((law.instant <= at).astype(jnp.int32) for law in self._sudden)
        parts = tuple(Passenger(begun.state.position, begun.state.velocity) for _ in self._carrying)
        asked = {name: jnp.zeros(()) for law in self.laws for name in law.history}
        return Start(ExtendedState(begun.state, parts, asked), ExtendedMode(begun.mode, past), begun.time)

    def observe(self, state: ExtendedState, mode: ExtendedMode, inputs: Any) -> dict[str, jax.Array]:
        """True value of each channel."""
        return self.rig.observe(self._system(state, mode.past, inputs), state.inner, mode.inner, self._felt(inputs))

    def fibres(self, state: Any, mode: Any, inputs: Any) -> tuple:
        """Stretch and rate of each fibre, of a motion given by the rig's own states and modes."""
        assert self.rig.fibres is not None, "a rig with a fibre"
        zero, now = jnp.zeros(()), inputs[CLOCK][0]
        whole = ExtendedState(state, tuple(Passenger(state.position, zero) for _ in self._carrying), {})
        past = tuple((law.instant <= now).astype(jnp.int32) for law in self._sudden)
        return self.rig.fibres(self._system(whole, past, inputs), state, mode, self._felt(inputs))

    @property
    def _sudden(self) -> tuple[Any, ...]:
        return tuple(law for law in self.laws if law.sudden)

    @property
    def _carrying(self) -> tuple[GuideLaw, ...]:
        return tuple(law for law in laws_of(GuideLaw, self.laws) if law.carries)

    def pace(self) -> jax.Array:
        """True time over that of the record."""
        pace = jnp.ones(())
        for law in laws_of(StudyLaw, self.laws):
            pace = pace * law.pace()
        return pace

    def _felt(self, inputs: Any) -> Any:
        """Inputs of the rig, their rates by true time."""
        pace = self.pace()
        return {name: (value, rate / pace) for name, (value, rate) in inputs.items() if name != CLOCK}

    def _laws(self, past: tuple[jax.Array, ...], inputs: Any, known: Mapping[str, Any]) -> tuple[Effect, ...]:
        """The laws as they are now."""
        now, over = inputs[CLOCK][0], iter(past)
        history = {name: known.get(name, jnp.zeros(())) for name in HISTORY_OF_MOTION}
        drive_speed = jnp.abs(self._felt(inputs)["drive"][1]) if "drive" in inputs else jnp.zeros(())
        laws = []
        for law in self.laws:
            share = jnp.zeros(())
            if law.sudden:
                # At the null nothing is switched, and the slope is that of a law that is there all the same.
                instant = law.instant  # type: ignore[attr-defined]
                share = jnp.where(law.absent(), (instant <= now).astype(float), next(over).astype(float))
            laws.append(law.as_of(Moment(now, share, drive_speed=drive_speed, **history)) if law.timed else law)
        return tuple(laws)

    def _with(self, laws: tuple[Effect, ...]) -> Any:
        return self.rig.build(self.values, self.conditions, laws, self.tension_law)

    def _system(self, state: ExtendedState, past: tuple[jax.Array, ...], inputs: Any) -> Any:
        """The rig's system as it is now, with the pull of what hangs on its weight."""
        system = self._with(self._laws(past, inputs, state.history))
        for law, part in zip(self._carrying, state.passengers, strict=True):
            share, omega, ratio = law.loose()
            swing = omega * (part.position - state.inner.position)
            swing = omega * (swing + 2.0 * ratio * (part.velocity - state.inner.velocity))
            guide = replace(system.guide, laws=(*system.guide.laws, _Pull(share * system.mass * swing)))
            system = replace(system, guide=guide, mass=(1.0 - share) * system.mass)
        return system


def bare(solution: Any) -> Any:
    """A motion with the states and modes of the rig alone."""
    arcs = solution.arcs
    arcs = arcs._replace(state=arcs.state.inner, reached=arcs.reached.inner, mode=arcs.mode.inner)
    return solution._replace(states=solution.states.inner, modes=solution.modes.inner, arcs=arcs)


class Experiment(NamedTuple):
    """Conditions and clock of one record, as arrays.

    Parameters
    ----------
    times : (n_time,) in s
        Increasing; padded at the end if need be.
    count : () int
        Number of samples before the padding.
    conditions : dict of () in SI units
        The rig's `conditions`.
    inputs : dict of Signals
        The rig's `inputs`.
    duration : () in s, optional
        Of the whole record, which may be followed less far; how far it is followed unless said.
    """

    times: jax.Array
    count: jax.Array  # type: ignore[assignment]
    conditions: dict[str, jax.Array]
    inputs: dict[str, Any]
    duration: jax.Array | None = None


class Response(NamedTuple):
    """Simulated response of a model to the conditions of a record.

    Parameters
    ----------
    channels : dict of (n_time,) in SI units
        Readings.
    solution : Solution
        The motion behind them.
    jumps : Jumps
        Of the readings.
    """

    channels: dict[str, jax.Array]
    solution: Solution
    jumps: Jumps


@dataclass(frozen=True)
class Model:
    """A rig with effects; hashable, holds no values.

    Parameters
    ----------
    effects : tuple of Effect classes
    tension_law : {"clamped", "heaviside"}
    """

    rig: Rig
    effects: tuple[type[Effect], ...] = ()
    tension_law: str = "clamped"

    @property
    def pieces(self) -> int | None:
        """Samples of each stretch that begins with a state of its own; None where a record is followed to its end."""
        return None

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The base model's parameters, then those of the effects under their dotted names."""
        return self.rig.parameters + tuple(
            dotted_parameter(effect, parameter) for effect in self.effects for parameter in effect.parameters
        )

    def laws(self, values: Values) -> tuple[Effect, ...]:
        """The effects with their values."""
        return tuple(
            effect(**{parameter.name: values[f"{effect.name}.{parameter.name}"] for parameter in effect.parameters})
            for effect in self.effects
        )

    def respond(self, values: Values, experiment: Experiment) -> Response:
        """Simulate one record.

        Parameters
        ----------
        values : dict of () in SI units
            Each of `parameters` and of the rig's nuisances.

        Returns
        -------
        Response
            Differentiable in forward mode.
        """
        if not any(effect.singular for effect in self.effects):
            return self._simulate(values, experiment)
        # Singular effects at their null have no tangents here: `_with_slopes` has these, and all of them.
        held = dict(values)
        for law, name, _ in _singular(self, values):
            keep = partial(jnp.where, law.absent())
            held[name] = jax.tree.map(lambda v, keep=keep: keep(jax.lax.stop_gradient(v), v), values[name])
        response = self._simulate(held, experiment)
        return response._replace(channels=_with_slopes(self, values, experiment, response.channels))

    def stretched(
        self, values: Values, experiment: Experiment, solution: Solution
    ) -> tuple[tuple[jax.Array, jax.Array], ...]:
        """Stretch [m] and its rate [m/s] ``(n_time,)`` of each fibre of a simulated record; none without one."""
        if (fibres := self.rig.fibres) is None:
            return ()
        system, _ = self._system(values, self._in_record(values, experiment), experiment)
        here = _at_samples(self._driven(self._in_record(values, experiment), experiment), experiment.times)
        if isinstance(system, Extended):
            return jax.vmap(system.fibres)(solution.states, solution.modes, here)
        return jax.vmap(partial(fibres, system))(solution.states, solution.modes, here)

    def _in_record(self, values: Values, experiment: Experiment) -> tuple[Effect, ...]:
        """The effects as they are in one record."""
        number = experiment.conditions.get(ORDER, jnp.ones(()))
        followed = experiment.times[experiment.count - 1] - experiment.times[0]
        duration = followed if experiment.duration is None else experiment.duration
        return tuple(law.in_record(number, duration) for law in self.laws(values))

    def _system(self, values: Values, laws: tuple[Effect, ...], experiment: Experiment) -> tuple[Any, Values]:
        """The system that moves, and the conditions of its record."""
        conditions = corrected_conditions(experiment.conditions, values, laws)
        if is_extended(laws):
            of_rig = {p.name: values[p.name] for p in self.rig.parameters}
            return Extended(self.rig, self.tension_law, of_rig, dict(conditions), laws), conditions
        return self.rig.build(values, conditions, laws, self.tension_law), conditions

    def _driven(self, laws: tuple[Effect, ...], experiment: Experiment) -> dict[str, Course]:
        """Inputs as they reach the rig."""
        inputs, times = dict(experiment.inputs), experiment.times
        for law in (law for law in laws_of(DriveLaw, laws) if law.remembers):
            inputs["drive"] = Signals(*law.passed_on(*inputs["drive"]))
        inputs = pushed_by(laws, inputs, times)
        clock = {CLOCK: Signals(times - times[0], jnp.ones_like(times))} if is_extended(laws) else {}
        return courses(inputs | clock, times)

    def _simulate(self, values: Values, experiment: Experiment) -> Response:
        """The response, without tangents of effects that are singular at their null."""
        laws = self._in_record(values, experiment)
        times, count = experiment.times, experiment.count
        inputs = self._driven(laws, experiment)
        system, conditions = self._system(values, laws, experiment)
        first = inputs_at(inputs, times, jnp.int32(0), times[0])
        extended = isinstance(system, Extended)
        start = system.start(values, first) if extended else self.rig.start(system, values, conditions, first)
        begin = start._replace(time=times[0] if start.time is None else start.time)
        solution = solve(system, begin, Grid(times, count, inputs))

        sensors = laws_of(SensorLaw, laws)
        feels = any(sensor.feels for sensor in sensors)

        def observe(state: Any, mode: Any, here: Any) -> dict[str, jax.Array]:
            channels = _observe(self.rig, system, state, mode, here)
            if not feels:
                return channels
            rates = system.derivative(state, mode, here)
            # By true time, as the gauge feels it, whatever the clock of the record says.
            felt = rates.inner.velocity / system.pace() if extended else rates.velocity
            return channels | {FELT: felt}

        here, chain = _at_samples(inputs, times), chain_of(laws)
        channels = jax.vmap(observe)(solution.states, solution.modes, here)
        sensed = partial(_both_sides, sensors, None if chain is None else chain.at_once(times[1] - times[0]))
        jumps = jumps_of(observe, lambda step, time: inputs_at(inputs, times, step, time), solution, sensed)
        if chain is not None:
            jumps = jumps._replace(instants=jumps.instants + chain.late_by)
            for role in [role for role in channels if role in FORCES]:
                motion = (system, times, count, inputs, solution)
                channels[role] = _through_sensor(self, role, chain.zero, channels[role], (motion, *chain[:2]))
        channels = commanded(laws, channels, times, count) if "force" not in inputs else channels
        channels = _measured(sensors, channels, times)
        zeros = {role: values[f"{role}_zero"] for role in channels if f"{role}_zero" in values}
        channels |= {role: channels[role] + zero for role, zero in zeros.items()}
        return Response(channels, bare(solution) if extended else solution, jumps)


FELT = "acceleration"
"""What sensors may feel besides the readings."""
ORDER = "order"
"""Condition that tells the place of a record in its series, from 1."""


def pushed_by(laws: tuple[Effect, ...], inputs: dict[str, Signals], times: jax.Array) -> dict[str, Signals]:
    """Inputs with a measured force as it reaches the mass.

    Parameters
    ----------
    times : (n_time,) in s
    """
    for law in laws_of(PushLaw, laws) if "force" in inputs else ():
        inputs = inputs | {"force": Signals(*law.applied(*inputs["force"], times))}
    return inputs


def commanded(
    laws: tuple[Effect, ...], channels: dict[str, jax.Array], times: jax.Array, count: jax.Array
) -> dict[str, jax.Array]:
    """Readings with the force on the mass as it has to be measured, the last law undone first.

    Such laws look ahead: beyond the `count` samples of the record, where nothing is simulated, the force stays.
    """
    pushes = laws_of(PushLaw, laws)
    if pushes:
        force = channels["force"]
        channels = channels | {"force": jnp.where(jnp.arange(force.size) < count, force, force[count - 1])}
    for law in reversed(pushes):
        channels = channels | {"force": law.commanded(channels["force"], times)}
    return channels


def corrected_conditions(stated: Values, values: Values, laws: tuple[Effect, ...]) -> Values:
    """Conditions that are stated, as the laws know them."""
    # A condition that no one knows is a value like any other, and is found.
    conditions = {name: values.get(name, said) for name, said in stated.items()}
    for law in laws_of(RigLaw, laws):
        conditions = law.correct(conditions)
    return conditions


def _observe(rig: Rig, system: Any, state: Any, mode: Any, here: Any) -> dict[str, jax.Array]:
    """True value of each channel at one instant."""
    if isinstance(system, Extended):
        return system.observe(state, mode, here)
    return rig.observe(system, state, mode, here)


def _measured(sensors: tuple[SensorLaw, ...], channels: dict[str, jax.Array], times: jax.Array) -> dict[str, jax.Array]:
    """Readings at `times`, in s."""
    for sensor in sensors:
        channels = sensor.measure(channels, times)
    return {role: reading for role, reading in channels.items() if role != FELT}


def _both_sides(sensors: tuple[SensorLaw, ...], at_once: jax.Array | None, sides: Sides, times: jax.Array) -> Sides:
    """Readings before and after jumps; of a force behind a slow gauge, as much later as comes through within a step."""
    before, after = sides
    if at_once is not None:
        passed = {role: before[role] + at_once * (after[role] - before[role]) for role in after if role in FORCES}
        after = after | passed
    return _measured(sensors, before, times), _measured(sensors, after, times)


def _at_samples(inputs: dict[str, Course], times: jax.Array) -> dict[str, Any]:
    """Value and rate of each input at every sample."""
    steps = jnp.minimum(jnp.arange(times.shape[0]), times.shape[0] - 2)
    return jax.vmap(lambda step, time: inputs_at(inputs, times, step, time))(steps, times)


def _singular(model: Model, values: Values) -> Iterator[tuple[Effect, str, Parameter]]:
    """Singular laws, name and declaration of the strength of each; without those at a null that has no tangents."""
    for law in (law for law in model.laws(values) if law.singular):
        (declared,) = (parameter for parameter in law.parameters if parameter.name in law.strength)
        name = f"{law.name}.{declared.name}"
        if not declared.reciprocal or isinstance(values[name], ByInverse):
            yield law, name, declared


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _with_slopes(model: Model, values: Values, experiment: Experiment, channels: dict[str, jax.Array]) -> Any:
    """Channels as they are. Where a singular effect is at its null, their derivative is that of a small strength.

    At the null such an effect is absent, down to the kind of the equations, and a derivative would say nothing of it.
    """
    return channels


@_with_slopes.defjvp
def _with_slopes_jvp(model: Model, primals: tuple, tangents: tuple) -> tuple[Any, Any]:
    values, experiment, channels = primals
    d_values, _, d_channels = tangents
    for law, name, declared in _singular(model, values):
        size = law.singular / declared.typical if declared.reciprocal else law.singular * declared.typical

        def slope(name: str = name, declared: Parameter = declared, size: float = size) -> Any:
            strength = ByInverse(jnp.asarray(size)) if declared.reciprocal else jnp.asarray(declared.null + size)
            there = model._simulate({**values, name: strength}, experiment).channels
            return jax.tree.map(lambda one, none: (one - none) / size, there, channels)

        zeros = partial(jax.tree.map, jnp.zeros_like, channels)
        slopes = jax.lax.cond(law.absent(), slope, zeros)
        (along,) = jax.tree.leaves(d_values[name])
        d_channels = jax.tree.map(lambda d, s, along=along: d + s * along, d_channels, slopes)
    return channels, d_channels


@partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def _through_sensor(model: Model, role: str, zero: jax.Array, plain: jax.Array, given: tuple) -> jax.Array:
    """A channel behind the dynamics of its sensor; where those are `zero`, the `plain` one, to the last bit.

    The derivative is that of the dynamics all the same.
    """
    return jax.lax.cond(zero, lambda: plain, lambda: _behind(model, role, given))


@_through_sensor.defjvp
def _through_sensor_jvp(model: Model, role: str, primals: tuple, tangents: tuple) -> tuple[jax.Array, jax.Array]:
    moved = jax.jvp(partial(_behind, model, role), primals[2:], tangents[2:])[1]
    return _through_sensor(model, role, *primals), moved


def _behind(model: Model, role: str, given: tuple) -> jax.Array:
    (system, times, *motion), lags, late_by = given

    def felt(state: Any, mode: Any, here: Any) -> jax.Array:
        return _observe(model.rig, system, state, mode, here)[role]

    return behind(pieces_of(felt, system, times, *motion), lags, late_by, times)


def dotted_parameter(effect: type[Effect], parameter: Parameter) -> Parameter:
    """Declaration of an effect's parameter under the name it bears in a model."""
    return replace(parameter, name=f"{effect.name}.{parameter.name}")
