"""Laws of the drive: a mount that yields, and play."""

from __future__ import annotations

import math
from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.core.declarations import inverse_of
from fibrefit.laws.law import DriveLaw, quantity


class Compliance(DriveLaw):
    """A mount of the drive that yields to the pull of the fibre.

    Law
    ---
    A spring k_d between the measured drive and the end of the fibre: ``T = k_d δ``, ``e = x - δ - u``; while the fibre
    is slack, no force in it.

    Valid range
    -----------
    The mass of the mount is small against that of the weight.

    Source
    ------
    Two springs in series, one of them damped.
    """

    name: ClassVar[str] = "drive.compliance"
    yields: ClassVar[bool] = True
    stiff: ClassVar[bool] = True
    singular: ClassVar[float] = 0.1
    mount_stiffness: jax.Array = quantity(
        "N/m", "stiffness of the mount of the drive", 2e5, lower=1e3, null=math.inf, reciprocal=True, symbol="k_d"
    )

    def compliance(self) -> jax.Array:
        """1/k_d."""
        return inverse_of(self.mount_stiffness)


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
