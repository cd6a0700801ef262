"""A mass whose measured motion leads: the force that it asks for is explained, and found to be what was put in."""

from __future__ import annotations

from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.core.errors import DataError, StudyError
from fibrefit.laws.pushes import PushDelay, PushGain, PushHold, PushLag
from fibrefit.problem.diagnose import newton
from fibrefit.report.sentences.fit import advice_sentence
from fibrefit.study import load_study
from fibrefit.workflow.fit import Fit, fit_study
from fibrefit.workflow.prepare import model_of, task_of
from tests.laboratories import made

HEAD = "time [s],force [N],position [mm]"
STARTS = 2
FORCE_NOISE = 0.15
"""Rms in N."""


def drive(t: float) -> float:
    return 12.0 * np.sin(2.0 * np.pi * 0.7 * t) + 9.0 * np.sin(2.0 * np.pi * 2.3 * t)


def rows(seed: int, seconds: float = 6.0) -> np.ndarray:
    found = made.cart(seconds, 500.0, drive, (0.012, 0.0))
    random = np.random.default_rng(seed)
    found[:, 1] += FORCE_NOISE * random.standard_normal(len(found))
    found[:, 2] += 1e-5 * random.standard_normal(len(found))
    return found


def study(folder: Path, effects: str, name: str = "a.csv", more: str = "") -> Path:
    text = '[rig]\nkind = "guided_mass"\ndriven_by = "position"\n[model]\n'
    text += f'effects = ["guide.spring", "guide.viscous_friction"{effects}]\n{more}[[records]]\nfile = "{name}"\n'
    return made.study(folder, text)


def near(fit: Fit, name: str, truth: float, share: float) -> None:
    found = fit.parameters[name]
    assert abs(found.value - truth) <= max(4.0 * found.std_error, share * truth), f"{name}: {found}"


@pytest.mark.slow
def test_inverse_dynamics_finds_what_was_put_in(tmp_path: Path) -> None:
    made.write(tmp_path / "a.csv", HEAD, rows(1) * [1.0, 1.0, 1e3], "%.7g")
    fit = fit_study(load_study(study(tmp_path, "")), starts=STARTS)
    near(fit, "mass", made.CART["mass"], 0.01)
    near(fit, "friction", made.CART["friction"], 0.05)
    near(fit, "guide.spring.spring_stiffness", made.CART["stiffness"], 0.01)
    near(fit, "guide.spring.spring_zero", made.CART["zero"], 0.01)
    near(fit, "guide.viscous_friction.viscous_coefficient", made.CART["viscous"], 0.03)
    told = fit.summary().gap.channels["force"]
    assert told.explained > 0.99
    assert told.rms < 1.4 * FORCE_NOISE
    # Where the mass hardly moves its friction is not known, and the force there is no evidence.
    counted = np.asarray(fit.identification.problem.observations.weight["force"]) > 0.0
    assert 0.4 * 3001 < counted.sum() < 0.95 * 3001
    made.write(tmp_path / "b.csv", HEAD, rows(2, 3.0) * [1.0, 1.0, 1e3], "%.7g")
    told = fit.predict(load_study(study(tmp_path, "", "b.csv")))
    assert told.summary().verdict == "holds"


LAWS = {
    "push.force_gain": PushGain(gain=1.3),
    "push.force_delay": PushDelay(delay=0.012),
    "push.force_lag": PushLag(time_constant=0.02),
    "push.hold": PushHold(period=0.01),
}


@pytest.mark.parametrize("name", LAWS)
def test_what_lies_between_a_command_and_its_force_is_undone(name: str) -> None:
    times = np.arange(3000) / 1000.0
    pushed = np.array([drive(t) for t in times])
    commanded = np.asarray(LAWS[name].commanded(jnp.asarray(pushed), jnp.asarray(times)))
    again, _ = LAWS[name].applied(jnp.asarray(commanded), jnp.gradient(commanded, times[1]), jnp.asarray(times))
    inside = slice(100, -100)
    assert np.max(np.abs(commanded - pushed)[inside]) > 0.5
    # A hold is undone to the second order in its period.
    np.testing.assert_allclose(np.asarray(again)[inside], pushed[inside], atol=0.02)


def test_inverse_dynamics_knows_conditions_as_laws_correct_them(tmp_path: Path) -> None:
    made.write(tmp_path / "a.csv", HEAD, rows(1, 2.0) * [1.0, 1.0, 1e3], "%.7g")
    text = '[rig]\nkind = "guided_mass"\n[model]\neffects = ["study.gain"]\n[[records]]\nfile = "a.csv"\ngain = 0.9\n'
    task = task_of(load_study(made.study(tmp_path, text)))
    names = task.problem.layout.names
    local = np.where(np.array(names) == "study.gain.error", 0.2, 1.0)
    system, _ = newton._system(task, task.traces[0], local)
    assert float(system.gain) == pytest.approx(0.9 * 1.2, rel=1e-12)


@pytest.mark.slow
def test_a_force_that_acts_late_on_a_measured_motion(tmp_path: Path) -> None:
    late, commanded = 0.012, rows(3)
    command = np.array([drive(t + late) for t in commanded[:, 0]])
    commanded[:, 1] = command + FORCE_NOISE * np.random.default_rng(4).standard_normal(len(commanded))
    made.write(tmp_path / "a.csv", HEAD, commanded * [1.0, 1.0, 1e3], "%.7g")
    fit = fit_study(load_study(study(tmp_path, ', "push.force_delay"')), starts=STARTS)
    near(fit, "push.force_delay.delay", late, 0.03)
    near(fit, "mass", made.CART["mass"], 0.02)


@pytest.mark.slow
def test_an_added_mass_tells_what_a_volt_is_worth(tmp_path: Path) -> None:
    for name, added in (("plain", 0.0), ("loaded", 0.8)):
        found = made.cart(3.0, 500.0, drive, (0.012, 0.0), added)
        made.write(tmp_path / f"{name}.csv", "t [s],U1 [V],x [mm]", found * [1.0, 1.0 / 7.0, 1e3], "%.7g")
    text = '[rig]\nkind = "guided_mass"\ndriven_by = "position"\n[channels]\ntime = "t [s]"\nposition = "x [mm]"\n'
    text += 'force = { column = "U1 [V]", unit = "V", scale = "6 +/- 3 N/V" }\n'
    text += '[model]\neffects = ["guide.spring", "guide.viscous_friction"]\n'
    text += '[[records]]\nfile = "plain.csv"\n[[records]]\nfile = "loaded.csv"\nadded_mass = "800 g"\n'
    fit = fit_study(load_study(made.study(tmp_path, text)), starts=STARTS)
    near(fit, "push.force_gain.gain", 7.0 / 6.0, 0.02)
    near(fit, "mass", made.CART["mass"], 0.02)


def test_what_makes_no_sense_along_a_measured_motion_is_refused(tmp_path: Path) -> None:
    made.write(tmp_path / "a.csv", HEAD, rows(1, 2.0) * [1.0, 1.0, 0.0])
    with pytest.raises(DataError, match=r"hardly moves|does not change"):
        task_of(load_study(study(tmp_path, "")))
    with pytest.raises(StudyError, match="a position that is measured and explained"):
        model_of(load_study(study(tmp_path, ', "sensor.position_gain"')))


@pytest.mark.slow
def test_one_stroke_in_one_direction_says_what_to_hold(tmp_path: Path) -> None:
    times = np.arange(400) / 200.0
    place = 0.1 * times + 0.02 * times**2 + 0.01 * np.sin(4.0 * times)
    speed = 0.1 + 0.04 * times + 0.04 * np.cos(4.0 * times)
    force = 2.0 * (0.04 - 0.16 * np.sin(4.0 * times)) + 6.0 * speed + 1.5
    force += 0.01 * np.random.default_rng(1).standard_normal(len(times))
    made.write(tmp_path / "a.csv", HEAD, np.column_stack([times, force, 1e3 * place]), "%.7g")
    text = '[rig]\nkind = "guided_mass"\n{way}[model]\neffects = ["guide.viscous_friction"]\n'
    text += '{held}[[records]]\nfile = "a.csv"\n'
    for way in ("", 'driven_by = "position"\n'):
        both = fit_study(load_study(made.study(tmp_path, text.format(way=way, held=""))), starts=STARTS)
        (told,) = [line for line in map(advice_sentence, both.identification.advice) if "one direction" in line]
        assert "record the way back too, or hold one of them" in told
        assert both.status == "suspect"
    held = text.format(way=way, held='[parameters.force_offset]\nfixed = "0 N"\n')
    one = fit_study(load_study(made.study(tmp_path, held)), starts=STARTS)
    assert not [line for line in map(advice_sentence, one.identification.advice) if "one direction" in line]
    near(one, "friction", 1.5, 0.02)
    near(one, "mass", 2.0, 0.02)


@pytest.mark.parametrize(
    ("driven_by", "key", "fits"),
    [
        ("nothing", "gain = 0.9", False),
        ("position", 'window = "0.1 s"', False),
        ("force", 'window = "0.1 s"', True),
        ("position", "gain = 0.9", True),
    ],
)
def test_what_only_a_mass_driven_otherwise_has_is_refused(tmp_path: Path, driven_by: str, key: str, fits: bool) -> None:
    """It would change nothing, and nobody would say so."""
    text = f'schema = "fibrefit/study/1"\nname = "axis"\n[rig]\nkind = "guided_mass"\ndriven_by = "{driven_by}"\n'
    (tmp_path / "a.csv").touch()
    (tmp_path / "study.toml").write_text(f'{text}[[records]]\nfile = "a.csv"\n{key}\n', encoding="utf-8")
    if fits:
        model_of(load_study(tmp_path))
        return
    with pytest.raises(StudyError, match=f"records.0..{key.partition(' ')[0]}: .* Leave it out"):
        model_of(load_study(tmp_path))
