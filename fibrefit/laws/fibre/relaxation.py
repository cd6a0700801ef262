"""Springs and dashpots of Maxwell: in series with the fibre it creeps, beside it a part of the tension relaxes."""

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


class MaxwellBranch(FibreLaw):
    """Maxwell element parallel to the fibre (standard linear solid): tension that relaxes.

    Law
    ---
    ``+ k_1 (e - q)``, ``q' = (e - q)/τ``; while slack ``q' = -q/τ``.

    Valid range
    -----------
    τ from the sampling interval to the length of a record; a shorter one is damping, a longer one stiffness.

    Source
    ------
    The standard linear solid, e.g. Flügge, Viscoelasticity (1975), ch. 1.
    """

    name: ClassVar[str] = "fibre.maxwell_branch"
    memory: ClassVar[tuple[str, ...]] = ("dashpot_stretch",)
    branch_stiffness: jax.Array = quantity(
        "N/m", "stiffness of the relaxing branch", 3e3, lower=0.0, upper=1e6, symbol="k_1"
    )
    relaxation_time: jax.Array = quantity(
        "s", "time in which it relaxes", 0.02, lower=5e-4, upper=10.0, log=True, symbol="τ"
    )

    def tension(self, stiffness: jax.Array, stretch: jax.Array, rate: jax.Array, memory: Memory) -> jax.Array:
        """k_1 (e - q)."""
        return self.branch_stiffness * (stretch - memory[0])

    def memory_at_rest(self, stretch: jax.Array) -> Memory:
        """Relaxed: q = e."""
        return (jnp.maximum(stretch, 0.0),)

    def memory_rate(self, stretch: jax.Array, rate: jax.Array, memory: Memory, slack: jax.Array) -> Memory:
        """Creep of the dashpot."""
        return ((jnp.maximum(stretch, 0.0) - memory[0]) / self.relaxation_time,)
