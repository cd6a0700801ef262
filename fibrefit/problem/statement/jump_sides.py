"""Samples beside a jump of the reading: which side of it they were taken on hangs on microseconds."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from fibrefit.simulation.inputs import row
from fibrefit.simulation.switched import write


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
    size = times.shape[0]
    rows = jnp.int32(instants.shape[0]) if number is None else number
    steps = jnp.clip(jnp.searchsorted(times, instants, side="right") - 1, 0, size - 2)
    way = jnp.clip((instants - times[steps]) / (times[steps + 1] - times[steps]), 0.0, 1.0)
    jumps = _Jumps(
        steps,
        jnp.concatenate([jnp.full(1, -2), steps[:-1]]),
        jnp.stack([(1.0 - way) ** 2 * (1.0 + 2.0 * way), way**2 * (3.0 - 2.0 * way)], axis=-1)[:, None],
        jnp.stack([heights, -heights], axis=-1).swapaxes(0, 1),
        jnp.stack([distances[:, steps], distances[:, steps + 1]], axis=-1).swapaxes(0, 1),
    )
    passed = _passed_by(jumps, rows)
    # Each sample is as the last jump beside it leaves it.
    place = jnp.arange(instants.shape[0])
    following = jnp.where(place + 1 < rows, jnp.roll(steps, -1), size)
    first = jnp.where((place < rows) & (following > steps), steps, size)
    second = jnp.where((place < rows) & (following > steps + 1), steps + 1, size)
    for samples, left in ((first, passed[..., 0]), (second, passed[..., 1])):
        distances = distances.at[:, samples].set(left.T, mode="drop")
    return distances


class _Jumps(NamedTuple):
    """What jumps, one after the other in time, do to the two samples beside each of them.

    Parameters
    ----------
    step, before : (n_jump,) int
        The first of these samples, and that of the jump before.
    doubt : (n_jump, 1, 2)
        Share in which a sample may be on the other side.
    other : (n_jump, n_channel, 2)
        What lies between here and there, as seen from each sample.
    here : (n_jump, n_channel, 2)
        Distances of the samples.
    """

    step: jax.Array
    before: jax.Array
    doubt: jax.Array
    other: jax.Array
    here: jax.Array


def _passed_by(jumps: _Jumps, rows: jax.Array) -> jax.Array:
    """Distances of the samples beside the first `rows` jumps when each has passed, ``(n_jump, n_channel, 2)``.

    Few of the rows are filled: one after the other is faster than all at once. The loop holds nothing but these
    samples: one that held all distances would copy them, with all their tangents, at each jump.
    """

    def pass_by(number: jax.Array, carry: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        left, passed = carry
        jump: _Jumps = jax.tree.map(lambda part: row(part, number), jumps)
        # A sample beside two jumps is handed on from one to the next.
        beside = jnp.stack([left[:, 1], jump.here[:, 1]], axis=-1)
        now = jnp.where(jump.step == jump.before, left, jnp.where(jump.step == jump.before + 1, beside, jump.here))
        nearer = jnp.clip(-now, jnp.minimum(jump.other, 0.0), jnp.maximum(jump.other, 0.0))
        left = now + jump.doubt * nearer
        return left, write(passed, number, left)

    start = jnp.zeros_like(jumps.here[0]), jnp.zeros_like(jumps.here)
    return jax.lax.fori_loop(0, rows, pass_by, start)[1]
