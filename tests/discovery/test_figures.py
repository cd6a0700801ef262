"""Every verdict is drawn, with the figures it calls for; nothing is left out that a reader would look for."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.colors import to_rgba

from fibrefit.fitting.result import Identification
from fibrefit.plots.before_after import SMOOTH, _smooth, averaged_noise
from fibrefit.plots.curve import curve_figure
from fibrefit.plots.discovery import discovery_figures
from fibrefit.plots.fitted import Fitted
from fibrefit.plots.places import places_figure
from fibrefit.plots.quantities import readable_unit
from fibrefit.plots.states import _of_states, _unit
from fibrefit.plots.style import FINAL, LONGEST_BESIDE_AXES, caption_of
from fibrefit.problem.task import Task
from fibrefit.report.discovery import discovery_report
from fibrefit.report.page.common import gaps_table
from fibrefit.study.summaries.results import ChannelGap, Gap
from fibrefit.workflow.groups_in_common import motion_group
from tests.discovery.made import CURVES, FINDINGS, WHERE, identified, named
from tests.plots.saved import drawn_search, fitted_of, saved_search

RECORDS = {"record drop_10mm_90deg.csv", "record drop_20mm_45deg.csv"}


@pytest.mark.parametrize("verdict", sorted(FINDINGS))
def test_the_figures_of_a_verdict(task: Task, verdict: str) -> None:
    figures = drawn_search(FINDINGS[verdict](task))
    expected = {"overview", "gap", "candidates", "places", "states", "map", "map of the fibre", "spectrum"} | RECORDS
    expected -= {"candidates"} if verdict == "not_trusted" else set()
    assert set(figures) == expected | ({"curve"} if verdict == "unexplained" else set())
    for figure in figures.values():
        figure.canvas.draw()


def test_before_and_after_share_their_axes(task: Task) -> None:
    figure = drawn_search(named(task))["record drop_20mm_45deg.csv"]
    said = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert any("31 %" in text for text in said)
    labels = figure.axes[0].get_legend_handles_labels()[1]
    assert labels == ["measured", "first model", "final model"]


def test_a_record_may_be_named_by_a_long_path(task: Task) -> None:
    summary, groups = saved_search(named(task))
    first = Fitted.of(summary, groups)
    folder = "/somewhere/far/away/with/many/folders/of/folders/in/folders/of/the/laboratory/"
    first.records = tuple(folder + name for name in first.records)
    places = [place.model_copy(update={"record": folder + place.record}) for place in WHERE]
    figure = places_figure(first, places, groups["phase_shares"])
    figure.canvas.draw()
    names = [text.get_text() for text in figure.axes[1].get_yticklabels()]
    assert all(len(name) <= LONGEST_BESIDE_AXES and name.endswith("deg.csv") for name in names)
    assert figure.axes[1].get_position().width > 0.2


def test_a_round_has_its_candidates(task: Task) -> None:
    finding = named(task)
    figures = drawn_search(replace(finding, steps=finding.steps * 2))
    assert {"candidates", "candidates 2"} <= set(figures)
    bars = figures["candidates"].axes[0].patches
    assert len(bars) == len(finding.ranking)
    assert bars[0].get_facecolor() != bars[1].get_facecolor() == bars[2].get_facecolor()
    assert bars[0].get_facecolor() == to_rgba(FINAL)


def test_gaps_far_apart_get_a_logarithmic_axis(task: Task) -> None:
    finding = named(task)
    held = tuple(one.model_copy(update={"gap_before": 60.0}) for one in finding.held_out)
    axes = drawn_search(replace(finding, held_out=held))["gap"].axes
    assert [one.get_xscale() for one in axes] == ["linear", "linear", "log"]


def test_where_nothing_was_measured_nothing_is_drawn(task: Task) -> None:
    """A force that was clipped says nothing of its residual there: no zero stands in for it."""
    fitted = fitted_of(identified(task, wrong=3.0))
    (states,), whole = _of_states(fitted, "force", "tension")
    high = fitted.states["tension"].values > np.median(states)
    fitted._measured["force"] = np.where(high, np.nan, fitted._measured["force"])
    (left,), residual = _of_states(fitted, "force", "tension")
    assert 0 < len(left) < len(states)
    assert left.max() <= np.median(states)
    assert np.isfinite(residual).all()
    assert len(_of_states(fitted, "position", "tension")[1]) == len(whole)


def test_gaps_below_the_noise_are_on_a_logarithmic_axis_too(task: Task) -> None:
    """Where a study states twice the noise."""
    finding = named(task)
    held = tuple(one.model_copy(update={"gap_before": 60.0, "gap_after": 0.4}) for one in finding.held_out)
    axes = drawn_search(replace(finding, held_out=held))["gap"].axes[-1]
    assert axes.get_xscale() == "log"
    assert axes.get_xlim()[0] < 0.4


def test_a_channel_that_no_noise_judges_has_no_gap(task: Task) -> None:
    """As the force that drives an axis: how much of it is explained stands in the gap of all records alone."""
    summary, groups = saved_search(named(task))
    explained = ChannelGap(rms=2.0, unit="N", noise=None, ratio=None, explained=0.998)
    gap = Gap(total=summary.gap.total, **summary.gap.channels, drive=explained)
    shown = summary.model_copy(update={"gap": gap})
    figure = discovery_figures(shown, groups)["gap"]
    assert len(figure.axes) == len(discovery_figures(summary, groups)["gap"].axes)
    assert discovery_report(shown)
    table = gaps_table({n: one.gap for n, one in shown.records.items()}, gap, shown.before.records, shown.before.gap)
    assert all(row[-2] == "" for row in table.rows)


def test_averages_leave_out_what_is_missing() -> None:
    values = np.array([1.0, 1.0, np.nan, 1.0, 3.0, 3.0, np.nan, np.nan, np.nan])
    smooth = _smooth(values, 3)
    assert smooth[2] == 1.0
    assert smooth[4] == pytest.approx(7.0 / 3.0)
    assert np.isnan(smooth[7])


def test_the_best_curve_is_large_and_says_where_it_acts_and_where_it_is_supported() -> None:
    figure = curve_figure(CURVES)
    figure.canvas.draw()
    best, stays, *others = figure.axes
    assert best.get_legend_handles_labels()[1] == ["where it acts", "95 % band", "height at a knot"]
    assert best.get_ylabel() == "height / N"
    assert (stays.get_xlabel(), stays.get_ylabel()) == ("position / mm", "time / s")
    (line,) = (line for line in best.lines if line.get_label() == "height at a knot")
    np.testing.assert_allclose(line.get_ydata(), CURVES[0].heights)
    assert [bar.get_height() for bar in stays.patches] == list(CURVES[0].seconds)
    assert len(others) == len(CURVES) - 1
    assert others[1].get_ylabel() == "height / mm"
    assert others[2].get_xlabel() == "position / (mm/s)"
    said = [" ".join(axes.texts[0].get_text().split()) for axes in others]
    assert said == [f"{curve.says}: gap {curve.gap_after:.2f}" for curve in CURVES[1:]]


def test_where_nothing_was_seen_the_band_does_not_set_the_scale() -> None:
    axes = curve_figure(CURVES[:1]).axes[0]
    assert np.isfinite(axes.get_ylim()).all()
    assert axes.get_ylim()[1] < 1.7 * max(CURVES[0].heights)


def test_a_curve_no_knot_of_which_is_determined_is_drawn() -> None:
    nothing = (0.0,) * 40
    blind = CURVES[0].model_copy(
        update={"heights": nothing, "std_errors": (None,) * 40, "seconds": nothing, "acts": None}
    )
    figure = curve_figure((blind, blind))
    figure.canvas.draw()
    assert figure.axes
    assert all(np.isfinite([*axes.get_xlim(), *axes.get_ylim()]).all() for axes in figure.axes)


def with_stretch(found: Identification) -> Identification:
    """The same, with a fibre whose stretch is not the position of the weight, as behind a drive."""
    states = found.motion.states
    stretch = states["tension"] / 2.2e4
    more = {"stretch": stretch, "stretch rate": np.gradient(stretch, axis=1) / 5e-4}
    return replace(found, motion=replace(found.motion, states=states | more))


def test_the_spectrum_has_a_panel_a_channel_with_the_noise_and_both_models(task: Task) -> None:
    axes = drawn_search(named(task))["spectrum"].axes
    assert [one.get_ylabel() for one in axes] == ["force residual / (N²/Hz)", "position residual / (µm²/Hz)"]
    assert axes[-1].get_xlabel() == "frequency / Hz"
    for one in axes:
        assert (one.get_xscale(), one.get_yscale()) == ("log", "log")
        assert [line.get_label() for line in one.lines] == ["noise at rest", "first model", "final model"]
        floor, first, final = (np.asarray(line.get_ydata()) for line in one.lines)
        # What was made is a wave of 40 rad/s and noise, which is white.
        assert first[:3].max() > 10.0 * final[:3].max()
        assert np.median(first[-100:] / final[-100:]) == pytest.approx(1.0, abs=0.2)
        assert len(floor) == len(first)


def test_residuals_are_shown_against_every_state_the_rig_has(task: Task) -> None:
    finding = named(task)
    before, after = with_stretch(finding.before), with_stretch(finding.after)
    figures = drawn_search(replace(finding, before=before, after=after))
    axes = figures["states"].axes
    labels = ["position / mm", "speed / (mm/s)", "stretch / mm", "stretch rate / (mm/s)", "tension / N"]
    assert [one.get_xlabel() for one in axes] == [""] * 5 + labels
    assert len({one.get_ylim() for one in axes[:5]}) == 1
    plane = figures["map of the fibre"].axes
    assert {one.get_xlabel() for one in plane} >= {"stretch / mm"}
    assert {one.get_ylabel() for one in plane} >= {"stretch rate / (mm/s)"}


def test_of_a_rig_that_turns_position_is_an_angle(task: Task) -> None:
    fitted = fitted_of(named(task).before)
    assert (_unit(fitted, "position"), _unit(fitted, "speed")) == ("m", "m/s")
    finding = named(task).before
    rig = SimpleNamespace(channels=("angle", "force_1", "force_2"))
    turning = SimpleNamespace(layout=finding.problem.layout, model=SimpleNamespace(rig=rig))
    group = motion_group(turning, finding.motion)  # type: ignore[arg-type]
    assert (group["position"].unit, group["speed"].unit) == ("rad", "rad/s")
    assert readable_unit(np.array([0.1]), group["position"].unit)[1] > 0.0


def test_the_band_of_an_averaged_residual_is_that_of_averaged_noise(task: Task) -> None:
    """White noise of n samples averaged is louder by a root of n than its mean."""
    finding = named(task)
    groups = saved_search(finding)[1]
    channel = fitted_of(finding.before).compared(0)[0]
    spectrum = dict(groups["residual_spectrum"])
    step = float(np.median(np.diff(channel.times)))
    white = 2.0 * step * np.ones_like(spectrum["floor"].values)
    spectrum["floor"] = replace(spectrum["floor"], values=white)
    width = round(SMOOTH / step)
    assert averaged_noise(spectrum, channel) == pytest.approx(1.0 / np.sqrt(width), rel=0.05)


def test_every_figure_of_a_search_has_a_caption(task: Task) -> None:
    for name, figure in drawn_search(named(task)).items():
        assert len(caption_of(figure).split()) > 5, name
        assert caption_of(figure).endswith("."), name


def test_the_residuals_of_the_rounds_are_saved(task: Task) -> None:
    finding = named(task)
    left = finding.before.residuals
    found = replace(finding.steps[0], residuals=left, residuals_with=(finding.after.residuals, left))
    groups = saved_search(replace(finding, steps=(found,)))[1]["rounds"]
    np.testing.assert_allclose(groups["left"].values[0], left, atol=6e-4)
    assert groups["effect"].values.tolist() == [one.effect for one in found.summary.ranking[:2]]
    data = finding.before.problem.observations
    for i, channel in enumerate(finding.before.problem.model.rig.channels):
        weight = np.asarray(data.weight[channel])
        np.testing.assert_allclose((groups["noise"].values[:, i] * weight)[weight > 0.0], 1.0)
        assert np.isnan(groups["noise"].values[:, i][weight == 0.0]).all()
    assert saved_search(finding)[1]["rounds"] == {}
