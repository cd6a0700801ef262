"""A fibre that pulls and never pushes, with whatever laws were added to it; and one with a mass of its own.

The latter has points between segments that obey the laws of the whole fibre. Each segment goes taut and slack by
itself, and every such instant is located. Between them the fibre is smooth, and the step that carries it lets what is
too fast for it die out.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.laws.fibre.point_masses import PointMasses
from fibrefit.laws.law import FibreLaw, Memory, laws_of

Memories = tuple[Memory, ...]

NEWTON_STEPS = 8
CONVERGED = 1e-9
"""Last change, as a share of the value, after which another step of Newton's would change nothing."""
LEAST_DAMPING = 0.05
"""In N s/m: keeps a fibre without damping from snapping into balance with a spring in series at no time at all."""
SLACK, LOADED, LIMP = 0, 1, 2
"""Modes of a fibre: without load; with load; stretched, and yet without load because it is let go too fast.

The last is distinguished from the first only where a law asks for it.
"""


class Fibre(eqx.Module):
    """Kelvin-Voigt fibre, tension only.

    Law
    ---
    ``k e Π(stiffness factors) + b ė Π(damping factors) + Σ(added tensions)`` for stretch e > 0, else nothing.
    `clamped`: nothing either while that sum is negative; `heaviside`: to the letter.

    Parameters
    ----------
    stiffness : () in N/m
    damping : () in N s/m
    tension_law : {"clamped", "heaviside"}

    Source
    ------
    Polach and Václavík (docs/rigs.md), eq. (2); the clamp keeps a releasing fibre from pushing.
    """

    stiffness: jax.Array
    damping: jax.Array
    laws: tuple[FibreLaw, ...] = ()
    tension_law: str = eqx.field(static=True, default="clamped")

    def memories(self, length: jax.Array) -> Memories:
        """The laws' own states after a long rest at `length`."""
        return tuple(law.memory_at_rest(self.stretch(length)) for law in self.laws)

    def stretch(self, length: jax.Array) -> jax.Array:
        """Stretch of the fibre, in m, at a distance of its ends `length` beyond the nominal one."""
        for law in self.laws:
            length = length - law.initial_slack()
        return length

    def pull(self, length: jax.Array, rate: jax.Array, memories: Memories) -> jax.Array:
        """Tension while the fibre is taut, in N."""
        e = self.stretch(length)
        elastic, viscous, added = self.stiffness * e, self.damping * rate, jnp.zeros(())
        for law, memory in zip(self.laws, memories, strict=True):
            elastic = elastic * law.stiffness_factor(e, rate)
            viscous = viscous * law.damping_factor(e, rate)
            added = added + law.tension(self.stiffness, e, rate, memory)
        return elastic + viscous + added

    def at_rest(self, tension: jax.Array) -> jax.Array:
        """Length at which a fibre long at rest carries `tension`; where it is zero, just taut."""

        def static(stretch: jax.Array) -> jax.Array:
            memories = tuple(law.memory_at_rest(stretch) for law in self.laws)
            return self.pull(stretch + slack, jnp.zeros(()), memories)

        slack = -self.stretch(jnp.zeros(()))
        stretch = tension / self.stiffness
        for _ in range(NEWTON_STEPS):
            value, slope = jax.jvp(static, (stretch,), (jnp.ones(()),))
            stretch = stretch - (value - tension) / slope
        return jnp.where(tension > 0.0, stretch, 0.0) + slack

    def rate_under(self, tension: jax.Array, length: jax.Array, memories: Memories) -> jax.Array:
        """Rate at which a fibre of `length` creeps under a given tension, in m/s."""
        if not self.laws:
            return (tension - self.pull(length, jnp.zeros(()), memories)) / jnp.maximum(self.damping, LEAST_DAMPING)
        return _creep(self, tension, length, memories)

    def tension(self, length: jax.Array, rate: jax.Array, memories: Memories, mode: jax.Array) -> jax.Array:
        """Tension in N; zero unless loaded."""
        return jnp.where(mode == LOADED, self.pull(length, rate, memories), 0.0)

    def mode_of(self, length: jax.Array, rate: jax.Array, memories: Memories) -> jax.Array:
        """The mode it is in by itself, without what was before."""
        taut = self.stretch(length) > 0.0
        if self.tension_law == "clamped":
            taut &= self.pull(length, rate, memories) > 0.0
        return jnp.where(taut, LOADED, SLACK).astype(jnp.int32)

    def margin(self, length: jax.Array, rate: jax.Array, memories: Memories, mode: jax.Array) -> jax.Array:
        """Positive while the fibre stays as it is, in m."""
        e = self.stretch(length)
        if self.tension_law == "heaviside":
            return jnp.where(mode == LOADED, e, -e)
        # In metres too, so that the two conditions for load are of one size at the switch.
        load = self.pull(length, rate, memories) / self.stiffness
        loaded = jnp.minimum(e, load)
        plain = jnp.where(mode == LOADED, loaded, -loaded)
        if not self._forgetful():
            return plain
        exact = jnp.where(mode == LIMP, jnp.minimum(e, -load), jnp.where(mode == SLACK, -e, loaded))
        return jnp.where(self._tells_limp(), exact, plain)

    def margin_of_length(self, length: jax.Array, mode: jax.Array) -> jax.Array:
        """Positive while the fibre stays longer than its free length, or shorter, in m."""
        e = self.stretch(length)
        return jnp.where(mode == LOADED, e, -e)

    def memory_rates(self, length: jax.Array, rate: jax.Array, memories: Memories, mode: jax.Array) -> Memories:
        """Rates of the laws' own states."""
        e, slack = self.stretch(length), mode == SLACK
        return tuple(law.memory_rate(e, rate, m, slack) for law, m in zip(self.laws, memories, strict=True))

    def switch(
        self, length: jax.Array, rate: jax.Array, memories: Memories, mode: jax.Array, crossed: jax.Array
    ) -> tuple[Memories, jax.Array]:
        """Memories and mode after the fibre has changed its mode, or as they were."""
        after = jnp.where(mode == LOADED, SLACK, LOADED)
        if self._forgetful() and self.tension_law == "clamped":
            lame = self.pull(length, rate, memories) < 0.0
            exact = jnp.where(self.stretch(length) < 0.0, SLACK, jnp.where(lame, LIMP, LOADED))
            after = jnp.where(self._tells_limp(), exact, after)
        slackened = crossed & (after == SLACK)
        blank = tuple(law.when_slack(m) for law, m in zip(self.laws, memories, strict=True))
        memories = jax.tree.map(lambda new, old: jnp.where(slackened, new, old), blank, memories)
        return memories, jnp.where(crossed, after, mode)

    def _forgetful(self) -> tuple[FibreLaw, ...]:
        """Laws for which it matters that a fibre was slack and did not only carry no load."""
        return tuple(law for law in self.laws if law.forgets)

    def _tells_limp(self) -> jax.Array:
        """Whether to tell limp from slack: an additional switch, which an absent law must not bring."""
        return ~functools.reduce(operator.and_, (law.absent() for law in self._forgetful()))


@jax.custom_jvp
def _creep(fibre: Fibre, tension: jax.Array, length: jax.Array, memories: Memories) -> jax.Array:
    """Rate of a fibre with laws under a tension: Newton's method, which ends as soon as it has converged."""

    def going(now: tuple[jax.Array, jax.Array, jax.Array]) -> jax.Array:
        rate, change, step = now
        return (step < NEWTON_STEPS) & (jnp.abs(change) > CONVERGED * jnp.abs(rate))

    def newton(now: tuple[jax.Array, jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array, jax.Array]:
        rate, _, step = now
        value, slope = _pull_and_slope(fibre, length, rate, memories)
        change = (tension - value) / slope
        return rate + change, change, step + 1

    return jax.lax.while_loop(going, newton, (jnp.zeros(()), jnp.ones(()), jnp.int32(0)))[0]


@_creep.defjvp
def _creep_jvp(primals: tuple, tangents: tuple) -> tuple[jax.Array, jax.Array]:
    rate = _creep(*primals)
    fibre, _, length, memories = primals
    d_fibre, d_tension, d_length, d_memories = tangents
    _, slope = _pull_and_slope(fibre, length, rate, memories)
    at_rate = lambda fibre, length, memories: fibre.pull(length, rate, memories)  # noqa: E731
    _, d_pull = jax.jvp(at_rate, (fibre, length, memories), (d_fibre, d_length, d_memories))
    return rate, (d_tension - d_pull) / slope


def _pull_and_slope(fibre: Fibre, length: jax.Array, rate: jax.Array, memories: Memories) -> tuple[Any, Any]:
    value, slope = jax.jvp(lambda r: fibre.pull(length, r, memories), (rate,), (jnp.ones(()),))
    return value, jnp.maximum(slope, LEAST_DAMPING)


LEAST = 1e-4
"""Damping in N s/m over stiffness in N/m below which a search would not begin: at zero it has no slope."""


def spring_and_damper(loads: Sequence[tuple[np.ndarray, ...]], refused: DataError) -> tuple[float, float]:
    """Stiffness in N/m and damping in N s/m by least squares.

    Parameters
    ----------
    loads : sequence of three (n_sample,)
        Stretch in m, its rate in m/s and the force in N, of each record where it carries load.
    refused : DataError
        Raised where the force does not grow with the stretch.
    """
    stretch, rate, force = (np.concatenate(parts) for parts in zip(*loads, strict=True))
    (stiffness, damping), *_ = np.linalg.lstsq(np.column_stack([stretch, rate]), force, rcond=None)
    if not stiffness > 0.0:
        raise refused
    return float(stiffness), float(max(damping, LEAST * stiffness))


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
        return tuple(self.fibre.mode_of(*segment, own) for segment, own in self._stretched(state, near, far))

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
        # Damping of the whole fibre, in N s/m, that b lacks to calm its points.
        segments, point = self.points + 1, self.mass / self.points
        critical = 2.0 * jnp.sqrt(jnp.where(self.there(), segments * self.fibre.stiffness * point, 1.0)) / segments
        lacking = jnp.where(self.there(), jnp.maximum(CALMING * critical - self.fibre.damping, 0.0), 0.0)
        shared = far.rate - near.rate
        loads = []
        for ((length, rate), memories), mode in zip(self._stretched(state, near, far), modes, strict=True):
            calming = jnp.where(mode == LOADED, lacking * (rate - shared), 0.0)
            loads.append(self.fibre.tension(length, rate, memories, mode) + calming)
        return loads
