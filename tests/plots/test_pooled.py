"""Pictures of a series say in their titles what is seen."""

from __future__ import annotations

from typing import Any

import pytest

from fibrefit.plots.batch import _parameters, batch_figures
from fibrefit.plots.pooled import RecordValue, population_figure, trends_figure
from fibrefit.plots.style import caption_of
from fibrefit.report.pooled import population_rows
from fibrefit.series.meta_analysis import BY_ORDER
from fibrefit.study.summaries.results import ParameterSummary
from fibrefit.study.summaries.series import BatchItem, BatchSummary, OutlierSummary, PopulationSummary, TrendSummary
from fibrefit.workflow.together.pooled import quantities_of

RECORDS = ("slow.csv", "middle.csv", "fast.csv")
MEAN = {"stiffness": 14.7e3, "guide.stribeck_friction.stribeck_speed": 0.02}


def population(chance: float) -> dict[str, PopulationSummary]:
    more = {"unit": "N/m", "relative": True, "between_records": 0.03, "between_records_interval_95": (0.01, 0.05)}
    ends = {name: (0.99 * mean, 1.01 * mean) for name, mean in MEAN.items()}
    return {
        name: PopulationSummary(
            mean=mean, mean_interval_95=ends[name], new_record_interval_95=ends[name], chance=found, **more
        )
        for (name, mean), found in zip(MEAN.items(), (0.6, chance), strict=True)
    }


VALUES = {
    record: {name: RecordValue(mean * (1.0 + 0.01 * i), 0.01 * mean, mean, 0.005 * mean) for name, mean in MEAN.items()}
    for i, record in enumerate(RECORDS)
}


def test_no_gap_of_a_batch_lies_at_the_edge_of_its_panel() -> None:
    gaps = {"a": 0.98, "b": 1.02, "c": 3.1}
    value = {"stiffness": ParameterSummary(value=1e4, unit="N/m", std_error=10.0, free=True)}
    items = {name: BatchItem(status="ok", gap=gap, parameters=value) for name, gap in gaps.items()}
    for shown in (("a", "b"), ("a", "b", "c")):
        axes = _parameters({name: items[name] for name in shown})["parameters"].axes[-1]
        low, high = axes.get_ylim()
        assert low == 0.0
        assert high > 1.05 * max(gaps[name] for name in shown)


def test_an_item_that_failed_leaves_the_others_room() -> None:
    def item(value: float, status: str = "ok", gap: float = 1.0) -> BatchItem:
        found = ParameterSummary(value=value, unit="N/m", std_error=1e-3 * value, free=True)
        return BatchItem(status=status, gap=gap, parameters={"stiffness": found})

    sound = {f"{i}": item(1e4 + 10.0 * i) for i in range(9)}
    values, gaps = _parameters({**sound, "lost": item(1e7, "failed", 300.0)})["parameters"].axes
    low, high = values.get_ylim()
    assert 9.8 < low < 10.0 < 10.08 < high < 10.3  # kN/m
    assert any(text.get_text() == "1 beyond" for text in values.texts)
    assert gaps.get_yscale() == "log"
    alone, _ = _parameters(sound)["parameters"].axes
    assert not alone.texts


def test_an_interval_is_told_to_digits_that_tell_its_ends_apart() -> None:
    ends = {"mean_interval_95": (14723.1, 14723.9), "new_record_interval_95": (14695.0, 14752.0)}
    found = population(0.5)["stiffness"].model_copy(update={"mean": 14723.5, **ends})
    (row,) = population_rows({"stiffness": found})
    assert row == ("stiffness", "14.72350", "14.72310 to 14.72390", "3 %", "14.695 to 14.752", "kN/m")


def test_items_of_which_no_gap_is_known_are_drawn() -> None:
    """As where no motion could be simulated."""
    value = {"stiffness": ParameterSummary(value=1e4, unit="N/m", free=True)}
    axes = _parameters({"a": BatchItem(status="failed", gap=None, parameters=value)})["parameters"].axes[-1]
    assert axes.get_ylim() == (0.0, pytest.approx(1.32))


def test_how_items_ended_is_seen_without_colours() -> None:
    value = {"stiffness": ParameterSummary(value=1e4, unit="N/m", std_error=10.0, free=True)}
    items = {name: BatchItem(status=name, gap=1.0, parameters=value) for name in ("ok", "suspect", "failed")}
    axes, _ = _parameters(items)["parameters"].axes
    assert {line.get_marker() for line in axes.lines if len(line.get_xdata()) == 1} == {"o", "^", "s"}


@pytest.mark.parametrize(
    ("chance", "says"),
    [
        (0.02, "Stribeck speed differs from record to record by 3 % (probability by chance 0.02)"),
        (0.03, "Records differ by no more than chance: stribeck speed by 3 % (probability 0.03)"),
    ],
)
def test_what_differs_is_said_with_its_probability(chance: float, says: str) -> None:
    """Of two parameters the surer has to be half as probable by chance as one alone."""
    assert caption_of(population_figure(population(chance), VALUES)).startswith(says)


@pytest.mark.parametrize("name", ["stiffness", "guide.own_law." + "long_" * 12 + "name"])
def test_the_legend_stands_below_the_remark_however_long_the_title(name: str) -> None:
    found = population(0.02)["stiffness"].model_copy(update={"chance": 0.001})
    figure = population_figure({name: found}, VALUES)
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    remark = min(text.get_window_extent(renderer).y0 for text in figure.texts)
    legend = figure.axes[0].get_legend()
    assert legend is not None
    assert legend.get_window_extent(renderer).y1 < remark


@pytest.mark.parametrize(
    ("chances", "says"),
    [
        ((0.01, 0.5), "1 of 2 possible trends is stronger than chance: stiffness over added mass first"),
        ((0.06, 0.5), "None of 2 trends is stronger than chance"),
    ],
)
def test_trends_are_counted(chances: tuple[float, ...], says: str) -> None:
    found = [
        TrendSummary(
            parameter=name,
            condition="added_mass",
            condition_unit="kg",
            unit="N/m",
            records=3,
            slope=1.0,
            slope_error=1.0,
            slope_interval_95=(-1.0, 3.0),
            intercept=mean,
            between_records=0.0,
            chance=chance,
            chance_corrected=chance,
        )
        for (name, mean), chance in zip(MEAN.items(), chances, strict=True)
    ]
    where = {
        record: BatchItem(status="ok", conditions={"added_mass": float(i)}, condition_errors={"added_mass": 0.1 * i})
        for i, record in enumerate(RECORDS)
    }
    assert caption_of(trends_figure(found, VALUES, where)).startswith(says)


def over(condition: str, unit: str, **more: Any) -> TrendSummary:
    return TrendSummary(
        parameter="stiffness", condition=condition, condition_unit=unit, unit="N/m", records=3, slope=1.0,
        slope_error=1.0, slope_interval_95=(-1.0, 3.0), intercept=1e4, between_records=0.0, chance=0.5,
        chance_corrected=0.5, **more,
    )  # fmt: skip


def test_items_stand_in_their_order_with_those_of_which_nothing_can_be_used() -> None:
    """As the line through them was found: an item that failed is a step of the order too."""
    value = {"stiffness": ParameterSummary(value=1e4, unit="N/m", std_error=10.0, free=True)}
    usable = BatchItem(status="ok", gap=1.0, parameters=value)
    items = {"a": usable, "lost": BatchItem(error="lost: nothing."), "c": usable, "d": usable}
    summary = BatchSummary(status="suspect", name="many", items=items, trends=(over(BY_ORDER, "-"),))
    (line,) = [line for line in batch_figures(summary)["trends"].axes[0].lines if line.get_marker() == "o"]
    assert line.get_xdata().tolist() == [1.0, 3.0, 4.0]
    order = quantities_of(items)[1][-1]
    assert (order.name, order.values.tolist()) == (BY_ORDER, [1.0, 3.0, 4.0])


def test_an_outlier_is_seen_without_colours() -> None:
    found = over("added_mass", "kg", outliers=(OutlierSummary(record=RECORDS[1], score=9.0, chance=1e-4),))
    where = {record: BatchItem(status="ok", conditions={"added_mass": float(i)}) for i, record in enumerate(RECORDS)}
    drawn = [line for line in trends_figure([found], VALUES, where).axes[0].lines if line.get_linestyle() == "None"]
    marks = {line.get_marker(): len(line.get_xdata()) for line in drawn}
    assert marks == {"o": 2, "D": 1}
