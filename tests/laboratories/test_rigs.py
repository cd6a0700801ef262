"""Rigs of other laboratories, in made records of the form their loggers write: what was put in is found again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fibrefit.core.errors import DataError, StudyError
from fibrefit.report.sentences.fit import advice_sentence
from fibrefit.study import load_study
from fibrefit.workflow.fit import Fit, fit_study
from fibrefit.workflow.prepare import task_of
from tests.fitting import made as drops
from tests.laboratories import made

STARTS = 2
MASS_ERROR = 0.05
"""Standard uncertainty of the mass of a weight, in kg."""
FEW_ERRORS = 4.0
"""Standard errors by which a value may miss the truth."""
COUNTS = 2.0 * np.pi / 4000
"""Step of an encoder of 4000 counts a turn, in rad."""


def fitted(folder: Path, text: str) -> Fit:
    return fit_study(load_study(made.study(folder, text)), starts=STARTS)


def near(fit: Fit, name: str, truth: float, share: float = 0.02) -> None:
    """Within its error bar, or a share of it where the step of the encoder leaves next to none."""
    found = fit.parameters[name]
    assert abs(found.value - truth) <= max(FEW_ERRORS * found.std_error, share * abs(truth)), f"{name}: {found}"


@pytest.mark.slow
def test_a_pendulum_that_is_held_and_let_go(tmp_path: Path) -> None:
    rows = made.pendulum(seconds=8.0)
    held = np.column_stack([np.arange(-50, 0) / 100.0, np.full(50, rows[0, 1])])
    rows = np.vstack([held, rows])
    rows[:, 1] = COUNTS * np.round((rows[:, 1] + 0.02) / COUNTS)
    made.write(tmp_path / "swing.csv", "time [s],angle [deg]", rows * [1.0, 180.0 / np.pi])
    inertia = 0.02
    fit = fitted(
        tmp_path,
        f'[rig]\nkind = "pendulum"\nmoment_of_inertia = "{inertia} kg m^2"\n[[records]]\nfile = "swing.csv"\n',
    )
    near(fit, "length", made.PENDULUM["length"], 1e-3)
    near(fit, "damping", inertia * made.PENDULUM["damping"], 0.1)
    near(fit, "friction", inertia * made.PENDULUM["friction"], 0.1)
    (record,) = fit.summary().records.values()
    assert record.parameters["angle_zero"].value == pytest.approx(0.02, abs=COUNTS)
    assert fit.summary().gap.channels["angle"].explained > 0.999
    # Two starts are too few to agree by the check; what the swing itself is judged by passes.
    failed = {check.identifier for check in fit.identification.checks if not check.passed and check.about == "numbers"}
    assert failed <= {"starts", "identifiability"}


@pytest.mark.parametrize(
    ("said", "passes"),
    [
        ('prior = "2.1 +/- 0.1 kg"', True),
        ('prior = {kind = "uniform", lower = "1 kg", upper = "3 kg"}', False),
        ('shared = false\nprior = "2.1 +/- 0.1 kg"', False),
    ],
)
def test_a_prior_that_a_fit_does_not_weigh_is_no_scale_of_a_free_decay(tmp_path: Path, said: str, passes: bool) -> None:
    rows = made.cart(2.0, 200.0, lambda t: 0.0, (0.06, 0.0), 0.0)
    made.write(tmp_path / "plain.csv", "time [s],X [m]", rows[:, [0, 2]], "%.5f")
    text = '[rig]\nkind = "guided_mass"\ndriven_by = "nothing"\n[channels]\nposition = "X [m]"\n[model]\n'
    text += f'effects = ["guide.spring"]\n[parameters.mass]\n{said}\n[[records]]\nfile = "plain.csv"\n'
    study = load_study(made.study(tmp_path, text))
    if passes:
        assert task_of(study).start.size
    else:
        with pytest.raises(StudyError, match=r"a free decay, and a mass that is not held.*prior = "):
            task_of(study)


@pytest.mark.slow
def test_two_free_decays_of_a_cart_tell_its_mass_by_the_one_that_was_added(tmp_path: Path) -> None:
    for name, added in (("plain", 0.0), ("loaded", 0.986)):
        rows = made.cart(2.0, 200.0, lambda t: 0.0, (0.06, 0.0), added)
        made.write(tmp_path / f"{name}.csv", "time [s],X [m]", rows[:, [0, 2]], "%.5f")
    text = '[rig]\nkind = "guided_mass"\ndriven_by = "nothing"\n[channels]\nposition = "X [m]"\n[model]\n'
    text += 'effects = ["guide.spring", "guide.viscous_friction"]\n{hold}'
    text += '[[records]]\nfile = "plain.csv"\n[[records]]\nfile = "loaded.csv"\n{added}'
    with pytest.raises(StudyError, match=r"a free decay, and a mass that is not held.*the moving mass"):
        task_of(load_study(made.study(tmp_path, text.format(hold="", added=""))))
    fit = fitted(tmp_path, text.format(hold="", added='added_mass = "0.986 kg"\n'))
    near(fit, "mass", made.CART["mass"])
    near(fit, "friction", made.CART["friction"])
    near(fit, "guide.spring.spring_stiffness", made.CART["stiffness"])
    near(fit, "guide.spring.spring_zero", made.CART["zero"])
    near(fit, "guide.viscous_friction.viscous_coefficient", made.CART["viscous"])
    # The zero of the spring says what a constant force would.
    assert not fit.parameters["force_offset"].free


@pytest.mark.slow
def test_an_added_mass_calibrates_a_force_in_volts(tmp_path: Path) -> None:
    def drive(t: float) -> float:
        return 12.0 * np.sin(2.0 * np.pi * 0.7 * t) + 8.0 * np.sin(2.0 * np.pi * 1.9 * t)

    for name, added in (("plain", 0.0), ("loaded", 0.8)):
        rows = made.cart(2.5, 200.0, drive, (0.012, 0.0), added)
        made.write(tmp_path / f"{name}.csv", "t [s],U1 [V],x [mm]", rows * [1.0, 1.0 / 7.0, 1e3], "%.6g")
    text = '[rig]\nkind = "guided_mass"\n[channels]\ntime = "t [s]"\nposition = "x [mm]"\n'
    text += 'force = { column = "U1 [V]", unit = "V", scale = "1 N/V" }\n'
    text += '[model]\neffects = ["guide.spring", "guide.viscous_friction", "push.force_gain"]\n'
    text += '[[records]]\nfile = "plain.csv"\n[[records]]\nfile = "loaded.csv"\nadded_mass = "800 g"\n'
    fit = fitted(tmp_path, text)
    near(fit, "push.force_gain.gain", 7.0)
    near(fit, "mass", made.CART["mass"])
    near(fit, "guide.spring.spring_stiffness", made.CART["stiffness"])


def test_values_that_are_stated_are_where_the_search_begins(tmp_path: Path) -> None:
    rows = made.cart(2.0, 200.0, lambda t: 9.0 * np.sin(6.0 * t), (0.012, 0.0))
    made.write(tmp_path / "a.csv", "time [s],force [N],position [m]", rows)
    text = '[rig]\nkind = "guided_mass"\n[model]\neffects = ["guide.spring", "guide.viscous_friction"]\n'
    text += '{more}[[records]]\nfile = "a.csv"\n'
    free = task_of(load_study(made.study(tmp_path, text.format(more=""))))
    names = list(free.problem.layout.free_names)
    assert free.start[names.index("guide.spring.spring_stiffness")] == pytest.approx(made.CART["stiffness"], rel=0.1)
    # What is stated is taken off the force before the rest is looked for.
    held = '[parameters.mass]\ninitial = "1.2 kg"\n'
    other = task_of(load_study(made.study(tmp_path, text.format(more=held))))
    assert other.start[names.index("mass")] == 1.2
    moved = other.start[names.index("guide.spring.spring_stiffness")]
    assert moved < 0.95 * free.start[names.index("guide.spring.spring_stiffness")]


def test_a_sign_is_refused_only_where_it_is_proven(tmp_path: Path) -> None:
    head = "time [s],force [N],position [m]"
    text = '[rig]\nkind = "guided_mass"\n[[records]]\nfile = "a.csv"\n'
    times = np.arange(400) / 200.0
    fast = 0.01 * np.sin(12.0 * times)
    wrong = np.column_stack([times, 2.0 * 144.0 * fast, fast])
    made.write(tmp_path / "a.csv", head, wrong)
    with pytest.raises(DataError, match="the force does not go with the acceleration"):
        task_of(load_study(made.study(tmp_path, text)))
    # So slow that friction is all there is: nothing is proven, and the search may begin.
    slow = 0.1 * np.sin(0.5 * times)
    noise = np.random.default_rng(1).standard_normal(len(times))
    made.write(
        tmp_path / "a.csv", head, np.column_stack([times, 3.0 * np.sign(np.cos(0.5 * times)) + 0.3 * noise, slow])
    )
    assert task_of(load_study(made.study(tmp_path, text))).start.size


@pytest.mark.slow
def test_a_fall_of_which_the_force_alone_was_measured(tmp_path: Path) -> None:
    folder = tmp_path / "drops"
    drops.study(folder)
    for one in drops.records(share=0.3, seed=2):
        made.write(folder / one.name, "time [s],force [N]", np.column_stack([one.time, one.channels["force"]]))
    text = (folder / "study.toml").read_text(encoding="utf-8").replace('position = "position [mm]"\n', "")
    text = text.replace('kind = "fibre_mass"', 'kind = "fibre_mass"\nmeasured = "force"')
    text = "\n".join(line for line in text.splitlines() if not line.startswith("lift"))
    assert f'weight_mass = "{drops.MASS} kg"' in text
    text = text.replace(f'weight_mass = "{drops.MASS} kg"', f'weight_mass = "{drops.MASS} +/- {MASS_ERROR} kg"')
    (folder / "study.toml").write_text(text, encoding="utf-8")
    fit = fit_study(load_study(folder), starts=drops.STARTS)
    near(fit, "weight_mass", drops.MASS)
    assert fit.parameters["weight_mass"].std_error <= 1.01 * MASS_ERROR
    (told,) = [line for line in map(advice_sentence, fit.identification.advice) if "Force alone determines" in line]
    per_mass = float(told.split("stiffness over mass, ")[1].split(" ")[0])
    assert per_mass == pytest.approx(drops.TRUTH["stiffness"] / drops.MASS, rel=0.01)
    for name, value in drops.TRUTH.items():
        near(fit, name, value)
    for lift, record in zip(drops.LIFTS, fit.summary().records.values(), strict=True):
        assert record.parameters["lift"].value == pytest.approx(lift, rel=0.02)
