"""Corners of a motion: where they are, how large, and that neither noise nor a smooth motion has any."""

from __future__ import annotations

import numpy as np
import pytest

from fibrefit.problem.inputs import smoothing
from fibrefit.problem.inputs.smoothing import corner_motion

STEP = 1.0 / 2000.0
TIMES = STEP * np.arange(2400)
INSTANTS = 0.3003 + np.array([0.0, 0.02, 0.025, 0.045, 0.4, 0.5])
JUMPS = np.array([40.0, -40.0, -40.0, 40.0, -12.0, 12.0])
"""A stroke of 20 mm at 800 mm/s, whose second and third corner are 5 ms apart, and a slow one."""


def motion(instants: np.ndarray = INSTANTS, jumps: np.ndarray = JUMPS) -> np.ndarray:
    """Value and slope of a motion of constant accelerations."""
    since = np.maximum(TIMES[:, None] - instants, 0.0)
    return np.stack([0.5 * since**2 @ jumps, since @ jumps], axis=-1)


def of_corners(values: np.ndarray, noise: float) -> np.ndarray:
    """What the corners of a reading make."""
    return corner_motion(values, TIMES, noise)


def by_windows(values: np.ndarray) -> np.ndarray:
    """Value and slope as windows alone have them."""
    weights = smoothing._weights(values, TIMES, smoothing._fast_noise(values), "made")
    reach = weights.shape[1] // 2
    around = np.lib.stride_tricks.sliding_window_view(np.pad(values, reach), weights.shape[1])
    return np.einsum("nti,nt->ni", weights, around)


def worst(found: np.ndarray) -> float:
    """Largest error of the slope in m/s, the ends of the record left out."""
    return float(np.abs(found - motion())[100:-100, 1].max())


def test_corners_of_an_exact_motion_are_where_they_are() -> None:
    found = of_corners(motion()[:, 0], 1e-9)
    np.testing.assert_allclose(found[:, 1], motion()[:, 1], atol=1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_a_noisy_motion_keeps_its_corners(seed: int) -> None:
    noise = 1e-5 * np.random.default_rng(seed).standard_normal(len(TIMES))
    values = motion()[:, 0] + noise
    corners = smoothing.smoothed(values, TIMES, "made")
    assert worst(corners) < 0.6 * worst(by_windows(values))
    assert worst(corners) < 0.015


def test_a_drive_read_in_steps_keeps_its_corners() -> None:
    random = np.random.default_rng(3)
    values = 5e-5 * np.round((motion()[:, 0] + 1e-5 * random.standard_normal(len(TIMES))) / 5e-5)
    assert worst(smoothing.smoothed(values, TIMES, "made")) < 0.8 * worst(by_windows(values))


@pytest.mark.parametrize("freedom", [None, 4.0])
def test_noise_alone_has_no_corner(freedom: float | None) -> None:
    random = np.random.default_rng(11)
    noise = random.standard_normal(len(TIMES)) if freedom is None else random.standard_t(freedom, len(TIMES))
    assert not np.any(of_corners(1e-5 * noise, 1e-5))


@pytest.mark.parametrize("frequency", [1.6, 5.0, 20.0, 50.0])
def test_a_smooth_motion_has_no_corner(frequency: float) -> None:
    """One that vibrates all the time has a filter that is large all the time, and no instant stands out."""
    random = np.random.default_rng(5)
    turn = 2.0 * np.pi * frequency
    values = 0.25 / turn * np.sin(turn * TIMES) + 1e-5 * random.standard_normal(len(TIMES))
    assert not np.any(of_corners(values, 1e-5))


def test_a_damaged_reading_makes_no_corner_and_takes_none_away() -> None:
    random = np.random.default_rng(2)
    values = motion()[:, 0] + 1e-5 * random.standard_normal(len(TIMES))
    values[[250, 615, 900]] = np.nan
    found = smoothing.smoothed(values, TIMES, "made")
    assert np.isfinite(found).all()
    assert worst(found) < 0.02


def test_a_record_too_short_for_corners_has_none() -> None:
    assert not np.any(of_corners(motion()[:200, 0], 1e-9))
