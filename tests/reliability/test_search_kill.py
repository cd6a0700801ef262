"""A search killed at random moments, by process id, and resumed: the result of one that nobody killed."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from tests.reliability.studies import copied

DROPS = Path(__file__).resolve().parents[1] / "data" / "discover" / "viscous" / "study.toml"
LONGEST = 600.0
SETTINGS = ("--time", "600", "--figures", "none")


class Series(NamedTuple):
    """A series that is searched, and how often a search of it is killed.

    Parameters
    ----------
    tried : tuple of str
        Effects, so few that each search takes a minute or two.
    found : list of str
        What it adds to the model.
    """

    study: Path
    tried: tuple[str, ...]
    found: list[str]
    kills: int

    def command(self, out: Path, *words: str) -> list[str]:
        """Words of a search of it."""
        only = (f"--only={name}" for name in self.tried)
        return [
            sys.executable,
            "-m",
            "fibrefit",
            "discover",
            str(self.study),
            "--out",
            str(out),
            *only,
            *SETTINGS,
            *words,
        ]


RUBS = tuple(
    f"guide.{name}"
    for name in ("viscous_friction", "quadratic_drag", "friction_drift", "friction_wear", "stribeck_friction")
)
KILLS = {"drops": 10, "drive": 4}


def told(out: Path) -> dict[str, Any]:
    """What a result says, but for when and how long it was made."""
    summary = json.loads((out / "summary.json").read_text())
    summary.pop("provenance")
    return summary


def jobs_done(out: Path) -> int:
    """Results of a search that is under way, or was."""
    return len(list(out.parent.glob(f"{out.name}.partial/journal/*.job")))


def series_of(name: str, folder: Path) -> Series:
    """Drops with a viscous friction, or a drive whose guide is two degrees steeper than its study says."""
    if name == "drops":
        return Series(DROPS, RUBS, ["guide.viscous_friction"], KILLS[name])
    study = copied("drive_series", folder, records=3) / "study.toml"
    stated = study.read_text("utf-8")
    study.write_text(stated.replace('inclination = "30 deg"', 'inclination = "28 deg"'), "utf-8")
    assert study.read_text("utf-8") != stated
    return Series(study, ("study.inclination", *RUBS[:2]), ["study.inclination"], KILLS[name])


@pytest.fixture(scope="module")
def whole(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Series, dict[str, Any], int]:
    """A series, what a search says of it that nobody kills, and the jobs it is made of."""
    folder, most = tmp_path_factory.mktemp("search"), 0
    series, out = series_of(request.param, folder), folder / "whole"
    process = subprocess.Popen(series.command(out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while process.poll() is None:
        most = max(most, jobs_done(out))
        time.sleep(0.05)
    assert process.returncode == 0
    assert told(out)["added"] == series.found
    return series, told(out), most


@pytest.mark.slow
@pytest.mark.parametrize(
    ("whole", "number"), [(name, i) for name, kills in KILLS.items() for i in range(kills)], indirect=["whole"]
)
def test_a_kill_costs_nothing(tmp_path: Path, whole: tuple[Series, dict[str, Any], int], number: int) -> None:
    """Moments are counted in the jobs that a search is made of, so that they are spread over it on any machine."""
    series, expected, most = whole
    random = np.random.default_rng([13, number])
    done, more = int((number + random.uniform()) / series.kills * most), float(random.uniform(0.0, 0.3))
    out = tmp_path / "out"
    process = subprocess.Popen(series.command(out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    began = time.monotonic()
    while jobs_done(out) < done and process.poll() is None and not out.exists():
        assert time.monotonic() - began < LONGEST
        time.sleep(0.002)
    time.sleep(more)
    process.send_signal(signal.SIGKILL)
    process.wait()
    kept = jobs_done(out)
    print(f"\nkilled with {kept} of {most} jobs done{', after the end' if out.exists() else ''}")
    assert kept >= done or out.exists()
    if not out.exists():
        subprocess.run(series.command(out, "--resume"), check=True, capture_output=True, timeout=LONGEST)
    assert told(out) == expected
    assert {path.name for path in tmp_path.iterdir()} <= {"out", ".out.lock"}
