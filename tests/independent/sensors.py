"""From true readings to a logger's: gauge dynamics on the fine grid, then noise, hum and resolution."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter, lfilter_zi

Effects = Mapping[str, Mapping[str, float]]


def sense(
    effects: Effects, forces: np.ndarray, middles: np.ndarray, times: np.ndarray, step: float, rest: float
) -> np.ndarray:
    """What the force gauge reads at `times`; before the first of `middles` it has long felt `rest`."""
    if gauge := effects.get("sensor.gauge_resonance"):
        forces = _resonant(forces, step, gauge["natural_frequency"], gauge["damping_ratio"], rest)
    if lag := effects.get("sensor.force_lag"):
        forces = _lagging(forces, step, lag["time_constant"], rest)
    late = effects.get("sensor.force_delay", {}).get("delay", 0.0)
    reading = np.interp(times - late, middles, forces, left=rest)
    reading = effects.get("sensor.force_gain", {}).get("gain", 1.0) * reading
    reading = reading + effects.get("sensor.force_offset", {}).get("offset", 0.0)
    return reading + effects.get("sensor.force_drift", {}).get("drift", 0.0) * times


def _filtered(numerator: list[float], denominator: list[float], signal: np.ndarray, rest: float) -> np.ndarray:
    state = lfilter_zi(numerator, denominator) * rest
    return lfilter(numerator, denominator, signal, zi=state)[0]


def _resonant(forces: np.ndarray, step: float, frequency: float, damping: float, rest: float) -> np.ndarray:
    turn = 2.0 * math.pi * frequency * step / 2.0
    if turn > 0.5:
        return forces
    scale = 1.0 + 2.0 * damping * turn + turn**2
    numerator = [turn**2 / scale, 2.0 * turn**2 / scale, turn**2 / scale]
    denominator = [1.0, (2.0 * turn**2 - 2.0) / scale, (1.0 - 2.0 * damping * turn + turn**2) / scale]
    return _filtered(numerator, denominator, forces, rest)


def _lagging(forces: np.ndarray, step: float, constant: float, rest: float) -> np.ndarray:
    if constant <= 0.0:
        return forces
    pace = step / (2.0 * constant)
    return _filtered([pace / (1.0 + pace)] * 2, [1.0, (pace - 1.0) / (1.0 + pace)], forces, rest)


@dataclass(frozen=True)
class Noise:
    """The imperfections of a logger, SI.

    Parameters
    ----------
    rms : of each channel
    pink : share of the amplitude that is pink; the rest of the power is white
    hum : amplitude of 50 Hz
    resolution : of each channel
    """

    rms: Mapping[str, float]
    pink: float
    hum: Mapping[str, float]
    resolution: Mapping[str, float]


USUAL = Noise(
    rms={"force": 0.4, "position": 2e-5, "drive": 1e-5},
    pink=0.5,
    hum={"force": 0.06, "position": 1.3e-6, "drive": 1e-6},
    resolution={"force": 0.02, "position": 5e-6, "drive": 5e-6},
)


def pink_noise(n: int, rng: np.random.Generator) -> np.ndarray:
    """Noise with a power that falls as 1/f, of variance one.

    Made twice as long as needed and cut, so that its ends do not meet.
    """
    frequencies = np.fft.rfftfreq(2 * n)[1:]
    power = 1.0 / frequencies
    power /= power.sum()
    deviates = rng.standard_normal((2, power.size))
    spectrum = np.concatenate([[0.0], np.sqrt(power / 2.0) * (deviates[0] + 1j * deviates[1])])
    return np.fft.irfft(spectrum * 2 * n / math.sqrt(2.0), 2 * n)[:n]


def logged(channel: str, values: np.ndarray, times: np.ndarray, noise: Noise, rng: np.random.Generator) -> np.ndarray:
    """The values as a logger would write them."""
    size = noise.rms[channel]
    white = math.sqrt(1.0 - noise.pink**2) * rng.standard_normal(values.size)
    hum = noise.hum[channel] * np.sin(2.0 * math.pi * (50.0 * times + rng.random()))
    noisy = values + size * (white + noise.pink * pink_noise(values.size, rng)) + hum
    grain = noise.resolution[channel]
    return grain * np.round(noisy / grain) if grain > 0.0 else noisy
