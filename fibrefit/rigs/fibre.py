"""A massless fibre that pulls and never pushes, with whatever laws were added to it."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp

from fibrefit.effects.law import FibreLaw, Memory

Memories = tuple[Memory, ...]

SLACK, LOADED, LIMP = 0, 1, 2
"""Modes of a fibre: not stretched; stretched and pulling; stretched, but not pulling because it is let go too fast."""


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
    laws : tuple of FibreLaw
    tension_law : {"clamped", "heaviside"}

    Source
    ------
    Polach and Václavík, eq. (2); the clamp keeps a releasing fibre from pushing.
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

    @property
    def remembers(self) -> bool:
        """Whether any law has states of its own, which go on with the stretch while the clamp holds the load at nil."""
        return self.tension_law == "clamped" and any(law.memory for law in self.laws)

    def tension(self, length: jax.Array, rate: jax.Array, memories: Memories, mode: jax.Array) -> jax.Array:
        """Tension in N; nil unless loaded."""
        return jnp.where(mode == LOADED, self.pull(length, rate, memories), 0.0)

    def margin(self, length: jax.Array, rate: jax.Array, memories: Memories, mode: jax.Array) -> jax.Array:
        """Positive while the fibre stays as it is, in m."""
        e = self.stretch(length)
        if self.tension_law == "heaviside":
            return jnp.where(mode == LOADED, e, -e)
        # In metres too, so that the two conditions for load are of one size at the switch.
        load = self.pull(length, rate, memories) / self.stiffness
        loaded = jnp.minimum(e, load)
        if not self.remembers:
            return jnp.where(mode == LOADED, loaded, -loaded)
        return jnp.where(mode == LOADED, loaded, jnp.where(mode == LIMP, jnp.minimum(e, -load), -e))

    def memory_rates(self, length: jax.Array, rate: jax.Array, memories: Memories, mode: jax.Array) -> Memories:
        """Rates of the laws' own states."""
        e, taut = self.stretch(length), mode != SLACK
        return tuple(law.memory_rate(e, rate, m, taut) for law, m in zip(self.laws, memories, strict=True))

    def switch(
        self, length: jax.Array, rate: jax.Array, memories: Memories, mode: jax.Array, crossed: jax.Array
    ) -> tuple[Memories, jax.Array]:
        """Memories and mode after the fibre has changed its mode, or as they were."""
        if not self.remembers:
            after = jnp.where(mode == LOADED, SLACK, LOADED)
        else:
            limp = self.pull(length, rate, memories) < 0.0
            after = jnp.where(self.stretch(length) < 0.0, SLACK, jnp.where(limp, LIMP, LOADED))
        released = crossed & (after == SLACK)
        forgot = tuple(law.at_release(m) for law, m in zip(self.laws, memories, strict=True))
        memories = jax.tree.map(lambda new, old: jnp.where(released, new, old), forgot, memories)
        return memories, jnp.where(crossed, after, mode)
