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
    worst = max(found.pairs(0.0), key=lambda pair: pair[2], default=None)
    heading = "No two effects can be compared"
    if worst is not None:
        heading = f"{worst[0]} and {worst[1]} are told apart least: |cosine| of sensitivities {worst[2]:.2f}"
    return Figures({"confusion": correlation_figure(names, found.cosine, heading)})
