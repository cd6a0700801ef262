"""Noise of known spectra, and records that hold nothing else."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np

from fibrefit.problem.statement.observations import Observations
from fibrefit.simulation.model import Experiment
from tests.sampling.drops import pink

RATE, RECORDS, COUNT = 2000.0, 5, 2000
UNIT = 0.2
"""SI units in one unit of the residuals."""
CORNER = 8.0
TONES = (50.1, 150.3)
STRANGE = 83.7
"""Frequency of a line that is no mains frequency, in Hz."""


def records(valid: np.ndarray, counts: np.ndarray | None = None, channels: tuple[str, ...] = ("force",)) -> Any:
    """What is asked of a problem: instants, and weights ``(n_record, n_time)`` that are zero where not valid."""
    number, size = valid.shape
    times = np.tile(np.arange(size) / RATE, (number, 1))
    weight = {channel: np.where(valid, 1.0 / UNIT, 0.0) for channel in channels}
    experiment = Experiment(times, np.full(number, size) if counts is None else counts, {}, {})  # type: ignore[arg-type]
    data = Observations(experiment, dict.fromkeys(channels, np.zeros(times.shape)), weight)  # type: ignore[arg-type]
    return SimpleNamespace(observations=data, model=SimpleNamespace(rig=SimpleNamespace(channels=channels)))


def white(random: np.random.Generator) -> np.ndarray:
    """Of variance one."""
    return random.standard_normal((RECORDS, COUNT))


def pink_noise(random: np.random.Generator) -> np.ndarray:
    """1/f of variance one, and some white noise."""
    return np.array([pink(random, COUNT) for _ in range(RECORDS)]) + 0.3 * white(random)


def first_order_noise(random: np.random.Generator) -> np.ndarray:
    """A first-order part of variance one, and some white noise."""
    found = first_order(random, CORNER)
    return found + 0.5 * white(random)


def first_order(random: np.random.Generator, corner: float) -> np.ndarray:
    """A first-order part of variance one."""
    decay = np.exp(-2.0 * np.pi * corner / RATE)
    fresh, found = white(random), np.zeros((RECORDS, COUNT))
    found[:, 0] = fresh[:, 0]
    for t in range(1, COUNT):
        found[:, t] = decay * found[:, t - 1] + np.sqrt(1.0 - decay**2) * fresh[:, t]
    return found


def tone(random: np.random.Generator, frequency: float) -> np.ndarray:
    """A line of variance one, with a phase of its own in each record."""
    turns = frequency * np.arange(COUNT) / RATE + random.random((RECORDS, 1))
    return np.asarray(np.sqrt(2.0) * np.sin(2.0 * np.pi * turns))


def two_lines(random: np.random.Generator) -> np.ndarray:
    """Two lines on white noise."""
    return 0.5 * tone(random, TONES[0]) + 0.3 * tone(random, TONES[1]) + white(random)


def line_on_pink(random: np.random.Generator) -> np.ndarray:
    """A line on pink noise."""
    return pink_noise(random) + 0.5 * tone(random, STRANGE)


KINDS: dict[str, Callable[[np.random.Generator], np.ndarray]] = {
    "white": white,
    "1/f": pink_noise,
    "first order": first_order_noise,
    "two lines": two_lines,
    "a line on 1/f": line_on_pink,
}


def masked(random: np.random.Generator) -> np.ndarray:
    """A gap in all records, and single samples lost."""
    valid = random.random((RECORDS, COUNT)) > 0.05
    valid[:, 300:380] = False
    return valid
