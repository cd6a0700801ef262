"""Error bars under noise with and without memory, against explicit sums and against many draws."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fibrefit.fitting import error_bars
from fibrefit.fitting.uncertainty import (
    MEMORY,
    Scores,
    block_bootstrap,
    by_windows,
    inverse_root,
    newey_west,
    sandwich,
    stationary,
    white,
)
from fibrefit.problem.statement.layout import Belief, Layout, Range, Slot
from tests.fitting import made

RATE, SAMPLES, RECORDS = 2000.0, 512, 4
EXACT = 1e-10


def slopes() -> np.ndarray:
    """One shared value seen all through, one seen in the second half, and a level of each record's own."""
    t = np.arange(SAMPLES) / SAMPLES
    columns = np.stack([np.sin(9.0 * t) + 0.6, np.where(t > 0.5, np.cos(40.0 * t), 0.0), np.ones(SAMPLES)], axis=-1)
    return np.stack([columns * (1.0 + 0.1 * r) for r in range(RECORDS)])[:, None]


def scores(residuals: np.ndarray) -> Scores:
    columns = np.array([[0, 1, 2 + r] for r in range(RECORDS)])
    return Scores(residuals, slopes(), np.full(RECORDS, SAMPLES), columns, 2 + RECORDS)


def noise(share: float, seed: int) -> np.ndarray:
    random = np.random.default_rng([seed, 9])
    return np.stack([made.coloured(SAMPLES, share, random) for _ in range(RECORDS)])[:, None]


def fitted(residuals: np.ndarray) -> tuple[Scores, np.ndarray]:
    """Scores of what is left after a linear fit, and the errors of the fit ``(n_free,)``."""
    raw = scores(residuals)
    errors = np.linalg.solve(raw.normal_matrix(), raw.gradient())
    local = errors[raw.columns]
    return dataclasses.replace(raw, residuals=residuals - np.einsum("rcti,ri->rct", raw.slopes, local)), errors


def standard_errors(fit: Scores, middle: np.ndarray) -> np.ndarray:
    return np.sqrt(np.diag(sandwich(fit.normal_matrix(), middle)))


METHODS = {
    "white": white,
    "spectrum": lambda fit: stationary(fit, RATE),
    "newey_west": newey_west,
    "block_bootstrap": block_bootstrap,
}


def honesty(share: float) -> dict[str, np.ndarray]:
    """Rms of errors over standard errors of the two shared values, over 150 draws; one is right."""
    ratios: dict[str, list[np.ndarray]] = {name: [] for name in METHODS}
    for seed in range(150):
        fit, errors = fitted(noise(share, seed))
        for name, method in METHODS.items():
            ratios[name].append((errors / standard_errors(fit, method(fit)))[:2])
    return {name: np.sqrt(np.mean(np.square(rows), axis=0)) for name, rows in ratios.items()}


def test_white_noise_is_covered_by_all_that_assume_it_and_nearly_by_the_rest() -> None:
    found = honesty(0.0)
    # 150 draws know a standard deviation to 6 %.
    for name in ("white", "spectrum"):
        np.testing.assert_allclose(found[name], 1.0, atol=0.18)
    # Few blocks, of which the fit has used some: these two are known to be too short then.
    for name in ("newey_west", "block_bootstrap"):
        assert np.all((found[name] > 0.9) & (found[name] < 1.6))


def test_pink_noise_is_covered_by_the_spectrum_and_not_by_white_error_bars() -> None:
    found = honesty(0.7)
    np.testing.assert_allclose(found["spectrum"], 1.0, atol=0.25)
    assert found["white"][0] > 2.0  # the negative control
    assert np.all(found["newey_west"] < found["white"])


def test_sums_over_records_are_those_of_the_whole_jacobian() -> None:
    residuals = noise(0.5, 1)
    fit = scores(residuals)
    jacobian = np.zeros((RECORDS * SAMPLES, fit.size))
    for r in range(RECORDS):
        jacobian[r * SAMPLES : (r + 1) * SAMPLES, fit.columns[r]] = fit.slopes[r, 0]
    np.testing.assert_allclose(fit.normal_matrix(), jacobian.T @ jacobian, rtol=EXACT)
    np.testing.assert_allclose(fit.gradient(), jacobian.T @ residuals.ravel(), rtol=1e-8, atol=1e-9)


def test_a_value_that_is_held_in_a_record_gets_nothing_from_it() -> None:
    fit = scores(noise(0.0, 0))
    columns = fit.columns.copy()
    columns[1, 2] = fit.size + 1
    held = dataclasses.replace(fit, columns=columns)
    assert held.normal_matrix()[3].any() == False  # noqa: E712
    assert held.gradient()[3] == 0.0
    np.testing.assert_allclose(held.normal_matrix()[:2, :2], fit.normal_matrix()[:2, :2])


def test_newey_west_is_the_weighted_sum_of_autocovariances() -> None:
    fit, _ = fitted(noise(0.5, 2))
    total = np.zeros((fit.size, fit.size))
    for r in range(RECORDS):
        score = fit.of_record(r)
        score = score - score.mean(axis=0)
        lags = round(MEMORY * SAMPLES)
        local = score.T @ score
        for lag in range(1, lags + 1):
            product = score[lag:].T @ score[:-lag]
            local += (1.0 - lag / (lags + 1.0)) * (product + product.T)
        total[np.ix_(fit.columns[r], fit.columns[r])] += local
    np.testing.assert_allclose(newey_west(fit), total, rtol=1e-8, atol=1e-9 * np.abs(total).max())


@pytest.mark.parametrize("samples", [512, 509, 500])
def test_the_bootstrap_is_the_limit_of_many_resamples(samples: int) -> None:
    whole = scores(noise(0.6, 3))
    fit = dataclasses.replace(
        whole,
        residuals=whole.residuals[:1, :, :samples],
        slopes=whole.slopes[:1, :, :samples],
        counts=np.array([samples]),
        columns=np.array([[0, 1, 2]]),
        size=3,
    )
    length, random = round(MEMORY * samples), np.random.default_rng(0)
    starts = random.integers(0, samples, size=(20_000, -(-samples // length)))
    index = (starts[:, :, None] + np.arange(length)).reshape(len(starts), -1)[:, :samples] % samples
    drawn = np.cov((fit.residuals[0, 0][index] @ fit.slopes[0, 0]).T)
    found = block_bootstrap(fit)
    scale = np.sqrt(np.diag(drawn))
    # 20 000 resamples know a variance to 1 %.
    np.testing.assert_allclose(found / np.outer(scale, scale), drawn / np.outer(scale, scale), atol=0.04)


def test_the_bootstrap_of_two_channels_is_the_sum_over_their_shared_places() -> None:
    """All shifts of one block at a time, written out; the second channel follows the first by three samples."""
    samples, random = 90, np.random.default_rng(4)
    first = np.cumsum(random.standard_normal(samples))
    residuals = np.stack([first, np.roll(first, 3) + 0.1 * random.standard_normal(samples)])
    slopes = np.cumsum(random.standard_normal((2, samples, 3)), axis=1)
    fit = Scores(residuals[None], slopes[None], np.array([samples]), np.arange(3)[None], 3)
    total, length = np.zeros((3, 3)), round(MEMORY * samples)
    for start in range(0, samples, length):
        here = np.arange(start, min(start + length, samples))
        shifted = [residuals[:, (here + shift) % samples] for shift in range(samples)]
        drawn = np.array([np.einsum("ct,cti->i", rows, slopes[:, here]) for rows in shifted])
        total += np.cov(drawn.T, bias=True)
    np.testing.assert_allclose(block_bootstrap(fit), total, rtol=1e-9, atol=1e-9 * np.abs(total).max())


def test_the_spectrum_of_white_noise_gives_the_white_error_bars() -> None:
    fit, _ = fitted(noise(0.0, 5))
    np.testing.assert_allclose(
        standard_errors(fit, stationary(fit, RATE))[:2], standard_errors(fit, white(fit))[:2], rtol=0.15
    )


def test_the_variance_under_a_known_spectrum_is_that_of_many_draws() -> None:
    """Slopes alone: scores of noise drawn again and again."""
    drawn = np.array([scores(noise(0.7, seed)).gradient()[:2] for seed in range(400)])
    found = np.mean([stationary(scores(noise(0.7, seed)), RATE)[:2, :2] for seed in range(20)], axis=0)
    # How noise goes on below one over the record is a convention, which matters most for a slope with a mean.
    np.testing.assert_allclose(np.sqrt(np.diag(found)), drawn.std(axis=0), rtol=0.3)


def test_masked_samples_count_neither_as_noise_nor_as_silence() -> None:
    fit, _ = fitted(noise(0.0, 6))
    mask = np.random.default_rng(1).random(fit.residuals.shape) < 0.5
    half = dataclasses.replace(fit, residuals=fit.residuals * mask, slopes=fit.slopes * mask[..., None])
    for name in ("white", "spectrum"):
        ratio = standard_errors(half, METHODS[name](half))[:2] / standard_errors(fit, METHODS[name](fit))[:2]
        np.testing.assert_allclose(ratio, np.sqrt(2.0), rtol=0.15)


def test_what_the_data_do_not_see_gets_an_infinite_error() -> None:
    normal = np.diag([4.0, 0.0, 1e-8])
    covariance = sandwich(normal, normal)
    np.testing.assert_allclose(np.diag(covariance), [0.25, np.inf, 1e8])


def test_values_that_only_act_together_get_infinite_errors_and_leave_the_others_alone() -> None:
    columns = np.random.default_rng(0).normal(size=(100, 2))
    jacobian = np.column_stack([columns, 1e5 * columns[:, 0]])
    variance = np.diag(sandwich(jacobian.T @ jacobian, jacobian.T @ jacobian))
    assert np.isinf(variance[[0, 2]]).all()
    assert variance[1] == pytest.approx(0.01, rel=0.4)


def test_what_the_data_do_not_see_does_not_choose_the_error_bars() -> None:
    """An infinite variance is infinite by every method; the widest of the others is still the one to be believed."""
    slots = tuple(Slot(name, "-", Range(-np.inf, np.inf, 1.0)) for name in ("a", "b"))
    problem = SimpleNamespace(layout=Layout(slots, ("r.csv",)))
    sizes = [error_bars.size(problem, np.diag([np.inf, variance])) for variance in (1.0, 9.0)]
    assert sizes[0] < sizes[1] < np.inf


def test_values_that_no_record_shares_have_the_widest_error_bars_too() -> None:
    """As of a study in which each record has all of its own: pink noise is not taken for white there."""
    slots = tuple(Slot(name, "-", Range(-np.inf, np.inf, 1.0), shared=False) for name in ("a", "b", "c"))
    names = tuple(f"{r}.csv" for r in range(RECORDS))
    problem: Any = SimpleNamespace(layout=Layout(slots, names), model=SimpleNamespace(pieces=None))
    raw = scores(noise(0.7, 1))
    raw = dataclasses.replace(raw, columns=np.arange(3 * RECORDS).reshape(RECORDS, 3), size=3 * RECORDS)
    bars = error_bars.error_bars(problem, raw, RATE)
    assert bars.method != "white"
    assert error_bars.error_inflation(problem, bars) > 1.5


def test_what_centres_of_priors_do_is_no_larger_for_noise_that_has_a_memory() -> None:
    """A level with a prior: how it follows its centre is a matter of slopes, whatever noise the error bars are for."""
    belief = Belief(0.0, 0.02)
    slots = tuple(
        Slot(name, "-", Range(-np.inf, np.inf, 1.0), belief=belief if name == "level" else None)
        for name in ("a", "level")
    )
    layout = Layout(slots, ("r.csv",))
    problem: Any = SimpleNamespace(layout=layout, model=SimpleNamespace(pieces=None))
    columns = slopes()[:1][..., [0, 2]]
    raw = Scores(
        noise(0.9, 2)[:1], columns, np.array([SAMPLES]), np.array([[0, 1]]), 2, belief=layout.prior_gram(np.zeros(2))
    )
    bars = error_bars.error_bars(problem, raw, RATE)
    inverse = np.linalg.inv(raw.normal_matrix())
    found = error_bars.estimates(problem, np.zeros(2), bars)
    for i, one in enumerate(found):
        assert one.found.common_error == pytest.approx(abs(inverse[i, 1]) / belief.spread)
        assert one.found.common_error < one.found.std_error
    # The covariance in its place would tell more than the whole error.
    assert bars.covariance[1, 1] / belief.spread > found[1].found.std_error
    # It is the same where what the model lacks is allowed for.
    wider = error_bars.ErrorBars({**bars.covariances, "wide": 9.0 * bars.covariance}, "wide", bars.method, bars.inverse)
    again = error_bars.estimates(problem, np.zeros(2), wider)
    assert [one.found.common_error for one in again] == [one.found.common_error for one in found]


def test_the_interval_of_the_only_record_is_said_to_be_its_own() -> None:
    slot = Slot("a", "-", Range(-np.inf, np.inf, 1.0))
    for names, kind in ((("r.csv",), "record"), (("r.csv", "s.csv"), "normal")):
        problem: Any = SimpleNamespace(layout=Layout((slot,), names))
        bars = error_bars.ErrorBars({"white": np.eye(1)}, "white")
        (one,) = error_bars.estimates(problem, np.zeros(1), bars)
        assert one.found.interval_kind == kind


@pytest.mark.parametrize("lost", [np.nan, np.inf])
def test_where_slopes_are_no_numbers_nothing_is_known_and_nothing_fails(lost: float) -> None:
    normal = np.array([[2.0, 1.0], [1.0, 3.0]])
    broken = normal.copy()
    broken[0, 1] = broken[1, 0] = lost
    for pair in ((broken, normal), (normal, broken)):
        np.testing.assert_array_equal(np.diag(sandwich(*pair)), [np.inf, np.inf])
    np.testing.assert_allclose(sandwich(normal, normal), np.linalg.inv(normal))


WINDOW = 32


def in_windows(seed: int) -> tuple[Scores, np.ndarray]:
    """A fit to errors that begin at nought in each window and grow along it, as the slopes do."""
    random = np.random.default_rng([seed, 3])
    walks = np.cumsum(random.standard_normal((RECORDS, SAMPLES // WINDOW, WINDOW)), axis=-1)
    ahead = np.tile(np.arange(WINDOW) / WINDOW, SAMPLES // WINDOW)
    columns = ahead[:, None] * slopes()[:, 0]
    columns[..., 2] = 1.0
    raw = dataclasses.replace(scores(walks.reshape(RECORDS, 1, SAMPLES)), slopes=columns[:, None])
    errors = np.linalg.solve(raw.normal_matrix(), raw.gradient())
    left = raw.residuals - np.einsum("rcti,ri->rct", raw.slopes, errors[raw.columns])
    return dataclasses.replace(raw, residuals=left), errors


def test_errors_that_grow_along_each_window_are_covered_by_windows_alone() -> None:
    ratios: dict[str, list[np.ndarray]] = {"windows": [], "spectrum": [], "block_bootstrap": []}
    methods = {**METHODS, "windows": lambda fit: by_windows(fit, WINDOW)}
    for seed in range(150):
        fit, errors = in_windows(seed)
        for name, found in ratios.items():
            found.append((errors / standard_errors(fit, methods[name](fit)))[:2])
    rms = {name: np.sqrt(np.mean(np.square(rows), axis=0)) for name, rows in ratios.items()}
    np.testing.assert_allclose(rms["windows"], 1.0, atol=0.18)
    for name in ("spectrum", "block_bootstrap"):
        assert np.all(rms[name] > 1.25), f"{name}: {rms[name]}"


@pytest.mark.parametrize("window", [WINDOW, 200])
def test_by_windows_is_the_sum_of_products(window: int) -> None:
    """Windows of which a record holds many, and few; the last may be shorter."""
    fit, _ = in_windows(1)
    inverse = np.linalg.inv(fit.normal_matrix())
    covariance, counted, pieces = np.zeros((window, window)), np.zeros((window, window)), []
    for r, places in enumerate(fit.columns):
        for start in range(0, SAMPLES, window):
            part = slice(start, min(start + window, SAMPLES))
            here = np.zeros((part.stop - start, fit.size))
            here[:, places] = fit.slopes[r, 0, part]
            own = np.zeros(window)
            own[: len(here)] = np.linalg.solve(np.eye(len(here)) - here @ inverse @ here.T, fit.residuals[r, 0, part])
            covariance += np.outer(own, own)
            counted[: len(here), : len(here)] += 1.0
            pieces.append(here)
    covariance /= np.maximum(np.sqrt(np.outer(np.diag(counted), np.diag(counted))), 1.0)
    expected = sum(here.T @ covariance[: len(here), : len(here)] @ here for here in pieces)
    np.testing.assert_allclose(by_windows(fit, window), expected, rtol=1e-7, atol=1e-9 * np.abs(expected).max())


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("slope", [0.0, np.nan])
def test_what_no_window_tells_is_no_fault(slope: float) -> None:
    fit, _ = in_windows(2)
    blind = dataclasses.replace(fit, slopes=np.full_like(fit.slopes, slope))
    assert inverse_root(blind.normal_matrix()).shape == (fit.size, 0)
    assert by_windows(blind, WINDOW).shape == (fit.size, fit.size)
