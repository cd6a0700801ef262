"""A mass of which the velocity was measured: what was put in is found, driven by the force and along the motion."""

from __future__ import annotations

from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.core.errors import DataError, StudyError
from fibrefit.study import load_study
from fibrefit.workflow.fit import Fit, fit_study
from fibrefit.workflow.prepare import read_records, task_of
from tests.laboratories import made

HEAD = "time [s],force [N],speed [mm/s]"
FORCE_NOISE, SPEED_NOISE = 0.15, 1e-3
"""Rms in N and in m/s."""
RATE, FINER = 500.0, 20
SECONDS = 2.0
DRIFT = SPEED_NOISE * np.sqrt(SECONDS / RATE)
"""Rms in m by which the integral of the noise is wrong at the end of a record."""
LAWS = '[model]\neffects = ["guide.spring", "guide.viscous_friction"]\n'
NAMES = {
    "mass": "mass",
    "friction": "friction",
    "guide.spring.spring_stiffness": "stiffness",
    "guide.viscous_friction.viscous_coefficient": "viscous",
}


def drive(t: float) -> float:
    return 12.0 * np.sin(2.0 * np.pi * 0.7 * t) + 9.0 * np.sin(2.0 * np.pi * 2.3 * t)


@pytest.fixture(scope="module")
def record() -> np.ndarray:
    """Time, force and velocity of a cart on a spring that begins where the spring is slack."""
    fine = made.cart(SECONDS, FINER * RATE, drive, (made.CART["zero"], 0.0))
    rows = np.column_stack([fine[:, 0], fine[:, 1], np.gradient(fine[:, 2], fine[:, 0])])[::FINER]
    random = np.random.default_rng(1)
    return rows + random.standard_normal(rows.shape) * [0.0, FORCE_NOISE, SPEED_NOISE]


def study(folder: Path, record: np.ndarray, more: str, channels: str = 'velocity = "speed"') -> Path:
    made.write(folder / "a.csv", HEAD, record * [1.0, 1.0, 1e3], "%.7g")
    text = f'[rig]\nkind = "guided_mass"\n{more}[channels]\n{channels}\n{LAWS}[[records]]\nfile = "a.csv"\n'
    return made.study(folder, text)


def near(fit: Fit) -> None:
    for name, put_in in NAMES.items():
        found = fit.parameters[name]
        assert abs(found.value - made.CART[put_in]) <= 4.0 * found.std_error, f"{name}: {found}"
        assert found.std_error < 0.1 * made.CART[put_in]
    # Its place is counted from the first sample, where this one's spring is slack.
    zero = fit.parameters["guide.spring.spring_zero"]
    assert abs(zero.value) <= 4.0 * (zero.std_error + DRIFT)


@pytest.mark.slow
def test_driven_by_the_force(tmp_path: Path, record: np.ndarray) -> None:
    fit = fit_study(load_study(study(tmp_path, record, 'measured = "velocity"\n')), starts=1)
    near(fit)
    told = fit.summary().gap.channels
    assert told["velocity"].explained > 0.999
    assert told["velocity"].rms < 1.3 * SPEED_NOISE
    assert told["force"].explained > 0.999
    assert {"velocity"} == set(fit.identification.problem.model.rig.channels)


@pytest.mark.slow
def test_what_was_put_in_explains_the_velocity(tmp_path: Path, record: np.ndarray) -> None:
    """Without a search: in each window only the speed at its start is found."""
    known = {**{name: made.CART[put_in] for name, put_in in NAMES.items()}, "guide.spring.spring_zero": 0.0}
    problem = task_of(load_study(study(tmp_path, record, 'measured = "velocity"\n'))).problem
    assert set(problem.model.rig.channels) == {"velocity"}
    names = [slot.name for slot, _ in problem.layout.entries]
    residual = problem.residuals(jnp.array([known.get(name, 0.0) for name in names]))
    wrong = problem.residuals(jnp.array([1.05 * known.get(name, 0.0) for name in names]))
    rms = float(jnp.sqrt(jnp.mean(residual**2)))
    assert rms < 1.6
    assert float(jnp.sqrt(jnp.mean(wrong**2))) > 4.0


@pytest.mark.slow
def test_along_the_motion(tmp_path: Path, record: np.ndarray) -> None:
    fit = fit_study(load_study(study(tmp_path, record, 'measured = "velocity"\ndriven_by = "position"\n')), starts=1)
    near(fit)
    assert fit.summary().gap.channels["force"].rms < 1.3 * FORCE_NOISE


def test_its_column_may_be_scaled(tmp_path: Path, record: np.ndarray) -> None:
    """A motor's speed: turns a minute, and what one turn is worth, of either sign."""
    scaled = 'velocity = { column = "speed", unit = "rpm", scale = "-60 mm/s/rpm" }'
    study_file = study(tmp_path, record * [1.0, 1.0, -1.0 / 60.0], 'measured = "velocity"\n', scaled)
    (found,) = read_records(load_study(study_file))
    np.testing.assert_allclose(found.channels["velocity"], record[:, 2], atol=1e-6)


def test_refusals(tmp_path: Path, record: np.ndarray) -> None:
    file = study(tmp_path, record, 'measured = "velocity"\n', 'force = "force [N]"')
    with pytest.raises(DataError, match=r"no velocity channel.*\[channels\] velocity"):
        fit_study(load_study(file), starts=1)
    with pytest.raises(StudyError, match="free decay of which the velocity was measured"):
        load_study(study(tmp_path, record, 'measured = "velocity"\ndriven_by = "nothing"\n'))
    with pytest.raises(DataError, match="no position channel"):
        fit_study(load_study(study(tmp_path, record, "")), starts=1)
