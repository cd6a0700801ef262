"""Products of long arrays within compiled programs that are the same to the last bit for any number of threads.

A product of matrices is shared out among threads by the compiler's library, along the sum where that is what is long:
each number of threads then has last digits of its own. A product of few samples is worth one thread only, and blocks of
products are added in a fixed order.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

BLOCK = 128
"""Samples that are summed in one go. Of 256, a product of 65 rows is shared out among eight threads; of 128, none of up
to 400 rows is."""


def row_products(rows: jax.Array, others: jax.Array) -> jax.Array:
    """Products of each row with each other one, ``(..., k, n)`` and ``(..., l, n)`` to ``(..., k, l)``."""
    return jnp.sum(jnp.einsum("...kbn,...lbn->...bkl", _in_blocks(rows, -1), _in_blocks(others, -1)), axis=-3)


def column_products(columns: jax.Array, others: jax.Array) -> jax.Array:
    """Products of each column with each other one, ``(..., n, k)`` and ``(..., n, l)`` to ``(..., k, l)``."""
    return jnp.sum(jnp.einsum("...bnk,...bnl->...bkl", _in_blocks(columns, -2), _in_blocks(others, -2)), axis=-3)


def _in_blocks(array: jax.Array, axis: int) -> jax.Array:
    """An array whose long axis ``(n,)`` has become two, ``(n_block, BLOCK)``, padded with zeros."""
    place = array.ndim + axis
    number = -(-array.shape[place] // BLOCK)
    padding = [(0, 0)] * array.ndim
    padding[place] = (0, number * BLOCK - array.shape[place])
    return jnp.pad(array, padding).reshape(*array.shape[:place], number, BLOCK, *array.shape[place + 1 :])
