"""Figures of a fit: which there are, what they show, and that nothing global is touched."""

from __future__ import annotations

import base64
import dataclasses
import io
import re
import subprocess
import sys
from pathlib import Path
from typing import Any, cast

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image, ImageColor

from fibrefit.core.declarations import HELD, LOADING, REST, SLACK, UNLOADING
from fibrefit.core.matrices import correlation_matrix
from fibrefit.fitting.result import Identification, Starts
from fibrefit.plots.certainty import correlation_figure
from fibrefit.plots.fit import MOST_RECORDS, fit_figures
from fibrefit.plots.save import figure_file, save_figures
from fibrefit.plots.shrink import small_png
from fibrefit.plots.snaps import first_contact
from fibrefit.plots.starts import starts_figure
from fibrefit.plots.style import VERMILLION, caption_of
from fibrefit.problem.task import Task
from fibrefit.store import read_result, write_result
from fibrefit.study.summaries.check import SIZE, Check
from fibrefit.workflow.fit_files import _starts_group
from fibrefit.workflow.simulate import Simulation
from tests.plots.saved import drawn_fit, fitted_of, saved_fit
from tests.study.test_summaries import PROVENANCE


@pytest.fixture(scope="module")
def figures(found: Identification) -> dict[str, Figure]:
    return drawn_fit(found)


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
        "overview",
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
    fitted = fitted_of(found)
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
    assert first_contact(fitted_of(stays), 0, (LOADING, UNLOADING, REST))[1] is None
    assert "release" not in texts(drawn_fit(stays)["snaps"]).splitlines()


def test_starts_show_every_basin_with_its_own_mark(found: Identification) -> None:
    starts = found.starts
    basin = np.array([0, 0, 0, 1, 1, 2, -1, 0])
    cost = np.where(basin < 0, np.inf, starts.cost * (1.0 + 3.0 * np.maximum(basin, 0)))
    spread = dataclasses.replace(starts, basin=basin, cost=cost)
    figure = starts_figure(_starts_group(spread), {"stiffness": "N/m"})
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
    assert "given up: 2" in texts(starts_figure(_starts_group(lost), {"k": "N/m"}))


def test_correlations_leave_out_what_is_not_determined() -> None:
    covariance = np.array([[4.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, np.inf]])
    found = correlation_matrix(covariance)
    assert found[0, 1] == 0.5
    assert np.isnan(found[2]).all()
    assert ".50" in texts(correlation_figure(("a", "b", "c[r.csv]"), covariance))


def test_of_many_values_those_that_are_correlated_most_are_drawn() -> None:
    """Two values of all records, and forty of single ones, of which two trade places."""
    names = ("stiffness", "damping", *(f"zero[{'long ' * 20}{i}.csv]" for i in range(40)))
    covariance = np.eye(len(names))
    covariance[30, 31] = covariance[31, 30] = 0.9
    said = texts(correlation_figure(names, covariance))
    assert "20 of 42 are shown, with the largest correlation; those of all records first" in said
    assert {"stiffness  1", "damping  2"} <= set(said.splitlines())
    assert ".90" in said
    assert max(len(line) for line in said.splitlines() if re.search(r"  \d+$", line)) < 100


def test_the_reported_interval_stands_out(found: Identification, figures: dict[str, Figure]) -> None:
    said = texts(figures["errors"])
    assert said.count("(reported)") == 3
    assert f"The reported error bars are {found.error_inflation:.2g} times those under white noise" in said
    for method in ("white (i.i.d.) noise", "whitened (GLS) (reported)", "not whitened (OLS)"):
        assert method in said


@pytest.mark.parametrize(
    ("kind", "says"), [("profile likelihood", "profile (reported)"), ("population", "mean of population (reported)")]
)
def test_an_interval_that_no_standard_error_tells_is_shown_beside_the_others(
    found: Identification, figures: dict[str, Figure], kind: str, says: str
) -> None:
    profile = {"interval_kind": kind, "interval_95": (1.0, 2.0e5)}
    estimates = tuple(
        e._replace(found=e.found.model_copy(update=profile)) if e.record is None else e for e in found.estimates
    )
    figure = drawn_fit(dataclasses.replace(found, estimates=estimates))["errors"]
    said = texts(figure)
    assert says in said
    assert "(GLS) (reported)" not in said
    assert says not in texts(figures["errors"])
    ends = [line.get_xdata() for line in figure.axes[0].lines]
    assert any(len(each) == 2 and each[1] / each[0] == pytest.approx(2.0e5) for each in ends)


def test_of_a_long_series_the_worst_records_are_drawn(found: Identification, monkeypatch: pytest.MonkeyPatch) -> None:
    assert MOST_RECORDS >= 24
    monkeypatch.setattr("fibrefit.plots.fit.MOST_RECORDS", 1)
    worst = max(found.record_gaps, key=lambda name: max(gap.ratio for gap in found.record_gaps[name].values()))
    assert [name for name in drawn_fit(found) if name.startswith("record")] == [f"record {worst}"]


def test_a_simulation_is_drawn_over_what_was_measured(task: Task, found: Identification) -> None:
    figures = Simulation(cast(Any, None), task, dict(found.readings)).plot()
    assert list(figures) == ["record drop_5mm.csv", "record drop_10mm.csv"]
    labels = [line.get_label() for line in figures["record drop_5mm.csv"].axes[0].lines]
    assert labels == ["measured", "simulated"]


def test_sizes_are_fixed(figures: dict[str, Figure]) -> None:
    assert {round(figures[f"record drop_{lift}mm.csv"].get_size_inches()[0] * 25.4) for lift in (5, 10)} == {183}
    for figure in figures.values():
        width, height = figure.get_size_inches() * 25.4
        assert 85.0 < width < 260.0
        assert 40.0 < height < 297.0


def test_every_title_is_a_sentence_that_the_caption_repeats(figures: dict[str, Figure]) -> None:
    for name, figure in figures.items():
        caption = caption_of(figure)
        heading = " ".join(text.get_text() for text in figure.texts if text.get_fontweight() == "bold")
        assert caption.endswith("."), name
        assert len(caption.split()) > 5, name
        assert name == "overview" or caption.startswith(heading[:20]), name


def test_the_overview_has_records_values_and_verdict(found: Identification, figures: dict[str, Figure]) -> None:
    said = texts(figures["overview"])
    for words in ("drop_5mm.csv", "drop_10mm.csv", "stiffness", "Gap by record", "residual / noise", "checks"):
        assert words in said


def test_the_overview_tells_failed_numbers_from_what_the_model_lacks(found: Identification) -> None:
    summary, groups = saved_fit(found)
    right = summary.model_copy(
        update={"status": "ok", "checks": tuple(c.model_copy(update={"passed": True}) for c in summary.checks)}
    )
    assert caption_of(fit_figures(right, groups)["overview"]).endswith("All checks passed.")
    first, second, *others = right.checks
    larger = first.model_copy(update={"passed": False, "about": "model", "identifier": SIZE})
    unknown = second.model_copy(update={"passed": False, "about": "model", "identifier": "noise_level"})

    def drawn(*checks: Check) -> Figure:
        return fit_figures(right.model_copy(update={"checks": (*checks, *others)}), groups)["overview"]

    # Error bars allow for that only by the method that does.
    assert "What is left is more than noise: the model lacks something" in texts(drawn(larger, unknown))
    allows = right.model_copy(update={"checks": (larger, *others), "error_method": "discrepancy"})
    assert "allow for what is left, which is more than noise" in texts(fit_figures(allows, groups)["overview"])
    assert caption_of(drawn(larger, unknown)).endswith(". 2 say that the model lacks something.")
    said = caption_of(drawn(larger, second.model_copy(update={"passed": False})))
    assert said.endswith("1 check of the numbers failed; 1 says that the model lacks something.")
    # That the noise is not known from a rest does not say that more than noise is left.
    assert "no larger than the noise" in texts(drawn(first, unknown))
    assert caption_of(drawn(first, unknown)).endswith(". 1 leaves a doubt about the model.")


def test_records_are_cropped_to_their_motion(found: Identification, figures: dict[str, Figure]) -> None:
    figure = figures["record drop_10mm.csv"]
    from_s, to_s = figure.axes[1].get_xlim()
    fitted = fitted_of(found)
    phase, times = fitted.phase(1), fitted.times(1)
    moving = times[~np.isin(phase, (HELD, REST))]
    assert from_s <= moving[0] <= moving[-1] <= to_s
    cut = to_s - from_s < times[-1] - times[0]
    assert cut == ("not shown: rest" in texts(figure))


def test_a_saved_result_is_drawn_as_the_one_it_was_saved_from(found: Identification, tmp_path: Path) -> None:
    summary, groups = saved_fit(found)
    write_result(tmp_path / "result.h5", "fibrefit/fit/1", groups, PROVENANCE)
    read, _ = read_result(tmp_path / "result.h5")
    first, again = fit_figures(summary, groups), fit_figures(summary, read)
    assert list(first) == list(again)
    for name in first:
        assert texts(first[name]) == texts(again[name])


def test_figures_are_written_in_every_format_with_their_captions(figures: dict[str, Figure], tmp_path: Path) -> None:
    paths = save_figures({"starts": figures["starts"]}, tmp_path, formats=("png", "pdf", "svg"))
    assert [path.name for path in paths] == ["starts.png", "starts.pdf", "starts.svg"]
    assert small_png(paths[0].read_bytes())[1] == caption_of(figures["starts"])
    assert paths[1].read_bytes().startswith(b"%PDF")
    assert caption_of(figures["starts"])[:30] in paths[2].read_text(encoding="utf-8")
    assert save_figures({"starts": figures["starts"]}, tmp_path / "none", formats=()) == []


def test_a_picture_for_the_page_keeps_the_colour_of_a_single_point() -> None:
    drawn = Image.effect_noise((600, 400), 80.0).convert("RGB")
    red = ImageColor.getrgb(VERMILLION)
    drawn.paste(red, (300, 200, 304, 204))
    blue = Image.linear_gradient("L").resize((600, 200))
    drawn.paste(Image.merge("RGB", (blue, blue, Image.new("L", blue.size, 255))), (0, 0))
    file = io.BytesIO()
    drawn.save(file, "PNG")
    small, _ = small_png(file.getvalue())
    with Image.open(io.BytesIO(small)) as picture:
        kept = picture.convert("RGB").getpixel((302, 202))
    assert isinstance(kept, tuple)
    assert max(abs(a - b) for a, b in zip(kept, red, strict=True)) < 40


def test_a_notebook_shows_all_figures_at_once(figures: dict[str, Figure]) -> None:
    html = figures._repr_html_()  # type: ignore[attr-defined]
    assert html.count("<img") == len(figures)
    alone = figures.only("starts")._repr_html_()  # type: ignore[attr-defined]
    assert len(alone) < 0.6 * len(base64.b64encode(figure_file(figures["starts"])))
    assert 'alt="31 of' in html or "starts reached the best minimum" in html


def test_nothing_global_is_touched(found: Identification) -> None:
    before = dict(mpl.rcParams)
    drawn_fit(found)
    assert dict(mpl.rcParams) == before


def test_drawing_needs_neither_pyplot_nor_jax() -> None:
    loads = "import sys; import fibrefit.plots.fit, fibrefit.plots.save"
    code = f"{loads}; print({{'matplotlib.pyplot', 'jax'}} & set(sys.modules))"
    root = Path(__file__).resolve().parents[2]
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=root)
    assert done.stdout.strip() == "set()"
