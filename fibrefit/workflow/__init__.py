"""From a study to a result on disk: the only floor that knows all the others."""

from __future__ import annotations

from fibrefit.workflow.discover import Discovery, discover_study
from fibrefit.workflow.fit import Fit, fit_study
from fibrefit.workflow.prepare import model_of, read_records, task_of
from fibrefit.workflow.sample import Sampled, sample_study
from fibrefit.workflow.simulate import Simulation, simulate_study

__all__ = [
    "Discovery",
    "Fit",
    "Sampled",
    "Simulation",
    "discover_study",
    "fit_study",
    "model_of",
    "read_records",
    "sample_study",
    "simulate_study",
    "task_of",
]
