"""Bands of speed: the motion is taken apart where a law bends sharply, so that it is gentle inside each part."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp

from fibrefit.laws.law import Effect


class SpeedBands(eqx.Module):
    """Bands of speed of the weight, as a mode: the number of limits below it.

    Parameters
    ----------
    laws : tuple of Effect
        Those that name `speeds`.
    """

    laws: tuple[Effect, ...] = ()

    @classmethod
    def of(cls, laws: tuple[Effect, ...]) -> SpeedBands | None:
        """Bands for some laws; None where none of them bends."""
        bent = tuple(law for law in laws if law.speeds)
        return cls(bent) if bent else None

    def margin(self, band: jax.Array, velocity: jax.Array) -> jax.Array:
        """Positive while the speed stays in the band, in m/s."""
        limits = (0.0, *sorted({speed for law in self.laws for speed in law.speeds}))
        speed, margin = jnp.abs(velocity), jnp.asarray(1.0)
        for i, limit in enumerate(limits):
            if i:
                margin = jnp.where(band == i - 1, jnp.minimum(margin, limit - speed), margin)
                margin = jnp.where(band == i, speed - limit, margin)
        return jnp.where(self._absent(), 1.0, margin)

    def switch(self, band: jax.Array, velocity: jax.Array, crossed: jax.Array) -> jax.Array:
        """The band after a limit has been crossed."""
        limits = sorted({speed for law in self.laws for speed in law.speeds})
        after = sum(((jnp.abs(velocity) > limit).astype(band.dtype) for limit in limits), start=jnp.zeros_like(band))
        return jnp.where(crossed, after, band)

    def _absent(self) -> jax.Array:
        zero = jnp.array(True)
        for law in self.laws:
            zero &= law.absent()
        return zero
