"""The examples in the docstrings of what is offered in Python are true."""

from __future__ import annotations

import doctest
import inspect
from pathlib import Path
from typing import Any

import pytest

import fibrefit


def examples_of(thing: Any, name: str) -> list[doctest.DocTest]:
    finder = doctest.DocTestFinder(recurse=False)
    return finder.find(thing, name, module=False, globs={"fibrefit": fibrefit})


def carried_out(tests: list[doctest.DocTest], folder: Path, monkeypatch: pytest.MonkeyPatch) -> doctest.TestResults:
    monkeypatch.chdir(folder)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.FAIL_FAST)
    for test in tests:
        runner.run(test)
    return runner.summarize(verbose=False)


@pytest.mark.parametrize("name", fibrefit.__all__)
def test_the_example_is_true(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    offered = getattr(fibrefit, name)
    function = offered if inspect.isfunction(offered) else type(offered).__call__
    found = carried_out(examples_of(function, name), tmp_path, monkeypatch)
    assert found.attempted >= 1
    assert found.failed == 0


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
