"""How the times grow with samples, records, parameters and lanes."""

from __future__ import annotations

import numpy as np

from tests.benchmarks import ours
from tests.benchmarks.problem import drop_task
from tests.benchmarks.simulations import CASES, SAMPLES
from tests.benchmarks.table import Table
from tests.benchmarks.timing import Contender, Stopwatch, spoken

BASE = CASES["in motion throughout"]
LENGTHS = (2000, 4000, 8000, 16000)
LANES = (1, 8, 64, 1024)
RECORDS = (1, 2, 5, 10, 20)


def tables(watch: Stopwatch) -> list[Table]:
    """All of them."""
    return [_samples(watch), _lanes(watch), _parameters(watch), _records(watch)]


def _relative(values: list[float]) -> list[str]:
    return [f"{value / values[0]:.2g}" for value in values]


def _samples(watch: Stopwatch) -> Table:
    point = ours.start(BASE)
    contenders = {
        f"{what} {n}": Contender(ours.done(ours.programs(n)[what], point), 9)
        for n in LENGTHS
        for what in ("run", "jacobian")
    }
    t = watch.interleaved(contenders)
    columns = [[t[f"{what} {n}"].median for n in LENGTHS] for what in ("run", "jacobian")]
    rows = [
        (str(n), spoken(run), a, spoken(jacobian), b)
        for n, run, jacobian, a, b in zip(LENGTHS, *columns, *map(_relative, columns), strict=True)
    ]
    note = "One record in motion throughout; relative to the first row."
    return Table("Growth with samples", note, ("samples", "run", "relative", "Jacobian", "relative"), rows)


def _lanes(watch: Stopwatch) -> Table:
    point, mine = np.asarray(ours.start(BASE)), ours.programs(SAMPLES)
    contenders = {}
    for n in LANES:
        rows_ = np.tile(point, (n, 1)) * np.linspace(0.95, 1.05, n)[:, None]
        contenders[str(n)] = Contender(ours.done(mine["run, vmap"], rows_), 3, n)
    t = watch.interleaved(contenders)
    each = [t[str(n)].median for n in LANES]
    rows = [(str(n), spoken(value), r) for n, value, r in zip(LANES, each, _relative(each), strict=True)]
    return Table(
        "Growth with runs at once",
        f"{SAMPLES} samples, time of each run under vmap.",
        ("runs", "each", "relative"),
        rows,
    )


def _parameters(watch: Stopwatch) -> Table:
    kinds = {5: (), 12: ours.EFFECTS}
    contenders = {}
    for n, effects in kinds.items():
        point, mine = ours.start(BASE, effects), ours.programs(SAMPLES, effects)
        if point.size != n:
            raise AssertionError(f"{point.size} parameters, {n} wanted")
        contenders[f"run {n}"] = Contender(ours.done(mine["run"], point), 9)
        contenders[f"jacobian {n}"] = Contender(ours.done(mine["jacobian"], point), 9)
    t = watch.interleaved(contenders)
    rows = [(str(n), spoken(t[f"run {n}"].median), spoken(t[f"jacobian {n}"].median)) for n in kinds]
    note = f"{SAMPLES} samples; twelve parameters are the base model's with those of {', '.join(ours.EFFECTS)}."
    return Table("Growth with parameters", note, ("parameters", "run", "Jacobian"), rows)


def _records(watch: Stopwatch) -> Table:
    contenders = {}
    for n in RECORDS:
        task = drop_task(n)
        contenders[str(n)] = Contender(lambda task=task: ours.fit(task), 3)
    t = watch.interleaved(contenders)
    times = [t[str(n)].median for n in RECORDS]
    rows = [(str(n), spoken(value), r) for n, value, r in zip(RECORDS, times, _relative(times), strict=True)]
    note = "A warm fit of the drop series; more than five records repeat it."
    return Table("Growth with records", note, ("records", "fit", "relative"), rows)
