"""A massless fibre that pulls and never pushes, with whatever laws were added to it."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp

from fibrefit.effects.law import FibreLaw, Memory

Memories = tuple[Memory, ...]


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

    def memories(self) -> Memories:
        """The laws' own states at the start, all zero."""
        return tuple(tuple(jnp.zeros(()) for _ in law.memory) for law in self.laws)

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

    def tension(self, length: jax.Array, rate: jax.Array, memories: Memories, taut: jax.Array) -> jax.Array:
        """Tension in N; nil while slack."""
        return jnp.where(taut > 0, self.pull(length, rate, memories), 0.0)

    def margin(self, length: jax.Array, rate: jax.Array, memories: Memories, taut: jax.Array) -> jax.Array:
        """Positive while the fibre stays as it is, taut or slack."""
        e = self.stretch(length)
        if self.tension_law == "clamped":
            # In metres, so that the two conditions for load are of one size at the switch.
            e = jnp.minimum(e, self.pull(length, rate, memories) / self.stiffness)
        return jnp.where(taut > 0, e, -e)

    def memory_rates(self, length: jax.Array, rate: jax.Array, memories: Memories, taut: jax.Array) -> Memories:
        """Rates of the laws' own states."""
        e = self.stretch(length)
        return tuple(law.memory_rate(e, rate, m, taut) for law, m in zip(self.laws, memories, strict=True))

    def switch(self, memories: Memories, taut: jax.Array, crossed: jax.Array) -> tuple[Memories, jax.Array]:
        """Memories and mode after the fibre has gone slack or taut."""
        released = crossed & (taut > 0)
        after = tuple(law.at_release(m) for law, m in zip(self.laws, memories, strict=True))
        memories = jax.tree.map(lambda new, old: jnp.where(released, new, old), after, memories)
        return memories, jnp.where(crossed, 1 - taut, taut)
