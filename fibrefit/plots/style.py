"""How every figure looks: fixed sizes, thin lines, colours that survive colour blindness and a grey print.

Each figure is made by itself, on the Agg canvas, from matplotlib's own defaults: what stands in a ``matplotlibrc``,
which may be anybody's where it lies in the working folder, changes none of them.

Source
------
Palette: Okabe and Ito, Color Universal Design (2008).
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from matplotlib import rc_context, rcParamsDefault
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

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

#: One colour, one meaning, in every figure and on the page.
FIRST, FINAL = VERMILLION, BLACK
"""The model a search begins with; the one it ends with, or the only one there is."""
PLACE, MASKED = YELLOW, PURPLE
"""Where the first model goes wrong; samples that do not count."""
POSTERIOR, PRIOR = BLUE, ORANGE
ENDED = {"ok": GREEN, "suspect": ORANGE, "failed": "#B03A00"}
"""How a result ended."""
ENDED_AS = {"ok": "o", "suspect": "^", "failed": "s"}
"""The same as marks, for print without colours."""

WIDTH = 183.0
"""Of a figure, in mm: two columns of a journal."""
SMALL, USUAL, LARGE = 6.5, 7.5, 9.0
"""Sizes of text, in points."""
MM = 1.0 / 25.4
LEFT, RIGHT, TOP, BOTTOM = 16.0, 5.0, 17.0, 11.0
"""Usual margins in mm: numbers of five figures and a label; half a number; a title in two lines, its remark; numbers
and a label."""
GAP = 4.5
"""Room in mm between axes one below the other: a line of small text."""
TITLE_LEFT = 4.0
"""Where a title begins, in mm."""
LETTER = 1.9
"""Width of a bold letter of a title, in mm."""
LETTER_SMALL = 1.3
"""Width of a letter of small text, in mm."""
LONGEST_BESIDE_AXES = 34
"""Letters of a name beside axes, which then takes a quarter of the width."""
MOST_NAMES = 12
"""Names of records that fit below an axis, in two lines."""
SMALLEST = 0.8
"""Factor by which a long title may be set smaller before it is broken into two lines."""

#: What was measured is broad and light, what was simulated thin and dark: both stay visible where they agree.
MEASURED: dict[str, Any] = {"color": SKY, "linewidth": 2.0, "solid_capstyle": "round"}
SIMULATED: dict[str, Any] = {"color": FINAL, "linewidth": 0.7}
RESIDUAL: dict[str, Any] = {"color": FINAL, "linewidth": 0.35}

#: Colour and marker together tell basins, methods and the like apart.
KINDS = ((BLUE, "o"), (GREEN, "s"), (ORANGE, "^"), (PURPLE, "D"), ("#8C6D31", "v"), ("0.35", "P"))


_DEFAULTS = {name: value for name, value in rcParamsDefault.items() if not name.startswith("backend")}
_DEFAULTS["text.parse_math"] = False  # a name of a record may hold half a formula
in_own_style = rc_context(_DEFAULTS)
"""Decorator of what makes figures or files of them: both ask for settings."""


def new_figure(height: float, width: float = WIDTH) -> Figure:
    """Empty figure of a size in mm."""
    figure = Figure(figsize=(width * MM, height * MM), dpi=200, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def axes_at(figure: Figure, left: float, bottom: float, width: float, height: float) -> Axes:
    """Axes at a place in mm from the lower left corner of a figure."""
    across, up = figure.get_size_inches() / MM
    axes = figure.add_axes((left / across, bottom / up, width / across, height / up))
    axes.tick_params(labelsize=SMALL, width=0.5, length=2.5, direction="out", pad=2)
    axes.ticklabel_format(useOffset=False)
    for side, spine in axes.spines.items():
        spine.set_linewidth(0.5)
        spine.set_visible(side in ("left", "bottom"))
    return axes


def stacked_figure(heights: Sequence[float], below: float = 0.0) -> tuple[Figure, list[Axes]]:
    """Figure with axes one below the other that share their horizontal axis; all measures in mm.

    Parameters
    ----------
    heights : sequence of float
        Of the axes, from above.
    below : float
        Further room below the last of them.
    """
    up = TOP + sum(heights) + GAP * (len(heights) - 1) + BOTTOM + below
    figure = new_figure(up)
    made: list[Axes] = []
    upper = up - TOP
    for height in heights:
        made.append(axes_at(figure, LEFT, upper - height, WIDTH - LEFT - RIGHT, height))
        made[-1].sharex(made[0])
        upper -= height + GAP
    for axes in made[:-1]:
        axes.tick_params(labelbottom=False)
    return figure, made


def title(figure: Figure, text: str, beside: str = "") -> None:
    """Title at the upper left, a sentence that says what is seen; remark below it. Both are the figure's caption.

    A title that is too long for its figure is set smaller, then in two lines.
    """
    across, up = figure.get_size_inches() / MM
    room = (across - 2.0 * TITLE_LEFT) / LETTER
    factor = min(1.0, max(room / max(len(text), 1), SMALLEST))
    lines = textwrap.wrap(text, int(room / factor), max_lines=2, placeholder="\N{HORIZONTAL ELLIPSIS}")
    for number, line in enumerate([*lines, beside] if beside else lines):
        y, said = 1.0 - (4.5 + 4.3 * number) / up, number == len(lines)
        style: dict[str, Any] = {"fontsize": SMALL, "color": "0.25"} if said else {"fontweight": "bold"}
        figure.text(TITLE_LEFT / across, y, line, **{"fontsize": factor * LARGE, "va": "center", "ha": "left"} | style)
    set_caption(figure, f"{text.rstrip('.')}. {_sentence(beside)}".strip())


def set_caption(figure: Figure, caption: str) -> None:
    """Give a figure its caption: whole sentences that say what is seen, with the number that matters."""
    figure.set_label(caption)


def caption_of(figure: Figure) -> str:
    """The caption of a figure; empty where it has none."""
    return str(figure.get_label())


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:].rstrip('.')}." if text else ""


def name_records(axes: Axes, places: Any, names: Sequence[str], width: float) -> None:
    """Names of records below axes of a width in mm, in lines broken after ``_``; the end of a longer one."""
    room = max(int(width / len(names) / LETTER_SMALL), 1)
    lines = [textwrap.wrap(name.replace("_", "_ "), room)[-2:] for name in names]
    axes.set_xticks(places, ["\n".join(part).replace("_ ", "_") for part in lines])
    axes.tick_params(axis="x", labelsize=SMALL)


def cut_name(name: str, longest: int = LONGEST_BESIDE_AXES) -> str:
    """A name of at most so many letters: what a longer one begins and ends with."""
    return name if len(name) <= longest else f"{name[: longest // 2 - 1]}\N{HORIZONTAL ELLIPSIS}{name[-longest // 2 :]}"


def label(axes: Axes, *, x: str = "", y: str = "") -> None:
    """Labels of the axes."""
    if x:
        axes.set_xlabel(x, fontsize=USUAL, labelpad=2)
    if y:
        axes.set_ylabel(y, fontsize=USUAL, labelpad=3)


WIDE = 20.0
"""Ratio of the largest to the smallest value from which an axis is logarithmic."""
WIDE_GAP = 8.0
"""Gap, as a multiple of the noise, from which an axis of gaps is logarithmic: below it the line of noise is seen."""
FEWEST_TICKS = 2
"""Numbers that an axis needs to be read."""


class _Threes(LogLocator):
    """Numbers at 1 and 3 of each decade, or at 1 alone where there is no room for both."""

    def __init__(self) -> None:
        super().__init__(subs=(1.0, 3.0), numticks=7)

    def tick_values(self, vmin: float, vmax: float) -> Any:
        """As of a locator, in SI units of the axis."""
        found = np.asarray(super().tick_values(vmin, vmax))
        powers = np.asarray(LogLocator(numticks=7).tick_values(vmin, vmax))
        low, high = min(vmin, vmax), max(vmin, vmax)
        inside, of_powers = (sum(low <= tick <= high for tick in ticks.tolist()) for ticks in (found, powers))
        fits = self.axis is None or inside <= self.axis.get_tick_space()
        # Over many decades a locator of several numbers a decade gives none at all.
        return found if fits and inside >= min(of_powers, FEWEST_TICKS) else powers


def is_wide(values: np.ndarray) -> bool:
    """Whether values, those that are finite, are positive and differ so much that only decades show them all."""
    known = values[np.isfinite(values)]
    return bool(known.size and known.min() > 0.0 and known.max() > WIDE * known.min())


def logarithmic(axes: Axes, *ways: Literal["x", "y"]) -> None:
    """Make axes logarithmic, ``"x"`` or ``"y"``, with plain numbers: texts are shown as they stand, formulas too."""
    for way in ways:
        axes.set(**{f"{way}scale": "log"})
        axis = getattr(axes, f"{way}axis")
        axis.set_major_locator(_Threes())
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())
        axes.tick_params(axis=way, which="minor", width=0.4, length=1.5)


def legend(axes: Axes, **options: Any) -> None:
    """Legend without a frame, in a row."""
    settings = {"fontsize": SMALL, "frameon": False, "borderpad": 0.1, "handlelength": 2.2, "ncols": 4}
    axes.legend(**(settings | options))
