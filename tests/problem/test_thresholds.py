"""Every threshold of residuals and estimates decides: with twice or half of it a verdict here would be another."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np
import pytest

from fibrefit.core.errors import DataError
from fibrefit.problem import formulation, thresholds
from fibrefit.problem.diagnose import channels, motion, newton
from fibrefit.problem.diagnose.channels import roughness
from fibrefit.problem.diagnose.motion import moves
from fibrefit.problem.diagnose.newton import ForceBalance
from fibrefit.problem.estimate import evidence, gls
from fibrefit.problem.estimate.evidence import EXTENSION, grid_over, usual_axes
from fibrefit.problem.estimate.gls import HausmanTest
from fibrefit.problem.inputs import errors_in_variables, smoothing
from fibrefit.problem.linear_model import unknowns
from fibrefit.problem.noise import readings, whittle
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.statement import observations
from fibrefit.problem.statement.layout import Range, Slot
from fibrefit.rigs.catalogue import rig_of
from fibrefit.rigs.signals.newton import Pull, Sizes
from fibrefit.rigs.signals.trace import Trace
from tests.brackets import Bracket
from tests.brackets import thresholds as names_in


def compared(share: float) -> bool:
    """Whether a difference is left unjudged where the better estimate saves so small a share of the variance."""
    found = HausmanTest.of(np.array([5.0]), np.array([[1.0]]), np.array([[1.0 - share]]))
    return not np.isfinite(found.scores).any()


def cornered(height: float) -> bool:
    """Whether a wave as a corner leaves it, so high in its matched filter where the noise is one, is a corner."""
    step, size = 1.0 / 2000.0, 2400
    shapes = smoothing._Shapes(34, step, lambda v: v - smoothing._parabolas(v, 34, step)[0][:, 0])
    wave = shapes.columns(np.array([0.6]), size)[0][:, 0]
    return bool(len(smoothing._selected(height * wave / np.linalg.norm(wave), shapes, 1.0)[0]))


class _Rubs(NamedTuple):
    """A guide with a friction of 2 N."""

    def net_force(self, drive: Any, direction: Any, sliding: Any) -> Any:
        return drive - 2.0 * direction


class _OneMass(NamedTuple):
    """A mass in a guide, driven by what was measured."""

    guide: _Rubs
    gain: float = 1.0
    offset: float = 0.0
    mass: float = 3.0


def standing(speed: float) -> bool:
    """Whether a mass of such a speed counts as one that stands: no force is asked of it but the measured one."""
    one, system = np.ones(1), _OneMass(guide=_Rubs())
    return bool(newton._required_force(system, 0.0 * one, speed * one, 0.0 * one, 5.0 * one) == 5.0)


ORDINATES = 100
"""Of a record of two hundred samples, in steps of one Hz from one on."""
BANK: Any = SimpleNamespace(rate=np.array([200.0]), corners=np.array([5.0]))
DRAWS = whittle._Draws(np.ones((1, 1, 200)), np.ones((1, 200), bool), np.array([200]), BANK)


def line(power: float, frequency: int = 50) -> bool:
    """Whether an ordinate of such a power over what is expected is a line."""
    powers = np.where(np.arange(ORDINATES) == frequency - 1, power, 1e-3)
    frequencies = 1.0 + np.arange(ORDINATES)
    whole = whittle.Periodograms(frequencies, powers, np.ones((ORDINATES, 1)), np.zeros(ORDINATES, int))
    with patch.object(whittle, "_refined", lambda *_: (50.0, 1.0)):
        return whittle._line(DRAWS, whole, np.ones(1), ()) is not None


def clear(distance: float) -> bool:
    """Whether an ordinate so many others away from a line tells of the rest of the spectrum."""
    whole = whittle.Periodograms(np.array([50.0 + distance]), np.ones(1), np.ones((1, 1)), np.zeros(1, int))
    return bool(whittle._clear(whole, [(50.0, 1.0)], DRAWS)[0])


def slow_part(variance: float) -> bool:
    """Whether a first-order part of such a variance beside white noise of one is named."""
    found = SimpleNamespace(bands=SimpleNamespace(simplest=lambda: np.array([variance, 0.0, 1.0])))
    with patch.object(whittle, "periodograms", lambda *_: found):
        return bool(whittle._noise(DRAWS, lines=False).slow)


def grows(errors: float) -> bool:
    """Whether noise that is so many standard errors larger under load is taken to grow with it."""
    with patch.object(readings, "growth_and_error", lambda *_: (errors, 1.0)):
        return readings.growth_with_load((), "force") > 0.0


def told_by(number: float) -> bool:
    """Whether so many readings at each of eight levels of the load tell how its noise grows."""
    noise = np.random.default_rng(4).normal(size=8 * int(number))
    traces: Any = [SimpleNamespace(channels={"force": np.repeat(np.arange(8) * 1e3 + 500.0, int(number)) + noise})]
    with patch.object(readings, "coarse_step", lambda *_: None):
        return bool(np.isfinite(readings.growth_and_error(traces, "force")[1]))


def touching(samples: float) -> bool:
    """Whether a contact of 40 ms of which so many positions are known tells of a delay."""
    times = np.arange(400) / 1000.0
    force = np.where(np.abs(times - 0.2) < 0.02, 100.0, 0.0)
    trace = SimpleNamespace(times=times, step=1e-3, channels={"force": force})
    known = np.where(np.abs(np.arange(400) - 200) < samples / 2, 0.0, np.nan)
    task: Any = SimpleNamespace(traces=[trace])
    with patch.object(newton, "measured_positions", lambda *_: known):
        return len(newton._contacts(task)) == 1


def loaded(share: float) -> bool:
    """Whether a fibre is slack in a second contact of such a share of the largest force."""
    times = np.arange(800) / 1000.0
    force = np.where(np.abs(times - 0.2) < 0.02, 100.0, 0.0) + np.where(np.abs(times - 0.6) < 0.02, 100.0 * share, 0.0)
    task: Any = SimpleNamespace(traces=[SimpleNamespace(times=times, step=1e-3, channels={"force": force})])
    with patch.object(newton, "measured_positions", lambda *_: np.zeros(800)):
        return len(newton._contacts(task)) == 1


def flying(samples: float) -> bool:
    """Whether a flight of so many samples has a curvature, a tenth of them being left out at either end."""
    return bool(newton._stretches(np.pad(np.ones(int(samples), bool), 5)))


def driven(share: float) -> bool:
    """Whether a drive moves at such a share of its largest rate."""
    rates = np.where(np.arange(2000) < 1000, 1.0, share)[None]
    return bool(moves(rates, np.arange(2000.0)[None] / 1000.0)[0, 1500])


def smooth(spans: float) -> bool:
    """Whether a ramp of so many spans is told to be smooth."""
    times = np.arange(5 * int(spans)) / 1000.0
    return bool(np.isfinite(roughness(times, times)))


def believed(explained: float) -> bool:
    """Whether a force of half its size is told, where such sizes explain so much."""
    signals = {"position": np.zeros(1), "force": np.zeros(1)}
    trace: Any = SimpleNamespace(name="a", times=None, channels=signals, conditions={})
    rig: Any = SimpleNamespace(pulled=lambda *_: SimpleNamespace(mass=1.0), parameters=(), conditions=())
    with patch.object(channels, "newton_of", lambda *_: Sizes(1.0, 0.5, 0.01, 0.01, 0.0, explained)):
        try:
            channels.refuse_misread([trace], rig)
        except DataError:
            return True
    return False


def sign_told(explained: float) -> bool:
    """Whether a force is told to have another sign, where Newton's law explains so much of the positions."""
    signals = {"position": np.zeros(1), "force": np.zeros(1)}
    trace: Any = SimpleNamespace(times=None, channels=signals, conditions={}, inputs={})
    rig: Any = SimpleNamespace(pulled=lambda *_: Pull(1.0, 1.0, np.ones(1)))
    with patch.object(channels, "newton_of", lambda *_: Sizes(1.0, -1.0, 0.01, 0.01, 0.0, explained)):
        return channels.against_which(channels.senses_of(trace, rig)) == ("force",)


def weighing(size: float) -> bool:
    """Whether force and position are told to be turned round, where gravity seems to have such a size upwards."""
    return turned_by(size, 1.0)


def levelled(share: float) -> bool:
    """The same, where the pull of gravity is such a share of the range of the force."""
    return turned_by(1.0, share)


def turned_by(size: float, share: float) -> bool:
    signals = {"position": np.zeros(2), "force": np.array([0.0, 1.0])}
    trace: Any = SimpleNamespace(times=None, channels=signals, conditions={}, inputs={})
    rig: Any = SimpleNamespace(pulled=lambda *_: Pull(1.0, share, np.ones(2)))
    with patch.object(channels, "newton_of", lambda *_: Sizes(-size, 1.0, 0.01, 0.01, 0.0, 1.0)):
        return channels.against_which(channels.senses_of(trace, rig)) == ("gravity",)


def leading(share: float) -> bool:
    """Whether a weight that moves against its drive, by such a share of it, is told to."""
    drive = np.sin(np.arange(400.0))
    inputs = {"drive": np.column_stack([drive] * 3)}
    trace: Any = SimpleNamespace(times=None, channels={"position": -share * drive}, conditions={}, inputs=inputs)
    return channels.against_which(channels.senses_of(trace, rig_of("pulley_drive"))) == ("drive",)


def long_enough(samples: float) -> bool:
    """Whether a record of so many samples tells a motion."""
    times = np.arange(samples) / 1000.0
    try:
        observations.stack([Trace("a", times, {"force": times}, {}, {})], {"force": np.ones(1)})
    except DataError:
        return False
    return True


def read_often(samples: float) -> bool:
    """Whether so many valid readings of a channel tell a motion."""
    force = np.where(np.arange(100) < samples, 1.0, np.nan)
    record: Any = SimpleNamespace(
        name="a", time=np.arange(100) / 1000.0, rate=1000.0, uniform=True, channels={"force": force}
    )
    rig: Any = SimpleNamespace(kind="a", measured=("force",), channels=("force",), inputs=(), derived=(), anchor=None)
    with patch.object(formulation, "conditions_of", lambda *_: {}):
        try:
            formulation.trace_of(record, rig, {})
        except DataError:
            return False
    return True


def bridged(samples: float) -> bool:
    """Whether so many usable samples of an input around each instant tell its slope."""
    with patch.object(smoothing, "_around", lambda *_: np.full(20, samples)):
        try:
            smoothing._refuse_holes(np.zeros(20), np.arange(20.0), 30, "a")
        except DataError:
            return False
    return True


def of_mains(distance: float) -> bool:
    """Whether an ordinate so far below the mains in Hz is left out of the noise."""
    told: list[float] = []
    with patch.object(readings, "whittle", lambda frequency, power: (told.extend(frequency.tolist()), (1.0, 0.0))[1]):
        readings.noise_of([(np.random.default_rng(0).standard_normal(1000), 1000.0)])
    return not np.any(np.abs(np.array(told) - (50.0 - distance)) < 1e-6)


def told_though_masked(share: float) -> bool:
    """Whether all of a rest tells the noise of which such a share is masked."""
    values = np.zeros(1000)
    values[:: round(1.0 / share)] = np.nan
    return len(readings.unbroken(values)) == 1000


def line_reaches(distance: float) -> bool:
    """Whether errors of an input may hold power of the mains so far from them in Hz."""
    half_periods = np.array([round((50.0 - distance) * 20.0)])
    return bool(errors_in_variables.amplitudes(Noise(0.0, 0.0, 1.0, 1000), 10.0, half_periods)[0] > 0.0)


def coarse(noise: float) -> bool:
    """Whether readings are coarse whose noise is such a share of their step."""
    trace = Trace("a", np.arange(9.0), {"force": np.arange(9.0)}, {}, {})
    with patch.object(readings, "fast_part", lambda _: noise):
        return readings.coarse_step([trace], "force") is not None


def crossing(steps: float) -> bool:
    """Whether readings that rise by so many steps within a window show their noise."""
    rising = np.resize(np.linspace(0.0, steps, readings.WINDOW), 10 * readings.WINDOW)
    return readings.noise_in_motion([Trace("a", np.arange(320.0), {"force": rising}, {}, {})], "force", 1.0) > 0.0


MASS = Slot("mass", "kg", Range(0.0, np.inf, 1.0))


def ending(told: float) -> evidence.MarginalLikelihood:
    """Evidence of records that make the last level so many times as probable as beforehand, of three parameters."""
    axes = usual_axes(3, (0,))
    grid, prior = grid_over(axes)
    last = grid[:, 0] == EXTENSION[-1]
    share = np.exp(prior)[last].sum()
    logs = prior + np.where(last, np.log(told * (1.0 - share) / (1.0 - told * share)), 0.0)
    columns: Any = SimpleNamespace(names=("stiffness", "damping", "friction"), scattering=np.arange(3))
    mode: Any = SimpleNamespace(unknowns=columns)
    return evidence.MarginalLikelihood._over_grid(
        mode, grid, logs, np.zeros((len(grid), 1)), np.zeros((len(grid), 1, 1)), axes
    )


def within(told: float) -> bool:
    """Verdict on records that differ in their stiffness so."""
    (check,) = ending(told).between_records_checks()
    assert check.facts["parameter"] == "stiffness"
    return check.passed


CASES = (
    Bracket("LAST_LEVEL_RATIO", evidence, lambda x: not ending(x).beyond_levels, 1.5, 2.5),
    Bracket("LAST_LEVEL_RATIO", evidence, within, 1.5, 2.5),
    Bracket("BESIDE_MAINS", readings, of_mains, 3.0, 6.0),
    Bracket("FEW_MASKED", readings, told_though_masked, 0.04, 0.07),
    Bracket("LINE_WIDTH", errors_in_variables, line_reaches, 0.8, 1.4),
    Bracket("COARSE_STEPS", readings, coarse, 0.4, 0.7),
    Bracket("CROSSED", readings, crossing, 3.0, 2.0),
    Bracket("PROVEN_FACTOR", unknowns, lambda x: unknowns._row(MASS, 1.0, 1.0 / x)[0], 7.0, 4.0),
    Bracket("MISREAD", channels, lambda x: not channels.is_off(x, 0.01), 1.2, 1.3),
    Bracket("PROVEN_FACTOR", channels, lambda x: not channels.is_off(2.0, 1.0 / x), 4.0, 6.0),
    Bracket("TELLS_A_SIGN", channels, sign_told, 0.14, 0.07),
    Bracket("CARRIES_LOAD", channels, levelled, 0.06, 0.04),
    Bracket("FOLLOWS", channels, leading, 0.5, 0.3),
    Bracket("CARRIES_LOAD", newton, loaded, 0.035, 0.07),
    Bracket("SHORTEST_CONTACT", newton, touching, 30, 18),
    Bracket("SHORTEST_FLIGHT", newton, flying, 12, 9),
    Bracket("CREEPS", motion, driven, 0.03, 0.014),
    Bracket("FEWEST_READINGS", channels, smooth, 20, 12),
    Bracket("LINE_BY_CHANCE", whittle, line, 18.6, 18.2),
    Bracket("SLOWEST_LINE", whittle, lambda x: line(30.0, int(x)), 25, 15),
    Bracket("CLEAR", whittle, clear, 4.0, 2.0),
    Bracket("NEGLIGIBLE_PART", whittle, slow_part, 1.4e-4, 0.7e-4),
    Bracket("GROWS", readings, grows, 4.0, 2.0),
    Bracket("LEVEL_READINGS", readings, told_by, 75, 35),
    Bracket(
        "UNLIKELY",
        gls,
        lambda x: HausmanTest(np.ones(1), 1.0 / x, np.ones(1)).check(("a",)).passed,
        1 / 0.0013,
        1 / 0.0007,
    ),
    Bracket("FEWEST_READINGS", formulation, read_often, 20, 12),
    Bracket("FEWEST_AROUND", smoothing, bridged, 4, 3),
    Bracket("CORNER", smoothing, cornered, 6.0, 4.0),
    Bracket("STANDING", newton, standing, 7e-4, 1.3e-3),
    Bracket("SLIGHT", gls, compared, 0.015, 0.025),
    Bracket("BALANCE", newton, lambda x: ForceBalance(1.0, x, 1.0 - x**2).check().passed, 0.08, 0.12),
)


def test_the_larger_part_decides_where_there_is_no_threshold() -> None:
    """What explains less than it leaves is not believed; what is nearer to nil than to one has no sign."""
    assert believed(0.6)
    assert not believed(0.4)
    assert weighing(0.7)
    assert not weighing(0.35)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_verdict_turns_at_the_threshold(case: Bracket, monkeypatch: pytest.MonkeyPatch) -> None:
    case.test(monkeypatch)


def test_a_record_is_long_enough_from_there_on(monkeypatch: pytest.MonkeyPatch) -> None:
    Bracket("FEWEST_READINGS", observations, long_enough, 20, 12).test(monkeypatch)


def test_no_threshold_is_without_a_case() -> None:
    """`GAP_OF_NOISE` decides in the checks of a fit and of a posterior, which have a case of it each."""
    assert names_in(thresholds) == {case.name for case in CASES} | {"GAP_OF_NOISE"}
