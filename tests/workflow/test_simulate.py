"""Simulation of a study, and the way back: what was simulated can be identified."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from fibrefit.core.errors import DataError, UsageError
from fibrefit.plots.save import save_figures
from fibrefit.records import read_record
from fibrefit.study import Study, load_study
from fibrefit.workflow.fit import fit_study
from fibrefit.workflow.outcome.draw import draw_result
from fibrefit.workflow.outcome.stored import StoredSimulation, load_result
from fibrefit.workflow.simulate import simulate_study
from tests.fitting import made

VALUES = "".join(
    f'[parameters.{name}]\ninitial = "{value}"\n'
    for name, value in (("stiffness", "20 kN/m"), ("damping", "25 N s/m"), ("friction", "4 N"))
)
AS_PRINTED = 1e-8
"""Nine digits are written."""


@pytest.fixture(scope="module")
def stated(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """The series with the values it was made with."""
    folder = tmp_path_factory.mktemp("stated")
    study = made.study(folder, more=VALUES)
    made.write(folder, made.records(share=0.5, seed=3))
    return study


def test_the_simulation_is_what_was_measured_but_for_the_noise(stated: Study) -> None:
    simulation = simulate_study(stated)
    for channel, noise in made.NOISE.items():
        for r, trace in enumerate(simulation.task.traces):
            error = trace.channels[channel] - simulation.readings[channel][r, : made.SAMPLES]
            assert np.sqrt(np.mean(error**2)) == pytest.approx(noise, rel=0.15)


def test_a_mass_added_to_a_drop_is_one_more_part_of_its_weight(tmp_path: Path) -> None:
    whole, parts = ('[rig]\nweight_mass = "4 kg"\n', '[rig]\nweight_mass = "3 kg"\nadded_mass = "1 kg"\n')
    heading = 'schema = "fibrefit/study/1"\nname = "planned"\n'
    record = '[[records]]\nname = "drop"\nlift = "5 mm"\nsampling_rate = "1 kHz"\nduration = "0.3 s"\n'
    found = []
    for number, rig in enumerate((whole, parts)):
        file = tmp_path / f"{number}.toml"
        file.write_text(f'{heading}{rig}kind = "fibre_mass"\ninclination = "60 deg"\n{VALUES}{record}')
        found.append(simulate_study(load_study(file)).readings["force"])
    np.testing.assert_array_equal(*found)


def test_times_of_a_logger_that_has_run_for_days_stay_apart(tmp_path: Path) -> None:
    study = made.study(tmp_path / "late", more=VALUES)
    late = [dataclasses.replace(one, time=one.time + 250_000.0) for one in made.records(share=0.5, seed=3)]
    made.write(tmp_path / "late", late)
    out = simulate_study(study).save(tmp_path / "out")
    for one, file in zip(late, sorted((out / "simulated").iterdir(), key=lambda file: len(file.name)), strict=True):
        times = np.loadtxt(file, delimiter=",", skiprows=1, usecols=0)
        np.testing.assert_allclose(np.diff(times), 1.0 / made.RATE, rtol=1e-6)
        assert times[0] == pytest.approx(one.time[0], abs=1e-9)


def test_files_hold_the_readings_at_the_records_own_samples(stated: Study, tmp_path: Path) -> None:
    simulation = simulate_study(stated)
    out = simulation.save(tmp_path / "out")
    names = sorted(path.name for path in (out / "simulated").iterdir())
    assert names == ["drop_10mm.csv", "drop_5mm.csv"]
    assert len(list((out / "figures").glob("*.png"))) == 2
    path = out / "simulated" / "drop_5mm.csv"
    assert path.read_text().splitlines()[0] == "time [s],force [N],position [mm]"
    record = read_record(path)
    np.testing.assert_allclose(record.time, simulation.task.traces[0].times, atol=1e-12)
    for channel in made.NOISE:
        expected = simulation.readings[channel][0, : made.SAMPLES]
        np.testing.assert_allclose(record.channels[channel], expected, atol=AS_PRINTED * np.ptp(expected))


def test_a_saved_simulation_is_drawn_again_as_it_was(stated: Study, tmp_path: Path) -> None:
    out = simulate_study(stated).save(tmp_path / "out")
    for again in (draw_result(out), load_result(out).plot()):
        drawn = save_figures(again, tmp_path / "again")
        assert {path.name: path.read_bytes() for path in drawn} == {
            path.name: path.read_bytes() for path in (out / "figures").iterdir()
        }
    (out / "result.h5").unlink()
    with pytest.raises(UsageError, match="cannot be drawn from what was saved"):
        draw_result(out)


def test_a_saved_simulation_is_the_same_table(stated: Study, tmp_path: Path) -> None:
    simulation = simulate_study(stated)
    again = load_result(simulation.save(tmp_path / "out"))
    assert isinstance(again, StoredSimulation)
    assert set(again.to_dataframe().columns) == {"record", "time [s]", "force [N]", "position [mm]"}
    assert list(simulation.to_dataframe().columns) == list(again.to_dataframe().columns)
    assert len(simulation.to_dataframe()) == len(again.to_dataframe())
    assert len(repr(simulation).splitlines()) == len(repr(again).splitlines()) == 2


def test_a_saved_simulation_calls_its_records_as_the_study_does(stated: Study, tmp_path: Path) -> None:
    """In its order, by names of which a file's name keeps only a part."""
    called = ("run/1: 5 mm", "a run before it")
    records = tuple(
        record.model_copy(update={"name": name}) for record, name in zip(stated.records, called, strict=True)
    )
    simulation = simulate_study(stated.model_copy(update={"records": records}))
    out = simulation.save(tmp_path / "out")
    again = load_result(out)
    assert isinstance(again, StoredSimulation)
    assert tuple(again.records) == called
    assert again.to_dataframe()["record"].tolist() == simulation.to_dataframe()["record"].tolist()
    (out / "result.h5").unlink()
    told = load_result(out)
    assert isinstance(told, StoredSimulation)
    assert sorted(map(len, told.records.values())) == sorted(map(len, again.records.values()))
    for file in (out / "simulated").iterdir():
        file.unlink()
    with pytest.raises(DataError, match="simulated: no files; expected one for each record"):
        load_result(out).to_dataframe()


def test_what_was_simulated_is_identified(stated: Study, tmp_path: Path) -> None:
    out = simulate_study(stated).save(tmp_path / "out")
    made.study(out / "simulated")
    fit = fit_study(load_study(out / "simulated"), starts=made.STARTS)
    for name, estimate in fit.parameters.items():
        assert estimate.value == pytest.approx(made.TRUTH[name], rel=1e-4)
