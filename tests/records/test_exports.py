"""Exports of laboratory software with known truth: read right, or refused with the cause; never wrong in silence."""

from __future__ import annotations

import pytest

from tests.records.exports import KINDS, NOT_MET
from tests.records.exports.outcome import CLEAR, RIGHT, differences, outcome


def test_names_are_distinct() -> None:
    for exports in KINDS.values():
        assert len({export.name for export in exports}) == len(exports)
    assert sum(map(len, KINDS.values())) >= 2000
    assert {export.name for exports in KINDS.values() for export in exports} >= NOT_MET


@pytest.mark.parametrize("kind", KINDS)
def test_a_set(kind: str, tmp_path) -> None:
    failed = []
    for export in KINDS[kind]:
        what, said = outcome(export, tmp_path)
        met = what in ((RIGHT,) if export.refused is None else (RIGHT, CLEAR))
        if met == (export.name in NOT_MET):
            failed.append(
                f"{export.name}: {what}: {said}" if not met else f"{export.name}: is met, and stands in NOT_MET"
            )
    assert not failed, "\n".join(failed)


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
