"""Counts how often 95 % intervals of a population hold its mean and its standard deviation.

``python -m tests.validation.validate_population --release LABEL --series 25`` makes so many further series of drops,
has `batch` identify their records and pool them, writes each parameter down as soon as its series is done, and prints
the table. Fibre, guide and the scatter between records are drawn anew for each series; its records differ in lift,
inclination and noise. The truth is what the records were drawn from, not what these happen to have.
"""

from __future__ import annotations

import argparse
import itertools
import math
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.independent.series import draw_base
from tests.validation.many_records import make
from tests.validation.tables import ROOT, Share, Table, append, median, read, revision

RESULTS = ROOT / "results" / "validate_population"
RECORDS = 8
SCATTERS = (0.0, 0.01, 0.03)
STARTS = 8
NAMES = ("stiffness", "damping", "friction")


@dataclass(frozen=True)
class Counted:
    """A parameter of one series; a row of the file of a release.

    Parameters
    ----------
    key, release : str
    index, used : int
        Number of the series; records that could be used.
    parameter : str
    scatter, mean : float
        That are true.
    mean_low, mean_high, sd, sd_low, sd_high : float
        Told.
    relative : bool
        Whether standard deviations are told relative to the mean.
    processor_seconds : float
    revision : str
    """

    key: str
    release: str
    index: int
    used: int
    parameter: str
    scatter: float
    mean: float
    mean_low: float
    mean_high: float
    sd: float
    sd_low: float
    sd_high: float
    relative: bool
    processor_seconds: float
    revision: str

    @property
    def holds_mean(self) -> bool:
        """Whether the interval of the mean holds it."""
        return self.mean_low <= self.mean <= self.mean_high

    @property
    def holds_sd(self) -> bool:
        """Whether that of the standard deviation does."""
        true = self.scatter * (1.0 if self.relative else self.mean)
        return self.sd_low <= true <= self.sd_high


def counted(release: str, index: int) -> list[Counted]:
    """Make a series, identify its records and pool them."""
    from fibrefit.workflow.batches.batch import batch_studies
    from fibrefit.workflow.batches.jobs import jobs_of, origins_of
    from tests.validation.cases import seed_of

    rng = np.random.default_rng(seed_of("population", release, str(index)))
    base, scatter, seed = draw_base(rng), SCATTERS[index % len(SCATTERS)], int(rng.integers(2**31))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        make(folder, RECORDS, seed, base, scatter)
        began = time.process_time()
        jobs = jobs_of(origins_of([str(folder)], None, ()), "record", STARTS, 0)
        summary = batch_studies(name, jobs, folder / "out").summary()
    used = sum(item.status in ("ok", "suspect") for item in summary.items.values())
    spent = time.process_time() - began
    rows = []
    for parameter in NAMES:
        one = summary.population.get(parameter)
        mean, sd = (one.mean_interval_95, one.between_records_interval_95) if one else ((math.nan,) * 2,) * 2
        rows.append(
            Counted(
                key=f"{release}/{index}/{parameter}",
                release=release,
                index=index,
                used=used,
                parameter=parameter,
                scatter=scatter,
                mean=getattr(base, parameter),
                mean_low=mean[0],
                mean_high=mean[1],
                sd=one.between_records if one else math.nan,
                sd_low=sd[0],
                sd_high=sd[1],
                relative=bool(one and one.relative),
                processor_seconds=spent,
                revision=revision(),
            )
        )
    return rows


def tables(rows: Sequence[Counted]) -> list[str]:
    """Shares of intervals with the truth, by scatter and parameter."""
    groups: Iterator[tuple[str, str, list[Counted]]] = (
        (what, name, [row for row in rows if row.parameter == name and row.scatter in among])
        for what, among in ((f"{100 * s:g} %", (s,)) for s in SCATTERS)
        for name in NAMES
    )
    whole = (("all", name, [row for row in rows if row.parameter == name]) for name in NAMES)
    everything = (("all", "all", list(rows)),)
    lines = [
        [what, name, len(group), Share.of(group, lambda row: row.holds_mean), Share.of(group, lambda row: row.holds_sd)]
        for what, name, group in itertools.chain(groups, whole, everything)
        if group
    ]
    seconds = median(row.processor_seconds / max(row.used, 1) for row in rows)
    said = f"Processor time of a record, median: {1e3 * seconds:.0f} ms, compilation included."
    return [
        *Table.of(["scatter", "parameter", "series", "mean held", "standard deviation held"], lines).lines(),
        "",
        said,
    ]


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.validation.validate_population", description=__doc__)
    parser.add_argument("--release", required=True, help="label; another one draws other series")
    parser.add_argument("--series", type=int, default=0, help="further series; 0 prints the table only")
    given = parser.parse_args()
    path = RESULTS / f"{given.release}.csv"
    known = {row.index for row in read(path, Counted)}
    for index in itertools.islice((i for i in itertools.count() if i not in known), given.series):
        rows = counted(given.release, index)
        for row in rows:
            append(path, row, "key")
        held = "".join(f" {row.parameter} {'+-'[not row.holds_mean]}{'+-'[not row.holds_sd]}" for row in rows)
        print(f"{index} ({100 * rows[0].scatter:g} %, {rows[0].used} used):{held}", flush=True)
    print("\n".join(tables(read(path, Counted))))


if __name__ == "__main__":
    main()
