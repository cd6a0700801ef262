"""How far off a new record may be for the error bars of the values: right as often as it says, by drawn values."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from fibrefit.fitting.uncertainty import Freedom, freedom_of
from fibrefit.study.summaries.results import ParameterSummary
from fibrefit.workflow.prediction.judge import limit
from fibrefit.workflow.prediction.known import _means
from fibrefit.workflow.thresholds import RARE

DRAWS = 200_000
COUNTED = np.ones((1, 10), dtype=bool)
SCATTER = 0.0015
"""Five standard deviations and more of a share of one in a hundred among so many draws."""


def free(sizes: list[float], own: list[float], records: int = 1, known: float = np.inf) -> Freedom:
    """Of values that move readings of their own by their error bars, alike in each record."""
    size = np.array(sizes)
    slopes = np.repeat(np.diag(size)[None], records, axis=0)
    return freedom_of(slopes, np.eye(len(size)), np.array(own), np.full(len(size), known))


def share_beyond(squares: np.ndarray, expected: float, freedom: Freedom) -> float:
    """Of mean squares, the share that does not pass where nothing but errors of values is expected."""
    most = limit({"values": np.full((1, 10), expected)}, COUNTED, freedom)
    return float(np.mean(np.sqrt(squares / expected) > most))


def test_directions_are_counted_by_what_they_do() -> None:
    assert free([2.0, 0.0, 0.0], [0.0] * 3).directions == pytest.approx(1.0)
    assert free([2.0] * 3, [0.0] * 3).directions == pytest.approx(3.0)
    # Four records are off alike by what is common to them, and each by itself by what it differs by.
    assert free([1.0], [0.0], 4).directions == pytest.approx(1.0)
    assert free([1.0], [1.0], 4).directions == pytest.approx(4.0)
    # Half of the variance of each is common: covariances of a half between any two of them.
    assert free([1.0], [0.5], 4).directions == pytest.approx(16.0 / (4.0 + 12.0 * 0.25))
    assert free([], []) == (1.0, np.inf)


def test_what_is_known_with_few_degrees_of_freedom_counts_by_its_share() -> None:
    assert np.isinf(free([1.0], [1.0]).known)
    assert free([1.0], [1.0], known=3.0).known == pytest.approx(3.0)
    found = freedom_of(np.eye(2)[None], np.eye(2), np.ones(2), np.array([3.0, np.inf]))
    assert found.known == pytest.approx(3.0 / 0.25)


@pytest.mark.parametrize("sizes", [[1.0] * 3, [1.0, 0.1, 0.1], [1.0, *[0.05] * 4]], ids=["alike", "3", "5"])
def test_values_that_are_right_are_called_wrong_as_rarely_as_is_said(sizes: list[float]) -> None:
    """The negative control counts values: where one direction outweighs the others that is far too many."""
    random, size = np.random.default_rng(1), np.array(sizes)
    squares = np.sum((random.standard_normal((DRAWS, len(size))) * size) ** 2, axis=1)
    freedom = free(sizes, [0.0] * len(size))
    assert share_beyond(squares, float(size @ size), freedom) == pytest.approx(RARE, abs=SCATTER)
    counted = share_beyond(squares, float(size @ size), Freedom(float(len(size))))
    assert counted == pytest.approx(RARE, abs=SCATTER) if min(sizes) == 1.0 else counted > 4.0 * RARE


@pytest.mark.parametrize("number", [2, 3, 5])
def test_a_record_more_lies_in_the_band_and_within_the_limit(number: int) -> None:
    """Of values that each record has of its own; the negative control takes their scatter for that of all records."""
    random, beyond, inside, plain = np.random.default_rng(2), 0.0, 0.0, 0.0
    rounds, each = 400, 2000
    for _ in range(rounds):
        values = random.standard_normal(number)
        records = [{"damping": ParameterSummary(value=float(v), std_error=0.1, unit="N s/m")} for v in values]
        means, differences = _means(records, ["damping"])
        told, own = means["damping"], differences["damping"]
        assert told.std_error is not None
        freedom = freedom_of(np.ones((1, 1, 1)), np.array([[told.std_error**2]]), *np.array(own)[:, None])
        away = np.abs(random.standard_normal(each) - told.value)
        beyond += share_beyond(away**2, told.std_error**2, freedom) / rounds
        inside += float(np.mean(away < norm.ppf(0.975) * told.std_error)) / rounds
        plain += share_beyond(away**2, float(np.var(values, ddof=1)), Freedom(1.0)) / rounds
    assert beyond == pytest.approx(RARE, abs=0.007)
    assert inside == pytest.approx(0.95, abs=0.02)
    assert plain > 0.05
