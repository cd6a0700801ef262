"""Files of figures, axes and lines, and the figure of a measurement file."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure

import fibrefit.plots
from fibrefit.core.paths import LONGEST_STEM
from fibrefit.plots.lines import MOST, thinned
from fibrefit.plots.quantities import axis_label, readable_unit
from fibrefit.plots.save import figure_file, file_names, save_figures
from fibrefit.plots.style import axes_at, logarithmic, new_figure
from fibrefit.plots.table import table_figure
from fibrefit.records import read_record, read_table

PNG = b"\x89PNG\r\n\x1a\n"


def test_figures_become_files_named_after_them(tmp_path: Path) -> None:
    figures = {name: new_figure(40.0) for name in ("record a/b.csv", "record a b.csv", "../../etc", "con", "Čeština")}
    paths = save_figures(figures, tmp_path / "figures")
    assert [path.name for path in paths] == [
        "record_a_b.png",
        "record_a_b_2.png",
        "etc.png",
        "con_.png",
        "Cestina.png",
    ]
    assert all(path.parent == tmp_path / "figures" and path.read_bytes().startswith(PNG) for path in paths)


@given(st.lists(st.text(), min_size=1, max_size=6, unique=True))
def test_any_names_give_safe_and_different_files(names: list[str]) -> None:
    stems = file_names(names)
    assert len({stem.casefold() for stem in stems}) == len(names)
    for stem in stems:
        assert stem.isascii()
        assert stem.replace("_", "").replace("-", "").isalnum() or set(stem) <= {"_", "-"} or stem == "figure"
        assert 0 < len(stem) <= LONGEST_STEM + 4


@pytest.mark.parametrize(
    ("largest", "si", "unit", "worth"),
    [
        (0.0123, "m", "mm", 1e-3),
        (2.0e-5, "m", "µm", 1e-6),
        (81.0, "N", "N", 1.0),
        (2300.0, "N", "kN", 1e3),
        (0.4, "N", "N", 1.0),
        (1.2, "rad", "°", np.pi / 180),
        (0.0, "m", "m", 1.0),
        (np.nan, "N", "N", 1.0),
    ],
)
def test_axes_have_the_unit_a_person_would_choose(largest: float, si: str, unit: str, worth: float) -> None:
    assert readable_unit(np.array([0.0, -largest, np.nan]), si) == (unit, pytest.approx(worth))


def test_labels_follow_the_way_of_the_standard() -> None:
    assert axis_label("position_zero", "mm") == "position zero / mm"
    assert axis_label("stiffness", "kN/m") == "stiffness / (kN/m)"
    assert axis_label("asymmetry", "-") == "asymmetry"


def test_a_long_record_keeps_its_extremes() -> None:
    times = np.arange(200_000) / 2000.0
    values = np.sin(times)
    values[77_777], values[150_001] = 9.0, -7.0
    values[20_000:30_000] = np.nan
    x, y = thinned(times, values)
    assert len(y) <= MOST + 2
    assert np.nanmax(y) == 9.0
    assert np.nanmin(y) == -7.0
    assert np.isnan(y[(x > 10.1) & (x < 14.9)]).all()
    short = np.arange(10.0)
    assert thinned(short, short)[1] is short


def long_noisy() -> Figure:
    figure = new_figure(50.0)
    axes = axes_at(figure, 10.0, 10.0, 100.0, 30.0)
    axes.plot(*thinned(np.arange(1e6), np.random.default_rng(0).normal(size=1_000_000)), linewidth=0.4)
    return figure


def test_a_million_samples_can_be_drawn(tmp_path: Path) -> None:
    (path,) = save_figures({"long": long_noisy()}, tmp_path)
    assert path.stat().st_size > 1000


def csv(path: Path, rows: list[str]) -> Path:
    path.write_text("time [s],force [N],position [mm]\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return path


@pytest.fixture
def damaged(tmp_path: Path) -> Path:
    """A record with bad cells and forty missing rows."""
    rows = [f"{i / 2000:.4f},{np.sin(i / 50):.4f},{i / 100:.3f}" for i in range(400)]
    rows[100] = "0.0500,OVERLOAD,1.000"
    return csv(tmp_path / "torn.csv", rows[:200] + rows[240:])


def test_the_figure_of_a_file_shows_columns_masks_and_gaps(damaged: Path) -> None:
    for what in (read_table(damaged), read_record(damaged)):
        figure = table_figure(what)
        assert [axes.get_ylabel().partition(" ")[0] for axes in figure.axes] == ["force", "position"]
        legend = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
        assert legend == ["masked (1)", "missing"]
        assert np.isnan(figure.axes[1].lines[0].get_ydata()).any()  # the gap is left open
        assert "torn.csv, as it was understood" in [text.get_text() for text in figure.texts]
        assert any("2000 Hz" in text.get_text() for text in figure.texts)


def test_columns_of_two_rates_each_have_their_own_times() -> None:
    path = Path(__file__).resolve().parents[1] / "data" / "loggers" / "08_catman_two_rates.txt"
    figure = table_figure(read_table(path))
    steps = [float(np.diff(axes.lines[0].get_xdata())[0]) for axes in figure.axes]
    assert steps == pytest.approx([0.5e-3, 10e-3])
    assert any("100 Hz" in text.get_text() for text in figure.texts)


def test_logarithmic_axes_have_plain_numbers() -> None:
    figure = new_figure(60.0)
    axes = axes_at(figure, 20.0, 15.0, 140.0, 40.0)
    axes.plot([1e-3, 1.0], [0.5, 300.0])
    logarithmic(axes, "x", "y")
    figure_file(figure)
    shown = [text.get_text() for axis in (axes.xaxis, axes.yaxis) for text in axis.get_ticklabels(which="both")]
    assert {"0.01", "0.1", "10", "100"} <= set(shown)
    assert not any("$" in text for text in shown)


def test_no_figure_is_logarithmic_in_another_way() -> None:
    folder = Path(fibrefit.plots.__file__).parent
    assert not [path.name for path in folder.glob("*.py") if re.search(r"scale\(.log", path.read_text("utf-8"))]


def test_many_columns_are_counted(tmp_path: Path) -> None:
    header = "time [s]," + ",".join(f"c{i} [V]" for i in range(20))
    rows = [f"{t / 100:.2f}," + ",".join(f"{np.sin(t + i):.3f}" for i in range(20)) for t in range(60)]
    path = tmp_path / "many.csv"
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    figure = table_figure(read_table(path))
    assert len(figure.axes) == 12
    assert any("8 further columns not shown" in text.get_text() for text in figure.texts)
