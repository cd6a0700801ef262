"""Errors of measured inputs: their prior, how readings react to them, and their elimination."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.core.limits import OutOfTimeError, time_limit
from fibrefit.problem.formulation import formulate
from fibrefit.problem.inputs.errors_in_variables import (
    COSINES,
    InputErrors,
    corrected,
    downweights,
    error_rms,
    expanded,
    input_errors,
    no_errors,
    residuals,
    smoothed_cosines,
    stacked_weights,
)
from fibrefit.problem.inputs.sensitivities import NEGLIGIBLE, InputSensitivities
from fibrefit.problem.inputs.smoothing import smoothed, smoother
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.task import Task
from fibrefit.rigs.catalogue import RIGS
from fibrefit.simulation.model import Model
from fibrefit.study import load_study
from fibrefit.workflow.prepare import read_records

#: Differences of residuals that jump where the weight starts to move, against derivatives.
DIFFERENCES = 2e-2
#: Sensitivities are held in single precision.
SINGLE = 1e-5


STUDY = Path(__file__).parents[2] / "configs" / "drive_series" / "study.toml"
TRUTH = {"stiffness": 14693.386, "damping": 26.943, "friction": 3.951}


@pytest.fixture(scope="module")
def task() -> Task:
    """First and fourth record of the drive series: strokes, and sines with a mass added."""
    study = load_study(STUDY)
    study = study.model_copy(update={"records": (study.records[0], study.records[3])})
    task = formulate(study, read_records(study), Model(RIGS["pulley_drive"], ()))
    start = task.start.copy()
    start[: len(TRUTH)] = [TRUTH[slot.name] for slot, _ in task.problem.layout.entries[: len(TRUTH)]]
    return dataclasses.replace(task, start=start)


@pytest.fixture(scope="module")
def known(task: Task) -> dict[str, InputErrors]:
    return input_errors(task)


def test_the_weights_are_those_of_the_smoother() -> None:
    random = np.random.default_rng(0)
    times = np.arange(400) / 2000.0
    values = 0.05 * np.abs(np.sin(20.0 * times)) + 1e-5 * random.standard_normal(400)
    values[37] = np.nan
    weights = smoother(values, times, "made")
    reach = weights.shape[1] // 2
    whole = smoothed(values, times, "made")
    for t in (reach, 36, 200, 399 - reach):
        near = np.nan_to_num(values[t - reach : t + reach + 1])
        np.testing.assert_allclose(near @ weights[t], whole[t], rtol=1e-12)
    # A parabola passes through it as it is.
    parabola = 0.01 + 0.3 * times - 2.0 * times**2
    found = smoothed(parabola, times, "made")
    np.testing.assert_allclose(found, np.column_stack([parabola, 0.3 - 4.0 * times]), atol=1e-9)


def test_weights_that_recur_are_kept_once() -> None:
    random = np.random.default_rng(0)
    times = np.arange(900) / 2000.0
    values = 0.05 * np.abs(np.sin(20.0 * times)) + 1e-5 * random.standard_normal(900)
    values[37] = np.nan
    records = [smoother(values[:800], times[:800], "made"), smoother(values, times, "made")]
    kinds, kind = stacked_weights(records, 1000)
    for r, weights in enumerate(records):
        np.testing.assert_allclose(kinds[r][kind[r, : len(weights)]], weights, atol=1e-10 * np.abs(weights).max())
        # What is beyond the end of a record is nothing.
        assert not np.any(kinds[r][kind[r, len(weights) :]])
        assert len(np.unique(kind[r])) < 0.5 * len(weights)
    # Weights that all differ are all kept.
    apart = random.standard_normal((300, 7, 2))
    kinds, kind = stacked_weights([apart], 300)
    np.testing.assert_array_equal(kinds[0][kind[0]], apart)


def test_cosines_go_through_the_smoother_as_any_error_does(task: Task, known: dict[str, InputErrors]) -> None:
    times = task.problem.observations.experiment.times
    of_record = jax.tree.map(lambda rows: rows[1], known["drive"])
    for number in (0, 5, 200, of_record.size.size - 1):
        numbers = jnp.arange(COSINES) + number - COSINES // 2
        coefficients = np.eye(of_record.size.size)[[number]]
        of_one = corrected(task.problem, known, {"drive": np.concatenate([coefficients, coefficients])})
        expected = [
            np.asarray(before - after)[1]
            for before, after in zip(
                task.problem.observations.experiment.inputs["drive"],
                of_one.observations.experiment.inputs["drive"],
                strict=True,
            )
        ]
        for found, row in zip(smoothed_cosines(times[1], of_record, numbers), expected, strict=True):
            np.testing.assert_allclose(found[COSINES // 2], row, atol=1e-8 * np.abs(row).max() + 1e-15)
    # There is none before the first and none after the last.
    assert not np.any(smoothed_cosines(times[1], of_record, jnp.arange(COSINES) - COSINES).values)
    assert not np.any(smoothed_cosines(times[1], of_record, of_record.size.size + jnp.arange(COSINES)).values)


def test_waves_of_variance_one_have_the_power_of_the_noise(task: Task, known: dict[str, InputErrors]) -> None:
    random, noise = np.random.default_rng(1), task.input_noise["drive"]
    coefficients = {name: random.standard_normal(wave.shape) for name, wave in no_errors(known).items()}
    rms = [error_rms(task.problem, known, {"drive": scale * coefficients["drive"]})["drive"] for scale in (1.0, 2.0)]
    duration = float(known["drive"].duration[0])
    frequency = np.arange(0.25 / duration, 60.0, 0.5 / duration)
    power = noise.density(frequency).sum() * 0.5 / duration + 2.0 * noise.line
    assert rms[0] == pytest.approx(np.sqrt(power), rel=0.3)
    # Before anything is drawn it is the mean over all draws.
    assert known["drive"].rms == pytest.approx(np.sqrt(power), rel=0.1)
    assert rms[1] == pytest.approx(2.0 * rms[0], rel=1e-12)


def test_records_are_linearised_one_by_one_as_long_as_there_is_time(
    task: Task, known: dict[str, InputErrors], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[jax.Array] = []
    monkeypatch.setattr(
        "fibrefit.problem.inputs.errors_in_variables._linearised", lambda _, local, *rest: asked.append(local) or ()
    )
    with time_limit(0.0), pytest.raises(OutOfTimeError):
        expanded(task.problem, known, task.start, no_errors(known))
    assert not asked
    expanded(task.problem, known, task.start, no_errors(known), [0])
    np.testing.assert_array_equal(asked, task.problem.layout.local(task.start)[:1])


@pytest.mark.slow
def test_readings_react_to_an_error_as_differences_say(task: Task, known: dict[str, InputErrors]) -> None:
    quiet, random = no_errors(known), np.random.default_rng(2)
    wave = {"drive": 0.01 * random.standard_normal(quiet["drive"].shape)}
    there = np.asarray(corrected(task.problem, known, wave).residuals(jnp.asarray(task.start)))
    back = np.asarray(corrected(task.problem, known, {"drive": -wave["drive"]}).residuals(jnp.asarray(task.start)))
    plain = 0.5 * (there - back)
    for r, (_, _, sensitivities) in enumerate(expanded(task.problem, known, task.start, quiet)):
        missed = plain[r].ravel() - wave["drive"][r] @ sensitivities
        assert np.linalg.norm(missed) < DIFFERENCES * np.linalg.norm(plain[r])


@pytest.mark.slow
def test_each_record_may_be_linearised_at_values_of_its_own(task: Task, known: dict[str, InputErrors]) -> None:
    quiet, stiffer = no_errors(known), task.start.copy()
    stiffer[0] *= 1.02
    local = np.array(task.problem.layout.local(task.start))
    local[1] = task.problem.layout.local(stiffer)[1]
    here, there = (expanded(task.problem, known, values, quiet) for values in (task.start, stiffer))
    for part, of in zip(expanded(task.problem, known, local, quiet), (here[0], there[1]), strict=True):
        for found, expected in zip(part, of, strict=True):
            np.testing.assert_array_equal(found, expected)
    # The negative control: at the values of the other record it is another matter.
    assert np.linalg.norm(there[1][2] - here[1][2]) > 0.01 * np.linalg.norm(here[1][2])


EVERY_DIRECTION = "fibrefit.problem.inputs.sensitivities.NEGLIGIBLE", 0.0
"""Errors count however little the readings show of them."""


def test_elimination_is_that_of_the_joint_least_squares(
    task: Task, known: dict[str, InputErrors], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(*EVERY_DIRECTION)
    quiet = no_errors(known)
    parts = expanded(task.problem, known, task.start, quiet)
    whole = np.ones((len(parts), *parts[0][0].shape))
    seen = InputSensitivities.of(quiet, [rows for _, _, rows in parts], whole)
    rows = np.stack([np.concatenate([slopes, residuals.reshape(1, -1)]) for residuals, slopes, _ in parts])
    left, waves = seen.split(rows)
    for r, (_, _, sensitivities) in enumerate(parts):
        # Errors are held by a prior of variance one: rows below those of the readings.
        columns = np.concatenate([sensitivities.T, np.eye(len(sensitivities))])
        dense = np.concatenate([rows[r].T, np.zeros((len(sensitivities), len(rows[r])))])
        best = np.linalg.lstsq(columns, dense, rcond=None)[0].T
        size = np.linalg.norm(rows[r], axis=1)[:, None]
        np.testing.assert_allclose(waves[r] / size, best / size, atol=SINGLE)
        np.testing.assert_allclose(left[r] / size, (rows[r] - best @ sensitivities) / size, atol=SINGLE)
        assert np.linalg.norm(left[r][-1]) < 0.99 * np.linalg.norm(rows[r][-1])


def test_about_other_errors_readings_without_any_are_predicted_anew(task: Task, known: dict[str, InputErrors]) -> None:
    quiet = no_errors(known)
    parts = expanded(task.problem, known, task.start, quiet)
    rows, whole = [rows for _, _, rows in parts], np.ones((len(parts), *parts[0][0].shape))
    seen, random = InputSensitivities.of(quiet, rows, whole), np.random.default_rng(5)
    there = seen.named([random.standard_normal(len(record.rows)) for record in seen.records])
    moved, anew = seen.about(there), InputSensitivities.of(there, rows, whole)
    size = np.abs(anew.offset).max()
    assert size > 1.0
    np.testing.assert_allclose(moved.offset / size, anew.offset / size, atol=SINGLE)
    np.testing.assert_array_equal(moved.coefficients["drive"], there["drive"])
    # And back again nothing has changed.
    np.testing.assert_allclose(moved.about(quiet).offset / size, seen.offset / size, atol=SINGLE)


def test_directions_that_the_readings_hardly_show_are_left_to_the_noise(
    task: Task, known: dict[str, InputErrors], monkeypatch: pytest.MonkeyPatch
) -> None:
    quiet = no_errors(known)
    parts = expanded(task.problem, known, task.start, quiet)
    reactions, whole = [rows for _, _, rows in parts], np.ones((len(parts), *parts[0][0].shape))
    most = InputSensitivities.of(quiet, reactions, whole)
    monkeypatch.setattr(*EVERY_DIRECTION)
    every = InputSensitivities.of(quiet, reactions, whole)
    numbers = np.array([[len(record.inverse) for record in seen.records] for seen in (every, most)])
    assert np.all(numbers[1] < 0.8 * numbers[0])
    random = np.random.default_rng(5)
    rows = random.standard_normal((len(parts), 3, whole[0].size))
    costs = []
    for seen in (every, most):
        left, waves = seen.split(rows)
        costs.append(np.sum(left**2, axis=-1) + np.sum(waves**2, axis=-1))
    # Of noise each direction that is left out would have taken less than a share of one.
    lost = costs[1] - costs[0]
    assert np.all(lost > 0.0)
    assert np.all(lost < 1.5 * NEGLIGIBLE * (numbers[0] - numbers[1])[:, None])
    # What is not known of the coefficients is what the prior and all reactions leave.
    for r, root in enumerate(most.roots()):
        exact = np.linalg.inv(np.eye(len(root)) + reactions[r] @ reactions[r].T)
        assert np.linalg.norm(root @ root.T - exact, 2) < 1.1 * NEGLIGIBLE


def drawn_reactions(random: np.random.Generator, size: int) -> np.ndarray:
    """What forty errors do to readings of two channels, slow ones most, ``(40, 2 * size)``."""
    waves = np.cos(np.pi * np.arange(1, 41)[:, None] * (np.arange(size) + 0.5) / size)
    channels = np.concatenate([waves, 0.3 * waves], axis=1)
    return channels * (0.5 / np.arange(1, 41))[:, None] * random.uniform(0.5, 1.5, (40, 1))


def test_readings_whitened_of_the_errors_of_inputs_are_those_of_the_symmetric_root() -> None:
    random, size = np.random.default_rng(8), 300
    reactions = drawn_reactions(random, size)
    seen = InputSensitivities.of({"drive": np.zeros((1, 40))}, [reactions], np.ones((1, 2, size)))
    rows = random.standard_normal((1, 3, 2 * size))
    white = seen.whitened(rows, seen.products(rows))
    shown = seen.records[0].basis @ seen.records[0].basis.T @ reactions
    values, vectors = np.linalg.eigh(np.eye(2 * size) + shown.T @ shown)
    np.testing.assert_allclose(white[0], rows[0] @ (vectors / np.sqrt(values)) @ vectors.T, atol=SINGLE)
    grams = seen.eliminated(rows @ np.swapaxes(rows, 1, 2), seen.products(rows))
    np.testing.assert_allclose(white @ np.swapaxes(white, 1, 2), grams, rtol=1e-4, atol=1e-3)


def test_scores_scatter_as_their_information_says_whatever_of_a_change_the_inputs_absorb() -> None:
    """Of readings with noise and errors of the input; the control takes what these leave of rows for the whole."""
    random, size = np.random.default_rng(9), 640
    reactions = drawn_reactions(random, size)
    seen = InputSensitivities.of({"drive": np.zeros((1, 40))}, [reactions], np.ones((1, 2, size)))
    found: dict[str, list[float]] = {"whitened": [], "without_errors": []}
    for _ in range(200):
        readings = random.standard_normal(2 * size) + random.standard_normal(40) @ reactions
        rows = np.stack([reactions[0], readings])[None]
        pulled = seen.products(rows)
        told = seen.eliminated(rows @ np.swapaxes(rows, 1, 2), pulled)[0, 0, 0]
        for name, ratios in found.items():
            change, noise = getattr(seen, name)(rows, pulled)[0].reshape(2, 2, 64, -1).swapaxes(1, 2).reshape(2, 64, -1)
            ratios.append(float(np.sum(np.sum(change * noise, axis=1) ** 2)) / told)
    assert np.mean(found["whitened"]) == pytest.approx(1.0, abs=4.0 * np.std(found["whitened"]) / np.sqrt(200.0))
    assert np.mean(found["without_errors"]) < 0.2


def test_each_record_has_its_own_directions_and_is_held_as_far_as_it_counts(
    task: Task, known: dict[str, InputErrors]
) -> None:
    quiet = no_errors(known)
    parts = expanded(task.problem, known, task.start, quiet)
    weight = np.ones((len(parts), *parts[0][0].shape))
    weight[0, :, 100:] = 0.0
    seen = InputSensitivities.of(quiet, [rows for _, _, rows in parts], weight)
    first, *others = seen.records
    assert first.rows.shape[2] == 100
    assert all(len(first.inverse) < 0.5 * len(other.inverse) for other in others)
    # What is held of a record are all products with what counts of it.
    rows = np.random.default_rng(6).standard_normal((len(parts), 2, weight[0].size)) * weight.reshape(len(parts), 1, -1)
    for record, own, (_, _, every), of in zip(seen.records, rows, parts, weight, strict=True):
        whole = record.basis.T @ (every * of.ravel())
        size = np.linalg.norm(whole, axis=1) * np.linalg.norm(own, axis=1).max()
        np.testing.assert_allclose(record.products(own) / size, own @ whole.T / size, atol=SINGLE)
        one = np.eye(len(whole))[:1]
        np.testing.assert_allclose(
            record.imitated(one, own.shape[1])[0], whole[0], atol=SINGLE * np.abs(whole[0]).max()
        )


def test_the_best_errors_lower_the_cost_as_predicted(task: Task, known: dict[str, InputErrors]) -> None:
    parts = expanded(task.problem, known, task.start, no_errors(known))
    residuals = np.stack([residuals for residuals, _, _ in parts])
    seen = InputSensitivities.of(no_errors(known), [rows for _, _, rows in parts], np.ones(residuals.shape))
    left, waves = seen.split(residuals.reshape(len(parts), 1, -1))
    after = np.asarray(corrected(task.problem, known, {"drive": -waves[:, 0]}).residuals(jnp.asarray(task.start)))
    before, cost = np.sum(residuals**2), np.sum(after**2) + np.sum(waves**2)
    predicted_reduction = before - np.sum(left**2) - np.sum(waves**2)
    assert predicted_reduction > 0.1 * before
    assert before - cost == pytest.approx(predicted_reduction, rel=0.05)


@pytest.mark.slow
def test_what_counts_in_full_is_what_the_linearised_problem_foretells() -> None:
    study = load_study(STUDY)
    task = formulate(study, read_records(study), Model(RIGS["pulley_drive"], ()))
    start = task.start.copy()
    start[: len(TRUTH)] = [TRUTH[slot.name] for slot, _ in task.problem.layout.entries[: len(TRUTH)]]
    known = input_errors(task)
    quiet = no_errors(known)
    sensitivities = [rows for _, _, rows in expanded(task.problem, known, start, quiet)]
    downweight = downweights(task.problem, known, start, quiet, sensitivities)
    # Errors it has not been made from.
    wave = {"drive": np.random.default_rng(99).standard_normal(quiet["drive"].shape)}
    moved = residuals(task.problem, known, start, wave) - residuals(task.problem, known, start, quiet)
    predicted = np.stack([w @ rows for w, rows in zip(wave["drive"], sensitivities, strict=True)]).reshape(moved.shape)
    missed = np.abs(moved - predicted)
    full, little = downweight > 0.9, downweight < 0.3
    assert full.mean() > 0.6
    assert np.sqrt(np.mean(missed[full] ** 2)) < 0.5 * np.sqrt(np.mean(moved[full] ** 2))
    # Some records bounce, and there it is far off.
    assert little.any()
    assert np.sqrt(np.mean(missed[little] ** 2)) > 3.0 * np.sqrt(np.mean(missed[full] ** 2))


def test_no_noise_no_error(task: Task) -> None:
    silent = dataclasses.replace(task, input_noise={"drive": Noise(0.0, 0.0, 0.0, 0)})
    assert input_errors(silent) == {}
