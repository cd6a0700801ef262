"""Scales, masses and constants that are known within an uncertainty: what depends on them is known no better."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fibrefit.core.errors import StudyError
from fibrefit.problem.statement.layout import Belief, Layout, Range, Slot
from fibrefit.study import Study, load_study
from fibrefit.workflow.fit import Fit, fit_study
from fibrefit.workflow.prepare import model_of
from tests.laboratories import made

AMPERES = 2.07
"""Newtons for one ampere."""
ERROR = 0.29
PER_FORCE = ("mass", "friction", "guide.spring.spring_stiffness", "guide.viscous_friction.viscous_coefficient")
"""What is found of a driven cart, and grows with what its force is worth."""


def driven(folder: Path, force: str, position: str = '"x [mm]"', more: str = "") -> Study:
    def drive(t: float) -> float:
        return 12.0 * np.sin(2.0 * np.pi * 0.7 * t) + 8.0 * np.sin(2.0 * np.pi * 1.9 * t)

    rows = made.cart(2.5, 200.0, drive, (0.012, 0.0))
    rows[:, 2] += 2e-5 * np.random.default_rng(3).standard_normal(len(rows))
    made.write(folder / "a.csv", "t [s],I [A],x [mm]", rows * [1.0, 1.0 / AMPERES, 1e3], "%.7g")
    text = f'[rig]\nkind = "guided_mass"\n[channels]\ntime = "t [s]"\nposition = {position}\nforce = {force}\n'
    text += '[model]\neffects = ["guide.spring", "guide.viscous_friction"]\n'
    return load_study(made.study(folder, f'{text}{more}[[records]]\nfile = "a.csv"\n'))


def fitted(study: Study) -> Fit:
    return fit_study(study, starts=2)


@pytest.mark.slow
def test_what_depends_on_an_uncertain_scale_is_known_no_better(tmp_path: Path) -> None:
    exact = fitted(driven(tmp_path, '{ column = "I [A]", scale = "2.07 N/A" }'))
    told = fitted(driven(tmp_path, f'{{ column = "I [A]", scale = "2.07 +/- {ERROR} N/A" }}'))
    relative = ERROR / AMPERES
    gain = told.parameters["push.force_gain.gain"]
    assert (gain.value, gain.std_error) == (pytest.approx(1.0, abs=1e-3), pytest.approx(relative, rel=1e-2))
    for name in PER_FORCE:
        # Mass, friction, stiffness and damping are a force over what is known exactly: errors add in squares.
        value = told.parameters[name].value
        propagated = np.hypot(exact.parameters[name].std_error, relative * value)
        assert told.parameters[name].std_error == pytest.approx(propagated, rel=0.03), name
        assert exact.parameters[name].std_error < 0.1 * propagated or name == "friction"
    zero = "guide.spring.spring_zero"
    assert told.parameters[zero].std_error == pytest.approx(exact.parameters[zero].std_error, rel=0.1)
    # What the prior leaves open stands in the error bars, and is no weakness of the records.
    assert not [
        check for check in told.identification.checks if check.identifier == "identifiability" and not check.passed
    ]


@pytest.mark.slow
def test_an_uncertain_scale_of_the_position_widens_what_divides_by_it(tmp_path: Path) -> None:
    study = driven(tmp_path, '{ column = "I [A]", scale = "2.07 N/A" }', '{ column = "x [mm]", scale = "1 +/- 0.05" }')
    found = fitted(study).parameters
    assert found["sensor.position_gain.gain"].std_error == pytest.approx(0.05, rel=1e-2)
    for name in PER_FORCE:
        # A force that holds is the same whatever a millimetre is.
        expected, slack = (0.0, 0.02) if name == "friction" else (0.05, 3e-3)
        assert found[name].std_error / found[name].value == pytest.approx(expected, abs=slack), name
    assert abs(found["mass"].value - made.CART["mass"]) < 0.1 * found["mass"].std_error


@pytest.mark.slow
def test_a_free_decay_needs_the_mass_only_as_well_as_it_is_known(tmp_path: Path) -> None:
    rows = made.cart(2.0, 200.0, lambda t: 0.0, (0.06, 0.0))
    made.write(tmp_path / "a.csv", "time [s],X [m]", rows[:, [0, 2]], "%.5f")
    text = '[rig]\nkind = "guided_mass"\ndriven_by = "nothing"\n[channels]\nposition = "X [m]"\n[model]\n'
    text += 'effects = ["guide.spring", "guide.viscous_friction"]\n[parameters.mass]\nprior = "1.9 +/- 0.05 kg"\n'
    fit = fitted(load_study(made.study(tmp_path, f'{text}[[records]]\nfile = "a.csv"\nadded_mass = "0 +/- 0.01 kg"\n')))
    found = fit.parameters
    (exact,) = [line for line in fit.summary().advice if "for exact" in line]
    assert 'takes added_mass for exact, though record "a.csv" says' in exact
    assert "mass is held by its prior, 1.900 +/- 0.050 kg" in " ".join(fit.report().split())
    assert fit.summary().parameters["guide.spring.spring_stiffness"].prior_error is None
    assert found["mass"].std_error == pytest.approx(0.05, rel=0.02)
    stiffness = found["guide.spring.spring_stiffness"]
    assert stiffness.value == pytest.approx(made.CART["stiffness"], rel=0.01)
    assert stiffness.std_error / stiffness.value == pytest.approx(0.05 / 1.9, rel=0.05)


DROP = '[rig]\nkind = "fibre_mass"\nweight_mass = "{mass}"\ninclination = "90 deg"\n[[records]]\nlift = "10 mm"\n'


def dropped(folder: Path, mass: str = "3.1 +/- 0.05 kg", more: str = "") -> Study:
    text = DROP.format(mass=mass) + 'name = "a"\nsampling_rate = "2 kHz"\nduration = "0.5 s"\n' + more
    return load_study(made.study(folder, text))


def test_a_constant_with_an_uncertainty_is_a_parameter_with_that_prior(tmp_path: Path) -> None:
    study = dropped(tmp_path)
    assert study.rig.weight_mass == study.records[0].weight_mass == 3.1
    model = model_of(study)
    assert [parameter.name for parameter in model.parameters] == ["stiffness", "damping", "friction", "weight_mass"]
    setting = study.settings({parameter.name: parameter for parameter in model.parameters})["weight_mass"]
    assert (setting.initial, setting.prior.centre, setting.prior.spread) == (3.1, 3.1, 0.05)
    # The resolved study reads back as the same.
    (tmp_path / "again.toml").write_text(study.resolved_toml(), encoding="utf-8")
    assert load_study(tmp_path / "again.toml").model_dump() == study.model_dump()
    plain = dropped(tmp_path, "3.1 kg")
    assert "weight_mass" not in [parameter.name for parameter in model_of(plain).parameters]


@pytest.mark.parametrize(
    ("mass", "more", "says"),
    [
        ("3.1 +/- 0.05 kg", 'weight_mass = "3.2 kg"\n', "another value than under"),
        ("3.1 +/- 0.05 mm", "", "kg"),
        ("3.1 kg", '[parameters.stiffness]\nprior = "1 +/- kN"\n', "a prior such as"),
        ("3.1 kg", '[parameters.stiffness]\nprior = "30 +/- 3 N"\n', "N/m"),
    ],
)
def test_an_uncertainty_that_means_nothing_is_refused(tmp_path: Path, mass: str, more: str, says: str) -> None:
    with pytest.raises(StudyError, match=says):
        study = dropped(tmp_path, mass, more)
        study.settings({parameter.name: parameter for parameter in model_of(study).parameters})


def test_a_constant_that_is_not_in_the_model_cannot_be_found(tmp_path: Path) -> None:
    text = DROP.format(mass="3.1 kg").replace("inclination", 'fibre_length = "599 +/- 1 mm"\ninclination')
    study = load_study(made.study(tmp_path, f'{text}name = "a"\nsampling_rate = "2 kHz"\nduration = "0.5 s"\n'))
    with pytest.raises(StudyError, match=r"rig\.fibre_length.*what the model does not contain"):
        model_of(study)


@pytest.mark.parametrize("log", [False, True])
def test_a_belief_is_one_more_residual(log: bool) -> None:
    belief = Belief(2.0, 0.1, log)
    layout = Layout(
        (Slot("a", "-", Range(-np.inf, np.inf, 1.0)), Slot("b", "-", Range(0.0, np.inf, 1.0), belief=belief)), ("r",)
    )
    values, step = np.array([5.0, 2.3]), 1e-6
    gram = layout.prior_gram(values)
    assert gram[-1, -1] == pytest.approx((np.log(2.3 / 2.0) if log else 0.3) ** 2 / 0.01)
    up, down = (layout.prior_gram(np.array([5.0, 2.3 + s]))[-1, -1] for s in (step, -step))
    assert 2.0 * gram[1, -1] == pytest.approx((up - down) / (2.0 * step))
    assert gram[1, 1] == pytest.approx(gram[1, -1] ** 2 / gram[-1, -1])
    assert not gram[0].any()
    assert not Layout(layout.slots[:1], ("r",)).prior_gram(values[:1]).any()
