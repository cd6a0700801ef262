"""The trust region of optimistix, which knows that a cost is rounded."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx


class TrustRegion(optx.ClassicalTrustRegion[Any]):
    """Accept a step whose predicted reduction is less than the rounding of the cost, and let the next be shorter.

    At a minimum the predicted reductions of the last steps are hidden by rounding. Held to them, one step after the
    other is refused until rounding happens to be kind: half of a descent went into that.

    Parameters
    ----------
    rounding : float
        Share of the cost that may be rounding.
    """

    rounding: float = 0.0

    def step(
        self, first_step: jax.Array, y: Any, y_eval: Any, f_info: Any, f_eval_info: Any, state: Any
    ) -> tuple[Any, jax.Array, optx.RESULTS, Any]:
        """Size of the next step, whether this one is accepted, the result so far, and the next state."""
        size, accept, result, following = super().step(first_step, y, y_eval, f_info, f_eval_info, state)
        slack = self.rounding * f_info.as_min()
        hidden = self.predict_reduction(jax.tree.map(jnp.subtract, y_eval, y), f_info) > -slack
        accept = accept | (hidden & (f_eval_info.as_min() - f_info.as_min() <= slack))
        size = jnp.where(hidden, self.low_constant * state.step_size, size)
        return size, accept, result, eqx.tree_at(lambda of: of.step_size, following, size)
