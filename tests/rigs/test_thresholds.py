"""Thresholds of motions decide: with twice or half of one a motion would be taken for another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from fibrefit.core.errors import DataError
from fibrefit.rigs import fibre_mass, guided_mass, pulley_drive, rig, thresholds
from fibrefit.rigs.catalogue import RIGS
from fibrefit.rigs.signals import newton, rates, rest
from fibrefit.rigs.signals.newton import Pull, Sizes
from fibrefit.rigs.signals.trace import Trace
from tests.brackets import Bracket
from tests.brackets import thresholds as names_in

NUMBER = 20
"""Samples of a stretch."""
TIMES = np.arange(40 * NUMBER) / 1000.0


def stretches(speed: np.ndarray) -> int:
    """Stretches in which a weight of such speeds slides."""
    with patch.object(newton, "derivative", lambda *_: speed):
        return len(newton._stretches(np.zeros((2, len(speed))), TIMES, np.ones(len(speed), bool), NUMBER))


def slides(speed: float) -> bool:
    """Whether a weight slides that has such a share of its largest speed, which it has in half of the record."""
    return stretches(np.where(TIMES[len(TIMES) // 2] > TIMES, 1.0, speed)) > 50


def mostly_slides(share: float) -> bool:
    """Whether stretches count in such a share of which a weight moves."""
    return stretches(np.where(np.arange(len(TIMES)) % NUMBER < share * NUMBER, 1.0, 0.0)) > 20


def agree(number: float) -> bool:
    """Whether so many stretches tell the sizes of gravity and force."""
    found = Sizes(1.0, 1.0, 0.1, 0.1, 0.0, 1.0)
    with (
        patch.object(newton, "_stretches", lambda *_: np.zeros((int(number), 3, NUMBER))),
        patch.object(newton, "_fitted", lambda *_: found),
    ):
        return newton.newton_of(TIMES, TIMES, TIMES, Pull(1.0, 9.81, np.ones(len(TIMES)))) is not None


def stands(speed: float) -> bool:
    """Whether a mass stands that has such a share of its largest speed."""
    return bool(rates._stands(np.array([1.0, 1.0, speed, speed]))[2])


def leads(samples: float) -> bool:
    """Whether a motion in which the force was read so often leads a model."""
    times = np.arange(400) / 1000.0
    force = np.where(np.arange(400) < 100 + int(samples), 1.0, np.nan)
    force[:100] = np.nan
    place = np.column_stack([times, np.ones(400), times])
    return accepted(lambda: rates.along_motion(Trace("a", times, {"force": force}, {"position": place}, {})))


def accepted(read: Callable[[], Any]) -> bool:
    """Whether something is not refused."""
    try:
        read()
    except DataError:
        return False
    return True


def record(channels: dict[str, np.ndarray], inputs: dict[str, np.ndarray] | None = None, **conditions: float) -> Trace:
    """One of a thousand samples a second, with measured inputs whose rates are given beside them or zero."""
    columns = {
        name: row if row.ndim == 2 else np.column_stack([row, 0 * row, row]) for name, row in (inputs or {}).items()
    }
    rows = next(iter((channels or columns).values()))
    return Trace("a", np.arange(len(rows)) / 1000.0, channels, columns, conditions)


def rests_first(levels: Sequence[float], least: int = 2) -> bool:
    """Whether a record whose first blocks lie at such levels, in units of the noise, begins with a rest so long."""
    means = np.array([*levels, *[50.0, 80.0] * 20])
    noise = np.random.default_rng(0).standard_normal((len(means), rest.BLOCK))
    signal = noise - noise.mean(axis=1, keepdims=True) + means[:, None]
    first = [found.stop for found in rest.rests(record({"force": signal.ravel()})) if found.start == 0]
    return max(first, default=0) >= least * rest.BLOCK


def rests_throughout(blocks: int) -> bool:
    """Whether so many blocks at rest include two, one after the other, that lie away."""
    means = np.zeros(blocks)
    means[12:14] = 4.0
    noise = np.random.default_rng(0).standard_normal((blocks, rest.BLOCK))
    signal = noise - noise.mean(axis=1, keepdims=True) + means[:, None]
    return (
        max(found.stop for found in rest.rests(record({"force": signal.ravel()})) if found.start == 0) > 14 * rest.BLOCK
    )


def drifts(share: float) -> bool:
    """Whether an input that moves by such a share of its travel is at rest."""
    drive = np.repeat([0.0, share, 1.0], [8 * rest.BLOCK, 4 * rest.BLOCK, 20 * rest.BLOCK])
    return rest.rests(record({}, {"drive": drive}))[0].stop > 8 * rest.BLOCK


def holds(share: float) -> bool:
    """Whether what was let go has not begun to move, such a share of its way from where it was held."""
    way = np.concatenate([np.ones(10), np.full(100, 1.0 - share), np.cos(np.linspace(0.7, 20.0, 800)), np.zeros(200)])
    return len(rates.from_motion(record({"angle": way}), "angle").times) < 1005


def lasts(samples: float) -> bool:
    """Whether a motion is long enough that lasts so many samples."""
    way = np.repeat([1.0, 0.0], [200 - int(samples), int(samples)])
    return accepted(lambda: rates.from_motion(record({"angle": way}), "angle"))


def falls(fallen: np.ndarray) -> bool:
    """Whether a weight falls, by shares of its lift; where it was let go, and from where, is stated."""
    trace = record({"position": fallen}, lift=1.0)
    return accepted(lambda: fibre_mass._fall(trace, {"release": 0.0, "position_zero": 1.0}))


def force_rises(size: float) -> bool:
    """Whether a force is seen that rises so many times as far as it scatters at rest."""
    force = np.append(np.tile([1.0, -1.0], 50), np.full(50, size))
    with patch.object(fibre_mass, "first_rest", lambda *_: slice(0, 100)):
        return accepted(lambda: fibre_mass._onset(record({"force": force, "position": np.arange(150.0)}), 0.0))


def caught_later(share: float) -> bool:
    """Whether a force that begins at such a share of the largest is that of a weight still falling."""
    force = np.concatenate([np.full(30, share), np.zeros(50), np.sin(np.linspace(0.0, np.pi, 40)), np.zeros(50)])
    trace = record({"force": force}, weight_mass=0.1, added_mass=0.0, inclination=1.0)
    with patch.object(fibre_mass, "rests", lambda _: []):
        return accepted(lambda: fibre_mass._catch(trace))


def slid(samples: float) -> bool:
    """Whether a mass that slides for so many samples shows what acts on it."""
    speed = np.where(np.arange(100) < samples, 1.0, 0.0)
    trace = record({"force": speed}, {"position": speed, "speed": speed}, gain=1.0, added_mass=0.0)
    return accepted(lambda: guided_mass._terms(trace, False, False))


def turned(share: float) -> bool:
    """Whether a force is accepted that goes against the acceleration, which explains such a share of it."""
    speeding, other = np.tile([1.0, -1.0], 50), np.repeat([1.0, -1.0], 50)
    force = np.sqrt(1.0 - share) * other - np.sqrt(share) * speeding
    return accepted(lambda: guided_mass._solved({"mass": speeding}, force, {}, "a"))


def drive_stands(noise: float, away: float) -> bool:
    """Whether a drive that is so far away in m has not begun to move."""
    drive = np.append(np.tile([noise, -noise], 50), np.full(50, away))
    return not accepted(lambda: pulley_drive._begins(record({}, {"drive": drive}), slice(0, 100)))


def offered(factor: float) -> bool:
    """Whether a further drop may be so much higher than the one at hand."""
    stated = {"weight_mass": [1.0], "added_mass": [0.0], "inclination": [1.0], "lift": [1.0]}
    return RIGS["fibre_mass"].reach(stated)["lift"][1] >= factor


CASES = (
    Bracket("FARTHER", rig, offered, 1.3, 1.8),
    Bracket("LIFT_AGREES", fibre_mass, lambda x: fibre_mass.LiftShown("a", 1.0, 1.0 + x).agrees, 0.08, 0.15),
    Bracket("MOVES", newton, slides, 0.07, 0.035),
    Bracket("MOSTLY_SLIDES", newton, mostly_slides, 0.9, 0.7),
    Bracket("FEWEST_STRETCHES", newton, agree, 6, 5),
    Bracket("STANDS", rates, stands, 0.015, 0.03),
    Bracket("FEWEST_MOVING", rates, leads, 36, 28),
    Bracket("FEWEST_MOVING", rates, lasts, 36, 28),
    Bracket("SHORTEST_REST", rest, lambda n: rests_first([0.0] * n, 1), 3, 2),
    Bracket("FIRST_BLOCKS", rest, lambda n: rests_first([0.0, 0.0, 3.0, 3.0, 0.0, 0.0][:n]), 6, 4),
    Bracket("SPREADS", rest, rests_throughout, 28, 42),
    Bracket("SLOW_NOISE", rest, lambda x: rests_first([0.0] * 4 + [x] * 4, 5), 4.5, 8.0),
    Bracket("FAST_NOISE", rest, lambda x: rests_first([0.0, 0.0, x, x]), 0.9, 1.6),
    Bracket("DRIFT", rest, drifts, 0.002, 0.0045),
    Bracket("BEGUN", rates, holds, 0.015, 0.03),
    Bracket("FALLS_AT_ALL", fibre_mass, lambda x: falls(np.linspace(0.85 - x, 0.85, 200)), 0.4, 0.2),
    Bracket("FALLEN", fibre_mass, lambda x: falls(x * np.linspace(0.0, 1.0, 200) ** 2), 0.9, 0.7),
    Bracket("FEWEST_FALLING", fibre_mass, lambda n: falls(np.append(np.linspace(0.1, 0.7, n), [1.0, 0.0])), 5, 3),
    Bracket("FORCE_RISES", fibre_mass, force_rises, 10.0, 6.0),
    Bracket("CAUGHT", fibre_mass, caught_later, 0.04, 0.07),
    Bracket("FEWEST_SLIDING", guided_mass, slid, 20, 12),
    Bracket("PROVEN", guided_mass, turned, 0.15, 0.3),
    Bracket("DRIVE_BEGINS", pulley_drive, lambda x: drive_stands(1e-3, 1e-3 * x), 7.0, 13.0),
    Bracket("DRIVE_STANDS", pulley_drive, lambda x: drive_stands(0.0, x), 0.7e-5, 1.3e-5),
)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_motion_is_taken_for_another_at_the_threshold(case: Bracket, monkeypatch: pytest.MonkeyPatch) -> None:
    case.test(monkeypatch)


def test_no_threshold_is_without_a_case() -> None:
    assert names_in(thresholds) == {case.name for case in CASES}
