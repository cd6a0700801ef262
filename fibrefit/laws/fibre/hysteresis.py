from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.law import FibreLaw, Memory, quantity


class Hysteresis(FibreLaw):
    """Rate-independent hysteresis of strands that rub on each other.

    Law
    ---
    ``+ k_h z``, ``z' = ė - β |ė| z - γ ė |z|``; z = 0 while slack.

    Valid range
    -----------
    |γ| ≤ β, else a loop may release energy.

    Source
    ------
    Bouc (1967) and Wen, J. Eng. Mech. Div. 102 (1976) 249-263.
    """

    name: ClassVar[str] = "fibre.hysteresis"
    memory: ClassVar[tuple[str, ...]] = ("hysteretic_stretch",)
    forgets: ClassVar[bool] = True
    hysteretic_stiffness: jax.Array = quantity(
        "N/m", "stiffness of the rubbing part", 3e3, lower=0.0, upper=1e6, symbol="k_h"
    )
    beta: jax.Array = quantity("1/m", "loop shape: dissipation", 600.0, lower=5.0, upper=3e3, log=True, symbol="β")
    gamma: jax.Array = quantity(
        "1/m", "loop shape: difference of loading and unloading", 300.0, lower=-2e3, upper=2e3, symbol="γ"
    )

    def tension(self, stiffness: jax.Array, stretch: jax.Array, rate: jax.Array, memory: Memory) -> jax.Array:
        """k_h z."""
        return self.hysteretic_stiffness * memory[0]

    def memory_rate(self, stretch: jax.Array, rate: jax.Array, memory: Memory, slack: jax.Array) -> Memory:
        """Rate of z."""
        (z,) = memory
        change = rate - self.beta * jnp.abs(rate) * z - self.gamma * rate * jnp.abs(z)
        return (jnp.where(slack, 0.0, change),)

    def when_slack(self, memory: Memory) -> Memory:
        """A slack fibre has forgotten."""
        return (jnp.zeros_like(memory[0]),)
