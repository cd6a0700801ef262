"""Spectra of residuals by Whittle's likelihood: what was put in is found, and white noise is bare."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.problem.estimate.gls import scattered
from fibrefit.problem.noise.coloured import bank_for
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.noise.whittle import (
    STEPS,
    _Bands,
    _nearest,
    noise_of_residuals,
    noise_of_signals,
    periodograms,
    sample_mask,
    whitening_of,
)
from fibrefit.sampling.density.filters import Autoregressive
from tests.problem.coefficients import (
    CORNER,
    COUNT,
    KINDS,
    RATE,
    RECORDS,
    STRANGE,
    TONES,
    UNIT,
    first_order,
    first_order_noise,
    line_on_pink,
    masked,
    pink_noise,
    records,
    tone,
    two_lines,
    white,
)

SERIES = 8
"""Of five records each, over which what is found is averaged."""
LEVEL = 0.06
"""Share by which a white level may be off: five thousand ordinates, and what goes to the fastest of the first-order
parts, which is nearly white."""
RISE = 0.12
"""The same at a few Hz, where there are few ordinates and no part of the noise can be less than zero."""
SLOW = 0.25
"""The same of the slow noise, of which a record has some ten ordinates an octave at most."""
TELL = 0.05
"""Part of the spacing of ordinates by which the frequency of a line may be off."""
LINE = 0.1
"""Share by which its variance may be off."""
SURE = 4.0
"""Standard errors of a correlation by chance: once in sixteen thousand; forty or so are looked at."""
SQUARE = 0.03
"""Share by which the mean square of innovations may be off one, five times two thousand of them having two percent."""
LEAKING = 0.05
"""The same, and for correlations, where samples are lost: fewer are left."""


def noise_of(drawn: np.ndarray, valid: np.ndarray | None = None) -> Noise:
    valid = np.ones(drawn.shape, dtype=bool) if valid is None else valid
    (found,) = noise_of_residuals(records(valid), np.where(valid, drawn, 1e3)[None, :, None])
    return found.scaled(1.0 / UNIT)


def found_in(kind: str, holes: bool = False) -> list[Noise]:
    return [
        noise_of(KINDS[kind](random), masked(random) if holes else None)
        for random in (np.random.default_rng([seed, 1]) for seed in range(SERIES))
    ]


@pytest.mark.parametrize("holes", [False, True])
def test_white_noise_is_white(holes: bool) -> None:
    frequency = np.geomspace(3.0, 0.5 * RATE, 60)
    density = np.mean([found.density(frequency) for found in found_in("white", holes)], axis=0) * 0.5 * RATE
    np.testing.assert_allclose(density[frequency > 100.0], 1.0, rtol=LEVEL)
    np.testing.assert_allclose(density, 1.0, rtol=RISE)


def test_white_noise_has_no_line_and_no_slow_part_of_weight() -> None:
    """The negative control: nothing is found where nothing is, in forty series."""
    for seed in range(40):
        found = noise_of(white(np.random.default_rng([seed, 2])))
        assert found.lines == ()
        assert sum(variance for corner, variance in found.slow if corner < 100.0) < 0.03


def test_the_simplest_spectrum_that_will_do_is_taken() -> None:
    """1/f noise is told by one number, and so is what a record of its length does not show of it."""
    for found in found_in("white"):
        assert (found.slow, found.pink) == ((), 0.0)
    pink = found_in("1/f")
    assert [noise.slow for noise in pink] == [()] * SERIES
    np.testing.assert_allclose([noise.pink for noise in pink], 1.0 / np.log(0.5 * COUNT), rtol=SLOW)
    for found in found_in("first order"):
        assert found.pink == 0.0
        assert len(found.slow) == 2
        assert found.slow[0][0] < CORNER < found.slow[1][0]


def test_what_is_neither_is_told_by_parts_of_all_corners() -> None:
    """Two first-order parts far from each other: no simple spectrum will do, and none is forced on them."""
    for seed in range(SERIES):
        random = np.random.default_rng([seed, 7])
        found = noise_of(2.0 * first_order(random, 2.0) + 0.5 * first_order(random, 120.0) + 0.1 * white(random))
        density = 4.0 * lorentz(2.0, 60.0) + 0.25 * lorentz(120.0, 60.0) + 0.01 / (0.5 * RATE)
        assert found.density(np.array([60.0]))[0] == pytest.approx(density, rel=2.0 * SLOW)


def lorentz(corner: float, frequency: float) -> float:
    return (2.0 / np.pi) * corner / (corner**2 + frequency**2)


@pytest.mark.parametrize("holes", [False, True])
def test_pink_noise_is_found(holes: bool) -> None:
    frequency = np.geomspace(4.0, 100.0, 20)
    densities = np.array([found.density(frequency) for found in found_in("1/f", holes)])
    # Variance one between one period of a record and half the rate, and the white noise.
    truth = 1.0 / np.log(0.5 * COUNT) / frequency + 0.09 / (0.5 * RATE)
    np.testing.assert_allclose(densities.mean(axis=0), truth, rtol=SLOW)


@pytest.mark.parametrize("holes", [False, True])
def test_a_first_order_part_is_found(holes: bool) -> None:
    frequency = np.geomspace(3.0, 80.0, 20)
    found = found_in("first order", holes)
    densities = np.mean([noise.density(frequency) for noise in found], axis=0)
    truth = (2.0 / np.pi) * CORNER / (CORNER**2 + frequency**2) + 0.25 / (0.5 * RATE)
    np.testing.assert_allclose(densities, truth, rtol=SLOW)
    total = np.mean([sum(variance for _, variance in noise.slow) for noise in found])
    assert total == pytest.approx(1.0, rel=SLOW)
    assert np.mean([noise.white for noise in found]) * 0.5 * RATE == pytest.approx(0.25, rel=2.0 * LEVEL)


@pytest.mark.parametrize("holes", [False, True])
@pytest.mark.parametrize(
    ("kind", "truth"), [("two lines", {TONES[0]: 0.25, TONES[1]: 0.09}), ("a line on 1/f", {STRANGE: 0.25})]
)
def test_lines_are_found_where_they_are(kind: str, truth: dict[float, float], holes: bool) -> None:
    for found in found_in(kind, holes):
        assert len(found.lines) == len(truth)
        for (frequency, _), true in zip(sorted(found.lines), sorted(truth), strict=True):
            assert abs(frequency - true) < TELL * RATE / COUNT
    means = np.mean([[variance for _, variance in sorted(found.lines)] for found in found_in(kind, holes)], axis=0)
    np.testing.assert_allclose(means, [truth[line] for line in sorted(truth)], rtol=LINE)


def test_a_line_leaves_nothing_to_the_rest_of_the_spectrum() -> None:
    """A line as strong as the noise: what the ends of a record spread of it is neither slow noise nor another line."""
    for seed in range(SERIES):
        random = np.random.default_rng([seed, 3])
        found = noise_of(white(random) + 1.4 * tone(random, STRANGE))
        assert len(found.lines) == 1
        assert (found.slow, found.pink) == ((), 0.0)
        assert found.white * 0.5 * RATE == pytest.approx(1.0, rel=LEVEL)


def test_lines_are_not_looked_for_where_they_are_not_wanted() -> None:
    drawn, times = two_lines(np.random.default_rng(0)), np.tile(np.arange(COUNT) / RATE, (RECORDS, 1))
    assert noise_of(drawn).lines
    assert noise_of_signals(drawn[None], times, np.full(RECORDS, COUNT)).lines == ()


def test_what_a_rig_does_slowly_is_no_line() -> None:
    random = np.random.default_rng(1)
    assert noise_of(white(random) + tone(random, 12.0)).lines == ()


@pytest.mark.parametrize("holes", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_innovations_are_white_with_unit_variance(kind: str, holes: bool) -> None:
    for seed in range(3):
        random = np.random.default_rng([seed, 3])
        valid = masked(random) if holes else np.ones((RECORDS, COUNT), dtype=bool)
        fresh = innovations(KINDS[kind](random), valid)
        assert np.all(fresh[~valid] == 0.0)
        assert np.mean(fresh[valid] ** 2) == pytest.approx(1.0, abs=LEAKING if holes else SQUARE)
        for lag in (1, 2, 5, 20, 100):
            pairs = np.sum(valid[:, lag:] & valid[:, :-lag])
            assert abs(correlation(fresh, valid, lag)) < (LEAKING * np.sqrt(pairs) if holes else SURE)


def innovations(drawn: np.ndarray, valid: np.ndarray, noise: Noise | None = None) -> np.ndarray:
    problem = records(valid)
    found = noise_of_residuals(problem, drawn[None, :, None]) if noise is None else (noise,)
    return np.asarray(whitening_of(problem, found).whiten(jnp.asarray(drawn[:, None])))[:, 0]


def correlation(fresh: np.ndarray, valid: np.ndarray, lag: int) -> float:
    """Of samples so far apart, in its standard errors."""
    pairs = np.sum(valid[:, lag:] & valid[:, :-lag])
    return float(np.sum(fresh[:, lag:] * fresh[:, :-lag]) / np.sqrt(pairs))


def test_innovations_of_the_wrong_noise_are_not_white() -> None:
    """The negative control: pink noise and lines that are taken for white noise leave their memory."""
    valid, white_alone = np.ones((RECORDS, COUNT), dtype=bool), Noise(UNIT**2 / (0.5 * RATE), 0.0, 0.0, 1000)
    for make in (pink_noise, first_order_noise, two_lines, line_on_pink):
        fresh = innovations(make(np.random.default_rng(4)), valid, white_alone)
        assert max(abs(correlation(fresh, valid, lag)) for lag in (1, 2, 5, 20)) > 2.0 * SURE


def test_the_expected_periodogram_is_that_of_many_draws() -> None:
    random = np.random.default_rng(5)
    valid = masked(random)
    counts = np.full(RECORDS, COUNT)
    bank = bank_for(*map(np.asarray, records(valid).observations.experiment[:2]))
    draws = np.where(valid, np.array([first_order_noise(random) for _ in range(60)]), 0.0)
    found = periodograms(draws, valid, counts, bank)
    weights = found.bands.simplest()
    assert np.all(weights >= 0.0)
    share = found.power / (found.expected @ weights)
    # Sixty draws of five records: an ordinate is known to thirteen percent, a tenth of the band to one.
    for part in np.array_split(np.argsort(found.frequency), 10):
        assert share[part].mean() == pytest.approx(1.0, abs=0.05)


def test_several_draws_of_what_is_not_known_are_averaged() -> None:
    random = np.random.default_rng(6)
    drawn = np.stack([white(random), 3.0 * white(random)])
    (found,) = noise_of_residuals(records(np.ones((RECORDS, COUNT), dtype=bool)), drawn[:, :, None])
    assert found.rms(COUNT / RATE, RATE) == pytest.approx(UNIT * np.sqrt(5.0), rel=0.03)


def test_samples_that_hardly_weigh_do_not_count() -> None:
    problem = records(np.ones((2, 100), dtype=bool))
    weight = problem.observations.weight["force"]
    weight[0, :50] *= 0.2
    weight[1, :50] *= 0.4
    mask = sample_mask(problem)
    assert mask.shape == (2, 1, 100)
    assert mask[0, 0].tolist() == [False] * 50 + [True] * 50
    assert mask[1].all()
    weight[1] = 0.0
    assert not sample_mask(problem)[1].any()


def test_a_record_that_ends_earlier_tells_as_much_as_it_has() -> None:
    random = np.random.default_rng(7)
    valid = np.ones((RECORDS, COUNT), dtype=bool)
    counts = np.array([COUNT, COUNT, 1200, 1500, 900])
    for r, count in enumerate(counts):
        valid[r, count:] = False
    drawn = np.where(valid, two_lines(random), 0.0)
    (found,) = noise_of_residuals(records(valid, counts), drawn[None, :, None])
    found = found.scaled(1.0 / UNIT)
    assert [round(frequency) for frequency, _ in sorted(found.lines)] == [50, 150]
    assert found.white * 0.5 * RATE == pytest.approx(1.0, rel=LEVEL)


def test_where_there_is_nothing_to_tell_a_unit_is_taken() -> None:
    valid = np.ones((RECORDS, COUNT), dtype=bool)
    assert noise_of(np.zeros((RECORDS, COUNT))).samples == 0
    (found,) = noise_of_residuals(records(~valid), white(np.random.default_rng(0))[None, :, None])
    assert (found.samples, found.slow, found.lines) == (0, (), ())


def test_a_channel_that_a_record_lost_does_not_hinder_the_lines_of_the_others() -> None:
    valid = np.ones((RECORDS, COUNT), dtype=bool)
    valid[2] = False
    found = noise_of(two_lines(np.random.default_rng(8)), valid)
    assert [round(frequency) for frequency, _ in sorted(found.lines)] == [50, 150]


@pytest.mark.parametrize("count", [40, 57])
def test_the_variance_of_products_with_noise_is_that_of_its_whole_covariance(count: int) -> None:
    valid, random = np.ones((2, 2, count), dtype=bool), np.random.default_rng(8)
    valid[0, 1, 5:9] = False
    whitening = Autoregressive.of([np.array([1.0, 0.6, 0.5]), np.array([2.0, -0.9])], valid)
    slopes = np.where(valid[..., None], random.standard_normal((2, 2, count, 3)), 0.0)
    level, apart = np.array([1.5, 0.5]), np.abs(np.arange(count)[:, None] - np.arange(count))
    covariance = whitening.autocovariance(count)[..., apart] * level[:, None, None] ** 2
    whole = np.einsum("rcti,rcts,rcsj->rij", slopes, covariance, slopes)
    np.testing.assert_allclose(scattered(slopes, whitening, level), whole, rtol=1e-9, atol=1e-9 * np.abs(whole).max())


def test_steps_of_some_parts_are_those_of_all_with_the_others_at_nothing() -> None:
    random = np.random.default_rng(0)
    expected, number = random.uniform(0.1, 1.0, (50, 6)), np.ceil(random.uniform(0.0, 20.0, 50))
    bands = _Bands(expected @ random.uniform(0.0, 1.0, 6) * random.exponential(1.0, 50), expected, number)
    parts = [np.array([5]), np.array([4, 5]), np.array([1, 2, 5])]
    for some, weights in zip(parts, bands.fitted(parts), strict=True):
        plain = np.zeros(6)
        plain[some] = 0.1 * np.average(bands.power, weights=number) / expected.mean(axis=0)[some]
        for _ in range(STEPS):
            share = number / (expected @ plain)
            plain = plain * ((share * bands.power / (expected @ plain)) @ expected) / (share @ expected)
        np.testing.assert_allclose(weights, plain, rtol=1e-9)
        assert not np.delete(weights, some).any()


@pytest.mark.parametrize("rates", [(1000.0, 4000.0), (4000.0, 1000.0)])
def test_records_at_several_rates_have_the_density_of_white_noise_in_common(rates: tuple[float, float]) -> None:
    """A faster logger's noise of the same density has a larger variance, and no more of it at any frequency."""
    random, density, seconds = np.random.default_rng(3), 2e-3, 2.0
    counts = np.array([round(rate * seconds) for rate in rates])
    times, values = np.zeros((2, counts.max())), np.zeros((2, counts.max()))
    for row, at, rate, count in zip(values, times, rates, counts, strict=True):
        row[:count] = np.sqrt(0.5 * density * rate) * random.standard_normal(count)
        at[:] = np.arange(counts.max()) / rate
    noise = noise_of_signals(values[None], times, counts)
    assert noise.white == pytest.approx(density, rel=LEVEL)
    assert noise.density(np.array([30.0]))[0] == pytest.approx(density, rel=SLOW)


def test_the_nearest_ordinate_may_be_the_one_before() -> None:
    places = _nearest(np.array([1.0, 2.0, 3.5]), np.array([0.2, 1.4, 1.6, 2.7, 2.8, 9.0]))
    assert places.tolist() == [0, 0, 1, 1, 2, 2]
    assert _nearest(np.array([1.0]), np.array([0.5, 7.0])).tolist() == [0, 0]
