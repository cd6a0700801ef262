"""A mass on a guide whose motion was measured: the force that it asks for is what is explained."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from fibrefit.core.capability import Capability
from fibrefit.effects.law import Effect, GuideLaw, fast, laws_of
from fibrefit.rigs.guide import Guide, Sliding
from fibrefit.rigs.guided_mass import GUIDED_MASS, GuidedMassState
from fibrefit.rigs.rig import Start, Values


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
    mass : () in kg
    gain : () a pure number
        Force on the mass per measured force.
    offset : () in N
        Constant force against the + direction.
    guide : Guide
    """

    mass: jax.Array
    gain: jax.Array
    offset: jax.Array
    guide: Guide

    def stiff(self) -> jax.Array | None:
        """Whether friction that sets in over a short distance is there now."""
        return fast(self.guide.laws)

    def derivative(self, state: GuidedMassState, mode: FollowedMode, inputs: Any) -> GuidedMassState:
        """Rate of the measured motion, and of the guide's bristles along it."""
        sliding = self._direction(state.velocity)
        return GuidedMassState(inputs["position"][1], inputs["speed"][1], self.guide.bristle_rate(sliding, _now(state)))

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
        bristle = jnp.zeros(()) if self.guide.may_creep else None
        return GuidedMassState(position, velocity, bristle), FollowedMode(jnp.int32(0))

    def force(self, state: GuidedMassState, inputs: Any) -> jax.Array:
        """Force that was to be measured, in N."""
        # What `net_force` leaves of no drive is the guide's own force.
        held = self.guide.net_force(jnp.zeros(()), self._direction(state.velocity), _now(state))
        return (self.mass * inputs["speed"][1] + self.offset - held) / self.gain

    def _direction(self, velocity: jax.Array) -> jax.Array:
        return self.guide.sliding(jnp.sign(velocity).astype(jnp.int32))


def _now(state: GuidedMassState) -> Sliding:
    return Sliding(state.position, state.velocity, jnp.zeros(()), state.bristle)


def _build(values: Values, conditions: Values, laws: tuple[Effect, ...], tension_law: str) -> FollowedMass:
    """System of one record."""
    guide = Guide(values["friction"], laws_of(GuideLaw, laws))
    return FollowedMass(values["mass"] + conditions["added_mass"], conditions["gain"], values["force_offset"], guide)


def _start(system: FollowedMass, values: Values, conditions: Values, inputs: Any) -> Start:
    return Start(*system.begin(inputs["position"][0], inputs["speed"][0]))


def _observe(system: FollowedMass, state: GuidedMassState, mode: FollowedMode, inputs: Any) -> dict[str, jax.Array]:
    """Force in N."""
    return {"force": system.force(state, inputs)}


FOLLOWED_MASS = replace(
    GUIDED_MASS,
    capabilities=frozenset({Capability.GUIDE, Capability.PUSH}),
    channels=("force",),
    inputs=("position", "speed"),
    build=_build,
    start=_start,
    observe=_observe,
    anchor=None,
    derived=("speed",),
)
