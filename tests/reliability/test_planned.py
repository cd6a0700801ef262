"""Records that are only planned: their length is counted before it is made, and each has a file of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fibrefit import fit, load_study, simulate
from fibrefit.core.errors import StudyError
from fibrefit.core.limits import MOST_PLANNED
from fibrefit.rigs.rig import STANDARD_GRAVITY

SERIES = Path(__file__).resolve().parents[2] / "configs" / "drop_series"
HELD = "".join(
    f'[parameters.{name}]\nfixed = "{value}"\n'
    for name, value in {"stiffness": "11 kN/m", "damping": "9 N s/m", "friction": "2 N"}.items()
)


def planned(folder: Path, *records: tuple[str, str, str]) -> Path:
    """A study of planned drops: name, sampling rate and duration of each."""
    head = (SERIES / "study.toml").read_text("utf-8").partition("[[records]]")[0]
    rows = [
        f'[[records]]\nname = "{name}"\nsampling_rate = "{rate}"\nduration = "{duration}"\nlift = "{5 + i} mm"\n'
        'inclination = "90 deg"\nrelease = "0.1 s"\n'
        for i, (name, rate, duration) in enumerate(records)
    ]
    (folder / "study.toml").write_text(head + HELD + "".join(rows), "utf-8")
    return folder


@pytest.mark.parametrize(
    ("rate", "duration", "says"),
    [
        ("1 MHz", "1e9 s", r"1e\+15 samples; expected 10 million at most, of all records together"),
        ("2 kHz", "1e6 s", r"2e\+09 samples; expected 10 million at most"),
        ("1e15 Hz", "1e15 s", r"1e\+30 samples; expected 10 million at most"),
        ("2 kHz", "1e-9 s", "a planned record of 1 samples; expected at least 16"),
        ("1e-9 Hz", "1 s", "a planned record of 1 samples; expected at least 16"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_a_length_that_cannot_be_is_refused_before_it_is_made(
    tmp_path: Path, rate: str, duration: str, says: str
) -> None:
    with pytest.raises(StudyError, match=says):
        simulate(load_study(planned(tmp_path, ("one", rate, duration))))


def test_the_records_of_a_study_are_counted_together(tmp_path: Path) -> None:
    half = f"{0.6 * MOST_PLANNED / 2e3:g} s"
    with pytest.raises(StudyError, match="two: a planned record of 6e.06 samples"):
        simulate(load_study(planned(tmp_path, ("one", "2 kHz", half), ("two", "2 kHz", half))))


@pytest.mark.slow  # how files are called is tested in core
def test_records_of_one_name_in_several_folders_do_not_replace_each_other(tmp_path: Path) -> None:
    """Nor do those whose names differ only behind a point, or in capitals."""
    names = ["monday/drop", "tuesday/drop", "drop_1.5", "drop_1.7", "Last", "last"]
    study = planned(tmp_path, *((name, "2 kHz", "0.3 s") for name in names))
    simulate(study).save(tmp_path / "out")
    files = sorted((tmp_path / "out" / "simulated").iterdir())
    assert [file.name for file in files] == [
        "Last.csv", "drop_1.5.csv", "drop_1.7.csv", "last_2.csv", "monday_drop.csv", "tuesday_drop.csv",
    ]  # fmt: skip
    assert len({file.read_text("utf-8") for file in files}) == len(names)


def driven(folder: Path, duration: str, rig: str = "", rate: str = "20 mm/s") -> Path:
    """A study of one planned record of a driven rig."""
    head = (SERIES.parent / "drive_series" / "study.toml").read_text("utf-8").partition("[[records]]")[0]
    head = head.replace("[channels]", f"{rig}\n[channels]")
    record = (
        f'[[records]]\nname = "one"\nsampling_rate = "2 kHz"\nduration = "{duration}"\nexcitation = "quasi_sine"\n'
        f'amplitude = "60 mm"\nrate = "{rate}"\n'
    )
    (folder / "study.toml").write_text(head + HELD + record, "utf-8")
    return folder


def test_a_drive_that_does_not_move_in_its_record_is_refused(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="one: a drive that does not move within 8 s; expected at least one whole"):
        simulate(load_study(driven(tmp_path, "8 s")))


HEAD = 'schema = "fibrefit/study/1"\nname = "x"\n[rig]\n'
DROP = HEAD + 'kind = "fibre_mass"\nweight_mass = "3 kg"\ninclination = "90 deg"\n'
DRIVE = HEAD + 'kind = "pulley_drive"\nweight_mass = "3 kg"\ninclination = "30 deg"\n'
UPRIGHT = (SERIES.parent / "pendulum" / "study.toml").read_text("utf-8").partition("[sweep]")[0]
PLAN = '[[records]]\nname = "one"\nsampling_rate = "2 kHz"\nduration = "0.5 s"\n'


@pytest.mark.parametrize(
    ("study", "says"),
    [
        (DROP + HELD + PLAN, "one: no lift; expected it for a planned record. Give lift in the record."),
        (
            DROP + PLAN + 'lift = "5 mm"',
            "parameters.stiffness: no initial; expected a value: planned records have no data to find it from.",
        ),
        (
            DRIVE + HELD + PLAN,
            "one: no excitation and no amplitude and no rate; expected the movement of the drive of a planned record.",
        ),
        (
            DRIVE + HELD + PLAN + 'excitation = "trapezoid"\nrate = "20 mm/s"',
            "one: no amplitude; expected the movement of the drive of a planned record.",
        ),
        (UPRIGHT + PLAN, "one: no frequency; expected the movement of the driven ends."),
        (
            UPRIGHT.replace("amplitude =", "# amplitude =") + PLAN,
            "one: no amplitude and no frequency; expected the movement of the driven ends.",
        ),
    ],
)
def test_what_a_planned_record_lacks_is_asked_for(tmp_path: Path, study: str, says: str) -> None:
    (tmp_path / "study.toml").write_text(study, "utf-8")
    with pytest.raises(StudyError) as refused:
        simulate(load_study(tmp_path))
    assert says in str(refused.value)


def test_a_planned_record_among_measured_ones_is_no_measurement(tmp_path: Path) -> None:
    file = (SERIES / "drop_5mm_90deg.csv").as_posix()
    study = DROP + f'[[records]]\nfile = "{file}"\nlift = "5 mm"\n' + PLAN + 'lift = "7 mm"'
    (tmp_path / "study.toml").write_text(study, "utf-8")
    with pytest.raises(StudyError, match='record "one" has no file; expected a measured record. Name its file.'):
        fit(load_study(tmp_path))


def test_a_planned_weight_rests_where_its_fibre_slants(tmp_path: Path) -> None:
    """Tension over its lever holds the weight: with less it would slide before the drive begins."""
    slanting = 'lateral_offset = "400 mm"\nguide_distance = "900 mm"'
    made = simulate(load_study(driven(tmp_path, "2 s", slanting, "250 mm/s")))
    lever = 0.9 / np.hypot(0.9, 0.4)
    held = 3.096 * STANDARD_GRAVITY * np.sin(np.radians(30.0)) / lever
    before_it_moves = made.readings["force"][0, :400]
    assert before_it_moves == pytest.approx(np.full(400, held), rel=1e-3)
