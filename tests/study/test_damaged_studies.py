"""Damaged studies with every key that tells how files are read: loaded, or refused; never a fault."""

from __future__ import annotations

import random
import time
from pathlib import Path

import pytest

from fibrefit.core.errors import FibrefitError
from fibrefit.workflow.inspection.inspection import inspect
from tests.study.test_fuzz import CHARACTERS

LONGEST = 20.0
TEXT = """schema = "fibrefit/study/1"
name = "volts"
[rig]
kind = "fibre_mass"
weight_mass = "3 kg"
inclination = "90 deg"
[channels]
time = "Zeit"
force = { column = "U1", unit = "V", scale = "-200 +/- 3 N/V" }
[units]
time = "s"
[files]
delimiter = ","
decimal = "."
sampling_rate = "2 kHz"
[parameters.stiffness]
bounds = ["1 kN/m", "300 kN/m"]
[[records]]
file = "a.csv"
parts = ["b.csv"]
header = "run.ini"
beside = { file = "x.csv", clock_offset = "-5 ms" }
channels = { position = "Weg" }
lift = "5 mm"
"""
FILES = {
    "a.csv": "Zeit,U1\n" + "".join(f"{i / 2000:.4f},{-0.05 - 0.001 * (i % 7):.4f}\n" for i in range(30)),
    "b.csv": "Zeit,U1\n" + "".join(f"{i / 2000:.4f},{-0.05 - 0.001 * (i % 7):.4f}\n" for i in range(30, 60)),
    "x.csv": "Zeit,Weg [mm]\n" + "".join(f"{i / 2000:.4f},{0.1 * i:.4f}\n" for i in range(60)),
    "run.ini": "fs = 2000 Hz\n",
}


def damaged(chance: random.Random) -> str:
    """The study with one to three damages."""
    text = TEXT
    for _ in range(chance.randint(1, 3)):
        i = chance.randrange(len(text) or 1)
        j = min(len(text), i + chance.randint(1, 15))
        lines = text.splitlines(keepends=True) or [""]
        k, m = chance.randrange(len(lines)), chance.randrange(len(lines))
        text = chance.choice(
            [
                text[:i] + text[j:],
                text[:j] + text[i:],
                text[:i] + chance.choice(CHARACTERS) + text[i + chance.randint(0, 1) :],
                "".join([*lines[:k], lines[m], *lines[k:]]),
                "".join(lines[:k] + lines[k + 1 :]),
                text[: max(i, 1)],
                text.replace(chance.choice(['"', "=", "{", "}", "\n", "N/V", "a.csv", "kHz"]), "", 1),
                text[:i]
                + chance.choice(["9" * 5000, "\\u0000", '"""', "{}", "[]", "-", "inf", "1979-05-27"])
                + text[i:],
            ]
        )
    return text


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def survive(number: int, folder: Path) -> bool:
    """Whether a damaged study was read with its files; fails for a fault, and for what takes too long."""
    (folder / "study.toml").write_text(damaged(random.Random(number)), encoding="utf-8", newline="")
    start = time.process_time()
    try:
        read = not inspect(folder).refusals
    except FibrefitError:
        read = False
    except Exception as error:
        raise AssertionError(f"number {number}: {type(error).__name__}: {error}") from error
    assert time.process_time() - start < LONGEST
    return read


def test_the_study_itself_is_read(rig: Path) -> None:
    (rig / "study.toml").write_text(TEXT)
    assert [seen.verdict for seen in inspect(rig).seen] == ["understood"] * 3


def test_200_damaged_studies(rig: Path) -> None:
    assert 3 < sum(survive(number, rig) for number in range(200)) < 190


@pytest.mark.slow
def test_2000_damaged_studies(rig: Path) -> None:
    assert 30 < sum(survive(number, rig) for number in range(1000, 3000)) < 1900
