"""Exports of laboratory software with known truth: read right, or refused with the cause; never wrong in silence."""

from __future__ import annotations

import pytest

from tests.records.exports import KINDS
from tests.records.exports.base import Export
from tests.records.exports.outcome import CLEAR, RIGHT, differences, outcome
from tests.records.exports.rounds import NOT_MET

EXPORTS = [(kind, export) for kind, exports in KINDS.items() for export in exports]


def test_names_are_distinct() -> None:
    for exports in KINDS.values():
        assert len({export.name for export in exports}) == len(exports)
    assert len(EXPORTS) >= 300


@pytest.mark.parametrize(("kind", "export"), EXPORTS, ids=lambda part: getattr(part, "name", part))
def test_export(kind: str, export: Export, tmp_path, request: pytest.FixtureRequest) -> None:
    if export.name in NOT_MET:
        request.applymarker(pytest.mark.xfail(strict=True))
    what, said = outcome(export, tmp_path)
    assert what in ((RIGHT,) if export.refused is None else (RIGHT, CLEAR)), f"{what}: {said}"


def test_a_wrong_reading_is_seen(tmp_path) -> None:
    from dataclasses import replace

    from fibrefit.records import read_record

    export = KINDS["text"][0]
    path = tmp_path / "a.csv"
    path.write_bytes(export.content)
    record = read_record(path)
    assert not differences(export, record)
    assert differences(replace(export, force=export.force + 0.001), record)
    assert differences(replace(export, time=export.time * 1.001), record)
    assert differences(replace(export, position=-export.position), record)
