"""What fits would have left of records made by hand: noise of a known colour, bounces that slow down, and a gap."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from fibrefit.core.declarations import LOADING, SLACK, UNLOADING
from fibrefit.problem.diagnose.motion import Motion, ResidualSet
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.statement.observations import Observations
from fibrefit.simulation.model import Experiment

RATE, COUNT, RECORDS = 2000.0, 2000, 5
CHANNELS = ("force", "position")
SIGMA = 0.2
BOUNCE, TAUT = 200, 60
"""Samples from one take-up to the next, and of a contact, the first half of which is loading."""


def of_colour(pink: float, samples: int = 4000) -> Noise:
    """Noise with an rms of `SIGMA`, a share `pink` of whose power is pink."""
    duration, band = COUNT / RATE, 0.5 * RATE
    return Noise(
        (1.0 - pink) * SIGMA**2 / band, pink * SIGMA**2 / np.log(band * duration), 0.0, samples
    )  # fmt: skip


def bounces(records: int) -> Motion:
    """Ten contacts a record, whose speed at take-up falls from 1 m/s to 0.1 m/s."""
    sample = np.arange(COUNT)
    into = sample % BOUNCE - (BOUNCE - TAUT)
    phase = np.where(into < 0, SLACK, np.where(into < TAUT // 2, LOADING, UNLOADING))
    speed = (1.0 - 0.1 * (sample // BOUNCE)) * np.where(phase == UNLOADING, -1.0, 1.0)
    tile = lambda row: np.tile(row, (records, 1))  # noqa: E731
    states = {"position": tile(1e-3 * into), "speed": tile(speed), "stretch rate": tile(speed)}
    return Motion(tile(phase), states, np.zeros(records, dtype=bool), {}, tile(np.sign(speed)))


def noise_alone(seed: int, pink: float = 0.0, records: int = RECORDS, samples: int = 4000) -> ResidualSet:
    """Residuals of a perfect model."""
    random, noise = np.random.default_rng(seed), of_colour(pink, samples)
    times = np.tile(np.arange(COUNT) / RATE, (records, 1))
    data = Observations(
        Experiment(times, np.full(records, COUNT), {}, {}),  # type: ignore[arg-type]
        {channel: np.zeros(times.shape) for channel in CHANNELS},  # type: ignore[misc]
        {channel: np.full(times.shape, 1.0 / SIGMA) for channel in CHANNELS},  # type: ignore[misc]
    )
    rig = SimpleNamespace(channels=CHANNELS, directions=("down", "up"))
    problem: Any = SimpleNamespace(
        observations=data,
        layout=SimpleNamespace(records=tuple(f"{r}.csv" for r in range(records))),
        model=SimpleNamespace(rig=rig),
    )
    residuals = np.array([[noise.draw(COUNT, RATE, random) / SIGMA for _ in CHANNELS] for _ in range(records)])
    return ResidualSet(problem, residuals, bounces(records), dict.fromkeys(CHANNELS, noise))


def with_gap(left: ResidualSet, by: np.ndarray, channel: int = 0) -> ResidualSet:
    """The same with a gap of one channel, in units of the noise; one for all records or for each."""
    residuals = left.residuals.copy()
    residuals[:, channel] += by
    return replace(left, residuals=residuals)
