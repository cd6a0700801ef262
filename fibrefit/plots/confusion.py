"""Which effects change the records in the same way, as a matrix."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fibrefit.plots.certainty import correlation_figure
from fibrefit.plots.figures import Figures

if TYPE_CHECKING:
    from fibrefit.discovery.design.distinguish import Confusion


def confusion_figures(found: Confusion) -> Figures:
    """The cosines between what the effects do to the records.

    Parameters
    ----------
    found : Confusion

    Returns
    -------
    Figures
    """
    names = tuple(direction.effect for direction in found.directions)
    heading = "How alike effects change these records (1: inseparable)"
    return Figures({"confusion": correlation_figure(names, found.cosine, heading)})
