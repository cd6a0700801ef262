"""Figures of a prediction: what was measured, over the band it was expected in."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from fibrefit.plots.bands import Banded, bands_figure
from fibrefit.plots.figures import Figures

if TYPE_CHECKING:
    from fibrefit.problem.task import Task

MOST_RECORDS = 24
"""Records that get a figure of their own."""
Z_95 = 1.959964


def prediction_figures(task: Task, readings: Mapping[str, np.ndarray], model: np.ndarray, whole: np.ndarray) -> Figures:
    """One figure a record.

    Parameters
    ----------
    task : Task
    readings : mapping of channel to (n_record, n_time) in SI units
    model, whole : (n_record, n_channel, n_time) in SI units
        Standard deviations of the model's reading, and of a new measurement.

    Returns
    -------
    Figures
        By ``record <name>``.
    """
    figures = Figures()
    for r, trace in enumerate(task.traces[:MOST_RECORDS]):
        inside = slice(0, len(trace.times))
        banded = [
            Banded(
                channel,
                task.units[channel],
                trace.times,
                trace.channels[channel],
                _around(values[r, inside], model[r, c, inside]),
                _around(values[r, inside], whole[r, c, inside]),
            )
            for c, (channel, values) in enumerate(readings.items())
        ]
        figures[f"record {trace.name}"] = bands_figure(trace.name, banded, "predicted; bands hold 95 %")
    return figures


def _around(middle: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    return np.stack([middle - Z_95 * sigma, middle, middle + Z_95 * sigma])
