"""The likelihood of readings in coarse steps beside errors of measured inputs.

Errors of inputs are found from readings taken for fine ones first, which is linear; at these errors the likelihood of
the steps is linearised once more, its slope that where readings were linearised. What errors do to it from there on is
little: a part of a step.

Law
---
With readings ``e + S w`` of errors ``w ~ N(0, I)``, in units of the noise, ``w1`` those that leave least of fine
readings, and deviance residuals ``d``: ``min |d(e + S w)|^2 + |w|^2`` is that of ``d(e + S w1) + D S (w - w1)``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.inputs.sensitivities import InputSensitivities
from fibrefit.problem.noise.rounding import before_rounding
from fibrefit.problem.statement.observations import Steps, rows_in_steps

_in_steps = jax.jit(rows_in_steps)


@dataclass(frozen=True)
class StepLikelihood:
    """What readings in coarse steps say, given residuals of readings taken for fine ones.

    Parameters
    ----------
    channels : tuple of str
        In the order of the residuals.
    steps : mapping of channel to Steps
        Of those that are read in coarse ones.
    fine : InputSensitivities or None
        Of readings taken for fine ones; None where no input is noisy.
    slope : (n_record, n_channel * n_time) or None
        Of the likelihood's residuals with those of fine readings, where these were linearised.
    """

    channels: tuple[str, ...]
    steps: Mapping[str, Steps]
    fine: InputSensitivities | None = None
    slope: np.ndarray | None = None

    def rows(self, rows: jax.Array, weights: Mapping[str, Any]) -> jax.Array:
        """Residuals of fine readings and their changes as those of readings in steps.

        Parameters
        ----------
        rows : (n_record, n_row, n_channel * n_time) in units of the noise
            Residuals first, of inputs without errors where they are noisy.
        weights : mapping of channel to (n_record, n_time) per SI unit
        """
        if self.fine is None or self.slope is None:
            return self._seen(rows, weights)
        without = jnp.asarray(self.fine.left(np.asarray(rows[:, :1])))
        seen = self._seen(rows.at[:, :1].set(without), weights)
        return seen.at[:, 0].add(self.slope * (rows - without)[:, 0])

    def _seen(self, rows: jax.Array, weights: Mapping[str, Any]) -> jax.Array:
        parts = jnp.split(rows, len(self.channels), axis=2)
        for c, channel in enumerate(self.channels):
            if channel in self.steps:
                parts[c] = _in_steps(parts[c], jnp.asarray(weights[channel]), self.steps[channel])
        return jnp.concatenate(parts, axis=2)

    @cached_property
    def sensitivities(self) -> InputSensitivities | None:
        """To errors of inputs, of what readings in steps say."""
        return None if self.fine is None or self.slope is None else self.fine.scaled(self.slope)


def step_likelihood(
    channels: Sequence[str],
    known: Mapping[str, Steps],
    residuals: np.ndarray,
    weights: Mapping[str, Any],
    fine: InputSensitivities | None,
) -> StepLikelihood:
    """Likelihood of readings in coarse steps, with the noise before rounding that is most probable where they are.

    Parameters
    ----------
    channels : sequence of str
    known : mapping of channel to Steps
        Before anything is known of the noise before rounding.
    residuals : (n_record, n_channel * n_time) in units of the noise
        Of readings taken for fine ones, of inputs without errors where they are noisy.
    weights : mapping of channel to (n_record, n_time) per SI unit
    fine : InputSensitivities or None
    """
    left = residuals if fine is None else fine.left(residuals[:, None])[:, 0]
    away = left.reshape(len(left), len(channels), -1)
    found = {}
    for c, channel in enumerate(channels):
        if channel in known:
            weight, level = np.asarray(weights[channel]), np.asarray(known[channel].level)[:, None]
            seen = weight > 0.0
            distance, share = away[:, c][seen] / weight[seen], (weight * level)[seen] ** 2
            found[channel] = before_rounding(known[channel], distance, share)
    plain = StepLikelihood(tuple(channels), found)
    if fine is None or not found:
        return plain
    rows = jnp.stack([jnp.asarray(left), jnp.ones_like(left)], axis=1)
    return StepLikelihood(plain.channels, found, fine, np.asarray(plain.rows(rows, weights)[:, 1]))
