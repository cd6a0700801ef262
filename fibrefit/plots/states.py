"""Residuals vs state: on which state of the rig they depend."""

from __future__ import annotations

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

from fibrefit.core.declarations import HELD, STATES, TAUT
from fibrefit.plots.fitted import Fitted
from fibrefit.plots.quantities import axis_label, readable_unit
from fibrefit.plots.style import (
    BOTTOM,
    FINAL,
    FIRST,
    GREY,
    LEFT,
    PALE,
    RIGHT,
    SMALL,
    TOP,
    axes_at,
    label,
    legend,
    new_figure,
    title,
)

OF_FIBRE = ("stretch", "stretch rate", "tension")
"""States that say something only while a fibre is taut."""
HEIGHT, ABOVE, BETWEEN = 34.0, 8.0, 12.0
"""Height of a panel, room above the next row for its numbers, and between maps for numbers and label, in mm."""
CLOSE = 4.0
"""Distance in mm of panels that share an axis."""
BINS, FEWEST = 24, 12
"""Bins of a state, and samples from which one has a mean: it is then known to 0.3 noise rms."""
CELLS, PLANE = 44, 46.0
"""Cells of a map each way, and its height in mm: a cell is a millimetre, which the eye still tells apart."""
LARGEST = 4.0
"""Residual, in noise rms, at which the colours of the map end."""


def states_figure(before: Fitted, after: Fitted | None) -> Figure:
    """Mean residual and its spread in bins of each state, before and after.

    Parameters
    ----------
    before, after : Fitted
        None where the model did not change.
    """
    channels = before.channels
    known = [state for state in STATES if state in before.states]
    figure = new_figure(TOP + BOTTOM + len(channels) * (HEIGHT + ABOVE) - ABOVE)
    beside = (
        "while the weight moves; of the fibre, while it is taut" if "tension" in known else "while the weight moves"
    )
    beside = f"mean and spread of measured minus simulated, {beside}; grey: ± 1 noise rms"
    title(figure, _heading(before, after, known), beside)
    across, up = figure.get_size_inches() * 25.4
    width = (across - LEFT - RIGHT - CLOSE * (len(known) - 1)) / len(known)
    for row, channel in enumerate(channels):
        bottom, first = up - TOP - HEIGHT - row * (HEIGHT + ABOVE), None
        for column, state in enumerate(known):
            axes = axes_at(figure, LEFT + column * (width + CLOSE), bottom, width, HEIGHT)
            _panel(axes, before, after, state, channel)
            if first is None:
                first = axes
                label(axes, y=f"{channel} residual / noise")
            else:
                axes.sharey(first)
                axes.tick_params(labelleft=False)
            if row < len(channels) - 1:
                axes.set_xlabel("")
            if row == column == 0:
                legend(axes, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    return figure


def _heading(before: Fitted, after: Fitted | None, known: list[str]) -> str:
    """On which state the residuals of which channel depend most."""
    depends = {(c, s): _dependence(before, c, s) for c in before.channels for s in known}
    (channel, state), most = max(depends.items(), key=lambda one: one[1])
    said = f"The {channel} residual of the first model follows the {state} most: {most:.2f} noise rms"
    return said if after is None else f"{said}; of the final one {_dependence(after, channel, state):.2f}"


def _dependence(fitted: Fitted, channel: str, state: str) -> float:
    """Rms of the mean residuals in bins of a state, in noise rms; zero where too little moves."""
    (values,), residual = _of_states(fitted, channel, state)
    if len(values) < FEWEST:
        return 0.0
    mean, number = _binned(values, residual)[1:3]
    return float(np.sqrt(np.average(mean**2, weights=number))) if number.size else 0.0


def _panel(axes: Axes, before: Fitted, after: Fitted | None, state: str, channel: str) -> None:
    axes.axhspan(-1.0, 1.0, facecolor=PALE, edgecolor="none", zorder=0)
    axes.axhline(0.0, color="0.5", linewidth=0.4)
    unit, worth = readable_unit(_of_state(before, state), _unit(before, state))
    for fitted, colour, said in ((before, FIRST, "first model"), (after, FINAL, "final model")):
        if fitted is not None:
            (values,), residual = _of_states(fitted, channel, state)
            _band(axes, values / worth, residual, colour, said)
    label(axes, x=axis_label(state, unit))


def map_figure(before: Fitted, after: Fitted | None, variables: tuple[str, str] = ("position", "speed")) -> Figure:
    """Mean residual over the plane of two states, for each channel before and after.

    Parameters
    ----------
    before, after : Fitted
        None where the model did not change.
    variables : tuple of str
        Across and up.
    """
    stages = [("first model", before)] + ([("final model", after)] if after is not None else [])
    # A row for each channel; where nothing changed, the channels stand side by side.
    panels = [(channel, stage) for channel in before.channels for stage in stages]
    rows = -(-len(panels) // 2)
    figure = new_figure(TOP + BOTTOM + rows * (PLANE + ABOVE) - ABOVE)
    said = f"Where in the plane of {variables[0]} and {variables[1]} measurement and model differ"
    title(figure, said, "mean of measured minus simulated, in units of the noise")
    across, up = figure.get_size_inches() * 25.4
    width = (across - LEFT - 20.0 - BETWEEN) / 2
    units = [readable_unit(_of_state(before, state), _unit(before, state)) for state in variables]
    for number, (channel, (said, fitted)) in enumerate(panels):
        row, column = divmod(number, 2)
        bottom = up - TOP - PLANE - row * (PLANE + ABOVE)
        axes = axes_at(figure, LEFT + column * (width + BETWEEN), bottom, width, PLANE)
        mesh = _map(axes, fitted, channel, variables, (units[0][1], units[1][1]))
        heading = f"{channel}, {said}"
        axes.text(0.0, 1.02, heading, transform=axes.transAxes, fontsize=SMALL, color="0.25", va="bottom")
        label(axes, x=axis_label(variables[0], units[0][0]) if row == rows - 1 else "")
        label(axes, y=axis_label(variables[1], units[1][0]) if column == 0 else "")
    bar = axes_at(figure, LEFT + 2 * width + BETWEEN + 4.0, bottom, 2.5, PLANE)
    figure.colorbar(mesh, cax=bar, extend="both", ticks=[-LARGEST, -2, 0, 2, LARGEST])
    bar.tick_params(labelsize=SMALL, width=0.5, length=2)
    return figure


def has_fibre_map(fitted: Fitted) -> bool:
    """Whether stretch and its rate say anything that position and speed do not: on a drop they are the same."""
    states = fitted.states
    if "stretch" not in states or not _moving(fitted, "stretch").any():
        return False
    return not np.array_equal(states["stretch rate"].values, states["speed"].values)


def _unit(fitted: Fitted, state: str) -> str:
    return fitted.states[state].unit


def _moving(fitted: Fitted, state: str) -> np.ndarray:
    phase = fitted.phases
    within = np.arange(phase.shape[1]) < fitted.counts[:, None]
    return within & (np.isin(phase, TAUT) if state in OF_FIBRE else phase != HELD)


def _of_state(fitted: Fitted, state: str) -> np.ndarray:
    return fitted.states[state].values[_moving(fitted, state)]


def _of_states(fitted: Fitted, channel: str, *states: str) -> tuple[list[np.ndarray], np.ndarray]:
    """States, and measured minus simulated in units of the noise, where something was measured that counts."""
    residuals = fitted.residuals(channel)
    seen = _moving(fitted, states[0]) & np.isfinite(residuals)
    return [fitted.states[state].values[seen] for state in states], residuals[seen]


def _band(axes: Axes, state: np.ndarray, residual: np.ndarray, colour: str, said: str) -> None:
    if len(state) < FEWEST:
        return
    centre, mean, _, squares = _binned(state, residual)
    spread = np.sqrt(np.maximum(squares - mean**2, 0.0))
    axes.fill_between(centre, mean - spread, mean + spread, facecolor=colour, alpha=0.2, edgecolor="none")
    axes.plot(centre, mean, color=colour, linewidth=1.0, label=said)


def _binned(state: np.ndarray, residual: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Middle, mean residual, number of samples and mean square of each bin that holds enough of them."""
    low, high = np.quantile(state, (0.002, 0.998))
    edges = np.linspace(float(low), float(high), BINS + 1)
    index = np.clip(np.digitize(state, edges) - 1, 0, BINS - 1)
    number = np.bincount(index, minlength=BINS)
    enough = number >= FEWEST
    sums = (np.bincount(index, values, BINS)[enough] / number[enough] for values in (residual, residual**2))
    mean, squares = sums
    return 0.5 * (edges[1:] + edges[:-1])[enough], mean, number[enough], squares


def _map(axes: Axes, fitted: Fitted, channel: str, variables: tuple[str, str], worth: tuple[float, float]) -> QuadMesh:
    values, residual = _of_states(fitted, channel, *variables)
    x, y = (one / unit for one, unit in zip(values, worth, strict=True))
    number, edges_x, edges_y = np.histogram2d(x, y, CELLS)
    total, _, _ = np.histogram2d(x, y, (edges_x, edges_y), weights=residual)
    mean = np.ma.masked_where(number == 0, total / np.maximum(number, 1))
    axes.axhline(0.0, color=GREY, linewidth=0.4, zorder=0)
    return axes.pcolormesh(
        edges_x, edges_y, mean.T, cmap=colormaps["RdBu_r"], vmin=-LARGEST, vmax=LARGEST, rasterized=True
    )
