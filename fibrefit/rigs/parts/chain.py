"""A fibre with a mass of its own: points between segments that obey the laws of the whole fibre.

Each segment goes taut and slack by itself, and every such instant is located. Between them the fibre is smooth, and the
step that carries it lets what is too fast for it die out.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from fibrefit.laws.fibre.point_masses import PointMasses
from fibrefit.laws.law import laws_of
from fibrefit.rigs.parts.fibre import LOADED, SLACK, Fibre, Memories

Modes = tuple[jax.Array, ...]

CALMING = 0.25
"""Least damping of a point between its neighbours, as a share of the critical one."""


class End(NamedTuple):
    """Place [m] of an end of the fibre along its line, and its rate [m/s]."""

    place: jax.Array
    rate: jax.Array


class ChainState(NamedTuple):
    """Places [m] and speeds [m/s] of the points along the line, and the memories of each segment."""

    places: tuple[jax.Array, ...]
    speeds: tuple[jax.Array, ...]
    memories: tuple[Memories, ...]


class PointChain(eqx.Module):
    """Points and segments of one fibre.

    Law
    ---
    ``m_i y_i'' = T_{i+1} - T_i + m_i g``, ``T_i = T((n+1)(y_i - y_{i-1}), (n+1)(y_i' - y_{i-1}'))``. Where b is too
    small to calm the points among themselves, taut segments resist by what is lacking to what they do not share.

    Parameters
    ----------
    fibre : Fibre
        The laws of the whole.
    mass : () in kg
        Of all points; zero where there are none.
    gravity : () in m/s^2
        Along the line, from its first end to its last.
    """

    fibre: Fibre
    mass: jax.Array
    gravity: jax.Array
    points: int = eqx.field(static=True)

    @classmethod
    def of(cls, fibre: Fibre, gravity: jax.Array) -> PointChain | None:
        """The chain of a fibre whose laws give it a mass; None where there is none in the model."""
        laws = laws_of(PointMasses, fibre.laws)
        return cls(fibre, laws[0].fibre_mass, gravity, laws[0].points) if laws else None

    def there(self) -> jax.Array:
        """Whether the fibre has a mass now."""
        return self.mass > 0.0

    def at_rest(self, near: End, far: End) -> ChainState:
        """State in which the points hang still between ends at rest."""
        segments = self.points + 1
        point, stiffness = self.mass / self.points, self.fibre.stiffness
        length = far.place - near.place
        carried = [point * self.gravity * (self.points - i) for i in range(self.points)]
        hanging = jnp.cumsum(jnp.stack([self.fibre.at_rest(load) for load in carried])) / segments
        sag = [point * self.gravity * (0.5 * self.points - i) / (segments * stiffness) for i in range(self.points)]
        drawn = length * jnp.arange(1, segments) / segments + jnp.cumsum(jnp.stack(sag))
        places = near.place + jnp.where(length > hanging[-1], drawn, hanging)
        still = tuple(jnp.zeros(()) for _ in range(self.points))
        state = ChainState(tuple(places[i] for i in range(self.points)), still, ())
        stretched = self._segments(state, near, far)
        return state._replace(memories=tuple(self.fibre.memories(length) for length, _ in stretched))

    def modes(self, state: ChainState, near: End, far: End) -> Modes:
        """The mode each segment is in by itself, without what was before."""
        found = []
        for (length, rate), memories in self._stretched(state, near, far):
            taut = self.fibre.stretch(length) > 0.0
            if self.fibre.tension_law == "clamped":
                taut &= self.fibre.pull(length, rate, memories) > 0.0
            found.append(jnp.where(taut, LOADED, SLACK).astype(jnp.int32))
        return tuple(found)

    def tensions(self, state: ChainState, modes: Modes, near: End, far: End) -> tuple[jax.Array, jax.Array]:
        """Tension at the near end and at the far one, in N."""
        loads = self._loads(state, modes, near, far)
        return loads[0], loads[-1]

    def margins(self, state: ChainState, modes: Modes, near: End, far: End) -> Modes:
        """Positive while each segment stays as it is, in m; one where the fibre has no mass."""
        there, stretched = self.there(), zip(self._stretched(state, near, far), modes, strict=True)
        margins = (self.fibre.margin(*segment, memories, mode) for (segment, memories), mode in stretched)
        return tuple(jnp.where(there, margin, 1.0) for margin in margins)

    def switch(self, state: ChainState, modes: Modes, crossed: Modes, near: End, far: End) -> tuple[ChainState, Modes]:
        """State and modes after the switches `crossed`."""
        stretched = zip(self._stretched(state, near, far), modes, crossed, strict=True)
        after = [self.fibre.switch(*segment, memories, mode, flag) for (segment, memories), mode, flag in stretched]
        memories, found = zip(*after, strict=True)
        return state._replace(memories=memories), found

    def derivative(self, state: ChainState, modes: Modes, near: End, far: End) -> ChainState:
        """Rate of the state; zero where the fibre has no mass."""
        there, loads = self.there(), self._loads(state, modes, near, far)
        point = jnp.where(there, self.mass, 1.0) / self.points
        zero = jnp.zeros(())
        speeds = tuple(jnp.where(there, speed, 0.0) for speed in state.speeds)
        rates = tuple(
            jnp.where(there, (after - before) / point + self.gravity, zero) for before, after in pairwise(loads)
        )
        stretched = zip(self._stretched(state, near, far), modes, strict=True)
        changes = tuple(self.fibre.memory_rates(*segment, own, mode) for (segment, own), mode in stretched)
        memories = jax.tree.map(lambda rate: jnp.where(there, rate, 0.0), changes)
        return ChainState(speeds, rates, memories)

    def _segments(self, state: ChainState, near: End, far: End) -> list[tuple[jax.Array, jax.Array]]:
        """Length beyond the free one and its rate, of each segment as if it were the whole fibre."""
        places, speeds = [near.place, *state.places, far.place], [near.rate, *state.speeds, far.rate]
        scale = self.points + 1
        return [
            (scale * (places[i + 1] - places[i]), scale * (speeds[i + 1] - speeds[i])) for i in range(self.points + 1)
        ]

    def _stretched(self, state: ChainState, near: End, far: End) -> list[tuple[tuple[jax.Array, jax.Array], Memories]]:
        """Length and rate of each segment, with its memories."""
        return list(zip(self._segments(state, near, far), state.memories, strict=True))

    def _loads(self, state: ChainState, modes: Modes, near: End, far: End) -> list[jax.Array]:
        lacking, shared = self._lacking(), far.rate - near.rate
        loads = []
        for ((length, rate), memories), mode in zip(self._stretched(state, near, far), modes, strict=True):
            calming = jnp.where(mode == LOADED, lacking * (rate - shared), 0.0)
            loads.append(self.fibre.tension(length, rate, memories, mode) + calming)
        return loads

    def _lacking(self) -> jax.Array:
        """Damping of the whole fibre, in N s/m, that b lacks to calm its points."""
        segments, point = self.points + 1, self.mass / self.points
        critical = 2.0 * jnp.sqrt(jnp.where(self.there(), segments * self.fibre.stiffness * point, 1.0)) / segments
        return jnp.where(self.there(), jnp.maximum(CALMING * critical - self.fibre.damping, 0.0), 0.0)
