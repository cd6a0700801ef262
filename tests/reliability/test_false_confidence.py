"""What would be believed wrongly: copies of one record, channels in each other's place, numbers off by a factor."""

from __future__ import annotations

import math
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fibrefit import fit
from fibrefit.core.errors import DataError, StudyError
from fibrefit.fitting import checks
from fibrefit.fitting.identify import identify
from fibrefit.fitting.result import Found
from fibrefit.problem import formulation as whole
from fibrefit.problem.diagnose.channels import force_and_position_exchanged, roughness
from fibrefit.report.sentences.fit import fit_sentence
from fibrefit.rigs.signals.trace import Trace
from fibrefit.study import load_study
from fibrefit.study.summaries.check import status_by
from fibrefit.study.summaries.results import ChannelGap
from fibrefit.workflow.prepare import read_records, task_of

SERIES = Path(__file__).resolve().parents[2] / "configs" / "drop_series"
FILE = "drop_10mm_90deg.csv"


def study_of(folder: Path, *files: str) -> Path:
    """A study of some files, under one set of conditions."""
    head = (SERIES / "study.toml").read_text("utf-8").partition("[[records]]")[0]
    records = [f'[[records]]\nfile = "{file}"\nlift = "10 mm"\ninclination = "90 deg"\n' for file in files]
    (folder / "study.toml").write_text(head + "\n".join(records), "utf-8")
    return folder


def written(folder: Path, name: str, *, digits: int | None = None, noise: float = 0.0) -> str:
    """A copy of a record under another name; with other digits, or measured anew."""
    lines = (SERIES / FILE).read_text("utf-8").splitlines()
    if digits is not None or noise:
        draws = np.random.default_rng(3).normal(size=(len(lines), 2)) * noise
        rows = [[float(cell) for cell in line.split(",")] for line in lines[1:]]
        lines[1:] = [
            ",".join(f"{value:.{digits or 12}f}" for value in (t, f + more[0], x + more[1] / 100))
            for (t, f, x), more in zip(rows, draws, strict=False)
        ]
    (folder / name).write_text("\n".join(lines) + "\n", "utf-8")
    return name


@pytest.mark.parametrize("digits", [None, 7])
def test_one_record_under_several_names_is_refused(tmp_path: Path, digits: int | None) -> None:
    shutil.copy(SERIES / FILE, tmp_path / "r0.csv")
    names = [written(tmp_path, f"r{i}.csv", digits=digits) for i in (1, 2, 3)]
    with pytest.raises(StudyError, match=r'records "r0.csv" and "r1.csv" hold the same data.*Take one of the two off'):
        read_records(load_study(study_of(tmp_path, "r0.csv", *names)))


def test_a_test_that_was_repeated_is_two_records(tmp_path: Path) -> None:
    """The same conditions, the same motion, another noise: the negative control."""
    shutil.copy(SERIES / FILE, tmp_path / "r0.csv")
    name = written(tmp_path, "r1.csv", noise=0.05)
    assert len(read_records(load_study(study_of(tmp_path, "r0.csv", name)))) == 2


def traces(study: Path, exchanged: bool) -> list[Trace]:
    """Bare traces of a study's records."""
    found = []
    for record in read_records(load_study(study)):
        channels = {name: np.asarray(record.channels[name]) for name in ("force", "position")}
        if exchanged:
            channels = {"force": channels["position"], "position": channels["force"]}
        found.append(Trace(record.name, np.asarray(record.time), channels, {}, {}))
    return found


@pytest.mark.parametrize("name", ["drop_series", "drive_series", "guided_axis", "second_fibre", "lubricated_guide"])
def test_force_and_position_are_told_apart_on_every_rig(name: str) -> None:
    study = SERIES.with_name(name)
    right, wrong = traces(study, False), traces(study, True)
    assert not any(force_and_position_exchanged([trace]) for trace in right)
    assert all(force_and_position_exchanged([trace]) for trace in wrong)


def test_roughness_does_not_hang_on_units_nor_on_damage() -> None:
    times = np.arange(4000) / 2000.0
    values = np.sin(40.0 * times)
    assert roughness(times, 1e3 * values + 7.0) == pytest.approx(roughness(times, values), rel=1e-9)
    assert math.isnan(roughness(times, np.full(4000, 3.0)))
    damaged = np.where(np.arange(4000) % 50 == 0, np.nan, values)
    assert roughness(times, damaged) == pytest.approx(roughness(times, values), rel=0.01)


def test_a_refusal_of_exchanged_records_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    refusal = DataError("a.csv", "the record does not fall by its lift", "a weight that falls", "Check lift.")
    wrong, right = traces(SERIES, True), traces(SERIES, False)
    told = whole._with_exchange(refusal, wrong)
    assert "force and position look exchanged" in str(told)
    assert "under [channels]" in told.do
    assert whole._with_exchange(refusal, right) is refusal


@pytest.mark.parametrize(
    ("explained", "status"), [(0.999, "ok"), (0.98, "suspect"), (0.94, "failed"), (-3.0, "failed")]
)
def test_numbers_of_no_use_are_failed(explained: float, status: str) -> None:
    gap = ChannelGap.against_noise(0.4, 10.0, "N", explained)
    check = checks.check("explained_share", checks.signal_explained({"force": gap}))
    assert status_by([check]) == status
    assert ("of no use" in fit_sentence(check)) == (status == "failed")


def test_exchanged_channels_fail_a_fit() -> None:
    assert status_by([checks.check("exchanged_channels", Found(passed=False))]) == "failed"


TRUTH = {"stiffness": 11150.63, "damping": 9.437, "friction": 2.686}
"""Of the drop series."""


def mistaken(
    folder: Path, late: int = 0, force: float = 1.0, position: float = 1.0, clock: float = 1.0, **stated: str
) -> Path:
    """A study of one drop: its force some samples late, its readings or times too large, or what it states wrong."""
    times, *readings = np.loadtxt(SERIES / FILE, delimiter=",", skiprows=1).T
    times = clock * times
    readings[0] = force * np.concatenate([np.full(late, readings[0][0]), readings[0][: len(times) - late]])
    readings[1] = position * readings[1]
    head = (SERIES / FILE).read_text("utf-8").splitlines()[0]
    np.savetxt(folder / FILE, np.column_stack([times, *readings]), "%.6f", ",", header=head, comments="")
    study = study_of(folder, FILE) / "study.toml"
    text = study.read_text("utf-8")
    for name, value in stated.items():
        text = re.sub(rf'{name} = "[^"]*"', f'{name} = "{value}"', text)
    study.write_text(text, "utf-8")
    return folder


MISTAKES: dict[str, tuple[dict[str, Any], str]] = {
    "none": ({}, "ok"),
    "lift 11 for 10 mm": ({"lift": "11 mm"}, "failed"),
    "inclination 60 for 90 deg": ({"inclination": "60 deg"}, "failed"),
    "force 5 ms late": ({"late": 10}, "failed"),
    "positions 1.2 times too large": ({"position": 1.2}, "failed"),
    "mass 10 % too large": ({"weight_mass": "3.406 kg"}, "suspect"),
    "force 5 % too large": ({"force": 1.05}, "suspect"),
    "clock 1 % fast": ({"clock": 1.01}, "suspect"),
    "force 1 ms late": ({"late": 2}, "suspect"),
}
QUICK = ("none",)
"""Those that are tried at every run; the others take half a minute each, or need many starts."""


@pytest.mark.parametrize(
    "mistake",
    [pytest.param(name, marks=[] if name in QUICK else [pytest.mark.slow]) for name in MISTAKES],
)
def test_values_off_by_a_factor_are_failed(tmp_path: Path, mistake: str) -> None:
    """And those that are a few percent off are not, nor are those of a record without a fault."""
    given, status = MISTAKES[mistake]
    found = identify(task_of(load_study(mistaken(tmp_path, **given))), starts=8)
    off = max(abs(math.log(max(found.parameters[name].value, 1e-3) / value)) for name, value in TRUTH.items())
    print(f"\n{mistake}: {found.status}, off by a factor of {math.exp(off):.3g}")
    assert found.status == status, [fit_sentence(check) for check in found.checks if not check.passed]
    assert (off > math.log(1.3)) == (status == "failed")


def test_a_file_with_its_columns_exchanged_is_refused_and_told(tmp_path: Path) -> None:
    rows = [line.split(",") for line in (SERIES / FILE).read_text("utf-8").splitlines()]
    lines = [",".join(rows[0]), *(",".join((time, position, force)) for time, force, position in rows[1:])]
    study_of(tmp_path, FILE)
    (tmp_path / FILE).write_text("\n".join(lines) + "\n", "utf-8")
    with pytest.raises(DataError, match="force and position look exchanged"):
        fit(tmp_path, starts=1)
