"""A prismatic guide: friction that truly holds the weight at rest, and forces that go with its motion."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp

from fibrefit.effects.law import GuideLaw


class Guide(eqx.Module):
    """Set-valued Coulomb friction with whatever laws were added to it.

    The mode of a guide is the direction of sliding: +1, -1, or 0 at rest.

    Law
    ---
    Sliding: ``-s (F_c + Σ friction) - Σ force``; at rest whatever balances the other forces, up to that level.

    Parameters
    ----------
    friction : () in N
    laws : tuple of GuideLaw
    """

    friction: jax.Array
    laws: tuple[GuideLaw, ...] = ()

    def level(self, direction: jax.Array, position: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """Friction against sliding in `direction`, in N."""
        level = self.friction
        for law in self.laws:
            level = level + law.friction(self.friction, direction, velocity, tension) + law.roughness(position)
        return level

    def single_valued(self, position: jax.Array, velocity: jax.Array) -> jax.Array:
        """Sum of the forces that need no mode, in N; positive opposes motion in the + direction."""
        total, viscosity = jnp.zeros(()), jnp.zeros(())
        for law in self.laws:
            total = total + law.force(position, velocity)
            viscosity = viscosity + law.viscosity()
        for law in self.laws:
            viscosity = viscosity * law.viscosity_factor(velocity)
        return total + viscosity * velocity

    def net_force(
        self, drive: jax.Array, direction: jax.Array, position: jax.Array, velocity: jax.Array, tension: jax.Array
    ) -> jax.Array:
        """Force that accelerates the weight when `drive` acts on it besides the guide, in N; nil at rest."""
        level = self.level(direction.astype(float), position, velocity, tension)
        net = drive - self.single_valued(position, velocity) - direction * level
        return jnp.where(direction == 0, 0.0, net)

    def margin(
        self, drive: jax.Array, direction: jax.Array, position: jax.Array, velocity: jax.Array, tension: jax.Array
    ) -> jax.Array:
        """Positive while the weight goes on sliding as it does, or stays at rest."""
        return jnp.where(direction == 0, self._reserve(drive, position, tension), direction * velocity)

    def settle(
        self, drive: jax.Array, direction: jax.Array, crossed: jax.Array, position: jax.Array, tension: jax.Array
    ) -> jax.Array:
        """Direction after a switch: a weight that has stopped, or was at rest, stays or moves with the net force."""
        at_rest = crossed | (direction == 0)
        net = drive - self.single_valued(position, jnp.zeros(()))
        free = jnp.where(self._reserve(drive, position, tension) < 0.0, jnp.sign(net), 0.0).astype(direction.dtype)
        return jnp.where(at_rest, free, direction)

    def _reserve(self, drive: jax.Array, position: jax.Array, tension: jax.Array) -> jax.Array:
        net = drive - self.single_valued(position, jnp.zeros(()))
        towards = jnp.where(net >= 0.0, 1.0, -1.0)
        return self.level(towards, position, jnp.zeros(()), tension) - towards * net
