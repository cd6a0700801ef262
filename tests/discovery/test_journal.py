"""The journal of a search: what is done is not done twice, and nothing but results is ever read."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fibrefit.discovery.engine.journal import Journal, digest
from fibrefit.discovery.engine.refit import Refit

RESULT = Refit(np.arange(6.0).reshape(2, 3), 1.5)


class Counted:
    """A job that tells how often it was done."""

    def __init__(self, result: Any) -> None:
        self.result, self.times = result, 0

    def __call__(self) -> Any:
        self.times += 1
        return self.result


def test_a_job_is_done_once(tmp_path: Path) -> None:
    job = Counted(RESULT)
    first, again = (Journal(tmp_path).recall("key", job) for _ in range(2))
    assert job.times == 1
    assert np.array_equal(first.local, again.local)
    assert again.cost == 1.5


def test_other_keys_are_other_jobs(tmp_path: Path) -> None:
    journal, job = Journal(tmp_path), Counted(RESULT)
    journal.recall("one", job)
    journal.recall("two", job)
    assert job.times == 2


def test_without_a_folder_nothing_is_kept() -> None:
    job = Counted(RESULT)
    Journal().recall("key", job)
    Journal().recall("key", job)
    assert job.times == 2


def test_what_has_a_name_is_found_again(tmp_path: Path) -> None:
    model = object()
    journal = Journal(tmp_path, lambda thing: "model" if thing is model else None, {"model": model}.__getitem__)
    journal.recall("key", Counted((model, 1.0)))
    assert journal.recall("key", Counted(None)) == (model, 1.0)


MODULE = b"fibrefit.discovery.search.screen"
FEWER = b"\x80\x04\x8c" + bytes([len(MODULE)]) + MODULE + b"\x8c\x09Elsewhere\x93)\x81."
"""A tuple with names that is made of nothing, as of a version in which it had other fields."""


@pytest.mark.parametrize("damage", [b"", b"\x80", b"nonsense", pickle.dumps(Path("/")), FEWER])
def test_a_damaged_entry_is_done_again(tmp_path: Path, damage: bytes) -> None:
    job = Counted(RESULT)
    (tmp_path / "key.job").write_bytes(damage)
    assert Journal(tmp_path).recall("key", job).cost == 1.5
    assert job.times == 1
    Journal(tmp_path).recall("key", job)
    assert job.times == 1


class Evil:
    """What a file of somebody else might hold."""

    def __reduce__(self) -> tuple[Any, ...]:
        return (Path.touch, (Path("touched"),))


def test_nothing_of_a_file_is_carried_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "key.job").write_bytes(pickle.dumps(Evil()))
    assert Journal(tmp_path).recall("key", Counted(RESULT)).cost == 1.5
    assert not (tmp_path / "touched").exists()
    # The negative control: a reader that allows everything does what the file says.
    pickle.loads(pickle.dumps(Evil()))
    assert (tmp_path / "touched").exists()


def through_ours(name: str) -> bytes:
    """A file that calls something by a name one of our modules knows, with a path made by another of them."""

    def known(word: str) -> bytes:
        parts = (b"\x8c" + bytes([len(text)]) + text.encode() for text in ("fibrefit.discovery.engine.journal", word))
        return b"".join(parts) + b"\x93"

    place = known("Path") + b"\x8c\x07touched\x85R"
    return b"\x80\x04" + known(name) + place + b"\x85R."


@pytest.mark.parametrize("name", ["Path.touch", "Path", "Journal.recall", "os.mkdir"])
def test_our_modules_lead_nowhere_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """They know classes of others, and a name with dots leads on from there."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "key.job").write_bytes(through_ours(name))
    assert Journal(tmp_path).recall("key", Counted(RESULT)).cost == 1.5
    assert not (tmp_path / "touched").exists()


def test_a_folder_that_is_gone_costs_the_journal_only(tmp_path: Path) -> None:
    assert Journal(tmp_path / "gone").recall("key", Counted(RESULT)).cost == 1.5


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (("a", "b"), ("ab",)),
        ((np.zeros(2),), (np.zeros(3),)),
        ((np.zeros(2),), (np.zeros((2, 1)),)),
        ((np.zeros(2),), (np.zeros(2, dtype=np.float32),)),
        ((["a"], "b"), (["a", "b"],)),
        ((1.0,), (1,)),
        ((np.array([1.0]),), (np.array([np.nextafter(1.0, 2.0)]),)),
    ],
)
def test_digests_differ_where_anything_does(one: tuple, other: tuple) -> None:
    assert digest(*one) == digest(*one)
    assert digest(*one) != digest(*other)
