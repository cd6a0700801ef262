"""Uncertainty: correlations of the estimates, and error bars by every method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fibrefit.core.formatting import in_words, typeset_unit
from fibrefit.core.matrices import correlation_matrix
from fibrefit.plots.quantities import axis_label, readable_unit
from fibrefit.plots.style import BLUE, GREY, SMALL, USUAL, axes_at, cut_name, label, new_figure, title
from fibrefit.study.summaries.part import Z_95
from fibrefit.study.summaries.results import ParameterSummary

METHODS = {
    "white": "white (i.i.d.) noise",
    "spectrum": "noise spectrum",
    "whitened": "whitened (GLS)",
    "newey_west": "Newey-West",
    "block_bootstrap": "block bootstrap",
    "windows": "windows drawn anew",
    "discrepancy": "what the model lacks",
    "alike": "whitened, records alike",
}
ITSELF = {"profile likelihood": "profile", "population": "mean of population"}
"""Kinds of intervals that are drawn as they are, as no standard error says where they end: that of a profile, and the
marginal of the mean of a population over all standard deviations between records."""
CORRELATION = "correlation"
CELL, MOST_NUMBERS, LARGEST = 6.5, 20, 110.0
"""Side of a cell, in mm, that holds a number; values that are drawn at the most; side of the whole at most, in mm."""
LONGEST_NAME = 70.0
"""Room for the name of a value, in mm."""
LETTER = 1.3
"""Width of a small letter, in mm, not less."""


def correlation_figure(
    names: tuple[str, ...], covariance: np.ndarray, heading: str = "", what: str = CORRELATION
) -> Figure:
    """Correlation of all free values, as colours and numbers; empty where the data do not determine a value.

    Parameters
    ----------
    covariance : (n_free, n_free)
    heading : str
        Which two are correlated most, unless said.
    what : str
        What is drawn; anything but correlations is from 0 to 1.
    """
    correlation, signed = correlation_matrix(covariance), what == CORRELATION
    heading, chosen = heading or _strongest(names, correlation), _correlated_most(names, correlation)
    beside = (
        f"{len(chosen)} of {len(names)} are shown, with the largest {what}{'; those of all records first' * signed}"
    )
    beside = beside if len(chosen) < len(names) else ""
    names, correlation = tuple(names[i] for i in chosen), correlation[np.ix_(chosen, chosen)]
    number = len(names)
    side = min(CELL * number, LARGEST)
    shown_names = [cut_name(_short(name), int(LONGEST_NAME / LETTER)) for name in names]
    left = 12.0 + LETTER * max(len(name) for name in shown_names)
    figure = new_figure(side + 22.0, width=max(left + side + 26.0, 90.0))
    title(figure, heading, beside)
    axes = axes_at(figure, left, 9.0, side, side)
    shown = np.ma.masked_invalid(np.where(np.tri(number, k=-1, dtype=bool), correlation, np.nan))
    image = axes.imshow(shown, cmap=colormaps["RdBu_r" if signed else "Greys"], vmin=-1.0 * signed, vmax=1.0)
    axes.set_xticks(range(number), [str(i + 1) for i in range(number)])
    axes.set_yticks(range(number), [f"{name}  {i + 1}" for i, name in enumerate(shown_names)])
    axes.tick_params(length=0, labelsize=SMALL)
    axes.spines[:].set_visible(False)
    _numbers(axes, correlation)
    bar = axes_at(figure, left + side + 5.0, 9.0, 3.0, min(side, 40.0))
    figure.colorbar(image, cax=bar, ticks=[-1, -0.5, 0, 0.5, 1] if signed else [0, 0.5, 1])
    bar.tick_params(labelsize=SMALL, width=0.5, length=2)
    bar.set_ylabel(what, fontsize=SMALL)
    return figure


def _correlated_most(names: Sequence[str], correlation: np.ndarray) -> list[int]:
    """Values there is room for: the strongest pair, those of all records, then by their strongest correlation."""
    beside = np.where(np.eye(len(names), dtype=bool), 0.0, np.nan_to_num(np.abs(correlation)))
    most = float(beside.max())
    ranked = sorted(range(len(names)), key=lambda i: (beside[i].max() < most, "[" in names[i], -beside[i].max()))
    return sorted(ranked[:MOST_NUMBERS])


def _strongest(names: tuple[str, ...], correlation: np.ndarray) -> str:
    """Which two values trade places most."""
    below = np.where(np.tri(len(names), k=-1, dtype=bool), np.abs(correlation), np.nan)
    if not np.isfinite(below).any():
        return "No two estimates are determined"
    i, j = np.unravel_index(int(np.nanargmax(below)), below.shape)
    value = f"{correlation[i, j]:.2f}".replace("-", "\N{MINUS SIGN}")
    return f"{_short(names[i])} and {_short(names[j])} are correlated most: {value}"


def _short(name: str) -> str:
    parameter, _, record = name.partition("[")
    words = parameter.replace("_", " ")
    return f"{words}, {record.rstrip(']')}" if record else words


def _numbers(axes: Axes, correlation: np.ndarray) -> None:
    for i in range(len(correlation)):
        for j in range(i):
            value = correlation[i, j]
            if np.isfinite(value):
                colour = "white" if abs(value) > 0.65 else "black"
                said = f"{value:.2f}".replace("0.", ".", 1).replace("-", "\N{MINUS SIGN}")
                axes.text(j, i, said, ha="center", va="center", fontsize=5.0, color=colour)


def errors_figure(estimates: Mapping[str, ParameterSummary], method: str, inflation: float | None) -> Figure:
    """95 % intervals of the shared parameters by every method; the one that is reported stands out.

    Parameters
    ----------
    method : str
        The one that is reported.
    inflation : float or None
        Median ratio of the reported standard errors to those under white noise.
    """
    height, gap, top, bottom, left = 16.0, 10.0, 15.0, 11.0, 36.0
    figure = new_figure(top + bottom + len(estimates) * (height + gap) - gap, width=126.0)
    times = "" if inflation is None else f" are {inflation:.2g} times those under white noise"
    title(figure, f"The reported error bars{times}" if times else "Error bars by method", "95 % intervals by method")
    up = figure.get_size_inches()[1] * 25.4
    for row, (name, estimate) in enumerate(estimates.items()):
        axes = axes_at(figure, left, up - top - height - row * (height + gap), 84.0, height)
        _intervals(axes, name, estimate, method)
    return figure


def _intervals(axes: Axes, name: str, estimate: ParameterSummary, chosen: str) -> None:
    rows = [
        (words, estimate.value - Z_95 * error, estimate.value + Z_95 * error, method == chosen)
        for method, words in METHODS.items()
        if (error := estimate.std_errors.get(method)) is not None
    ]
    if estimate.plain_error is not None and estimate.plain_value is not None:
        reach = Z_95 * estimate.plain_error
        rows.append(("not whitened (OLS)", estimate.plain_value - reach, estimate.plain_value + reach, False))
    if estimate.interval_95 is not None:
        # A bound may cut it short.
        rows = [(words, *(estimate.interval_95 if own else (low, high)), own) for words, low, high, own in rows]
    if (words := ITSELF.get(estimate.interval_kind)) and estimate.interval_95 is not None:
        rows = [(*row[:3], False) for row in rows] + [(words, *estimate.interval_95, True)]
    unit, worth = readable_unit(np.array([estimate.value]), estimate.unit)
    for i, (words, low, high, reported) in enumerate(rows):
        colour, marker = (BLUE, "o") if reported else (GREY, "o")
        width = 1.8 if reported else 0.9
        axes.plot([low / worth, high / worth], [i, i], color=colour, linewidth=width, solid_capstyle="butt")
        centre = estimate.plain_value if words == "not whitened (OLS)" else estimate.value
        axes.plot((centre or 0.0) / worth, i, marker=marker, color=colour, markersize=4.0 if reported else 3.0)
    axes.set_yticks(range(len(rows)), [f"{row[0]} (reported)" if row[3] else row[0] for row in rows])
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.margins(x=0.08)
    label(axes, x=axis_label(name, unit))
    if not rows:
        axes.text(0.5, 0.5, "not determined", transform=axes.transAxes, ha="center", va="center", fontsize=USUAL)


def each_figure(estimates: Mapping[tuple[str, str], ParameterSummary]) -> Figure:
    """Values that each record has for itself, with their 95 % intervals: one row a parameter.

    Parameters
    ----------
    estimates : mapping of (name, record) to ParameterSummary
    """
    names = list(dict.fromkeys(name for name, _ in estimates))
    records = list(dict.fromkeys(record for _, record in estimates))
    height, gap, top, left, room = 26.0, 5.0, 15.0, 18.0, 159.0
    flat = LETTER * sum(len(record) + 3 for record in records) < room
    shown = [cut_name(record) for record in records]
    bottom = 7.0 if flat else 5.0 + LETTER * max(map(len, shown))
    figure = new_figure(top + bottom + len(names) * (height + gap) - gap)
    words = [name.replace("_", " ") for name in names]
    title(figure, f"Each record has its own {in_words(words)}", "bars: 95 % intervals; dashed: mean of all records")
    up = figure.get_size_inches()[1] * 25.4
    for row, name in enumerate(names):
        axes = axes_at(figure, left, up - top - height - row * (height + gap), room, height)
        _by_record(axes, name, {record: one for (other, record), one in estimates.items() if other == name}, records)
        last = row == len(names) - 1
        turned: dict = {} if flat else {"rotation": 70, "ha": "right", "rotation_mode": "anchor"}
        axes.set_xticks(range(len(records)), shown if last else [""] * len(records), **turned)
        axes.set_xlim(-0.5, len(records) - 0.5)
    return figure


def _by_record(axes: Axes, name: str, estimates: Mapping[str, ParameterSummary], records: list[str]) -> None:
    values = np.array([estimate.value for estimate in estimates.values()])
    unit, worth = readable_unit(values, next(iter(estimates.values())).unit)
    places = [records.index(record) for record in estimates]
    limits = np.array([estimate.interval_95 or (np.nan, np.nan) for estimate in estimates.values()])
    bars = np.abs(np.where(np.isfinite(limits), limits, values[:, None]) - values[:, None]).T / worth
    colour, marker = BLUE, "o"
    axes.errorbar(
        places, values / worth, yerr=bars, linestyle="none", marker=marker, markersize=3.5, color=colour,
        linewidth=0.9, capsize=2.0, capthick=0.6,
    )  # fmt: skip
    axes.axhline(float(np.mean(values)) / worth, color=GREY, linewidth=0.5, linestyle=(0, (3, 3)), zorder=0)
    label(axes, y=axis_label(name.rpartition(".")[2], typeset_unit(unit)))
