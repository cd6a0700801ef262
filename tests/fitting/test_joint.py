"""Values and input errors found together."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from fibrefit.fitting.search.varpro import bounded_step, expected_gap, joint
from fibrefit.problem.formulate.formulate import formulate
from fibrefit.problem.inputs.errors_in_variables import input_errors
from fibrefit.rigs.catalogue import RIGS
from fibrefit.simulation.model import Model
from fibrefit.study import load_study
from fibrefit.workflow.prepare import read_records

STUDY = Path(__file__).parents[2] / "configs" / "drive_series" / "study.toml"
TRUTH = {"stiffness": 14693.386, "damping": 26.943, "friction": 3.951}


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10**6), st.integers(1, 5))
def test_a_step_inside_bounds_is_that_of_bounded_least_squares(seed: int, size: int) -> None:
    random = np.random.default_rng(seed)
    # Columns at right angles: stopping a value then never moves another one back inside.
    columns = np.linalg.qr(random.standard_normal((20, size)))[0] * random.uniform(0.1, 10.0, size)
    target = random.standard_normal(20)
    lower, upper = -random.uniform(0.0, 1.0, size), random.uniform(0.0, 1.0, size)
    step = bounded_step(columns.T @ columns, -columns.T @ target, lower, upper)
    np.testing.assert_allclose(step, lsq_linear(columns, target, (lower, upper), tol=1e-14).x, atol=1e-6)


def test_a_value_nothing_depends_on_stays() -> None:
    step = bounded_step(np.diag([4.0, 0.0]), np.array([-8.0, 0.0]), np.full(2, -9.0), np.full(2, 9.0))
    np.testing.assert_allclose(step, [2.0, 0.0])


def test_a_measured_drive_with_noise_leaves_neither_bias_nor_gap() -> None:
    study = load_study(STUDY)
    study = study.model_copy(update={"records": (study.records[0], study.records[3])})
    task = formulate(study, read_records(study), Model(RIGS["pulley_drive"], ()))
    layout, known = task.problem.layout, input_errors(task)
    start = task.start.copy()
    start[: len(TRUTH)] = [1.002 * TRUTH[slot.name] for slot, _ in layout.entries[: len(TRUTH)]]
    found = joint(task, known, start)
    samples = task.problem.n_measured
    gap = np.sqrt(np.sum(found.linear.residuals**2) / samples)
    expected, _ = expected_gap(task, known, found)
    assert gap == pytest.approx(expected, rel=0.03)
    assert expected < 1.0
    for (slot, _), value in zip(layout.entries, found.values[: len(TRUTH)], strict=False):
        assert value == pytest.approx(TRUTH[slot.name], rel=0.01)
    assert 0.2 < found.error_rms["drive"] / 1.05e-5 < 1.15
    # As it was measured, the drive leaves more.
    plain = np.asarray(task.problem.residuals(found.values))
    assert np.sqrt(np.sum(plain**2) / samples) > 1.03 * gap
