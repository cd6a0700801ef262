"""Figures of an identification."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from fibrefit.plots.certainty import correlation_figure, each_figure, errors_figure
from fibrefit.plots.figures import Figures
from fibrefit.plots.fitted import Fitted
from fibrefit.plots.records import compared_figure
from fibrefit.plots.snaps import snap_figures
from fibrefit.plots.starts import starts_figure
from fibrefit.problem.diagnose.phases import PHASES, TAUT

if TYPE_CHECKING:
    from fibrefit.fitting.result import Identification

MOST_RECORDS = 24
"""Records that get a figure of their own; of a longer series those that are explained worst."""


def fit_figures(found: Identification) -> Figures:
    """All figures of an identification.

    Parameters
    ----------
    found : Identification

    Returns
    -------
    Figures
        A dict. ``record <name>``: measured against simulated with the residual under it. ``snaps``: the first contacts.
        ``starts``: where the search began and ended. ``correlation`` and ``errors``: uncertainty of the values.
        ``each``: values that every record has for itself.
    """
    fitted = Fitted(found)
    figures = Figures({f"record {fitted.records[r]}": record_figure(fitted, r) for r in _chosen(fitted)})
    for number, figure in enumerate(snap_figures(fitted, TAUT)):
        figures["snaps" if number == 0 else f"snaps {number + 1}"] = figure
    units = {estimate.name: estimate.unit for estimate in found.estimates}
    if found.starts.names:
        figures["starts"] = starts_figure(found.starts, units)
    if len(found.values) > 1:
        figures["correlation"] = correlation_figure(found.problem.layout.free_names, found.covariance)
    if any(estimate.record is None and estimate.free for estimate in found.estimates):
        figures["errors"] = errors_figure(found)
    if own := [estimate for estimate in found.estimates if estimate.record is not None and estimate.free]:
        figures["each"] = each_figure(own)
    return figures


def record_figure(fitted: Fitted, record: int) -> Figure:
    """One record, with the phases of its motion on top."""
    phase = fitted.phase(record)
    phases = {name: phase == index for index, name in enumerate(PHASES) if (phase == index).any()}
    return compared_figure(fitted.records[record], fitted.conditions(record), fitted.compared(record), phases)


def _chosen(fitted: Fitted) -> list[int]:
    gaps = fitted.found.record_gaps
    worst = sorted(
        range(len(fitted.records)), key=lambda r: -max(gap.ratio for gap in gaps[fitted.records[r]].values())
    )
    return sorted(worst[:MOST_RECORDS])
