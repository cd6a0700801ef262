"""``fibrefit sweep``: from a study to the files of the result, and what it refuses."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from fibrefit.store.hdf5 import read_result
from fibrefit.study import load_study
from tests.cli.conftest import Run

PENDULUM = Path(__file__).resolve().parents[2] / "configs" / "pendulum" / "study.toml"
FEW = ("--set", "sweep.lowest=4.2 Hz", "--set", "sweep.highest=4.4 Hz", "--set", "sweep.step=0.1 Hz")
BRANCHES = ("rest", "up", "down")


@pytest.fixture
def one_curve(tmp_path: Path) -> Path:
    """The study that ships, with its first curve alone."""
    text = PENDULUM.read_text(encoding="utf-8")
    path = tmp_path / "study.toml"
    path.write_text(text.partition("[[sweep.curves]]")[0], encoding="utf-8")
    return path


def test_files_of_a_sweep(fibrefit: Run, one_curve: Path) -> None:
    done = fibrefit("sweep", str(one_curve), *FEW, "--out", "out", "--json")
    assert done.code == 0, done.err
    document = done.document
    assert document["schema"] == "fibrefit/sweep/1"
    assert document["runs"] == 9
    (curve,) = document["curves"].values()
    assert curve["branches"]["rest"]["peak"]["frequency_hz"] == pytest.approx(4.3)
    with (Path("out") / "curves" / "inverted_pendulum.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["begun from"] for row in rows] == [name for name in BRANCHES for _ in range(3)]
    half = 0.5 * (float(rows[1]["angle max [rad]"]) - float(rows[1]["angle min [rad]"]))
    assert half == pytest.approx(curve["branches"]["rest"]["peak"]["angle_rad"], rel=1e-6)
    groups, attributes = read_result(Path("out") / "result.h5")
    assert attributes["schema"] == "fibrefit/sweep/1"
    assert groups["inverted_pendulum_rest"]["frequency"].unit == "Hz"
    assert (Path("out") / "figures" / "sweep_inverted_pendulum.png").is_file()
    again = fibrefit("show", "out", "--figures", "svg", "--out", "drawn")
    assert again.out.split() == [str(Path("drawn/sweep_inverted_pendulum.svg"))]
    assert load_study(Path("out")).sweep.step == pytest.approx(0.1)
    shown = fibrefit("show", "out")
    assert shown.code == 0
    assert "4.3 Hz" in shown.out
    assert max(map(len, shown.out.splitlines())) <= 80
    assert fibrefit("sweep", str(one_curve), *FEW, "--out", "out").code == 2


def test_the_study_that_ships_names_its_curves() -> None:
    study = load_study(PENDULUM)
    assert [curve.name for curve in study.sweep.curves] == ["20 mm", "60 mm", "20 mm, preload 585 N"]


@pytest.mark.parametrize(
    ("changes", "code", "message"),
    [
        (["sweep.lowest=5 Hz", "sweep.highest=4 Hz"], 4, "a value above lowest, 5 Hz"),
        (["sweep.step=1e-5 Hz"], 4, "at most 20000 frequencies"),
        (["sweep.sampling_rate=100 Hz"], 4, "at least 240 Hz: 20 steps a period"),
        (["sweep.stepp=0.1 Hz"], 4, 'Did you mean "step"'),
        (["sweep.step=3"], 4, "without a unit"),
    ],
)
def test_refusals(fibrefit: Run, one_curve: Path, changes: list[str], code: int, message: str) -> None:
    words = [word for change in changes for word in ("--set", change)]
    done = fibrefit("sweep", str(one_curve), *words)
    assert done.code == code
    assert message in done.err


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('amplitude = "20 mm"\n', "", "no amplitude"),
        ('initial = "8264 N/m"', 'bounds = ["1 kN/m", "2 kN/m"]', "no initial"),
        ('anchor_distance = "1.2 m"\n', "", "no anchor_distance"),
    ],
)
def test_what_a_sweep_needs(fibrefit: Run, one_curve: Path, old: str, new: str, message: str) -> None:
    text = one_curve.read_text(encoding="utf-8")
    assert old in text
    one_curve.write_text(text.replace(old, new), encoding="utf-8")
    done = fibrefit("sweep", str(one_curve), *FEW)
    assert done.code == 4
    assert message in done.err


@pytest.mark.parametrize(
    ("effect", "message"),
    [
        ("fibre.stiffness_drift", "which changes with time"),
        ("fibre.knot_slip@3", "goes by the place of a record in its series"),
        ("fibre.stiffness_trend", "goes by the place of a record in its series"),
        ("sensor.force_gain", "of a gauge or of the drive"),
    ],
)
def test_an_effect_without_a_part_in_steady_motion_is_refused(
    fibrefit: Run, one_curve: Path, effect: str, message: str
) -> None:
    done = fibrefit("sweep", str(one_curve), *FEW, "--set", f'model.effects=["{effect}"]')
    assert done.code == 4
    assert effect in done.err
    assert message in done.err


def test_a_constant_that_was_found_is_swept_as_it_was_found(fibrefit: Run, one_curve: Path) -> None:
    text = one_curve.read_text(encoding="utf-8")
    unsure = text.replace('"3.288 kg m^2"', '"3.288 +/- 0.1 kg m^2"')
    one_curve.write_text(unsure, encoding="utf-8")
    found = fibrefit(
        "sweep", str(one_curve), *FEW, "--set", "parameters.moment_of_inertia.initial=3.4 kg m^2", "--json"
    )
    (curve,) = found.document["curves"].values()
    one_curve.write_text(text.replace('"3.288 kg m^2"', '"3.4 kg m^2"'), encoding="utf-8")
    (stated,) = fibrefit("sweep", str(one_curve), *FEW, "--json").document["curves"].values()
    assert curve["natural_frequency_hz"] == stated["natural_frequency_hz"]
    one_curve.write_text(unsure + '[[sweep.curves]]\nname = "a"\nmoment_of_inertia = "3.5 kg m^2"\n', encoding="utf-8")
    refused = fibrefit("sweep", str(one_curve), *FEW)
    assert refused.code == 4
    assert 'curve "a": another moment_of_inertia than under [rig], where it is a parameter' in refused.err


def test_two_curves_of_one_name_are_refused(fibrefit: Run, one_curve: Path) -> None:
    text = one_curve.read_text(encoding="utf-8") + '[[sweep.curves]]\nname = "a"\n' * 2
    one_curve.write_text(text, encoding="utf-8")
    done = fibrefit("sweep", str(one_curve))
    assert done.code == 4
    assert "two curves of one name" in done.err


def test_another_rig_cannot_be_swept(fibrefit: Run) -> None:
    done = fibrefit("sweep", str(PENDULUM.parents[1] / "drop_series"))
    assert done.code == 2
    assert "a study of the rig fibre_mass" in done.err


def test_a_record_cannot_be_swept_whatever_its_rig(fibrefit: Run) -> None:
    """A sweep has no ``--rig`` that could be added."""
    Path("data.csv").write_text("time [s],force [N]\n0,1\n")
    done = fibrefit("sweep", "data.csv")
    assert done.code == 2
    assert "data.csv: a record; expected a study of an inverted pendulum." in done.err
    assert "--rig" not in done.err
    assert "no such file or folder" in fibrefit("sweep", "none.csv").err
