"""How series of the validation are taken: rigs, records, noise. What is scored and what one may tune on differ in all.

Series of a release are those of the usual practice. The tuning set has other lifts, slopes and motions of the drive,
another length of the records, other ranges of the base parameters and another step of the simulator, so that no series
of it can be one of a release.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from tests.independent.laws import DROP
from tests.independent.sensors import USUAL, Noise
from tests.independent.series import DRIVES, DROPS, Plan, drive_plan, drop_plan
from tests.independent.simulate import FINE_STEP, Base

NOISES = ("pink", "slow", "tails", "hum", "load", "coarse")
NOISES_OF_INTERVALS = (*NOISES, "filtered 200 Hz", "filtered 500 Hz")
SCATTERS = (0.0, 0.005, 0.01)
SCATTERS_OF_INTERVALS = (*SCATTERS, 0.02)


@dataclass(frozen=True)
class Design:
    """Conditions under which series are taken.

    Parameters
    ----------
    drops : lift in mm and slope in degrees of each record
    after : s for which a drop is logged from the release on
    drives : shape, rate in mm/s, amplitude in mm and whether mass is added, of each record
    seconds : length of a driven record
    stiffness, damping, friction : ranges of the base parameters; the first is drawn log-uniform
    step : of the simulator, s
    """

    drops: tuple[tuple[int, int], ...]
    after: float
    drives: tuple[tuple[str, int, int, bool], ...]
    seconds: float
    stiffness: tuple[float, float]
    damping: tuple[float, float]
    friction: tuple[float, float]
    step: float

    def plans(self, rig: str, rng: np.random.Generator) -> list[Plan]:
        """Records of a series before they are taken."""
        if rig == DROP:
            return [drop_plan(*row, rng, self.after) for row in self.drops]
        return [drive_plan(*row, rng, self.seconds) for row in self.drives]

    def base(self, rng: np.random.Generator) -> Base:
        """A fibre and a guide."""
        low, high = np.log(self.stiffness)
        return Base(math.exp(rng.uniform(low, high)), rng.uniform(*self.damping), rng.uniform(*self.friction))


USUAL_DESIGN = Design(DROPS, 1.6, DRIVES, 3.2, (8e3, 4e4), (8.0, 50.0), (1.5, 6.0), FINE_STEP)
TUNING_DESIGN = Design(
    drops=((6, 90), (12, 90), (18, 90), (12, 55), (18, 55)),
    after=1.4,
    drives=(
        ("trapezoid", 80, 50, False),
        ("trapezoid", 250, 70, True),
        ("trapezoid", 400, 55, False),
        ("quasi_sine", 200, 40, True),
        ("rectangle", 700, 25, True),
    ),
    seconds=2.9,
    stiffness=(1.2e4, 6e4),
    damping=(5.0, 35.0),
    friction=(2.5, 9.0),
    step=8e-6,
)


def noise_of(kind: str, rng: np.random.Generator) -> Noise:
    """Noise of one of the kinds, with its own figures.

    Parameters
    ----------
    kind : "pink" (half of the amplitude), "slow" (first order with a corner at 8 Hz, part of the power), "tails"
        (Student's t of four degrees of freedom), "hum" (lines at 50.1 and 150.3 Hz, as large as the noise), "load"
        (grows with the force), "coarse" (steps of 1 N and 0.05 mm with little noise; that of the drive's reading in
        every other series), "filtered" (behind a filter of second order at 200 or 500 Hz)
    rng : draws what a kind leaves open
    """
    plain = replace(USUAL, pink=0.0)
    if kind == "pink":
        return USUAL
    if kind == "slow":
        return replace(plain, slow=math.sqrt(rng.uniform(0.3, 0.7)), corner=8.0)
    if kind == "tails":
        return replace(plain, freedom=4.0)
    if kind == "hum":
        return replace(plain, hum=dict.fromkeys(USUAL.hum, 0.0), lines=_lines(rng))
    if kind == "load":
        return replace(plain, pink=float(rng.choice([0.0, 0.5])), growth=rng.uniform(0.5, 2.0))
    if kind == "coarse":
        drive = {"drive": 5e-5} if rng.random() < 0.5 else {"drive": USUAL.resolution["drive"]}
        return replace(
            plain,
            rms={"force": 0.2, "position": 1e-5, "drive": 1e-5},
            hum=dict.fromkeys(USUAL.hum, 0.0),
            resolution={"force": 1.0, "position": 5e-5, **drive},
        )
    if kind.startswith("filtered"):
        return replace(plain, band=float(kind.split()[1]))
    raise ValueError(f"no noise {kind!r}; there are {', '.join(NOISES_OF_INTERVALS)}")


def _lines(rng: np.random.Generator) -> Mapping[str, tuple[tuple[float, float], ...]]:
    sizes = rng.uniform(0.5, 1.5, (3, 2)) * (1.0, 0.5)
    return {
        channel: tuple((frequency, float(size) * rms) for frequency, size in zip((50.1, 150.3), row, strict=True))
        for (channel, rms), row in zip(USUAL.rms.items(), sizes, strict=True)
    }
