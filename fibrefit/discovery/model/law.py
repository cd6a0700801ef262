"""A law that was composed for what has no name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
    curve : str
        What the free curve it stands for is, in words.
    shape : callable
        From values of its parameters to its heights ``(n_knot,)`` at the knots of that curve, without their median,
        all in SI units; a second variable counts as zero.
    """

    summary: ProposedLawSummary
    file: str
    source: str
    curve: str
    shape: Callable[[Sequence[float]], np.ndarray]

    @property
    def heights(self) -> np.ndarray:
        """Heights with the values that are told."""
        return self.shape([one.value for one in self.summary.parameters.values()])
