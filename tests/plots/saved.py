"""What a fit, or a search, would have saved: figures are drawn from that."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from fibrefit.discovery.model.finding import Finding
from fibrefit.fitting.result import Identification
from fibrefit.plots.discovery import discovery_figures
from fibrefit.plots.figures import Figures
from fibrefit.plots.fit import fit_figures
from fibrefit.plots.fitted import Fitted
from fibrefit.workflow.discovery.files import discovery_groups, discovery_summary
from fibrefit.workflow.fit_files import fit_groups, fit_summary
from tests.study.test_summaries import PROVENANCE


def _records(found: Identification) -> list[Any]:
    counts = np.asarray(found.problem.observations.experiment.count)
    names = found.problem.layout.records
    return [SimpleNamespace(name=n, time=np.zeros(c), valid={}, notes=()) for n, c in zip(names, counts, strict=True)]


def _study(records: list[Any]) -> Any:
    """A study of these records, of which no condition is stated."""
    stated = [
        SimpleNamespace(files=(one.name,), in_numbers=dict, conditions=dict, uncertainties=None) for one in records
    ]
    return SimpleNamespace(
        name="drops", kind="fibre_mass", rig=None, records=stated, found_constants=(), settings=lambda of: {}
    )


def saved_fit(found: Identification) -> tuple[Any, Any]:
    """Summary and groups of a fit."""
    records = _records(found)
    return fit_summary(_study(records), records, found, PROVENANCE), fit_groups(found)


def saved_search(finding: Finding) -> tuple[Any, Any]:
    """Summary and groups of a search."""
    records = _records(finding.after)
    return discovery_summary(_study(records), records, finding, PROVENANCE), discovery_groups(finding)


def fitted_of(found: Identification) -> Fitted:
    """Its records as they are drawn."""
    return Fitted.of(*saved_fit(found))


def drawn_fit(found: Identification) -> Figures:
    """All figures of a fit."""
    return fit_figures(*saved_fit(found))


def drawn_search(finding: Finding) -> Figures:
    """All figures of a search."""
    return discovery_figures(*saved_search(finding))
