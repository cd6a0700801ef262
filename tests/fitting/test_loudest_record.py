"""A single record that leaves more than its noise, among many that do not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fibrefit.fitting import checks as judge
from fibrefit.fitting.residuals import loudest_record, scatter_of_noise
from fibrefit.fitting.result import record_sizes, total
from fibrefit.fitting.thresholds import LOUDER_THAN_AT_REST
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.report.sentences.fit import fit_sentence
from fibrefit.study.summaries.check import Check, status_by
from fibrefit.study.summaries.results import ChannelGap

RATE = 2000.0
WHITE = Noise(2.0 / RATE, 0.0, 0.0, 1000)
"""Of variance one."""


def slow(count: int) -> Noise:
    """Noise of variance one over a record of so many samples, half of its power 1/f."""
    return Noise(1.0 / RATE, 0.5 / np.log(0.5 * count), 0.0, 1000)


def residual_set(residuals: np.ndarray, noise: Noise) -> Any:
    """Residuals ``(n_record, n_time)`` of one channel, in units of a noise of one."""
    number, count = residuals.shape
    return SimpleNamespace(
        residuals=residuals[:, None],
        channels=("force",),
        noise={"force": noise},
        rests={},
        rate=RATE,
        rates=np.full(number, RATE),
        counts=np.full(number, count),
        sigma=np.ones((number, 1)),
        counted=np.ones((number, 1, count), dtype=bool),
    )


def gaps(residuals: np.ndarray) -> dict[str, dict[str, ChannelGap]]:
    sizes = np.sqrt(np.mean(residuals**2, axis=1))
    return {f"fall {r}.csv": {"force": ChannelGap.against_noise(1.0, float(size), "N")} for r, size in enumerate(sizes)}


def judged(residuals: np.ndarray, noise: Noise, expected: float = 1.0) -> Check:
    found = loudest_record(record_sizes(gaps(residuals)), residual_set(residuals, noise), expected)
    return judge.check("loudest_record", found)


def drawn(number: int, count: int, noise: Noise, seed: int) -> np.ndarray:
    random = np.random.default_rng(seed)
    return np.stack([noise.draw(count, RATE, random) for _ in range(number)])


@pytest.mark.parametrize(("number", "loud"), [(5, 1.4), (10, 1.75), (20, 2.25)])
def test_a_record_that_hides_among_equal_ones_is_named(number: int, loud: float) -> None:
    """Slow residuals, as a model leaves them: together all records leave no more than passes for noise."""
    residuals = drawn(number, 4000, WHITE, 1)
    # Residuals of a lost bounce last: third differences hardly see them.
    wave = np.sqrt(2.0 * (loud**2 - 1.0)) * np.sin(2.0 * np.pi * 7.0 * np.arange(4000) / RATE)
    residuals[3] += wave
    whole = {"force": ChannelGap.against_noise(1.0, float(np.sqrt(np.mean(residuals**2))), "N")}
    assert judge.check("residual_size", judge.gap_is_noise(whole)).passed
    check = judged(residuals, WHITE)
    assert not check.passed
    assert check.statistic == pytest.approx(loud, rel=0.1)
    says = fit_sentence(check)
    assert says.startswith('The residual RMS of "fall 3" is')
    assert f"at most {LOUDER_THAN_AT_REST:g} is expected of a single record" in says
    # It tells what the model leaves: no number is suspect, and no fit is lost.
    assert (check.about, check.fatal, status_by([check])) == ("model", False, "ok")


@pytest.mark.parametrize("colour", ["white", "slow"])
def test_none_of_many_short_sound_records_stands_out(colour: str) -> None:
    """The negative control: without an allowance for few samples and many records nearly each series has one."""
    noise = WHITE if colour == "white" else slow(30)
    series = [drawn(200, 30, noise, seed) for seed in range(20)]
    assert sum(not judged(one, noise).passed for one in series) == 0
    bare = [max(total(gap) for gap in gaps(one).values()) for one in series]
    assert sum(one > LOUDER_THAN_AT_REST for one in bare) >= 15


def test_a_short_record_is_seen_beside_long_ones() -> None:
    residuals = drawn(8, 4000, WHITE, 2)
    found = residual_set(residuals, WHITE)
    found.counts[5], found.counted[5, :, 400:] = 400, False
    sizes = dict.fromkeys(map(str, range(8)), 1.0) | {"5": 1.6}
    loudest = loudest_record(sizes, found, 1.0)
    assert (loudest.passed, loudest.facts["record"]) == (False, "5")
    assert loudest_record(sizes | {"5": 1.2}, found, 1.0).passed


def test_noise_that_is_louder_at_all_frequencies_is_noise() -> None:
    residuals = drawn(6, 4000, WHITE, 3)
    residuals[2] *= 1.45
    assert judged(residuals, WHITE).passed
    # Beyond what noise in motion may be it is not.
    assert not judged(2.0 / 1.45 * residuals, WHITE).passed


def test_what_is_expected_counts_and_one_record_is_judged_by_the_gap() -> None:
    residuals = drawn(5, 4000, WHITE, 4)
    assert not judged(residuals, WHITE, expected=0.7).passed
    alone: Any = SimpleNamespace(seen=SimpleNamespace(record_gaps={"a": {}}), outcomes={})
    assert judge.checks_of(alone, [row for row in judge.CHECKS if row.identifier == "loudest_record"]) == ()
    lost = judge.check(
        "loudest_record", loudest_record({"a": 1.0, "b": np.nan}, residual_set(residuals[:2], WHITE), 1.0)
    )
    assert not lost.passed
    assert '"b" is not known' in fit_sentence(lost)


@pytest.mark.parametrize("count", [60, 1000])
def test_the_scatter_of_a_mean_square_is_that_of_many_draws(count: int) -> None:
    for noise in (WHITE, slow(count)):
        powers = np.mean(drawn(4000, count, noise, 5) ** 2, axis=1)
        found = scatter_of_noise(noise, count, RATE, count)
        assert np.sqrt(found) == pytest.approx(powers.std() / powers.mean(), rel=0.1)
    assert scatter_of_noise(WHITE, count, RATE, count) == pytest.approx(2.0 / count, rel=0.05)
