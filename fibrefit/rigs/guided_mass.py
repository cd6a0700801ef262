"""A mass on a guide, driven by a measured force: a rig to identify a guide by itself."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from fibrefit.core.capability import Capability
from fibrefit.core.parameter import Parameter
from fibrefit.effects.law import Effect, GuideLaw, fast, laws_of
from fibrefit.rigs.bands import SpeedBands
from fibrefit.rigs.guide import CREEPING, Guide, Sliding
from fibrefit.rigs.rig import Rig, Start, Values


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
    guide : Guide
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


GUIDED_MASS = Rig(
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
    anchor="position",
)


def _let_go(system: GuidedMass, values: Values, conditions: Values, inputs: Any) -> Start:
    """The mass is somewhere, and moves by itself."""
    return Start(*system.begin(values["start_position"], values["start_speed"], inputs))


FREE_MASS = replace(
    GUIDED_MASS,
    nuisances=START,
    conditions=(ADDED,),
    capabilities=frozenset({Capability.GUIDE, Capability.PLACE}),
    inputs=(),
    start=_let_go,
    anchor=None,
    released="position",
)
"""The same where nothing drives it: followed from its start to its end."""
