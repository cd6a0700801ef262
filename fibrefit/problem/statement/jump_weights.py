"""Samples beside a jump of the reading: which side of it they were taken on hangs on microseconds."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp

NOTICEABLE = 0.1
"""Height in noise rms above which a jump counts as one."""


def certainty(times: jax.Array, instants: jax.Array, heights: jax.Array, number: Any = None) -> jax.Array:
    """How much each sample counts, from nothing at a jump to all of it one sampling interval away, ``(..., n_time)``.

    A jump that passes a sample as the parameters move would make the cost jump, by the square of its height in noise
    rms: the search would end at that wall, wherever it first meets it. A sample that fades out as the jump comes near
    keeps the cost smooth, and a jump on the wrong side of a sample still pulls.

    Parameters
    ----------
    times : (n_time,) in s
    instants : (n_jump,) in s
    heights : (..., n_jump) in units of the noise
    number : () int, optional
        Jumps that there are; the rest of the rows is not looked at. All by default.
    """
    noticed = heights**2 / (heights**2 + NOTICEABLE**2)

    # Few of the rows are filled: one after the other is faster than all at once.
    def fade(jump: jax.Array, doubt: jax.Array) -> jax.Array:
        instant, height = instants[jump], noticed[..., jump]
        step = jnp.clip(jnp.searchsorted(times, instant, side="right") - 1, 0, times.shape[0] - 2)
        way = jnp.clip((instant - times[step]) / (times[step + 1] - times[step]), 0.0, 1.0)
        behind, ahead = height * (1.0 - way) ** 2 * (1.0 + 2.0 * way), height * way**2 * (3.0 - 2.0 * way)
        beside = jnp.stack([behind, ahead], axis=-1)
        now = jax.lax.dynamic_slice_in_dim(doubt, step, 2, axis=-1)
        return jax.lax.dynamic_update_slice_in_dim(doubt, now + beside, step, axis=-1)

    doubt = jnp.zeros((*heights.shape[:-1], times.shape[0]))
    doubt = jax.lax.fori_loop(0, instants.shape[0] if number is None else number, fade, doubt)
    return 1.0 - jnp.minimum(doubt, 1.0)
