"""An innovations filter carried out in blocks of samples: matrix products in place of a step for each sample.

A filter that goes from sample to sample takes as long for one row of residuals as for ten, since each of its steps is
short. Within a block innovations are a triangular matrix times the residuals, and what came before enters by the state
at its beginning alone; only that is carried on from block to block.

Source
------
Block recursive filters: Burrus, IEEE Trans. Audio Electroacoust. 20 (1972).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.programs import kept_program
from fibrefit.core.threads import for_each
from fibrefit.problem.noise.coloured import Coloured, swapped

BLOCK = 32
"""Samples of a block: fewer make more blocks, more make larger matrices."""


class BlockFilter(eqx.Module):
    """The filter of a `Coloured`.

    Parameters
    ----------
    taps : (n_block, n_record, n_channel, BLOCK, BLOCK)
        Innovations from the residuals of the block.
    onto : (n_block, n_record, n_channel, BLOCK, n_state)
        Innovations from the states before it.
    drive : (n_block, n_record, n_channel, n_state, BLOCK)
        States after it from its residuals.
    carry : (n_block, n_record, n_channel, n_state, n_state)
        States after it from those before.
    """

    taps: jax.Array
    onto: jax.Array
    drive: jax.Array
    carry: jax.Array

    @property
    def channels(self) -> int:
        """Number of channels."""
        return self.taps.shape[2]

    def of_records(self, records: Sequence[int]) -> BlockFilter:
        """The filter of other records, each like one of these, whose places are given."""
        places = np.asarray(records)
        return BlockFilter(*(part[:, places] for part in (self.taps, self.onto, self.drive, self.carry)))

    def whiten(self, residuals: jax.Array) -> jax.Array:
        """Innovations of unit variance ``(n_record, n_channel, n_time)``; zero where a sample is masked."""
        return self.whiten_rows(residuals[None])[0]

    def whiten_rows(self, rows: jax.Array) -> jax.Array:
        """Innovations of many residuals at once, ``(n_row, n_record, n_channel, n_time)``."""
        number, time = len(self.taps), rows.shape[-1]
        padded = jnp.pad(rows, [(0, 0)] * 3 + [(0, number * BLOCK - time)])
        blocks = jnp.transpose(padded.reshape(*rows.shape[:3], number, BLOCK), (3, 1, 2, 4, 0))

        def on(state: jax.Array, block: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
            carry, driven = block
            return carry @ state + driven, state

        nothing = jnp.zeros((*self.carry.shape[1:4], len(rows)))
        _, before = jax.lax.scan(on, nothing, (self.carry, self.drive @ blocks))
        innovations = self.taps @ blocks + self.onto @ before
        return jnp.transpose(innovations, (4, 1, 2, 0, 3)).reshape(*rows.shape[:3], number * BLOCK)[..., :time]

    def whiten_many(self, records: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Innovations of so many residuals of each record ``(n_row, n_channel, n_seen)`` that products of matrices pay.

        NumPy's are several times as fast as those of a compiled program, in the precision of the rows. What is not seen
        of the end of a record is not needed.
        """
        return for_each(self._whitened, range(len(records)), records)

    def _whitened(self, r: int, some: np.ndarray) -> np.ndarray:
        """The same of one record."""
        time = some.shape[-1]
        number = -(-time // BLOCK)
        parts = self.taps, self.onto, self.drive, self.carry
        taps, onto, drive, carry = (np.asarray(part[:number], dtype=some.dtype) for part in parts)
        padded = np.pad(some, [(0, 0)] * 2 + [(0, number * BLOCK - time)])
        blocks = np.ascontiguousarray(padded.reshape(*some.shape[:2], number, BLOCK).transpose(2, 1, 3, 0))
        before = drive[:, r] @ blocks
        state = np.zeros_like(before[0])
        for block, after in zip(carry[:, r], before, strict=True):
            driven = after.copy()
            after[:] = state
            state = block @ state + driven
        innovations = taps[:, r] @ blocks
        innovations += onto[:, r] @ before
        return np.ascontiguousarray(innovations.transpose(3, 1, 0, 2).reshape(padded.shape)[..., :time])


@kept_program
def in_blocks(filtered: Coloured) -> BlockFilter:
    """A filter in blocks: what it makes of each sample of a block, and of each state before it."""
    lines, size = filtered.lines, filtered.along.shape[-1]
    read = slice(size - lines)
    number = -(-len(filtered.gain) // BLOCK)
    gain, scale = (_split(part, number) for part in (filtered.gain, filtered.inverse_scale))
    along, across = filtered.along[..., None, :], filtered.across[..., None, :]
    state = jnp.zeros((*gain.shape[1:4], BLOCK + size, size)).at[..., BLOCK:, :].set(jnp.eye(size))

    def step(state: jax.Array, here: tuple[jax.Array, jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        impulse, gain, scale = here
        innovation = impulse - jnp.sum(state[..., read], axis=-1)
        state = state + gain[..., None, :] * innovation[..., None]
        after = along * state
        return after + across * swapped(state, lines) if lines else after, innovation * scale[..., None]

    end, made = jax.lax.scan(step, state, (jnp.eye(BLOCK, BLOCK + size), gain, scale))
    made, end = jnp.moveaxis(made, 0, -2), jnp.swapaxes(end, -1, -2)
    return BlockFilter(made[..., :BLOCK], made[..., BLOCK:], end[..., :BLOCK], end[..., BLOCK:])


def _split(part: jax.Array, number: int) -> jax.Array:
    """What belongs to each sample of a block, ``(BLOCK, n_block, ...)``; padded with nothing."""
    padded: Any = jnp.pad(part, [(0, number * BLOCK - len(part)), *[(0, 0)] * (part.ndim - 1)])
    return jnp.swapaxes(padded.reshape(number, BLOCK, *part.shape[1:]), 0, 1)
