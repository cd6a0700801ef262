"""Samples beside a jump of the reading: which side of it they were taken on hangs on microseconds."""

from __future__ import annotations

import jax
import jax.numpy as jnp

NOTICEABLE = 0.1
"""Height in noise rms above which a jump counts as one."""


def certainty(times: jax.Array, instants: jax.Array, heights: jax.Array) -> jax.Array:
    """How much each sample counts, from nothing at a jump to all of it one sampling interval away, ``(n_time,)``.

    A jump that passes a sample as the parameters move would make the cost jump, by the square of its height in noise
    rms: the search would end at that wall, wherever it first meets it. A sample that fades out as the jump comes near
    keeps the cost smooth, and a jump on the wrong side of a sample still pulls.

    Parameters
    ----------
    times : (n_time,) in s
    instants : (n_jump,) in s
    heights : (n_jump,) in units of the noise
    """
    step = jnp.clip(jnp.searchsorted(times, instants, side="right") - 1, 0, times.shape[0] - 2)
    way = jnp.clip((instants - times[step]) / (times[step + 1] - times[step]), 0.0, 1.0)
    noticed = heights**2 / (heights**2 + NOTICEABLE**2)
    behind, ahead = noticed * (1.0 - way) ** 2 * (1.0 + 2.0 * way), noticed * way**2 * (3.0 - 2.0 * way)
    doubt = jnp.zeros_like(times).at[step].add(behind).at[step + 1].add(ahead)
    return 1.0 - jnp.minimum(doubt, 1.0)
