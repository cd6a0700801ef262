"""From true readings to a logger's: gauge dynamics on the fine grid, then noise, hum and resolution."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import butter, lfilter, lfilter_zi, sosfilt

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
    if curved := effects.get("open.curved_gauge"):
        reading = reading + curved["curvature"] * reading * np.abs(reading)
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
    slow : share of the amplitude that has a memory of first order
    corner : of the slow part, Hz
    freedom : of Student's t, by which the white part is drawn; infinite for a normal one
    lines : of each channel, frequency in Hz and amplitude, beside `hum`
    growth : share by which noise of the force is larger where the force is largest than where there is none
    band : frequency in Hz of a filter of second order (Butterworth) behind which the white part is; infinite for none
    """

    rms: Mapping[str, float]
    pink: float
    hum: Mapping[str, float]
    resolution: Mapping[str, float]
    slow: float = 0.0
    corner: float = 8.0
    freedom: float = math.inf
    lines: Mapping[str, tuple[tuple[float, float], ...]] = field(default_factory=dict)
    growth: float = 0.0
    band: float = math.inf

    def all_lines(self, channel: str) -> tuple[tuple[float, float], ...]:
        """Frequency and amplitude of every line of a channel, that of the mains among them."""
        return ((50.0, self.hum[channel]), *self.lines.get(channel, ()))

    def scale(self, channel: str, force: np.ndarray) -> np.ndarray:
        """Amplitude of the noise of a channel over that at rest, sample by sample, for the true force."""
        if channel != "force" or self.growth == 0.0:
            return np.ones(force.size)
        return 1.0 + self.growth * np.abs(force) / np.abs(force).max()


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


def slow_noise(n: int, pace: float, rng: np.random.Generator) -> np.ndarray:
    """Noise of first order, of variance one, whose correlation falls by `pace` nepers a sample."""
    kept = math.exp(-pace)
    deviates = math.sqrt(1.0 - kept**2) * rng.standard_normal(n)
    return lfilter([1.0], [1.0, -kept], deviates, zi=[kept * rng.standard_normal()])[0]


def white_noise(n: int, freedom: float, rng: np.random.Generator) -> np.ndarray:
    """Noise without memory, of variance one: normal, or of Student's t."""
    if math.isinf(freedom):
        return rng.standard_normal(n)
    return math.sqrt((freedom - 2.0) / freedom) * rng.standard_t(freedom, n)


def filtered_noise(n: int, share: float, freedom: float, rng: np.random.Generator) -> np.ndarray:
    """White noise behind a filter of second order at a `share` of the sampling rate, of variance one."""
    settled = math.ceil(10.0 / share)
    passed = sosfilt(butter(2, share, fs=1.0, output="sos"), white_noise(settled + n, freedom, rng))[settled:]
    impulse = sosfilt(butter(2, share, fs=1.0, output="sos"), np.eye(1, settled)[0])
    return passed / math.sqrt(np.sum(impulse**2))


def logged(
    channel: str,
    values: np.ndarray,
    times: np.ndarray,
    noise: Noise,
    rng: np.random.Generator,
    force: np.ndarray | None = None,
) -> np.ndarray:
    """The values as a logger would write them; `force` is what noise that grows with the load grows with."""
    n, rate = values.size, 1.0 / (times[1] - times[0])
    filtered = math.isfinite(noise.band)
    fresh = filtered_noise(n, noise.band / rate, noise.freedom, rng) if filtered else white_noise(n, noise.freedom, rng)
    coloured = math.sqrt(1.0 - noise.pink**2 - noise.slow**2) * fresh
    lines = sum(
        amplitude * np.sin(2.0 * math.pi * (frequency * times + rng.random()))
        for frequency, amplitude in noise.all_lines(channel)
    )
    coloured = coloured + noise.pink * pink_noise(n, rng)
    if noise.slow:
        coloured = coloured + noise.slow * slow_noise(n, 2.0 * math.pi * noise.corner / rate, rng)
    size = noise.rms[channel] * (1.0 if force is None else noise.scale(channel, force))
    noisy = values + size * coloured + lines
    grain = noise.resolution[channel]
    return grain * np.round(noisy / grain) if grain > 0.0 else noisy
