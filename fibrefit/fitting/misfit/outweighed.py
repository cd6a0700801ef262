"""Whether what a model leaves unexplained is more than what a value does in the readings at all.

A value is determined by its own trace: what the readings would lack without it, and nothing else can imitate. What is
left beyond the noise shows a fault in the model or in what the study states; of such a fault the values took up as much
as they could, and nobody knows how much that was. Where what is left is the larger of the two, the value may be nothing
but that.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fibrefit.fitting.thresholds import NO_FACTOR, OUTWEIGHED
from fibrefit.fitting.uncertainty import Scores, sandwich
from fibrefit.problem.statement.layout import Layout
from fibrefit.problem.thresholds import GAP_OF_NOISE


class Outweighed(NamedTuple):
    """A value whose trace is outweighed.

    Parameters
    ----------
    value : float in SI units
    ratio, most : float
        What is left over what the value does in the readings, and the most that passes.
    """

    name: str
    value: float
    unit: str
    ratio: float
    most: float = OUTWEIGHED


def outweighed(layout: Layout, values: np.ndarray, scores: Scores) -> Outweighed | None:
    """The value whose trace is outweighed most; None where none is.

    Parameters
    ----------
    values : (n_free,) in SI units
    scores : Scores
        At these values.

    Law
    ---
    ``sqrt(e (H^-1)_jj) / |θ_j| > 1`` with e the sum of squares beyond the noise: both sums of squares have the same
    unit, so that neither noise nor number of samples matter. Values that may have either sign are small by accident,
    and those the records do not see at all are reported elsewhere.
    """
    variance = np.diag(sandwich(*(scores.normal_matrix(),) * 2))
    worst: Outweighed | None = None
    for i, (slot, record) in enumerate(layout.entries):
        if record is None and slot.range.lower >= 0.0 and np.isfinite(variance[i]):
            moved = float(np.sqrt(_beyond_noise(scores) * variance[i]))
            ratio = moved / max(abs(float(values[i])), NO_FACTOR * slot.range.scale)
            if ratio > (OUTWEIGHED if worst is None else worst.ratio):
                worst = Outweighed(slot.name, float(values[i]), slot.unit, ratio)
    return worst


def _beyond_noise(scores: Scores) -> float:
    """Sum of squared residuals less that of noise, which is known to a few percent."""
    counted = np.count_nonzero(scores.residuals, axis=(0, 2))
    return float(np.sum(np.maximum(np.sum(scores.residuals**2, axis=(0, 2)) - GAP_OF_NOISE**2 * counted, 0.0)))
