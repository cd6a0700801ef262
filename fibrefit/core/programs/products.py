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


def column_products(columns: jax.Array, others: jax.Array) -> jax.Array:
    """Products of each column with each other one, ``(..., n, k)`` and ``(..., n, l)`` to ``(..., k, l)``."""
    return jnp.sum(jnp.einsum("...bnk,...bnl->...bkl", _in_blocks(columns), _in_blocks(others)), axis=-3)


def _in_blocks(columns: jax.Array) -> jax.Array:
    """Columns ``(..., n, k)`` as ``(..., n_block, BLOCK, k)``, padded with zeros."""
    *before, n, k = columns.shape
    padding = [(0, 0)] * len(before) + [(0, -n % BLOCK), (0, 0)]
    return jnp.pad(columns, padding).reshape(*before, -(-n // BLOCK), BLOCK, k)
