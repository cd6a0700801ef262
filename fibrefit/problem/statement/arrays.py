"""One formula for both kinds of arrays: NumPy's where nothing is compiled, JAX's inside compiled programs."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

RAN_AWAY = np.errstate(over="ignore", invalid="ignore")
"""Decorates products of slopes: of a motion that ran away they are not finite, and not believed where they are used."""


def functions_for(array: Any) -> Any:
    """`jax.numpy` for what JAX holds or traces, `numpy` for all else: a number at hand needs no compiler."""
    return jnp if isinstance(array, jax.Array) else np
