"""Tests of extras: which they are, that `make test-extras` installs what they need, and that none is passed over."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from tests.extras import REQUIRED, need

ROOT = Path(__file__).resolve().parent.parent
MARKED, SKIPPED = (
    {
        name
        for path in (ROOT / "tests").rglob("test_*.py")
        for name in re.findall(rf'\b{words}\("(\w+)"', path.read_text(encoding="utf-8"))
    }
    for words in (r"mark\.extra", "importorskip")
)


def test_the_target_installs_what_marked_tests_need_and_nothing_else_is_passed_over() -> None:
    (target,) = re.findall(r"^test-extras:(.*)\n\t(.*)", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    installed, with_test = (
        {re.split(r"[^\w-]", one)[0].lower() for name in names for one in extras[name]}
        for names in (set(re.findall(r"installed-(\w+)", target[0])) - {"test"}, ("test", "docs"))
    )
    assert installed == MARKED
    assert f"{REQUIRED}=" in target[1]
    assert target[1].endswith("pytest -m extra")
    assert not MARKED & SKIPPED
    assert {name.replace("_", "-") for name in SKIPPED} <= with_test


def test_a_missing_package_is_a_failure_where_it_is_required(monkeypatch: pytest.MonkeyPatch) -> None:
    need("pytest")
    monkeypatch.delenv(REQUIRED, raising=False)
    with pytest.raises(pytest.skip.Exception, match="no_such_package"):
        need("no_such_package")
    monkeypatch.setenv(REQUIRED, "1")
    need("pytest")
    with pytest.raises(pytest.fail.Exception, match="no_such_package"):
        need("no_such_package")
