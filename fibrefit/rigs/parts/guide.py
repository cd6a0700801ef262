"""A prismatic guide: friction that truly holds the weight at rest, and forces that go with its motion."""

from __future__ import annotations

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp

from fibrefit.laws.law import Effect, GuideLaw

REST, CREEPING = 0, 2
"""Modes of a guide besides the direction of sliding, +1 or -1: at rest; and +2 or -2, held by bristles that bend."""

TREMBLING = 1e-4
"""Speed, in m/s, that is no reversal yet for a weight on bristles."""

LEAST_LEVEL = 1e-3
"""In N: bristles of a guide without friction bend as far as this."""


def _creeps(mode: jax.Array) -> jax.Array:
    return jnp.abs(mode) == CREEPING


class Sliding(NamedTuple):
    """What a guide feels: position [m] and velocity [m/s] of the weight, tension [N] that draws it askew.

    `bristle` is the force [N] of bristles that bend before they let go, None in a model without them.
    """

    position: jax.Array
    velocity: jax.Array
    tension: jax.Array
    bristle: Any = None


class Guide(eqx.Module):
    """Set-valued Coulomb friction with whatever laws were added to it.

    Law
    ---
    Sliding: ``-s (F_c + Σ friction) - Σ force``; at rest whatever balances the other forces, up to that level.
    Creeping: the level is reached by bending bristles, ``f' = (v - |v| f/level)/compliance``.

    Parameters
    ----------
    friction : () in N
    """

    friction: jax.Array
    laws: tuple[GuideLaw, ...] = ()

    @property
    def may_creep(self) -> bool:
        """Whether the model has bristles."""
        return any(law.creeps for law in self.laws)

    def level(self, direction: jax.Array, velocity: jax.Array, now: Sliding) -> jax.Array:
        """Friction against sliding in `direction` with `velocity`, in N."""
        level = self.friction
        for law in self.laws:
            level = level + law.friction(self.friction, direction, velocity, now.tension) + law.roughness(now.position)
        # Laws that each leave a level may leave none together: friction never drives.
        return jnp.where(level < 0.0, 0.0, level)

    def single_valued(self, position: jax.Array, velocity: jax.Array) -> jax.Array:
        """Sum of the forces that need no mode, in N; positive opposes motion in the + direction."""
        if not self.laws:
            return jnp.zeros(())
        total, viscosity = jnp.zeros(()), jnp.zeros(())
        for law in self.laws:
            total = total + law.force(position, velocity)
            viscosity = viscosity + law.viscosity()
        for law in self.laws:
            viscosity = viscosity * law.viscosity_factor(velocity)
        return total + viscosity * velocity

    def net_force(self, drive: jax.Array, mode: jax.Array, now: Sliding) -> jax.Array:
        """Force that accelerates the weight when `drive` acts on it besides the guide, in N; zero at rest."""
        level = self.level(mode.astype(float), now.velocity, now)
        net = drive - self.single_valued(now.position, now.velocity)
        if now.bristle is None:
            return jnp.where(mode == REST, 0.0, net - mode * level)
        damping = sum((law.bristle_damping_coefficient() for law in self.laws if law.creeps), start=jnp.zeros(()))
        bent = now.bristle + damping * self._bending(now)
        return jnp.where(mode == REST, 0.0, net - jnp.where(_creeps(mode), bent, mode * level))

    def speed(self, mode: jax.Array, velocity: jax.Array) -> jax.Array:
        """Rate of the position, in m/s: exactly zero at rest."""
        return jnp.where(mode == REST, 0.0, velocity)

    def bristle_rate(self, mode: jax.Array, now: Sliding) -> jax.Array | None:
        """Rate of the force of the bristles, in N/s."""
        if now.bristle is None:
            return None
        creeping, compliance = _creeps(mode), self._compliance()
        return jnp.where(creeping, self._bending(now) / jnp.where(creeping, compliance, 1.0), 0.0)

    def margin(self, drive: jax.Array, mode: jax.Array, now: Sliding) -> jax.Array:
        """Positive while the weight goes on sliding as it does, stays at rest, or creeps."""
        rigid = jnp.where(mode == REST, self._reserve(drive, now), mode * now.velocity)
        # Bristles bend by another law after a reversal. A weight that only trembles on them need not stop for that.
        creeping = TREMBLING + jnp.sign(mode) * now.velocity
        return rigid if now.bristle is None else jnp.where(_creeps(mode), creeping, rigid)

    def stop(self, mode: jax.Array, crossed: jax.Array, velocity: jax.Array) -> jax.Array:
        """Velocity after a switch: zero where a sliding weight has turned round."""
        return jnp.where(crossed & (mode != REST) & ~_creeps(mode), 0.0, velocity)

    def settle(self, drive: jax.Array, mode: jax.Array, crossed: jax.Array, now: Sliding) -> jax.Array:
        """Mode after a switch: a weight that has stopped, or was at rest, stays or moves with the net force."""
        at_rest = crossed | (mode == REST)
        net = drive - self.single_valued(now.position, jnp.zeros(()))
        free = jnp.where(self._reserve(drive, now) < 0.0, jnp.sign(net), 0.0).astype(mode.dtype)
        settled = jnp.where(at_rest, free, mode)
        if now.bristle is None:
            return settled
        turned = jnp.where(_creeps(mode), jnp.where(crossed, -mode, mode), CREEPING)
        return jnp.where(self._compliance() > 0.0, turned, settled)

    def sliding(self, direction: jax.Array) -> jax.Array:
        """Mode in which the weight moves in a direction: 1, -1, or 0 where it stands."""
        if not self.may_creep:
            return direction
        return jnp.where(self._compliance() > 0.0, CREEPING * direction, direction)

    def bristle_at_rest(self, drive: jax.Array, now: Sliding) -> jax.Array | None:
        """Force of bristles that hold the weight where it is, as far as they can."""
        if not self.may_creep:
            return None
        net = drive - self.single_valued(now.position, jnp.zeros(()))
        return jnp.where(
            self._compliance() > 0.0, net - jnp.sign(net) * jnp.maximum(-self._reserve(drive, now), 0.0), 0.0
        )

    def _reserve(self, drive: jax.Array, now: Sliding) -> jax.Array:
        net = drive - self.single_valued(now.position, jnp.zeros(()))
        towards = jnp.where(net >= 0.0, 1.0, -1.0)
        return self.level(towards, jnp.zeros(()), now) - towards * net

    def _compliance(self) -> jax.Array:
        return sum((law.compliance() for law in self.laws if law.creeps), start=jnp.zeros(()))

    def _bending(self, now: Sliding) -> jax.Array:
        """Speed at which the bristles bend, in m/s."""
        direction = jnp.where(now.velocity >= 0.0, 1.0, -1.0)
        level = self.level(direction, now.velocity, now)
        return now.velocity - jnp.abs(now.velocity) * now.bristle / jnp.maximum(level, LEAST_LEVEL)


def first_band(laws: tuple[Effect, ...]) -> jax.Array | None:
    """Band of speed of a weight at rest: the number of limits below it; None where no law bends sharply over speed.

    The motion is taken apart at the `speeds` that laws name, so that it is gentle inside each band.
    """
    return jnp.int32(0) if any(law.speeds for law in laws) else None


def band_margin(laws: tuple[Effect, ...], band: Any, velocity: jax.Array) -> Any:
    """Positive while the speed stays in its band, in m/s; None where there are no bands."""
    if band is None:
        return None
    bent = [law for law in laws if law.speeds]
    limits = (0.0, *sorted({speed for law in bent for speed in law.speeds}))
    speed, margin = jnp.abs(velocity), jnp.asarray(1.0)
    for i, limit in enumerate(limits):
        if i:
            margin = jnp.where(band == i - 1, jnp.minimum(margin, limit - speed), margin)
            margin = jnp.where(band == i, speed - limit, margin)
    absent = jnp.array(True)
    for law in bent:
        absent &= law.absent()
    return jnp.where(absent, 1.0, margin)


def band_after(laws: tuple[Effect, ...], band: Any, velocity: jax.Array, crossed: jax.Array) -> Any:
    """The band after a limit has been crossed; None where there are no bands."""
    if band is None:
        return None
    limits = sorted({speed for law in laws for speed in law.speeds})
    after = sum(((jnp.abs(velocity) > limit).astype(band.dtype) for limit in limits), start=jnp.zeros_like(band))
    return jnp.where(crossed, after, band)
