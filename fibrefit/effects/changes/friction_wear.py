"""Friction that grows or falls with the path travelled, as surfaces run in or wear."""

from __future__ import annotations

from typing import ClassVar, Self

import jax
import jax.numpy as jnp

from fibrefit.core.capability import Capability
from fibrefit.effects.law import LEAST, GuideLaw, Moment, quantity


class FrictionWear(GuideLaw):
    """Friction that grows or falls with the path travelled, as surfaces run in or wear.

    Law
    ---
    Level ``F_c max(0.02, 1 + a s)``, s the path of the weight to and fro within the record.

    Parameters
    ----------
    wear : () in 1/m
        a.

    Valid range
    -----------
    Paths short against that in which it would come to rest.

    Source
    ------
    Wear over sliding distance: Archard, J. Appl. Phys. 24 (1953) 981-988.
    """

    name: ClassVar[str] = "guide.friction_wear"
    # A path is told from where a record begins; in windows that begin anew there is none.
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.GUIDE, Capability.FIBRE})
    timed: ClassVar[bool] = True
    worn: ClassVar[bool] = True
    wear: jax.Array = quantity("1/m", "relative growth of Coulomb friction over the path", 0.5, lower=-5.0, upper=50.0)

    def as_of(self, moment: Moment) -> Self:
        """What has come together by then."""
        return self.scaled(moment.path)

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """F_c (max(0.02, 1 + a s) - 1)."""
        return coulomb * jnp.maximum(LEAST - 1.0, self.wear)
