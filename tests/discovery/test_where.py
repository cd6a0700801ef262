"""Where a gap is said to lie: planted gaps are found and put into words, and noise of any colour is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from fibrefit.core.declarations import LOADING, PHASES, SLACK
from fibrefit.discovery.engine.thresholds import WRONGLY
from fibrefit.discovery.residuals.chance import loudest
from fibrefit.discovery.residuals.contacts import contacts, trend
from fibrefit.discovery.residuals.eigenvalues import autocorrelation
from fibrefit.discovery.residuals.residuals import channel_residuals
from fibrefit.discovery.residuals.spectrum import narrow_band, spectrum_of
from fibrefit.discovery.residuals.where import most_of, phase_shares, places
from fibrefit.fitting.result import Identification
from fibrefit.problem.diagnose.motion import ResidualSet
from fibrefit.problem.noise.readings import noise_of
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.report.sentences.discovery import discovery_sentence
from tests.discovery.left import BOUNCE, CHANNELS, COUNT, RATE, RECORDS, SIGMA, TAUT, noise_alone, of_colour, with_gap

SERIES = 100
#: Of a hundred series of noise one may get a place; three happen once in a hundred tests.
BY_CHANCE = 2
#: An exponential bound is wider than the exact quantile of a sum of squares, by no more than this.
WIDER = 1.25
QUIET = "No channel exceeds its noise level in any phase of the motion."

SAMPLE = np.arange(COUNT)
INTO = SAMPLE % BOUNCE - (BOUNCE - TAUT)
"""Samples since take-up."""
CONTACT = SAMPLE // BOUNCE


def in_words(found: ResidualSet) -> str:
    return discovery_sentence(most_of(found))


@pytest.mark.parametrize("pink", [0.0, 0.5])
def test_noise_has_no_places_and_no_words(pink: float) -> None:
    said = [(places(noise_alone(seed, pink)), in_words(noise_alone(seed, pink))) for seed in range(SERIES)]
    assert sum(bool(found) for found, _ in said) <= BY_CHANCE
    assert sum(words != QUIET for _, words in said) <= BY_CHANCE


@pytest.mark.parametrize("pink", [0.0, 0.5])
def test_nor_has_noise_that_is_known_from_short_rests_only(pink: float) -> None:
    random, wrong = np.random.default_rng(8), 0
    true = of_colour(pink)
    for seed in range(SERIES):
        told = noise_of([(true.draw(COUNT, RATE, random)[:200], RATE) for _ in range(RECORDS)])
        left = noise_alone(seed, pink)
        scaled = left.residuals * true.rms(COUNT / RATE, RATE) / told.rms(COUNT / RATE, RATE)
        wrong += bool(places(replace(left, residuals=scaled, noise=dict.fromkeys(CHANNELS, told))))
    assert wrong <= BY_CHANCE


def test_noise_that_is_pink_needs_the_colour_to_be_known() -> None:
    """Were the same noise taken for white, wander would be called a gap."""
    taken = [replace(noise_alone(seed, 0.5), noise=dict.fromkeys(CHANNELS, of_colour(0.0))) for seed in range(10)]
    assert sum(bool(places(left)) for left in taken) > 5


def test_a_limit_for_white_noise_is_a_little_above_that_of_chi_squared() -> None:
    for width in (20, 320):
        exact = chi2.isf(WRONGLY / 1000, width) / width
        assert exact < loudest(of_colour(0.0, 0), width, COUNT, RATE, 1000) < WIDER * exact


@pytest.mark.parametrize("width", [20, 100, 320])
def test_coloured_noise_is_rarely_beyond_a_limit_and_often_beyond_half_of_it(width: int) -> None:
    random, noise = np.random.default_rng(0), of_colour(0.5, 0)
    drawn = np.array([noise.draw(COUNT, RATE, random)[:width] / SIGMA for _ in range(4000)])
    powers = np.mean(drawn**2, axis=1)
    limit = loudest(noise, width, COUNT, RATE, 1)
    assert np.mean(powers > limit) < WRONGLY
    assert np.mean(powers > 0.5 * limit) > WRONGLY


@pytest.mark.parametrize("pink", [0.0, 0.5])
def test_a_burst_is_found_where_it_is(pink: float) -> None:
    burst = np.zeros((RECORDS, COUNT))
    burst[3, 800:840] = 8.0
    found = places(with_gap(noise_alone(1, pink), burst, channel=1))
    assert (found[0].record, found[0].channel, found[0].phase) == ("3.csv", "position", "slack")
    assert abs(found[0].from_s - 800 / RATE) <= 0.011
    assert abs(found[0].to_s - 839 / RATE) <= 0.011
    assert found[0].share > 0.8


def test_what_is_weak_is_found_where_it_lasts() -> None:
    weak = np.zeros((RECORDS, COUNT))
    weak[2, 640:1280] = np.sign(np.sin(0.3 * SAMPLE[640:1280]))
    found = places(with_gap(noise_alone(2), weak))
    assert {place.record for place in found} == {"2.csv"}
    assert sum(place.to_s - place.from_s for place in found) > 0.2


def test_shares_are_of_one_whole() -> None:
    left = with_gap(noise_alone(3, records=1), np.where((INTO >= 0) & (CONTACT < 4), 5.0, 0.0))
    assert sum(phase_shares(left).values()) == pytest.approx(1.0)
    assert 0.9 < sum(place.share for place in places(left)) <= 1.0


def test_a_gap_after_take_up_that_grows_with_speed_is_said_to() -> None:
    speed = 1.0 - 0.1 * CONTACT
    soon = np.where((INTO >= 0) & (INTO < 10), 12.0 * speed, 0.0)
    words = in_words(with_gap(noise_alone(4), soon))
    assert "of the gap lies in the force while taut, loading" in words
    assert "% of that in the first 4.5 ms after take-up" in words
    assert "it grows with the speed at take-up" in words
    assert len(words) < 200
    slow = with_gap(noise_alone(4), np.where((INTO >= 0) & (INTO < 10), 12.0 * (1.1 - speed), 0.0))
    assert "it shrinks with the speed at take-up" in in_words(slow)


def test_a_gap_all_through_the_contact_is_not_said_to_lie_at_its_beginning() -> None:
    words = in_words(with_gap(noise_alone(5), np.where(INTO >= 0, 5.0 * np.cos(1.3 * SAMPLE), 0.0)))
    assert "after take-up" not in words
    assert "speed" not in words


def test_gaps_of_any_size_depend_on_the_speed_once_in_a_hundred_times() -> None:
    said = 0
    for seed in range(SERIES):
        sizes = np.random.default_rng(seed).uniform(0.0, 6.0, size=(RECORDS, COUNT // BOUNCE))
        left = with_gap(noise_alone(seed), np.where(INTO >= 0, sizes[:, CONTACT], 0.0))
        listed = contacts(left, [piece for piece in channel_residuals(left) if piece.channel == 0])
        assert len(listed) == RECORDS * COUNT // BOUNCE
        said += trend(listed, LOADING, None) is not None
    assert said <= BY_CHANCE + 2


def test_five_contacts_show_nothing() -> None:
    left = with_gap(noise_alone(6, records=1), np.where(INTO >= 0, 12.0 * (1.0 - 0.1 * CONTACT), 0.0))
    listed = contacts(left, [piece for piece in channel_residuals(left) if piece.channel == 0])
    assert trend(listed, LOADING, None) == "grows"
    assert trend(listed[:5], LOADING, None) is None


def test_a_tone_is_said_to_lie_at_its_frequency() -> None:
    left = with_gap(noise_alone(7), np.where(INTO < 0, 3.0 * np.sin(2.0 * np.pi * 130.0 * SAMPLE / RATE), 0.0))
    own = [piece for piece in channel_residuals(left) if piece.channel == 0]
    band = narrow_band(spectrum_of(own), own[0].noise)
    assert band is not None
    low, high, share = band
    assert low < 130.0 < high < 1.3 * low
    assert share > 0.8
    assert f"lies between {low:.3g} and {high:.3g} Hz" in in_words(left)


@pytest.mark.parametrize(("known", "told"), [((), True), (((130.0, 1.0),), False)])
def test_of_a_line_that_noise_is_known_to_have_nothing_is_said(
    known: tuple[tuple[float, float], ...], told: bool
) -> None:
    left = with_gap(noise_alone(7), 3.0 * np.sin(2.0 * np.pi * 130.0 * SAMPLE / RATE))
    own = [piece for piece in channel_residuals(left) if piece.channel == 0]
    assert (narrow_band(spectrum_of(own), replace(own[0].noise, lines=known)) is not None) == told


@pytest.mark.parametrize("lines", [(), ((50.1, 0.5),), ((50.1, 0.3), (150.3, 0.2))])
def test_the_autocorrelation_of_noise_begins_with_its_whole_variance(lines: tuple[tuple[float, float], ...]) -> None:
    noise = Noise(white=1.0 / RATE, pink=0.0, line=0.0, samples=COUNT, lines=lines)
    found = autocorrelation(noise, COUNT, RATE)
    assert found[0] == pytest.approx(1.0, abs=2.0 / COUNT)
    whole = noise.rms(COUNT / RATE, RATE) ** 2
    turns = 2.0 * np.pi * np.arange(1, COUNT) / RATE
    expected = sum((share / whole * np.cos(line * turns) for line, share in lines), start=np.zeros(COUNT - 1))
    np.testing.assert_allclose(found[1:], expected, atol=2.0 / COUNT)


def test_a_hiss_lies_at_no_frequency() -> None:
    left = with_gap(noise_alone(8), 2.0 * np.random.default_rng(1).standard_normal(COUNT))
    own = [piece for piece in channel_residuals(left) if piece.channel == 0]
    assert narrow_band(spectrum_of(own), own[0].noise) is None


@pytest.mark.parametrize("pink", [0.0, 0.5])
def test_the_spectrum_of_noise_lies_on_its_floor(pink: float) -> None:
    own = [piece for piece in channel_residuals(noise_alone(9, pink, records=40)) if piece.channel == 0]
    found = spectrum_of(own)
    ratio = found.power / found.floor
    assert ratio.mean() == pytest.approx(1.0, abs=0.05)
    inside = (ratio > found.chance[0]) & (ratio < found.chance[1])
    assert inside.mean() == pytest.approx(0.95, abs=0.02)


def test_a_gap_that_belongs_to_a_moving_drive_is_said_to() -> None:
    left = noise_alone(10)
    driven = np.broadcast_to((CONTACT % 2 == 0)[None], left.motion.phase.shape)
    left = replace(left, motion=replace(left.motion, driven=driven))
    gap = with_gap(left, np.where((INTO < 0) & (CONTACT % 2 == 0), 3.0, 0.0))
    assert f"while {PHASES[SLACK]} and the drive moves" in in_words(gap)
    assert "drive" not in in_words(with_gap(left, np.where(INTO < 0, 3.0, 0.0)))


def test_an_identification_tells_what_it_left(task: object) -> None:
    from tests.discovery.made import identified

    found: Identification = identified(task, wrong=5.0)  # type: ignore[arg-type]
    assert found.residual_set.residuals is found.residuals
    assert in_words(found.residual_set)
    assert places(found.residual_set) != ()
