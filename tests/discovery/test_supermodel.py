"""Frames: whitened products against dense algebra, and what the errors of noisy inputs are taken to be."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.discovery.design.beside import Beside
from fibrefit.discovery.design.distinguish import confusion
from fibrefit.discovery.engine.candidates import transferred
from fibrefit.discovery.engine.common_noise import common_noise_of
from fibrefit.discovery.engine.refit import refit
from fibrefit.discovery.engine.supermodel import (
    STRETCHES,
    Supermodel,
    change_products,
    simulation_groups,
    stretch_products,
    supermodel_of,
)
from fibrefit.discovery.search.inputs import coefficients_of
from fibrefit.discovery.search.setup import prepared_search
from fibrefit.laws.catalogue import CATALOGUE, find_effect
from fibrefit.problem.formulation import formulate
from fibrefit.problem.inputs.errors_in_variables import expanded, input_errors, no_errors
from fibrefit.problem.inputs.sensitivities import InputSensitivities, sensitivities_of
from fibrefit.problem.linear_model.view import with_best_input_errors
from fibrefit.problem.noise.coloured import BlockFilter
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.task import Task
from fibrefit.rigs.catalogue import RIGS
from fibrefit.simulation.model import Model
from fibrefit.study import load_study
from fibrefit.workflow.prepare import read_records, task_of
from tests.discovery import made
from tests.discovery.conftest import DATA

STUDY = Path(__file__).parents[2] / "configs" / "drive_series" / "study.toml"
#: InputSensitivities are kept in single precision.
SINGLE = 1e-4
#: Two ways to the same sum of some thousand squares.
EXACT = 1e-8
#: Of a change by a difference of two simulations, by programs that round otherwise.
DIFFERENCES = 1e-6


@pytest.fixture(scope="module")
def task() -> Task:
    """The first record of the drive series."""
    study = load_study(STUDY)
    study = study.model_copy(update={"records": study.records[:1]})
    return formulate(study, read_records(study), Model(RIGS["pulley_drive"], ()))


@pytest.mark.slow
def test_best_errors_and_costs_are_those_of_the_elimination(task: Task) -> None:
    known = input_errors(task)
    quiet = no_errors(known)
    sensitivities = sensitivities_of(task, task.start, quiet)
    assert sensitivities is not None
    # A little beside the values the sensitivities are those of.
    values = task.start * 1.0002
    parts = expanded(task.problem, known, values, quiet)
    whole = InputSensitivities.of(quiet, [rows for _, _, rows in parts], sensitivities.downweight)
    left = np.stack([residuals for residuals, _, _ in parts]) * sensitivities.downweight
    kept, waves = whole.split(left.reshape(len(parts), 1, -1))
    supermodel = supermodel_of(task, (), sensitivities)
    local = np.asarray(task.problem.layout.local(values))
    search: Any = SimpleNamespace(context=SimpleNamespace(whole=task.counts[-1]))
    fitted: Any = SimpleNamespace(supermodel=supermodel, local=local)
    own = coefficients_of(search, fitted)
    assert own is not None
    np.testing.assert_allclose(own["drive"], -waves[:, 0], atol=0.02 * np.abs(waves).max())
    cost = supermodel.costs(local, task.counts[-1]).sum()
    assert cost == pytest.approx(np.sum(kept**2) + np.sum(waves**2), rel=0.01)


@pytest.mark.slow
def test_far_from_a_right_model_nothing_counts_once_something_could_not_be_foretold() -> None:
    study = load_study(STUDY)
    study = study.model_copy(update={"records": study.records[-1:]})
    task = formulate(study, read_records(study), Model(RIGS["pulley_drive"], ()))
    quiet = no_errors(input_errors(task))
    near, far = (sensitivities_of(task, task.start, quiet, far) for far in (False, True))
    assert near is not None
    assert far is not None
    # The last record bounces, and comes to rest again: seen from nearby, what is after counts once more.
    assert np.any(np.diff(near.downweight, axis=-1) > 0.1)
    assert np.all(np.diff(far.downweight, axis=-1) <= 0.0)
    assert np.all(far.downweight <= near.downweight)


def test_an_absent_effect_changes_nothing(task: Task) -> None:
    sensitivities = sensitivities_of(task, task.start, no_errors(input_errors(task)))
    bare = supermodel_of(task, (), sensitivities)
    supermodel = supermodel_of(task, (find_effect("guide.viscous_friction"),), sensitivities)
    local = np.asarray(task.problem.layout.local(task.start))
    wider = transferred(supermodel, Supermodel(task), local)
    costs = [bare.costs(local, task.counts[-1]), supermodel.costs(wider, task.counts[-1])]
    np.testing.assert_allclose(*costs, rtol=SINGLE)


@pytest.fixture(scope="module")
def drops() -> Task:
    """Two short drops."""
    study = load_study(DATA / "viscous")
    return formulate(study, read_records(study), Model(RIGS["fibre_mass"], ()))


def coloured(task: Task) -> tuple[Noise, ...]:
    """Slow noise in one channel and a line in the other, as large as the noise at rest."""
    first, second = (task.noise[channel] for channel in task.problem.model.rig.channels)
    force, position = (noise.rms(0.8, 2000.0) ** 2 for noise in (first, second))
    return (
        Noise(5e-4 * force, 0.0, 0.0, 1000, slow=((8.0, 0.5 * force),)),
        Noise(1e-3 * position, 0.0, 0.0, 1000, lines=((83.7, 0.3 * position),)),
    )


def whitened(whitening: BlockFilter, rows: np.ndarray) -> np.ndarray:
    """Rows ``(n_row, n_record, n_channel * n_time)``."""
    shape = (*rows.shape[:2], whitening.taps.shape[2], -1)
    return np.asarray(whitening.whiten_rows(jnp.asarray(rows.reshape(shape)))).reshape(rows.shape)


def varied(task: Task, supermodel: Supermodel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values, two columns and their targets."""
    local = np.asarray(task.problem.layout.local(task.start))
    columns = np.array([supermodel.names.index(name) for name in ("stiffness", "friction")])
    return local, columns, local[:, columns] * (1.0 + 1e-5)


def changes(
    supermodel: Supermodel, local: np.ndarray, columns: np.ndarray, targets: np.ndarray, whole: np.ndarray
) -> np.ndarray:
    """Changes of the residuals and the residuals ``(n_column + 1, n_record, n_channel * n_time)``, one by one."""
    here, rows = np.asarray(supermodel.residuals(local, whole)), []
    for column, target in zip(columns, targets.T, strict=True):
        moved = local.copy()
        moved[:, column] = target
        rows.append(np.asarray(supermodel.residuals(moved, whole)) - here)
    return np.array([*rows, here])


def test_products_are_those_of_whitened_rows(drops: Task) -> None:
    supermodel, whole = supermodel_of(drops, ()), drops.counts[-1]
    common_noise = common_noise_of(supermodel, coloured(drops))
    values = varied(drops, supermodel)
    rows = whitened(common_noise.whitening, changes(supermodel, *values, whole))
    expected = np.einsum("irt,jrt->rij", rows, rows)
    found = common_noise.whitened(supermodel).grams(*values, whole)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-9 * np.abs(expected).max())
    assert common_noise.whitened(supermodel).costs(values[0], whole) == pytest.approx(expected[:, -1, -1], rel=EXACT)
    # The negative control: without whitening it is another sum of squares.
    assert not np.allclose(supermodel.costs(values[0], whole), expected[:, -1, -1], rtol=0.01)


def test_products_within_stretches_add_up(drops: Task) -> None:
    supermodel, whole = supermodel_of(drops, ()), drops.counts[-1]
    common_noise = common_noise_of(supermodel, coloured(drops))
    seen, values = common_noise.whitened(supermodel), varied(drops, supermodel)
    products = stretch_products(seen, *values, whole)
    assert products.shape == (2, STRETCHES, 3, 3)
    grams = seen.grams(*values, whole)
    np.testing.assert_allclose(products.sum(axis=1), grams, rtol=EXACT, atol=1e-12 * np.abs(grams).max())
    rows = whitened(common_noise.whitening, changes(supermodel, *values, whole))
    # A stretch holds a sixty-fourth of each record, all channels together.
    size = -(-rows.shape[-1] // (2 * STRETCHES))
    first = rows.reshape(3, 2, 2, -1)[..., :size]
    np.testing.assert_allclose(products[:, 0, -1, -1], np.sum(first[-1] ** 2, axis=(1, 2)), rtol=EXACT)


def test_the_change_from_one_place_to_another_is_one_row(drops: Task) -> None:
    supermodel, whole = supermodel_of(drops, ()), drops.counts[-1]
    common_noise = common_noise_of(supermodel, coloured(drops))
    local, columns, targets = varied(drops, supermodel)
    other = local.copy()
    other[:, columns] = targets
    products = change_products(common_noise.whitened(supermodel), local, other, whole)
    assert products.shape == (2, STRETCHES, 2, 2)
    here, there = (np.asarray(supermodel.residuals(values, whole)) for values in (local, other))
    rows = whitened(common_noise.whitening, np.array([there - here, here]))
    expected = np.einsum("irt,jrt->rij", rows, rows)
    np.testing.assert_allclose(products.sum(axis=1), expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())


def test_errors_of_inputs_are_eliminated_from_whitened_rows(task: Task) -> None:
    known = input_errors(task)
    plain = sensitivities_of(task, task.start, no_errors(known))
    assert plain is not None
    supermodel, whole = supermodel_of(task, (), plain), task.counts[-1]
    noise = tuple(task.noise[channel] for channel in task.problem.model.rig.channels)
    slow = tuple(Noise(of.white, of.pink, 0.0, 1000, slow=((8.0, 0.3 * of.rms(1.0, 2000.0) ** 2),)) for of in noise)
    common_noise = common_noise_of(supermodel, slow)
    local = np.asarray(task.problem.layout.local(task.start * 1.0002))
    left = whitened(common_noise.whitening, np.asarray(supermodel.residuals(local, whole))[None])[0, 0]
    directions = plain.records[0]
    every = directions.imitated(np.eye(len(directions.rows)), left.size)
    rows = whitened(common_noise.whitening, every[:, None])[:, 0]
    # The best errors, each with a prior of variance one, from one dense solve.
    wave = np.linalg.solve(rows @ rows.T + np.eye(len(rows)), rows @ left)
    cost = np.sum((left - wave @ rows) ** 2) + wave @ wave
    assert common_noise.whitened(supermodel).costs(local, whole).sum() == pytest.approx(cost, rel=SINGLE)
    # The negative control: were only the readings counted, the errors would cost nothing.
    assert wave @ wave > 10.0 * SINGLE * cost


def test_a_change_that_errors_of_the_input_make_good_is_in_no_reading(task: Task) -> None:
    """What values take along of the noise is put back with the errors of the input at their best for it."""
    known = input_errors(task)
    plain = sensitivities_of(task, task.start, no_errors(known))
    assert plain is not None
    shape = (1, 1, *np.asarray(task.problem.linearised_at(task.problem.layout.local(task.start)).residuals).shape[1:])
    strong = plain.records[0].imitated(1e3 * np.eye(len(plain.records[0].rows))[:1], int(np.prod(shape))).reshape(shape)
    left = with_best_input_errors(strong, strong, plain, plain)
    power = float(np.sum((strong / 1e3) ** 2))
    # Of a change along one direction a share of 1 / (1 + its power) is left.
    np.testing.assert_allclose(left, strong / (1.0 + power), rtol=SINGLE, atol=SINGLE * np.abs(strong).max())
    assert power > 100.0
    # The negative control: what no error of the input does stays as it is.
    every = plain.records[0].imitated(np.eye(len(plain.records[0].rows)), strong.size)
    other = np.random.default_rng(1).standard_normal(strong.size)
    other = (other - every.T @ np.linalg.lstsq(every.T, other, rcond=None)[0]).reshape(shape)
    np.testing.assert_allclose(
        with_best_input_errors(other, other, plain, plain), other, atol=SINGLE * np.abs(other).max()
    )


@pytest.mark.slow
def test_effects_simulated_in_groups_are_those_of_one_model(task: Task) -> None:
    effects = [
        find_effect(name)
        for name in ("guide.viscous_friction", "sensor.force_gain", "fibre.hardening", "pulley.capstan_friction")
    ]
    sensitivities = sensitivities_of(task, task.start, no_errors(input_errors(task)))
    whole = supermodel_of(task, effects, sensitivities)
    apart = replace(whole, groups=simulation_groups(effects))
    assert sorted(effect.name for group in apart.groups for effect in group) == sorted(one.name for one in effects)
    assert len(apart.groups) > 2
    local = transferred(whole, Supermodel(task), np.asarray(task.problem.layout.local(task.start)))
    strengths = [f"{effect.name}.{effect.strength[0]}" for effect in effects]
    # Not in the order of the groups, and more columns than are whitened at once.
    names = [strengths[2], "damping", strengths[0], *strengths[3:], "stiffness", strengths[1]]
    columns = np.array([whole.names.index(name) for name in names])
    targets = local[:, columns] + 0.01 * np.array([whole.declared[name].typical for name in names])
    counts = task.counts[-1]
    rows = np.asarray(apart.rows(local, columns, targets, counts))
    expected = np.asarray(whole.rows(local, columns, targets, counts))
    assert rows.shape == expected.shape
    assert np.all(np.abs(rows - expected).max(axis=-1) <= DIFFERENCES * np.abs(expected).max(axis=-1))
    np.testing.assert_allclose(
        np.asarray(apart.residuals(local, counts)), np.asarray(whole.residuals(local, counts)), atol=1e-9
    )


def test_what_takes_long_to_compile_is_in_no_group_with_others() -> None:
    groups = simulation_groups(list(CATALOGUE.values()))
    assert len([effect for group in groups for effect in group]) == len(CATALOGUE)
    (alone,) = (group for group in groups if find_effect("fibre.mass") in group)
    assert len(alone) == 1


def test_more_columns_than_a_program_has_are_simulated_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    study = load_study(STUDY.parents[1] / "drop_series")
    task = formulate(study, read_records(study), Model(RIGS["fibre_mass"], ()))
    effects = tuple(find_effect(name) for name in ("guide.viscous_friction", "fibre.toe_region", "sensor.force_offset"))
    columns = np.arange(7)
    local = np.array(task.problem.layout.local(task.start))

    def rows() -> np.ndarray:
        supermodel = supermodel_of(task, effects)
        whole = transferred(supermodel, supermodel_of(task, ()), local)
        targets = whole[:, columns] * 1.01 + 1e-3
        return np.asarray(supermodel.rows(whole, columns, targets, task.counts[-1]))

    expected = rows()
    assert np.ptp(expected, axis=1).max() > 1.0
    monkeypatch.setattr("fibrefit.discovery.engine.supermodel.WIDTH", 2)
    found = rows()
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


def test_a_lift_that_no_study_states_is_a_value_of_each_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It has no typical size, and the search counts it in units of its own."""
    for path in (DATA / "viscous").iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    text = (tmp_path / "study.toml").read_text(encoding="utf-8").splitlines()
    silent = [line for line in text if not line.startswith("lift")]
    (tmp_path / "study.toml").write_text("\n".join(silent), encoding="utf-8")
    task = task_of(load_study(tmp_path))
    assert len(silent) < len(text)
    assert "lift" in task.problem.layout.names
    monkeypatch.setitem(made.BASE, "lift", 0.012)
    search, base = prepared_search(task, made.identified(task), [made.VISCOUS], lambda *of: None)
    assert np.isfinite(base.local).all()
    assert np.isfinite(base.log)
    # In plain squares and in detection limits as in the likelihood.
    held, context = search.supermodel_for(made.VISCOUS), search.context
    local = transferred(held, base.supermodel, base.local)
    off = np.tile(base.local.mean(axis=0), (2, 1))
    squares = refit(base.supermodel, context.subset(()), off, context.whole)
    assert squares.cost < 0.5 * base.supermodel.costs(off, context.whole).sum()
    alike = confusion(held, context, local, [made.VISCOUS], lambda number: 10.0, Beside())
    assert 0.0 < alike.directions[0].smallest_detectable < np.inf
