"""The drop rig: a weight in an inclined guide, caught by a fibre that hangs from a force gauge."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.declarations import Capability, Parameter
from fibrefit.laws.law import Effect, FibreLaw, GuideLaw, fast, laws_of
from fibrefit.rigs.parts.bands import SpeedBands
from fibrefit.rigs.parts.chain import ChainState, End, PointChain
from fibrefit.rigs.parts.fibre import Fibre, Memories
from fibrefit.rigs.parts.guide import Guide, Sliding
from fibrefit.rigs.rig import STANDARD_GRAVITY, Rig, Start, Values, Variation
from fibrefit.rigs.signals.newton import Pull
from fibrefit.rigs.starting.fibre_mass import starting_fibre_mass
from fibrefit.rigs.starting.force_only import starting_force_only


class FibreMassState(NamedTuple):
    """Position u [m] and velocity [m/s] of the weight, away from the frame; u = 0 where the fibre is just taut.

    Memories of the fibre's laws; force [N] of the guide's bristles, and the fibre's points, where the model has them.
    """

    position: jax.Array
    velocity: jax.Array
    memories: Memories
    bristle: jax.Array | None
    chain: Any = None


class FibreMassMode(NamedTuple):
    """Modes of the fibre and of the guide; band of speed, and modes of the fibre's segments, None where there are none.

    A fibre with segments of its own is only known to be longer than its free length or not.
    """

    fibre: jax.Array
    guide: jax.Array
    band: Any
    chain: Any = None


class FibreMass(eqx.Module):
    """Weight, guide and fibre as a switched system.

    Law
    ---
    ``m ü = m g sin α - T - guide``, fibre stretch ``e = u``.

    Parameters
    ----------
    mass : () in kg
    pull_of_gravity : () in N, along the guide

    Source
    ------
    Polach and Václavík (docs/rigs.md), Figs 3-5.
    """

    mass: jax.Array
    pull_of_gravity: jax.Array
    fibre: Fibre
    guide: Guide

    def stiff(self) -> jax.Array | None:
        """Whether friction that sets in over a short distance is there now."""
        return fast((*self.guide.laws, *self.fibre.laws))

    def tension(self, state: FibreMassState, mode: FibreMassMode) -> jax.Array:
        """Tension of the fibre, in N: what the gauge at the frame feels."""
        return self._tensions(state, mode)[0]

    def derivative(self, state: FibreMassState, mode: FibreMassMode, inputs: Any) -> FibreMassState:
        """Rate of the state."""
        now, drive = self._sliding(state, mode)
        return FibreMassState(
            self.guide.speed(mode.guide, state.velocity),
            self.guide.net_force(drive, mode.guide, now) / self.mass,
            self.fibre.memory_rates(state.position, state.velocity, state.memories, mode.fibre),
            self.guide.bristle_rate(mode.guide, now),
            self._chain_rate(state, mode),
        )

    def margins(self, state: FibreMassState, mode: FibreMassMode, inputs: Any) -> FibreMassMode:
        """Margins of each mode."""
        now, drive = self._sliding(state, mode)
        fibre = self.fibre.margin(state.position, state.velocity, state.memories, mode.fibre)
        bands = SpeedBands.of(self.guide.laws)
        band = None if bands is None else bands.margin(mode.band, state.velocity)
        segments = None
        if (chain := self._chain()) is not None:
            segments = chain.margins(state.chain, mode.chain, *_ends(state.position, state.velocity))
            fibre = jnp.where(chain.there(), self.fibre.margin_of_length(state.position, mode.fibre), fibre)
        return FibreMassMode(fibre, self.guide.margin(drive, mode.guide, now), band, segments)

    def switch(
        self, state: FibreMassState, mode: FibreMassMode, crossed: FibreMassMode, inputs: Any
    ) -> tuple[FibreMassState, FibreMassMode]:
        """State and mode after the switches `crossed`."""
        here = state.position, state.velocity, state.memories
        memories, taut = self.fibre.switch(*here, mode.fibre, crossed.fibre)
        velocity = self.guide.stop(mode.guide, crossed.guide, state.velocity)
        state, mode = state._replace(velocity=velocity, memories=memories), mode._replace(fibre=taut)
        if (bands := SpeedBands.of(self.guide.laws)) is not None:
            mode = mode._replace(band=bands.switch(mode.band, velocity, crossed.band))
        if (chain := self._chain()) is not None:
            ends = _ends(state.position, velocity)
            points, segments = chain.switch(state.chain, mode.chain, crossed.chain, *ends)
            state, mode = state._replace(chain=points), mode._replace(chain=segments)
        now, drive = self._sliding(state, mode)
        return state, mode._replace(guide=self.guide.settle(drive, mode.guide, crossed.guide, now))

    def at_rest(self, position: jax.Array) -> tuple[FibreMassState, FibreMassMode]:
        """State and mode of a weight let go at `position`."""
        zero = jnp.zeros(())
        bristle = zero if self.guide.may_creep else None
        chain = self._chain()
        points: Any = None if chain is None else chain.at_rest(*_ends(position, zero))
        state = FibreMassState(position, zero, self.fibre.memories(position), bristle, points)
        taut = (self.fibre.stretch(position) > 0.0).astype(jnp.int32)
        band = None if SpeedBands.of(self.guide.laws) is None else jnp.int32(0)
        segments = None if chain is None else chain.modes(points, *_ends(position, zero))
        mode = FibreMassMode(taut, jnp.int32(0), band, segments)
        stopped = jax.tree.map(lambda _: jnp.array(False), mode)._replace(guide=jnp.array(True))
        return self.switch(state, mode, stopped, None)

    def _chain(self) -> PointChain | None:
        return PointChain.of(self.fibre, self.pull_of_gravity / self.mass)

    def _tensions(self, state: FibreMassState, mode: FibreMassMode) -> tuple[jax.Array, jax.Array]:
        """At the frame and at the weight, in N."""
        plain = self.fibre.tension(state.position, state.velocity, state.memories, mode.fibre)
        if (chain := self._chain()) is None:
            return plain, plain
        at_frame, at_weight = chain.tensions(state.chain, mode.chain, *_ends(state.position, state.velocity))
        return jnp.where(chain.there(), at_frame, plain), jnp.where(chain.there(), at_weight, plain)

    def _chain_rate(self, state: FibreMassState, mode: FibreMassMode) -> ChainState | None:
        if (chain := self._chain()) is None:
            return None
        return chain.derivative(state.chain, mode.chain, *_ends(state.position, state.velocity))

    def _sliding(self, state: FibreMassState, mode: FibreMassMode) -> tuple[Sliding, jax.Array]:
        """What the guide feels, and the force on the weight besides the guide's, in N."""
        tension = self._tensions(state, mode)[1]
        return Sliding(state.position, state.velocity, tension, state.bristle), self.pull_of_gravity - tension


def _ends(position: jax.Array, velocity: jax.Array) -> tuple[End, End]:
    """The fibre from the frame to the weight."""
    zero = jnp.zeros(())
    return End(zero, zero), End(position, velocity)


PARAMETERS = (
    Parameter("stiffness", "N/m", "stiffness of the fibre", 3e4, lower=10.0, upper=1e7, log=True),
    Parameter("damping", "N s/m", "damping of the fibre", 20.0, lower=0.0, upper=1e4),
    Parameter("friction", "N", "Coulomb friction between weight and guide", 4.0, lower=0.0, upper=1e3),
)

NUISANCES = (
    Parameter("position_zero", "m", "reading of the position channel where the fibre is just taut", 1e-3),
    Parameter("release", "s", "instant at which the weight was let go", 0.1),
)

LEAD = 0.1
"""Time in s at rest before the motion of a planned record begins."""

CONDITIONS = (
    Parameter("weight_mass", "kg", "mass of the weight", math.nan, lower=0.0),
    Parameter("added_mass", "kg", "mass added to the weight", 0.0, lower=0.0),
    Parameter("inclination", "rad", "slope of the guide; pi/2 is free fall", math.nan, lower=0.0, upper=math.pi / 2),
    Parameter("lift", "m", "height above the point where the fibre is just taut", math.nan),
)


def _build(values: Values, conditions: Values, laws: tuple[Effect, ...], tension_law: str) -> FibreMass:
    """System of one record."""
    mass = conditions["weight_mass"] + conditions["added_mass"]
    return FibreMass(
        mass=mass,
        pull_of_gravity=mass * STANDARD_GRAVITY * jnp.sin(conditions["inclination"]),
        fibre=Fibre(values["stiffness"], values["damping"], laws_of(FibreLaw, laws), tension_law),
        guide=Guide(values["friction"], laws_of(GuideLaw, laws)),
    )


def _pulled(conditions: Mapping[str, float], position: np.ndarray) -> Pull:
    """Gravity draws the weight away from the frame, the fibre back."""
    mass = conditions["weight_mass"] + conditions["added_mass"]
    return Pull(mass, STANDARD_GRAVITY * math.sin(conditions["inclination"]), -np.ones(len(position)))


def _start(system: FibreMass, values: Values, conditions: Values, inputs: Any) -> Start:
    """The weight rests `lift` above the taut point until it is released."""
    return Start(*system.at_rest(-conditions["lift"]), values["release"])


def _observe(system: FibreMass, state: FibreMassState, mode: FibreMassMode, inputs: Any) -> dict[str, jax.Array]:
    """Force at the frame in N, position of the weight in m."""
    return {"force": system.tension(state, mode), "position": state.position}


def _fibres(
    system: FibreMass, state: FibreMassState, mode: FibreMassMode, inputs: Any
) -> tuple[tuple[jax.Array, jax.Array], ...]:
    """Stretch in m and its rate in m/s."""
    return ((system.fibre.stretch(state.position), state.velocity),)


def _observe_force(system: FibreMass, state: FibreMassState, mode: FibreMassMode, inputs: Any) -> dict[str, jax.Array]:
    """Force at the frame in N."""
    return {"force": system.tension(state, mode)}


_USUAL = Rig(
    kind="fibre_mass",
    parameters=PARAMETERS,
    nuisances=NUISANCES,
    conditions=CONDITIONS,
    capabilities=frozenset(
        {
            Capability.FIBRE,
            Capability.GUIDE,
            Capability.INCLINE,
            Capability.TAUT_POINT,
            Capability.FALL,
            Capability.PLACE,
        }
    ),
    channels=("force", "position"),
    inputs=(),
    build=_build,
    start=_start,
    observe=_observe,
    fibres=_fibres,
    starting=starting_fibre_mass,
    pulled=_pulled,
    directions=("down", "up"),
    planned=lambda _: {"release": LEAD},
    further=(Variation("lift"), Variation("inclination"), Variation("added_mass", onto="weight_mass")),
)

FORCE_ONLY = replace(
    _USUAL,
    nuisances=NUISANCES[1:],
    capabilities=_USUAL.capabilities - {Capability.TAUT_POINT, Capability.PLACE},
    channels=("force",),
    observe=_observe_force,
    starting=starting_force_only,
)
"""The same where no position was measured: how far the weight fell is given by how hard it is caught."""

FIBRE_MASS = replace(_USUAL, variants={"force_only": FORCE_ONLY})
