"""Figures of a simulation: what the model says, over what was measured."""

from __future__ import annotations

import numpy as np

from fibrefit.plots.figures import MOST_RECORDS, Figures
from fibrefit.plots.records import Compared, compared_figure
from fibrefit.plots.style import in_own_style
from fibrefit.study.summaries.part import Groups


@in_own_style
def simulation_figures(groups: Groups) -> Figures:
    """One figure a record, of the first ones of many.

    Parameters
    ----------
    groups : Groups
        ``observed_data`` and ``predictions``.

    Returns
    -------
    Figures
        By ``record <name>``.
    """
    observed, predicted = groups["observed_data"], groups["predictions"]
    figures = Figures()
    for r, record in enumerate(observed["record"].values[:MOST_RECORDS]):
        times = observed["time"].values[r]
        inside = np.isfinite(times)
        channels = [
            Compared(name, one.unit, times[inside], observed[name].values[r, inside], one.values[r, inside])
            for name, one in predicted.items()
            if one.values.ndim > 1  # read again, there are numbers of records and samples beside the channels
        ]
        figures[f"record {record}"] = compared_figure(f"{record}, simulated at the starting values", "", channels)
    return figures
