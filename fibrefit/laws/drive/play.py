from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.law import DriveLaw, quantity


class Play(DriveLaw):
    """A drive with play: after each reversal it runs free before it takes the fibre along.

    Law
    ---
    The end of the fibre y keeps ``x <= y <= x + g`` of the measured drive x, and moves only where it must;
    at first y = x.

    Valid range
    -----------
    A joint that its own friction holds where it is; taken from sample to sample.

    Source
    ------
    The play operator, e.g. Visintin, Differential Models of Hysteresis (1994), ch. 3.
    """

    name: ClassVar[str] = "drive.play"
    remembers: ClassVar[bool] = True
    # Without play the end of the fibre lies at both ends of it, and a derivative would be half of what it is.
    singular: ClassVar[float] = 0.1
    play: jax.Array = quantity("m", "lost motion of the drive", 2e-4, lower=0.0, upper=0.02, symbol="g")

    def passed_on(self, course: jax.Array, rates: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Y and its rate."""

        def follow(before: jax.Array, here: jax.Array) -> tuple[jax.Array, jax.Array]:
            now = jnp.clip(before, here, here + self.play)
            return now, now

        end = jax.lax.scan(follow, course[0], course)[1]
        taken = (end == course) | (end == course + self.play)
        return end, jnp.where(taken, rates, 0.0)
