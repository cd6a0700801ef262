"""Blocks of time: each has the density of its own readings, at the noise of their channels."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import jax.numpy as jnp
import numpy as np
from scipy.stats import norm

from fibrefit.sampling import predict
from fibrefit.sampling.density.likelihood import Likelihood

#: Of two channels the first was measured in the first half alone.
WEIGHT = {"force": np.array([[1.0, 1.0, 0.0, 0.0]]), "position": np.ones((1, 4))}
BLOCKS = np.array([[0, 0, 1, 1]])
RESIDUALS = np.where(
    np.stack(list(WEIGHT.values()), axis=1) > 0.0, np.array([[[0.3, -2.0, 0, 0], [1, 4, -3, 0.5]]]), 0.0
)


class White:
    """No colour."""

    log_scale = 0.0

    def whiten(self, residuals: Any) -> Any:
        return residuals


class Density:
    """Noise levels of both channels are unknown; residuals are what they are."""

    def __init__(self) -> None:
        counts = jnp.array([2.0, 4.0])
        white = cast(Any, White())
        self.likelihood = Likelihood(white, counts, jnp.zeros(()), ("force", "position"), (False, False))
        observations = SimpleNamespace(weight=WEIGHT)
        self.problem = SimpleNamespace(observations=observations)

    def split(self, point: Any) -> tuple[Any, Any]:
        return None, point


def test_a_block_has_the_levels_of_the_channels_it_holds() -> None:
    levels = np.array([0.5, 3.0])
    points, white = jnp.log(jnp.asarray(levels))[None], jnp.asarray(RESIDUALS)[None]
    found = np.asarray(predict._blockwise(cast(Any, Density()), white, points, jnp.asarray(BLOCKS), 3))[0]
    each = norm.logpdf(RESIDUALS[0], scale=levels[:, None])
    whole = np.where([WEIGHT["force"][0] > 0.0, WEIGHT["position"][0] > 0.0], each, 0.0).sum(axis=0)
    np.testing.assert_allclose(found, [whole[:2].sum(), whole[2:].sum(), 0.0], rtol=1e-6, atol=1e-9)
