"""Files of outcomes, one row a case, written as soon as a case is done and never again; and tables out of them.

``python -m tests.validation.tables FILE ...`` prints tables that ``journal/tables`` keeps.
"""

from __future__ import annotations

import csv
import dataclasses
import math
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

from scipy.stats import beta

ROOT = Path(__file__).resolve().parents[2]
JOURNAL = Path(__file__).parent / "journal" / "tables"
"""Tables of the releases that docs/ rests on; written anew by the runners with ``--document``."""
Row = TypeVar("Row")


@dataclass(frozen=True)
class Share:
    """A number of hits among cases, with its 95 % interval by Clopper and Pearson."""

    hits: int
    cases: int

    @classmethod
    def of(cls, rows: Iterable[Row], hit: Callable[[Row], bool]) -> Share:
        """Share of the rows for which `hit` holds."""
        found = [bool(hit(row)) for row in rows]
        return cls(sum(found), len(found))

    @property
    def interval(self) -> tuple[float, float]:
        """Lower and upper end, 0 to 1."""
        low = float(beta.ppf(0.025, self.hits, self.cases - self.hits + 1)) if self.hits else 0.0
        high = float(beta.ppf(0.975, self.hits + 1, self.cases - self.hits)) if self.hits < self.cases else 1.0
        return low, high

    def __str__(self) -> str:
        if not self.cases:
            return "no case"
        low, high = self.interval
        percent = 100.0 * self.hits / self.cases
        return f"{percent:.1f} % ({self.hits} of {self.cases}; {100 * low:.1f} to {100 * high:.1f} %)"


@dataclass(frozen=True)
class Table:
    """A table of outcomes.

    Parameters
    ----------
    heads : of the columns
    rows : cells as they are printed
    """

    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    @classmethod
    def of(cls, heads: Iterable[str], rows: Iterable[Iterable[object]]) -> Table:
        """Table of cells of any kind."""
        return cls(tuple(heads), tuple(tuple(map(str, row)) for row in rows))

    @classmethod
    def kept(cls, path: Path) -> Table:
        """Table of a CSV file."""
        with path.open(newline="", encoding="utf-8") as file:
            heads, *rows = csv.reader(file)
        return cls.of(heads, rows)

    def keep(self, path: Path) -> None:
        """Write the table as CSV."""
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows([self.heads, *self.rows])

    def lines(self) -> list[str]:
        """Lines of Markdown."""
        rule = "|" + "---|" * len(self.heads)
        return [_line(self.heads), rule, *map(_line, self.rows)]


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def printed(tables: Mapping[str, Table]) -> str:
    """Tables one below the other, each under its name."""
    return "\n".join(line for name, one in tables.items() for line in (f"### {name}", "", *one.lines(), ""))


def read(path: Path, kind: type[Row]) -> list[Row]:
    """Rows of a file of outcomes; none where there is no file."""
    if not path.is_file():
        return []
    casts: dict[str, Callable[[str], Any]] = {"float": float, "int": int, "bool": lambda text: text == "True"}
    types = {f.name: casts.get(str(f.type), str) for f in dataclasses.fields(kind)}  # type: ignore[arg-type]
    with path.open(newline="", encoding="utf-8") as file:
        return [kind(**{key: types[key](text) for key, text in row.items()}) for row in csv.DictReader(file)]


def append(path: Path, row: Any, key: str) -> None:
    """Write one more outcome down.

    Raises
    ------
    ValueError
        If the file has one of the same case: only first outcomes count, a new release draws new cases.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    if any(getattr(other, key) == getattr(row, key) for other in read(path, type(row))):
        raise ValueError(f"{path.name} has an outcome of {getattr(row, key)}; for another one, name another release")
    new = not path.is_file()
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [f.name for f in dataclasses.fields(row)])
        if new:
            writer.writeheader()
        writer.writerow(dataclasses.asdict(row))


@lru_cache(maxsize=1)
def revision() -> str:
    """Revision of the program that is validated."""
    found = subprocess.run(
        ["git", "describe", "--always", "--dirty"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    return found.stdout.strip() or "unknown"


def median(values: Iterable[float]) -> float:
    """Median of the finite ones; nan where there is none."""
    known = sorted(value for value in values if math.isfinite(value))
    if not known:
        return math.nan
    middle = len(known) // 2
    return known[middle] if len(known) % 2 else 0.5 * (known[middle - 1] + known[middle])


if __name__ == "__main__":
    print(printed({Path(name).stem: Table.kept(Path(name)) for name in sys.argv[1:]}))
