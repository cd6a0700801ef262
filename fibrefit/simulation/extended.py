"""A rig whose laws change while it moves: with time, at an instant, with the path travelled; and what it carries along.

The rig itself knows nothing of this. At every instant its system is built with the laws as they are then; the instants
are switches like any other, so that no step runs across one, and their derivatives are exact.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from fibrefit.laws.law import HISTORY_OF_MOTION, Effect, GuideLaw, Moment, StudyLaw, extends, laws_of, loading, resting
from fibrefit.rigs.rig import Rig, Start, Values
from fibrefit.simulation.inputs import Signals

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


def with_clock(inputs: dict[str, Signals], times: jax.Array) -> dict[str, Signals]:
    """Inputs and the time since the first sample."""
    return inputs | {CLOCK: Signals(times - times[0], jnp.ones_like(times))}


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

    @classmethod
    def of(cls, rig: Rig, tension_law: str, values: Values, known: Mapping[str, Any], laws: Any) -> Extended:
        """The same from all values of a record."""
        return cls(rig, tension_law, {p.name: values[p.name] for p in rig.parameters}, dict(known), tuple(laws))

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

    def fibres(self, state: ExtendedState, mode: ExtendedMode, inputs: Any) -> tuple:
        """Stretch and rate of each fibre."""
        assert self.rig.fibres is not None, "a rig with a fibre"
        return self.rig.fibres(self._system(state, mode.past, inputs), state.inner, mode.inner, self._felt(inputs))

    def fibres_then(self, state: Any, mode: Any, inputs: Any) -> tuple:
        """As `fibres`, of a motion given by the rig's own states and modes."""
        zero, now = jnp.zeros(()), inputs[CLOCK][0]
        whole = ExtendedState(state, tuple(Passenger(state.position, zero) for _ in self._carrying), {})
        past = tuple((law.instant <= now).astype(jnp.int32) for law in self._sudden)
        return self.fibres(whole, ExtendedMode(mode, past), inputs)

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
