"""Draw a saved result again: from its summary and its ``result.h5``, nothing is computed anew."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from fibrefit.core.errors import UsageError
from fibrefit.store import read_result, read_summary
from fibrefit.study.summaries.discovery import DiscoverySummary, DistinguishSummary, PlanSummary
from fibrefit.study.summaries.part import Part
from fibrefit.study.summaries.results import FitSummary, PosteriorSummary, PredictionSummary, SweepSummary
from fibrefit.study.summaries.series import BatchSummary, SeriesSummary

if TYPE_CHECKING:
    from fibrefit.plots.figures import Figures

NEEDED = "motion", "posterior_predictive"
"""Groups of which a fit, a discovery or a posterior that can be drawn holds one."""


def draw_result(result: Path | str) -> Figures:
    """Figures of a saved result, by name.

    Parameters
    ----------
    result : pathlib.Path or str
        Folder of any result.

    Raises
    ------
    DataError
        If there is no result.
    UsageError
        If what it is drawn from is gone.
    """
    folder = Path(result)
    if (folder / "simulated").is_dir():
        return simulated_figures(folder)
    summary = read_summary(folder)
    folder = folder if folder.is_dir() else folder.parent
    groups = read_result(folder / "result.h5")[0] if (folder / "result.h5").is_file() else {}
    return saved_figures(summary, groups, str(result))


def simulated_figures(folder: Path) -> Figures:
    """Figures of a saved simulation, one a record.

    Raises
    ------
    UsageError
        If its ``result.h5`` is gone.
    """
    from fibrefit.plots.simulated import simulation_figures

    if not (folder / "result.h5").is_file():
        raise _not_drawn(str(folder))
    return simulation_figures(read_result(folder / "result.h5")[0])


def saved_figures(summary: Part, groups: Any, result: str) -> Figures:
    """Figures of a result as it was read.

    Parameters
    ----------
    groups : mapping
        Arrays of ``result.h5``.
    result : str
        Where it lies, for the message.

    Raises
    ------
    UsageError
        As `draw_result`.
    """
    figures = figures_of(summary, groups)
    if figures is None:
        raise _not_drawn(result)
    return figures


def _not_drawn(result: str) -> UsageError:
    do = "Run it again: figures come with it."
    return UsageError(result, "cannot be drawn from what was saved", "a result with all its files", do)


def _of_summary(summary: Part) -> Figures | None:
    """Figures of a kind of which the summary holds all; None for others."""
    from fibrefit.plots.batch import batch_figures
    from fibrefit.plots.confusion import confusion_figures
    from fibrefit.plots.plan import plan_figures
    from fibrefit.plots.series import series_figures

    if isinstance(summary, BatchSummary):
        return batch_figures(summary)
    if isinstance(summary, SeriesSummary):
        return series_figures(summary)
    if isinstance(summary, PlanSummary):
        return plan_figures(summary)
    return confusion_figures(summary) if isinstance(summary, DistinguishSummary) else None


def figures_of(summary: Part, groups: Any) -> Figures | None:
    """Figures of a result as it was read; None where they cannot be drawn from it."""
    from fibrefit.plots.discovery import discovery_figures
    from fibrefit.plots.fit import fit_figures
    from fibrefit.plots.posterior import posterior_figures
    from fibrefit.plots.prediction import prediction_figures
    from fibrefit.plots.sweep import sweep_figures

    if (drawn := _of_summary(summary)) is not None:
        return drawn
    if isinstance(summary, SweepSummary):
        return sweep_figures(summary, groups) if groups else None
    if isinstance(summary, PredictionSummary):
        return prediction_figures(groups) if groups else None
    if not any(name in groups for name in NEEDED):
        return None
    if isinstance(summary, FitSummary):
        return fit_figures(summary, groups)
    if isinstance(summary, DiscoverySummary):
        return discovery_figures(summary, groups)
    return posterior_figures(summary, groups) if isinstance(summary, PosteriorSummary) else None
