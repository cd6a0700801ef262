"""Every threshold of the readers decides: with twice or half of it a verdict here would be another."""

from __future__ import annotations

import numpy as np
import pytest

from fibrefit.records import thresholds
from fibrefit.records.columns import damage
from fibrefit.records.columns.damage import absurd, flat_stretches, lone_outliers
from tests.brackets import Bracket
from tests.brackets import thresholds as names_in

#: Amplitude of a reading that goes to and fro, as its distance from the mean of its neighbours: what outliers are
#: measured by.
SCATTER = 1.4826


def believed(usual: float, last: float) -> bool:
    """Whether the last of a column of like numbers counts as measured."""
    return not absurd(np.array([usual] * 9 + [last])).any()


def by_chance(length: float, *, kept: float, before: tuple[int, ...] = (), after: int = 0) -> bool:
    """Whether a run of equal readings may come by chance, with runs before it, and runs of one after it."""
    lengths = np.array([*before, int(length), *[1] * after])
    return length <= damage._longest_by_chance(lengths, len(before), kept)


def in_steps(period: float) -> bool:
    """Whether readings that leave their step once in a period are noise: 0.54 of it for three samples, 0.43 for five."""
    run = np.tile([0.0] * (int(period) - 1) + [1.0], 200)
    return damage._is_noisy(run, np.ones(run.size, int))


def turning(share: float) -> bool:
    """Whether readings are noise of whose second differences such a share has another sign than the one before."""
    correlation = np.sin(np.pi * (0.5 - share))
    weight = (1.0 - np.sqrt(1.0 - 4.0 * correlation**2)) / (2.0 * correlation) if abs(correlation) > 1e-9 else 0.0
    white = np.random.default_rng(5).normal(size=4001)
    return damage._is_noisy(np.cumsum(np.cumsum(white[1:] + weight * white[:-1])), np.ones(4000, int))


def repeated(share: float) -> bool:
    """Whether readings are noise of which such a share equals the one before."""
    runs = np.full(200, round(1.0 / (1.0 - share)))
    return damage._is_noisy(np.random.default_rng(5).normal(size=1000), runs)


def calm(share: float) -> bool:
    """Whether the noise is told by what is no impact, with such a share of the third differences in impacts."""
    run = np.tile([0.0, 1.0], 5000)
    run[2 :: round(4.0 / share)] += 1e3
    return damage._noise(run) < 10.0


def rest(length: float) -> bool:
    """Whether a stop of so many samples inside a record of ten thousand is a peak that was cut off."""
    return damage._is_short((500, int(length)), 10_000)


def stops(level: float, slope: float, resolution: float) -> bool:
    """Whether a reading that falls evenly is told to stop dead at a level."""
    falling = level + slope * np.arange(40)[::-1]
    return flat_stretches(np.append(falling, [level] * 12), resolution).stops_dead.any()


def lone(distance: float) -> bool:
    """Whether a sample this many times further from its neighbours than they scatter is reported."""
    run = np.tile([0.5, -0.5], 50)
    run[50] = -0.5 + distance * SCATTER
    return lone_outliers(run).size > 0


DAMAGE = (
    Bracket("ABSURD", damage, lambda x: believed(1.0, x), 0.7e9, 1.3e9),
    Bracket("ABSURD_RATIO", damage, lambda x: believed(2e5, 2e5 * x), 0.7e4, 1.3e4),
    Bracket("NINES_RATIO", damage, lambda x: believed(9999.0 / x, 9999.0), 7.0, 13.0),
    Bracket("RUN_BY_CHANCE", damage, lambda x: by_chance(x, kept=0.9, after=1000 - int(x)), 151, 157),
    Bracket("ALWAYS", damage, lambda x: by_chance(x, kept=0.97, after=1000 - int(x)), 120, 190),
    Bracket(
        "AROUND",
        damage,
        lambda x: by_chance(14, kept=0.0, before=(3,) * 300 + (1,) * int(x), after=5000),
        70,
        130,
    ),
    Bracket("SHORTEST_RUN", damage, lambda x: by_chance(x, kept=0.0, after=1000), 4, 5),
    Bracket("BEYOND_ROUNDING", damage, in_steps, 3, 5),
    Bracket("TURNING", damage, turning, 0.62, 0.5),
    Bracket("REPEATED", damage, repeated, 0.5, 0.75),
    Bracket("CALM", damage, calm, 0.03, 0.08),
    Bracket("PIECES", damage, lambda x: damage._parts(np.zeros(int(x))).size == x, 7e4, 1.3e5),
    Bracket("PIECE", damage, lambda x: damage._parts(np.zeros(int(x))).size == x, 7e4, 1.3e5),
    Bracket("OVERSHOOT", damage, lambda x: stops(1.0, 1.0 / 32.0, 1.0 / 32.0 / x), 5.0, 3.0),
    Bracket("AT_ZERO", damage, lambda x: stops(round(1024 * x) / 1024, 1.0 / 32.0, 0.0), 0.03, 0.015),
    Bracket("SHORT_STOP", damage, rest, 150, 250),
    Bracket("LONE", damage, lone, 14.0, 10.0),
)

CASES = DAMAGE


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_verdict_turns_at_the_threshold(case: Bracket, monkeypatch: pytest.MonkeyPatch) -> None:
    case.test(monkeypatch)


def test_no_threshold_is_without_a_case() -> None:
    assert names_in(thresholds) == {case.name for case in CASES}
