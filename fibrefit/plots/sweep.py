"""Figures of a frequency sweep: extremes of angle and forces, amplitude and stability against the drive frequency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fibrefit.plots.figures import Figures
from fibrefit.plots.save import file_names
from fibrefit.plots.style import (
    BLACK,
    BLUE,
    GREY,
    KINDS,
    ORANGE,
    PALE,
    VERMILLION,
    in_own_style,
    label,
    legend,
    stacked_figure,
    title,
)
from fibrefit.series.jumps import Extremes, jumps, ranges
from fibrefit.study.summaries.part import Groups, Variable
from fibrefit.study.summaries.results import CurveSummary, SweepSummary

CHANNELS = ("angle", "force_1", "force_2")

WAYS: dict[str, tuple[str, dict[str, Any]]] = {
    "rest": ("from rest", {"color": BLACK, "linestyle": "none", "marker": ".", "markersize": 2.5}),
    "up": ("sweep up", {"color": BLUE, "linewidth": 0.9}),
    "down": ("sweep down", {"color": VERMILLION, "linewidth": 0.9, "linestyle": "--"}),
}
OTHER_MOTION = 0.05
"""Share of an amplitude by which that of another way to a frequency differs when it is another motion."""
MARKS = 10
"""Marks along a curve, beside others."""
HEIGHTS, BOTH_PANELS = (46.0, 34.0, 34.0, 24.0), (52.0, 52.0)
"""Heights in mm of angle, forces and multiplier, and of the two panels of all curves: both figures fit on a page."""


@dataclass(frozen=True)
class _Branch(Extremes):
    """Extremes of angle and forces, and what else is marked."""

    multiplier: np.ndarray
    overturned: np.ndarray

    @classmethod
    def of(cls, group: Mapping[str, Variable]) -> _Branch:
        """From its group of ``result.h5``."""
        lowest, highest, first_lowest, first_highest = (
            np.column_stack([group[f"{channel}_{end}{when}"].values for channel in CHANNELS])
            for when in ("", "_from_the_start")
            for end in ("min", "max")
        )
        multiplier, overturned = group["multiplier"].values, group["overturned"].values.astype(bool)
        return cls(lowest, highest, first_lowest, first_highest, multiplier, overturned)


@dataclass(frozen=True)
class _Curve:
    name: str
    summary: CurveSummary
    frequencies: np.ndarray
    branches: Mapping[str, _Branch]


@in_own_style
def sweep_figures(summary: SweepSummary, groups: Groups) -> Figures:
    """One figure of each curve, and one of all if there are more.

    Parameters
    ----------
    groups : mapping
        Arrays of ``result.h5``: one group a branch of a curve.

    Returns
    -------
    Figures
        By ``sweep <name>``; ``sweep`` is that of all.
    """
    curves = []
    for (name, curve), stem in zip(summary.curves.items(), file_names(list(summary.curves)), strict=True):
        branches = {way: _Branch.of(groups[f"{stem}_{way}"]) for way in curve.branches}
        frequencies = groups[f"{stem}_{next(iter(branches))}"]["frequency"].values
        curves.append(_Curve(name, curve, frequencies, branches))
    figures = Figures({f"sweep {curve.name}": _swept_figure(curve) for curve in curves})
    if len(curves) > 1:
        figures["sweep"] = _comparison_figure(curves)
    return figures


def _swept_figure(curve: _Curve) -> Figure:
    """Extremes of angle and forces, and the largest Floquet multiplier, against frequency."""
    figure, axes = stacked_figure(HEIGHTS)
    preload = curve.summary.preload_n
    title(
        figure,
        f"{curve.name}: {_remark(curve)}",
        f"drive {1e3 * curve.summary.amplitude_m:g} mm, {f'preload {preload:g} N' if preload else 'no preload'}",
    )
    for channel, name in enumerate(("angle / rad", "force 1 / N", "force 2 / N")):
        _extremes(axes[channel], curve, channel)
        label(axes[channel], y=name)
    for way, branch in curve.branches.items():
        axes[3].plot(curve.frequencies, branch.multiplier, **WAYS[way][1])
    axes[3].axhline(1.0, color=GREY, linewidth=0.6)
    seen = np.concatenate([branch.multiplier for branch in curve.branches.values()])
    axes[3].set_ylim(top=1.05 * float(np.max(seen[np.isfinite(seen)], initial=1.0)))
    label(axes[3], x="frequency of the drive / Hz", y="Floquet |\N{GREEK SMALL LETTER MU}|")
    _mark(axes, curve)
    legend(axes[0], loc="lower right", bbox_to_anchor=(1.0, 1.0))
    return figure


def _comparison_figure(curves: Sequence[_Curve]) -> Figure:
    """Maximum |angle| from rest and steady-state amplitude of all curves."""
    figure, axes = stacked_figure(BOTH_PANELS)
    title(
        figure,
        _remark_on_all(curves),
        "lines: from rest and sweep up; dashed: sweep down",
    )
    for i, curve in enumerate(curves):
        colour, mark = KINDS[i % len(KINDS)]
        rest, name = curve.branches["rest"], curve.name
        standing = np.where(rest.overturned, np.nan, rest.max_angle)
        # Marks here and there, each curve's at places of its own, for print without colours.
        every = (i, max(len(curve.frequencies) // MARKS, 1))
        style: dict[str, Any] = {
            "color": colour, "linewidth": 0.8, "marker": mark, "markersize": 3.0, "markevery": every,
        }  # fmt: skip
        axes[0].plot(curve.frequencies, standing, label=name, **style)
        axes[1].plot(curve.frequencies, curve.branches["up"].amplitude, **style)
        axes[1].plot(curve.frequencies, curve.branches["down"].amplitude, linestyle="--", **style)
        for first, last in ranges(curve.frequencies, rest.overturned):
            axes[0].plot([first, last], [np.nanmax(standing)] * 2, color=colour, marker="x", markersize=4.0)
    label(axes[0], y="max |angle| incl. transient, from rest / rad")
    label(axes[1], x="frequency of the drive / Hz", y="steady-state amplitude / rad")
    legend(axes[0], loc="lower right", bbox_to_anchor=(1.0, 1.0))
    return figure


def _remark(curve: _Curve) -> str:
    """How much it matters where the frequency comes from; how far the pendulum swings, where it does not."""
    up, down = (
        np.where(curve.branches[way].overturned, np.nan, curve.branches[way].amplitude) for way in ("up", "down")
    )
    one_way = np.flatnonzero(np.isnan(up) != np.isnan(down))
    if one_way.size:
        way = "below" if np.isnan(up[one_way[0]]) else "above"
        return f"at {curve.frequencies[one_way[0]]:.3g} Hz it overturns coming from {way} alone"
    apart = np.nan_to_num(np.abs(down - up))
    most = int(np.argmax(apart))
    if apart[most] > OTHER_MOTION * max(up[most], down[most]):
        ends = f"{down[most]:.2g} rad coming from above, {up[most]:.2g} rad from below"
        return f"at {curve.frequencies[most]:.3g} Hz the steady-state amplitude is {ends}"
    if np.isnan(up).all():
        return "it overturns at every frequency"
    most = int(np.nanargmax(up))
    largest = f"{up[most]:.2g} rad at {curve.frequencies[most]:.3g} Hz"
    return f"the steady-state amplitude reaches {largest}, from above as from below"


def _remark_on_all(curves: Sequence[_Curve]) -> str:
    """Which curve has the largest maximum |angle|, started from rest."""
    angles = [
        np.where(curve.branches["rest"].overturned, -1.0, np.nan_to_num(curve.branches["rest"].max_angle))
        for curve in curves
    ]
    worst = int(np.argmax([angle.max() for angle in angles]))
    most = int(np.argmax(angles[worst]))
    if angles[worst][most] < 0.0:
        return "Started from rest, the pendulum overturns at every frequency"
    where = f"{angles[worst][most]:.2g} rad at {curves[worst].frequencies[most]:.3g} Hz"
    return f"Started from rest, maximum |angle| is largest with {curves[worst].name}: {where}"


def _extremes(axes: Axes, curve: _Curve, channel: int) -> None:
    """Steady-state extremes of every branch, and those with the transient of the runs from rest."""
    rest = curve.branches["rest"]
    standing = ~rest.overturned
    for values in (rest.first_lowest, rest.first_highest):
        ever = np.where(standing, values[:, channel], np.nan)
        said = "from rest, incl. transient" if values is rest.first_highest else None
        axes.plot(curve.frequencies, ever, color=ORANGE, linewidth=0.6, label=said)
    for way, branch in curve.branches.items():
        said, style = WAYS[way]
        for values, known in ((branch.lowest, None), (branch.highest, said)):
            axes.plot(curve.frequencies, values[:, channel], label=known, **style)


def _mark(axes: Sequence[Axes], curve: _Curve) -> None:
    """Jumps as arrows between both ends, ranges in which the pendulum overturns as bands."""
    for way, branch in curve.branches.items():
        colour = WAYS[way][1]["color"]
        for first, last in ranges(curve.frequencies, branch.overturned):
            half = 0.5 * float(np.min(np.diff(curve.frequencies)))
            for one in axes:
                one.axvspan(first - half, last + half, facecolor=PALE, edgecolor="none", zorder=0)
            axes[0].annotate(
                "overturns",
                (0.5 * (first + last), 1.0),
                xycoords=("data", "axes fraction"),
                fontsize=5.5,
                color=colour,
                rotation=90,
                ha="center",
                va="top",
            )
        _arrows(axes[0], curve, branch, way, colour)


def _arrows(axes: Axes, curve: _Curve, branch: _Branch, way: str, colour: str) -> None:
    for jump in jumps(curve.frequencies, branch.amplitude):
        ends = [(jump.lower, jump.before), (jump.upper, jump.after)]
        if way == "down":
            ends.reverse()
        axes.annotate("", ends[1], ends[0], arrowprops={"arrowstyle": "->", "color": colour, "linewidth": 0.8})
