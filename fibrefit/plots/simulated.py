"""Figures of a simulation: what the model says, over what was measured."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from fibrefit.plots.figures import Figures
from fibrefit.plots.records import Compared, compared_figure

if TYPE_CHECKING:
    from fibrefit.problem.task import Task


def simulation_figures(task: Task, readings: Mapping[str, np.ndarray]) -> Figures:
    """One figure a record.

    Parameters
    ----------
    task : Task
    readings : mapping of channel to (n_record, n_time) in SI units

    Returns
    -------
    Figures
        By ``record <name>``.
    """
    figures = Figures()
    for r, trace in enumerate(task.traces):
        count = len(trace.times)
        channels = [
            Compared(channel, task.units[channel], trace.times, trace.channels[channel], values[r, :count])
            for channel, values in readings.items()
        ]
        figures[f"record {trace.name}"] = compared_figure(
            f"{trace.name}, simulated at the starting values", "", channels
        )
    return figures
