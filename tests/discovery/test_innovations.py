"""Tests of innovations: silent where nothing is missing, loud where a parameter steps or slow noise is new."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.stats import gamma, kstest

from fibrefit.core.declarations import Statement
from fibrefit.discovery import conclusion
from fibrefit.discovery.engine.supermodel import STRETCHES
from fibrefit.discovery.engine.thresholds import ALARM, CONTRADICTED
from fibrefit.discovery.level_shifts import LevelShift
from fibrefit.discovery.residuals import innovations
from fibrefit.discovery.residuals.innovations import (
    FEWEST_ORDINATES,
    Alarm,
    _drifts,
    _freedom,
    _gain,
    _in_stretches,
    _levelled,
    _Scores,
    _windows,
    against_rest,
)
from fibrefit.discovery.search import setup
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.report.sentences.discovery import discovery_sentence
from fibrefit.rigs.signals.rest import rests
from fibrefit.rigs.signals.trace import Trace
from tests.problem.test_noise import RATE, trace

NAMES = ("stiffness", "damping", "friction")
RECORDS, SAMPLES = 5, 30
"""Samples of a stretch."""
NULLS = 400
UNIFORM = 1e-3
"""Probability of a Kolmogorov-Smirnov statistic that is not taken for chance."""


def slopes_of(random: np.random.Generator, contacts: bool = True) -> np.ndarray:
    """Whitened slopes ``(n_record, n_stretch, n_sample, p)`` of a motion that dies down, in contact now and then."""
    found = random.standard_normal((RECORDS, STRETCHES, SAMPLES, len(NAMES)))
    found = np.cumsum(found, axis=2) * np.exp(-np.linspace(0.0, 2.0, STRETCHES))[:, None, None]
    found = found * np.array([1e3, 20.0, 3.0])
    if contacts:
        taut = np.arange(STRETCHES) % 4 == 0
        found[:, ~taut, :, :2] = 0.0
    return found


def scores_of(slopes: np.ndarray, innovations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Information and scores of each stretch."""
    return np.einsum("rstp,rstq->rspq", slopes, slopes), np.einsum("rstp,rst->rsp", slopes, innovations)


def drawn(seed: int, step: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """White innovations, with a change of the parameters ``(n_record, n_stretch, p)`` in units of their errors."""
    random = np.random.default_rng(seed)
    slopes = slopes_of(random)
    innovations = random.standard_normal(slopes.shape[:3])
    if step is not None:
        errors = np.sum(slopes**2, axis=(1, 2)) ** -0.5
        innovations = innovations + np.einsum("rstp,rsp->rst", slopes, step * errors[:, None])
    return scores_of(slopes, innovations)


KNOWN = 1e9
"""Degrees of freedom of noise whose size is known."""


def constancy(information: np.ndarray, score: np.ndarray, freedom: float = KNOWN) -> Alarm:
    return _windows(_Scores(information, score, np.full(len(score), freedom)))


def drift(information: np.ndarray, score: np.ndarray, freedom: float = KNOWN) -> Alarm:
    return _drifts(_Scores(information, score, np.full(len(score), freedom)), NAMES)


BOTH = [constancy, drift]


def levelled(slopes: np.ndarray, innovations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Information and levelled scores of each stretch."""
    information, score = scores_of(slopes, innovations)
    single = slopes * innovations[..., None]
    pairs = zip(information.sum(axis=1), np.einsum("rstp,rstq->rpq", single, single), strict=True)
    return information, np.einsum("rpq,rsq->rsp", np.array([_levelled(*pair) for pair in pairs]), score)


def test_scores_are_levelled_to_the_variance_that_the_information_says() -> None:
    random = np.random.default_rng(3)
    slopes = random.standard_normal((500, 3)) @ random.standard_normal((3, 3)) * np.array([1e6, 1.0, 1e-3])
    scores = slopes * (random.standard_normal(500) * np.where(np.arange(500) % 3, 0.2, 2.0))[:, None]
    information, squares = slopes.T @ slopes, scores.T @ scores
    way = _levelled(information, squares)
    np.testing.assert_allclose(way @ squares @ way.T, information, rtol=1e-6)
    # Noise of one level is one factor, and none at all changes nothing.
    np.testing.assert_allclose(_levelled(information, 0.25 * information), 2.0 * np.eye(3), atol=1e-6)
    np.testing.assert_array_equal(_levelled(information, 0.0 * information), np.eye(3))


@pytest.mark.parametrize("test", BOTH)
def test_readings_that_say_most_and_are_quieter_than_taken_do_not_make_the_others_loud(test: Any) -> None:
    """Slopes that explode in a part of a motion, along one direction, by readings that count for little."""
    random = np.random.default_rng(4)
    slopes = slopes_of(random, contacts=False)
    wild = np.abs(np.arange(STRETCHES) - STRETCHES // 2) < 2
    slopes[:, wild] += 30.0 * random.standard_normal((RECORDS, 3, SAMPLES, 1)) * np.array([1e3, 20.0, 3.0])
    innovations = random.standard_normal(slopes.shape[:3])
    innovations[:, wild] *= 0.05
    assert not test(*levelled(slopes, innovations)).raised
    # The negative control: one factor for each parameter is that of the readings which say most of it.
    information, score = scores_of(slopes, innovations)
    squares = np.einsum("rstp,rst->rp", slopes**2, innovations**2)
    level = np.sqrt(squares / np.einsum("rspp->rp", information))
    assert constancy(information, score / level[:, None]).raised


def rows_of(seed: int, records: int, samples: int, heavy: bool) -> np.ndarray:
    """Innovations, and slopes that act in a burst each, ``(n_record, 4, n_sample)``; heavy ones are of Student's t4."""
    random, moment = np.random.default_rng(seed), np.arange(samples) / samples
    bursts = [np.exp(-(((moment - k / 4.0) / 0.12) ** 2)) * np.sin(44.0 * moment + k) for k in (1, 2, 3)]
    shape = (records, 1, samples)
    left = random.standard_t(4, shape) / np.sqrt(2.0) if heavy else random.standard_normal(shape)
    return np.concatenate([left, np.broadcast_to(bursts, (records, 3, samples))], axis=1)


def with_known_size(scores: _Scores) -> _Scores:
    return scores._replace(freedom=np.full(len(scores.freedom), KNOWN))


@pytest.mark.parametrize(
    ("records", "samples", "heavy"), [(1, 30, False), (5, 30, False), (5, 100, True), (5, 300, True), (1, 1000, True)]
)
def test_noise_of_few_readings_or_with_heavy_tails_raises_no_alarm(records: int, samples: int, heavy: bool) -> None:
    drawn_scores = [_in_stretches(rows_of(seed, records, samples, heavy), 1) for seed in range(120)]
    for test in (_windows, lambda scores: _drifts(scores, NAMES)):
        assert np.mean([test(scores).probability < 1e-2 for scores in drawn_scores]) < 0.03
        assert not any(test(scores).raised for scores in drawn_scores)
    # The negative control: the size of the scores is taken for known though these very readings tell it.
    if samples <= 100:
        known = [_drifts(with_known_size(scores), NAMES).probability for scores in drawn_scores]
        assert np.mean(np.array(known) < 1e-2) > 0.03


@pytest.mark.parametrize("heavy", [False, True])
def test_on_thousands_of_readings_a_change_is_seen_as_if_the_size_of_noise_were_known(heavy: bool) -> None:
    rows = rows_of(0, 5, 6400, heavy)
    error = np.sum(rows[0, 1] ** 2) ** -0.5
    first = np.arange(6400) < 1600
    logs = []
    for step in (4.0, 6.0, 8.0):
        changed = rows.copy()
        changed[:, 0] += step * error * np.where(first, -1.0, 1.0) * rows[:, 1]
        scores = _in_stretches(changed, 1)
        found, known = _windows(scores), _windows(with_known_size(scores))
        logs.append(np.log(found.probability) / np.log(known.probability))
        assert found.raised == known.raised
    assert min(logs) > (0.7 if heavy else 0.85)
    assert found.raised


def test_scores_in_stretches_are_sums_over_their_readings() -> None:
    random = np.random.default_rng(5)
    rows = random.standard_normal((2, 4, 2 * 150))
    scores = _in_stretches(rows, 2)
    size = -(-150 // STRETCHES)
    first = rows.reshape(2, 4, 2, 150)[..., :size].reshape(2, 4, -1)
    np.testing.assert_allclose(scores.information[:, 0], first[:, 1:] @ np.swapaxes(first[:, 1:], 1, 2))
    np.testing.assert_allclose(scores.information.sum(axis=1), rows[:, 1:] @ np.swapaxes(rows[:, 1:], 1, 2))
    # All readings alike: half of Satterthwaite's number; one that holds nearly all: hardly any.
    one = np.where(np.arange(300) % 2, 1.0, -1.0)[None]
    assert _freedom(one) == pytest.approx(300.0)
    assert _freedom(np.where(np.arange(300) == 7, 1e3, one)) == pytest.approx(1.0, rel=1e-3)
    assert _freedom(np.full((1, 3), np.nan)) == _freedom(np.zeros((1, 3))) == 0.0


@pytest.mark.parametrize("test", BOTH)
def test_white_innovations_give_any_probability_alike(test: Any) -> None:
    found = [test(*drawn(seed)).probability for seed in range(NULLS)]
    assert kstest(found, "uniform").pvalue > UNIFORM
    assert min(found) > ALARM


@pytest.mark.parametrize("test", BOTH)
def test_values_that_were_fitted_to_each_record_change_nothing(test: Any) -> None:
    """A value that is wrong all through a record is no change within it."""
    wrong = np.zeros((RECORDS, STRETCHES, len(NAMES)))
    wrong += 20.0 * np.random.default_rng(1).standard_normal((RECORDS, 1, len(NAMES)))
    for seed in range(5):
        assert test(*drawn(seed, wrong)).probability == pytest.approx(test(*drawn(seed)).probability, rel=1e-6)


def stepping(signs: np.ndarray, parameter: int, size: float = 16.0) -> np.ndarray:
    """One parameter that steps in the middle of each record, in standard errors of its value in that record."""
    step = np.zeros((RECORDS, STRETCHES, len(NAMES)))
    step[:, STRETCHES // 8 :, parameter] = size * signs[:, None]
    return step


@pytest.mark.parametrize("parameter", range(3))
@pytest.mark.parametrize("test", BOTH)
def test_a_parameter_that_steps_raises_an_alarm(test: Any, parameter: int) -> None:
    found = [test(*drawn(seed, stepping(np.ones(RECORDS), parameter))) for seed in range(10)]
    assert all(alarm.raised for alarm in found)
    if test is drift:
        assert all(f"Slow changes of {NAMES[parameter]} and" in discovery_sentence(alarm.statement) for alarm in found)


def test_steps_that_differ_from_record_to_record_are_no_drift() -> None:
    """The negative control of what is alike in all records: windows see it, a common drift hardly does."""
    signs = np.array([1.0, -1.0, 1.0, -1.0, 0.0])
    seen = [[test(*drawn(seed, stepping(signs, 0))).probability for test in BOTH] for seed in range(10)]
    windows, common = np.array(seen).T
    assert np.all(windows < ALARM)
    assert np.median(common / windows) > 1e3


def test_a_step_within_its_error_is_no_alarm() -> None:
    for test in BOTH:
        assert not any(test(*drawn(seed, stepping(np.ones(RECORDS), 0, 0.5))).raised for seed in range(20))


@pytest.mark.parametrize("test", BOTH)
def test_units_of_the_parameters_do_not_matter(test: Any) -> None:
    information, score = drawn(3)
    unit = np.array([1e6, 1e-3, 1.0])
    other = test(information * unit[:, None] * unit, score * unit).probability
    assert other == pytest.approx(test(information, score).probability, rel=1e-6)


@pytest.mark.parametrize("test", BOTH)
def test_what_no_record_sees_is_not_tested(test: Any) -> None:
    information, score = drawn(4)
    nothing = test(np.zeros_like(information), np.zeros_like(score))
    assert nothing.probability == 1.0
    assert not nothing.raised
    information[..., 1, :] = information[..., :, 1] = score[..., 1] = 0.0
    assert np.isfinite(test(information, score).probability)


SERIES = 40


def resting(seed: int, share: float = 0.5, grain: float = 0.0) -> list[Trace]:
    """Five records that rest, move, and rest again; their noise has variance one, a share of its rms pink."""
    random = np.random.default_rng([seed, 9])
    return [trace(random, share, 0.0, grain) for _ in range(5)]


def pink(share: float) -> Noise:
    """The noise of `resting`."""
    return Noise((1.0 - share**2) / (0.5 * RATE), share**2 / (np.log(2400) + 0.577), 0.0, 1000)


def probability(traces: list[Trace], noise: Noise) -> float:
    found = against_rest(traces, "force", noise)
    assert found is not None
    return found.probability


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_noise_that_is_the_same_at_rest_passes(share: float) -> None:
    found = np.array([probability(resting(seed, share), pink(share)) for seed in range(SERIES)])
    assert found.min() > CONTRADICTED
    # Half of them below a half, within what forty series tell; rests that are short leak a little from below.
    assert 0.2 < np.mean(found < 0.5) < 0.8


def test_a_few_masked_readings_do_not_end_a_rest() -> None:
    """What was said without them is said: slow noise that is not there at rest, and noise that is."""
    noise = pink(0.5)
    louder = Noise(noise.white, noise.pink, 0.0, 1000, slow=((4.0, 1.0), (15.0, 1.0)))
    whole = resting(3, 0.5)
    masked = [one._replace(channels={"force": one.channels["force"].copy()}) for one in whole]
    for one in masked:
        one.channels["force"][7::97] = np.nan
    for held, raised in ((louder, True), (noise, False)):
        found = [against_rest(traces, "force", held) for traces in (whole, masked)]
        assert [alarm is not None and alarm.raised for alarm in found] == [raised, raised]


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_slow_noise_that_rests_do_not_show_raises_an_alarm(share: float) -> None:
    noise = pink(share)
    louder = Noise(noise.white, noise.pink, 0.0, 1000, slow=((4.0, 1.0), (15.0, 1.0)))
    found = [against_rest(resting(seed, share), "force", louder) for seed in range(10)]
    assert all(alarm is not None and alarm.raised for alarm in found)
    assert found[0] is not None
    assert discovery_sentence(found[0].statement).startswith("Below 40 Hz the force holds ")
    # The negative control: as much noise above is no slow noise.
    hiss = Noise(3.0 * noise.white, 3.0 * noise.pink, 0.0, 1000)
    assert all(probability(resting(seed, share), hiss) > CONTRADICTED for seed in range(10))


def at_rest(monkeypatch: pytest.MonkeyPatch, rate: float, samples: int, number: int = 1) -> tuple[list[Trace], Noise]:
    """White noise of records that rest all the time, and the noise that a right model leaves of them."""
    monkeypatch.setattr(innovations, "rests", lambda trace: [slice(0, samples)])
    random, times = np.random.default_rng(0), np.arange(samples) / rate
    drawn = [Trace("rest", times, {"force": random.standard_normal(samples)}, {}, {}) for _ in range(number)]
    return drawn, Noise(2.0 / rate, 0.0, 0.0, samples)


def test_fast_noise_that_few_ordinates_tell_is_not_taken_for_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 250 Hz 100 readings of rest hold nine ordinates above 100 Hz and fifteen below 40 Hz."""
    traces, noise = at_rest(monkeypatch, 250.0, 100, 2000)
    alarms = [alarm for one in traces if (alarm := against_rest([one], "force", noise)) is not None]
    found = np.array([alarm.probability for alarm in alarms])
    assert len(found) > 1900
    assert kstest(found, "uniform").pvalue > UNIFORM
    # The negative control: with the mean of the fast ones taken for known, one in twenty is below a hundredth.
    shares = np.array([1.0 / cast(float, alarm.facts["times"]) for alarm in alarms])
    assert np.mean(gamma.cdf(15.0 * shares, 15) < 0.01) > 0.03


@pytest.mark.parametrize(("rate", "samples", "asked"), [(205.0, 200, False), (1000.0, 200, False), (250.0, 100, True)])
def test_rests_with_few_ordinates_on_either_side_are_not_asked(
    monkeypatch: pytest.MonkeyPatch, rate: float, samples: int, asked: bool
) -> None:
    """Two fast ones in the first, seven slow ones in the second."""
    traces, noise = at_rest(monkeypatch, rate, samples)
    assert (against_rest(traces, "force", noise) is not None) == asked


def test_of_a_long_rest_at_2_khz_the_number_of_fast_ordinates_hardly_matters(monkeypatch: pytest.MonkeyPatch) -> None:
    traces, noise = at_rest(monkeypatch, 2000.0, 4000)
    for times in (1.0, 2.0, 3.0):
        louder = Noise(noise.white, 0.0, 0.0, 4000, slow=((40.0, 1e4 * (times - 1.0) * noise.white),))
        alarm = against_rest(traces, "force", louder)
        assert alarm is not None
        known = float(gamma.cdf(79.0 / cast(float, alarm.facts["times"]), 79))
        assert alarm.raised == (known < CONTRADICTED)
        assert np.log(alarm.probability) == pytest.approx(np.log(known), rel=0.1, abs=0.1)


def test_where_a_logger_shows_its_steps_nothing_is_told() -> None:
    traces = resting(0, 0.0)
    quiet = [one._replace(channels={"force": 0.1 * one.channels["force"]}) for one in traces]
    # At rest a hundredth of the power the model leaves in motion: that is not the same noise.
    assert against_rest(quiet, "force", pink(0.0)) is None


@pytest.mark.parametrize(("coarse", "said"), [((), ["jump"]), (("force",), [])])
def test_a_reading_in_coarse_steps_jumps_without_anything_that_does(
    monkeypatch: pytest.MonkeyPatch, coarse: tuple[str, ...], said: list[str]
) -> None:
    """Whether a search weighs readings by the step they lie in, or takes errors of rounding for noise."""
    monkeypatch.setattr(innovations, "residuals_of", lambda *of: [None])
    monkeypatch.setattr(innovations, "level_shifts", lambda *of: [LevelShift(0, 0, 5, 1e-20, 3.0)])
    monkeypatch.setattr(innovations, "against_rest", lambda *of: None)
    noise = SimpleNamespace(whitening=None, noise=(pink(0.0),))
    search: Any = SimpleNamespace(common_noise=noise, context=SimpleNamespace(whole=None))
    mode = SimpleNamespace(unknowns=SimpleNamespace(scattering=()))
    fitted: Any = SimpleNamespace(evidence=SimpleNamespace(mode=mode))
    found = innovations.tests_of(search, fitted, resting(0, 0.0)[:1], ("force",), coarse)
    assert [alarm.test for alarm in found if alarm.raised] == said


def test_too_little_rest_tells_nothing() -> None:
    times = np.arange(300) / RATE
    short = Trace("short", times, {"force": 30.0 * np.sin(40.0 * times)}, {}, {})
    assert not rests(short)
    assert against_rest([short], "force", pink(0.0)) is None
    assert FEWEST_ORDINATES > 1


def test_an_alarm_is_raised_below_its_threshold() -> None:
    assert Alarm("rest", 0.5e-4, 1e-4).raised
    assert not Alarm("rest", 2e-4, 1e-4).raised


def test_slopes_that_are_no_numbers_tell_nothing() -> None:
    assert _gain(np.diag([1.0, np.nan]), np.ones(2), np.ones(2)) == (0.0, 0)
    assert _gain(np.eye(2), np.array([1.0, np.nan]), np.ones(2)) == (0.0, 0)
    assert _gain(np.eye(2), np.array([3.0, 4.0]), np.ones(2)) == (25.0, 2)


@pytest.mark.parametrize(
    ("cut", "tried", "said"),
    [
        (True, False, ("not_trusted", "all_untried")),
        (True, True, ("unexplained", "none_tried")),
        (False, True, ("unexplained", "no_effect")),
    ],
)
def test_a_gap_of_which_nothing_was_tried_is_not_told_as_one_that_nothing_accounts_for(
    cut: bool, tried: bool, said: tuple[str, str]
) -> None:
    alarm = Alarm("rest", 1e-9, 1e-4)
    verdict, reason = conclusion._verdict(cast(Any, SimpleNamespace(effects=())), [alarm], [], cut, tried)
    assert (verdict, reason[0].identifier) == said


@pytest.mark.parametrize("cut", [True, False])
def test_a_name_found_before_the_time_ended_says_that_more_may_be_missing(cut: bool) -> None:
    evidence = SimpleNamespace(grid=np.zeros((1, 1)), weight=np.ones(1))
    best = cast(Any, SimpleNamespace(effects=(object(),), evidence=evidence))
    verdict, reason = conclusion._verdict(best, [], [], cut, True)
    assert verdict == "named"
    assert [one.identifier for one in reason] == ["noise_left", *(["no_further_look"] if cut else [])]
    assert ("--time" in " ".join(map(discovery_sentence, reason))) == cut


@pytest.mark.parametrize(
    ("gap", "inputs", "said"),
    [(1.3, {"drive": 1e-5}, "nothing_missing"), (16.0, {"drive": 1e-5}, "not_trusted"), (16.0, {}, "nothing_missing")],
)
def test_nothing_is_missing_only_where_a_fit_of_a_drive_follows_the_motion_to_its_end(
    gap: float, inputs: dict[str, float], said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (conclusion, setup):
        monkeypatch.setattr(module, "total", lambda of: of)
    after = cast(Any, SimpleNamespace(gap=gap, expected_gap=1.0, input_errors=inputs))
    verdict, reason = conclusion._of_whole_records("nothing_missing", (Statement("noise_left"),), after)
    assert verdict == said
    assert [one.identifier for one in reason] == ["motion_lost" if said == "not_trusted" else "noise_left"]
    assert conclusion._of_whole_records("named", reason, after) == ("named", reason)
    if said == "not_trusted":
        assert "a gap of 16 over whole records" in discovery_sentence(reason[0])


@pytest.mark.parametrize("verdict", ["named", "nothing_missing"])
def test_where_an_effect_was_taken_out_by_the_fit_nothing_is_said_to_be_complete(verdict: Any) -> None:
    noise = (Statement("noise_left", {"between_records": False}),)
    assert conclusion._after_refusal(verdict, noise, True) == ("unexplained", ())
    assert conclusion._after_refusal(verdict, noise, False) == (verdict, noise)
