"""Every threshold of a series decides: with twice or half of it something else would be said."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.report import pooled
from fibrefit.series import jumps, thresholds
from fibrefit.series import meta_analysis as trends
from fibrefit.series import speed_models as models
from fibrefit.study.summaries.series import OutlierSummary, TrendSummary
from tests.brackets import Bracket
from tests.brackets import thresholds as names_in

NUMBER = 40
NAMES = [f"record {n}" for n in range(NUMBER)]
ORDER = trends.Quantity("order", "-", np.arange(float(NUMBER)), np.zeros(NUMBER))


def law(log: float, parameters: int) -> Any:
    """A law of speed with so many parameters."""
    return SimpleNamespace(log=log, effects=(SimpleNamespace(parameters=(None,) * parameters),))


def chosen(*found: Any) -> Any:
    """The law that is taken; the first is the most probable, and that of constant parameters is 0."""
    look = SimpleNamespace(found=found, gain=lambda one: one.log)
    return models._simplest(cast(Any, look))


def simpler(*found: Any) -> bool:
    """Whether a law with one parameter is taken."""
    return len(chosen(*found).effects[0].parameters) == 1


def series(values: np.ndarray) -> trends.Quantity:
    return trends.Quantity("damping", "N s/m", values, np.full(len(values), 0.1))


def outliers(share: float) -> bool:
    """Whether so large a share of the records is left out, one after another, the oddest first."""
    values = np.random.default_rng(0).standard_normal(NUMBER)
    odd = round(share * NUMBER)
    values[3 :: NUMBER // odd][:odd] += 10.0 ** np.arange(2, 2 + odd)
    found = trends.trend_of(NAMES, series(values), ORDER)
    return found is not None and len(found.outliers) == odd


def outlier(chance: float) -> bool:
    """Whether a record is named that so large a share of series would have by chance."""
    values = np.random.default_rng(0).standard_normal(NUMBER)
    values[7] += 6.0

    def named(looks: float) -> tuple[OutlierSummary, ...]:
        found = trends.trend_of(NAMES, series(values), ORDER, cast(Any, looks))
        assert found is not None
        return found.outliers

    return bool(named(1e-9 * chance / named(1e-9)[0].chance))


def line_of(records: int) -> bool:
    """Whether so many records give a line."""
    some = slice(0, records)
    order = trends.Quantity("order", "-", ORDER.values[some], ORDER.errors[some])
    return trends.trend_of(NAMES[some], series(np.array([1.0, 2.5, 2.7, 4.2, 5.0])[some]), order) is not None


def logarithmic(error: float) -> bool:
    """Whether values with such relative errors are told by their logarithms."""
    values = np.array([90.0, 100.0, 110.0])
    found = trends.population(values, error * values)
    return found is not None and found.logarithmic


def smooth(*amplitude: float) -> bool:
    """Whether a curve has no jump."""
    return not jumps.jumps(np.arange(float(len(amplitude))), np.array(amplitude))


def trend(chance: float) -> TrendSummary:
    """A trend that chance makes so often, corrected for all looks."""
    line = trends.trend_of(NAMES, series(np.random.default_rng(0).standard_normal(NUMBER)), ORDER)
    assert line is not None
    return line.model_copy(update={"chance_corrected": chance, "outliers": ()})


CASES = (
    Bracket("PREFERRED", models, lambda x: chosen(law(x, 1)) is None, 4.0, 6.0),
    Bracket("SIMPLER_LAW", models, lambda x: simpler(law(50.0, 2), law(50.0 - x, 1)), 0.8, 1.3),
    Bracket("SIGNIFICANT", pooled, lambda x: "None of" not in pooled.trend_sentences([trend(x)])[0], 0.04, 0.07),
    Bracket("OUTLIER", trends, outlier, 0.008, 0.013),
    Bracket("FEWEST_RECORDS", trends, lambda n: line_of(int(n)), 4, 3),
    Bracket("MOST_OUTLIERS", trends, outliers, 0.1, 0.15),
    Bracket("LOGARITHMIC", trends, logarithmic, 0.25, 0.4),
    Bracket("HIGH", jumps, lambda x: smooth(1.0 - x, 1.0 - x, 1.0 - x, 1.0, 1.0, 1.0), 0.04, 0.07),
    Bracket("STEEP_JUMP", jumps, lambda x: smooth(0.0, 0.2, 0.2 + 0.2 * x, 0.4 + 0.2 * x), 2.5, 3.5),
)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_what_is_said_turns_at_the_threshold(case: Bracket, monkeypatch: pytest.MonkeyPatch) -> None:
    case.test(monkeypatch)


def test_no_threshold_is_without_a_case() -> None:
    assert names_in(thresholds) == {case.name for case in CASES}
