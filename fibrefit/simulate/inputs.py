"""Measured inputs between the points of the grid."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax


class Signals(NamedTuple):
    """A measured input as a cubic between the points of the grid.

    Parameters
    ----------
    values : (n_time,) in SI units of the input
    slopes : (n_time,) its rate, per second
    """

    values: jax.Array
    slopes: jax.Array


def inputs_at(inputs: Any, times: jax.Array, step: jax.Array, time: jax.Array) -> Any:
    """Value and rate of each input at `time`, which lies in step `step` of the grid.

    Returns
    -------
    pytree like `inputs`, each `Signals` replaced by ``(value, rate)``.
    """
    length = times[step + 1] - times[step]
    s = (time - times[step]) / length

    def cubic(signal: Signals) -> tuple[jax.Array, jax.Array]:
        p0, p1 = signal.values[step], signal.values[step + 1]
        m0, m1 = signal.slopes[step] * length, signal.slopes[step + 1] * length
        c2, c3 = 3.0 * (p1 - p0) - 2.0 * m0 - m1, 2.0 * (p0 - p1) + m0 + m1
        return p0 + s * (m0 + s * (c2 + s * c3)), (m0 + s * (2.0 * c2 + 3.0 * s * c3)) / length

    return jax.tree.map(cubic, inputs, is_leaf=lambda node: isinstance(node, Signals))
