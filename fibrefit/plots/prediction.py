"""Figures of a prediction: what was measured, over the band it was expected in."""

from __future__ import annotations

import numpy as np

from fibrefit.plots.bands import Banded, bands_figure
from fibrefit.plots.figures import MOST_RECORDS, Figures
from fibrefit.plots.style import in_own_style
from fibrefit.study.summaries.part import AXES, Z_95, Groups


@in_own_style
def prediction_figures(groups: Groups) -> Figures:
    """One figure a record.

    Parameters
    ----------
    groups : mapping
        Arrays of ``result.h5``: ``observed_data``, ``predictions`` with their standard deviations, ``constant_data``.

    Returns
    -------
    Figures
        By ``record <name>``.
    """
    observed, predicted = groups["observed_data"], groups["predictions"]
    counts = groups["constant_data"]["samples"].values.astype(int)
    figures = Figures()
    for r, record in enumerate(map(str, observed["record"].values[:MOST_RECORDS])):
        at = (r, slice(0, counts[r]))
        banded = [
            Banded(
                channel,
                measured.unit,
                observed["time"].values[at],
                measured.values[at],
                _around(predicted[channel].values[at], predicted[f"{channel}_model_sd"].values[at]),
                _around(predicted[channel].values[at], predicted[f"{channel}_sd"].values[at]),
            )
            for channel, measured in observed.items()
            if channel not in AXES
        ]
        figures[f"record {record}"] = bands_figure(record, banded, "predicted; bands hold 95 %")
    return figures


def _around(middle: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    return np.stack([middle - Z_95 * sigma, middle, middle + Z_95 * sigma])
