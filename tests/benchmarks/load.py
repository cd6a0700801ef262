"""How commands grow with what they are given, from a prompt: time and the largest memory, and the exponent of both.

Each runs twice: with no programs compiled before, and with those that the first time left. Only the second grows with
the size alone; the first compiles a program for each shape it meets.

``python -m tests.benchmarks.load`` prints the tables, ``--only draws`` one of them.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from tests.benchmarks.limit import Drop, simulate
from tests.benchmarks.table import Table
from tests.benchmarks.timing import spoken

LINEAR = 1.15
"""Exponent of what a second run takes, up to which its growth counts as linear: the scatter of such a fit."""
SERIES = 3
"""Series of one size that a second run is the median of."""
POWERS = np.linspace(0.1, 3.0, 291)
"""Exponents that are tried."""
FLAT = 0.1
"""Share of the first row below which what is added is no growth, and has no exponent."""

MASS, GRAVITY, LENGTH = 3.096, 9.81, 1.79
TRUE = {"stiffness": 11_000.0, "damping": 9.5, "friction": 2.7}
LIFTS = (0.005, 0.01, 0.02)
NOISE = {"force": 0.3, "position": 2e-5}
RATE = 2000.0

HEAD = """schema = "fibrefit/study/1"
name = "load"

[rig]
kind = "fibre_mass"
weight_mass = "3.096 kg"
fibre_length = "599 mm"
fibre_mass = "1.63 g"

[channels]
time = "time [s]"
force = "force [N]"
position = "position [mm]"
"""


class Load(NamedTuple):
    """Something that grows.

    Parameters
    ----------
    title : str
    sizes : tuple of int
        From the smallest to the largest, wide enough that what grows is more than what is there anyhow.
    series : callable
        Number of records and samples a second, of a size.
    words : callable
        Command line, without the study and the folder, of a size.
    """

    title: str
    sizes: tuple[int, ...]
    series: Callable[[int], tuple[int, float]]
    words: Callable[[int], tuple[str, ...]]


class Measured(NamedTuple):
    """What a command took.

    Parameters
    ----------
    seconds : float
        By the clock.
    processor : float
        Spent by it and all its processes, s.
    memory : float
        Largest of any of its processes, MB.
    """

    seconds: float
    processor: float
    memory: float


WALKERS, ENSEMBLES = 32, 4

LOADS = {
    "batch": Load(
        "records in `batch`",
        (50, 250, 500, 1000),
        lambda n: (n, RATE),
        lambda n: ("batch", "--starts", "4", "--jobs", "1"),
    ),
    "records": Load("records in one `fit`", (5, 10, 20, 50), lambda n: (n, RATE), lambda n: ("fit",)),
    "samples": Load(
        "samples in one record",
        (10_000, 20_000, 40_000, 80_000, 160_000),
        lambda n: (1, n / LENGTH),
        lambda n: ("fit",),
    ),
    "draws": Load(
        "posterior draws",
        (19_968, 59_904, 120_064, 200_064),
        lambda n: (1, RATE),
        lambda n: (
            "sample", "--walkers", str(WALKERS), "--ensembles", str(ENSEMBLES), "--ess", "1e9", "--r-hat", "1.000001",
            "--max-steps", str(n // (WALKERS * ENSEMBLES)),
        ),
    ),
}  # fmt: skip


def write_series(folder: Path, records: int, rate: float, seed: int = 0) -> None:
    """A study of drops, each measured anew, by the hand-written simulation.

    Parameters
    ----------
    folder : Path
    records : int
    rate : float
        Samples a second.
    seed : int
    """
    random, rows = np.random.default_rng(seed), [HEAD]
    times = np.arange(round(LENGTH * rate)) / rate
    force, position = np.empty((2, times.size))
    for number in range(records):
        lift = LIFTS[number % len(LIFTS)]
        simulate(Drop(*TRUE.values(), MASS, MASS * GRAVITY, lift, 0.05), 1.0 / rate, force, position)
        noisy = [values + random.normal(0.0, NOISE[name], times.size) for name, values in
                 (("force", force), ("position", position))]  # fmt: skip
        table = np.column_stack([times, noisy[0], 1e3 * noisy[1]])
        name = f"drop_{number}.csv"
        np.savetxt(
            folder / name, table, ("%.7f", "%.3f", "%.4f"), ",", header="time [s],force [N],position [mm]", comments=""
        )
        rows.append(f'[[records]]\nfile = "{name}"\nlift = "{1e3 * lift:g} mm"\ninclination = "90 deg"\n')
    (folder / "study.toml").write_text("\n".join(rows), "utf-8")


def measured(load: Load, size: int) -> tuple[Measured, Measured]:
    """One command, each time in a process of its own: from an empty cache of programs, and from what that one kept.

    The second is the median of `SERIES` of them, each of a series of its own: how many steps a search takes over a
    whole record is chance.

    Raises
    ------
    RuntimeError
        If it fails.
    """
    with tempfile.TemporaryDirectory() as place:
        folder, again = Path(place), []
        command = (*load.words(size), "-q", "--force", "--out", str(folder / "out"))
        for seed in range(SERIES):
            write_series(folder, *load.series(size), seed)
            if not seed:
                first = _run(folder, command)
            again.append(_run(folder, command))
    return first, Measured(*np.median(again, axis=0))


def _run(folder: Path, words: tuple[str, ...]) -> Measured:
    command = [sys.executable, "-m", "fibrefit", words[0], str(folder), *words[1:]]
    with (folder / "said").open("wb") as said:
        began = time.perf_counter()
        cache = os.environ | {"FIBREFIT_CACHE": str(folder / "cache")}
        process = subprocess.Popen(command, stdout=said, stderr=said, env=cache)
        _, status, usage = os.wait4(process.pid, 0)
        seconds = time.perf_counter() - began
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in (0, 5):
        raise RuntimeError((folder / "said").read_text(errors="replace")[-2000:])
    return Measured(seconds, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024.0)


def exponent(sizes: Sequence[int], values: Sequence[float]) -> float:
    """Power of the size with which a value grows beyond what is there anyhow: 1 is linear, 2 quadratic.

    That of the least squares of ``base + factor * size**power``, base and factor not negative. An empty process with
    its libraries and programs is the base, and it is fitted too: what a process takes scatters by megabytes, whatever
    its size, so that ratios of what is added to a smallest size would say what chance made of that one.
    """
    powers = np.asarray(sizes, dtype=float)[:, None] ** POWERS / max(sizes) ** POWERS
    left = [nnls(np.column_stack([np.ones(len(sizes)), column]), np.asarray(values))[1] for column in powers.T]
    return float(POWERS[int(np.argmin(left))])


def growth(sizes: Sequence[int], values: Sequence[float]) -> str:
    """How values grow: their exponent, or that they do not."""
    return "flat" if max(values) - values[0] < FLAT * values[0] else f"{exponent(sizes, values):.2f}"


def too_fast(grown: Sequence[str]) -> bool:
    """Whether time of processors or memory of a second run grows faster than linear; the clock sees other work too."""
    return any(one != "flat" and float(one) > LINEAR for one in grown[len(Measured._fields) + 1 :])


def table(name: str) -> tuple[Table, bool]:
    """Times and memory of all sizes with their exponents, and whether one of them is more than linear."""
    load = LOADS[name]
    found = []
    for size in load.sizes:
        found.append(measured(load, size))
        print(f"{load.title}: {size}: {found[-1]}", file=sys.stderr, flush=True)
    rows = [
        (f"{size:,}".replace(",", " "), *(cell for one in both for cell in _cells(one)))
        for size, both in zip(load.sizes, found, strict=True)
    ]
    grown = [
        growth(load.sizes, [getattr(both[i], what) for both in found]) for i in (0, 1) for what in Measured._fields
    ]
    rows.append(("exponent", *grown))
    words = " ".join(load.words(load.sizes[-1]))
    note = (
        f"`fibrefit {words}`, from a prompt; again: median of {SERIES} series; exponents of what grows beyond a base."
    )
    heads = (f"{what}, {when}" for when in ("first", "again") for what in ("time", "processors", "largest memory"))
    return Table(f"Growth with {load.title}", note, (load.title, *heads), rows), too_fast(grown)


def _cells(one: Measured) -> tuple[str, str, str]:
    return spoken(one.seconds), spoken(one.processor), f"{one.memory:.0f} MB"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.load", description=__doc__)
    parser.add_argument("--only", choices=tuple(LOADS), action="append", help="make only this table, repeatable")
    given = parser.parse_args()
    beyond = []
    for name in given.only or LOADS:
        made, faster = table(name)
        beyond += [made.title] if faster else []
        print(made.text(), flush=True)
    if beyond:
        sys.exit(f"More than linear: {', '.join(beyond)}.")


if __name__ == "__main__":
    main()
