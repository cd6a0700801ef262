"""Series whose study is wrong: the records hold the mistake, the study does not; and the table counts what is told."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("numba", reason="the second simulator is compiled with numba: install the extra `bench`")

from tests.independent.laws import DRIVE, DROP
from tests.independent.make import write_study
from tests.independent.series import Plan, drop_plan
from tests.validation.mistakes import MISTAKES, Mistaken, as_said, exchanged, heavier, mistakes
from tests.validation.tables import append, read
from tests.validation.validate_mistakes import Told, table_of

WEIGHT = 3.096


def of(mistake: str, rig: str = DROP) -> Mistaken:
    return Mistaken("made here", mistake, rig, 0, "pink", 0.0)


def study_of(case: Mistaken, folder: Path) -> str:
    case.write(folder)
    return (folder / "study.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize("rig", [DROP, DRIVE])
@pytest.mark.parametrize("mistake", MISTAKES)
def test_the_study_says_what_it_would_say_of_a_rig_that_is_as_stated(rig: str, mistake: str, tmp_path: Path) -> None:
    said = study_of(of(mistake, rig), tmp_path / "wrong")
    assert 'weight_mass = "3.096 kg"' in said
    angles = {line for line in said.splitlines() if line.startswith("inclination")}
    expected = {90, 45} if rig == DROP else {30}
    assert angles == {f'inclination = "{angle} deg"' for angle in expected}


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_records_hold_the_mistake(sign: float) -> None:
    plan = drop_plan(10, 45, np.random.default_rng(0))
    true = {name: mistake.taken(plan, sign) for name, mistake in MISTAKES.items()}
    assert true["mass"].conditions == replace(plan.conditions, weight_mass=WEIGHT * (1.0 + 0.02 * sign))
    assert true["inclination"].conditions.inclination == pytest.approx(np.radians(45.0 + 2.0 * sign))
    np.testing.assert_allclose(true["clock"].times, plan.times * (1.0 + 0.01 * sign))
    assert true["swapped"] == true["sign"] == true["other fibre"] == plan


def greatest_forces(monkeypatch: pytest.MonkeyPatch, taken: Callable[[Plan, float], Plan]) -> np.ndarray:
    """Of each record of a series whose study is wrong about the weight, were it taken so."""
    monkeypatch.setitem(MISTAKES, "mass", MISTAKES["mass"]._replace(taken=taken))
    records = of("mass").make()[0].records
    assert {record.conditions.weight_mass for record in records} == {WEIGHT}, "what is told"
    return np.array([record.clean.force.max() for record in records])


def test_a_heavier_weight_pulls_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same series with the mistake and without; a fall into a spring pulls by more than the root of the mass."""
    usual = greatest_forces(monkeypatch, MISTAKES["mass"].taken)
    said = greatest_forces(monkeypatch, as_said)
    signs = (-1.0, 1.0)
    wrong = [greatest_forces(monkeypatch, lambda plan, _, sign=sign: heavier(plan, sign)) for sign in signs]
    for sign, forces in zip(signs, wrong, strict=True):
        assert np.all(sign * (forces / said - 1.0) > 0.01)
        assert np.all(sign * (forces / said - 1.0) < 0.02)
    assert any(np.array_equal(usual, forces) for forces in wrong)


def test_exchanged_headings_stand_over_each_other_s_columns(tmp_path: Path) -> None:
    of("swapped").write(tmp_path)
    record = of("swapped").make()[0].records[0]
    file = tmp_path / record.name
    assert file.read_text(encoding="utf-8").splitlines()[0] == "time [s],force [N],position [mm]"
    table = np.loadtxt(file, delimiter=",", skiprows=1)
    np.testing.assert_allclose(table[:, 1], record.logged.force, atol=0.006)
    np.testing.assert_allclose(1e-3 * exchanged(record).logged.force, record.logged.position)
    # In mm a place stands under the force, in N the weight under the position.
    assert np.ptp(table[:, 1]) < 15.0
    assert table[:, 2].max() > 20.0


def test_one_channel_is_logged_with_the_wrong_sign(tmp_path: Path) -> None:
    found = set()
    for number, case in enumerate(itertools.islice(mistakes("made here", "sign"), 8)):
        channel, place = case.turned
        found.add((channel, place is None))
        series, _ = case.make()
        write_study(series, tmp_path / str(number))
        for i, record in enumerate(series.records):
            with (tmp_path / str(number) / record.name).open(encoding="utf-8") as file:
                heads = next(file).split(",")
                (column,) = (at for at, head in enumerate(heads) if head.startswith(channel))
                readings = np.loadtxt(file, delimiter=",", usecols=column)
            clean = getattr(record.clean, channel)
            assert (np.corrcoef(readings, clean)[0, 1] < 0.0) == (place in (None, i)), (case.name, record.name)
        assert case.told == f"Check the sign of the {channel}:"
    assert len(found) > 2


def test_one_record_is_another_fibre_s() -> None:
    for case in itertools.islice(mistakes("made here", "other fibre"), 6):
        series, odd = case.make()
        exact = replace(case, scatter=0.0).make()[0]
        others = {record.base for record in exact.records if record.name != odd}
        assert len(others) == 1
        (one,) = [record.base for record in exact.records if record.name == odd]
        (usual,) = others
        ratio = one.stiffness / usual.stiffness
        assert max(ratio, 1.0 / ratio) > 1.1
        assert one.friction == usual.friction
        assert odd in {record.name for record in series.records}


def test_series_of_a_label_are_its_own_and_are_written_once(tmp_path: Path) -> None:
    first, other = (next(mistakes(label, "mass")) for label in ("a", "b"))
    assert first.seed != other.seed
    row = Told("a/mass", "a", "mass", DROP, 0, "pink", 0.0, "study.weight_mass", "named", "study.weight_mass", "",
               40.0, "r", "", True)  # fmt: skip
    append(tmp_path / "a.csv", row, "case")
    with pytest.raises(ValueError, match="another release"):
        append(tmp_path / "a.csv", row, "case")
    assert read(tmp_path / "a.csv", Told) == [row]
    assert "100.0 % (1 of 1" in "\n".join(table_of([row, replace(row, mistake="clock", right=False)]).lines())
    assert "0.0 % (0 of 1" in "\n".join(table_of([row, replace(row, mistake="clock", right=False)]).lines())
