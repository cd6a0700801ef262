"""What becomes of an export: right, refused clearly or not, wrong in silence, or a fault."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from fibrefit.core.errors import FibrefitError
from fibrefit.records import Record, joined, read_record, side_by_side
from tests.records.exports.base import Export

RIGHT, CLEAR, UNCLEAR, WRONG, FAULT = "right", "clear refusal", "unclear refusal", "silently wrong", "fault"
NOTED = "wrong, with a remark"
"""What a record is that quotes, as not understood, the words by which it was to be told."""


def written(export: Export, folder: Path) -> Path:
    path = folder / f"{re.sub(r'[^A-Za-z0-9]+', '_', export.name)[:60]}{export.suffix}"
    if callable(export.content):
        export.content(path)
    else:
        path.write_bytes(export.content)
    return path


def read(export: Export, path: Path, **more: Any) -> Record:
    """The record of an export, with the files that belong to it."""

    def other(name: str, text: str) -> Path:
        file = path.with_name(f"{path.stem}_{name}")
        file.write_text(text)
        return file

    options = {**export.options, **more}
    if export.header is not None:
        options["header"] = other(*export.header)
    files = [path, *(other(f"part{i}{export.suffix}", text) for i, text in enumerate(export.parts, 2))]
    record = joined([read_record(file, **options) for file in files])
    if export.beside is None:
        return record
    text, offset = export.beside
    return side_by_side(record, read_record(other(f"beside{export.suffix}", text)), offset)


def differences(export: Export, record: Record) -> list[str]:
    """What a record holds that is not the truth."""
    found = [f"a {role} out of nothing" for role in export.absent if role in record.channels]
    times = export.time - export.time[0]
    if (
        len(record) > len(times)
        or not np.isin(np.round((record.time - record.time[0]) * 1e7), np.round(times * 1e7)).all()
    ):
        read = record.time - record.time[0]
        if len(record) != len(times) or np.abs(read - times).max() > export.atol_time:
            found.append(f"times: {len(record)} from {record.time[:3]}")
    for role, truth in (("force", export.force), ("position", export.position)):
        if truth is None:
            continue
        if role not in record.channels:
            found.append(f"no {role}")
            continue
        rows = np.searchsorted(0.5 * (times[1:] + times[:-1]), record.time - record.time[0])
        expected = truth[rows]
        valid = record.valid[role]
        if valid.mean() < export.valid or not np.allclose(
            record.channels[role][valid], expected[valid], rtol=export.rtol, atol=1e-12
        ):
            found.append(f"{role}: {record.channels[role][:3]} for {expected[:3]}, {valid.mean():.0%} valid")
    return found


def outcome(export: Export, folder: Path) -> tuple[str, str]:
    """Kind of the outcome, and what was said."""
    path = written(export, folder)
    try:
        record = read(export, path)
    except FibrefitError as error:
        return (CLEAR if _is_clear(export, path, error) else UNCLEAR), str(error)
    except Exception as error:  # what must not happen
        return FAULT, f"{type(error).__name__}: {error}"
    wrong = differences(export, record)
    said = "; ".join(wrong)
    noted = export.refused is not None and any(
        note.startswith("Not understood") and re.search(export.refused, note, re.I) for note in record.history
    )
    return (RIGHT if not wrong else NOTED if noted else WRONG), said


def _is_clear(export: Export, path: Path, error: FibrefitError) -> bool:
    """Whether a refusal names its cause, and what it asks for leads to the record."""
    said = str(error)
    if export.refused is None or not (error.do or error.expected) or not re.search(export.refused, said, re.I):
        return False  # what need not be refused is not refused clearly
    return export.remedy is None or _leads(export, path, export.remedy)


def _leads(export: Export, path: Path, remedy: dict[str, Any]) -> bool:
    try:
        return not differences(export, read(export, path, **remedy))
    except Exception:
        return False


def counted(kinds: dict[str, list[Export]], folder: Path, show: bool = True) -> Counter[str]:
    total: Counter[str] = Counter()
    for kind, exports in kinds.items():
        own: Counter[str] = Counter()
        for export in exports:
            what, said = outcome(export, folder)
            own[what] += 1
            if show and what != RIGHT:
                print(f"{what.upper():16} {kind}: {export.name}: {said[:330]}")
        print(f"== {kind}: {len(exports)}: {dict(own)}")
        total += own
    return total


if __name__ == "__main__":
    import sys
    import tempfile

    from tests.records.exports import KINDS

    kinds = {kind: KINDS[kind] for kind in sys.argv[1:]} or KINDS
    with tempfile.TemporaryDirectory() as folder:
        total = counted(kinds, Path(folder))
    print(sum(total.values()), dict(total))
