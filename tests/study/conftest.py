"""A study on disk, whose text each test may change."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fibrefit.study import Study, load_study

TEXT = """\
schema = "fibrefit/study/1"
name = "two drops"

[rig]
kind = "fibre_mass"
weight_mass = "3.096 kg"
fibre_length = "599 mm"
fibre_mass = "1.63 g"
inclination = "90 deg"

[channels]
time = "time [s]"
force = "Kraft"
position = "position [mm]"

[units]
force = "kN"

[model]
tension_law = "heaviside"
effects = ["guide.stribeck_friction"]

[parameters.stiffness]
initial = "30 kN/m"
bounds = ["1 kN/m", "300 kN/m"]

[parameters.friction]
fixed = "2.5 N"

[parameters.guide.stribeck_friction.breakaway_excess]
initial = "4 N"

[noise]
force = "0.4 N"
position = "0.02 mm"

[[records]]
file = "one.csv"
lift = "10 mm"
release = "0.1432 s"

[[records]]
file = "two.csv"
lift = "5 mm"
inclination = "45 deg"
position_zero = "-0.12 mm"
"""

#: Writes a study with some of its text replaced, next to its records, and reads it.
Loader = Callable[..., Study]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Folder with the two records of the study."""
    for name in ("one.csv", "two.csv"):
        (tmp_path / name).write_text("time [s],Kraft,position [mm]\n0,1,2\n")
    return tmp_path


@pytest.fixture
def load(folder: Path) -> Loader:
    """Write and read the study, with `changes` made to its text first."""

    def write_and_read(*changes: tuple[str, str], overrides: tuple[str, ...] = ()) -> Study:
        text = TEXT
        for old, new in changes:
            assert text.count(old) == 1, f"{old!r} is not there once"
            text = text.replace(old, new)
        (folder / "study.toml").write_text(text, encoding="utf-8")
        return load_study(folder / "study.toml", overrides)

    return write_and_read
