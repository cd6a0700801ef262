"""Records of a prismatic axis in closed loop, made by a fine integration that shares nothing with the program."""

from __future__ import annotations

from pathlib import Path

import numpy as np

TRUTH = {"mass": 60.0, "viscous": 150.0, "friction": 18.0, "offset": -2.0}
STUDY = """\
schema = "fibrefit/study/1"
name = "axis"

[rig]
kind = "guided_mass"
{window}
[model]
effects = [{effects}]

[[records]]
file = "axis.csv"
"""
FINE = 10
"""Steps of the integration between two samples."""


def record(
    seconds: float = 6.0,
    rate: float = 500.0,
    seed: int = 0,
    asymmetry: float = 0.0,
    ripple: float = 1.5,
    slant: float = 0.0,
) -> np.ndarray:
    """Time, force and position ``(n_time, 3)`` of an axis that a controller moves to and fro.

    Coulomb friction is larger by a share `asymmetry` forwards than on the mean, viscous friction by a share `slant`.
    The force that is logged differs from the one that acts by a slow, random ripple of `ripple` [N] rms.
    """
    random = np.random.default_rng(seed)
    count, step, shares = round(seconds * rate) + 1, 1.0 / (rate * FINE), (asymmetry, slant)
    error = _ripple(count, rate, random) * ripple
    u = v = 0.0
    rows = np.empty((count, 3))
    for i in range(count):
        for j in range(FINE):
            time = i / rate + j * step
            force = _driven(time, u, v)
            if j == 0:
                rows[i] = i / rate, force + error[i], u
            u, v = _advance(time, u, v, step, shares)
    rows[:, 2] += random.normal(0.0, 1e-6, count)
    return rows


def write(folder: Path, effects: tuple[str, ...], window: str = "", **made: float) -> Path:
    """Study and record in a folder; the study's path."""
    rows = record(**made)  # type: ignore[arg-type]
    np.savetxt(
        folder / "axis.csv", rows, delimiter=",", header="time [s],force [N],position [m]", comments="", fmt="%.9g"
    )
    names = ", ".join(f'"{effect}"' for effect in effects)
    text = STUDY.format(effects=names, window=f'window = "{window}"\n' if window else "")
    (folder / "study.toml").write_text(text, encoding="utf-8")
    return folder / "study.toml"


def _goal(time: float) -> tuple[float, float]:
    """Where the axis is to be: two swings of different speed, and rests between them."""
    fast, slow = 2.0 * np.pi * 0.8, 2.0 * np.pi * 0.29
    position = 0.03 * (1.0 - np.cos(fast * time)) + 0.05 * (1.0 - np.cos(slow * time))
    return position, 0.03 * fast * np.sin(fast * time) + 0.05 * slow * np.sin(slow * time)


def _driven(time: float, u: float, v: float) -> float:
    """Force of the controller."""
    goal, goal_rate = _goal(time)
    return float(4e4 * (goal - u) + 1.5e3 * (goal_rate - v))


def _net(force: float, v: float, shares: tuple[float, float]) -> float:
    """Force that is left when friction is taken off; zero where it sticks."""
    net = force - TRUTH["offset"]
    level = TRUTH["friction"] * (1.0 + shares[0] * np.sign(v if v else net))
    if v == 0.0 and abs(net) <= level:
        return 0.0
    direction = np.sign(v) if v else np.sign(net)
    return float(net - direction * level - TRUTH["viscous"] * (1.0 + shares[1] * np.sign(v)) * v)


def _advance(time: float, u: float, v: float, step: float, shares: tuple[float, float]) -> tuple[float, float]:
    """By midpoints, and to the instant of a standstill: a search sees errors of Euler's steps beside a micrometre."""
    net = _net(_driven(time, u, v), v, shares) / TRUTH["mass"]
    if v == 0.0 and net == 0.0:
        return u, v
    half = v + 0.5 * step * net
    middle = u + 0.25 * step * (v + half)
    net = _net(_driven(time + 0.5 * step, middle, half), half, shares) / TRUTH["mass"] if v * half >= 0.0 else net
    after = v + step * net
    if v and after * v < 0.0:
        until = step * v / (v - after)
        return _advance(time + until, u + 0.5 * v * until, 0.0, step - until, shares)
    return u + 0.5 * step * (v + after), after


def _ripple(count: int, rate: float, random: np.random.Generator) -> np.ndarray:
    """Noise below 5 Hz, rms 1."""
    spectrum = random.normal(size=count // 2 + 1) + 1j * random.normal(size=count // 2 + 1)
    frequency = np.fft.rfftfreq(count, 1.0 / rate)
    spectrum[(frequency > 5.0) | (frequency < 0.2)] = 0.0
    wave = np.fft.irfft(spectrum, count)
    return wave / wave.std()
