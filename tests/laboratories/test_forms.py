"""Records in the very form that loggers of other laboratories write, identified from the prompt: values come back."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fibrefit.cli.main import run
from tests.laboratories import made

FEW_ERRORS = 4.0


def summary(folder: Path, *words: str) -> dict[str, Any]:
    """Of a command that was carried out, whether its result passed all checks or not."""
    out = folder / "out"
    assert run((*words, "--out", str(out), "-q")) in (0, 5)
    told: dict[str, Any] = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    return told


def near(told: dict[str, Any], truth: float, share: float) -> None:
    assert abs(told["value"] - truth) <= max(FEW_ERRORS * (told["std_error"] or 0.0), share * truth), told


@pytest.mark.slow
def test_a_carriage_in_volts_at_2_khz(tmp_path: Path) -> None:
    """The export of a National Instruments logger: an interval, and a column of times before each channel."""
    rows = made.cart(1.0, 2000.0, lambda t: 30.0 * np.sin(2.0 * np.pi * 4.0 * t), (0.012, 0.0))
    random = np.random.default_rng(5)
    volts = rows[:, 1] / -200.0 - 0.002 + 3e-4 * random.standard_normal(len(rows))
    place = (rows[:, 2] - 0.02) / 12.5e-3 + 2e-4 * random.standard_normal(len(rows))
    head = [
        "\ufeffTimestamp,2026-03-16 17:04:51,Timestamp,2026-03-16 17:04:51",
        "Interval,0.0005,Interval,0.0005",
        'Channel name,"Force",Channel name,"Input 1"',
        'Unit,"V",Unit,"V"',
    ]
    lines = [f"{t:.7g},{u!r},{t:.7g},{x!r}" for t, u, x in zip(rows[:, 0], volts.tolist(), place.tolist(), strict=True)]
    (tmp_path / "a3NI.csv").write_text("\n".join([*head, *lines]) + "\n", encoding="utf-8")
    study = made.study(
        tmp_path,
        '[rig]\nkind = "guided_mass"\n[channels]\nforce = { column = "Force", unit = "V", scale = "-200 N/V" }\n'
        'position = { column = "Input 1", unit = "V", scale = "12.5 mm/V" }\n'
        '[model]\neffects = ["guide.spring", "guide.viscous_friction"]\n[[records]]\nfile = "a3NI.csv"\n',
    )
    found = summary(tmp_path, "fit", str(study), "--starts", "4")["parameters"]
    near(found["mass"], made.CART["mass"], 0.01)
    near(found["guide.spring.spring_stiffness"], made.CART["stiffness"], 0.02)
    near(found["guide.viscous_friction.viscous_coefficient"], made.CART["viscous"], 0.05)
    near(found["friction"], made.CART["friction"], 0.1)


def batch(folder: Path, head: str, names: list[str]) -> dict[str, Any]:
    """Records without headings, one identification each."""
    listed = "".join(f'[[records]]\nfile = "{name}"\n' for name in names)
    study = made.study(folder, head + listed)
    found = summary(folder, "batch", str(study), "--each", "record", "--starts", "2", "--jobs", "1")["items"]
    assert list(found) == names
    return found


@pytest.mark.slow
def test_a_cart_on_a_belt_over_many_files(tmp_path: Path) -> None:
    """Four columns without headings, time stamps of a computer that jitter by some tens of microseconds."""
    names = []
    for number, start in enumerate((0.05, 0.06, 0.07)):
        rows = made.cart(
            3.0, 150.0, lambda t, n=number: (14.0 + n) * np.sin(2.0 * np.pi * (0.8 + 0.1 * n) * t), (start, 0.0)
        )
        random = np.random.default_rng(number)
        stamps = rows[:, 0] + 3e-5 * random.random(len(rows))
        ampere = np.round(rows[:, 1] / 3.3357 / 0.004) * 0.004
        place = np.round((rows[:, 2] + 0.15) / 1.7e-5) * 1.7e-5
        speed = np.gradient(place, 1.0 / 150.0)
        names.append(f"0m{100 * start:02.0f}.csv")
        table = np.column_stack([stamps, ampere, place, speed])
        np.savetxt(tmp_path / names[-1], table, delimiter=", ", fmt="%.5f")
    head = '[rig]\nkind = "guided_mass"\n[channels]\ntime = { column = "column 1", unit = "s" }\n'
    head += 'force = { column = "column 2", unit = "A", scale = "3.3357 N/A" }\n'
    head += 'position = { column = "column 3", unit = "m" }\n'
    head += '[model]\neffects = ["guide.spring", "guide.viscous_friction"]\n'
    for told in batch(tmp_path, head, names).values():
        near(told["parameters"]["mass"], made.CART["mass"], 0.02)
        near(told["parameters"]["guide.spring.spring_stiffness"], made.CART["stiffness"], 0.02)
        near(told["parameters"]["friction"], made.CART["friction"], 0.15)


@pytest.mark.slow
def test_pendulums_that_were_released_once(tmp_path: Path) -> None:
    """Time since the logger's start, angle of an encoder and its rate; held by hand before."""
    names, counts, inertia = [], 2.0 * np.pi / 8192, 0.2235 * 0.31692 * made.PENDULUM["length"]
    for number, start in enumerate((0.47, 0.52)):
        swing = made.pendulum(12.0, 150.0, start)
        held = np.column_stack([np.arange(-60, 0) / 150.0, np.full(60, start)])
        rows = np.vstack([held, swing])
        angle = counts * np.round(rows[:, 1] / counts)
        table = np.column_stack([rows[:, 0] + 2.74812, angle, np.gradient(angle, 1.0 / 150.0)])
        names.append(f"test{number + 1}pend1.csv")
        np.savetxt(tmp_path / names[-1], table, delimiter=", ", fmt="%.5f")
    head = '[rig]\nkind = "pendulum"\nmass = "0.2235 kg"\ncentre_distance = "0.31692 m"\n'
    head += '[channels]\ntime = { column = "column 1", unit = "s" }\nangle = { column = "column 2", unit = "rad" }\n'
    for told in batch(tmp_path, head, names).values():
        assert told["parameters"]["length"]["value"] == pytest.approx(made.PENDULUM["length"], rel=2e-3)
        near(told["parameters"]["damping"], inertia * made.PENDULUM["damping"], 0.1)
        near(told["parameters"]["friction"], inertia * made.PENDULUM["friction"], 0.1)
