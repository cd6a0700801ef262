"""A table of results as Markdown."""

from __future__ import annotations

from typing import NamedTuple

from tests.benchmarks.timing import Times, spoken


class Table(NamedTuple):
    """A titled table with a sentence on what was timed."""

    title: str
    note: str
    headings: tuple[str, ...]
    rows: list[tuple[str, ...]]

    def text(self) -> str:
        """Markdown."""
        lines = [f"## {self.title}", "", self.note, "", _line(self.headings), _line(["---"] * len(self.headings))]
        return "\n".join([*lines, *map(_line, self.rows), ""])


def _line(cells: tuple[str, ...] | list[str]) -> str:
    return f"| {' | '.join(cells)} |"


def against(what: str, ours: Times, theirs: Times, goal: str) -> tuple[str, ...]:
    """Row of two medians and how many times longer ours takes."""
    return what, spoken(ours.median), spoken(theirs.median), f"{ours.median / theirs.median:.1f}", goal
