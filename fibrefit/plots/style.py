"""How every figure looks: fixed sizes, thin lines, colours that survive colour blindness and a grey print.

Each figure is made by itself, on the Agg canvas: nothing here reads or changes a global state of matplotlib.

Source
------
Palette: Okabe and Ito, Color Universal Design (2008).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

BLACK, ORANGE, SKY, GREEN, YELLOW, BLUE, VERMILLION, PURPLE = (
    "#000000",
    "#E69F00",
    "#56B4E9",
    "#009E73",
    "#F0E442",
    "#0072B2",
    "#D55E00",
    "#CC79A7",
)
GREY, PALE = "0.55", "0.90"

WIDTH = 183.0
"""Of a figure, in mm: two columns of a journal."""
SMALL, USUAL, LARGE = 6.5, 7.5, 9.0
"""Sizes of text, in points."""
MM = 1.0 / 25.4

#: What was measured is broad and light, what was simulated thin and dark: both stay visible where they agree.
MEASURED: dict[str, Any] = {"color": SKY, "linewidth": 2.0, "solid_capstyle": "round"}
SIMULATED: dict[str, Any] = {"color": BLACK, "linewidth": 0.7}
RESIDUAL: dict[str, Any] = {"color": BLUE, "linewidth": 0.4}

#: Colour and marker together tell basins, methods and the like apart.
KINDS = ((BLUE, "o"), (VERMILLION, "s"), (GREEN, "^"), (PURPLE, "D"), (ORANGE, "v"), (BLACK, "P"))


def new_figure(height: float, width: float = WIDTH) -> Figure:
    """Empty figure of a size in mm."""
    figure = Figure(figsize=(width * MM, height * MM), dpi=200, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def place(figure: Figure, left: float, bottom: float, width: float, height: float) -> Axes:
    """Axes at a place in mm from the lower left corner of a figure."""
    across, up = figure.get_size_inches() / MM
    axes = figure.add_axes((left / across, bottom / up, width / across, height / up))
    axes.tick_params(labelsize=SMALL, width=0.5, length=2.5, direction="out", pad=2)
    axes.ticklabel_format(useOffset=False)
    for side, spine in axes.spines.items():
        spine.set_linewidth(0.5)
        spine.set_visible(side in ("left", "bottom"))
    return axes


def stack(figure: Figure, heights: Sequence[float], left: float, right: float, top: float, gap: float) -> list[Axes]:
    """Axes one below the other that share their horizontal axis; all measures in mm."""
    across, up = figure.get_size_inches() / MM
    made: list[Axes] = []
    upper = up - top
    for height in heights:
        axes = place(figure, left, upper - height, across - left - right, height)
        if made:
            axes.sharex(made[0])
        made.append(axes)
        upper -= height + gap
    for axes in made[:-1]:
        axes.tick_params(labelbottom=False)
    return made


def title(figure: Figure, text: str, beside: str = "", left: float = 4.0) -> None:
    """Title at the upper left, remark at the upper right."""
    across, up = figure.get_size_inches() / MM
    y = 1.0 - 5.0 / up
    figure.text(left / across, y, text, fontsize=LARGE, fontweight="bold", va="center", ha="left")
    figure.text(1.0 - 4.0 / across, y, beside, fontsize=USUAL, color="0.25", va="center", ha="right")


def label(axes: Axes, *, x: str = "", y: str = "") -> None:
    """Labels of the axes."""
    if x:
        axes.set_xlabel(x, fontsize=USUAL, labelpad=2)
    if y:
        axes.set_ylabel(y, fontsize=USUAL, labelpad=3)


def legend(axes: Axes, **options: Any) -> None:
    """Legend without a frame, in a row."""
    settings = {"fontsize": SMALL, "frameon": False, "borderpad": 0.1, "handlelength": 2.2, "ncols": 4}
    axes.legend(**(settings | options))
