"""Names of files for records: what a person would guess, and no two alike."""

from __future__ import annotations

import pytest

from fibrefit.core.paths import record_stems


@pytest.mark.parametrize(
    ("names", "stems"),
    [
        (["drop_5mm_90deg.csv", "drop 10 mm.csv", "Čeština.parquet"], ["drop_5mm_90deg", "drop 10 mm", "Čeština"]),
        (["drop_1.5", "drop_1.7"], ["drop_1.5", "drop_1.7"]),
        (["monday/drop.csv", "tuesday/drop.csv"], ["monday_drop", "tuesday_drop"]),
        (["a.csv", "A.csv", "a.txt"], ["a", "A_2", "a_3"]),
        (
            ["../../evil", "/etc/evil.csv", ".", "..", "x" * 300],
            ["_.._evil", "_etc_evil", "record", "record_2", "x" * 80],
        ),
    ],
)
def test_each_record_has_a_file_of_its_own(names: list[str], stems: list[str]) -> None:
    found = record_stems(names)
    assert len({stem.casefold() for stem in found}) == len(names)
    assert not any("/" in stem for stem in found)
    assert found == stems
