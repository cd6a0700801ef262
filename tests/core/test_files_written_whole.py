"""Single files are written whole or not at all."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from fibrefit.core.paths import sha256_of, whole, write_whole


def test_text_is_utf8_and_replaces(tmp_path: Path) -> None:
    path = tmp_path / "a"
    write_whole(path, "old")
    write_whole(path, "ρ")
    assert path.read_bytes() == "ρ".encode()
    assert list(tmp_path.iterdir()) == [path]


def test_a_failure_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "a"
    write_whole(path, "old")
    with pytest.raises(ZeroDivisionError), whole(path) as temporary:
        temporary.write_text("half")
        raise ZeroDivisionError
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_digest(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"content")
    assert sha256_of(tmp_path / "a") == hashlib.sha256(b"content").hexdigest()
