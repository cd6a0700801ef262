"""Noise from rests: white, pink and mains, as a logger with a resolution writes them."""

from __future__ import annotations

import numpy as np
import pytest

from fibrefit.core.spectra import periodogram, whittle, without_lines
from fibrefit.problem.inputs.errors_in_variables import amplitudes, half_periods
from fibrefit.problem.noise.readings import at_rest, estimate_noise, noise_of
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.noise.whittle import with_lines
from fibrefit.rigs.signals.rest import rests
from fibrefit.rigs.signals.trace import Trace
from tests.fitting import made

RATE = made.RATE
WITHIN = 0.03
"""On the average of 40 series; one estimate from some seconds of rest scatters by a few percent more."""


def trace(random: np.random.Generator, share: float, mains: float, grain: float, samples: int = 2400) -> Trace:
    """Two stretches of rest with a motion between; the noise has variance one."""
    times = np.arange(samples) / RATE
    motion = 50.0 * np.clip(times - 0.25, 0.0, 0.15) ** 2
    motion = 400.0 * motion * (1.0 + 0.3 * np.sin(80.0 * times) * (times > 0.25) * (times < 0.6))
    noise = made.coloured(samples, share, random) * np.sqrt(1.0 - 0.5 * mains**2)
    noise = noise + mains * np.sin(2.0 * np.pi * (50.0 * times + random.random()))
    values = grain * np.round((motion + noise) / grain) if grain else motion + noise
    return Trace("made", times, {"force": values}, {}, {})


def estimates(share: float, mains: float, grain: float) -> np.ndarray:
    """Noise rms of 40 series of five records; it should be one."""
    found = []
    for seed in range(40):
        random = np.random.default_rng([seed, 4])
        traces = [trace(random, share, mains, grain) for _ in range(5)]
        found.append(estimate_noise(traces, "force").rms(2400 / RATE, RATE))
    return np.array(found)


@pytest.mark.parametrize(("share", "mains", "grain"), [(0.0, 0.0, 0.05), (0.5, 0.15, 0.05), (0.5, 0.0, 0.0)])
def test_noise_is_known_to_three_percent(share: float, mains: float, grain: float) -> None:
    found = estimates(share, mains, grain)
    assert abs(found.mean() - 1.0) < WITHIN
    assert found.std() < 0.06


def test_the_scatter_of_short_rests_alone_is_not() -> None:
    """The negative control: what a rest of a tenth of a second shows leaves pink noise out."""
    short = [np.std(made.coloured(2400, 0.7, np.random.default_rng([seed, 4]))[:200]) for seed in range(200)]
    assert np.mean(short) < 1.0 - 2.0 * WITHIN


def test_a_level_twice_as_high_is_seen() -> None:
    random = np.random.default_rng(0)
    once = [trace(random, 0.5, 0.0, 0.0) for _ in range(5)]
    twice = [one._replace(channels={"force": 2.0 * one.channels["force"]}) for one in once]
    first, second = (estimate_noise(traces, "force").rms(1.2, RATE) for traces in (once, twice))
    assert second == pytest.approx(2.0 * first, rel=1e-3)


def test_white_and_pink_are_told_apart() -> None:
    random = np.random.default_rng(3)
    parts = [periodogram(made.coloured(4000, 0.6, random), RATE) for _ in range(20)]
    white, pink = whittle(*(np.concatenate(part) for part in zip(*parts, strict=True)))
    assert white * 0.5 * RATE == pytest.approx(0.64, rel=0.05)
    # The pink variance of one is spread over the logarithm of twice the number of samples.
    assert pink * (np.log(4000) + 0.577) == pytest.approx(0.36, rel=0.25)


def test_rests_end_where_the_motion_begins() -> None:
    found = rests(trace(np.random.default_rng(1), 0.5, 0.1, 0.05))
    assert found[0].start == 0
    # The block in which motion begins is left out.
    assert 0.25 * RATE - 96 <= found[0].stop <= 0.25 * RATE
    assert found[-1].stop == 2400
    assert found[-1].start >= 0.6 * RATE - 96


def test_damage_in_a_rest_is_left_out_and_is_no_motion_elsewhere() -> None:
    made_trace = trace(np.random.default_rng(1), 0.5, 0.0, 0.05)
    made_trace.channels["force"][250:260] = np.nan
    found = estimate_noise([made_trace] * 3, "force")
    assert found.samples > 0
    assert found.rms(1.2, RATE) == pytest.approx(1.0, rel=0.25)


@pytest.mark.parametrize("share", [0.003, 0.01, 0.03])
def test_masked_readings_within_a_rest_leave_its_noise_known(share: float) -> None:
    found = []
    for seed in range(20):
        random = np.random.default_rng([seed, 5])
        whole = trace(random, 0.0, 0.0, 0.0)
        lost = random.random(len(whole.times)) < share
        masked = whole._replace(channels={"force": np.where(lost, np.nan, whole.channels["force"])})
        noise = estimate_noise([masked], "force")
        assert noise.samples > 64
        found.append(noise.rms(1.2, RATE))
    assert abs(np.mean(found) - 1.0) < WITHIN


def test_the_noise_of_a_rest_whose_readings_are_all_masked_is_not_taken_from_it() -> None:
    whole = trace(np.random.default_rng(1), 0.0, 0.0, 0.0)
    masked = whole._replace(channels={"force": np.where(whole.times < 0.25, np.nan, whole.channels["force"])})
    seen = at_rest([masked], "force")
    assert [len(values) for values, _ in seen] == [rest.stop - rest.start for rest in rests(masked) if rest.start > 600]
    assert all(np.isfinite(values).all() for values, _ in seen)


def test_without_any_rest_the_fast_part_is_taken_and_said_to_be_so() -> None:
    times = np.arange(2000) / RATE
    swing = 30.0 * np.sin(2.0 * np.pi * 3.0 * times) + np.random.default_rng(0).standard_normal(2000)
    found = estimate_noise([Trace("made", times, {"force": swing}, {}, {})], "force")
    assert found.samples == 0
    assert found.rms(1.0, RATE) == pytest.approx(1.0, rel=0.1)


def test_a_channel_that_never_changes_has_the_noise_of_its_resolution() -> None:
    times = np.arange(2000) / RATE
    stairs = 0.1 * np.round(100.0 * np.clip(times - 0.5, 0.0, 0.1))
    found = estimate_noise([Trace("made", times, {"force": stairs}, {}, {})], "force")
    assert 0.0 < found.rms(1.0, RATE) <= 0.1


def test_spectrum_and_total_agree() -> None:
    noise = Noise(2e-3, 0.3, 0.05, 1000)
    frequency = np.linspace(1.0, 1000.0, 400_000)
    total = np.trapezoid(noise.density(frequency), frequency) + noise.line
    assert noise.rms(1.0, 2000.0) ** 2 == pytest.approx(total, rel=3e-3)


def test_lines_of_a_rest_are_found_at_their_frequencies_and_none_where_there_is_none() -> None:
    random, times = np.random.default_rng(5), np.arange(1000) / RATE
    quiet = [(random.standard_normal(1000), RATE) for _ in range(5)]
    assert with_lines(noise_of(quiet), quiet) == noise_of(quiet)
    mains = [np.sqrt(2.0) * np.sin(2.0 * np.pi * f * times + random.uniform(0.0, 6.0, (5, 1))) for f in (50.1, 150.3)]
    loud = [(values + two, rate) for (values, rate), two in zip(quiet, sum(mains), strict=True)]
    found = with_lines(noise_of(loud), loud)
    assert sorted(f for f, _ in found.lines) == pytest.approx([50.1, 150.3], abs=0.3)
    assert [variance for _, variance in found.lines] == pytest.approx([1.0, 1.0], rel=0.15)
    assert found.line == 0.0
    assert found.white * 0.5 * RATE == pytest.approx(1.0, rel=0.15)


def test_lines_are_found_whichever_rest_comes_first() -> None:
    """The frequencies of a short rest are far apart: a line between them was sought at the nearest, and left there."""
    random, pieces = np.random.default_rng(8), []
    for n in (256, 2784, 288, 2656, 160, 2464):
        times, phases = np.arange(n) / RATE, random.uniform(0.0, 6.0, 2)
        angles = [2.0 * np.pi * f * times + p for f, p in zip((50.1, 150.3), phases, strict=True)]
        mains = np.sqrt(2.0) * sum(map(np.sin, angles))
        pieces.append((random.standard_normal(n) + mains, RATE))
    for order in (pieces, pieces[::-1]):
        found = with_lines(noise_of(order), order)
        assert sorted(f for f, _ in found.lines) == pytest.approx([50.1, 150.3], abs=0.1)
        # What is left of a line that is missed would pass for slow noise, in which a drift is nothing.
        assert found.density(np.array([1.0]))[0] == pytest.approx(found.white, rel=0.5)


def test_what_is_too_short_for_a_line_says_nothing_of_it() -> None:
    random, pieces = np.random.default_rng(3), []
    for n in (2000, *[180] * 5):
        phase = random.uniform(0.0, 6.0)
        mains = np.sqrt(2.0) * np.sin(2.0 * np.pi * 50.0 * np.arange(n) / RATE + phase)
        pieces.append((0.1 * random.standard_normal(n) + mains, RATE))
    assert noise_of(pieces).line == pytest.approx(1.0, abs=0.02)
    assert noise_of(pieces[1:]).line == 0.0


@pytest.mark.parametrize("durations", [(20.0, 5.0), (5.0, 20.0), (20.0, 20.0), (5.0, 5.0)])
def test_hum_of_a_drive_is_an_error_of_it_in_each_record_however_long_the_others_are(
    durations: tuple[float, float],
) -> None:
    noise, each = Noise(1e-12, 0.0, 0.0, 1000, lines=((50.0, 1e-10),)), np.array(durations)
    numbers = half_periods(noise, each)
    for row, duration in zip(numbers, durations, strict=True):
        near = np.abs(0.5 * row / duration - 50.0) <= 1.0
        assert np.sum(amplitudes(noise, duration, row)[near] ** 2) / 2.0 == pytest.approx(1e-10, rel=0.2)


def test_lines_are_taken_off_and_a_level_and_what_is_beside_them_stay() -> None:
    random, times = np.random.default_rng(6), np.arange(701) / RATE
    noise = random.standard_normal(701)
    mains = np.sin(2.0 * np.pi * 50.1 * times + 0.3) + 0.5 * np.sin(2.0 * np.pi * 150.3 * times)
    left = without_lines(noise + 7.0 + mains, times, (50.1, 150.3))
    assert left.mean() == pytest.approx(7.0 + noise.mean() + mains.mean(), abs=0.01)
    # Of each line noise loses two numbers.
    assert np.std(left - 7.0 - noise) < np.sqrt(8.0 / 701.0)
    np.testing.assert_allclose(without_lines(noise, times, ()), noise)


@pytest.mark.parametrize(("seconds", "shown"), [(0.14, True), (0.07, False)])
def test_a_rest_of_less_than_five_periods_tells_no_line(seconds: float, shown: bool) -> None:
    count = round(1e4 * seconds)
    noise = 1e-3 * np.random.default_rng(0).standard_normal(count)
    values = noise + np.sin(2.0 * np.pi * 50.0 * np.arange(count) / 1e4)
    assert (noise_of([(values, 1e4)]).line > 0.4) == shown
