"""A law that was composed for what has no name."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fibrefit.study.summaries.discovery import ProposedLawSummary

LAWS = "laws"
"""Folder of a result with the laws that were composed for it."""


@dataclass(frozen=True)
class ProposedLaw:
    """The law that accounts best for what no effect of the catalogue does.

    Parameters
    ----------
    summary : ProposedLawSummary
    file, source : str
        Its file in the folder `LAWS`, by name and content.
    probe : str
        Name of the free curve it stands for.
    heights : (n_knot,)
        Of the law at the knots of that curve, without their median, in SI units.
    """

    summary: ProposedLawSummary
    file: str
    source: str
    probe: str
    heights: np.ndarray
