"""The walk of a reader: each function once, every change of file counted."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.validation.walks import Length, Step, found, length, traced


def test_a_change_of_file_is_a_stay_and_a_return_where_it_was_read_before() -> None:
    inner = Step("b", "inner")
    top = Step("a", "top", [Step("a", "own"), inner, Step("a", "last"), Step("c", "end")])
    assert length(top) == Length(functions=5, files=3, stays=5, returns=2)
    assert length(inner) == Length(1, 1, 1, 0)
    assert found(top, "end").file == "c"
    with pytest.raises(LookupError):
        found(top, "nothing")


def test_a_function_is_read_where_it_is_first_called(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "walked_b.py").write_text("def helper():\n    return [x for x in range(2)]\n")
    (tmp_path / "walked_a.py").write_text(
        "from walked_b import helper\ndef start():\n    return helper(), second()\ndef second():\n    return helper()\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    import walked_a

    (start,) = traced(tmp_path, walked_a.start).calls
    assert [call.name for call in start.calls] == ["helper", "second"]
    assert length(start) == Length(functions=3, files=2, stays=3, returns=1)
    assert sys.getprofile() is None
