"""From a study to a result on disk: the only floor that knows all the others.

What each part needs takes a while to load, and comes with the first use of that part.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fibrefit.workflow.design.distinguish import Distinguished, distinguish_study
    from fibrefit.workflow.design.plan import RecordPlan, plan_study
    from fibrefit.workflow.discovery.discover import Discovery, discover_study
    from fibrefit.workflow.fit import Fit, fit_study
    from fibrefit.workflow.prediction.predict import Prediction, predict_study
    from fibrefit.workflow.prepare import model_of, read_records, task_of
    from fibrefit.workflow.sampling.sample import Sampled, sample_study
    from fibrefit.workflow.simulate import Simulation, simulate_study
    from fibrefit.workflow.sweep import Sweep, sweep_study
    from fibrefit.workflow.together.series import SeriesResult, series_study

__all__ = [
    "Discovery",
    "Distinguished",
    "Fit",
    "Prediction",
    "RecordPlan",
    "Sampled",
    "SeriesResult",
    "Simulation",
    "Sweep",
    "discover_study",
    "distinguish_study",
    "fit_study",
    "model_of",
    "plan_study",
    "predict_study",
    "read_records",
    "sample_study",
    "series_study",
    "simulate_study",
    "sweep_study",
    "task_of",
]

PARTS = {
    "design.distinguish": ("Distinguished", "distinguish_study"),
    "discovery.discover": ("Discovery", "discover_study"),
    "fit": ("Fit", "fit_study"),
    "design.plan": ("RecordPlan", "plan_study"),
    "prediction.predict": ("Prediction", "predict_study"),
    "prepare": ("model_of", "read_records", "task_of"),
    "sampling.sample": ("Sampled", "sample_study"),
    "simulate": ("Simulation", "simulate_study"),
    "sweep": ("Sweep", "sweep_study"),
    "together.series": ("SeriesResult", "series_study"),
}


def __getattr__(name: str) -> Any:
    """A part of the package, loaded when it is first asked for."""
    for part, names in PARTS.items():
        if name in names:
            return getattr(importlib.import_module(f"{__name__}.{part}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
