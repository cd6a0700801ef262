from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.law import FibreLaw, Memory, quantity


class Creep(FibreLaw):
    """A fibre that creeps: under load it lengthens, and stays so.

    Law
    ---
    ``- k r z``, ``z' = max(e - r z, 0)``: the whole fibre in series with a dashpot k/r.

    Valid range
    -----------
    Creep within one record; what came before it is part of the free length.

    Source
    ------
    The Maxwell body, e.g. Flügge, Viscoelasticity (1975), ch. 1.
    """

    name: ClassVar[str] = "fibre.creep"
    memory: ClassVar[tuple[str, ...]] = ("stretch_over_time",)
    creep_rate: jax.Array = quantity(
        "1/s", "rate of creep over the elastic stretch", 0.05, lower=0.0, upper=50.0, symbol="r"
    )

    def tension(self, stiffness: jax.Array, stretch: jax.Array, rate: jax.Array, memory: Memory) -> jax.Array:
        """- k r z."""
        return -stiffness * self.creep_rate * memory[0]

    def memory_rate(self, stretch: jax.Array, rate: jax.Array, memory: Memory, slack: jax.Array) -> Memory:
        """Rate of z."""
        return (jnp.maximum(stretch - self.creep_rate * memory[0], 0.0),)
