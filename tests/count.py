"""Size of the house: ``python -m tests.count``, for each package of ``fibrefit/``.

Prints files, lines, lines of code (no docstring, comment or blank line), functions, private functions that one other
place of their file names, private functions in all, and deciding numbers (module-level names in capitals that hold a
number). ``--lower`` writes what has become less into ``house_budget.json``, which `test_house.py` holds the code
against; ``--raise PACKAGE QUANTITY "WHAT IT BOUGHT"`` writes down one that has become more, with its reason.
"""

from __future__ import annotations

import argparse
import ast
import collections
import io
import json
import pathlib
import tokenize
from typing import NamedTuple


class Count(NamedTuple):
    """Of a package: files, lines, lines of code, functions, private functions with one caller, deciding numbers."""

    files: int
    lines: int
    code: int
    functions: int
    single: int
    private: int
    numbers: int


def _documented(tree: ast.AST) -> set[int]:
    """Lines of docstrings, those below a constant or a field among them."""
    lines: set[int] = set()
    for node in ast.walk(tree):
        for body in (getattr(node, "body", None),):
            if isinstance(body, list):
                for one in body:
                    if (
                        isinstance(one, ast.Expr)
                        and isinstance(one.value, ast.Constant)
                        and isinstance(one.value.value, str)
                    ):
                        lines.update(range(one.lineno, (one.end_lineno or one.lineno) + 1))
    return lines


def _coded(text: str) -> set[int]:
    """Lines that hold a token that is neither comment nor end of line."""
    skip = {
        tokenize.COMMENT,
        tokenize.NL,
        tokenize.NEWLINE,
        tokenize.INDENT,
        tokenize.DEDENT,
        tokenize.ENDMARKER,
        tokenize.ENCODING,
    }
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in skip:
            lines.update(range(token.start[0], token.end[0] + 1))
    return lines


def _number(node: ast.AST) -> bool:
    return any(
        isinstance(x, ast.Constant) and isinstance(x.value, (int, float)) and not isinstance(x.value, bool)
        for x in ast.walk(node)
    )


def counts(root: pathlib.Path) -> dict[str, Count]:
    """Counts by package."""
    sums: dict[str, list[int]] = collections.defaultdict(lambda: [0] * 7)
    for path in sorted((root / "fibrefit").rglob("*.py")):
        parts = path.relative_to(root / "fibrefit").parts
        name = parts[0] if len(parts) > 1 else "."
        text = path.read_text(encoding="utf-8")
        tree = ast.parse(text)
        defs = [n for n in ast.walk(tree) if isinstance(n, (ast.FunctionDef, ast.AsyncFunctionDef))]
        used = collections.Counter(
            n.id if isinstance(n, ast.Name) else n.attr
            for n in ast.walk(tree)
            if isinstance(n, (ast.Name, ast.Attribute))
        )
        private = [d.name for d in defs if d.name.startswith("_") and not d.name.startswith("__")]
        row = sums[name]
        row[0] += 1
        row[1] += text.count("\n")
        row[2] += len(_coded(text) - _documented(tree))
        row[3] += len(defs)
        row[4] += sum(used[one] == 1 for one in private)
        row[5] += len(private)
        row[6] += sum(
            isinstance(one, (ast.Assign, ast.AnnAssign))
            and one.value is not None
            and _number(one.value)
            and all(
                t.id.isupper()
                for t in (one.targets if isinstance(one, ast.Assign) else [one.target])
                if isinstance(t, ast.Name)
            )
            and any(isinstance(t, ast.Name) for t in (one.targets if isinstance(one, ast.Assign) else [one.target]))
            for one in tree.body
        )
    return {name: Count(*row) for name, row in sums.items()}


BUDGET = pathlib.Path(__file__).with_name("house_budget.json")
HELD = ("files", "code", "single", "numbers")
"""What a package may not have more of than its budget says."""


class Budget(NamedTuple):
    """What packages may hold, by package and quantity, and for each figure that was raised what that bought."""

    packages: dict[str, dict[str, int]]
    raised: list[dict[str, str | int]]

    @classmethod
    def of(cls, text: str) -> Budget:
        """From the text of the file."""
        return cls(**json.loads(text))

    def exceeded(self, found: dict[str, Count]) -> list[str]:
        """A line for each figure beyond its budget; a package without one may hold nothing."""
        limits = {name: self.packages.get(name, dict.fromkeys(HELD, 0)) for name in found}
        return [
            f"{name}: {what} {getattr(one, what)}, budget {limits[name][what]}"
            for name, one in found.items()
            for what in HELD
            if getattr(one, what) > limits[name][what]
        ]

    def unexplained(self, before: Budget) -> list[str]:
        """A line for each figure above that of an earlier budget for which no new reason is given."""
        reasons = [one for one in self.raised if one not in before.raised and str(one["bought"]).strip()]
        explained = {(one["package"], one["quantity"], one["to"]) for one in reasons}
        return [
            f"{name}: {what} from {before.packages.get(name, {}).get(what, 0)} to {figure}"
            for name, figures in self.packages.items()
            for what, figure in figures.items()
            if figure > before.packages.get(name, {}).get(what, 0) and (name, what, figure) not in explained
        ]

    def write(self) -> None:
        """As the file: a package a line."""
        rows = ",\n".join(
            f"    {json.dumps(name)}: {json.dumps(self.packages[name])}" for name in sorted(self.packages)
        )
        raised = ",\n".join(f"    {json.dumps(one, ensure_ascii=False)}" for one in self.raised)
        text = f'{{\n  "packages": {{\n{rows}\n  }},\n  "raised": [{raised and f"{chr(10)}{raised}{chr(10)}  "}]\n}}\n'
        BUDGET.write_text(text, encoding="utf-8")


def _lowered(found: dict[str, Count]) -> Budget:
    """The budget with every figure that has become less, and without packages that are gone."""
    now = {name: {what: getattr(one, what) for what in HELD} for name, one in found.items()}
    if not BUDGET.exists():
        return Budget(now, [])
    old = Budget.of(BUDGET.read_text(encoding="utf-8"))
    kept = {
        name: {what: min(figure, old.packages[name][what]) for what, figure in figures.items()}
        for name, figures in now.items()
        if name in old.packages
    }
    return old._replace(packages=kept)


def _raised(found: dict[str, Count], package: str, quantity: str, bought: str) -> Budget:
    """The budget with one figure as it is now, and what that bought."""
    old, figure = Budget.of(BUDGET.read_text(encoding="utf-8")), getattr(found[package], quantity)
    figures = old.packages.get(package, dict.fromkeys(HELD, 0)) | {quantity: figure}
    reason: dict[str, str | int] = {"package": package, "quantity": quantity, "to": figure, "bought": bought}
    return Budget(old.packages | {package: figures}, [*old.raised, reason])


def main(arguments: list[str] | None = None) -> None:
    """Print the counts; lower or raise the budget if asked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("root", nargs="?", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parents[1])
    parser.add_argument("--lower", action="store_true", help="write what has become less into the budget")
    parser.add_argument("--raise", nargs=3, dest="more", metavar=("PACKAGE", "QUANTITY", "BOUGHT"))
    wanted = parser.parse_args(arguments)
    found = counts(wanted.root)
    if wanted.lower:
        _lowered(found).write()
    if wanted.more:
        _raised(found, *wanted.more).write()
    print(f"{'package':12}" + "".join(f"{head:>10}" for head in Count._fields))
    for name, one in sorted(found.items(), key=lambda item: -item[1].code):
        print(f"{name:12}" + "".join(f"{figure:10d}" for figure in one))
    print(f"{'all':12}" + "".join(f"{sum(figures):10d}" for figures in zip(*found.values(), strict=True)))


if __name__ == "__main__":
    main()
