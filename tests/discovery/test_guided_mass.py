"""A search on a guide by itself, from records that another integration made: windows, one record, a driving force."""

from __future__ import annotations

from pathlib import Path

import pytest

from fibrefit.study import load_study
from fibrefit.workflow.discovery.discover import Discovery, discover_study
from tests.workflow import axis

BASE = ("guide.viscous_friction",)
SLANTED = "guide.asymmetric_viscous_friction"
TRIED = (SLANTED, "guide.quadratic_drag")
HIDDEN = 0.2
SHIPPED = Path(__file__).resolve().parents[2] / "configs" / "guided_axis"
SURE = 4.0
"""Standard errors by which one value may be wrong."""


def searched(folder: Path, slant: float, ripple: float) -> Discovery:
    return discover_study(load_study(axis.write(folder, BASE, slant=slant, ripple=ripple)), only=TRIED)


def strength(found: Discovery) -> tuple[float, float]:
    estimate = found.parameters[f"{SLANTED}.viscous_asymmetry"]
    return estimate.value, estimate.std_error


@pytest.mark.slow
def test_friction_that_differs_by_direction_is_named_and_called_small_but_systematic(tmp_path: Path) -> None:
    found = searched(tmp_path, HIDDEN, ripple=0.0)
    assert (found.verdict, found.added) == ("named", (SLANTED,))
    value, error = strength(found)
    assert abs(value - HIDDEN) < SURE * error
    (weight,) = found.summary().weights
    assert weight.signal == "force"
    assert 0.02 < weight.share_of_signal < 0.05 < 0.9 < weight.share_of_gap
    assert weight.says.endswith("small but systematic.")
    assert "small but systematic" in found.report().replace("\n  ", " ")
    # One record: there are no others to foresee it from.
    assert found.summary().held_out == ()
    figures = found.plot()
    assert {"overview", "gap", "candidates", "places", "states", "map", "spectrum", "record axis.csv"} == set(figures)


@pytest.mark.slow
def test_nothing_is_named_where_nothing_is_hidden(tmp_path: Path) -> None:
    found = searched(tmp_path, 0.0, ripple=0.0)
    assert (found.verdict, found.added, found.summary().weights) == ("nothing_missing", (), ())


@pytest.mark.slow
@pytest.mark.parametrize("hidden", [HIDDEN, 0.0])
def test_a_force_that_is_logged_wrongly_neither_hides_an_effect_nor_makes_one_up(tmp_path: Path, hidden: float) -> None:
    found = searched(tmp_path, hidden, ripple=1.5)
    assert found.verdict == "unexplained"
    assert found.added == ((SLANTED,) if hidden else ())
    if hidden:
        value, error = strength(found)
        assert abs(value - hidden) < SURE * error
        assert found.summary().weights[0].says.endswith("small but systematic.")


@pytest.mark.slow
def test_the_series_that_ships_lacks_its_asymmetry_when_the_model_does(tmp_path: Path) -> None:
    shaped = "guide.asymmetric_friction"
    for path in SHIPPED.iterdir():
        text = path.read_text(encoding="utf-8").replace(f', "{shaped}"', "")
        (tmp_path / path.name).write_text(text, encoding="utf-8")
    found = discover_study(load_study(tmp_path), only=(shaped, "guide.quadratic_drag"))
    # Its force is logged with an error: a curve with forty knots fits more of that, and is no reason to drop the name.
    assert (found.verdict, found.added) == ("unexplained", (shaped,))
    assert found.parameters[f"{shaped}.asymmetry"].value == pytest.approx(0.2, abs=0.02)
    assert "standard error" in found.summary().weights[0].says
