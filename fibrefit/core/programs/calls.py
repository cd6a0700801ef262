"""A call of a compiled program: its arrays, which vary, and all else, which the program was made for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax


class Call(NamedTuple):
    """Arguments of a call but for the values of its arrays.

    Parameters
    ----------
    fixed : list
        Leaves of the arguments; None in the place of each array.
    tree : PyTreeDef
    places : list of int
        Of the arrays among the leaves.
    shapes : tuple
        Shape, type and weakness of the type of each array.
    """

    fixed: list[Any]
    tree: Any
    places: list[int]
    shapes: tuple[Any, ...]

    def with_(self, arrays: Sequence[Any]) -> Any:
        """The arguments with other arrays."""
        leaves = list(self.fixed)
        for place, array in zip(self.places, arrays, strict=True):
            leaves[place] = array
        return jax.tree.unflatten(self.tree, leaves)


def parted(args: tuple[Any, ...]) -> tuple[Call, list[Any]]:
    """A call with such arguments, and its arrays."""
    leaves, tree = jax.tree.flatten(args)
    places = [i for i, leaf in enumerate(leaves) if eqx.is_array(leaf)]
    arrays = [leaves[i] for i in places]
    fixed = [None if eqx.is_array(leaf) else leaf for leaf in leaves]
    return Call(fixed, tree, places, tuple(map(_shape, arrays))), arrays


def _shape(array: Any) -> tuple[Any, ...]:
    return array.shape, array.dtype, getattr(array, "weak_type", False)
