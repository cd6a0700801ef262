"""Figures: measured against simulated, the search, the uncertainty of the values.

Each is loaded when it is first asked for: a fit that draws its overview needs a few of them.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fibrefit.plots.batch import batch_figures
    from fibrefit.plots.confusion import confusion_figures
    from fibrefit.plots.discovery import discovery_figures
    from fibrefit.plots.figures import Figures
    from fibrefit.plots.fit import fit_figures, fit_overview
    from fibrefit.plots.plan import plan_figures
    from fibrefit.plots.posterior import band_figures, corner_figures, posterior_figures, prior_figures, trace_figures
    from fibrefit.plots.prediction import prediction_figures
    from fibrefit.plots.save import file_names, save_figures
    from fibrefit.plots.shrink import small_png
    from fibrefit.plots.simulated import simulation_figures
    from fibrefit.plots.sweep import sweep_figures
    from fibrefit.plots.table import table_figure

__all__ = [
    "Figures",
    "band_figures",
    "batch_figures",
    "confusion_figures",
    "corner_figures",
    "discovery_figures",
    "file_names",
    "fit_figures",
    "fit_overview",
    "plan_figures",
    "posterior_figures",
    "prediction_figures",
    "prior_figures",
    "save_figures",
    "simulation_figures",
    "small_png",
    "sweep_figures",
    "table_figure",
    "trace_figures",
]

PARTS = {
    "batch": ("batch_figures",),
    "confusion": ("confusion_figures",),
    "discovery": ("discovery_figures",),
    "figures": ("Figures",),
    "fit": ("fit_figures", "fit_overview"),
    "plan": ("plan_figures",),
    "posterior": ("band_figures", "corner_figures", "posterior_figures", "prior_figures", "trace_figures"),
    "prediction": ("prediction_figures",),
    "save": ("file_names", "save_figures"),
    "shrink": ("small_png",),
    "simulated": ("simulation_figures",),
    "sweep": ("sweep_figures",),
    "table": ("table_figure",),
}


def __getattr__(name: str) -> Any:
    """A part of the package, loaded when it is first asked for."""
    for part, names in PARTS.items():
        if name in names:
            return getattr(importlib.import_module(f"{__name__}.{part}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
