"""Samples beside a jump of the reading: which side of it they were taken on hangs on microseconds."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp


def nearest_side(
    times: jax.Array, distances: jax.Array, instants: jax.Array, heights: jax.Array, number: Any = None
) -> jax.Array:
    """Distances of samples from a signal that jumps; beside a jump, from the nearer of what it is before and after.

    A jump that passes a sample as the parameters move would make the cost jump, by the square of its height in noise
    rms: the search would end at that wall, wherever it first meets it. A sample that a jump comes near goes over to
    whatever between both sides is nearest to it, so the cost is smooth, and a jump on the wrong side of a sample still
    pulls. What is further off than the jump is high is not explained by it: no jump hides a sample that strays.

    Parameters
    ----------
    times : (n_time,) in s
    distances : (n_channel, n_time)
        Simulated less measured.
    instants : (n_jump,) in s
        One after the other in time.
    heights : (n_channel, n_jump) in the unit of the distances
        After less before.
    number : () int, optional
        Jumps that there are; the rest of the rows is not looked at. All by default.
    """

    # Few of the rows are filled: one after the other is faster than all at once. What a jump leaves is handed on to the
    # next one by itself: a loop that also read what it writes would copy all samples at each jump.
    def pass_by(jump: jax.Array, carry: tuple[jax.Array, ...]) -> tuple[jax.Array, ...]:
        last, left, passed = carry
        instant, height = instants[jump], heights[:, jump]
        step = jnp.clip(jnp.searchsorted(times, instant, side="right") - 1, 0, times.shape[0] - 2)
        way = jnp.clip((instant - times[step]) / (times[step + 1] - times[step]), 0.0, 1.0)
        doubt = jnp.stack([(1.0 - way) ** 2 * (1.0 + 2.0 * way), way**2 * (3.0 - 2.0 * way)])
        other = jnp.stack([height, -height], axis=-1)
        here = jax.lax.dynamic_slice_in_dim(distances, step, 2, axis=-1)
        beside = jnp.stack([left[:, 1], here[:, 1]], axis=-1)
        now = jnp.where(step == last, left, jnp.where(step == last + 1, beside, here))
        nearer = jnp.clip(-now, jnp.minimum(other, 0.0), jnp.maximum(other, 0.0))
        left = now + doubt * nearer
        return step, left, jax.lax.dynamic_update_slice_in_dim(passed, left, step, axis=-1)

    nowhere, nothing = jnp.full((), -2, dtype=jnp.int32), jnp.zeros((len(distances), 2))
    rows = instants.shape[0] if number is None else number
    return jax.lax.fori_loop(0, rows, pass_by, (nowhere, nothing, distances))[2]
