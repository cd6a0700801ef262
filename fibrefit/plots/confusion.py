"""Which effects are confounded: |cosine| of their sensitivities, as a matrix."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fibrefit.core.formatting import in_words
from fibrefit.plots.certainty import correlation_figure
from fibrefit.plots.figures import Figures
from fibrefit.plots.style import in_own_style

if TYPE_CHECKING:
    from fibrefit.study.summaries.discovery import DistinguishSummary


@in_own_style
def confusion_figures(summary: DistinguishSummary) -> Figures:
    """The |cosine| of the sensitivities of any two effects."""
    names, cosine = tuple(one.effect for one in summary.effects), np.array(summary.cosine)
    heading = "No two effects can be compared"
    below = np.tril(np.nan_to_num(cosine), -1) if len(names) > 1 else np.zeros((0, 0))
    if below.any():
        worst = np.unravel_index(int(np.argmax(below)), below.shape)
        pair = in_words(names[i] for i in sorted(worst))
        heading = f"{pair} are the most confounded pair: |cosine| of sensitivities {below[worst]:.2f}"
    return Figures({"confusion": correlation_figure(names, cosine, heading, "|cosine| of sensitivities")})
