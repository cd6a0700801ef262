"""Figures of a fit, drawn from what it saved."""

from __future__ import annotations

from matplotlib.figure import Figure

from fibrefit.core.declarations import PHASES, TAUT
from fibrefit.core.formatting import in_words
from fibrefit.plots.certainty import correlation_figure, each_figure, errors_figure
from fibrefit.plots.figures import MOST_RECORDS, Figures
from fibrefit.plots.fitted import Fitted
from fibrefit.plots.overview import overview_figure
from fibrefit.plots.records import Compared, compared_figure
from fibrefit.plots.snaps import snap_figures
from fibrefit.plots.starts import starts_figure
from fibrefit.plots.style import in_own_style
from fibrefit.study.summaries.part import Groups
from fibrefit.study.summaries.results import FitSummary

OVERVIEW = "overview"


@in_own_style
def fit_figures(summary: FitSummary, groups: Groups) -> Figures:
    """All figures of a fit.

    Parameters
    ----------
    summary : FitSummary
        Content of ``summary.json``.
    groups : Groups
        Content of ``result.h5``.

    Returns
    -------
    Figures
        A dict. ``overview``: verdict, records, residuals and values on one page. ``record <name>``: measured against
        simulated with the residual under it. ``snaps``: the first contacts. ``starts``: where the search began and
        ended. ``correlation`` and ``errors``: uncertainty of the values. ``each``: values that every record has for
        itself.
    """
    fitted = Fitted.of(summary, groups)
    figures = Figures({OVERVIEW: overview_figure(summary, fitted)})
    figures |= {f"record {fitted.records[r]}": record_figure(fitted, r) for r in fitted.worst(MOST_RECORDS)}
    for number, figure in enumerate(snap_figures(fitted, TAUT)):
        figures["snaps" if number == 0 else f"snaps {number + 1}"] = figure
    return Figures(figures | certainty_figures(summary, groups))


@in_own_style
def fit_overview(summary: FitSummary, groups: Groups) -> Figures:
    """The one figure that tells all of a fit, by its name; the others are not made.

    Parameters
    ----------
    summary : FitSummary
        Content of ``summary.json``.
    groups : Groups
        Content of ``result.h5``.
    """
    return Figures({OVERVIEW: overview_figure(summary, Fitted.of(summary, groups))})


def certainty_figures(summary: FitSummary, groups: Groups) -> dict[str, Figure]:
    """Figures of the search and of the uncertainty of the values, as far as there is any."""
    figures, shared = {}, {name: one for name, one in summary.parameters.items() if one.free}
    if len(groups["starts"]["parameter"].values):
        units = {name: one.unit for name, one in summary.parameters.items()}
        figures["starts"] = starts_figure(groups["starts"], units)
    estimate = groups["estimate"]
    if len(estimate["value"].values) > 1:
        names = tuple(map(str, estimate["parameter"].values))
        figures["correlation"] = correlation_figure(names, estimate["covariance"].values)
    if shared:
        figures["errors"] = errors_figure(shared, summary.error_method or "", summary.error_inflation)
    own = {
        (name, record): one for record, of in summary.records.items() for name, one in of.parameters.items() if one.free
    }
    if own:
        figures["each"] = each_figure(own)
    return figures


def record_figure(fitted: Fitted, record: int) -> Figure:
    """One record, with the phases of its motion on top."""
    phase, channels = fitted.phase(record), fitted.compared(record)
    phases = {name: phase == index for index, name in enumerate(PHASES) if (phase == index).any()}
    heading = f"{fitted.records[record]}: the model leaves {gaps_in_words(channels)} the noise"
    return compared_figure(heading, fitted.conditions(record), channels, phases, fitted.motion_ends(record))


def gaps_in_words(channels: list[Compared]) -> str:
    """What is left of each channel: ``1.02 (force) and 0.98 (position) times``."""
    return f"{in_words(f'{one.gap:.2f} ({one.name})' for one in channels)} times"
