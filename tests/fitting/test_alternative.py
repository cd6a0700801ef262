"""What a fault in a statement makes of the values: found with the values, and told only where it explains."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from fibrefit.fitting import checks as judge
from fibrefit.fitting.identify import identify
from fibrefit.fitting.misstatements import Alternative
from fibrefit.fitting.result import Identification
from fibrefit.laws.catalogue import CATALOGUE, is_alternative
from fibrefit.laws.fibre.relaxation import MaxwellBranch
from fibrefit.laws.fibre.series import Hardening
from fibrefit.laws.fibre.toe_region import ToeRegion
from fibrefit.laws.guide.friction_level import StribeckFriction
from fibrefit.laws.law import Effect, SensorLaw, StudyLaw
from fibrefit.report.sentences.fit import fit_sentence
from fibrefit.report.sentences.otherwise import CHECKED_BY, STATED_OTHERWISE
from fibrefit.rigs.catalogue import RIGS
from tests.fitting import made

LIFT = 1e-2


def of_one_drop(folder: Path, *, clock: float = 1.0, positions: float = 1.0) -> Identification:
    """A fit of one drop of 10 mm, its times and positions multiplied."""
    one = made.record("drop_10mm.csv", LIFT, seed=4, samples=2000)
    one = made.replace(one, position=positions * one.channels["position"])
    one = dataclasses.replace(one, time=clock * one.time, rate=one.rate / clock)
    return identify(made.task(folder, [one], lifts=(LIFT,)), made.STARTS, 0)


def told(found: Identification) -> Alternative | None:
    return next((check.facts["alternative"] for check in found.checks if check.identifier == judge.OTHERWISE), None)


@pytest.mark.parametrize(
    ("fault", "law", "size"),
    [
        pytest.param({"clock": 1.05}, "study.clock", 1.0 / 1.05 - 1.0, marks=pytest.mark.slow),
        pytest.param({"clock": 0.95}, "study.clock", 1.0 / 0.95 - 1.0, marks=pytest.mark.slow),
        pytest.param({"positions": 1.1}, "sensor.position_gain", 1.1, marks=pytest.mark.slow),
    ],
    ids=str,
)
def test_a_fault_that_puts_values_off_by_a_factor_is_found_and_fails_the_fit(
    tmp_path: Path, fault: dict[str, float], law: str, size: float
) -> None:
    found = of_one_drop(tmp_path, **fault)
    fault_found = told(found)
    assert fault_found is not None, [check.identifier for check in found.checks if not check.passed]
    assert fault_found.effect == law
    assert fault_found.size == pytest.approx(size, abs=0.003)
    assert fault_found.without == pytest.approx(made.TRUTH[fault_found.name], rel=0.05)
    values = dict(zip(found.problem.layout.free_names, found.values, strict=True))
    apart = max(max(values[n] / made.TRUTH[n], made.TRUTH[n] / max(values[n], 1e-9)) for n in made.TRUTH)
    assert (found.status == "failed") == (fault_found.factor > 1.5)
    assert fault_found.factor == pytest.approx(apart, rel=0.1) or apart > 10.0
    check = next(check for check in found.checks if check.identifier == judge.OTHERWISE)
    assert f"({law})" in fit_sentence(check)
    assert ("of no use" in fit_sentence(check)) == check.fatal


def lacking(folder: Path, *effects: type[Effect], **values: float) -> Identification:
    """A fit of the base model to one drop in which more is at work."""
    one = made.record("drop_10mm.csv", LIFT, seed=4, samples=2000, effects=effects, **values)
    return identify(made.task(folder, [one], lifts=(LIFT,)), made.STARTS, 0)


@pytest.mark.slow
def test_a_law_with_which_a_value_is_another_by_a_factor_fails_the_fit(tmp_path: Path) -> None:
    """Damping takes over what a branch of the fibre loses, and leaves little of it."""
    branch = {"fibre__maxwell_branch__branch_stiffness": 1e4, "fibre__maxwell_branch__relaxation_time": 6e-3}
    found = lacking(tmp_path, MaxwellBranch, **branch)
    (check,) = (check for check in found.checks if check.identifier == judge.OTHERWISE)
    law = check.facts["alternative"]
    assert (law.effect, law.name) == ("fibre.maxwell_branch", "damping")
    assert law.size == pytest.approx(1e4, rel=0.05)
    assert law.without == pytest.approx(made.TRUTH["damping"], rel=0.05)
    assert law.factor == pytest.approx(found.parameters["damping"].value / made.TRUTH["damping"], rel=0.05)
    assert found.status == "failed"
    assert "With fibre.maxwell_branch (" in fit_sentence(check)
    assert "the fit is of no use" in fit_sentence(check)


@pytest.mark.slow
def test_stribeck_friction_that_damping_takes_up_fails_the_fit(tmp_path: Path) -> None:
    """A friction that falls over the speeds of a bounce is a negative damping there."""
    shape = {"guide__stribeck_friction__breakaway_excess": 4.0, "guide__stribeck_friction__stribeck_velocity": 0.2}
    found = lacking(tmp_path, StribeckFriction, **shape)
    law = told(found)
    assert law is not None
    assert (law.effect, law.name) == ("guide.stribeck_friction", "damping")
    assert law.size == pytest.approx(4.0, rel=0.05)
    assert law.without == pytest.approx(made.TRUTH["damping"], rel=0.05)
    assert found.parameters["damping"].value < 0.5 * made.TRUTH["damping"]
    assert found.status == "failed"


@pytest.mark.slow
def test_a_law_that_leaves_the_values_as_they_are_fails_no_fit(tmp_path: Path) -> None:
    """A toe region is not among the laws; one that explains it as well leaves the values where they are."""
    found = lacking(tmp_path, ToeRegion, fibre__toe_region__toe_depth=0.5, fibre__toe_region__toe_length=4e-4)
    law = told(found)
    assert law is None or law.factor < 1.2
    assert found.status != "failed"
    assert not all(check.passed for check in found.checks)


@pytest.mark.slow
def test_a_sound_fit_is_not_asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fibrefit.fitting.checks.best_alternative", lambda *given: pytest.fail("it was asked"))
    assert of_one_drop(tmp_path).status == "ok"


@pytest.mark.slow
def test_a_law_is_not_put_down_to_a_statement(tmp_path: Path) -> None:
    """Hardening of the fibre, in two drops of other heights, is no fault in what the study states."""
    made_ones = made.records(effects=(Hardening,), fibre__hardening__hardening=200.0)
    found = identify(made.task(tmp_path, made_ones), made.STARTS, 0)
    law = told(found)
    assert law is not None
    assert law.effect == "fibre.hardening"
    assert found.status != "ok"


@pytest.mark.slow
@pytest.mark.parametrize("factor", [1.1, 0.9])
def test_a_wrong_mass_and_a_wrong_gain_explain_records_alike(tmp_path: Path, factor: float) -> None:
    """Both scale all that pulls: neither is said to be the one. The control is the mistake that nothing looks like."""
    ones = [made.replace(one, force=factor * one.channels["force"]) for one in made.records()]
    law = told(identify(made.task(tmp_path, ones), made.STARTS, 0))
    assert law is not None
    sizes = {law.effect: law.size} | {one.effect: one.size for one in law.alike}
    assert sizes.keys() == {"sensor.force_gain", "study.weight_mass"}
    assert sizes["sensor.force_gain"] == pytest.approx(factor, rel=0.01)
    assert sizes["study.weight_mass"] == pytest.approx(factor - 1.0, rel=0.05)
    alone = told(of_one_drop(tmp_path, clock=1.05))
    assert alone is not None
    assert (alone.effect, alone.alike) == ("study.clock", ())


def test_every_check_of_a_fault_is_named() -> None:
    assert set(CHECKED_BY) == set(STATED_OTHERWISE)


def test_every_law_a_fit_is_held_against_has_its_words() -> None:
    drop = RIGS["fibre_mass"]
    held = {name: law for name, law in CATALOGUE.items() if is_alternative(law, drop)}
    assert {name for name, law in held.items() if issubclass(law, StudyLaw | SensorLaw)} == set(STATED_OTHERWISE)
    for name, law in held.items():
        first = law.parameters[0]
        told_of = Alternative(name, 1.02 * first.typical, first.unit, "damping", "N s/m", 9.0, 4.0, 2.2)
        says = fit_sentence(judge.check("otherwise", judge.explained_otherwise(told_of)))
        assert "damping would be 4 N s/m in place of 9 N s/m: another by a factor of 2.2" in says, says
        assert says.endswith(
            "look at what the study states." if name in STATED_OTHERWISE else "run fibrefit discover."
        ), says
