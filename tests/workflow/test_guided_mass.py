"""A guided mass under a measured force: what was put in is found again, and how sure it is, is said honestly."""

from __future__ import annotations

import functools
import os
from pathlib import Path
from tempfile import mkdtemp

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.core.errors import DataError, StudyError
from fibrefit.problem.formulation import _in_windows, in_order, stated_numbers, trace_of
from fibrefit.problem.statement.problem import Problem
from fibrefit.study import load_study
from fibrefit.workflow.fit import Fit, fit_study
from fibrefit.workflow.prepare import model_of, read_records, task_of
from tests.workflow import axis

VISCOUS = "guide.viscous_friction"
SHAPED = "guide.asymmetric_friction"
TRUE = {
    "mass": axis.TRUTH["mass"],
    "friction": axis.TRUTH["friction"],
    "force_offset": axis.TRUTH["offset"],
    f"{VISCOUS}.viscous_coefficient": axis.TRUTH["viscous"],
}
#: The integration behind the record is of first order, in steps of 0.1 ms.
MADE = 5e-3
#: Derivatives against differences: what does not change the slope of the cost is left out of them.
DIFFERENCES = 1e-2
STARTS = 4


@functools.cache
def fitted(effects: tuple[str, ...] = (VISCOUS,), window: str = "", **made: float) -> Fit:
    folder = Path(mkdtemp())
    return fit_study(load_study(axis.write(folder, effects, window, **made)), starts=STARTS)


def balance(fit: Fit) -> float:
    (check,) = (check for check in fit.identification.checks if "force" in check.name)
    assert check.statistic is not None
    return check.statistic


@pytest.mark.slow
def test_what_was_put_in_is_found_again() -> None:
    found = fitted(ripple=0.0)
    for name, value in TRUE.items():
        assert found.parameters[name].value == pytest.approx(value, rel=MADE)
    assert found.identification.gap["position"].ratio == pytest.approx(1.0, abs=0.1)
    assert found.identification.starts.agreeing == STARTS
    assert balance(found) < 1e-2


@pytest.mark.slow
def test_a_force_that_is_logged_wrongly_widens_the_errors_to_what_is_true() -> None:
    found = fitted(ripple=1.5)
    for name, value in TRUE.items():
        low, high = found.parameters[name].interval_95
        assert low < value < high, f"{name}: {low:.4g} to {high:.4g}"
    assert found.identification.error_inflation > 3.0
    failed = {check.identifier: check.about for check in found.identification.checks if not check.passed}
    assert failed["residual_size"] == "model"
    assert "discrepancy" in found.parameters["mass"].std_errors


@pytest.mark.slow
def test_without_widening_the_errors_would_be_too_small() -> None:
    found = fitted(ripple=1.5)
    misses = [
        abs(found.parameters[name].value - value) / found.parameters[name].std_errors["white"]
        for name, value in TRUE.items()
    ]
    assert max(misses) > 3.0


@pytest.mark.slow
def test_friction_that_differs_by_direction_is_found_in_sum_with_a_constant_force() -> None:
    lacking = fitted(asymmetry=0.25, ripple=0.0)
    complete = fitted((VISCOUS, SHAPED), asymmetry=0.25, ripple=0.0)
    # Two ends of one minimum, up to where a search stops.
    assert complete.identification.gap["position"].rms < (1.0 + 1e-6) * lacking.identification.gap["position"].rms
    # A constant force imitates it but for the instants of rest: only the sum of both is sure.
    push = complete.parameters["force_offset"].value
    push += complete.parameters["friction"].value * complete.parameters[f"{SHAPED}.asymmetry"].value
    assert push == pytest.approx(axis.TRUTH["offset"] + 0.25 * axis.TRUTH["friction"], abs=0.1)


def samples_of_a_window(path: Path) -> int:
    """Of the model of a study, with its records read and nothing else found in them."""
    study = load_study(path)
    model = model_of(study)
    read = zip(read_records(study), study.records, strict=True)
    traces = in_order([trace_of(record, model.rig, stated_numbers(said)) for record, said in read])
    return _in_windows(model, study, traces).window  # type: ignore[attr-defined]


def test_the_window_of_the_study_is_used(tmp_path: Path) -> None:
    for window, samples in (("", 50), ("0.2 s", 100)):
        assert samples_of_a_window(axis.write(tmp_path, (VISCOUS,), window, seconds=2.0, rate=500.0)) == samples


def short(tmp_path: Path) -> tuple[Problem, np.ndarray]:
    task = task_of(load_study(axis.write(tmp_path, (VISCOUS,), ripple=0.0, seconds=2.0)))
    return task.problem, np.array([TRUE[name] for name in task.problem.layout.free_names])


@pytest.mark.slow
def test_windows_begin_where_the_mass_was_and_not_where_its_smoothed_position_is(tmp_path: Path) -> None:
    problem, true = short(tmp_path)
    residuals = np.asarray(problem.residuals(jnp.asarray(true)))[0, 0, 50 : 20 * 50].reshape(19, 50)
    # Each window has two values of its own: its mean and its slope are zero. In the first the mass stands.
    times = np.arange(50) - 24.5
    assert np.abs(residuals.mean(axis=1)).max() < 0.5
    assert np.abs(residuals @ times / (times @ times)).max() * 25.0 < 0.5


@pytest.mark.slow
def test_derivatives_are_those_of_the_residuals(tmp_path: Path) -> None:
    problem, true = short(tmp_path)
    exact = np.asarray(jax.jacfwd(problem.residuals)(jnp.asarray(true)))[0, 0]
    for j, value in enumerate(true):
        size = 1e-5 * abs(value)
        up, down = (np.asarray(problem.residuals(jnp.asarray(true).at[j].add(d)))[0, 0] for d in (size, -size))
        error = np.sort(np.abs((up - down) / (2.0 * size) - exact[:, j]))
        # Where the mass turns round in a window, samples beside that instant change sides.
        assert np.sqrt(np.mean(error[: -len(error) // 20] ** 2)) < DIFFERENCES * np.sqrt(np.mean(exact[:, j] ** 2))


def test_refusals(tmp_path: Path) -> None:
    path = axis.write(tmp_path, (VISCOUS,), seconds=2.0)
    rows = np.loadtxt(tmp_path / "axis.csv", delimiter=",", skiprows=1)

    def changed(column: int, factor: float) -> None:
        other = rows.copy()
        other[:, column] *= factor
        np.savetxt(tmp_path / "axis.csv", other, delimiter=",", header="time [s],force [N],position [m]", comments="")

    changed(1, -1.0)
    with pytest.raises(DataError, match="the force does not go with the acceleration"):
        task_of(load_study(path))
    text = path.read_text().replace('file = "axis.csv"', 'name = "a"\nsampling_rate = "1 kHz"\nduration = "1 s"')
    path.write_text(text)
    with pytest.raises(StudyError, match="planned records of a guided_mass"):
        task_of(load_study(path))


@pytest.mark.slow
def test_the_study_that_ships(tmp_path: Path) -> None:
    found = fit_study(load_study(Path(__file__).resolve().parents[2] / "configs" / "guided_axis"), starts=STARTS)
    assert found.parameters["mass"].value == pytest.approx(axis.TRUTH["mass"], rel=0.01)
    assert found.parameters[f"{SHAPED}.asymmetry"].value == pytest.approx(0.2, abs=0.02)
    out = found.save(tmp_path / "out")
    assert (out / "figures" / "overview.png").is_file()
    assert "record axis.csv" in found.plot()


PUBLIC = "FIBREFIT_AXIS_RECORD"
"""Where the EMPS record of ONERA and LS2N lies as CSV of time [s], force [N], position [m]; it may not be copied here.

A. Janot, M. Gautier and M. Brunot, Data set and reference models of EMPS (2019).
"""


@pytest.mark.slow
@pytest.mark.skipif(PUBLIC not in os.environ, reason=f"the public record is not there: set {PUBLIC}")
def test_a_public_record_gives_the_published_values(tmp_path: Path) -> None:
    base, shaped = (
        fit_study(load_study(_public(tmp_path, effects, more)))
        for effects, more in (
            ((VISCOUS,), ""),
            ((VISCOUS, SHAPED, "guide.asymmetric_viscous_friction"), '[parameters.force_offset]\nfixed = "0 N"\n'),
        )
    )
    published = {
        "mass": (95.1089, 0.02),
        f"{VISCOUS}.viscous_coefficient": (203.5034, 0.08),
        "friction": (20.3935, 0.08),
    }
    for name, (value, share) in published.items():
        estimate = base.parameters[name]
        assert estimate.value == pytest.approx(value, rel=share)
        assert estimate.interval_95[0] < value < estimate.interval_95[1]
    assert base.identification.error_inflation > 5.0
    # Published: 4.08 % becomes 3.11 %.
    assert balance(shaped) / balance(base) == pytest.approx(3.11 / 4.08, abs=0.06)


def _public(folder: Path, effects: tuple[str, ...], more: str) -> Path:
    text = axis.STUDY.format(effects=", ".join(f'"{e}"' for e in effects), window="")
    text = text.replace('"axis.csv"', f'"{Path(os.environ[PUBLIC]).as_posix()}"').replace(
        "[[records]]", f"{more}[[records]]"
    )
    (folder / "study.toml").write_text(text, encoding="utf-8")
    return folder / "study.toml"


def test_windows_are_as_long_in_all_records(tmp_path: Path) -> None:
    axis.write(tmp_path, (), seconds=1.0)
    (tmp_path / "axis.csv").rename(tmp_path / "first.csv")
    axis.write(tmp_path, (), seconds=1.0, seed=1)
    study, text = tmp_path / "study.toml", (tmp_path / "study.toml").read_text()
    study.write_text(f'{text}window = "0.1 s"\n\n[[records]]\nfile = "first.csv"\nwindow = "0.2 s"\n')
    with pytest.raises(StudyError, match=r"windows of 0\.1 s and 0\.2 s; expected one length for all"):
        samples_of_a_window(study)
    study.write_text(f'{text}window = "0.1 s"\n\n[[records]]\nfile = "first.csv"\nwindow = "0.1 s"\n')
    assert samples_of_a_window(study) == 50


def test_windows_that_cannot_be_as_long_as_stated_are_refused(tmp_path: Path) -> None:
    """All hold as many samples: records of another rate would be followed in windows of another length."""
    study = axis.write(tmp_path, (), seconds=1.0)
    text = study.read_text()
    study.write_text(f'{text}window = "20 ms"\n')
    with pytest.raises(StudyError, match=r"a window of 0\.02 s at 500 Hz; expected 16 samples or more. State 0\.032 s"):
        samples_of_a_window(study)
    (tmp_path / "axis.csv").rename(tmp_path / "first.csv")
    axis.write(tmp_path, (), seconds=1.0, rate=250.0)
    study.write_text(f'{text}\n[[records]]\nfile = "first.csv"\n')
    samples_of_a_window(study)
    study.write_text(
        text.replace('kind = "guided_mass"', 'kind = "guided_mass"\nwindow = "0.1 s"')
        + '\n[[records]]\nfile = "first.csv"\n'
    )
    with pytest.raises(StudyError, match=r"a window of 0\.1 s, and records at 250 Hz and at 500 Hz; expected one rate"):
        samples_of_a_window(study)
