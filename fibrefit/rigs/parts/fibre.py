"""A massless fibre that pulls and never pushes, with whatever laws were added to it."""

from __future__ import annotations

import functools
import operator
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp

from fibrefit.laws.law import FibreLaw, Memory

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
