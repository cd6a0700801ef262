"""One record: measured against simulated, with the residual under it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fibrefit.core.formatting import in_words
from fibrefit.plots.lines import draw_line, mark_masked
from fibrefit.plots.quantities import axis_label, readable_unit
from fibrefit.plots.style import MEASURED, PALE, RESIDUAL, SIMULATED, SMALL, label, legend, stacked_figure, title
from fibrefit.rigs.signals.rest import runs

TALL, LOW, STRIP = 33.0, 17.0, 2.5
"""Heights in mm of readings, residuals and phases: a residual of noise needs half the room, a phase only its shade."""
BAND = 2.0
"""Half-width of the noise band, in noise rms: 95 of 100 samples of pure noise lie inside."""


@dataclass(frozen=True)
class Compared:
    """One channel of one record.

    Parameters
    ----------
    name, unit : str
        The unit in SI.
    times, measured, simulated : (n_time,)
        Measured is NaN where a sample does not count.
    noise : float or None
        Noise rms, where a residual is to be drawn.
    error : (n_time,) or None
        Standard error of the simulated readings by those of the values.
    """

    name: str
    unit: str
    times: np.ndarray
    measured: np.ndarray
    simulated: np.ndarray
    noise: float | None = None
    error: np.ndarray | None = None

    @property
    def gap(self) -> float:
        """Rms of measured minus simulated over that of the noise; NaN where either is not known."""
        residual = self.measured - self.simulated
        known = np.isfinite(residual)
        return float(np.sqrt(np.mean(residual[known] ** 2)) / self.noise) if known.any() and self.noise else math.nan


def compared_figure(
    heading: str,
    beside: str,
    channels: list[Compared],
    phases: Mapping[str, np.ndarray] | None = None,
    ends: tuple[float, float] | None = None,
) -> Figure:
    """Channels of one record, each with its residual where its noise is known.

    Parameters
    ----------
    heading, beside : str
        Title and remark.
    phases : mapping of str to (n_time,) bool, optional
        When the rig is in which phase; drawn as a strip on top.
    ends : (float, float), optional
        From when to when; the whole record unless said.
    """
    heights = [STRIP] if phases else []
    for channel in channels:
        heights += [TALL] if channel.noise is None else [TALL, LOW]
    figure, axes = stacked_figure(heights)
    title(figure, heading, beside)
    label(axes[-1], x="time / s")
    panels = iter(axes)
    if phases:
        _phase_strip(next(panels), channels[0].times, phases)
    for number, channel in enumerate(channels):
        _curves(next(panels), channel)
        if number == 0:
            _legend(axes[bool(phases)], above=not phases)
        if channel.noise is not None:
            _residual(next(panels), channel)
    crop(axes[0], channels[0].times, ends)
    figure.align_ylabels(axes)
    return figure


def _legend(axes: Axes, above: bool) -> None:
    """Above the panel where nothing else stands there; inside it on white, or its lines would be taken for data."""
    if above:
        legend(axes, loc="lower right", bbox_to_anchor=(1.005, 1.0))
    else:
        legend(axes, loc="upper right", frameon=True, framealpha=0.9, edgecolor="none")


def crop(axes: Axes, times: np.ndarray, ends: tuple[float, float] | None) -> None:
    """Show a record from when to when, and say what is left out."""
    first, last = float(times[0]), float(times[-1])
    from_s, to_s = ends or (first, last)
    axes.set_xlim(from_s, to_s)
    rest = [f"{size:.2g} s at its {end}" for size, end in ((from_s - first, "start"), (last - to_s, "end")) if size > 0]
    if rest:
        said = f"not shown: rest, {in_words(rest)}"
        axes.figure.text(0.995, 0.005, said, fontsize=SMALL, color="0.4", ha="right", va="bottom")


def _curves(axes: Axes, channel: Compared) -> None:
    both = np.concatenate([channel.measured, channel.simulated])
    unit, worth = readable_unit(both, channel.unit)
    if np.isfinite(channel.measured).any():
        draw_line(axes, channel.times, channel.measured / worth, label="measured", **MEASURED)
    draw_line(axes, channel.times, channel.simulated / worth, label="simulated", **SIMULATED)
    if np.isfinite(channel.measured).any():
        mark_masked(axes, channel.times, np.isnan(channel.measured))
    label(axes, y=axis_label(channel.name, unit))
    axes.margins(y=0.08)


def _residual(axes: Axes, channel: Compared) -> None:
    residual = channel.measured - channel.simulated
    noise = channel.noise or 0.0
    largest = float(np.nanmax(np.abs(residual))) if np.isfinite(residual).any() else 0.0
    unit, worth = readable_unit(np.array([max(largest, noise)]), channel.unit)
    axes.axhspan(-BAND * noise / worth, BAND * noise / worth, facecolor=PALE, edgecolor="none")
    axes.axhline(0.0, color="0.5", linewidth=0.4)
    draw_line(axes, channel.times, residual / worth, **RESIDUAL)
    reach = max(1.08 * largest, 1.5 * BAND * noise) / worth
    axes.set_ylim(-reach, reach)
    label(axes, y=axis_label("residual", unit))
    said = f"measured \N{MINUS SIGN} simulated: RMS / noise {channel.gap:.2f};  band: ±{BAND:.0f} noise rms"
    axes.text(1.0, 1.02, said, transform=axes.transAxes, fontsize=SMALL, ha="right", va="bottom", color="0.25")


def _phase_strip(axes: Axes, times: np.ndarray, phases: Mapping[str, np.ndarray]) -> None:
    shades = np.linspace(1.0, 0.45, len(phases))
    for (name, inside), shade in zip(phases.items(), shades, strict=True):
        last = len(times) - 1
        spans = [(times[a], times[min(b, last)] - times[a]) for a, b in runs(inside)]
        axes.broken_barh(spans, (0.0, 1.0), facecolor=f"{shade:.3f}", edgecolor="0.3", linewidth=0.3, label=name)
    axes.set_ylim(0.0, 1.0)
    axes.set_yticks([])
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    legend(
        axes, loc="lower right", bbox_to_anchor=(1.005, 0.85), ncols=len(phases), handlelength=1.0, columnspacing=1.2
    )
