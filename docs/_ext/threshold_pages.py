"""Every number that decides what anybody is told: its value and its meaning, from the files it stands in."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

FLOORS = {
    "records": "Reading files",
    "study": "Reading studies",
    "rigs": "Rigs",
    "problem": "Noise and errors of inputs",
    "fitting": "Fits",
    "discovery.engine": "Searches",
    "discovery.residuals": "Tests of the innovations",
    "discovery.design": "Plans, and what records distinguish",
    "sampling": "Posteriors",
    "series": "Series",
    "workflow": "Commands",
    "report.sentences": "Words of a report",
}
BEGINNING = """# Numbers that decide

Every number that a verdict, a check or a sentence hangs on, as it stands in the code: this page is made from it. A
test moves each of them and sees what it decides change. Numbers that say only how a search goes on, where an
iteration ends or what has room on a page are listed with their reasons in `tests/tolerances.py`.

"""


class Threshold(NamedTuple):
    """A number with a name, as the code has it, and its meaning."""

    name: str
    value: str
    meaning: str


def thresholds_in(source: str) -> Iterator[Threshold]:
    """Numbers with names in a module; those that follow each other share the meaning below the last of them."""
    waiting: list[tuple[str, str]] = []
    for node in ast.parse(source).body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name | ast.Tuple):
            waiting += [pair for pair in _pairs(node.targets[0], node.value) if pair[0].isupper()]
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            meaning = " ".join(node.value.value.split())
            yield from (Threshold(name, value, meaning) for name, value in waiting)
            waiting = []
    yield from (Threshold(name, value, "") for name, value in waiting)


def _pairs(target: ast.expr, value: ast.expr) -> Iterator[tuple[str, str]]:
    """Names with their values, of one assignment."""
    if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
        for one, its in zip(target.elts, value.elts, strict=True):
            yield from _pairs(one, its)
    elif isinstance(target, ast.Name):
        yield target.id, ast.unparse(value)


def files_of(package: Path) -> dict[str, list[Path]]:
    """Files of thresholds by the floor they are of; how far a search looks stands in a file beside its thresholds."""
    found: dict[str, list[Path]] = {}
    for path in sorted(package.rglob("thresholds.py")):
        floor = ".".join(path.parent.relative_to(package).parts)
        found[floor] = [path, *path.parent.glob("effort.py")]
    return found


def threshold_page(package: Path) -> str:
    """Page of all numbers that decide."""
    files, lines = files_of(package), [BEGINNING]
    for floor, title in FLOORS.items():
        lines += [f"## {title}", "", "| number | value | meaning |", "|---|---|---|"]
        for path in files[floor]:
            for one in thresholds_in(path.read_text(encoding="utf-8")):
                meaning = one.meaning.replace("|", "\\|")
                lines.append(f"| `{one.name}` | `{one.value}` | {meaning} |")
        lines.append("")
    return "\n".join(lines)
