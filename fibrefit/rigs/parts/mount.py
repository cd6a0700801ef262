"""Where the drive holds the fibre: what is taken in, and a mount that yields."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp

from fibrefit.laws.law import DriveLaw


class Mount(eqx.Module):
    """A drive that moves the end of the fibre as measured, but for the laws that were added."""

    laws: tuple[DriveLaw, ...] = ()

    @property
    def may_yield(self) -> bool:
        """Whether the model has a mount that yields."""
        return any(law.yields for law in self.laws)

    def travel(self, drive: tuple[jax.Array, jax.Array], radius: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Fibre taken in, in m, and its rate, for the position and rate that were measured."""
        position, rate = drive
        for law in self.laws:
            position, rate = law.travel(position, rate, radius)
        return position, rate

    def compliance(self) -> jax.Array:
        """Displacement of the end of the fibre per tension, in m/N."""
        return sum((law.compliance() for law in self.laws), start=jnp.zeros(()))
