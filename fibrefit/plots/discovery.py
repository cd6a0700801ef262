"""Figures of a discovery: what the model lacked, and what is left once it is added."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from fibrefit.plots.before_after import before_after_figure
from fibrefit.plots.curve import curve_figure
from fibrefit.plots.figures import Figures
from fibrefit.plots.fitted import Fitted
from fibrefit.plots.gaps import candidates_figure, gap_figure
from fibrefit.plots.overview import overview_figure
from fibrefit.plots.places import places_figure
from fibrefit.plots.spectrum import spectrum_figure
from fibrefit.plots.states import has_fibre_map, map_figure, states_figure
from fibrefit.plots.style import in_own_style
from fibrefit.study.summaries.discovery import Candidate, DiscoverySummary
from fibrefit.study.summaries.part import Groups

MOST_RECORDS = 12
"""Records that get a figure of their own: those the first model explains worst."""


@in_own_style
def discovery_figures(summary: DiscoverySummary, groups: Groups) -> Figures:
    """All figures of a discovery.

    Parameters
    ----------
    summary : DiscoverySummary
        Content of ``summary.json``.
    groups : Groups
        Content of ``result.h5``.

    Returns
    -------
    Figures
        A dict. ``overview``: verdict, records before and after, and values on one page. ``gap``: of each record and
        channel before and after, and left out (predicted from the other records). ``candidates``: the gap with each
        effect, one figure a round. ``curve``: what an unexplained gap looks like. ``places``: where and in which phase
        the first model goes wrong. ``states``: residuals against position, speed, stretch, its rate, and tension;
        ``map``: over the plane of position and speed, and ``map of the fibre`` over that of stretch and its rate where
        it says more. ``spectrum``: power of the residuals and of the noise against frequency. ``record <name>``:
        measured and simulated, before and after.
    """
    final = Fitted.of(summary, groups)
    first = Fitted.before(summary, groups) if summary.before is not None else final
    after = final if summary.added else None
    places = summary.places
    figures = Figures({"overview": overview_figure(summary, final, first if after else None)})
    figures["gap"] = gap_figure(summary)
    figures |= _candidates(summary)
    curves = summary.unexplained.curves if summary.unexplained else ()
    if curves:
        figures["curve"] = curve_figure(curves)
    figures["places"] = places_figure(first, places, groups["phase_shares"])
    figures["states"] = states_figure(first, after)
    figures["map"] = map_figure(first, after)
    if has_fibre_map(first):
        figures["map of the fibre"] = map_figure(first, after, ("stretch", "stretch rate"))
    spectrum = groups["residual_spectrum"]
    figures["spectrum"] = spectrum_figure(spectrum, first, bool(summary.added))
    for r in first.worst(MOST_RECORDS):
        inside = [place for place in places if place.record == first.records[r]]
        figures[f"record {first.records[r]}"] = before_after_figure(first, after, r, inside, spectrum)
    return Figures(figures)


def _candidates(summary: DiscoverySummary) -> dict[str, Figure]:
    """One figure a round; of the last look where no round added anything."""
    expected = summary.expected_gap or 1.0
    looks: list[tuple[Sequence[Candidate], float, str]] = [
        (found.ranking, found.gap_before, found.added or "") for found in summary.rounds
    ]
    if not looks and summary.ranking:
        looks = [(summary.ranking, summary.unexplained.gap if summary.unexplained else expected, "")]
    return {
        "candidates" if number == 1 else f"candidates {number}": candidates_figure(*look, expected)
        for number, look in enumerate(looks, 1)
    }
