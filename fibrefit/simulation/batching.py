"""Batching rule of the simulator: tangents of one run in one batch, runs one after the other.

Each run of a batch meets its switches at instants of its own; in lock step all would wait for each. The tangents of
one run share everything but themselves.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax.custom_batching import custom_vmap
from jax.custom_derivatives import SymbolicZero

Push = Callable[[Any, Any], tuple[Any, Any]]


def sequential(push: Push) -> Push:
    """A function with a batching rule of its own: vmap over runs is sequential, over tangents it is one larger batch.

    Parameters
    ----------
    push : callable ``(given, tangents) -> (found, moved)``
        Each leaf of `tangents` and of `moved` has an axis of tangents in front; `found` does not depend on them.
    """

    @custom_vmap
    def both(given: Any, tangents: Any) -> tuple[Any, Any]:
        return push(given, tangents)

    @both.def_vmap
    def rule(size: int, batched: Any, given: Any, tangents: Any) -> Any:
        tangents_only = not any(jax.tree.leaves(batched[0]))
        if tangents_only:
            found, moved = _merged(both, size, batched[1], given, tangents)
        else:
            found, moved = _run_by_run(both, batched, (given, tangents))
        return (found, moved), (jax.tree.map(lambda _: not tangents_only, found), jax.tree.map(lambda _: True, moved))

    return both


def _run_by_run(push: Push, batched: Any, whole: tuple) -> tuple[Any, Any]:
    leaves, tree = jax.tree.flatten(whole)
    flags = jax.tree.leaves(batched)

    def one(rows: list[jax.Array]) -> tuple[Any, Any]:
        own = iter(rows)
        whole = [next(own) if flag else leaf for leaf, flag in zip(leaves, flags, strict=True)]
        return push(*jax.tree.unflatten(tree, whole))

    return jax.lax.map(one, [leaf for leaf, flag in zip(leaves, flags, strict=True) if flag])


def _merged(push: Push, size: int, batched: Any, given: Any, tangents: Any) -> tuple[Any, Any]:
    """A batch of batches of tangents is one batch."""

    def merged(tangent: jax.Array, flag: bool) -> jax.Array:
        rows = tangent if flag else jnp.broadcast_to(tangent, (size, *tangent.shape))
        return rows.reshape(-1, *rows.shape[2:])

    found, moved = push(given, jax.tree.map(merged, tangents, batched))
    return found, jax.tree.map(lambda rows: rows.reshape(size, -1, *rows.shape[1:]), moved)


def nonzero_leaves(tangents: Any) -> tuple[int, ...]:
    """Numbers of the leaves whose tangents are not symbolically zero."""
    return tuple(i for i, d in enumerate(jax.tree.leaves(tangents)) if not isinstance(d, SymbolicZero))


def materialise(tangent: Any) -> jax.Array:
    """A tangent as an array: zeros for a symbolic zero."""
    return jnp.zeros(tangent.shape, tangent.dtype) if isinstance(tangent, SymbolicZero) else tangent


def partition(whole: Any, which: tuple[int, ...]) -> tuple[list[Any], Callable[[list[Any]], Any]]:
    """Partition of a pytree: the leaves of the given numbers, and the function that puts others in their place."""
    leaves, tree = jax.tree.flatten(whole)

    def with_(some: list[Any]) -> Any:
        now = dict(zip(which, some, strict=True))
        return jax.tree.unflatten(tree, [now.get(i, leaf) for i, leaf in enumerate(leaves)])

    return [leaves[i] for i in which], with_
