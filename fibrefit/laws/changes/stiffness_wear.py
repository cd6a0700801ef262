from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.law import FibreLaw, Memory, quantity


class StiffnessWear(FibreLaw):
    """A stiffness that grows or fades with use, load cycle by load cycle.

    Law
    ---
    ``+ k e a s``, s the path of stretching to and fro within the record: ``s' = |e'|``
    while it carries; a cycle of amplitude A adds 4 A.

    Valid range
    -----------
    |a s| well below 1.

    Source
    ------
    Damage that adds up over cycles: Miner, J. Appl. Mech. 12 (1945) A159-A164.
    """

    name: ClassVar[str] = "fibre.stiffness_wear"
    memory: ClassVar[tuple[str, ...]] = ("stretching",)
    wear: jax.Array = quantity(
        "1/m", "relative growth of the stiffness over the path of stretching", -0.5, lower=-5.0, upper=50.0, symbol="a"
    )

    def tension(self, stiffness: jax.Array, stretch: jax.Array, rate: jax.Array, memory: Memory) -> jax.Array:
        """Elastic tension times a s."""
        return stiffness * stretch * self.wear * memory[0]

    def memory_rate(self, stretch: jax.Array, rate: jax.Array, memory: Memory, slack: jax.Array) -> Memory:
        """|e'| while the fibre carries."""
        return (jnp.where(slack, 0.0, jnp.abs(rate)),)
