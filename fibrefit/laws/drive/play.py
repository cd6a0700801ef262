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
    at first y = x. While the drive rests, y - x stays as it is: what its reading does then is noise, no motion.

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
    # Share of its largest rate below which a drive rests: the noise of a smoothed drive is a tenth of that, at slow
    # strokes up to half. Of a sine it leaves a five-thousandth of the amplitude beside each turning point.
    rests: ClassVar[float] = 0.02
    play: jax.Array = quantity("m", "lost motion of the drive", 2e-4, lower=0.0, upper=0.02, symbol="g")

    def passed_on(self, course: jax.Array, rates: jax.Array) -> tuple[jax.Array, jax.Array]:
        """``y`` and its rate."""
        moves = jnp.abs(rates) > self.rests * jnp.max(jnp.abs(rates))

        def follow(before: tuple, now: tuple) -> tuple[tuple, tuple]:
            (ahead, last), (here, moving) = before, now
            free = ahead - (here - last)
            taken = jnp.clip(free, 0.0, self.play)
            state = jnp.where(moving, taken, ahead), jnp.where(moving, here, last)
            return state, (state[0], moving & (free == taken) & (self.play > 0.0))

        ahead, runs_free = jax.lax.scan(follow, (jnp.zeros_like(course[0]), course[0]), (course, moves))[1]
        return course + ahead, jnp.where(runs_free, 0.0, rates)
