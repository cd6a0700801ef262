"""Noise that a study states is the standard deviation of a reading in every record, at whatever rate it was logged."""

from __future__ import annotations

import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fibrefit.core.declarations import ROLES, USUAL_NOISE
from fibrefit.core.errors import StudyError
from fibrefit.problem.formulation import formulate
from fibrefit.rigs.catalogue import RIGS
from fibrefit.simulation.model import Model
from fibrefit.study import Study, load_study
from fibrefit.workflow.prepare import model_of, read_records, task_of

SERIES = Path(__file__).resolve().parents[2] / "configs" / "drop_series"
FORCE = 0.4
"""N."""


def stating(study: Study, force: float | None) -> Study:
    noise = study.noise.model_copy(update={"force": force})
    return study.model_copy(update={"records": study.records[:2], "noise": noise})


def thinned(record: Any) -> Any:
    """Every second sample of a record."""
    channels = {name: values[::2] for name, values in record.channels.items()}
    return SimpleNamespace(
        name=record.name, time=record.time[::2], channels=channels, rate=0.5 * record.rate, uniform=record.uniform
    )


def levels(study: Study) -> list[float]:
    """Noise by which readings of the force are weighed in each record, in N; the second is at half the rate."""
    first, second = read_records(study)
    observations = formulate(study, [first, thinned(second)], Model(RIGS["fibre_mass"], ())).problem.observations
    return (1.0 / np.max(np.asarray(observations.weight["force"]), axis=-1)).tolist()


def test_it_is_the_same_at_every_rate() -> None:
    study = load_study(SERIES)
    assert levels(stating(study, FORCE)) == pytest.approx([FORCE, FORCE])
    # The control: of a spectrum that rests show, half the band holds less.
    first, second = levels(stating(study, None))
    assert second < 0.9 * first


def test_so_it_is_of_records_that_are_planned(tmp_path: Path) -> None:
    text = (SERIES / "study.toml").read_text().split("[[record", 1)[0]
    records = "".join(
        f'[[records]]\nname = "{name}"\nsampling_rate = "{rate} Hz"\nduration = "1 s"\n'
        'lift = "60 mm"\ninclination = "90 deg"\n'
        for name, rate in (("fast", 2000), ("slow", 500))
    )
    initial = "".join(
        f'[parameters.{name}]\ninitial = "{value}"\n'
        for name, value in (("stiffness", "11 N/mm"), ("damping", "10 N*s/m"), ("friction", "3 N"))
    )
    (tmp_path / "study.toml").write_text(f'{text}\n{initial}[noise]\nforce = "{FORCE} N"\n{records}')
    weight = task_of(load_study(tmp_path)).problem.observations.weight["force"]
    assert (1.0 / np.max(np.asarray(weight), axis=-1)).tolist() == pytest.approx([FORCE, FORCE])


@pytest.mark.parametrize("measured", ["force", "force and position"])
def test_noise_of_a_channel_that_the_model_makes_no_use_of_is_refused(tmp_path: Path, measured: str) -> None:
    """Of drops without a position that level would change nothing."""
    folder = tmp_path / "series"
    shutil.copytree(SERIES, folder)
    path = folder / "study.toml"
    text = path.read_text().replace('kind = "fibre_mass"', f'kind = "fibre_mass"\nmeasured = "{measured}"')
    path.write_text(text + '[noise]\nposition = "0.05 mm"\n')
    study = load_study(folder)
    if measured == "force and position":
        assert model_of(study).rig.channels == ("force", "position")
        return
    with pytest.raises(StudyError, match="noise.position: noise of the position, of which the model of these records"):
        model_of(study)


def test_every_channel_has_a_usual_noise() -> None:
    """A record of it could not be planned without."""
    assert set(USUAL_NOISE) == set(ROLES) - {"time"}


def test_a_zero_of_the_position_that_a_study_states_is_held_on_a_drive_too(tmp_path: Path) -> None:
    drive = load_study(SERIES.parent / "drive_series")
    stated = drive.records[0].model_copy(update={"position_zero": 1.5e-4})
    task = task_of(drive.model_copy(update={"records": (stated, *drive.records[1:2])}))
    (slot,) = (one for one in task.problem.layout.slots if one.name == "position_zero")
    assert (slot.fixed_in(0), slot.fixed_in(1)) == (1.5e-4, None)
