"""Figures of a fit: which there are, what they show, and that nothing global is touched."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from fibrefit.fitting.result import Identification, Starts
from fibrefit.plots import fit_figures, simulation_figures
from fibrefit.plots.certainty import correlation_figure, correlations
from fibrefit.plots.fit import MOST_RECORDS
from fibrefit.plots.fitted import Fitted
from fibrefit.plots.snaps import first_contact
from fibrefit.plots.starts import starts_figure
from fibrefit.problem.diagnose.phases import LOADING, REST, SLACK, UNLOADING
from fibrefit.problem.task import Task


@pytest.fixture(scope="module")
def figures(found: Identification) -> dict[str, Figure]:
    return fit_figures(found)


def texts(figure: Figure) -> str:
    """All that is written in a figure."""
    labels = [t.get_text() for t in figure.texts]
    for axes in figure.axes:
        labels += [axes.get_title(), axes.get_xlabel(), axes.get_ylabel()] + [t.get_text() for t in axes.texts]
        labels += [t.get_text() for t in (axes.get_legend().get_texts() if axes.get_legend() else ())]
        labels += [t.get_text() for t in (*axes.get_xticklabels(), *axes.get_yticklabels())]
    labels += [t.get_text() for legend in figure.legends for t in legend.get_texts()]
    return "\n".join(labels)


def test_every_figure_a_person_looks_for_is_there(figures: dict[str, Figure]) -> None:
    assert list(figures) == [
        "record drop_5mm.csv",
        "record drop_10mm.csv",
        "snaps",
        "starts",
        "correlation",
        "errors",
        "each",
    ]


def test_axes_carry_the_units_a_person_reads(figures: dict[str, Figure]) -> None:
    record = texts(figures["record drop_10mm.csv"])
    for label in ("force / N", "position / mm", "residual / N", "residual / µm", "time / s", "lift 10 mm"):
        assert label in record
    assert "stiffness / (kN/m)" in texts(figures["starts"])
    assert "damping / (N s/m)" in texts(figures["errors"])
    assert "first contact" in texts(figures["snaps"]).lower()
    assert "release / ms" in texts(figures["each"])


def test_the_residual_lies_under_its_curves_with_the_noise_band(
    found: Identification, figures: dict[str, Figure]
) -> None:
    figure = figures["record drop_10mm.csv"]
    panels = {axes.get_ylabel(): axes for axes in figure.axes}
    residual = panels["residual / N"]
    assert residual.get_position().y1 < panels["force / N"].get_position().y0
    line = max(residual.lines, key=lambda one: len(one.get_xdata()))
    reading = found.readings["force"][1, : len(line.get_ydata())]
    measured = np.asarray(found.problem.observations.measured["force"])[1, : len(reading)]
    np.testing.assert_allclose(line.get_ydata(), measured - reading)
    (band,) = residual.patches
    noise = found.record_gaps["drop_10mm.csv"]["force"].noise
    np.testing.assert_allclose([band.get_y(), band.get_height()], [-2.0 * noise, 4.0 * noise])


def test_masked_samples_are_marked_and_not_bridged(figures: dict[str, Figure]) -> None:
    assert "masked (40)" in [c.get_label() for a in figures["record drop_5mm.csv"].axes for c in a.collections]
    assert "masked" not in str([c.get_label() for a in figures["record drop_10mm.csv"].axes for c in a.collections])
    measured = figures["record drop_5mm.csv"].axes[1].lines[0]
    assert np.isnan(measured.get_ydata()[600:640]).all()


def test_measured_and_simulated_differ_in_more_than_colour(figures: dict[str, Figure]) -> None:
    measured, simulated = figures["record drop_5mm.csv"].axes[1].lines[:2]
    assert measured.get_linewidth() > 2.0 * simulated.get_linewidth()
    grey = [np.dot(mpl.colors.to_rgb(line.get_color()), (0.3, 0.59, 0.11)) for line in (measured, simulated)]
    assert grey[0] - grey[1] > 0.4


def test_the_first_contact_is_found_in_the_phases(found: Identification) -> None:
    fitted = Fitted(found)
    start, end = first_contact(fitted, 1, (LOADING, UNLOADING, REST))
    phase = fitted.phase(1)
    assert phase[start - 1] == SLACK
    assert phase[start] == LOADING
    assert phase[end - 1] == UNLOADING
    assert phase[end] == SLACK


def test_a_record_that_never_goes_slack_has_a_take_up_only(found: Identification) -> None:
    phase = np.where(found.motion.phase == SLACK, LOADING, found.motion.phase)
    phase[:, :300] = SLACK
    stays = dataclasses.replace(found, motion=dataclasses.replace(found.motion, phase=phase))
    assert first_contact(Fitted(stays), 0, (LOADING, UNLOADING, REST))[1] is None
    assert "release" not in texts(fit_figures(stays)["snaps"]).splitlines()


def test_starts_show_every_basin_with_its_own_mark(found: Identification) -> None:
    starts = found.starts
    basin = np.array([0, 0, 0, 1, 1, 2, -1, 0])
    cost = np.where(basin < 0, np.inf, starts.cost * (1.0 + 3.0 * np.maximum(basin, 0)))
    spread = dataclasses.replace(starts, basin=basin, cost=cost)
    figure = starts_figure(spread, {"stiffness": "N/m"})
    said = texts(figure)
    for words in (
        "best minimum: 4",
        "minimum 2: 2",
        "minimum 3: 1",
        "given up: 1",
        "4 of 8 starts reached the best minimum",
    ):
        assert words in said
    marks = {(line.get_color(), line.get_marker()) for line in figure.axes[0].lines if len(line.get_xdata()) > 0}
    assert len({mark for mark in marks if mark[1] not in ("None", "|")}) == 4


def test_a_search_that_lost_every_start_can_still_be_drawn() -> None:
    lost = Starts(("k",), *(np.full((2, 1), np.nan),) * 3, np.full(2, np.inf), np.zeros(2, dtype=int), np.full(2, -1))
    assert "given up: 2" in texts(starts_figure(lost, {"k": "N/m"}))


def test_correlations_leave_out_what_is_not_determined() -> None:
    covariance = np.array([[4.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, np.inf]])
    found = correlations(covariance)
    assert found[0, 1] == 0.5
    assert np.isnan(found[2]).all()
    assert ".50" in texts(correlation_figure(("a", "b", "c[r.csv]"), covariance))


def test_the_reported_interval_stands_out(found: Identification, figures: dict[str, Figure]) -> None:
    said = texts(figures["errors"])
    assert said.count("(reported)") == 3
    assert "reported / i.i.d. standard error: " in said
    for method in ("white (i.i.d.) noise", "whitened (GLS) (reported)", "not whitened (OLS)"):
        assert method in said


def test_a_profile_is_shown_beside_the_others(found: Identification) -> None:
    estimates = tuple(
        dataclasses.replace(e, interval_kind="profile likelihood") if e.record is None else e for e in found.estimates
    )
    assert "profile (reported)" in texts(fit_figures(dataclasses.replace(found, estimates=estimates))["errors"])


def test_of_a_long_series_the_worst_records_are_drawn(found: Identification, monkeypatch: pytest.MonkeyPatch) -> None:
    assert MOST_RECORDS >= 24
    monkeypatch.setattr("fibrefit.plots.fit.MOST_RECORDS", 1)
    worst = max(found.record_gaps, key=lambda name: max(gap.ratio for gap in found.record_gaps[name].values()))
    assert [name for name in fit_figures(found) if name.startswith("record")] == [f"record {worst}"]


def test_a_simulation_is_drawn_over_what_was_measured(task: Task, found: Identification) -> None:
    figures = simulation_figures(task, found.readings)
    assert list(figures) == ["record drop_5mm.csv", "record drop_10mm.csv"]
    labels = [line.get_label() for line in figures["record drop_5mm.csv"].axes[0].lines]
    assert labels == ["measured", "simulated"]


def test_sizes_are_fixed(figures: dict[str, Figure]) -> None:
    assert {round(figures[f"record drop_{lift}mm.csv"].get_size_inches()[0] * 25.4) for lift in (5, 10)} == {183}
    for figure in figures.values():
        width, height = figure.get_size_inches() * 25.4
        assert 85.0 < width < 260.0
        assert 40.0 < height < 260.0


def test_a_notebook_shows_all_figures_at_once(figures: dict[str, Figure]) -> None:
    html = figures._repr_html_()  # type: ignore[attr-defined]
    assert html.count("<img") == len(figures)
    assert 'alt="snaps"' in html


def test_nothing_global_is_touched(found: Identification) -> None:
    before = dict(mpl.rcParams)
    fit_figures(found)
    assert dict(mpl.rcParams) == before


def test_drawing_needs_neither_pyplot_nor_jax() -> None:
    code = "import sys; import fibrefit.plots; print({'matplotlib.pyplot', 'jax'} & set(sys.modules))"
    root = Path(__file__).resolve().parents[2]
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=root)
    assert done.stdout.strip() in ("set()", "{'jax'}")
    assert "pyplot" not in done.stdout
