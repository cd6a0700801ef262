"""Error bars where the model lacks something: two records of one axis agree within them; noise is left alone."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fibrefit.core.declarations import FORWARDS, HELD
from fibrefit.fitting.error_bars import METHOD, _cells, _without_parts, estimates, with_discrepancy
from fibrefit.fitting.thresholds import STATE_CELLS
from fibrefit.fitting.uncertainty import MEMORY, ErrorBars, Scores, sandwich, white
from fibrefit.fitting.values import most_doubtful
from fibrefit.problem.diagnose.motion import Motion
from fibrefit.problem.statement.layout import Range

SAMPLES = 4800
TRUTH = 2.0


def swept(amplitude: float, lacking: float, seed: int) -> tuple[float, Scores, Motion]:
    """A force over the speed of a swing; what the model ``c v`` lacks goes with the cube of the speed."""
    random = np.random.default_rng(seed)
    speed = amplitude * np.sin(np.linspace(0.0, 24.0 * np.pi, SAMPLES))
    force = TRUTH * speed + lacking * speed**3 + 0.05 * random.standard_normal(SAMPLES)
    found = float(force @ speed / (speed @ speed))
    left = (found * speed - force)[None, None]
    scores = Scores(left, speed[None, None, :, None], np.array([SAMPLES]), np.array([[0]]), 1)
    phase = np.full((1, SAMPLES), FORWARDS)
    motion = Motion(phase, {"speed": speed[None]}, np.zeros(1, dtype=bool), {})
    return found, scores, motion


def error(scores: Scores, motion: Motion) -> tuple[float, float]:
    """Standard error for noise without memory, and with what the model lacks."""
    normal = scores.normal_matrix()
    bars = ErrorBars({"white": sandwich(normal, white(scores))}, "white")
    wider = with_discrepancy(bars, scores, motion)
    assert wider.method == METHOD
    return tuple(float(errors[0]) for errors in (bars.errors["white"], wider.errors[METHOD]))  # type: ignore[return-value]


def test_two_records_of_one_axis_agree_within_their_error_bars() -> None:
    (one, *first), (other, *second) = swept(1.0, 0.3, 1), swept(1.2, 0.3, 2)
    plain, wide = zip(error(*first), error(*second), strict=True)
    assert abs(one - other) > 20.0 * np.hypot(*plain)
    assert abs(one - other) < 4.0 * np.hypot(*wide)


def test_of_noise_alone_it_is_no_wider_than_chance_makes_it() -> None:
    ratios = [wide / plain for plain, wide in (error(*swept(1.0, 0.0, seed)[1:]) for seed in range(20))]
    # The variance over so few cells is that of chi-square with one less than their number of degrees.
    assert np.mean(ratios) < 1.3
    assert min(ratios) >= 1.0


@pytest.mark.parametrize("held", [0, SAMPLES // 3])
def test_cells_are_visited_equally_often(held: int) -> None:
    _, scores, motion = swept(1.0, 0.0, 0)
    motion.phase[:, :held] = HELD
    cells = _cells(motion.states["speed"], motion, scores.counts)
    assert (cells[:, :held] == -1).all()
    number = np.bincount(cells[cells >= 0], minlength=STATE_CELLS)
    assert number.max() < 1.1 * number.min()


def decaying(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Two columns of a swing that dies out, and what was measured of it: the model lacks a cube of the speed."""
    random = np.random.default_rng(seed)
    time = np.linspace(0.0, 1.0, SAMPLES)
    speed = np.exp(-2.0 * time) * np.sin(150.0 * time)
    columns = np.column_stack([speed, np.sign(speed)])
    return columns, columns @ [TRUTH, 0.5] + 0.3 * speed**3 + 0.01 * random.standard_normal(SAMPLES)


def scores_of(columns: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, Scores]:
    found = np.linalg.lstsq(columns, force, rcond=None)[0]
    count, size = columns.shape
    return found, Scores(
        (columns @ found - force)[None, None], columns[None, None], np.array([count]), np.arange(size)[None], size
    )


def test_parts_left_out_are_fits_without_them() -> None:
    columns, force = decaying(3)
    found, scores = scores_of(columns, force)
    moved = []
    for part in np.array_split(np.arange(SAMPLES), round(1.0 / MEMORY)):
        rest = np.setdiff1d(np.arange(SAMPLES), part)
        moved.append(scores_of(columns[rest], force[rest])[0] - found)
    expected = (round(1.0 / MEMORY) - 1) / round(1.0 / MEMORY) * np.einsum("ri,rj->ij", moved, moved)
    np.testing.assert_allclose(_without_parts(scores), expected, rtol=1e-6)


def test_a_value_that_a_swing_asks_for_differently_as_it_dies_out_is_no_surer_than_that() -> None:
    """What a fit to nearly all of a record finds lies within the bars of a fit to all of it."""
    columns, force = decaying(4)
    found, scores = scores_of(columns, force)
    speed = columns[:, 0]
    motion = Motion(np.full((1, SAMPLES), FORWARDS), {"speed": speed[None]}, np.zeros(1, dtype=bool), {})
    bars = ErrorBars({"white": sandwich(scores.normal_matrix(), white(scores))}, "white")
    wide = with_discrepancy(bars, scores, motion).errors[METHOD]
    later, _ = scores_of(columns[SAMPLES // 6 :], force[SAMPLES // 6 :])
    assert np.all(np.abs(later - found) > 8.0 * bars.errors["white"])
    assert np.all(np.abs(later - found) < 2.0 * wide)


@pytest.mark.filterwarnings("error")
def test_parts_that_tell_nothing_are_no_fault() -> None:
    columns, force = decaying(1)
    _, scores = scores_of(columns, force)
    assert not _without_parts(replace(scores, slopes=0.0 * scores.slopes)).any()


def test_the_value_that_its_error_bar_reaches_furthest_round_is_the_doubtful_one() -> None:
    """Of values that cannot change their sign and that all records share, where the model lacks something."""
    positive, either = Range(0.0, 1e9, 10.0), Range(-1e9, 1e9, 1.0)
    kinds = (("stiffness", positive, None), ("friction", positive, None), ("position_zero", either, 0))
    layout = SimpleNamespace(
        entries=tuple((SimpleNamespace(name=name, unit="-", range=limits), record) for name, limits, record in kinds)
    )
    values, covariance = np.array([2e4, 4.0, 1e-4]), np.diag([2e3, 1.0, 1.0]) ** 2
    assert most_doubtful(layout, values, ErrorBars({"white": covariance}, "white")) is None  # type: ignore[arg-type]
    bars = ErrorBars({"white": 1e-2 * covariance, METHOD: covariance}, METHOD, "white")
    found = most_doubtful(layout, values, bars)  # type: ignore[arg-type]
    assert found is not None
    assert (found.name, found.value, found.error) == ("friction", 4.0, 1.0)
    assert found.share == pytest.approx(1.96 / 4.0, rel=1e-3)
    # What noise alone leaves open is told as not determined.
    vague = ErrorBars({"white": 9.0 * covariance, METHOD: 16.0 * covariance}, METHOD, "white")
    found = most_doubtful(layout, values, vague)  # type: ignore[arg-type]
    assert found is not None
    assert found.name == "stiffness"


def test_what_the_model_lacks_brings_no_value_to_a_limit() -> None:
    """A value in the middle of its range is told as not determined, however wide its bars become."""
    slot = SimpleNamespace(name="friction", unit="N", range=Range(0.0, 1000.0, 10.0), belief=None)
    problem = SimpleNamespace(layout=SimpleNamespace(entries=((slot, None),), slots=(), records=(), beliefs=()))
    narrow, wide = np.array([[400.0]]), np.array([[1e10]])
    told = {
        value: estimates(problem, np.array([value]), ErrorBars({"white": narrow, METHOD: wide}, METHOD, "white"))[
            0
        ].found  # type: ignore[arg-type]
        for value in (690.0, 999.0)
    }
    assert not told[690.0].at_bound
    assert told[690.0].interval_95 == (0.0, 1000.0)
    assert told[999.0].at_bound
