"""The measuring tool of the validation: its seeds, noise, noncentrality and the ideal test."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

pytest.importorskip("numba", reason="the second simulator is compiled with numba: install the extra `bench`")

from scipy.stats import chi2, kstest, ncx2

from tests.independent.drive_error import disturbed
from tests.independent.excitation import Excitation
from tests.independent.laws import DRIVE, DROP
from tests.independent.noncentrality import Hidden, Ideal, Projected, strength_for
from tests.independent.sensors import USUAL, logged
from tests.independent.series import drive_plan, drop_plan
from tests.independent.simulate import Base, simulate
from tests.independent.whitening import covariance, whitening
from tests.validation.cases import (
    KINDS,
    RIGS,
    STRENGTHS,
    _apart,
    cases,
    class_of,
    effects_of,
    hidden_in,
    interval_cases,
    seed_of,
)
from tests.validation.designs import NOISES, SCATTERS, TUNING_DESIGN, USUAL_DESIGN, noise_of

BASE = Base(1.8e4, 25.0, 3.0)
N, RATE = 2048, 2000.0
TIMES = np.arange(N) / RATE
#: Statistical tests here fail by chance once in ten thousand seeds, and the seeds are held.
BY_CHANCE = 1e-4


def drawn(noise, channel="force", times=TIMES, number=150, seed=0):
    """Noise of a channel at rest, ``(n, number)``, without lines and rounding."""
    plain = replace(noise, hum=dict.fromkeys(noise.hum, 0.0), lines={}, resolution=dict.fromkeys(noise.resolution, 0.0))
    rng = np.random.default_rng(seed)
    return np.column_stack([logged(channel, np.zeros(times.size), times, plain, rng) for _ in range(number)])


@pytest.mark.parametrize("kind", NOISES)
def test_noise_has_the_spectrum_claimed(kind: str) -> None:
    noise = noise_of(kind, np.random.default_rng(3))
    lags = covariance(replace(noise, resolution=dict.fromkeys(noise.resolution, 0.0)), "force", N, RATE)
    found = drawn(noise)
    for lag in (0, 1, 5, 20, 100):
        spread = 4.0 * lags[0] / math.sqrt(found.shape[1] * 10)
        assert np.mean(found[lag:] * found[: N - lag]) == pytest.approx(lags[lag], abs=spread), lag
    if kind in ("tails", "hum", "coarse"):
        assert np.all(lags[1:] == 0.0)
    else:
        assert lags[0] == pytest.approx(noise.rms["force"] ** 2, rel=1e-4)
    if kind == "slow":
        # First order: falls by a factor e in 1 / (2 pi 8 Hz).
        e_fold = RATE / (2.0 * math.pi * 8.0)
        assert math.log(lags[1] / lags[41]) == pytest.approx(40.0 / e_fold)


def test_tails_lines_and_growth_are_there() -> None:
    tails = drawn(noise_of("tails", np.random.default_rng(0)))
    assert np.mean(np.abs(tails) > 5.0 * 0.4) > 100 * math.erfc(5.0 / math.sqrt(2.0))
    hum = noise_of("hum", np.random.default_rng(0))
    reading = logged(
        "force", np.zeros(N), TIMES, replace(hum, rms=dict.fromkeys(hum.rms, 0.0)), np.random.default_rng(1)
    )
    for frequency, size in hum.lines["force"]:
        wave = np.exp(2j * math.pi * frequency * TIMES)
        assert 2.0 * abs(np.mean(reading * wave)) == pytest.approx(size, rel=0.1)
        assert 0.05 < size / hum.rms["force"] < 2.0
    load = noise_of("load", np.random.default_rng(0))
    force = np.concatenate([np.zeros(N // 2), np.full(N // 2, 90.0)])
    rng = np.random.default_rng(2)
    noisy = np.array([logged("force", force, TIMES, load, rng, force) - force for _ in range(100)])
    ratio = noisy[:, N // 2 :].std() / noisy[:, : N // 2].std()
    assert ratio == pytest.approx(1.0 + load.growth, rel=0.1)


@pytest.mark.parametrize("kind", ["pink", "slow", "load"])
def test_innovations_have_no_memory(kind: str) -> None:
    noise = noise_of(kind, np.random.default_rng(3))
    noise = replace(noise, resolution=dict.fromkeys(noise.resolution, 0.0), growth=0.0)
    found = drawn(noise)
    innovations = whitening(noise, "force", np.zeros(N), RATE)(found)
    assert innovations.std() == pytest.approx(1.0, abs=0.02)
    number = innovations.size
    for lag in (1, 2, 10, 100):
        assert abs(np.mean(innovations[lag:] * innovations[:-lag])) < 4.0 / math.sqrt(number), lag
    # The negative control: the noise itself has.
    if noise.pink or noise.slow:
        assert np.mean(found[10:] * found[:-10]) / found.var() > 20.0 / math.sqrt(number)


def test_every_release_draws_seeds_of_its_own() -> None:
    seeds = {
        case.seed
        for release, kind, rig, tuning in itertools.product(("one", "two"), KINDS, RIGS, (False, True))
        for case in itertools.islice(cases(release, kind, rig, tuning=tuning), 20)
    }
    assert len(seeds) == 2 * len(KINDS) * len(RIGS) * 2 * 20
    assert seed_of("a", "bc") != seed_of("ab", "c")
    again = [case.name for case in itertools.islice(cases("one", "faint", DROP), 20)]
    assert again == [case.name for case in itertools.islice(cases("one", "faint", DROP), 20)]
    first, other = (next(interval_cases("one", DROP, noise, 0.0)).seed for noise in ("pink", "slow"))
    assert first != other


def test_effects_are_drawn_together_only_where_the_simulator_can_have_both() -> None:
    rng, names = np.random.default_rng(0), ["fibre.mass", "guide.presliding", "sensor.force_lag", "fibre.hardening"]
    drawn = {frozenset(_apart(names, 2, rng)) for _ in range(200)}
    assert drawn == {
        frozenset(pair)
        for pair in (
            ("fibre.mass", "sensor.force_lag"),
            ("guide.presliding", "sensor.force_lag"),
            ("guide.presliding", "fibre.hardening"),
            ("sensor.force_lag", "fibre.hardening"),
        )
    }


def test_the_tuning_set_is_kept_apart() -> None:
    assert TUNING_DESIGN.step != USUAL_DESIGN.step
    assert not set(TUNING_DESIGN.drops) & set(USUAL_DESIGN.drops)
    assert not set(TUNING_DESIGN.drives) & set(USUAL_DESIGN.drives)
    for name in ("stiffness", "damping", "friction", "after", "seconds"):
        assert getattr(TUNING_DESIGN, name) != getattr(USUAL_DESIGN, name)


def test_a_short_run_holds_something_of_everything() -> None:
    for rig in RIGS:
        nulls = list(itertools.islice(cases("r", "null", rig), 18))
        assert {(case.noise, case.scatter) for case in nulls} == set(itertools.product(NOISES, SCATTERS))
        faint = list(itertools.islice(cases("r", "faint", rig), 32))
        names = effects_of("r", "faint", rig)
        assert len(names) == 8
        assert {(case.first, case.strength) for case in faint} == set(itertools.product(names, map(float, STRENGTHS)))
        assert len(effects_of("r", "outside", rig)) >= 8


def short(rig: str, scatter: float = 0.0, noise=USUAL) -> Ideal:
    rng = np.random.default_rng(1)
    if rig == DROP:
        return Ideal([drop_plan(10, 90, rng, 0.8), drop_plan(20, 45, rng, 0.8)], BASE, noise, scatter)
    return Ideal([drive_plan("quasi_sine", 250, 50, True, rng, 1.2)], BASE, noise, scatter)


@pytest.mark.parametrize(("rig", "scatter"), [(DROP, 0.0), (DROP, 0.01), (DRIVE, 0.01)])
def test_the_strength_has_the_noncentrality_asked_for(rig: str, scatter: float) -> None:
    ideal = short(rig, scatter)
    for name in ("guide.viscous_friction", "fibre.hardening", "sensor.force_lag"):
        for wanted in STRENGTHS:
            found = strength_for(ideal, Hidden(name, 0.1, {}), float(wanted))
            assert found.noncentrality == pytest.approx(wanted, rel=0.02)
            assert ideal.noncentrality([found.hidden]) == pytest.approx(wanted, rel=0.02)


def test_nothing_and_what_the_model_has_have_none() -> None:
    ideal = short(DROP)
    hidden = Hidden("guide.viscous_friction", 0.3, {})
    assert ideal.noncentrality([]) == 0.0
    whole = ideal.noncentrality([hidden])
    assert whole > 100.0
    assert abs(ideal.noncentrality([hidden], known=[hidden])) < 1e-6 * whole


def test_scatter_and_errors_of_the_drive_make_a_test_weaker() -> None:
    hidden = [Hidden("guide.viscous_friction", 0.1, {})]
    assert short(DROP, 0.01).noncentrality(hidden) < 0.9 * short(DROP).noncentrality(hidden)
    quiet = replace(USUAL, rms={**USUAL.rms, "drive": 1e-9}, resolution={**USUAL.resolution, "drive": 0.0})
    quiet = replace(quiet, hum={**USUAL.hum, "drive": 0.0})
    assert short(DRIVE).noncentrality(hidden) < 0.9 * short(DRIVE, noise=quiet).noncentrality(hidden)


def test_the_first_order_holds_for_a_faint_effect() -> None:
    """Against readings with the effect at full strength, refitted by nothing but the projection."""
    ideal = short(DROP)
    found = strength_for(ideal, Hidden("guide.viscous_friction", 0.1, {}), 60.0)
    full = changes_at_full_strength(ideal, found.hidden)
    assert left_of(ideal, full) == pytest.approx(60.0, rel=0.1)


def changes_at_full_strength(ideal: Ideal, hidden: Hidden) -> list[Projected]:
    parts = []
    for plan, yardstick in zip(ideal.plans, ideal.yardsticks, strict=True):
        effects = {hidden.name: hidden.values(BASE.stiffness)}
        there, here = (simulate(plan.conditions, BASE, e, plan.times, 1e-5) for e in (effects, {}))
        parts.append(yardstick.project((there.force - here.force)[:, None], (there.position - here.position)[:, None]))
    return parts


def left_of(ideal: Ideal, columns: list[Projected]) -> float:
    """Squared length off base parameters and each record's own, by least squares over all records."""
    normal, gradient, length, own = np.zeros((5, 5)), np.zeros(5), 0.0, 3
    for r, column in enumerate(columns):
        slopes = [ideal._slopes[i][r] for i in range(4)]
        joined = Projected(*(np.concatenate(parts, axis=1) for parts in zip(*slopes, strict=True)))
        places = np.array([0, 1, 2, own + r])
        normal[np.ix_(places, places)] += joined.dot(joined)
        gradient[places] += joined.dot(column)[:, 0]
        length += column.dot(column).item()
    return length - gradient @ np.linalg.solve(normal, gradient)


def gains(ideal: Ideal, hidden: Hidden, sizes: list[float], whiten_as=None, number: int = 120) -> list[np.ndarray]:
    """Gain of the true model on noisy readings with the effect at each size, to first order."""
    judge = ideal if whiten_as is None else replace(ideal, noise=whiten_as, _directions={})
    rng, n = np.random.default_rng(5), len(ideal.plans)
    direction = judge.direction(hidden)
    noisy = []
    for plan, yardstick in zip(ideal.plans, judge.yardsticks, strict=True):
        nothing = np.zeros(plan.times.size)
        force, position = (
            np.column_stack([logged(channel, nothing, plan.times, ideal.noise, rng) for _ in range(number)])
            for channel in ("force", "position")
        )
        noisy.append(yardstick.project(force, position))
    normal, inner = np.zeros((3 + n + 1,) * 2), np.zeros((3 + n + 1, number))
    for r in range(n):
        columns = [*(judge._slopes[i][r] for i in range(4)), direction[r]]
        joined = Projected(*(np.concatenate(parts, axis=1) for parts in zip(*columns, strict=True)))
        places = np.array([0, 1, 2, 3 + r, 3 + n])
        normal[np.ix_(places, places)] += joined.dot(joined)
        inner[places] += joined.dot(noisy[r])
    cross = np.linalg.solve(normal[:-1, :-1], normal[:-1, -1])
    score, length = inner[-1] - cross @ inner[:-1], normal[-1, -1] - cross @ normal[:-1, -1]
    return [(score + size * length) ** 2 / length for size in sizes]


@pytest.mark.parametrize("kind", ["pink", "slow", "hum"])
def test_the_ideal_test_gains_as_a_noncentral_chi_square(kind: str) -> None:
    noise = noise_of(kind, np.random.default_rng(4))
    ideal = short(DROP, noise=noise)
    hidden = strength_for(ideal, Hidden("guide.viscous_friction", 0.1, {}), 30.0).hidden
    with_it, without = gains(ideal, hidden, [hidden.strength, 0.0])
    assert kstest(with_it, ncx2(1, 30.0).cdf).pvalue > BY_CHANCE
    assert kstest(without, chi2(1).cdf).pvalue > BY_CHANCE


def test_a_test_that_takes_slow_noise_for_white_does_not() -> None:
    noise = noise_of("slow", np.random.default_rng(4))
    ideal = short(DROP, noise=noise)
    hidden = Hidden("guide.viscous_friction", 0.1, {})
    white = replace(noise, slow=0.0)
    (found,) = gains(ideal, hidden, [0.0], whiten_as=white)
    assert kstest(found, chi2(1).cdf).pvalue < 1e-6


@dataclass(frozen=True)
class Disturbed(Excitation):
    """A motion with an error that starts from nothing."""

    turn: float = 0.0
    size: float = 0.0

    def motion(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        position, velocity = super().motion(times)
        return position + self.size * np.sin(self.turn * times), velocity + self.size * self.turn * np.cos(
            self.turn * times
        )


def test_errors_of_the_drive_act_as_the_simulator_says() -> None:
    plan = drive_plan("quasi_sine", 250, 50, True, np.random.default_rng(0), 1.5)
    turns, size = np.array([3.0, 40.0, 150.0]), 1e-6
    force, position = disturbed(plan.conditions, BASE, plan.times, turns, np.full(3, -0.5 * math.pi))
    held = plan.conditions.excitation
    for j, turn in enumerate(turns):
        more, less = (
            simulate(
                replace(plan.conditions, excitation=Disturbed(**vars(held), turn=turn, size=sign * size)),
                BASE, {}, plan.times, 1e-5,
            )
            for sign in (1.0, -1.0)
        )  # fmt: skip
        for mine, other in ((force, more.force - less.force), (position, more.position - less.position)):
            true = other / (2.0 * size)
            assert np.linalg.norm(mine[:, j] - true) < 0.05 * np.linalg.norm(true)


def test_each_of_several_effects_has_its_noncentrality_beside_the_others() -> None:
    case = next(cases("r", "pair", DROP))
    rng = np.random.default_rng(0)
    ideal = short(DROP)
    found = hidden_in(case, ideal, rng)
    first, second = found.hidden
    assert class_of(first.name) != class_of(second.name)
    for one, other in ((first, second), (second, first)):
        assert ideal.noncentrality([one], known=[other]) == pytest.approx(found.noncentralities[one.name], rel=0.02)
        assert found.noncentralities[one.name] >= 0.9 * 200.0


def test_effects_that_undo_each_other_at_some_shape_are_not_hidden_together() -> None:
    """A dial gauge presses on the weight one way, as an asymmetric friction does; its spring is a shape of its own."""
    ideal = short(DROP)
    one = Hidden("guide.asymmetric_friction", -0.15, {})
    for travel in (0.02, 0.08):
        beside = Hidden("sensor.dial_gauge_force", 1.0, {"gauge_travel": travel})
        assert ideal.noncentrality([one], known=[beside]) < 0.05 * ideal.noncentrality([one])


def test_a_case_is_made_of_its_name_alone() -> None:
    case = next(cases("r", "faint", DROP))
    one, two = case.make(), case.make()
    for mine, other in zip(one.series.records, two.series.records, strict=True):
        np.testing.assert_array_equal(mine.logged.force, other.logged.force)
    assert one.noncentralities == two.noncentralities
    assert set(one.series.effects) == {case.first}


def test_the_true_law_leaves_more_of_a_record_that_differs_from_the_others() -> None:
    """Noise alone where records agree, and the more beyond it the more they differ."""
    gaps = []
    for scatter in (0.0, 0.01, 0.02):
        case = replace(next(cases("r", "faint", DROP)), scatter=scatter)
        gaps.append(case.make().gap_of_truth(case.design.step))
    assert gaps[0] == pytest.approx(1.0, abs=1e-9)
    assert gaps[1] > 1.01
    # Scatter acts by its square, beside what phases that slip more and more do.
    assert gaps[2] > 1.5 * (gaps[1] - 1.0) + 1.0
