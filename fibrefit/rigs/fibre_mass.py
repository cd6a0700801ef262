"""The drop rig: a weight in an inclined guide, caught by a fibre that hangs from a force gauge."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from fibrefit.core.parameter import Parameter
from fibrefit.effects.law import Effect, FibreLaw, GuideLaw, laws_of
from fibrefit.rigs.fibre import Fibre, Memories
from fibrefit.rigs.guide import Guide
from fibrefit.rigs.rig import STANDARD_GRAVITY, Rig, Start, Values

Mode = tuple[jax.Array, jax.Array]


class FibreMassState(NamedTuple):
    """Position u [m] and velocity [m/s] of the weight, away from the frame; u = 0 where the fibre is just taut."""

    position: jax.Array
    velocity: jax.Array
    memories: Memories


class FibreMass(eqx.Module):
    """Weight, guide and fibre as a switched system; modes: the fibre's and the guide's.

    Law
    ---
    ``m ü = m g sin α - T - guide``, fibre stretch ``e = u``.

    Parameters
    ----------
    mass : () in kg
    pull_of_gravity : () in N, along the guide
    fibre : Fibre
    guide : Guide

    Source
    ------
    Polach and Václavík, Figs 3-5.
    """

    mass: jax.Array
    pull_of_gravity: jax.Array
    fibre: Fibre
    guide: Guide

    def tension(self, state: FibreMassState, mode: Mode) -> jax.Array:
        """Tension of the fibre, in N: what the gauge at the frame feels."""
        return self.fibre.tension(state.position, state.velocity, state.memories, mode[0])

    def derivative(self, state: FibreMassState, mode: Mode, inputs: Any) -> FibreMassState:
        """Rate of the state."""
        tension = self.tension(state, mode)
        net = self.guide.net_force(self.pull_of_gravity - tension, mode[1], state.position, state.velocity, tension)
        rates = self.fibre.memory_rates(state.position, state.velocity, state.memories, mode[0])
        return FibreMassState(jnp.where(mode[1] == 0, 0.0, state.velocity), net / self.mass, rates)

    def margins(self, state: FibreMassState, mode: Mode, inputs: Any) -> tuple[jax.Array, jax.Array]:
        """Margins of the fibre and of the guide."""
        tension = self.tension(state, mode)
        free = self.pull_of_gravity - tension
        return (
            self.fibre.margin(state.position, state.velocity, state.memories, mode[0]),
            self.guide.margin(free, mode[1], state.position, state.velocity, tension),
        )

    def switch(
        self, state: FibreMassState, mode: Mode, crossed: tuple[jax.Array, jax.Array], inputs: Any
    ) -> tuple[FibreMassState, Mode]:
        """State and mode after the switches `crossed`."""
        memories, taut = self.fibre.switch(state.position, state.velocity, state.memories, mode[0], crossed[0])
        stopped = crossed[1] & (mode[1] != 0)
        state = FibreMassState(state.position, jnp.where(stopped, 0.0, state.velocity), memories)
        tension = self.tension(state, (taut, mode[1]))
        direction = self.guide.settle(self.pull_of_gravity - tension, mode[1], crossed[1], state.position, tension)
        return state, (taut, direction)

    def stiff(self) -> jax.Array | None:
        """Never: the weight is heavy against the fibre."""
        return None

    def at_rest(self, position: jax.Array) -> tuple[FibreMassState, Mode]:
        """State and mode of a weight let go at `position`."""
        state = FibreMassState(position, jnp.zeros(()), self.fibre.memories(position))
        taut = (self.fibre.stretch(position) > 0.0).astype(jnp.int32)
        nowhere = (jnp.array(False), jnp.array(True))
        return self.switch(state, (taut, jnp.int32(0)), nowhere, None)


PARAMETERS = (
    Parameter("stiffness", "N/m", "stiffness of the fibre", 3e4, lower=10.0, upper=1e7, log=True),
    Parameter("damping", "N s/m", "damping of the fibre", 20.0, lower=0.0, upper=1e4),
    Parameter("friction", "N", "Coulomb friction between weight and guide", 4.0, lower=0.0, upper=1e3),
)

NUISANCES = (
    Parameter("position_zero", "m", "reading of the position channel where the fibre is just taut", 1e-3),
    Parameter("release", "s", "instant at which the weight was let go", 0.1),
)

CONDITIONS = (
    Parameter("weight_mass", "kg", "mass of the weight", math.nan, lower=0.0),
    Parameter("added_mass", "kg", "mass added to the weight", 0.0, lower=0.0),
    Parameter("inclination", "rad", "slope of the guide; pi/2 is free fall", math.nan, lower=0.0, upper=math.pi / 2),
    Parameter("lift", "m", "height above the point where the fibre is just taut", math.nan),
)


def build(values: Values, conditions: Values, laws: tuple[Effect, ...], tension_law: str) -> FibreMass:
    """System of one record."""
    mass = conditions["weight_mass"] + conditions["added_mass"]
    return FibreMass(
        mass=mass,
        pull_of_gravity=mass * STANDARD_GRAVITY * jnp.sin(conditions["inclination"]),
        fibre=Fibre(values["stiffness"], values["damping"], laws_of(FibreLaw, laws), tension_law),
        guide=Guide(values["friction"], laws_of(GuideLaw, laws)),
    )


def start(system: FibreMass, values: Values, conditions: Values, inputs: Any) -> Start:
    """The weight rests `lift` above the taut point until it is released."""
    return Start(*system.at_rest(-conditions["lift"]), values["release"])


def observe(system: FibreMass, state: FibreMassState, mode: Mode, inputs: Any) -> dict[str, jax.Array]:
    """Force at the frame in N, position of the weight in m."""
    return {"force": system.tension(state, mode), "position": state.position}


FIBRE_MASS = Rig(
    kind="fibre_mass",
    parameters=PARAMETERS,
    nuisances=NUISANCES,
    conditions=CONDITIONS,
    channels=("force", "position"),
    inputs=(),
    build=build,
    start=start,
    observe=observe,
)
