"""The examples in the docstrings of what is offered in Python are true."""

from __future__ import annotations

import doctest
import importlib
import inspect
import re
from collections.abc import Iterator
from functools import cache
from itertools import takewhile
from pathlib import Path
from typing import Any

import pytest

import fibrefit
from fibrefit.laws.law import quantity
from fibrefit.records import Record
from fibrefit.series.sweep import SweptCurve

API = (Path(__file__).resolve().parents[1] / "docs" / "api.md").read_text(encoding="utf-8")
CLASSES = re.findall(r"autoclass:: ([\w.]+)\n   :members:", API)
INTERNAL = {"write", "write_data", "first_figures"}
"""Parts of `save` that the page leaves out."""
COMMON = {"AnyResult", "Saved", "FoundResult", "Predicts", "Shown", "dict"}
"""Classes whose members are not repeated in those that are made of them."""


@cache
def given() -> dict[str, Any]:
    """What the page of the Python interface says that its examples are given."""
    lines = re.search(r"In the examples.*?```python\n(.*?)```", API, re.DOTALL)
    assert lines is not None
    found: dict[str, Any] = {}
    exec(lines[1], found)
    return found


def members() -> Iterator[tuple[str, Any]]:
    """Every method and property that the page shows, by where its docstring stands."""
    for path in CLASSES:
        module, _, name = path.rpartition(".")
        of = getattr(importlib.import_module(module), name)
        own = takewhile(lambda one: one is of or one.__name__ not in COMMON, of.__mro__)  # noqa: B023
        for member, held in ((member, held) for one in own for member, held in vars(one).items()):
            function = getattr(held, "fget", None) or getattr(held, "func", held)
            if inspect.isfunction(function) and not member.startswith("_") and member not in INTERNAL:
                yield f"{name}.{member}", function


LONG = ("batch", "discover", "distinguish", "plan", "predict", "read_batch", "sample", "series_of", "simulate", "sweep")
"""Functions whose examples take longer than those of all others together."""
OTHER_NAMES = ("confuse",)
"""The same functions by a name they had before."""
MEMBERS = dict(members())
EXPLAINED = {
    name: function
    for name, function in MEMBERS.items()
    if name.startswith("AnyResult.") or len(inspect.signature(function).parameters) > 1
}
"""What every result offers, and whatever takes arguments."""


def examples_of(thing: Any, name: str, given: dict[str, Any] | None = None) -> list[doctest.DocTest]:
    finder = doctest.DocTestFinder(recurse=False)
    return finder.find(thing, name, module=False, globs={"fibrefit": fibrefit} | (given or {}))


def carried_out(tests: list[doctest.DocTest], folder: Path, monkeypatch: pytest.MonkeyPatch) -> doctest.TestResults:
    monkeypatch.chdir(folder)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.FAIL_FAST)
    for test in tests:
        runner.run(test)
    return runner.summarize(verbose=False)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow) if name in LONG else name
        for name in fibrefit.__all__
        if name not in OTHER_NAMES
    ],
)
def test_the_example_is_true(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    offered = getattr(fibrefit, name)
    function = offered if inspect.isfunction(offered) else type(offered).__call__
    found = carried_out(examples_of(function, name), tmp_path, monkeypatch)
    assert found.attempted >= 1
    assert found.failed == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(EXPLAINED))
def test_the_example_of_a_method_is_true(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = carried_out(examples_of(EXPLAINED[name], name, given()), tmp_path, monkeypatch)
    assert found.attempted >= 1
    assert found.failed == 0


@pytest.mark.parametrize("name", sorted(EXPLAINED))
def test_a_method_says_what_it_takes_and_returns(name: str) -> None:
    said = inspect.getdoc(EXPLAINED[name]) or ""
    taken = [one for one in inspect.signature(EXPLAINED[name]).parameters if one != "self"]
    assert "Parameters\n---" in said or not taken
    assert all(one in said.partition("Returns\n---")[0] for one in taken)
    assert "Returns\n---" in said or name == "AnyResult.status"


@pytest.mark.slow
@pytest.mark.parametrize("shown", [Record, SweptCurve])
def test_the_example_of_a_class_is_true(shown: type, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = carried_out(examples_of(shown, shown.__name__, given()), tmp_path, monkeypatch)
    assert found.attempted >= 2
    assert found.failed == 0


def test_the_example_of_a_law_of_ones_own_is_true(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = carried_out(examples_of(quantity, "quantity"), tmp_path, monkeypatch)
    assert (found.attempted, found.failed) == (2, 0)


def test_the_example_of_the_package_is_true(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = carried_out(examples_of(fibrefit, "fibrefit"), tmp_path, monkeypatch)
    assert found.attempted > 4
    assert found.failed == 0


def test_a_false_example_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def wrong() -> None:
        """Say what is not so.

        >>> fibrefit.load_study(fibrefit.example("drop_series")).name
        'another'
        """

    assert carried_out(examples_of(wrong, "wrong"), tmp_path, monkeypatch).failed == 1
