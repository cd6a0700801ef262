"""Figures of a discovery: what the model lacked, and what is left once it is added."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fibrefit.plots.before_after import before_after_figure
from fibrefit.plots.curve import curve_figure
from fibrefit.plots.figures import Figures
from fibrefit.plots.fitted import Fitted
from fibrefit.plots.gaps import candidates_figure, gap_figure
from fibrefit.plots.places import places_figure
from fibrefit.plots.spectrum import spectrum_figure
from fibrefit.plots.states import has_fibre_map, map_figure, states_figure

if TYPE_CHECKING:
    from fibrefit.discovery.model.finding import Finding

MOST_RECORDS = 12
"""Records that get a figure of their own: those the first model explains worst."""


def discovery_figures(finding: Finding) -> Figures:
    """All figures of a discovery.

    Parameters
    ----------
    finding : Finding

    Returns
    -------
    Figures
        A dict. ``gap``: of each record and channel before and after, and left out (predicted from the other records).
        ``candidates``: the gap with each effect, one figure a round. ``curve``: what an unexplained gap looks like.
        ``places``: where and in which phase the first model goes wrong. ``states``: residuals against position, speed,
        stretch, its rate, and tension; ``map``: over the plane of position and speed, and ``map of the fibre`` over
        that of stretch and its rate where it says more. ``spectrum``: power of the residuals and of the noise against
        frequency. ``record <name>``: measured and simulated, before and after.
    """
    before, after = Fitted(finding.before), Fitted(finding.after)
    changed = finding.after is not finding.before
    figures = Figures({"gap": gap_figure(finding)})
    looks = [(found.ranking, found.gap_before, found.added) for found in finding.rounds]
    if not looks and finding.ranking:
        looks = [(finding.ranking, finding.unexplained.gap, "")]
    for number, look in enumerate(looks, 1):
        figures["candidates" if number == 1 else f"candidates {number}"] = candidates_figure(
            *look, finding.before.expected_gap
        )
    if finding.curves:
        figures["curve"] = curve_figure(finding.curves)
    places = finding.rounds[0].where if finding.rounds else finding.unexplained.where
    figures["places"] = places_figure(finding.before, places)
    figures["states"] = states_figure(before, after if changed else None)
    figures["map"] = map_figure(before, after if changed else None)
    if has_fibre_map(before):
        figures["map of the fibre"] = map_figure(before, after if changed else None, ("stretch", "stretch rate"))
    figures["spectrum"] = spectrum_figure(before, after if changed else None)
    for r in _worst(before):
        inside = [place for place in places if place.record == before.records[r]]
        figures[f"record {before.records[r]}"] = before_after_figure(before, after if changed else None, r, inside)
    return figures


def _worst(fitted: Fitted) -> list[int]:
    gaps = fitted.found.record_gaps
    sizes = [max(gap.ratio for gap in gaps[name].values()) for name in fitted.records]
    return sorted(sorted(range(len(sizes)), key=lambda r: -sizes[r])[:MOST_RECORDS])
