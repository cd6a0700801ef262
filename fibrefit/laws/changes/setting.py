from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.law import FibreLaw, Memory, quantity


class Setting(FibreLaw):
    """A fibre that sets: its free length grows with use, load cycle by load cycle.

    Law
    ---
    ``- k x s``, s the path of stretching to and fro within the record: ``s' = |e'|`` while it carries.

    Valid range
    -----------
    Small against the stretch.

    Source
    ------
    Bedding in of ropes, e.g. Feyrer, Wire Ropes (2015), ch. 2.
    """

    name: ClassVar[str] = "fibre.setting"
    memory: ClassVar[tuple[str, ...]] = ("stretching",)
    setting: jax.Array = quantity(
        "-", "growth of the free length over the path of stretching", 2e-3, lower=0.0, upper=0.5, symbol="x"
    )

    def tension(self, stiffness: jax.Array, stretch: jax.Array, rate: jax.Array, memory: Memory) -> jax.Array:
        """- k x s."""
        return -stiffness * self.setting * memory[0]

    def memory_rate(self, stretch: jax.Array, rate: jax.Array, memory: Memory, slack: jax.Array) -> Memory:
        """|e'| while the fibre carries."""
        return (jnp.where(slack, 0.0, jnp.abs(rate)),)
