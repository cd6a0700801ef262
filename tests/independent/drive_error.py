"""What an error of the measured drive does to the readings a model foretells, to first order.

The true motion of the drive is smooth: what its reading has above `HIGHEST` is known to be noise. Below, errors are a
sum of cosines over the record. Their effect is that of the linearised rig along its true motion: the fibre pulls or is
slack, the weight slides or sticks as in the undisturbed run; a fibre that becomes taut earlier or later gives the
impulse of its damper, and a reversal under friction changes the disturbance of the velocity by the ratio of the
accelerations.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise

import numpy as np

from tests.independent.kernel import compiled
from tests.independent.sensors import Noise
from tests.independent.simulate import Base, Conditions, driven_steps, laws_for
from tests.independent.whitening import covariance

HIGHEST = 60.0
"""Hz."""
STEP = 1e-4
TURNING = 3
"""Steps."""
STEADY = 10.0
"""Largest change of a disturbance of the velocity at a reversal."""


def responses(
    conditions: Conditions, base: Base, times: np.ndarray, noise: Noise
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Force and position ``(n, m)`` for errors of the drive, per metre, and the precision ``(m, m)`` of their sizes.

    Parameters
    ----------
    conditions : of a record of the driven rig
    base : base parameters
    times : of the samples
    noise : of the logger; lines in the error of the drive are given ten times their amplitude, since it is not known
    """
    n, rate = times.size, 1.0 / (times[1] - times[0])
    count = int(2.0 * HIGHEST * n / rate) + 1
    turns = math.pi * np.arange(count) * rate / n
    lines = [(frequency, 10.0 * size) for frequency, size in noise.all_lines("drive") if size and frequency < HIGHEST]
    force, position = disturbed(
        conditions,
        base,
        times,
        np.concatenate([turns, *([2.0 * math.pi * frequency] * 2 for frequency, _ in lines)]),
        np.concatenate([0.5 * turns / rate, *([0.0, -0.5 * math.pi] for _ in lines)]),
    )
    precision = np.zeros((force.shape[1],) * 2)
    precision[:count, :count] = _precision(covariance(noise, "drive", n, rate).tobytes(), count)
    tail = np.arange(count, len(precision))
    precision[tail, tail] = np.repeat([size**-2 for _, size in lines], 2)
    return force, position, precision


@lru_cache(maxsize=16)
def _precision(lags: bytes, count: int) -> np.ndarray:
    """Inverse of the covariance ``(count, count)`` of the first cosines in noise with this covariance."""
    known = np.frombuffer(lags)
    n = known.size
    cosines = np.cos(math.pi / n * (np.arange(n)[:, None] + 0.5) * np.arange(count))
    lengths = np.linalg.norm(cosines, axis=0)
    cosines /= lengths
    return lengths[:, None] * np.linalg.inv(cosines.T @ _spread(known, cosines)) * lengths


def _spread(lags: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Product of the covariance matrix with these lags and the columns."""
    n = lags.size
    circle = np.concatenate([lags, [0.0], lags[:0:-1]])
    return np.fft.irfft(np.fft.rfft(circle)[:, None] * np.fft.rfft(columns, 2 * n, axis=0), 2 * n, axis=0)[:n]


def disturbed(
    conditions: Conditions, base: Base, times: np.ndarray, turns: np.ndarray, phases: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Change of force and position per metre of an error ``cos(turn t + phase)`` of the drive, ``(n, m)`` each.

    An error that is there from the start shifts the weight with it: its position is read from its own zero.
    """
    laws = laws_for(conditions, base, {})
    steps = math.ceil(times[-1] / STEP) + 1
    force, position, _ = driven_steps(replace(conditions, zeroed=False), laws, {}, steps, STEP)
    slides, factors = _switches(np.diff(position, append=position[-1]))
    every = round((times[1] - times[0]) / STEP)
    forces, positions = _disturbed(force > 0.0, slides, factors, turns, phases, laws, STEP, every, times.size)
    return forces.T, positions.T


def _switches(travels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whether the weight slides in each step, and the factor a disturbance of its velocity gets there.

    A weight that turns without a stay is at rest for a step or two.
    """
    slides, factors = travels != 0.0, np.ones(travels.size)
    moving = np.flatnonzero(slides)
    for last, first in pairwise(moving):
        if travels[last] * travels[first] < 0.0 and first - last <= TURNING and first + 2 < travels.size and last > 1:
            slides[last:first] = True
            before, after = travels[last - 1] - travels[last - 2], travels[first + 2] - travels[first + 1]
            factors[first] = min(max(after / before, 0.0), STEADY) if before else 1.0
    return slides, factors


@compiled
def _disturbed(taut, slides, factors, turns, phases, p, step, every, n):
    forces, positions = np.zeros((turns.size, n)), np.zeros((turns.size, n))
    pace = 2.0 * p.mass / step
    stiff = pace + 0.5 * step * p.stiffness + p.damping
    for j in range(turns.size):
        place, velocity = math.cos(phases[j]), 0.0
        error, other = math.cos(phases[j]), math.sin(phases[j])
        cosine, sine = math.cos(turns[j] * step), math.sin(turns[j] * step)
        for i in range(taut.size):
            if i > 0:
                error, other = error * cosine - other * sine, other * cosine + error * sine
            rate = -turns[j] * other
            if i > 1 and taut[i] and not taut[i - 1]:
                velocity += p.damping / p.mass * (error - place)
            velocity *= factors[i]
            middle = 0.0
            if slides[i]:
                if taut[i]:
                    middle = (pace * velocity + p.stiffness * (error - place) + p.damping * rate) / stiff
                else:
                    middle = velocity
            velocity = 2.0 * middle - velocity if slides[i] else 0.0
            half = place + 0.5 * step * middle
            if i % every == 0 and i // every < n:
                positions[j, i // every] = half
                if taut[i]:
                    forces[j, i // every] = p.stiffness * (error - half) + p.damping * (rate - middle)
            place += step * middle
    return forces, positions
