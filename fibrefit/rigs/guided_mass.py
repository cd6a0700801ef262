"""A mass on a guide, driven by a measured force, let go once, or along a measured motion."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from fibrefit.core.declarations import Capability, Parameter
from fibrefit.laws.law import Effect, GuideLaw, fast, laws_of
from fibrefit.rigs.parts.bands import SpeedBands
from fibrefit.rigs.parts.guide import CREEPING, Guide, Sliding
from fibrefit.rigs.rig import Rig, Start, Values
from fibrefit.rigs.signals.motion import along_motion, with_place
from fibrefit.rigs.signals.rates import from_motion
from fibrefit.rigs.starting.guided_mass import starting_guided_mass


class GuidedMassState(NamedTuple):
    """Position [m] and velocity [m/s] of the mass; force [N] of the guide's bristles where the model has them."""

    position: jax.Array
    velocity: jax.Array
    bristle: jax.Array | None


class GuidedMassMode(NamedTuple):
    """Mode of the guide; band of speed, None in a model without one."""

    guide: jax.Array
    band: Any


class GuidedMass(eqx.Module):
    """Mass and guide as a switched system.

    Law
    ---
    ``M v' = gain F(t) - offset - guide``.

    Parameters
    ----------
    mass : () in kg
    gain : () a pure number
        Force on the mass per measured force.
    offset : () in N
        Constant force against the + direction.
    """

    mass: jax.Array
    gain: jax.Array
    offset: jax.Array
    guide: Guide

    def stiff(self) -> jax.Array | None:
        """Whether friction that sets in over a short distance is there now."""
        return fast(self.guide.laws)

    def derivative(self, state: GuidedMassState, mode: GuidedMassMode, inputs: Any) -> GuidedMassState:
        """Rate of the state."""
        now, drive = self._sliding(state, inputs)
        return GuidedMassState(
            self.guide.speed(mode.guide, state.velocity),
            self.guide.net_force(drive, mode.guide, now) / self.mass,
            self.guide.bristle_rate(mode.guide, now),
        )

    def margins(self, state: GuidedMassState, mode: GuidedMassMode, inputs: Any) -> GuidedMassMode:
        """Margins of each mode."""
        now, drive = self._sliding(state, inputs)
        bands = SpeedBands.of(self.guide.laws)
        band = None if bands is None else bands.margin(mode.band, state.velocity)
        return GuidedMassMode(self.guide.margin(drive, mode.guide, now), band)

    def switch(
        self, state: GuidedMassState, mode: GuidedMassMode, crossed: GuidedMassMode, inputs: Any
    ) -> tuple[GuidedMassState, GuidedMassMode]:
        """State and mode after the switches `crossed`."""
        velocity = self.guide.stop(mode.guide, crossed.guide, state.velocity)
        state = state._replace(velocity=velocity)
        if (bands := SpeedBands.of(self.guide.laws)) is not None:
            mode = mode._replace(band=bands.switch(mode.band, velocity, crossed.band))
        now, drive = self._sliding(state, inputs)
        return state, mode._replace(guide=self.guide.settle(drive, mode.guide, crossed.guide, now))

    def begin(self, position: jax.Array, velocity: jax.Array, inputs: Any) -> tuple[GuidedMassState, GuidedMassMode]:
        """State and mode of a mass at `position` [m] that moves with `velocity` [m/s]."""
        state = GuidedMassState(position, velocity, None)
        now, drive = self._sliding(state, inputs)
        resting = self.guide.bristle_at_rest(drive, now)
        if resting is not None:
            # Bristles under a mass that has slid for long are bent as far as they go.
            bent = jnp.sign(velocity) * self.guide.level(jnp.sign(velocity), velocity, now)
            state = state._replace(bristle=jnp.where(velocity == 0.0, resting, bent))
            now, drive = self._sliding(state, inputs)
        direction = jnp.sign(velocity).astype(jnp.int32)
        bands = SpeedBands.of(self.guide.laws)
        band = None if bands is None else bands.switch(jnp.int32(0), velocity, jnp.array(True))
        still = self.guide.settle(drive, jnp.int32(0), jnp.array(True), now)
        moving = jnp.where(jnp.abs(still) == CREEPING, CREEPING * direction, direction)
        return state, GuidedMassMode(jnp.where(velocity == 0.0, still, moving), band)

    def _sliding(self, state: GuidedMassState, inputs: Any) -> tuple[Sliding, jax.Array]:
        """What the guide feels, and the force on the mass besides the guide's, in N."""
        now = Sliding(state.position, state.velocity, jnp.zeros(()), state.bristle)
        pushed = self.gain * inputs["force"][0] if "force" in inputs else 0.0
        return now, pushed - self.offset


class FollowedMode(NamedTuple):
    """Nothing switches where the motion is known: its direction is that of the measured speed."""

    none: jax.Array


class FollowedMass(eqx.Module):
    """Mass and guide along a measured motion.

    Law
    ---
    ``gain F = M v' + offset + guide(u, v)`` (inverse dynamics).

    Parameters
    ----------
    moved : GuidedMass
        The mass and its guide, with what drives it left out.
    """

    moved: GuidedMass

    def stiff(self) -> jax.Array | None:
        """As the mass that is driven."""
        return self.moved.stiff()

    def derivative(self, state: GuidedMassState, mode: FollowedMode, inputs: Any) -> GuidedMassState:
        """Rate of the measured motion, and of the guide's bristles along it."""
        sliding = self._direction(state.velocity)
        return GuidedMassState(
            inputs["position"][1], inputs["speed"][1], self.moved.guide.bristle_rate(sliding, _now(state))
        )

    def margins(self, state: GuidedMassState, mode: FollowedMode, inputs: Any) -> FollowedMode:
        """Nothing to cross."""
        return FollowedMode(jnp.ones(()))

    def switch(
        self, state: GuidedMassState, mode: FollowedMode, crossed: FollowedMode, inputs: Any
    ) -> tuple[GuidedMassState, FollowedMode]:
        """Nothing changes."""
        return state, mode

    def begin(self, position: jax.Array, velocity: jax.Array) -> tuple[GuidedMassState, FollowedMode]:
        """State and mode at the first sample."""
        bristle = jnp.zeros(()) if self.moved.guide.may_creep else None
        return GuidedMassState(position, velocity, bristle), FollowedMode(jnp.int32(0))

    def force(self, state: GuidedMassState, inputs: Any) -> jax.Array:
        """Force that was to be measured, in N."""
        # What `net_force` leaves of no drive is the guide's own force.
        held = self.moved.guide.net_force(jnp.zeros(()), self._direction(state.velocity), _now(state))
        return (self.moved.mass * inputs["speed"][1] + self.moved.offset - held) / self.moved.gain

    def _direction(self, velocity: jax.Array) -> jax.Array:
        return self.moved.guide.sliding(jnp.sign(velocity).astype(jnp.int32))


def _now(state: GuidedMassState) -> Sliding:
    return Sliding(state.position, state.velocity, jnp.zeros(()), state.bristle)


PARAMETERS = (
    Parameter("mass", "kg", "moving mass", 50.0, lower=1e-3, upper=1e6, log=True),
    Parameter("friction", "N", "Coulomb friction of the guide", 10.0, lower=0.0, upper=1e5),
    Parameter("force_offset", "N", "constant force against the direction in which the position grows", 1.0),
)

ADDED = Parameter("added_mass", "kg", "mass added to the moving one", 0.0, lower=0.0)
CONDITIONS = (Parameter("gain", "-", "force on the mass per measured force", 1.0, lower=0.0), ADDED)
START = (
    Parameter("start_position", "m", "position at the first sample", 0.01),
    Parameter("start_speed", "m/s", "speed at the first sample", 0.1),
)


def _build(values: Values, conditions: Values, laws: tuple[Effect, ...], tension_law: str) -> GuidedMass:
    """System of one record."""
    guide = Guide(values["friction"], laws_of(GuideLaw, laws))
    mass = values["mass"] + conditions["added_mass"]
    return GuidedMass(mass, conditions.get("gain", jnp.ones(())), values["force_offset"], guide)


def _start(system: GuidedMass, values: Values, conditions: Values, inputs: Any) -> Start:
    """The mass is where it was measured at the first sample, and as fast."""
    position, velocity = inputs["anchor"]
    return Start(*system.begin(position, velocity, inputs))


def _observe(system: GuidedMass, state: GuidedMassState, mode: GuidedMassMode, inputs: Any) -> dict[str, jax.Array]:
    """Position in m."""
    return {"position": state.position}


def _start_at_speed(system: GuidedMass, values: Values, conditions: Values, inputs: Any) -> Start:
    """The mass is as fast as it was measured at the first sample, where the measured speed has taken it."""
    return Start(*system.begin(inputs["position"][0], inputs["anchor"][0], inputs))


def _observe_velocity(
    system: GuidedMass, state: GuidedMassState, mode: GuidedMassMode, inputs: Any
) -> dict[str, jax.Array]:
    """Velocity in m/s."""
    return {"velocity": state.velocity}


_DRIVEN = Rig(
    kind="guided_mass",
    parameters=PARAMETERS,
    nuisances=(),
    conditions=CONDITIONS,
    capabilities=frozenset({Capability.GUIDE, Capability.PUSH, Capability.PLACE}),
    channels=("position",),
    inputs=("force",),
    build=_build,
    start=_start,
    observe=_observe,
    starting=starting_guided_mass,
    planned=None,
    anchor="position",
)


BY_VELOCITY = replace(
    _DRIVEN,
    capabilities=frozenset({Capability.GUIDE, Capability.PUSH}),
    channels=("velocity",),
    inputs=("force", "position"),
    derived=("position",),
    start=_start_at_speed,
    observe=_observe_velocity,
    anchor="velocity",
    prepared=with_place,
)
"""The same where the velocity was measured: a place is known as far as that velocity leads to it from zero."""


def _let_go(system: GuidedMass, values: Values, conditions: Values, inputs: Any) -> Start:
    """The mass is somewhere, and moves by itself."""
    return Start(*system.begin(values["start_position"], values["start_speed"], inputs))


FREE_MASS = replace(
    _DRIVEN,
    nuisances=START,
    conditions=(ADDED,),
    capabilities=frozenset({Capability.GUIDE, Capability.PLACE}),
    inputs=(),
    start=_let_go,
    anchor=None,
    prepared=partial(from_motion, channel="position"),
    per_unit_of="mass",
)
"""The same where nothing drives it: followed from its start to its end."""


def _build_followed(values: Values, conditions: Values, laws: tuple[Effect, ...], tension_law: str) -> FollowedMass:
    return FollowedMass(_build(values, conditions, laws, tension_law))


def _start_followed(system: FollowedMass, values: Values, conditions: Values, inputs: Any) -> Start:
    return Start(*system.begin(inputs["position"][0], inputs["speed"][0]))


def _observe_force(
    system: FollowedMass, state: GuidedMassState, mode: FollowedMode, inputs: Any
) -> dict[str, jax.Array]:
    """Force in N."""
    return {"force": system.force(state, inputs)}


FOLLOWED_MASS = replace(
    _DRIVEN,
    capabilities=frozenset({Capability.GUIDE, Capability.PUSH}),
    channels=("force",),
    inputs=("position", "speed"),
    build=_build_followed,
    start=_start_followed,
    observe=_observe_force,
    anchor=None,
    derived=("speed",),
    prepared=along_motion,
)
"""The same where the motion was measured: the force that it asks for is what is explained (inverse dynamics)."""

FOLLOWED_BY_VELOCITY = replace(FOLLOWED_MASS, inputs=("velocity", "position", "speed"), derived=("position", "speed"))
"""The same along a measured velocity."""

GUIDED_MASS = replace(
    _DRIVEN,
    variants={
        "free": FREE_MASS,
        "followed": FOLLOWED_MASS,
        "by_velocity": BY_VELOCITY,
        "followed_by_velocity": FOLLOWED_BY_VELOCITY,
    },
)
