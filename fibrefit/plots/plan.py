"""What further records would add: one row a record, one panel a purpose."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

import numpy as np

from fibrefit.plots.figures import Figures
from fibrefit.plots.style import (
    BLUE,
    GREEN,
    GREY,
    LETTER_SMALL,
    SMALL,
    VERMILLION,
    axes_at,
    in_own_style,
    label,
    new_figure,
    title,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fibrefit.study.summaries.discovery import FurtherRecord, PlanSummary

MOST = 12
"""Records that are drawn, the most useful first."""
ROW, LEFT = 7.0, 68.0
"""Height of a row, and room for what its record is, in mm."""
LINES = 2
"""Of a name, in a row."""
PALE = 0.4
"""Opacity of what slopes alone say."""
PURPOSES = {
    "errors": "how much the standard errors fall",
    "rivals": "how surely the rivals are distinguished",
    "power": "how much the detection limits fall",
}


@in_own_style
def plan_figures(summary: PlanSummary) -> Figures:
    """The best records of a plan, and what each would add."""
    return Figures({"plan": _plan(summary, summary.further[:MOST])})


def _plan(summary: PlanSummary, best: tuple[FurtherRecord, ...]) -> Figure:
    panels = [("errors fall by / %", BLUE, [100.0 * (1.0 - _mean(one.errors)) for one in best])]
    if summary.rivals:
        panels.insert(
            0,
            ("rivals distinguished / %", VERMILLION, [100.0 * (one.probability_distinguished or 0.0) for one in best]),
        )
    panels.append(("limits fall by / %", GREEN, [100.0 * (1.0 - _mean(one.limits)) for one in best]))
    height, width = ROW * len(best), 106.0 / len(panels) - 5.0
    figure = new_figure(height + 30.0)
    heading = f"{_like(best[0])} would add most" if best else "No further record was looked at"
    pale = "; pale: by slopes alone" if any(one.looked_into is False for one in best) else ""
    title(figure, heading, f"ranked by {PURPOSES[summary.purpose]}{pale}")
    rows = np.arange(len(best))
    for i, (words, colour, values) in enumerate(panels):
        axes = axes_at(figure, LEFT + i * (width + 6.0), 12.0, width, height)
        bars = axes.barh(rows, values, color=colour, height=0.6)
        axes.set_ylim(len(best) - 0.4, -0.6)
        axes.set_yticks(rows, [_in_lines(_name(one)) for one in best] if i == 0 else [""] * len(best))
        axes.tick_params(axis="y", length=0, labelsize=SMALL)
        label(axes, x=words)
        if summary.rivals and i == 0:
            axes.set_xlim(0.0, 100.0)
            for bar, one in zip(bars, best, strict=True):
                bar.set_alpha(PALE if one.looked_into is False else 1.0)
            if (now := summary.probability_distinguished_now) is not None:
                axes.axvline(100.0 * now, color=GREY, linewidth=0.7, linestyle="--")
    return figure


def _mean(factors: dict[str, float]) -> float:
    known = [factor for factor in factors.values() if factor > 0.0]
    return float(np.exp(np.mean(np.log(known)))) if known else 1.0


def _like(one: FurtherRecord) -> str:
    """What a record is, in words, without its cost: a name may hold a bracket or a colon itself."""
    return one.says.partition(" min): ")[0].rpartition(" (")[0]


def _name(one: FurtherRecord) -> str:
    return f"{_like(one).removeprefix('A record like ')} ({one.minutes:.3g} min)"


def _in_lines(name: str) -> str:
    """All of what a record is, in as many lines as a row has room for: neighbours differ in what comes last."""
    lines = textwrap.wrap(name, int(LEFT / LETTER_SMALL), max_lines=LINES, placeholder="\N{HORIZONTAL ELLIPSIS}")
    return "\n".join(lines)
