"""What figures say of what they show, and that nothing of it lies outside their axes."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from fibrefit.core.declarations import LOADING, SLACK
from fibrefit.plots.certainty import METHODS, errors_figure
from fibrefit.plots.fitted import Fitted
from fibrefit.plots.gaps import gap_figure
from fibrefit.plots.snaps import first_contact, snap_figures
from fibrefit.plots.starts import starts_figure
from fibrefit.plots.style import caption_of
from fibrefit.plots.sweep import CHANNELS, _comparison_figure, _remark, _remark_on_all, sweep_figures
from fibrefit.plots.traces import Way, traces_figure
from fibrefit.report.text import ERROR_METHODS
from fibrefit.study.summaries.discovery import DiscoverySummary
from fibrefit.study.summaries.part import Variable
from fibrefit.study.summaries.results import Gap, ParameterSummary
from tests.study.test_summaries import EXAMPLES

GRID = ("record", "sample")


def test_every_method_that_may_be_reported_has_a_row() -> None:
    assert set(METHODS) >= set(ERROR_METHODS)
    known = {"white": 1.0, "newey_west": 2.0, "discrepancy": 3.0}
    estimate = ParameterSummary(value=10.0, unit="N", std_error=3.0, std_errors=known, interval_95=(4.0, 16.0))
    figure = errors_figure({"friction": estimate}, "discrepancy", 3.0)
    rows = [text.get_text() for text in figure.axes[0].get_yticklabels()]
    assert [row for row in rows if row.endswith("(reported)")] == ["what the model lacks (reported)"]
    assert len(rows) == 3


def fitted(phase: list[int], channels: dict[str, str]) -> Fitted:
    """One record whose simulated motion is in these phases."""
    values = np.arange(len(phase), dtype=float)[None]
    name = {"record": Variable(np.array(["a.csv"], dtype=object), ("record",))}
    readings = {role: Variable(values * (1.0 + n), GRID, unit) for n, (role, unit) in enumerate(channels.items())}
    groups: Any = {
        "observed_data": {**name, "time": Variable(values * 1e-3, GRID, "s"), **readings},
        "predictions": {**name, **readings},
        "motion": {**name, "phase": Variable(np.array([phase]), GRID)},
        "constant_data": {**name, "samples": Variable(np.array([len(phase)]), ("record",))},
    }
    gap = Gap.model_validate({role: {"rms": 1.0, "unit": unit, "noise": 1.0} for role, unit in channels.items()})
    return Fitted(groups, gap, {"a.csv": gap})


BOTH = {"position": "m", "force": "N"}


@pytest.mark.parametrize(
    ("phase", "contact"),
    [
        ([SLACK] * 5 + [LOADING] * 5 + [SLACK] * 5, (5, 10)),
        ([SLACK] * 5 + [LOADING] * 5, (5, None)),
        ([LOADING] * 5 + [SLACK] * 5 + [LOADING] * 5, (10, None)),
        # Taut at the start and never again: nothing goes taut, though the last sample is slack before the first.
        ([LOADING] * 5 + [SLACK] * 5, None),
        ([LOADING] * 5, None),
        ([SLACK] * 5, None),
    ],
)
def test_a_contact_begins_where_the_fibre_goes_taut(phase: list[int], contact: tuple[int, int | None] | None) -> None:
    assert first_contact(fitted(phase, BOTH), 0, (LOADING,)) == contact


def test_it_is_the_force_that_is_looked_at_there_whichever_channel_comes_first() -> None:
    phase = [SLACK] * 20 + [LOADING] * 20
    (figure,) = snap_figures(fitted(phase, BOTH), (LOADING,))
    assert figure.axes[0].get_ylabel() == "force / N"
    assert not list(snap_figures(fitted(phase, {"position": "m"}), (LOADING,)))


def test_the_key_of_many_minima_has_the_best_and_the_signs() -> None:
    count = 14
    values = {
        "parameter": np.array(["k"], dtype=object),
        "began": np.ones((count, 1)),
        "ended": np.ones((count, 1)),
        "cost": 1.0 + np.arange(count),
        "basin": np.array([*range(count - 1), -1]),
    }
    figure = starts_figure({name: Variable(value) for name, value in values.items()}, {"k": "N/m"})
    said = [text.get_text() for text in figure.legends[0].get_texts()]
    assert said == ["best minimum: 1", *(f"minimum {n}: 1" for n in range(2, 7)), "given up: 1", "where it began"]


def swept(multiplier: float, amplitude: tuple[float, float]) -> Figure:
    """A curve that is a plateau of one amplitude from below and of another from above."""
    summary = EXAMPLES["fibrefit/sweep/1"]
    (curve,) = summary.curves.values()
    branch = curve.branches["rest"]
    ways = {"rest": amplitude[0], "up": amplitude[0], "down": amplitude[1]}
    changed = curve.model_copy(update={"branches": dict.fromkeys(ways, branch)})
    groups: Any = {}
    for way, size in ways.items():
        ends = {
            f"{channel}_{end}{when}": Variable(np.full(3, sign * size + 0.1))
            for channel in CHANNELS
            for end, sign in (("min", -1.0), ("max", 1.0))
            for when in ("", "_from_the_start")
        }
        groups[f"20_mm_{way}"] = {
            **ends,
            "frequency": Variable(np.array([4.0, 4.1, 4.2])),
            "multiplier": Variable(np.array([0.5, np.nan, multiplier])),
            "overturned": Variable(np.zeros(3)),
        }
    (figure,) = sweep_figures(summary.model_copy(update={"curves": {"20 mm": changed}}), groups).values()
    return figure


@pytest.mark.parametrize(
    ("overturned", "says"),
    [
        ([(0, 1, 0), (1, 1, 1)], "largest with 10 mm: 0.4 rad at 4 Hz"),
        ([(1, 1, 1), (1, 1, 1)], "Started from rest, the pendulum overturns at every frequency"),
    ],
)
def test_of_several_curves_the_largest_angle_is_told_where_there_is_any(
    overturned: list[tuple[int, ...]], says: str
) -> None:
    curves = [
        SimpleNamespace(
            name=name,
            frequencies=np.array([4.0, 4.1, 4.2]),
            branches={"rest": SimpleNamespace(overturned=np.array(over, bool), max_angle=np.array([0.4, 3.0, 0.3]))},
        )
        for name, over in zip(("10 mm", "20 mm"), overturned, strict=True)
    ]
    assert _remark_on_all(curves).endswith(says)


@pytest.mark.parametrize(
    ("up", "down", "says"),
    [
        ([0.3, 0.4], [0.3, np.nan], "at 4.1 Hz it overturns coming from above alone"),
        ([np.nan, 0.4], [0.3, 0.4], "at 4 Hz it overturns coming from below alone"),
        ([np.nan, 0.4], [np.nan, 0.4], "reaches 0.4 rad at 4.1 Hz, from above as from below"),
        ([np.nan, np.nan], [np.nan, np.nan], "it overturns at every frequency"),
    ],
)
def test_a_pendulum_that_overturns_one_way_alone_is_not_said_to_do_the_same_both_ways(
    up: list[float], down: list[float], says: str
) -> None:
    branches = {
        way: SimpleNamespace(overturned=np.isnan(values), amplitude=np.nan_to_num(values))
        for way, values in (("up", up), ("down", down))
    }
    curve: Any = SimpleNamespace(frequencies=np.array([4.0, 4.1]), branches=branches)
    assert _remark(curve).endswith(says)


def test_a_gap_that_is_not_known_is_not_nought() -> None:
    summary = EXAMPLES["fibrefit/discovery/1"]
    assert isinstance(summary, DiscoverySummary)
    unknown = summary.gap.model_copy(update={"total": None})
    figure = gap_figure(summary.model_copy(update={"gap": unknown}))
    assert any("is not known" in text.get_text() for text in figure.texts)


def test_curves_of_a_sweep_are_told_apart_without_colours() -> None:
    branch = SimpleNamespace(overturned=np.zeros(30, bool), max_angle=np.ones(30), amplitude=np.ones(30))
    ways = dict.fromkeys(("rest", "up", "down"), branch)
    curves = [SimpleNamespace(name=n, frequencies=np.arange(30.0), branches=ways) for n in ("10 mm", "20 mm")]
    for axes in _comparison_figure(curves).axes:  # type: ignore[arg-type]
        kinds = {(line.get_marker(), line.get_linestyle()) for line in axes.lines}
        assert len(kinds) == len(axes.lines)


@pytest.mark.parametrize(("multiplier", "top"), [(0.9, 1.05), (1.8, 1.89)])
def test_every_multiplier_lies_inside_the_axes(multiplier: float, top: float) -> None:
    assert swept(multiplier, (0.3, 0.3)).axes[3].get_ylim()[1] == pytest.approx(top)


@pytest.mark.parametrize(
    ("amplitude", "says"),
    [
        ((0.3, 0.3), "the steady-state amplitude reaches 0.3 rad at 4 Hz, from above as from below"),
        ((0.3, 0.6), "at 4 Hz the steady-state amplitude is 0.6 rad coming from above, 0.3 rad from below"),
    ],
)
def test_half_the_travel_is_called_amplitude(amplitude: tuple[float, float], says: str) -> None:
    """The largest angle is larger where the motion does not swing about zero, as here."""
    assert says in caption_of(swept(0.9, amplitude))


@pytest.mark.parametrize(
    ("r_hat", "limit", "says"),
    [
        (1.004, 1.01, "2 ensembles of walkers agree to an R-hat of 1.004 or better"),
        (3.214, 1.01, "2 ensembles of walkers do not agree: R-hat is up to 3.214, above 1.01"),
        (3.214, None, "2 ensembles of walkers agree to an R-hat of 3.214 or better"),
        (np.nan, 1.01, "Whether 2 ensembles of walkers agree is not known"),
    ],
)
def test_ensembles_that_do_not_agree_are_not_said_to(r_hat: float, limit: float | None, says: str) -> None:
    rng = np.random.default_rng(0)
    course, steps = np.zeros((2, 5)), np.arange(1, 6)
    ways = [
        Way(name, "N", steps, course - 1.0, course, course + 1.0, rng.normal(size=(2, 50)), 2, value)
        for name, value in (("friction", 1.001), ("offset", r_hat))
    ]
    assert says in caption_of(traces_figure(ways, limit))
    # What is not drawn may agree less.
    assert "do not agree: R-hat is up to 1.500" in caption_of(traces_figure(ways[:1], 1.01, 1.5))
