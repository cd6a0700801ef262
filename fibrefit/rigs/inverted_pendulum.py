"""The inverted pendulum: a rod on a pivot, held upright and driven by two fibres whose far ends move together."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from fibrefit.core.parameter import Parameter
from fibrefit.effects.law import Effect, FibreLaw, fast, laws_of
from fibrefit.rigs.fibre import LOADED, SLACK, Fibre, Memories
from fibrefit.rigs.rig import STANDARD_GRAVITY, Rig, Start, Values


class InvertedPendulumState(NamedTuple):
    """Angle φ [rad] from upright, towards the first fibre, and its rate [rad/s]; memories of both fibres."""

    angle: jax.Array
    rate: jax.Array
    memories_1: Memories
    memories_2: Memories


class InvertedPendulumMode(NamedTuple):
    """Modes of the two fibres."""

    fibre_1: jax.Array
    fibre_2: jax.Array


class Leg(NamedTuple):
    """One fibre as the pendulum has it now: length beyond the free one [m], its rate [m/s], lever of its pull [m]."""

    length: jax.Array
    rate: jax.Array
    lever: jax.Array


class InvertedPendulum(eqx.Module):
    """Rod and fibres as a switched system.

    Law
    ---
    ``I φ'' = F_1 d sin α_1 - F_2 d sin α_2 + m g (l/2) sin φ``, ``sin α_1 = (a + x) cos φ / l_1``,
    ``sin α_2 = (a - x) cos φ / l_2``, ``l_{1,2}² = (d cos φ)² + (a ± x ∓ d sin φ)²``; free length
    ``sqrt(a² + d²) - N/k``.

    Parameters
    ----------
    moment_of_inertia : () in kg m^2, about the pivot
    tipping : () in N m, m g l/2
    height : () in m
        d, from the pivot to where the fibres are attached.
    distance : () in m
        a, from the pivot to each driven end.
    preload : () in N
        N, of both fibres where the rod stands upright and the drive is in the middle.
    fibre : Fibre
        Both are alike.

    Source
    ------
    Polach and Václavík, eqs (1)-(4), Fig. 1.
    """

    moment_of_inertia: jax.Array
    tipping: jax.Array
    height: jax.Array
    distance: jax.Array
    preload: jax.Array
    fibre: Fibre

    def stiff(self) -> jax.Array | None:
        """Whether a law of the fibres is fast against the sampling."""
        return fast(self.fibre.laws)

    def leg(self, side: float, angle: jax.Array, rate: jax.Array, drive: Any) -> Leg:
        """The fibre on one side: +1 the first, -1 the second."""
        x, x_rate = drive
        reach = self.distance + side * x
        across, up = reach - side * self.height * jnp.sin(angle), self.height * jnp.cos(angle)
        length, shortness = _root(across**2 + up**2)
        lever = reach * up * shortness
        upright = _root(self.distance**2 + self.height**2)[0]
        slack = self.preload / self.fibre.stiffness
        return Leg(length - upright + slack, side * (across * x_rate * shortness - lever * rate), lever)

    def legs(self, state: InvertedPendulumState, inputs: Any) -> tuple[Leg, Leg]:
        """Both fibres."""
        first, second = (self.leg(side, state.angle, state.rate, inputs["drive"]) for side in (1.0, -1.0))
        return first, second

    def tensions(
        self, state: InvertedPendulumState, mode: InvertedPendulumMode, inputs: Any
    ) -> tuple[jax.Array, jax.Array]:
        """Tension of each fibre, in N."""
        first, second = self.legs(state, inputs)
        return (
            self.fibre.tension(first.length, first.rate, state.memories_1, mode.fibre_1),
            self.fibre.tension(second.length, second.rate, state.memories_2, mode.fibre_2),
        )

    def derivative(
        self, state: InvertedPendulumState, mode: InvertedPendulumMode, inputs: Any
    ) -> InvertedPendulumState:
        """Rate of the state."""
        first, second = self.legs(state, inputs)
        pull_1, pull_2 = self.tensions(state, mode, inputs)
        moment = pull_1 * first.lever - pull_2 * second.lever + self.tipping * jnp.sin(state.angle)
        return InvertedPendulumState(
            state.rate,
            moment / self.moment_of_inertia,
            self.fibre.memory_rates(first.length, first.rate, state.memories_1, mode.fibre_1),
            self.fibre.memory_rates(second.length, second.rate, state.memories_2, mode.fibre_2),
        )

    def margins(self, state: InvertedPendulumState, mode: InvertedPendulumMode, inputs: Any) -> InvertedPendulumMode:
        """Margins of each mode."""
        first, second = self.legs(state, inputs)
        return InvertedPendulumMode(
            self.fibre.margin(first.length, first.rate, state.memories_1, mode.fibre_1),
            self.fibre.margin(second.length, second.rate, state.memories_2, mode.fibre_2),
        )

    def switch(
        self, state: InvertedPendulumState, mode: InvertedPendulumMode, crossed: InvertedPendulumMode, inputs: Any
    ) -> tuple[InvertedPendulumState, InvertedPendulumMode]:
        """State and mode after the switches `crossed`."""
        first, second = self.legs(state, inputs)
        memories_1, mode_1 = self.fibre.switch(
            first.length, first.rate, state.memories_1, mode.fibre_1, crossed.fibre_1
        )
        memories_2, mode_2 = self.fibre.switch(
            second.length, second.rate, state.memories_2, mode.fibre_2, crossed.fibre_2
        )
        state = state._replace(memories_1=memories_1, memories_2=memories_2)
        return state, InvertedPendulumMode(mode_1, mode_2)

    def begin(
        self, angle: jax.Array, rate: jax.Array, inputs: Any
    ) -> tuple[InvertedPendulumState, InvertedPendulumMode]:
        """State and mode of a pendulum that has stood still and is now at `angle` [rad] with `rate` [rad/s]."""
        first, second = (self.leg(side, angle, rate, inputs["drive"]) for side in (1.0, -1.0))
        state = InvertedPendulumState(
            angle, rate, self.fibre.memories(first.length), self.fibre.memories(second.length)
        )
        return state, InvertedPendulumMode(
            self._carries(first, state.memories_1), self._carries(second, state.memories_2)
        )

    def mode_of(self, state: InvertedPendulumState, inputs: Any) -> InvertedPendulumMode:
        """The mode a state is in by itself, without what was before."""
        first, second = self.legs(state, inputs)
        return InvertedPendulumMode(self._carries(first, state.memories_1), self._carries(second, state.memories_2))

    def _carries(self, leg: Leg, memories: Memories) -> jax.Array:
        taut = self.fibre.stretch(leg.length) > 0.0
        if self.fibre.tension_law == "clamped":
            taut &= self.fibre.pull(leg.length, leg.rate, memories) > 0.0
        return jnp.where(taut, LOADED, SLACK).astype(jnp.int32)


def _root(square: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Root of a number, and its inverse.

    The compiler may or may not turn a division by a root into a product, as the rest of a program suggests: an effect
    that is nil would then change the last bits.
    """
    inverse = jax.lax.rsqrt(square)
    return square * inverse, inverse


PARAMETERS = (
    Parameter("stiffness", "N/m", "stiffness of each fibre", 8e3, lower=10.0, upper=1e7, log=True),
    Parameter("damping", "N s/m", "damping of each fibre", 4.0, lower=0.0, upper=1e4),
)

NUISANCES = (
    Parameter("start_angle", "rad", "angle of the pendulum at the first sample", 0.05),
    Parameter("start_rate", "rad/s", "angular velocity of the pendulum at the first sample", 0.5),
)

CONDITIONS = (
    Parameter("rod_length", "m", "length of the pendulum", math.nan, lower=0.0),
    Parameter("rod_mass", "kg", "mass of the pendulum", math.nan, lower=0.0),
    Parameter("moment_of_inertia", "kg m^2", "moment of inertia about the pivot", math.nan, lower=0.0),
    Parameter(
        "attachment_height", "m", "distance from the pivot to where the fibres are attached", math.nan, lower=0.0
    ),
    Parameter("anchor_distance", "m", "distance from the pivot to each driven end", math.nan, lower=0.0),
    Parameter("preload", "N", "tension of both fibres where the rod stands upright", 0.0, lower=0.0),
)


def build(values: Values, conditions: Values, laws: tuple[Effect, ...], tension_law: str) -> InvertedPendulum:
    """System of one record."""
    return InvertedPendulum(
        moment_of_inertia=conditions["moment_of_inertia"],
        tipping=0.5 * conditions["rod_mass"] * STANDARD_GRAVITY * conditions["rod_length"],
        height=conditions["attachment_height"],
        distance=conditions["anchor_distance"],
        preload=conditions["preload"],
        fibre=Fibre(values["stiffness"], values["damping"], laws_of(FibreLaw, laws), tension_law),
    )


def start(system: InvertedPendulum, values: Values, conditions: Values, inputs: Any) -> Start:
    """The pendulum is where it is at the first sample; unless said, upright and at rest."""
    nil = jnp.zeros(())
    return Start(*system.begin(values.get("start_angle", nil), values.get("start_rate", nil), inputs))


def observe(
    system: InvertedPendulum, state: InvertedPendulumState, mode: InvertedPendulumMode, inputs: Any
) -> dict[str, jax.Array]:
    """Angle in rad, force of each fibre in N."""
    force_1, force_2 = system.tensions(state, mode, inputs)
    return {"angle": state.angle, "force_1": force_1, "force_2": force_2}


INVERTED_PENDULUM = Rig(
    kind="inverted_pendulum",
    parameters=PARAMETERS,
    nuisances=NUISANCES,
    conditions=CONDITIONS,
    channels=("angle", "force_1", "force_2"),
    inputs=("drive",),
    build=build,
    start=start,
    observe=observe,
)
