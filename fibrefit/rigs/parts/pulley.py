"""Between drive and weight: the mount of the drive, the path of the fibre over a pulley, and its rim if that moves."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp

from fibrefit.laws.law import DriveLaw, PulleyLaw
from fibrefit.rigs.parts.guide import Guide


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


RIM_OF_A_RUBBING_PULLEY = 0.05
"""Mass of the rim, in kg, where its bearing rubs and nothing is known of its inertia."""


class Path(eqx.Module):
    """Length of fibre between pulley and weight.

    Law
    ---
    ``ℓ(u) = sqrt((s - u)^2 + d^2)``; the weight at u takes up ``ℓ(0) - ℓ(u)``. Without lateral offset that is u.

    Parameters
    ----------
    lateral_offset : () in m
        d, distance of the weight from the plane of the pulley.
    guide_distance : () in m
        s, distance along the guide from u = 0 to the foot of the pulley.
    """

    lateral_offset: jax.Array
    guide_distance: jax.Array

    def follow(self, position: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Fibre the weight has given back, in m, and the cosine between fibre and guide."""
        askew = self.lateral_offset > 0.0
        ahead = self.guide_distance - position
        length = jnp.sqrt(jnp.where(askew, ahead**2 + self.lateral_offset**2, 1.0))
        return jnp.where(askew, self._whole() - length, position), jnp.where(askew, ahead / length, 1.0)

    def position(self, given_back: jax.Array) -> jax.Array:
        """Position of the weight, in m."""
        askew = self.lateral_offset > 0.0
        length = self._whole() - given_back
        ahead = jnp.sqrt(jnp.where(askew, length**2 - self.lateral_offset**2, 1.0))
        return jnp.where(askew, self.guide_distance - ahead, given_back)

    def _whole(self) -> jax.Array:
        return jnp.sqrt(jnp.where(self.lateral_offset > 0.0, self.guide_distance**2 + self.lateral_offset**2, 1.0))


class Pulley(eqx.Module):
    """A pulley that turns without resistance, but for the laws that were added.

    Parameters
    ----------
    radius : () in m
    wrap_angle : () in rad
    near_share : () a pure number
        Share of the fibre between drive and rim.
    """

    radius: jax.Array
    wrap_angle: jax.Array
    near_share: jax.Array
    laws: tuple[PulleyLaw, ...] = ()

    @property
    def turns(self) -> bool:
        """Whether the model has a rim that moves by itself."""
        return any(law.turns for law in self.laws)

    @property
    def rubs(self) -> bool:
        """Whether the model has a bearing that holds the rim."""
        return any(law.rubs for law in self.laws)

    def turning(self) -> jax.Array:
        """Whether such a rim is there now, and not only at the null value of its laws."""
        return (self._inertia() > 0.0) | (self._rubbing() > 0.0)

    def mass(self) -> jax.Array:
        """Mass of the rim, in kg."""
        inertia = self._inertia()
        return jnp.where(inertia > 0.0, inertia, RIM_OF_A_RUBBING_PULLEY)

    def bearing(self) -> Guide:
        """The bearing, as a guide of the rim."""
        return Guide(self._rubbing())

    def grip(self, velocity: jax.Array) -> jax.Array:
        """Factor on the tension that reaches the weight."""
        factor = jnp.ones(())
        for law in self.laws:
            factor = factor * law.grip(self.wrap_angle, velocity)
        return factor

    def _inertia(self) -> jax.Array:
        return sum((law.inertia() for law in self.laws), start=jnp.zeros(()))

    def _rubbing(self) -> jax.Array:
        return sum((law.rubbing() for law in self.laws), start=jnp.zeros(()))
