"""Which effects are confounded: |cosine| of their sensitivities, as a matrix."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fibrefit.plots.certainty import correlation_figure
from fibrefit.plots.figures import Figures

if TYPE_CHECKING:
    from fibrefit.discovery.design.distinguish import Confusion


def confusion_figures(found: Confusion) -> Figures:
    """The |cosine| of the sensitivities of any two effects.

    Parameters
    ----------
    found : Confusion

    Returns
    -------
    Figures
    """
    names = tuple(direction.effect for direction in found.directions)
    heading = "Confounding: |cosine| of sensitivities (1: not separable)"
    return Figures({"confusion": correlation_figure(names, found.cosine, heading)})
