"""``[limits]``: what an engineer says that a rig can do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fibrefit.core.errors import StudyError
from fibrefit.rigs.catalogue import RIGS
from fibrefit.study import Study, load_study
from fibrefit.study.rigs import study_type
from fibrefit.workflow.prepare import model_of

DROP = """
schema = "fibrefit/study/1"
name = "a drop"
[rig]
kind = "fibre_mass"
weight_mass = "3 kg"
inclination = "90 deg"
[[records]]
name = "one"
lift = "10 mm"
sampling_rate = "2 kHz"
duration = "0.3 s"
"""
DRIVE = """
schema = "fibrefit/study/1"
name = "a drive"
[rig]
kind = "pulley_drive"
weight_mass = "3 kg"
inclination = "30 deg"
[[records]]
name = "one"
excitation = "trapezoid"
amplitude = "60 mm"
rate = "200 mm/s"
sampling_rate = "2 kHz"
duration = "0.4 s"
"""


def read(folder: Path, limits: str, text: str = DROP) -> Study:
    (folder / "study.toml").write_text(f"{text}[limits]\n{limits}\n", encoding="utf-8")
    return load_study(folder)


def test_what_is_stated_reaches_the_rig(tmp_path: Path) -> None:
    study = read(tmp_path, 'lift = ["4 mm", "2 cm"]\ninclination = ["90 deg", "90 deg"]')
    upright = pytest.approx((np.pi / 2, np.pi / 2))
    assert study.possible == {"lift": (0.004, 0.02), "inclination": upright}
    assert model_of(study).rig.possible == study.possible
    # Written back, it is the same study; one that says nothing has no such table, and the rig of all others.
    again = tmp_path / "again"
    again.mkdir()
    (again / "study.toml").write_text(study.resolved_toml(), encoding="utf-8")
    assert load_study(again).possible == {"lift": (0.004, 0.02), "inclination": upright}
    plain = read(tmp_path, "")
    assert plain.possible == {}
    assert "limits" not in plain.resolved_toml()
    assert model_of(plain).rig is RIGS["fibre_mass"]


@pytest.mark.parametrize(
    ("text", "limits", "says"),
    [
        (DROP, 'lift = ["20 mm", "4 mm"]', "lift from 20 mm to 4 mm; expected the least first"),
        (
            DROP,
            'lift = ["12 mm", "20 mm"]',
            "limits.lift: 12 mm to 20 mm; expected limits that hold every record",
        ),
        (DROP, 'lift = ["1 mm", "9.9 mm"]', "limits.lift: 1 mm to 9.9 mm; expected limits that hold every record"),
        (DROP, 'lift = ["4 kg", "20 kg"]', "lift"),
        (DROP, 'lift = ["-4 mm", "20 mm"]', "out of range"),
        (DROP, 'lift = "4 mm"', "lift"),
        (DROP, 'lfit = ["4 mm", "20 mm"]', 'Did you mean "lift"'),
        (DROP, 'drive_speed = ["4 mm/s", "20 mm/s"]', "unknown key"),
        (DROP, 'added_mass = ["-1 kg", "2 kg"]', "out of range"),
        (DRIVE, 'drive_speed = ["300 mm/s", "100 mm/s"]', "drive_speed from 300 mm/s to 100 mm/s"),
        (
            DRIVE,
            'inclination = ["31 deg", "60 deg"]',
            "limits.inclination: 31 deg to 60 deg; expected",
        ),
    ],
)
def test_limits_that_make_no_sense_are_refused(tmp_path: Path, text: str, limits: str, says: str) -> None:
    with pytest.raises(StudyError) as refused:
        read(tmp_path, limits, text)
    assert says in str(refused.value)


@pytest.mark.parametrize("kind", RIGS)
def test_all_that_can_be_varied_can_be_limited(kind: str) -> None:
    rig, limits = RIGS[kind], study_type(kind).model_fields["limits"].default
    run = rig.inputs if rig.anchor is None and not rig.derived else ()
    varied = {variation.condition for variation in rig.further}
    varied |= {f"{name}_{what}" for name in run for what in ("travel", "speed")}
    assert set(type(limits).model_fields) == varied
